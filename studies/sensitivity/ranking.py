"""What moves a mode most: its changes per one standard deviation of every parameter, ranked."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bicycle.critical.critical_speeds import critical_speeds
from bicycle.default_sd import EXACT, standard_deviations
from bicycle.effect import effect_class
from bicycle.modal.named_modes import modes
from bicycle.model import Model
from bicycle.parameter_key import ParameterKey, entries_of
from bicycle.parameters import UNITS
from bicycle.sensitivity.eigenvalue_derivatives import critical_speed_sensitivities, pair_sensitivities, sensitivities
from bicycle.sensitivity.model_covariance import model_covariance
from bicycle.sensitivity.propagation import frequency_gradient, standard_deviation
from tyre.base.errors import InputError, unknown

NEAR = 1e-4  # two real roots are a meeting below this distance, relative to their size


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
    """Changes of one mode at one speed, the largest change of the growth rate first.

    Where two real roots meet, ``eigenvalue`` is their mean and ``meeting`` says so: their growth rates have no
    derivatives, the mean has. ``others`` are real roots that the mode has beside the one that is ranked, 1/s.

    ``total`` is one standard deviation of the growth rate (1/s) with all parameters uncertain at once: with the
    covariance of those that were measured together where they are ``correlated``, else the root of the sum of squares
    of all changes. Each change is that of its parameter alone, the others held.
    """

    mode: str
    speed: float
    eigenvalue: complex
    meeting: bool
    critical_speeds: tuple[float, ...]
    changes: tuple[Change, ...]
    total: float
    correlated: bool
    others: tuple[float, ...] = ()


def rank(
    model: Model, *, mode: str, speed: float, given_sd: Mapping[str, float] | None = None, max_speed: float = 40.0
) -> Ranking:
    """Rank the parameters of a model by what one standard deviation does to the growth rate of a mode.

    Standard deviations are those of :func:`bicycle.default_sd.standard_deviations`: as given, else of the tyre's table
    or the bicycle's file, else the documented defaults. What is exact changes nothing and comes last.

    Parameters
    ----------
    model : Model
    mode : str
    speed : float
        m/s.
    given_sd : mapping of str to float, optional
        Standard deviations by parameter, in its unit.
    max_speed : float, optional
        Critical speeds are looked for up to it, m/s.

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
    deviations = standard_deviations(model, given_sd)
    for key in given_sd or {}:
        if not entries_of(key, found.parameters):
            raise InputError(f"standard deviation: {unknown('parameter', key, found.parameters)}")
    changes = [
        Change(
            key, unit_of(key), model.parameters[key], deviations[key].sd, deviations[key].origin,
            float(slope.real * deviations[key].sd), float(frequency_gradient(slope * deviations[key].sd)),
            tuple(float(d * deviations[key].sd) for d in moves[key]),
        )
        for key, slope in zip(found.parameters, slopes, strict=True)
    ]  # fmt: skip
    ranked = sorted(changes, key=lambda change: (change.origin == EXACT, -abs(change.growth)))
    names, covariance = model_covariance(model, given_sd, assume=True)
    gradient = dict(zip(found.parameters, slopes.real.tolist(), strict=True))
    total = float(standard_deviation([gradient[key] for key in names], covariance)) if names else 0.0
    correlated = bool((covariance != np.diag(np.diag(covariance))).any())
    others = () if meeting else tuple(z.real for z in values[1:] if not z.imag)
    critical = tuple(c.speed for c in crossings)
    return Ranking(mode, speed, eigenvalue, meeting, critical, tuple(ranked), total, correlated, others)


def unit_of(key: str) -> str:
    """SI unit of a bicycle ``key`` or an ``effect.name[.wheel]``."""
    return UNITS[key] if key in UNITS else str(_parameter(key).unit)


def record(ranking: Ranking) -> dict[str, Any]:
    """The ranking as JSON-ready data."""
    return {
        "mode": ranking.mode,
        "speed_m_s": ranking.speed,
        "eigenvalue_1_s": [ranking.eigenvalue.real, ranking.eigenvalue.imag],
        "mean_of_meeting_roots": ranking.meeting,
        "other_real_roots_1_s": list(ranking.others),
        "critical_speeds_m_s": list(ranking.critical_speeds),
        "total_growth_rate_change_1_s": ranking.total,
        "correlated": ranking.correlated,
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
    own = ParameterKey.parse(key)
    return next(p for p in effect_class(own.effect).parameters if p.name == own.name)
