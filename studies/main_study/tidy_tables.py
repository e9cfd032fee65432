"""Tidy tables of the main study; the name of a column ends with its unit."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from bicycle.model.eigen import damping_ratio, frequency_hz, oscillating
from studies.main_study.cases import TyreCase
from studies.main_study.compare import CRITICAL, DAMPING
from studies.main_study.published import compare_findings
from studies.main_study.settings import Setup
from studies.main_study.study import Study
from tyre.ground.text_table import write_csv

Row = dict[str, Any]


def write_tables(study: Study, folder: Path) -> dict[str, Path]:
    """Write every table as CSV into ``folder``; return name -> file."""
    written = {}
    for name, table in tables(study).items():
        written[name] = folder / f"{name}.csv"
        write_csv(written[name], table, number_format="%.10g")
    return written


def tables(study: Study) -> dict[str, pd.DataFrame]:
    """Make every table by name."""
    rows = {
        "tyre_properties": _tyres(study),
        "eigenvalues": _eigenvalues(study),
        "damping_ratios": _damping_ratios(study),
        "critical_speeds": _critical(study),
        "decomposition_damping_ratio": _changes(study, DAMPING, ""),
        "decomposition_critical_speed": _changes(study, CRITICAL, "_m_s"),
        "wobble": _wobble(study),
        "one_at_a_time": _hinges(study),
        "front_frame_samples": _front_samples(study),
        "published": _comparisons(study),
        "monte_carlo": _monte_carlo(study),
    }
    return {name: pd.DataFrame(list(table_rows)) for name, table_rows in rows.items()}


def _condition(study: Study, case: TyreCase, setup: Setup) -> Row:
    rear, front = case.pressures_bar or (None, None)
    return {
        "bicycle": study.settings.bicycle.name,
        "tyre": case.tyre,
        "surface": case.surface,
        "pressure_rear_bar": rear,
        "pressure_front_bar": front,
        "hands": setup.hands,
        "front": setup.front_name,
        "extrapolated": case.extrapolated,
    }


def _tyres(study: Study) -> Iterator[Row]:
    for case in study.cases:
        for k, at in enumerate(case.wheels):
            p = at.properties
            yield {
                "bicycle": study.settings.bicycle.name,
                "tyre": case.tyre,
                "surface": case.surface,
                "pressure_bar": case.pressures_bar[k] if case.pressures_bar else None,
                "wheel": at.wheel,
                "load_N": study.settings.bicycle.static_loads[k],
                "cornering_stiffness_N_per_deg": np.radians(at.cornering_stiffness),
                "cornering_stiffness_sd_N_per_deg": np.radians(at.cornering_stiffness_sd),
                "lateral_stiffness_N_per_mm": at.lateral_stiffness / 1e3,
                "lateral_stiffness_sd_N_per_mm": p.lateral_stiffness_sd / 1e3 if p else None,
                "relaxation_length_mm": at.relaxation_length * 1e3,
                "relaxation_length_sd_mm": at.relaxation_length_sd * 1e3,
                "origin": p.origin if p else "given",
                "notes": "; ".join(p.notes) if p else "",
            }


def _eigenvalues(study: Study) -> Iterator[Row]:
    speeds = study.settings.speeds
    for result in study.results:
        condition = _condition(study, result.case, result.setup)
        for mode, values in result.modes.branches.items():
            for branch, value in enumerate(values[: len(speeds)].T, 1):
                present = ~np.isnan(value)
                root = value[present]
                ratio = damping_ratio(oscillating(root))
                numbers = (speeds[present], root.real, root.imag, frequency_hz(root), ratio)
                for speed, real, imaginary, hertz, zeta in zip(*numbers, strict=True):
                    yield condition | {
                        "speed_m_s": speed,
                        "mode": mode,
                        "branch": branch,
                        "real_1_s": real,
                        "imaginary_rad_s": imaginary,
                        "frequency_Hz": hertz,
                        "damping_ratio": zeta,
                    }


def _damping_ratios(study: Study) -> Iterator[Row]:
    for result in study.results:
        for mode, ratio in result.damping.items():
            hertz = result.frequency[mode]
            yield _condition(study, result.case, result.setup) | {
                "speed_m_s": study.settings.report_speed,
                "mode": mode,
                "frequency_Hz": hertz.value,
                "frequency_sd_Hz": hertz.sd,
                "frequency_sd_of_tyre_Hz": hertz.tyre_sd,
                "damping_ratio": ratio.value,
                "damping_ratio_sd": ratio.sd,
                "damping_ratio_sd_of_tyre": ratio.tyre_sd,
            }


def _critical(study: Study) -> Iterator[Row]:
    for result in study.results:
        for c in result.crossings:
            yield _condition(study, result.case, result.setup) | {
                "mode": c.mode,
                "kind": c.kind,
                "direction": c.direction,
                "speed_m_s": c.speed,
                "speed_sd_m_s": c.sd,
                "speed_sd_of_tyre_m_s": c.tyre_sd,
                "frequency_Hz": c.frequency_hz,
            }


def _changes(study: Study, quantity: str, unit: str) -> Iterator[Row]:
    for d in study.decompositions:
        row = _condition(study, d.higher, d.setup)
        del row["pressure_rear_bar"], row["pressure_front_bar"]
        row |= {
            "extrapolated": d.higher.extrapolated or d.lower.extrapolated,
            "pressure_before_bar": d.higher.pressure_bar,
            "pressure_after_bar": d.lower.pressure_bar,
        }
        for change in d.changes:
            if change.quantity == quantity:
                yield row | {
                    "what": str(change.of),
                    f"before{unit}": change.before,
                    f"after{unit}": change.after,
                    f"total_change{unit}": change.total,
                    f"cornering_stiffness_part{unit}": change.stiffness_part,
                    f"relaxation_length_part{unit}": change.length_part,
                    f"interaction{unit}": change.interaction,
                }


def _wobble(study: Study) -> Iterator[Row]:
    limit = study.settings.fastest
    for r in study.results:
        span = r.wobble
        samples = study.samples_around(r)
        row = _condition(study, r.case, r.setup) | {
            "looked_at_up_to_m_s": limit,
            "wobbles": span is not None,
            "from_m_s": span.low if span else None,
            "to_m_s": span.high if span else None,
            "growth_1_s": span.growth if span else None,
            "frequency_Hz": span.frequency_hz if span else None,
            "min_damping_ratio": r.least.damping_ratio if r.least else None,
            "at_m_s": r.least.speed if r.least else None,
        }
        for edge in ("onset", "end"):
            low, high = (samples.interval(edge) if samples else None) or (None, None)
            row |= {f"samples_{edge}_5_%_m_s": low, f"samples_{edge}_95_%_m_s": high}
        counts = (samples.count, samples.stable_count) if samples else (None, None)
        yield row | dict(zip(("samples", "samples_without_wobble"), counts, strict=True))


def _hinges(study: Study) -> Iterator[Row]:
    for hinge in study.hinges:
        for name, end in (("first", hinge.low), ("second", hinge.high)):
            yield {
                "varied": hinge.what,
                "end": name,
                "value": end.what,
                "wobbles": end.span is not None,
                "from_m_s": end.span.low if end.span else None,
                "to_m_s": end.span.high if end.span else None,
                "min_damping_ratio": end.least.damping_ratio if end.least else None,
            }


def _front_samples(study: Study) -> Iterator[Row]:
    for samples in study.samples:
        for k, (onset, end, computed) in enumerate(zip(samples.onset, samples.end, samples.computed, strict=True)):
            yield _condition(study, samples.case, samples.setup) | {
                "number": k,
                "computed": bool(computed),
                "onset_m_s": onset,
                "end_m_s": end,
            }


def _comparisons(study: Study) -> Iterator[Row]:
    for comparison in compare_findings(study):
        low, high = comparison.ours or (None, None)
        yield {
            "who": comparison.finding.who,
            "kind": comparison.finding.kind,
            "quantity": comparison.finding.quantity,
            "hands": comparison.finding.hands,
            "published_low": comparison.finding.low,
            "published_high": comparison.finding.high,
            "here_low": low,
            "here_high": high,
            "verdict": comparison.verdict,
            "read": comparison.finding.read,
            "source": comparison.finding.source,
        }


def _monte_carlo(study: Study) -> Iterator[Row]:
    settings = study.settings
    for check in study.checks:
        for q in check.quantities:
            low, high = q.band()
            yield _condition(study, check.result.case, check.result.setup) | {
                "what": q.name,
                "unit": q.unit,
                "value": q.value,
                "sd_linear": q.linear_sd,
                "sd_monte_carlo": q.sampled_sd,
                "mean_monte_carlo": q.sampled_mean,
                "quantile_2.5_%": low,
                "quantile_97.5_%": high,
                "draws": settings.samples,
                "lost": q.lost,
                "seed": settings.seed,
            }
