"""Bicycles with riders whose unmeasured numbers are drawn, and the share of them that wobbles.

24 pairs: four packaged frames, both measured riders, three postures. A rider is seated by
:func:`bicycle.rider.rider_on_bicycle` and joined to the rear frame as one rigid body. Frames are those of sporting
bicycles, as nearly all of the reports: Pista (track), Fisher (mountain), Yellow, and the Davis bicycle, 20 kg heavier
with its instruments, which stands for a loaded touring bicycle. The city bicycles Browser and Crescendo are a
population of their own.

Each draw takes one of three measured tyres at one of three measured pressures, under the static loads.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle import Bicycle, Effect, Model, ModelFamily, effect_class, load_bicycle
from bicycle.effects import WHEELS
from bicycle.model import eigenvalues, frequency_hz
from bicycle.parameters import critical_damping, front_inertia
from bicycle.rider import SeatGeometry, packaged_geometry, read_geometry, read_rider, rider_on_bicycle
from studies.main_study import ASSUMED, LIMITS
from tyre import TyreMap
from tyre.ground import data_root

Array = NDArray[Any]
Ranges = Mapping[str, tuple[float, float]]

SPORTING = {"pista": "", "fisher": "", "rigid": "", "yellow": "YellowBenchmark.txt"}
CITY = {"browser": "", "crescendo": ""}
"""Name -> file in data/bicycle_text; empty: a packaged bicycle of that name."""
LIGHT = ("pista", "fisher", "yellow")  # without the instruments of the Davis bicycle
RIDERS = ("charlie", "jason")
POSTURES = {"upright": 16.0, "hoods": 45.0, "drops": 55.0}  # degrees, torso from the vertical
TYRES = ("Tyre1", "Tyre2", "Tyre3")
PRESSURES = (3.5e5, 5.5e5, 7.5e5)  # Pa, measured

SPEEDS = np.arange(0.5, 30.01, 0.5)  # m/s
WOBBLE_HZ = (LIMITS.wobble_hz, LIMITS.tyres_hz)  # weave is slower, the wheels' vibration on their tyres faster
GROWTH = LIMITS.growth  # 1/s
OFF, ON = (5.0, 15.0), (5.0, 22.0)  # m/s, between which wobble is counted, hands off and on
SLOW = LIMITS.hands_off  # m/s; growth at it is growth below it: nobody reports one there

EFFECTS = ("camber_thrust", "front_compliance", "pneumatic_trail", "relaxation_length", "rider_arms", "steer_damper",
           "twisting_torque")  # fmt: skip
OF_ARMS = ("arm_inertia", "arm_stiffness", "arm_damping")  # kg m^2, N m/rad, N m s/rad
RELAXED = {name: ASSUMED[name].usual for name in OF_ARMS}
TENSE = {name: ASSUMED[f"tense_{name}"].usual for name in OF_ARMS}
HANDS_OFF = dict.fromkeys(OF_ARMS, 0.0)


@dataclass(frozen=True, eq=False)
class Pair:
    """A bicycle with its rider."""

    name: str  # frame, rider and posture
    frame: str
    bicycle: Bicycle  # frame and rider as one rigid body
    seated: Any  # RiderOnBicycle, from rider_on_bicycle: body, segments, contacts


@dataclass(frozen=True, eq=False)
class Rival:
    """A further effect whose stiffness and damping are drawn; see ``rider_rivals``."""

    effect: type[Effect]
    ranges: Ranges  # of its parameters; ``*ratio`` is the share of critical damping of the parameter ``*damping``
    place: Callable[[Pair], dict[str, float]] = lambda pair: {}  # parameters that rider and frame give, SI
    # moment of inertia (kg m^2) or mass (kg) on each spring, by the beginning of its parameters' names
    inertia: Callable[[Pair], dict[str, float]] = lambda pair: {}

    def numbers(self, pair: Pair, drawn: Mapping[str, Any]) -> dict[str, Any]:
        """Every parameter by ``effect.name``, SI."""
        values: dict[str, Any] = {**self.place(pair), **drawn}
        for name in [name for name in drawn if name.endswith("ratio")]:
            begin = name.removesuffix("ratio")
            critical = critical_damping(drawn[f"{begin}stiffness"], self.inertia(pair)[begin])
            values[f"{begin}damping"] = values.pop(name) * critical
        return {f"{self.effect.identifier}.{name}": value for name, value in values.items()}


@dataclass(frozen=True, eq=False)
class Assumption:
    """Ranges from which every unmeasured number is drawn: logarithmically even, or even where the lower end is 0."""

    # front frame: ``stiffness`` N m/rad and ``damping_ratio`` or ``damping`` N m s/rad, ``height`` m of its hinge;
    # ``friction`` N m s/rad of the steering; ``camber_share`` 1/rad of the load, ``trail`` m and ``twisting``
    # N m/rad of both tyres; ``arm_*`` kg m^2, N m/rad, N m s/rad
    ranges: Ranges
    rivals: tuple[Rival, ...] = ()

    def with_ranges(self, **changes: tuple[float, float]) -> "Assumption":
        """The same with other ranges."""
        return replace(self, ranges={**self.ranges, **changes})

    def with_rivals(self, *rivals: Rival) -> "Assumption":
        """The same with further effects."""
        return replace(self, rivals=(*self.rivals, *rivals))


def at_values(numbers: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    """Ranges of no width."""
    return {name: (value, value) for name, value in numbers.items()}


@cache
def pairs(frames: tuple[str, ...] = tuple(SPORTING), riders: tuple[str, ...] = RIDERS) -> tuple[Pair, ...]:
    """Seat every rider on every frame in every posture."""
    files = SPORTING | CITY
    seated = []
    for frame in frames:
        path = data_root().joinpath("bicycle_text", files[frame])
        bare = load_bicycle(path if files[frame] else frame)
        for rider in riders:
            for posture in POSTURES:
                seated.append(seat(frame, bare, rider, posture))
    return tuple(seated)


def seat(frame: str, bare: Bicycle, rider: str, posture: str) -> Pair:
    """Seat a packaged rider; where no seat was measured it follows from the rider's legs."""
    packaged = packaged_geometry(frame)
    on_bicycle = rider_on_bicycle(
        bare,
        read_rider(rider),
        posture=posture,
        geometry=read_geometry(packaged, posture) if packaged else SeatGeometry(),
        torso_lean=np.radians(POSTURES[posture]),
    )
    bicycle = bare.replace(**on_bicycle.values, allow_unusual=True)
    return Pair(f"{frame} {rider} {posture}", frame, bicycle, on_bicycle)


