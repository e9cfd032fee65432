"""Tidy tables of the main study; every column with a unit says so in its name."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from studies.main_study.cases import PASCAL_PER_BAR, Setup, TyreCase
from studies.main_study.solve import Result
from studies.main_study.study import CRITICAL, DAMPING, Decomposition, Study

if TYPE_CHECKING:
    import pandas as pd


def write_tables(study: Study, folder: Path) -> dict[str, Path]:
    """Write every table as CSV; returns name -> file."""
    written = {}
    for name, table in tables(study).items():
        written[name] = folder / f"{name}.csv"
        table.to_csv(written[name], index=False, float_format="%.10g", lineterminator="\n")
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
        "other_fronts": pd.DataFrame(_fronts(study)),
        "monte_carlo": pd.DataFrame(_monte_carlo(study)),
    }


def _condition(study: Study, case: TyreCase, setup: Setup) -> dict[str, Any]:
    return {
        "bicycle": study.settings.bicycle.name, "tyre": case.tyre, "surface": case.surface,
        "pressure_bar": case.pressure_bar, "front": setup.front_name,
        "camber_stiffness_over_load_per_rad": setup.camber_share, "extrapolated": case.extrapolated,
    }  # fmt: skip


def _tyres(study: Study) -> Iterator[dict[str, Any]]:
    for case in study.cases:
        for wheel, p in (("rear", case.rear), ("front", case.front)):
            yield {
                "bicycle": study.settings.bicycle.name, "tyre": case.tyre, "surface": case.surface,
                "pressure_bar": p.pressure / PASCAL_PER_BAR, "wheel": wheel, "load_N": p.load,
                "cornering_stiffness_N_per_deg": np.radians(p.cornering_stiffness),
                "cornering_stiffness_sd_N_per_deg": np.radians(p.cornering_stiffness_sd),
                "lateral_stiffness_N_per_mm": p.lateral_stiffness / 1e3,
                "lateral_stiffness_sd_N_per_mm": p.lateral_stiffness_sd / 1e3,
                "relaxation_length_mm": p.relaxation_length * 1e3,
                "relaxation_length_sd_mm": p.relaxation_length_sd * 1e3,
                "origin": p.origin, "notes": "; ".join(p.notes),
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
            with np.errstate(invalid="ignore", divide="ignore"):
                ratio = np.where(kept.imag > 0, -kept.real / np.abs(kept), np.nan)
            parts.append(
                pd.DataFrame(
                    {
                        "speed_m_s": speeds[there], "mode": mode, "branch": branch + 1, "real_1_per_s": kept.real,
                        "imaginary_rad_per_s": kept.imag, "frequency_Hz": kept.imag / (2 * np.pi),
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
                "speed_m_s": study.settings.report_speed, "mode": mode, "uncertain": study.settings.uncertain,
                "frequency_Hz": hertz.value, "frequency_sd_Hz": hertz.sd, "frequency_sd_of_tyre_Hz": hertz.tyre_sd,
                "damping_ratio": ratio.value, "damping_ratio_sd": ratio.sd, "damping_ratio_sd_of_tyre": ratio.tyre_sd,
            }  # fmt: skip


def _critical(study: Study) -> Iterator[dict[str, Any]]:
    for result in study.results:
        for c in result.crossings:
            yield _condition(study, result.case, result.setup) | {
                "mode": c.mode, "kind": c.kind, "direction": c.direction, "uncertain": study.settings.uncertain,
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
    del row["pressure_bar"]
    row["extrapolated"] = decomposition.higher.extrapolated or decomposition.lower.extrapolated
    return row | {
        "pressure_before_bar": decomposition.higher.pressure_bar, "pressure_after_bar": decomposition.lower.pressure_bar
    }  # fmt: skip


def _fronts(study: Study) -> Iterator[dict[str, Any]]:
    for a in study.alternatives:
        yield {
            "bicycle": study.settings.bicycle.name, "tyre": a.case.tyre, "surface": a.case.surface,
            "pressure_bar": a.case.pressure_bar, "extrapolated": a.case.extrapolated, "front": a.what,
            "stiffness_N_m_per_rad": a.front.stiffness, "damping_N_m_s_per_rad": a.front.damping,
            "joint_height_m": a.front.joint_height,
            "unstable_wobble_from_m_s": a.onset, "unstable_wobble_to_m_s": a.end,
        }  # fmt: skip


def _monte_carlo(study: Study) -> Iterator[dict[str, Any]]:
    settings = study.settings
    for one in study.checks:
        for q in one.quantities:
            low, high = q.band()
            yield _condition(study, one.result.case, one.result.setup) | {
                "what": q.name, "unit": q.unit, "uncertain": settings.uncertain, "value": q.value,
                "sd_linear": q.linear_sd, "sd_monte_carlo": q.sampled_sd, "mean_monte_carlo": q.sampled_mean,
                "quantile_2.5_%": low, "quantile_97.5_%": high, "draws": settings.samples, "lost": q.lost,
                "seed": settings.seed,
            }  # fmt: skip
