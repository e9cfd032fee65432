"""How well can spectra of a ride determine a bicycle at best? Cramer-Rao bounds of SYNTHETIC rides, by differences.

Fisher information of Whittle's likelihood (1953, Arkiv foer Matematik 2, 423-434): over the frequencies of a ride, the
sum of tr(S^-1 dS/da S^-1 dS/db), S the spectral matrix of the sampled channels. S is that of ``ride_generator``,
differenced; nothing of a fitter is used. Unknown beside the asked parameters are, in each leg, size, corner and damping
of every coloured input, the rider's gains and lags, and the noise of every channel.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.validation.ride_bicycle import RiddenBicycle
from tests.validation.ride_generator import SAMPLE, Colour, Leg, Real, Sensors, close_loop, spectrum

TYRES = tuple(
    f"relaxation_length.{key}.{wheel}"
    for key in ("cornering_stiffness", "relaxation_length")
    for wheel in ("rear", "front")
)
FRONT = ("front_compliance.stiffness", "front_compliance.damping")
LOWEST = 0.05  # Hz, below which a ride is not used
STEP_SHARE = 1e-4  # of a parameter, or of its prior sd, for central differences


@dataclass(frozen=True)
class Place:
    """A parameter that is moved: how it is put into a leg, its value and the step of its difference."""

    value: float
    step: float
    put: Callable[[Leg, Sensors, float], tuple[Leg, Sensors]]


def bounds(
    legs: Sequence[Leg], *, sensors: Sensors | None = None, asked: Sequence[str] = (*TYRES, *FRONT),
    prior_sd: Mapping[str, float] | None = None, duration: float = 300.0, lowest: float = LOWEST,
    place_unknown: bool = False, count: int = 1200,
) -> dict[str, float]:  # fmt: skip
    """Least standard deviations (SI) of the ``asked`` parameters from rides of ``duration`` s in each leg.

    ``prior_sd`` names further parameters that are unknown, with the standard uncertainty in which they are known
    beforehand; all others are known. ``place_unknown``: the height of the side force is unknown too. Frequencies from
    ``lowest`` (Hz) to half the sample rate are used, ``count`` of them and more where the loop resonates.
    """
    prior_sd, sensors = prior_sd or {}, sensors or Sensors()
    shared = [*asked, *(key for key in prior_sd if key not in asked)]
    size = len(shared)
    information = np.diag([prior_sd[key] ** -2 if key in prior_sd else 0.0 for key in shared])
    for leg in legs:
        places = [_of_bicycle(leg.bicycle, key, prior_sd.get(key)) for key in shared]
        own = _of_leg(leg, sensors, place_unknown=place_unknown)
        fisher = _fisher(leg, sensors, [*places, *own], duration, _frequencies(leg, lowest, count))
        # what a leg alone does not know is eliminated: Schur complement
        cross = fisher[:size, size:]
        information = information + fisher[:size, :size] - cross @ _solve(fisher[size:, size:], cross.T)
    spread = _solve(information, np.eye(size))
    return {key: float(np.sqrt(spread[k, k])) for k, key in enumerate(asked)}


def relative_bounds(legs: Sequence[Leg], **how: Any) -> dict[str, float]:
    """Bounds of :func:`bounds` as shares of the true values."""
    return {key: sd / abs(legs[0].bicycle.values[key]) for key, sd in bounds(legs, **how).items()}


def _solve(matrix: Real, right: Real) -> Real:
    """Solve a symmetric system whose unknowns have any units."""
    scale = 1 / np.sqrt(np.diag(matrix))
    return np.asarray(scale[:, None] * np.linalg.solve(matrix * np.outer(scale, scale), scale[:, None] * right))


def _of_bicycle(bicycle: RiddenBicycle, key: str, sd: float | None) -> Place:
    value = bicycle.values[key]

    def put(leg: Leg, sensors: Sensors, moved: float) -> tuple[Leg, Sensors]:
        values = {**leg.bicycle.values, key: moved}
        return replace(leg, bicycle=replace(leg.bicycle, values=values)), sensors

    return Place(value, STEP_SHARE * (abs(value) if sd is None else 10 * sd), put)


def _of_leg(leg: Leg, sensors: Sensors, *, place_unknown: bool) -> list[Place]:
    places = []
    for name, colours in leg.colours.items():
        for k, colour in enumerate(colours):
            keys = ("sd", "corner", "damping") if colour.damping else ("sd", "corner")
            places += [_of_colour(name, k, colour, key) for key in keys]
    if leg.rider:
        places += [_of_rider("gains", k, gain) for k, gain in enumerate(leg.rider.gains)]
        places += [_of_rider("lags", k, lag) for k, lag in enumerate(leg.rider.lags)]
    places += [_of_noise(channel, sensors.sd(channel)) for channel in sensors.channels]
    if place_unknown:
        places.append(_of_height(leg.bicycle.push_at))
    return places


def _of_colour(name: str, k: int, colour: Colour, key: str) -> Place:
    value = getattr(colour, key)

    def put(leg: Leg, sensors: Sensors, moved: float) -> tuple[Leg, Sensors]:
        some = list(leg.colours[name])
        some[k] = replace(some[k], **{key: moved})
        return replace(leg, colours={**leg.colours, name: tuple(some)}), sensors

    return Place(value, STEP_SHARE * value, put)


def _of_rider(what: str, k: int, value: float) -> Place:
    def put(leg: Leg, sensors: Sensors, moved: float) -> tuple[Leg, Sensors]:
        assert leg.rider is not None
        numbers = list(getattr(leg.rider, what))
        numbers[k] = moved
        return replace(leg, rider=replace(leg.rider, **{what: tuple(numbers)})), sensors

    return Place(value, STEP_SHARE * (abs(value) + (1.0 if what == "gains" else 0.0)), put)


def _of_noise(channel: str, value: float) -> Place:
    def put(leg: Leg, sensors: Sensors, moved: float) -> tuple[Leg, Sensors]:
        return leg, replace(sensors, noise={**sensors.noise, channel: moved})

    return Place(value, STEP_SHARE * value, put)


def _of_height(push_at: tuple[float, float]) -> Place:
    def put(leg: Leg, sensors: Sensors, moved: float) -> tuple[Leg, Sensors]:
        return replace(leg, bicycle=replace(leg.bicycle, push_at=(push_at[0], moved))), sensors

    return Place(push_at[1], 1e-3, put)


def _fisher(leg: Leg, sensors: Sensors, places: Sequence[Place], duration: float, omega: Real) -> Real:
    """Information (p, p) of one leg about parameters, from frequencies ``omega`` (m,) in rad/s."""

    def spectral(place: Place | None = None, step: float = 0.0) -> NDArray[Any]:
        moved, seen = place.put(leg, sensors, place.value + step) if place else (leg, sensors)
        loop = close_loop(moved.bicycle.motion(moved.speed), moved.colours, moved.rider)
        return spectrum(loop, seen, moved.bicycle.values["lam"], omega)

    whiten = np.linalg.inv(np.linalg.cholesky(spectral()))
    slopes = []
    for place in places:
        slope = (spectral(place, place.step) - spectral(place, -place.step)) / (2 * place.step)
        white = whiten @ slope @ whiten.conj().transpose(0, 2, 1)
        slopes.append(white.reshape(len(omega), -1))
    # the ride has duration / (2 pi) frequencies per rad/s
    weights = duration / (2 * np.pi) * np.gradient(omega)
    whole = np.array(slopes)
    return np.einsum("awi,bwi,w->ab", whole, whole.conj(), weights, optimize=True).real


def _frequencies(leg: Leg, lowest: float, count: int) -> Real:
    """Frequencies (rad/s) up to half the sample rate, close to each other where the loop resonates."""
    end = np.pi / SAMPLE
    grid = [np.geomspace(2 * np.pi * lowest, end, count)]
    for root in np.linalg.eigvals(leg.loop.matrix):
        if 0 < root.imag < end:
            grid.append(root.imag + abs(root.real) * np.linspace(-6, 6, 61))
    whole = np.unique(np.concatenate(grid))
    return np.asarray(whole[(whole >= 2 * np.pi * lowest) & (whole <= end)])
