"""Hands on the handlebar from ring-downs of the steering: front wheel in the air, known springs at the handlebar.

The steering with the hands is one oscillator, I s^2 + c s + k + k_spring = 0. Two springs give I and k apart, the decay
gives c. The inertia of handlebar, fork and wheel about the steer axis, and the stiffness of their weight, are those of
the model at rest (:mod:`bicycle.equations.held_frame`); what remains is that of the hands.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from scipy.special import chdtrc

from bicycle.equations.held_frame import FRAME, held_equations
from bicycle.model.default_sd import standard_deviations
from bicycle.model.model import Model
from bicycle.standing.prediction import STEER, nearest_mode
from bicycle.standing.standing_table import LEAST_SD
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, unknown
from tyre.ground.schema import Check, maybe, number, path_key, table, text
from tyre.ground.text_table import read_columns

STEERING = ("w", "c", "lam", "rF", "mH", "xH", "zH", "IHxx", "IHzz", "IHxz", "mF", "IFxx")
HANDS = "hands"
"""Kind of measurement, and its table."""
HANDS_TABLE = table({**path_key("table", "hands.csv"), maybe("grip"): text("must be a grip of the table", blank=False)})
SPRING_SD = 0.02
"""Relative standard uncertainty of a spring, its lever included."""
COLUMNS: Mapping[str, Check] = {
    "spring_N_m_per_rad": number(
        least=0, most=1e4, says="must be a stiffness about the steer axis, N m/rad, 0 or more"
    ),
    "frequency_Hz": number(above=0, most=50, says="must be a frequency in Hz, above 0 and up to 50"),
    "frequency_sd_Hz": LEAST_SD,
    "damping_ratio": number(above=0, most=1, says="must be a damping ratio, above 0 and up to 1"),
    "damping_ratio_sd": LEAST_SD,
}
AMPLITUDE: Mapping[str, Check] = {
    "amplitude_deg": number(above=0, most=45, says="must be a steer angle in degrees, above 0 and up to 45")
}
DRY = "measurement.steer_friction"
"""Key of the dry friction (N m) of the steering."""
LEAST_RATIO = 1.3  # of the two outermost frequencies: nearer ones leave the inertia open


@dataclass(frozen=True)
class RingDown:
    """Decay of the steering with a spring at the handlebar."""

    grip: str  # loose, firm
    spring: float  # N m/rad about the steer axis
    frequency_hz: float  # |eigenvalue| / 2 pi
    frequency_sd_hz: float
    damping_ratio: float  # -real part / |eigenvalue|
    damping_ratio_sd: float
    amplitude: float = math.nan  # rad, logarithmic mean of the first and the last steer angle; NaN: not read


@dataclass(frozen=True, eq=False)
class Hands:
    """Hands of one grip: what the effect rider_arms takes."""

    grip: str
    values: Array  # (3,), inertia kg m^2, stiffness N m/rad, damping N m s/rad
    covariance: Array  # (3, 3), SI
    goodness: float  # P(chi^2 larger); NaN if there is nothing to be checked

    @property
    def sd(self) -> Array:
        """Standard uncertainties (3,), SI."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))


def read_ring_downs(path: Path) -> tuple[RingDown, ...]:
    """Read a table of ring-downs: grip, spring_N_m_per_rad, frequency_Hz, damping_ratio, each with its sd.

    A column amplitude_deg is optional.

    Raises
    ------
    InputError
        A column that is missing or unknown, a value out of range, with file and line.
    """
    columns = read_columns(path, numbers={**COLUMNS, **AMPLITUDE}, texts=("grip",), needed=("grip", *COLUMNS))
    named = [columns.numbers[name].tolist() for name in COLUMNS]
    if "amplitude_deg" in columns.numbers:
        named.append(np.radians(columns.numbers["amplitude_deg"]).tolist())
    return tuple(RingDown(*row) for row in zip(columns.texts["grip"], *named, strict=True))


def select_grip(ring_downs: Sequence[RingDown], grip: str | None) -> tuple[RingDown, ...]:
    """Ring-downs of one ``grip``; of the only one if it is None.

    Raises
    ------
    InputError
        A grip that the table has not, or none where it has several.
    """
    grips = dict.fromkeys(one.grip for one in ring_downs)
    if grip is None and len(grips) > 1:
        raise InputError(
            f"[{HANDS}]: the table has the grips {', '.join(map(repr, grips))}; each is a case of its own, write "
            f'grip = "{next(iter(grips))}"'
        )
    if grip is not None and grip not in grips:
        raise InputError(f"[{HANDS}]: {unknown('grip', grip, grips)}")
    return tuple(one for one in ring_downs if grip in (None, one.grip))


def spring_error(spring: float) -> str:
    """Key of the relative error of a spring (N m/rad)."""
    return f"spring {spring:g} N m/rad"