def draw(ranges: Ranges, draws: int, rng: np.random.Generator) -> dict[str, Array]:
    """Draw each quantity (draws,); equal names get equal shares of their ranges, whatever the ranges are."""
    numbers = {}
    for name in sorted(ranges):
        low, high = ranges[name]
        share = rng.random(draws)
        numbers[name] = low * (high / low) ** share if low > 0 else low + (high - low) * share
    return numbers


def parameters(
    pair: Pair, drawn: Mapping[str, Any], tyre: tuple[Array, Array], loads: Sequence[float]
) -> dict[str, Any]:
    """Parameters (SI) of all effects but the rivals.

    ``drawn`` are the numbers of an :class:`Assumption`, ``tyre`` the place among TYRES and the pressure (Pa) of each
    draw, ``loads`` N of rear and front wheel.
    """
    p = pair.bicycle.values
    height = np.asarray(drawn["height"])
    joint_x = p["w"] + p["c"] - height * np.tan(p["lam"])
    numbers = {
        "front_compliance.stiffness": drawn["stiffness"],
        "front_compliance.joint_x": joint_x,
        "front_compliance.joint_z": -height,
        "front_compliance.axis_tilt": p["lam"],
        "steer_damper.damping": drawn["friction"],
        "pneumatic_trail.trail": drawn["trail"],
        "twisting_torque.twisting_stiffness": drawn["twisting"],
    }
    if "damping_ratio" in drawn:
        places = zip(joint_x, -height, strict=True)
        inertia = [front_inertia(p, joint_x=x, joint_z=z, axis_tilt=p["lam"]) for x, z in places]
        numbers["front_compliance.damping"] = drawn["damping_ratio"] * critical_damping(
            drawn["stiffness"], np.array(inertia)
        )
    else:
        numbers["front_compliance.damping"] = drawn["damping"]
    for wheel, load in zip(WHEELS, loads, strict=True):
        stiffness, length = tyre_numbers(*tyre, load)
        numbers[f"relaxation_length.cornering_stiffness.{wheel}"] = stiffness
        numbers[f"relaxation_length.relaxation_length.{wheel}"] = length
        numbers[f"camber_thrust.camber_stiffness.{wheel}"] = drawn["camber_share"] * load
    return numbers


def tyre_numbers(which: Array, pressure: Array, load: float) -> tuple[Array, Array]:
    """Cornering stiffness (N/rad) and relaxation length (m) of each draw, continued beyond the measured loads."""
    stiffness, length = np.empty((2, len(which)))
    for number, name in enumerate(TYRES):
        chosen = which == number
        at = TyreMap.load(name).linear(load=np.full(chosen.sum(), load), pressure=pressure[chosen])
        stiffness[chosen], length[chosen] = at["cornering_stiffness"], at["relaxation_length"]
    return stiffness, length


def arms(drawn: Mapping[str, Any]) -> dict[str, Any]:
    """Parameters (SI) of the hands on the handlebar."""
    return {f"rider_arms.{name.removeprefix('arm_')}": drawn[name] for name in OF_ARMS}


@cache
def _usual(name: str) -> Effect:
    """An effect whose numbers are all replaced."""
    required = {p.name: sum(p.typical) / 2 for p in effect_class(name).parameters if p.default is None}
    return effect_class(name)(**required)


def family(pair: Pair, further: Iterable[type[Effect]] = ()) -> ModelFamily:
    """All models of a pair."""
    return ModelFamily(Model(pair.bicycle, tuple(map(_usual, EFFECTS))), further=tuple(further))


