"""What moves a mode most: its changes per one standard deviation of every parameter, ranked."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bicycle.critical import critical_speeds
from bicycle.effect import effect_class
from bicycle.model import Model
from bicycle.modes import modes
from bicycle.parameters import UNITS
from bicycle.sensitivity import critical_speed_sensitivities, pair_sensitivities, sensitivities
from tyre.errors import InputError, unknown

ASSUMED = 0.05  # of the value, where no standard deviation is known
OF_TYPICAL = f"{ASSUMED:.0%} of typical"  # origin where the value is zero: what it belongs to is switched off
NEAR = 1e-4  # two real roots are a meeting below this distance, relative to their size
CONSTANTS = ("g",)  # not uncertain


@dataclass(frozen=True)
class Change:
    """What one standard deviation of a parameter does to a mode (to first order).

    ``growth`` is the change of the real part (1/s, > 0 is worse), ``frequency`` that of the damped frequency (Hz);
    ``critical`` the change of each critical speed of the mode (m/s).
    """

    parameter: str
    unit: str
    value: float
    sd: float
    origin: str
    growth: float
    frequency: float
    critical: tuple[float, ...]


@dataclass(frozen=True)
class Ranking:
    """Changes of one mode at one speed, the largest change of the growth rate first; what is switched off last.

    Where two real roots meet, ``eigenvalue`` is their mean and ``meeting`` says so: their growth rates have no
    derivatives, the mean has.
    """

    mode: str
    speed: float
    eigenvalue: complex
    meeting: bool
    critical_speeds: tuple[float, ...]
    changes: tuple[Change, ...]

    @property
    def total(self) -> float:
        """Root of the sum of squares of all changes of the growth rate, 1/s (independent parameters)."""
        return math.hypot(*(change.growth for change in self.changes))


def rank(
    model: Model, *, mode: str, speed: float, given_sd: Mapping[str, float] | None = None, max_speed: float = 40.0
) -> Ranking:
    """Rank the parameters of a model by what one standard deviation does to the growth rate of a mode.

    Standard deviations are those given, else those of the tyre's table, else those of the bicycle file, else 5 % of
    the value; gravity is taken as constant. An effect parameter at zero gets 5 % of its largest typical value and is
    ranked after all others: its effect is switched off.

    Raises
    ------
    InputError
        The mode does not exist at that speed, or a given standard deviation is not >= 0 or names no parameter.
    """
    linear = model.linear_model()
    values = _values(modes(linear, [speed]).branches, mode, speed)
    found = sensitivities(model, [speed])
    meeting = len(values) == 2 and abs(values[0] - values[1]) < NEAR * abs(values[0])
    if meeting:
        pair = pair_sensitivities(model, speed, (values[0], values[1]))
        eigenvalue, slopes = complex(pair.sum / 2), pair.of_sum / 2 + 0j
    else:
        at = int(np.abs(found.eigenvalues[0] - values[0]).argmin())
        eigenvalue, slopes = complex(found.eigenvalues[0, at]), found.derivatives[0, at]
    crossings = [c for c in critical_speeds(linear, max_speed=max_speed) if c.mode == mode]
    moves = critical_speed_sensitivities(model, crossings)
    deviations = standard_deviations(model, found.parameters, given_sd or {})
    changes = [
        Change(
            key, unit_of(key), model.parameters[key], sd, origin, float(slope.real * sd),
            float(slope.imag * sd / (2 * math.pi)), tuple(float(d * sd) for d in moves[key]),
        )
        for (key, (sd, origin)), slope in zip(deviations.items(), slopes, strict=True)
    ]  # fmt: skip
    ranked = sorted(changes, key=lambda change: (change.origin == OF_TYPICAL, -abs(change.growth)))
    return Ranking(mode, speed, eigenvalue, meeting, tuple(c.speed for c in crossings), tuple(ranked))


def standard_deviations(
    model: Model, parameters: Sequence[str], given: Mapping[str, float]
) -> dict[str, tuple[float, str]]:
    """One standard deviation of each parameter and where it comes from."""
    for key, sd in given.items():
        if key not in parameters:
            raise InputError(f"standard deviation: {unknown('parameter', key, parameters)}")
        if not (math.isfinite(sd) and sd >= 0):
            raise InputError(f"the standard deviation of {key} is {sd!r}; it must be finite and >= 0 ({unit_of(key)})")
    found = {}
    for key in parameters:
        if key in given:
            found[key] = (float(given[key]), "given")
        elif model.sd.get(key):  # zero: the tyre's source states none
            found[key] = (float(model.sd[key]), "tyre table")
        elif key in model.bicycle.sd:
            found[key] = (model.bicycle.sd[key], "bicycle file")
        elif key in CONSTANTS:
            found[key] = (0.0, "constant")
        elif model.parameters[key] == 0 and _typical(key):
            found[key] = (ASSUMED * _typical(key), OF_TYPICAL)
        else:
            found[key] = (ASSUMED * abs(model.parameters[key]), f"assumed {ASSUMED:.0%}")
    return found


def unit_of(key: str) -> str:
    """SI unit of a bicycle key or an ``effect.name[.wheel]``."""
    return UNITS[key] if key in UNITS else str(_parameter(key).unit)


def record(ranking: Ranking) -> dict[str, Any]:
    """The ranking as JSON-ready data."""
    return {
        "mode": ranking.mode,
        "speed_m_s": ranking.speed,
        "eigenvalue_1_s": [ranking.eigenvalue.real, ranking.eigenvalue.imag],
        "mean_of_meeting_roots": ranking.meeting,
        "critical_speeds_m_s": list(ranking.critical_speeds),
        "total_growth_rate_change_1_s": ranking.total,
        "parameters": [
            {
                "parameter": c.parameter,
                "unit": c.unit,
                "value": c.value,
                "sd": c.sd,
                "sd_origin": c.origin,
                "growth_rate_change_1_s": c.growth,
                "frequency_change_Hz": c.frequency if ranking.eigenvalue.imag else None,
                "critical_speed_changes_m_s": list(c.critical),
            }
            for c in ranking.changes
        ],
    }


def _values(branches: Mapping[str, Any], mode: str, speed: float) -> list[complex]:
    here = {name: [complex(z) for z in rows[0] if not np.isnan(z)] for name, rows in branches.items()}
    here = {name: found for name, found in here.items() if found}
    if mode not in here:
        raise InputError(f"at {speed:g} m/s: {unknown('mode', mode, here)}")
    return here[mode]


def _parameter(key: str) -> Any:
    identifier, name, *_ = key.split(".")
    return next(p for p in effect_class(identifier).parameters if p.name == name)


def _typical(key: str) -> float:
    return 0.0 if key in UNITS else max(map(abs, _parameter(key).typical))
