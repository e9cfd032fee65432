"""Errata of the paper's formulas and captions, each shown on numbers of its own tables."""

import numpy as np

from studies.paper_audit.claim import Outcome, PaperTables, claim, judge_all, plain
from tyre.magic_formula import side_force

ROLLING_SPEED = 9.3 / 3.6  # m/s, the paper's section 3.2
ONE_TIME_CONSTANT = 1 - np.exp(-1)


@claim(section="1.1", statement="One relaxation length after a slip step the side force has reached 63 %", text="63 %")
def share_of_the_steady_force(tables: PaperTables) -> Outcome:
    share = 100 * float(ONE_TIME_CONSTANT)
    return Outcome(f"{share:.1f} % for eq. (1)", judge_all(abs(share - 63) < 0.5), {"share_percent": share})


@claim(section="1.1", statement="Eq. (2), F (1 - exp(-(lambda/v) t)), solves eq. (1)", text="lambda/v")
def exponent_of_equation_2(tables: PaperTables) -> Outcome:
    length = float(tables.tyre1.relaxation_length[0, 0]) / 1e3
    time_constant = length / ROLLING_SPEED
    printed = 1 - np.exp(-length / ROLLING_SPEED * time_constant)
    corrected = 1 - np.exp(-ROLLING_SPEED / length * time_constant)
    return Outcome(
        f"after one time constant: printed {100 * printed:.2f} %, with v/lambda {100 * corrected:.1f} %",
        judge_all(np.isclose(printed, ONE_TIME_CONSTANT)),
        {"printed_share_percent": 100 * float(printed), "corrected_share_percent": 100 * float(corrected)},
        "should read F (1 - exp(-v t / lambda)); the printed exponent has the unit s^2",
    )


@claim(section="1.1", statement="The time to 63 % divided by the speed is the relaxation length", text="t / v")
def time_divided_by_speed(tables: PaperTables) -> Outcome:
    length = float(tables.tyre1.relaxation_length[0, 0]) / 1e3
    time = length / ROLLING_SPEED
    return Outcome(
        f"{1e3 * length:.1f} mm at 9.3 km/h: "
        f"t v = {1e3 * time * ROLLING_SPEED:.1f} mm, t / v = {time / ROLLING_SPEED:.3f} s^2/m",
        judge_all(np.isclose(time / ROLLING_SPEED, length)),
        {"time_s": time},
        "the time is multiplied by the speed; t / v is no length",
    )


@claim(section="2.2", statement="Eq. (5): the cornering stiffness is B C D of the fit to Fy / Fz", text="B C D")
def load_missing_in_equation_5(tables: PaperTables) -> Outcome:
    load = float(tables.tyre1.loads[0])
    measured = float(np.degrees(tables.tyre1.cornering_stiffness[0, 0]))
    shape, peak = 1.3, 1.0  # any curve through the measured slope will do
    coefficients = {
        "stiffness_factor": measured / (shape * peak * load),
        "shape_factor": shape,
        "peak_factor": peak,
        "curvature_factor": 0.0,
    }
    slope = float(side_force.normalised_side_force_slope(0.0, **coefficients))
    return Outcome(
        f"Tyre1, 340 N, 3.5 bar: B C D = {slope:.1f} 1/rad, B C D Fz = {slope * load:.0f} N/rad",
        judge_all(np.isclose(slope, measured)),
        {"product_per_rad": slope, "stiffness_N_per_rad": slope * load},
        f"the vertical load is missing; Table 2 has {np.radians(measured):.1f} N/deg = {measured:.0f} N/rad",
    )


@claim(section="4", statement="Table 7 holds values measured on the flat track (caption)", text="flat track")
def caption_of_table_7(tables: PaperTables) -> Outcome:
    length = tables.tyre1_drum.relaxation_length
    with_flat = np.degrees(tables.tyre1.cornering_stiffness) / length
    with_drum = tables.tyre1_drum.lateral_stiffness
    expected = tables.tyre1.lateral_stiffness
    off_flat, off_drum = (100 * float(np.abs(k / expected - 1).max()) for k in (with_flat, with_drum))
    return Outcome(
        f"K against Tables 2 and 6: off by up to {off_flat:.0f} % with Table 2, {off_drum:.1f} % with Table 3 (drum)",
        judge_all(off_flat < off_drum),
        {"with_table_2_percent": off_flat, "with_table_3_percent": off_drum},
        "the values are the drum's, as the symbol in the table says",
    )


@claim(section="2.2", statement="R^2 of eq. (6) is a correlation coefficient", text="correlation coefficient")
def r_squared_is_no_correlation_coefficient(tables: PaperTables) -> Outcome:
    data, model = tables.tyre1.relaxation_length.ravel(), tables.tyre1_drum.relaxation_length.ravel()
    r_squared = _r_squared(data, model)
    correlation = float(np.corrcoef(data, model)[0, 1])
    return Outcome(
        f"Table 6 predicted by Table 7: eq. (6) {r_squared:.3f}, correlation coefficient {correlation:.3f}",
        judge_all(np.isclose(r_squared, correlation)),
        {"r_squared": r_squared, "correlation": correlation},
        "it is the coefficient of determination",
    )


@claim(section="2.2", statement="R^2 of eq. (6) varies between 0 and 1", text="0 to 1")
def range_of_r_squared(tables: PaperTables) -> Outcome:
    data, model = tables.tyre1.cornering_stiffness.ravel(), tables.tyre1_drum.cornering_stiffness.ravel()
    r_squared = _r_squared(data, model)
    return Outcome(
        f"Table 2 predicted by Table 3: {plain(r_squared, 2)}",
        judge_all(0 <= r_squared <= 1),
        {"r_squared": r_squared},
        "negative for a model worse than the mean of the data",
    )


def _r_squared(data: np.ndarray, model: np.ndarray) -> float:
    return 1 - float(((data - model) ** 2).sum() / ((data - data.mean()) ** 2).sum())
