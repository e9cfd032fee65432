"""Tidy tables of the main study; every column with a unit says so in its name."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bicycle.eigenvalues.oscillation import damping_ratio, frequency_hz, oscillating
from studies.main_study.cases import TyreCase
from studies.main_study.decompose import CRITICAL, DAMPING, Decomposition
from studies.main_study.published import compared
from studies.main_study.settings import Setup
from studies.main_study.solve import Result
from studies.main_study.study import Study
from tyre.base.csv_text import write_csv

if TYPE_CHECKING:
    import pandas as pd


def write_tables(study: Study, folder: Path) -> dict[str, Path]:
    """Write every table as CSV into ``folder``; returns name -> file."""
    written = {}
    for name, table in tables(study).items():
        written[name] = folder / f"{name}.csv"
        write_csv(written[name], table, number_format="%.10g")
    return written


def tables(study: Study) -> dict[str, "pd.DataFrame"]:
    """Every table by name."""
    import pandas as pd

    return {
        "tyre_properties": pd.DataFrame(_tyres(study)),
        "eigenvalues": pd.concat([_eigenvalues(study, result) for result in study.results], ignore_index=True),
        "damping_ratios": pd.DataFrame(_compared(study)),
        "critical_speeds": pd.DataFrame(_critical(study)),
        "decomposition_damping_ratio": pd.DataFrame(_changes(study, DAMPING, "")),
        "decomposition_critical_speed": pd.DataFrame(_changes(study, CRITICAL, "_m_s")),
        "wobble": pd.DataFrame(_wobble(study)),
        "hinges": pd.DataFrame(_hinges(study)),
        "plausible_fronts": pd.DataFrame(_plausible(study)),
        "published": pd.DataFrame(_published(study)),
        "monte_carlo": pd.DataFrame(_monte_carlo(study)),
    }


def _condition(study: Study, case: TyreCase, setup: Setup) -> dict[str, Any]:
    rear, front = case.pressures_bar or (None, None)
    return {
        "bicycle": study.settings.bicycle.name, "tyre": case.tyre, "surface": case.surface,
        "pressure_rear_bar": rear, "pressure_front_bar": front, "hands": setup.hands, "front": setup.front_name,
        "extrapolated": case.extrapolated,
    }  # fmt: skip


def _tyres(study: Study) -> Iterator[dict[str, Any]]:
    for case in study.cases:
        for k, wheel in enumerate(("rear", "front")):
            stiffness, length = (float(value) for value in case.contact[2 * k : 2 * k + 2])
            sd = np.sqrt(np.diag(case.covariance))[2 * k : 2 * k + 2]
            p = case.properties[k] if case.properties else None
            yield {
                "bicycle": study.settings.bicycle.name, "tyre": case.tyre, "surface": case.surface,
                "pressure_bar": case.pressures_bar[k] if case.pressures_bar else None, "wheel": wheel,
                "load_N": study.settings.bicycle.static_loads[k],
                "cornering_stiffness_N_per_deg": np.radians(stiffness),
                "cornering_stiffness_sd_N_per_deg": np.radians(sd[0]),
                "lateral_stiffness_N_per_mm": stiffness / length / 1e3,
                "lateral_stiffness_sd_N_per_mm": p.lateral_stiffness_sd / 1e3 if p else None,
                "relaxation_length_mm": length * 1e3, "relaxation_length_sd_mm": sd[1] * 1e3,
                "origin": p.origin if p else "given", "notes": "; ".join(p.notes) if p else "",
            }  # fmt: skip


def _eigenvalues(study: Study, result: Result) -> "pd.DataFrame":
    import pandas as pd

    parts = []
    speeds = study.settings.speeds
    for mode, values in result.modes.branches.items():
        for branch in range(values.shape[1]):
            value = values[: len(speeds), branch]
            there = ~np.isnan(value)
            kept = value[there]
            ratio = damping_ratio(oscillating(kept))
            parts.append(
                pd.DataFrame(
                    {
                        "speed_m_s": speeds[there], "mode": mode, "branch": branch + 1, "real_1_s": kept.real,
                        "imaginary_rad_s": kept.imag, "frequency_Hz": frequency_hz(kept),
                        "damping_ratio": ratio,
                    }
                )
            )  # fmt: skip
    table = pd.concat([part for part in parts if len(part)], ignore_index=True)
    for position, (column, value) in enumerate(_condition(study, result.case, result.setup).items()):
        table.insert(position, column, value)
    return table


def _compared(study: Study) -> Iterator[dict[str, Any]]:
    for result in study.results:
        for mode, ratio in result.damping.items():
            hertz = result.frequency[mode]
            yield _condition(study, result.case, result.setup) | {
                "speed_m_s": study.settings.report_speed, "mode": mode,
                "frequency_Hz": hertz.value, "frequency_sd_Hz": hertz.sd, "frequency_sd_of_tyre_Hz": hertz.tyre_sd,
                "damping_ratio": ratio.value, "damping_ratio_sd": ratio.sd, "damping_ratio_sd_of_tyre": ratio.tyre_sd,
            }  # fmt: skip


def _critical(study: Study) -> Iterator[dict[str, Any]]:
    for result in study.results:
        for c in result.crossings:
            yield _condition(study, result.case, result.setup) | {
                "mode": c.mode, "kind": c.kind, "direction": c.direction,
                "speed_m_s": c.speed, "speed_sd_m_s": c.sd, "speed_sd_of_tyre_m_s": c.tyre_sd,
                "frequency_Hz": c.frequency_hz,
            }  # fmt: skip


def _changes(study: Study, quantity: str, unit: str) -> Iterator[dict[str, Any]]:
    for d in study.decompositions:
        for change in d.changes:
            if change.quantity == quantity:
                yield _pressures(study, d) | {
                    "what": change.name, f"before{unit}": change.before, f"after{unit}": change.after,
                    f"total_change{unit}": change.total, f"cornering_stiffness_part{unit}": change.stiffness_part,
                    f"relaxation_length_part{unit}": change.length_part, f"interaction{unit}": change.interaction,
                }  # fmt: skip


def _pressures(study: Study, decomposition: Decomposition) -> dict[str, Any]:
    row = _condition(study, decomposition.higher, decomposition.setup)
    del row["pressure_rear_bar"], row["pressure_front_bar"]
    row["extrapolated"] = decomposition.higher.extrapolated or decomposition.lower.extrapolated
    return row | {
        "pressure_before_bar": decomposition.higher.pressure_bar, "pressure_after_bar": decomposition.lower.pressure_bar
    }  # fmt: skip


def _wobble(study: Study) -> Iterator[dict[str, Any]]:
    limit = study.settings.fastest
    for r in study.results:
        span, outer = r.span(limit), study.outer(r)
        likely = {edge: (outer.likely(edge) if outer else None) or (None, None) for edge in ("onset", "end")}
        yield _condition(study, r.case, r.setup) | {
            "looked_at_up_to_m_s": limit, "unstable": span is not None,
            "from_m_s": span.low if span else None, "to_m_s": span.high if span else None,
            "least_damping_ratio": r.least.damping_ratio if r.least else None,
            "at_m_s": r.least.speed if r.least else None,
            **{f"plausible_{edge}_{end}_m_s": ends[k] for edge, ends in likely.items()
               for k, end in enumerate(("5_%", "95_%"))},
            "random_bicycles": outer.count if outer else None,
            "of_these_without_wobble": outer.without if outer else None,
        }  # fmt: skip


def _hinges(study: Study) -> Iterator[dict[str, Any]]:
    for hinge in study.hinges:
        for name, end in (("first", hinge.low), ("second", hinge.high)):
            yield {
                "varied": hinge.what, "end": name, "value": end.what, "unstable": end.span is not None,
                "from_m_s": end.span.low if end.span else None, "to_m_s": end.span.high if end.span else None,
                "least_damping_ratio": end.least.damping_ratio if end.least else None,
            }  # fmt: skip


def _plausible(study: Study) -> Iterator[dict[str, Any]]:
    for one in study.plausible:
        for k, (onset, end, computed) in enumerate(zip(one.onset, one.end, one.computed, strict=True)):
            yield _condition(study, one.case, one.setup) | {
                "number": k, "computed": bool(computed), "onset_m_s": onset, "end_m_s": end
            }  # fmt: skip


def _published(study: Study) -> Iterator[dict[str, Any]]:
    for one in compared(study):
        low, high = one.ours or (None, None)
        yield {
            "who": one.finding.who, "quantity": one.finding.quantity, "hands": one.finding.hands,
            "published_low": one.finding.low, "published_high": one.finding.high, "here_low": low, "here_high": high,
            "verdict": one.verdict, "read": one.finding.read, "source": one.finding.source,
        }  # fmt: skip


def _monte_carlo(study: Study) -> Iterator[dict[str, Any]]:
    settings = study.settings
    for one in study.checks:
        for q in one.quantities:
            low, high = q.band()
            yield _condition(study, one.result.case, one.result.setup) | {
                "what": q.name, "unit": q.unit, "value": q.value,
                "sd_linear": q.linear_sd, "sd_monte_carlo": q.sampled_sd, "mean_monte_carlo": q.sampled_mean,
                "quantile_2.5_%": low, "quantile_97.5_%": high, "draws": settings.samples, "lost": q.lost,
                "seed": settings.seed,
            }  # fmt: skip
