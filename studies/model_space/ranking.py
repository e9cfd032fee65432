"""Ranking of what moves a mode most: its changes per one standard deviation of every parameter, ranked and drawn."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.model.default_sd import ASSUMED, EXACT, standard_deviations
from bicycle.model.eigen import frequency_hz
from bicycle.model.model import Model
from bicycle.parameters.parameter_covariance import entries_of
from bicycle.stability.critical import critical_speeds
from bicycle.stability.named_modes import modes
from bicycle.stability.naming import refuse_impossible_mode
from bicycle.stability.propagation import model_covariance, standard_deviation
from bicycle.stability.sensitivity import critical_speed_sensitivities, pair_sensitivities, sensitivities
from studies.model_space.axes import unit_of
from tyre.ground.errors import InputError, unknown


@dataclass(frozen=True)
class Change:
    """Changes of a mode for one standard deviation of a parameter, to first order."""

    parameter: str  # key of the bicycle, or ``effect.parameter[.wheel]``
    unit: str  # SI, of the parameter
    value: float  # in ``unit``
    sd: float  # in ``unit``
    origin: str  # of the sd: one of ``ORIGINS`` of :mod:`bicycle.model.default_sd`
    growth: float  # 1/s, of the real part of the root
    frequency: float  # Hz
    critical: tuple[float, ...]  # m/s, of each of the ranking's critical speeds


@dataclass(frozen=True)
class Ranking:
    """Changes of one mode at one speed, the largest change of the growth rate first."""

    mode: str  # name
    speed: float  # m/s
    eigenvalue: complex  # 1/s, Im >= 0; of two real roots that meet their mean
    meeting: bool  # True: two real roots of the mode meet near this speed
    critical_speeds: tuple[float, ...]  # m/s, of this mode, rising
    changes: tuple[Change, ...]  # one a parameter, the largest change of the growth rate first
    total: float  # 1/s, standard deviation of the growth rate by all parameters together
    correlated: bool  # True: some of the parameters are correlated
    further_roots: tuple[float, ...] = ()  # 1/s, further real roots of the mode


def rank(
    model: Model, *, mode: str, speed: float, given_sd: Mapping[str, float] | None = None, max_speed: float = 40.0
) -> Ranking:
    """Rank the parameters of a model by what one standard deviation does to the growth rate of a mode."""
    refuse_impossible_mode(mode, model.effects)
    linear = model.linear_model()
    values = _values(modes(linear, [speed]).branches, mode, speed)
    slopes_of_roots = sensitivities(model, [speed])
    # two real roots are a meeting below this distance, relative to their size
    meeting = len(values) == 2 and abs(values[0] - values[1]) < 1e-4 * abs(values[0])
    if meeting:
        pair = pair_sensitivities(model, speed, (values[0], values[1]))
        eigenvalue, slopes = complex(pair.sum / 2), pair.of_sum / 2 + 0j
    else:
        at = int(np.abs(slopes_of_roots.eigenvalues[0] - values[0]).argmin())
        eigenvalue, slopes = complex(slopes_of_roots.eigenvalues[0, at]), slopes_of_roots.derivatives[0, at]
    crossings = [c for c in critical_speeds(linear, max_speed=max_speed) if c.mode == mode]
    moves = critical_speed_sensitivities(model, crossings)
    deviations = standard_deviations(model, given_sd)
    for key in given_sd or {}:
        if not entries_of(key, slopes_of_roots.parameters):
            raise InputError(f"standard deviation: {unknown('parameter', key, slopes_of_roots.parameters)}")
    changes = [
        Change(
            key,
            unit_of(key),
            model.parameters[key],
            deviations[key].sd,
            deviations[key].origin,
            float(slope.real * deviations[key].sd),
            float(frequency_hz(slope * deviations[key].sd)),
            tuple(float(d * deviations[key].sd) for d in moves[key]),
        )
        for key, slope in zip(slopes_of_roots.parameters, slopes, strict=True)
    ]
    ranked = sorted(changes, key=lambda change: (change.origin == EXACT, -abs(change.growth)))
    names, covariance = model_covariance(model, given_sd, assume=True)
    gradient = dict(zip(slopes_of_roots.parameters, slopes.real.tolist(), strict=True))
    total = float(standard_deviation([gradient[key] for key in names], covariance)) if names else 0.0
    correlated = bool((covariance != np.diag(np.diag(covariance))).any())
    further_roots = () if meeting else tuple(z.real for z in values[1:] if not z.imag)
    critical = tuple(c.speed for c in crossings)
    return Ranking(mode, speed, eigenvalue, meeting, critical, tuple(ranked), total, correlated, further_roots)


def record(ranking: Ranking) -> dict[str, Any]:
    """The ranking as JSON-ready data."""
    return {
        "mode": ranking.mode,
        "speed_m_s": ranking.speed,
        "eigenvalue_1_s": [ranking.eigenvalue.real, ranking.eigenvalue.imag],
        "mean_of_meeting_roots": ranking.meeting,
        "other_real_roots_1_s": list(ranking.further_roots),
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
    roots_by_mode = {name: [complex(z) for z in rows[0] if not np.isnan(z)] for name, rows in branches.items()}
    roots_by_mode = {name: roots for name, roots in roots_by_mode.items() if roots}
    if mode not in roots_by_mode:
        raise InputError(f"at {speed:g} m/s: {unknown('mode', mode, roots_by_mode)}")
    return roots_by_mode[mode]


def draw_tornado(ranking: Ranking, target: Path, *, top: int = 15) -> None:
    """Bars of the change of the growth rate for plus (dark) and minus (hatched) one standard deviation."""
    from studies.reporting.plotting import LOOKS, drawing

    changes = ranking.changes[:top][::-1]
    growth, rows = np.array([change.growth for change in changes]), np.arange(len(changes))
    z, note = ranking.eigenvalue, "; two real roots meet, their mean" if ranking.meeting else ""
    with drawing(target, width=7.6, height=1.9 + 0.28 * len(changes)) as figure:
        axes = figure.subplots()
        axes.barh(rows, growth, color=LOOKS[0].colour, label="+1 standard uncertainty")
        axes.barh(
            rows, -growth, color="white", edgecolor=LOOKS[2].colour, hatch="////", label="−1 standard uncertainty"
        )
        axes.axvline(0, color="black", linewidth=0.8)
        labels = []
        for c in changes:
            unit = "" if c.unit == "1" else f" {c.unit}".replace("^2", "²").replace("^3", "³")
            labels.append(f"{c.parameter}  (sd {c.sd:.3g}{unit}{'*' if c.origin == ASSUMED else ''})")
        axes.set_yticks(rows, labels)
        axes.tick_params(axis="y", length=0)
        axes.margins(y=0.02)
        axes.grid(axis="y", visible=False)
        figure.suptitle(
            f"Sensitivity of {ranking.mode.replace('_', ' ')} at {ranking.speed:g} m/s\n"
            f"{abs(frequency_hz(z)):.2f} Hz, growth rate {z.real:.3g} 1/s{note}",
            fontsize=10,
            weight="bold",
        )
        figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=2)
        label = "Change of the growth rate, 1/s (> 0: less stable)"
        if any(change.origin == ASSUMED for change in changes):
            label += "\n* assumed: no source states it"
        axes.set_xlabel(label, fontsize=8.5)