def wobble(models: ModelFamily, numbers: Mapping[str, Any]) -> tuple[Array, Array]:
    """Growth (1/s) and frequency (Hz) of the least damped wobble, each (draws, speeds); growth -inf without any."""
    roots = eigenvalues(models.state_matrices(numbers, SPEEDS[None, :]))
    hertz = frequency_hz(roots)
    growth = np.where((hertz >= WOBBLE_HZ[0]) & (hertz < WOBBLE_HZ[1]), roots.real, -np.inf)
    least_damped = growth.argmax(-1)[..., None]
    return tuple(np.take_along_axis(values, least_damped, -1)[..., 0] for values in (growth, hertz))


@dataclass(frozen=True, eq=False)
class Hands:
    """Wobble of all draws of all pairs in one case of the hands."""

    growth: Array  # (pairs, draws, speeds), 1/s
    hertz: Array  # (pairs, draws, speeds), Hz

    def wobbling(self, speeds: tuple[float, float]) -> Array:
        """Draws (pairs, draws) that wobble somewhere between two ``speeds`` (m/s)."""
        return np.asarray((self.growth[..., within(speeds)] > GROWTH).any(-1))

    def onsets(self) -> Array:
        """Lowest speed (m/s) of growth of each draw that wobbles up to the highest speed counted hands off."""
        grows = self.growth > GROWTH
        onset = SPEEDS[grows.argmax(-1)]
        return np.asarray(onset[grows.any(-1) & (onset <= OFF[1])])

    def frequencies(self, speeds: tuple[float, float]) -> Array:
        """Frequency (Hz) where growth is largest, of each draw that wobbles between two ``speeds`` (m/s)."""
        chosen = within(speeds)
        place = self.growth[..., chosen].argmax(-1)[..., None]
        hertz = np.take_along_axis(self.hertz[..., chosen], place, -1)[..., 0]
        return np.asarray(hertz[self.wobbling(speeds)])

    def frequency_changes(self, speeds: tuple[float, float]) -> Array:
        """Highest less lowest over mean frequency while growing, of each draw that wobbles between two ``speeds``."""
        chosen = within(speeds)
        growing = self.growth[..., chosen] > GROWTH
        hertz = np.where(growing, self.hertz[..., chosen], np.nan)[growing.any(-1)]
        return np.asarray((np.nanmax(hertz, -1) - np.nanmin(hertz, -1)) / np.nanmean(hertz, -1))


def within(speeds: tuple[float, float]) -> Array:
    """Places among SPEEDS between two ``speeds`` (m/s)."""
    low, high = speeds
    return np.asarray((low <= SPEEDS) & (high >= SPEEDS))


@dataclass(frozen=True, eq=False)
class Population:
    """All draws of all pairs under one assumption."""

    members: tuple[Pair, ...]
    off: Hands
    on: Hands

    def counts(self) -> dict[str, float | None]:
        """What is compared with reports: shares of all draws; medians of onset (m/s), frequency (Hz) and its change."""
        return {
            "off": float(self.off.wobbling(OFF).mean()),
            "off_slow": float(self.off.wobbling((0.0, SLOW)).mean()),
            "on": float(self.on.wobbling(ON).mean()),
            "onset_off_m_s": median(self.off.onsets()),
            "hertz_off": median(self.off.frequencies(OFF)),
            "hertz_on": median(self.on.frequencies(ON)),
            "frequency_change_on": median(self.on.frequency_changes(ON)),
        }

    def by_frame(self) -> dict[str, dict[str, float]]:
        """The three shares of each frame."""
        wobbling = {
            "off": self.off.wobbling(OFF),
            "off_slow": self.off.wobbling((0.0, SLOW)),
            "on": self.on.wobbling(ON),
        }
        frames = np.array([pair.frame for pair in self.members])
        return {
            frame: {name: round(float(of[frames == frame].mean()), 3) for name, of in wobbling.items()}
            for frame in dict.fromkeys(frames.tolist())
        }


def median(values: Array) -> float | None:
    """Median, None of nothing."""
    return float(np.median(values)) if len(values) else None


def populate(assumption: Assumption, *, draws: int, seed: int, members: tuple[Pair, ...]) -> Population:
    """Draw and compute a population; a draw of one seed has the same shares of all ranges under every assumption."""
    wobbles: dict[str, list[tuple[Array, Array]]] = {"off": [], "on": []}
    for place, pair in enumerate(members):
        tyres, values, further = (np.random.default_rng([seed, place, stream]) for stream in range(3))
        drawn = draw(assumption.ranges, draws, values)
        tyre = tyres.integers(len(TYRES), size=draws), tyres.choice(PRESSURES, draws)
        numbers = parameters(pair, drawn, tyre, pair.bicycle.static_loads)
        for rival in assumption.rivals:
            numbers |= rival.numbers(pair, draw(rival.ranges, draws, further))
        models = family(pair, [rival.effect for rival in assumption.rivals])
        wobbles["off"].append(wobble(models, numbers | arms(HANDS_OFF)))
        wobbles["on"].append(wobble(models, numbers | arms(drawn)))
    off, on = (Hands(*map(np.array, zip(*wobbles[hands], strict=True))) for hands in ("off", "on"))
    return Population(members, off, on)