def predict_ring_downs(
    ring_downs: Sequence[RingDown], effects: Sequence[type[Any]], values: Mapping[str, Array]
) -> Array:
    """Predict frequency (Hz) and damping ratio of each ring-down on bicycles with ``effects``, (k, 2 n).

    Parameters
    ----------
    ring_downs : sequence of RingDown
    effects : sequence of type
        Those that add inertia, springs or dampers to the steering.
    values : mapping
        Parameters of bicycle and effects (k,), SI; perhaps errors of springs, and :data:`DRY`, the dry friction (N m).

    A dry friction T takes 4 T / (pi omega A) as its damping, with the logarithmic mean A of first and last amplitude:
    so long as T is small compared with the moment of the spring, this is exact for friction alone, whose amplitude
    falls in a straight line.
    """
    frame = held_equations(tuple(sorted(effects, key=lambda effect: effect.identifier)))
    free = [k for k, name in enumerate(frame.coordinates) if name not in FRAME]
    place = free.index(frame.coordinates.index(STEER))
    matrices = frame(values)
    mass, damping, stiffness = (
        matrix[:, free][:, :, free]
        for matrix in (matrices.mass, matrices.damping, matrices.stiffness + matrices.weight)
    )
    columns = []
    for one in ring_downs:
        sprung, damped = stiffness.copy(), damping.copy()
        sprung[:, place, place] += one.spring * (1 + values.get(spring_error(one.spring), np.zeros(1)))
        omega = 2 * np.pi * one.frequency_hz
        if DRY in values:
            damped[:, place, place] += 4 * values[DRY] / (np.pi * omega * one.amplitude)
        if len(free) == 1:  # also where it is damped so much that it does not oscillate
            size = np.sqrt(np.maximum(sprung / mass, 1e-9))[:, 0, 0]
            ratio = (damped / (2 * mass))[:, 0, 0] / size
        else:
            root, _ = nearest_mode(mass, damped, sprung, omega)
            size, ratio = np.abs(root), -root.real / np.abs(root)
        columns += [size / (2 * np.pi), ratio]
    return np.stack(columns, -1)


def measure_hands(ring_downs: Sequence[RingDown], model: Model) -> tuple[Hands, ...]:
    """Find the hands of each grip on the bicycle of a ``model``.

    Raises
    ------
    InputError
        A grip without two springs that differ enough.
    """
    grips = dict.fromkeys(ring_down.grip for ring_down in ring_downs)
    return tuple(_measure([one for one in ring_downs if one.grip == grip], grip, model) for grip in grips)


def _measure(ring_downs: Sequence[RingDown], grip: str, model: Model) -> Hands:
    """Weighted least squares of one grip; springs and the bicycle float with their standard uncertainties."""
    springs = sorted({one.spring for one in ring_downs})
    frequencies = [one.frequency_hz for one in ring_downs]
    if len(springs) < 2 or max(frequencies) < LEAST_RATIO * min(frequencies):
        raise InputError(
            f"grip {grip!r}: inertia and stiffness need two springs whose frequencies differ by a factor of "
            f"{LEAST_RATIO:g} or more; take a stiffer one"
        )
    deviations = standard_deviations(model)
    keys = [key for key in STEERING if deviations[key].sd > 0]
    place = np.array([springs.index(one.spring) for one in ring_downs])
    stated = np.array([one.spring for one in ring_downs])
    measured = np.array([[one.frequency_hz, one.damping_ratio] for one in ring_downs])
    sds = np.array([[one.frequency_sd_hz, one.damping_ratio_sd] for one in ring_downs])

    def residual(x: Array) -> Array:
        errors = x[3 + len(springs) :]
        moved = {key: model.bicycle[key] + deviations[key].sd * z for key, z in zip(keys, errors, strict=True)}
        inertia, weight = _steering({**model.bicycle.values, **moved})
        total = x[0] + inertia
        spring = x[1] + weight + stated * (1 + SPRING_SD * x[3:][place])
        root = np.sqrt(np.maximum(spring / total, 1e-9))
        predicted = np.stack([root / (2 * np.pi), x[2] / (2 * root * total)], -1)
        return np.concatenate([((measured - predicted) / sds).ravel(), x[3:]])

    omega = 2 * np.pi * measured[:, 0]
    low, high = int(omega.argmin()), int(omega.argmax())
    total = (stated[high] - stated[low]) / (omega[high] ** 2 - omega[low] ** 2)
    own = total - _steering(model.bicycle.values)[0]
    damping = float(np.mean(2 * measured[:, 1] * omega)) * total
    start = np.concatenate([[own, omega[low] ** 2 * total - stated[low], damping], np.zeros(len(springs) + len(keys))])
    end = scipy.optimize.least_squares(residual, start, x_scale="jac")
    covariance = np.linalg.inv(end.jac.T @ end.jac)[:3, :3]
    freedom = measured.size - 3
    goodness = float(chdtrc(freedom, 2 * end.cost)) if freedom > 0 else np.nan
    return Hands(grip, end.x[:3], covariance, goodness)


def _steering(values: Mapping[str, float]) -> tuple[float, float]:
    """Inertia (kg m^2) of the steering about its axis and stiffness (N m/rad) of its weight, the wheel in the air."""
    frame = held_equations(())
    place = frame.coordinates.index("steer")
    matrices = frame(values)
    return float(matrices.mass[0, place, place]), float(matrices.weight[0, place, place])
