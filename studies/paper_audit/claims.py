"""Claims of the paper, each tested on the numbers of its own tables; C and K are cornering and lateral stiffness.

They stand by quantity: K (Figs. 5 and 6), C (Tables 2 to 5), relaxation length (Tables 6 to 9), formulas, captions.
"""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike

from studies.paper_audit.verdict import (
    Claim,
    Outcome,
    Tables,
    Test,
    counted,
    judge_all,
    judge_number,
    percent_above,
    plain,
    signed,
    spread_over,
)
from tyre.arrays import Array
from tyre.magic_formula import normalised_side_force_slope

SPEED = 9.3 / 3.6  # m/s, the paper's section 3.2
LAG_SHARE = 1 - np.exp(-1)  # of the steady force, after one time constant
CLAIMS: list[Claim] = []
"""Every claim, in the order in which they stand here."""


def claim(section: str, statement: str, text: str) -> Callable[[Test], Test]:
    """Register a function of the tables as the test of a claim: its section, what it says, the number as printed."""

    def make(test: Test) -> Test:
        CLAIMS.append(Claim(test.__name__.replace("_", " "), section, statement, text, test))
        return test

    return make


def each(true: ArrayLike, what: str, values: Mapping[str, float] | None = None, *, remark: str = "") -> Outcome:
    """Judge a statement about several conditions, and count them."""
    return Outcome(f"{counted(true)} {what}", judge_all(true), dict(values or {}), remark)


def above(change: Array, remark: str = "") -> Outcome:
    """Judge that every ``change``, %, is positive."""
    what = f"conditions, {change.min():+.1f} to {change.max():+.1f} %"
    return each(change > 0, what, {"least_percent": float(change.min())}, remark=remark)


def mean(change: Array, claimed: float, shown: str) -> Outcome:
    """Judge the mean of a ``change``, %, against the number of the text."""
    value = float(change.mean())
    return Outcome(f"{value:+.1f} % {shown}", judge_number(value, claimed), {"mean_percent": value})


def r_squared_of(data: Array, model: Array) -> float:
    """Coefficient of determination, eq. (6)."""
    return 1 - float(((data - model) ** 2).sum() / ((data - data.mean()) ** 2).sum())


@claim("3.1", "Tyre1: K depends largely on pressure", "largely")
def tyre1_lateral_stiffness_over_pressure(t: Tables) -> Outcome:
    means = t.tyre1.K.mean(axis=0)
    rise = percent_above(means[-1], means[0])
    shown = f"{plain(means)} N/mm at {plain(t.tyre1.pressures)} bar, {signed(rise)} %"
    return Outcome(shown, judge_all(np.diff(means) > 0), {"rise_percent": float(rise)})


@claim("3.1", "Tyre1: load has hardly any influence on K at 3.5 and 5.5 bar", "not great")
def tyre1_lateral_stiffness_over_load_at_low_pressure(t: Tables) -> Outcome:
    stiffness = t.tyre1.K[:, :2]
    spread = spread_over(stiffness, 0)
    return Outcome(
        f"spread {plain(spread, 2)} %", judge_all(spread < 5), {"largest_spread_percent": float(spread.max())}
    )


@claim("3.1", "Tyre1: K varies with load at 7.5 bar in the order of 10 %", "10 %")
def tyre1_lateral_stiffness_over_load_at_7_5_bar(t: Tables) -> Outcome:
    spreads, means = [], []
    for grid in (t.tyre1, t.tyre1_drum):
        stiffness = grid.K
        spreads.append(spread_over(stiffness, 0)[-1])
        means.append(stiffness.mean(axis=0))
    common = np.mean(means, axis=0)
    return Outcome(
        f"{spreads[0]:.2f} % on flat track, {spreads[1]:.2f} % on the drum",
        judge_number(spreads[0], 10),
        {
            "spread_percent": float(spreads[0]),
            **{
                f"K_at_{pressure:g}_bar_N_per_mm": float(value)
                for pressure, value in zip(t.tyre1.pressures, common, strict=True)
            },
        },
        f"K is one value per pressure, {plain(common)} N/mm, for all loads and both surfaces within the printed digits",
    )


@claim("3.1", "Tyre2: K changes with load as well as with pressure", "affected by both")
def tyre2_lateral_stiffness_over_load_and_pressure(t: Tables) -> Outcome:
    stiffness = t.tyre2.K
    over_load = spread_over(stiffness, 0)
    over_pressure = spread_over(stiffness, 1)
    return Outcome(
        f"spread over load {plain(over_load, 0)} %, over pressure {plain(over_pressure, 0)} %",
        judge_all(np.concatenate([over_load, over_pressure]) > 5),
        {"least_spread_percent": float(min(over_load.min(), over_pressure.min()))},
    )


@claim("3.1", "At 3.5 bar K of Tyre1 and Tyre2 is almost the same", "almost the same")
def lateral_stiffness_of_tyre2_against_tyre1_at_3_5_bar(t: Tables) -> Outcome:
    change = percent_above(t.tyre2.K, t.tyre1.K)[:, 0]
    return Outcome(
        f"Tyre2 {signed(change)} % of Tyre1 at 340, 400, 490 N",
        judge_all(np.abs(change) < 5),
        {"largest_difference_percent": float(np.abs(change).max())},
        "almost the same is read as within 5 %",
    )


@claim("3.1", "Tyre2 at 3.5 bar: K rises by up to 20 % from 340 to 400 N", "20 %")
def tyre2_lateral_stiffness_from_340_to_400_newton(t: Tables) -> Outcome:
    stiffness = t.tyre2.K[:, 0]
    rise = float(percent_above(stiffness[1], stiffness[0]))
    shown = f"{rise:+.1f} % ({plain(stiffness[:2])} N/mm)"
    remark = f"and it falls to {stiffness[2]:.1f} N/mm at 490 N"
    return Outcome(shown, judge_number(rise, 20), {"rise_percent": rise}, remark)


@claim("3.1", "Tyre2 at 5.5 bar: K rises with load", "increasing")
def tyre2_lateral_stiffness_over_load_at_5_5_bar(t: Tables) -> Outcome:
    stiffness = t.tyre2.K[:, 1]
    return Outcome(f"{plain(stiffness)} N/mm", judge_all(np.diff(stiffness) > 0))


@claim("3.1", "Tyre2: K at 5.5 bar reaches higher values than at 7.5 bar", "higher")
def tyre2_lateral_stiffness_at_5_5_against_7_5_bar(t: Tables) -> Outcome:
    stiffness = t.tyre2.K
    change = percent_above(stiffness[:, 1], stiffness[:, 2])
    return Outcome(
        f"{signed(change)} % at 340, 400, 490 N",
        judge_all(stiffness[:, 1].max() > stiffness[:, 2].max()),
        {"largest_percent": change.max()},
        "true from 400 N; at 340 N it is lower" if change[0] < 0 else "",
    )


@claim("3.1", "At 7.5 bar K of Tyre2 is 25 % lower than that of Tyre1", "-25 %")
def lateral_stiffness_of_tyre2_against_tyre1_at_7_5_bar(t: Tables) -> Outcome:
    change = percent_above(t.tyre2.K, t.tyre1.K)[:, -1]
    shown = f"{change.mean():+.1f} % on average ({signed(change)})"
    return Outcome(shown, judge_number(-change.mean(), 25), {"mean_percent": change.mean()})


@claim("3.1", "K of Tyre2 is larger than that of Tyre3 at the same pressure", "larger")
def lateral_stiffness_of_tyre2_against_tyre3(t: Tables) -> Outcome:
    change = percent_above(t.tyre2.K, t.tyre3.K)
    return above(
        change, "" if change.min() > 0 else "the exception, 340 N and 5.5 bar, is within the stated uncertainty"
    )


@claim("3.1", "Tyre3: K at 5.5 bar is higher than at 7.5 bar above 400 N", "higher")
def tyre3_lateral_stiffness_at_5_5_against_7_5_bar(t: Tables) -> Outcome:
    stiffness = t.tyre3.K
    change = percent_above(stiffness[:, 1], stiffness[:, 2])
    above = t.tyre3.loads > 400
    shown = f"{signed(change)} % at 340, 400, 490 N"
    remark = "and at 400 N already" if change[t.tyre3.row(400)] > 0 else ""
    return Outcome(shown, judge_all(change[above] > 0), {"at_490_N_percent": float(change[-1])}, remark)


@claim("3.2, 5", "C on flat track is on average 15 % higher than on the drum", "15 %")
def cornering_stiffness_flat_over_drum(t: Tables) -> Outcome:
    change = percent_above(t.tyre1.C, t.tyre1_drum.C)
    return mean(change, 15, f"({change.min():+.1f} to {change.max():+.1f})")


@claim("3.2", "Flat track, Tyre1: 3.5 bar gives the lowest C at each load", "each load")
def cornering_stiffness_at_3_5_bar_is_lowest(t: Tables) -> Outcome:
    lowest = t.tyre1.C.argmin(axis=1) == 0
    shown = f"{counted(lowest)} loads"
    return Outcome(shown, judge_all(lowest), remark="at 340 and 400 N the lowest is at 7.5 bar (section 3.2 later)")


@claim("3.2", "Drum at 340 N: the order over pressure is completely inverted", "inverted")
def drum_cornering_stiffness_over_pressure_at_340_newton(t: Tables) -> Outcome:
    drum = t.tyre1_drum.C[0]
    return Outcome(f"{plain(drum)} N/deg at 3.5, 5.5, 7.5 bar", judge_all(np.diff(drum) < 0))


@claim("3.2", "Flat track, Tyre1: C increases with load at 5.5 and 7.5 bar", "increases")
def tyre1_cornering_stiffness_over_load(t: Tables) -> Outcome:
    steps = np.diff(t.tyre1.C[:, 1:], axis=0)
    return each(steps > 0, "steps of load")


@claim("3.2", "Flat track, Tyre1, 3.5 bar: C decreases slightly above 400 N", "slightly")
def tyre1_cornering_stiffness_above_400_newton(t: Tables) -> Outcome:
    column = t.tyre1.C[:, 0]
    change = float(percent_above(column[2], column[1]))
    return Outcome(f"{change:+.1f} %", judge_all(-5 < change < 0), {"change_percent": change})


@claim("3.2", "Flat track, Tyre1, 340 N: C at 7.5 bar is smaller than at other pressures", "smaller")
def tyre1_cornering_stiffness_at_340_newton(t: Tables) -> Outcome:
    row = t.tyre1.C[0]
    return Outcome(f"{plain(row)} N/deg at 3.5, 5.5, 7.5 bar", judge_all(row[2] < row[:2]))


@claim("3.2", "Flat track, Tyre1, 490 N: the peak of C is at 7.5 bar", "7.5 bar")
def tyre1_peak_cornering_stiffness_at_490_newton(t: Tables) -> Outcome:
    row = t.tyre1.C[-1]
    peak = t.tyre1.pressures[row.argmax()]
    return Outcome(f"{row.max():.1f} N/deg at {peak:g} bar", judge_all(peak == 7.5), {"pressure_bar": float(peak)})


@claim("3.2", "Drum: C increases with load", "increases")
def drum_cornering_stiffness_over_load(t: Tables) -> Outcome:
    steps = np.diff(t.tyre1_drum.C, axis=0)
    return each(steps > 0, "steps of load")


@claim("3.2", "Drum: at lower loads C is higher for low pressure", "higher")
def drum_cornering_stiffness_at_low_load(t: Tables) -> Outcome:
    low = t.tyre1_drum.C[:2]
    falls = np.diff(low, axis=1) < 0
    shown = f"{counted(falls)} steps of pressure at 340 and 400 N"
    return Outcome(shown, judge_all(falls), remark="at 400 N the highest is at 5.5 bar")


@claim("3.2", "Drum, 340 N: C at 3.5 bar is 15 % higher than at 7.5 bar", "15 %")
def drum_cornering_stiffness_at_3_5_against_7_5_bar(t: Tables) -> Outcome:
    row = t.tyre1_drum.C[0]
    change = float(percent_above(row[0], row[2]))
    return Outcome(f"{change:+.1f} %", judge_number(change, 15), {"change_percent": change})


@claim("3.2", "Drum, 490 N: the peak of C is at 5.5 bar", "5.5 bar")
def drum_peak_cornering_stiffness_at_490_newton(t: Tables) -> Outcome:
    row = t.tyre1_drum.C[-1]
    peak = t.tyre1_drum.pressures[row.argmax()]
    return Outcome(f"{row.max():.1f} N/deg at {peak:g} bar", judge_all(peak == 5.5), {"pressure_bar": float(peak)})


@claim("3.2", "Load influences C less on flat track than on the drum", "smaller")
def influence_of_load_on_cornering_stiffness(t: Tables) -> Outcome:
    flat, drum = (percent_above(grid.C[2], grid.C[0]) for grid in (t.tyre1, t.tyre1_drum))
    return Outcome(
        f"340 to 490 N: {signed(flat)} % on flat track, {signed(drum)} % on the drum",
        judge_all(flat < drum),
        {"flat_mean_percent": float(flat.mean()), "drum_mean_percent": float(drum.mean())},
    )


@claim("3.2", "C of Tyre1 is higher than that of Tyre2 for each pressure and load", "each")
def cornering_stiffness_of_tyre1_against_tyre2(t: Tables) -> Outcome:
    change = percent_above(t.tyre1.C, t.tyre2.C)
    return above(change, "equal at 490 N and 3.5 bar" if change[2, 0] == 0 else "")


@claim("3.2", "490 N: the peak of C is at 7.5 bar for Tyre1, at 3.5 bar for Tyre2", "7.5 and 3.5 bar")
def pressures_of_the_peaks_at_490_newton(t: Tables) -> Outcome:
    peaks = [grid.pressures[grid.C[-1].argmax()] for grid in (t.tyre1, t.tyre2)]
    return Outcome(f"{peaks[0]:g} and {peaks[1]:g} bar", judge_all([peaks[0] == 7.5, peaks[1] == 3.5]))


@claim("3.2", "Tyre2: C increases with load at each pressure", "increasing")
def tyre2_cornering_stiffness_over_load(t: Tables) -> Outcome:
    steps = np.diff(t.tyre2.C, axis=0)
    return each(steps > 0, "steps of load")


@claim("3.2", "490 N: C of Tyre2 equals that of Tyre1", "equal")
def cornering_stiffness_of_tyre2_at_490_newton(t: Tables) -> Outcome:
    change = percent_above(t.tyre2.C[-1], t.tyre1.C[-1])
    shown = f"Tyre2 {signed(change)} % at 3.5, 5.5, 7.5 bar"
    return Outcome(shown, judge_all(np.abs(change) < 1), {"least_percent": change.min()})


@claim("3.2", "Tyre1 is past saturation at 490 N: its C decreases", "decrease")
def tyre1_saturation_at_490_newton(t: Tables) -> Outcome:
    change = percent_above(t.tyre1.C[2], t.tyre1.C[1])
    return Outcome(f"400 to 490 N: {signed(change)} % at 3.5, 5.5, 7.5 bar", judge_all(change < 0))


@claim("3.2, 5", "C of Tyre3 is higher than that of Tyre2 for each pressure and load", "each")
def cornering_stiffness_of_tyre3_against_tyre2(t: Tables) -> Outcome:
    change = percent_above(t.tyre3.C, t.tyre2.C)
    return Outcome(
        f"{counted(change > 0)} conditions, {change.min():+.1f} to {change.max():+.1f} %", judge_all(change > 0)
    )


@claim("3.2", "Tyre2 and Tyre3: C still increases at 490 N", "no saturation")
def cornering_stiffness_of_tyre2_and_tyre3_up_to_490_newton(t: Tables) -> Outcome:
    steps = np.array([np.diff(grid.C, axis=0) for grid in (t.tyre2, t.tyre3)])
    return each(steps > 0, "steps of load")


@claim("3.2", "Mean difference of C between Tyre3 and Tyre2 is 8 N/deg", "8 N/deg")
def mean_difference_of_tyre3_and_tyre2(t: Tables) -> Outcome:
    mean = float((t.tyre3.C - t.tyre2.C).mean())
    return Outcome(f"{mean:.1f} N/deg", judge_number(mean, 8), {"mean_N_per_deg": mean})


@claim("3.2, 5", "C of Tyre3 is on average 6 % higher than that of Tyre2", "6 %")
def mean_ratio_of_tyre3_and_tyre2(t: Tables) -> Outcome:
    mean = float(percent_above(t.tyre3.C, t.tyre2.C).mean())
    return Outcome(f"{mean:+.1f} %", judge_number(mean, 6), {"mean_percent": mean})


@claim("Abstract", "Relaxation length on flat track is on average 15 % higher than on the drum", "15 %")
def relaxation_length_flat_over_drum(t: Tables) -> Outcome:
    change = percent_above(t.tyre1.length, t.tyre1_drum.length)
    return mean(change, 15, f"({change.min():+.1f} to {change.max():+.1f})")


@claim("5", "Relaxation length on flat track is on average 11 % larger than on the drum at 7.5 bar", "11 %")
def relaxation_length_flat_over_drum_at_7_5_bar(t: Tables) -> Outcome:
    change = percent_above(t.tyre1.length, t.tyre1_drum.length).mean(axis=0)
    return Outcome(
        f"{change[2]:+.1f} %",
        judge_number(float(change[2]), 11),
        {"mean_percent": float(change[2]), "at_3_5_bar_percent": float(change[0])},
        f"{signed(change)} % at 3.5, 5.5, 7.5 bar: the number of the text is near the one at 3.5 bar",
    )


@claim("4", "Relaxation length is lower on the drum", "generally lower")
def relaxation_length_is_lower_on_the_drum(t: Tables) -> Outcome:
    lower = t.tyre1_drum.length < t.tyre1.length
    return Outcome(f"{counted(lower)} conditions", judge_all(lower))


@claim("4", "It is lower on the drum because of the smaller cornering stiffness", "due to C")
def relaxation_length_follows_cornering_stiffness_on_the_drum(t: Tables) -> Outcome:
    length = percent_above(t.tyre1.length, t.tyre1_drum.length)
    stiffness = percent_above(t.tyre1.C, t.tyre1_drum.C)
    gap = np.abs(length - stiffness)
    shown = f"the two ratios differ by at most {gap.max():.2f} points"
    remark = "by construction: the drum values use the lateral stiffness of the flat track"
    return Outcome(shown, judge_all(gap < 0.5), {"largest_gap_points": float(gap.max())}, remark)


@claim("4", "Tyre1: relaxation length tends to increase with load", "tends to increase")
def tyre1_relaxation_length_over_load(t: Tables) -> Outcome:
    steps = np.array([np.diff(grid.length, axis=0) for grid in (t.tyre1, t.tyre1_drum)])
    return each(steps > 0, "steps of load", remark="the exception: flat track, 3.5 bar, 400 to 490 N")


@claim("5", "Relaxation length increases with load (all tyres)", "increases")
def relaxation_length_over_load(t: Tables) -> Outcome:
    rises = {name: np.diff(grid.length, axis=0) > 0 for name, grid in t.all.items()}
    return Outcome(
        f"{counted(np.array(list(rises.values())))} steps of load",
        judge_all(np.array(list(rises.values()))),
        remark="; ".join(f"{name} {counted(rise)}" for name, rise in rises.items()),
    )


@claim("4", "Direction: relaxation length increases while pressure decreases (Fig. 12)", "increases")
def direction_of_pressure_dependence(t: Tables) -> Outcome:
    falls = {name: np.diff(grid.length, axis=1) < 0 for name, grid in t.all.items()}
    tyre1 = np.array([falls["Tyre1 flat"], falls["Tyre1 drum"]])
    return Outcome(
        f"{counted(tyre1)} steps of pressure for Tyre1",
        judge_all(tyre1),
        remark=f"not so for Tyre2 ({counted(falls['Tyre2 flat'])}) and Tyre3 ({counted(falls['Tyre3 flat'])})",
    )


@claim("4, 5", "Relaxation length of Tyre1 almost doubles over the range of pressure", "almost doubled")
def almost_doubled(t: Tables) -> Outcome:
    ratio = np.concatenate([grid.length[:, 0] / grid.length[:, 2] for grid in (t.tyre1, t.tyre1_drum)])
    return Outcome(
        f"factor {ratio.min():.2f} to {ratio.max():.2f}",
        judge_all(ratio >= 1.8),
        {"least_factor": float(ratio.min()), "largest_factor": float(ratio.max())},
        "almost doubled is read as a factor of at least 1.8: on the drum at 340 N only",
    )


@claim("4, 5", "Direction: it doubles when passing from 3.5 bar to 7.5 bar", "rise with pressure")
def direction_of_the_doubling(t: Tables) -> Outcome:
    change = np.concatenate([percent_above(grid.length[:, 2], grid.length[:, 0]) for grid in (t.tyre1, t.tyre1_drum)])
    shown = f"{signed(change, 0)} %"
    remark = "it falls; the words belong to the way from 7.5 to 3.5 bar"
    return Outcome(shown, judge_all(change > 0), {"largest_percent": change.max()}, remark)


@claim("4", "Relaxation length of Tyre2 is more sensitive to load than that of Tyre1", "more")
def sensitivity_to_load_of_tyre2_against_tyre1(t: Tables) -> Outcome:
    one, two = (spread_over(grid.length, 0) for grid in (t.tyre1, t.tyre2))
    return Outcome(f"spread over load {plain(one, 0)} % for Tyre1, {plain(two, 0)} % for Tyre2", judge_all(two > one))


@claim("4", "7.5 bar: Tyre2 lies on average 13 % above Tyre1", "13 %")
def shift_of_tyre2_at_7_5_bar(t: Tables) -> Outcome:
    change = percent_above(t.tyre2.length, t.tyre1.length)[:, 2]
    return mean(change, 13, f"({signed(change)})")


@claim("4", "3.5 bar: Tyre2 has its peak at 490 N, 24 % above Tyre1", "+24 %")
def peak_of_tyre2_at_3_5_bar(t: Tables) -> Outcome:
    column = t.tyre2.length[:, 0]
    change = float(percent_above(column[2], t.tyre1.length[2, 0]))
    verdict = judge_number(change, 24) if column.argmax() == 2 else "fails"
    return Outcome(f"{change:+.1f} %", verdict, {"change_percent": change})


@claim("4", "The lowest relaxation length is that of Tyre2 at 490 N and 5.5 bar", "Tyre2, 490 N, 5.5 bar")
def lowest_relaxation_length(t: Tables) -> Outcome:
    def lowest(names: list[str]) -> tuple[str, float]:
        name = min(names, key=lambda key: t.all[key].length.min())
        grid = t.all[name]
        row, column = np.unravel_index(grid.length.argmin(), grid.length.shape)
        value = float(grid.length[row, column])
        return f"{name}, {grid.loads[row]:g} N, {grid.pressures[column]:g} bar ({value:.1f} mm)", value

    claimed = float(t.tyre2.length[t.tyre2.row(490), t.tyre2.column(5.5)])
    places = {
        "of all tables": lowest(list(t.all)),
        "on flat track": lowest(["Tyre1 flat", "Tyre2 flat", "Tyre3 flat"]),
        "in Tables 8 and 9, which the text cites": lowest(["Tyre2 flat", "Tyre3 flat"]),
    }
    return Outcome(
        places["of all tables"][0],
        judge_all([value == claimed for _, value in places.values()]),
        {"lowest_mm": places["of all tables"][1], "claimed_place_mm": claimed},
        "lowest "
        + "; ".join(f"{where}: {what}" for where, (what, _) in places.items())
        + f"; the text's: {claimed:.1f} mm",
    )


@claim("4, 5", "The 28 mm tyre (Tyre3) has a higher relaxation length than the 26 mm one (Tyre2)", "higher")
def relaxation_length_of_tyre3_against_tyre2(t: Tables) -> Outcome:
    change = percent_above(t.tyre3.length, t.tyre2.length)
    gap = float((t.tyre3.length - t.tyre2.length).min())
    return above(
        change, f"the least gap, {gap:.1f} mm, is within the stated 3 mm of each value" if gap < 3 * np.sqrt(2) else ""
    )


@claim("4", "Tyre2 and Tyre3: relaxation length is higher at 7.5 bar than at 5.5 bar", "higher")
def relaxation_length_at_7_5_against_5_5_bar(t: Tables) -> Outcome:
    change = np.array([percent_above(grid.length[:, 2], grid.length[:, 1]) for grid in (t.tyre2, t.tyre3)])
    shown = f"{counted(change > 0)} conditions"
    remark = f"340, 400, 490 N: Tyre2 {signed(change[0])} %, Tyre3 {signed(change[1])} %: a fall at 340 N, a rise above"
    return Outcome(shown, judge_all(change > 0), {"mean_percent": change.mean()}, remark)


@claim("4", "Slip between the layers at high pressure decreases the relaxation length of Tyre2 and Tyre3", "decrease")
def explanation_by_slip_between_layers(t: Tables) -> Outcome:
    change = np.array([grid.length[1:, 2] - grid.length[1:, 1] for grid in (t.tyre2, t.tyre3)])
    shown = f"5.5 to 7.5 bar at 400 and 490 N: {signed(change.ravel())} mm"
    remark = "the sentence before says it rises; slip between layers softens the tyre, and a lower K lengthens it"
    return Outcome(shown, judge_all(change < 0), {"least_mm": change.min()}, remark)


@claim("5", "Tyre1: relaxation length is much more sensitive to pressure than to load", "much more")
def sensitivity_to_pressure_against_load(t: Tables) -> Outcome:
    length = t.tyre1.length
    over_pressure = spread_over(length, 1)
    over_load = spread_over(length, 0)
    return Outcome(
        f"spread over pressure {plain(over_pressure, 0)} %, over load {plain(over_load, 0)} %",
        judge_all(over_pressure.min() > 2 * over_load.max()),
        {
            "least_over_pressure_percent": float(over_pressure.min()),
            "largest_over_load_percent": float(over_load.max()),
        },
    )


@claim("4", "All values exceed the 40-60 mm that reference [30] measured", "40-60 mm")
def values_against_reference_30(t: Tables) -> Outcome:
    lowest = min(float(grid.length.min()) for grid in t.all.values())
    return Outcome(f"lowest {lowest:.1f} mm", judge_all(lowest > 60), {"lowest_mm": lowest})


@claim("1.1", "One relaxation length after a slip step the side force has reached 63 %", "63 %")
def share_of_the_steady_force(t: Tables) -> Outcome:
    share = 100 * float(LAG_SHARE)
    return Outcome(f"{share:.1f} % for eq. (1)", judge_all(abs(share - 63) < 0.5), {"share_percent": share})


@claim("1.1", "Eq. (2), F (1 - exp(-(lambda/v) t)), solves eq. (1)", "lambda/v")
def exponent_of_equation_2(t: Tables) -> Outcome:
    length = float(t.tyre1.length[0, 0]) / 1e3
    time_constant = length / SPEED
    printed = 1 - np.exp(-length / SPEED * time_constant)
    corrected = 1 - np.exp(-SPEED / length * time_constant)
    return Outcome(
        f"after one time constant: printed {100 * printed:.2f} %, with v/lambda {100 * corrected:.1f} %",
        judge_all(np.isclose(printed, LAG_SHARE)),
        {"printed_share_percent": 100 * float(printed), "corrected_share_percent": 100 * float(corrected)},
        "should read F (1 - exp(-v t / lambda)); the printed exponent has the unit s^2",
    )


@claim("1.1", "The time to 63 % divided by the speed is the relaxation length", "t / v")
def time_divided_by_speed(t: Tables) -> Outcome:
    length = float(t.tyre1.length[0, 0]) / 1e3
    time = length / SPEED
    shown = f"{1e3 * length:.1f} mm at 9.3 km/h: t v = {1e3 * time * SPEED:.1f} mm, t / v = {time / SPEED:.3f} s^2/m"
    remark = "the time is multiplied by the speed; t / v is no length"
    return Outcome(shown, judge_all(np.isclose(time / SPEED, length)), {"time_s": time}, remark)


@claim("2.2", "Eq. (5): the cornering stiffness is B C D of the fit to Fy / Fz", "B C D")
def load_missing_in_equation_5(t: Tables) -> Outcome:
    load = float(t.tyre1.loads[0])
    measured = float(np.degrees(t.tyre1.C[0, 0]))
    shape, peak = 1.3, 1.0  # any curve through the measured slope will do
    coefficients = {
        "stiffness_factor": measured / (shape * peak * load),
        "shape_factor": shape,
        "peak_factor": peak,
        "curvature_factor": 0.0,
    }
    slope = float(normalised_side_force_slope(0.0, **coefficients))
    return Outcome(
        f"Tyre1, 340 N, 3.5 bar: B C D = {slope:.1f} 1/rad, B C D Fz = {slope * load:.0f} N/rad",
        judge_all(np.isclose(slope, measured)),
        {"product_per_rad": slope, "stiffness_N_per_rad": slope * load},
        f"the vertical load is missing; Table 2 has {np.radians(measured):.1f} N/deg = {measured:.0f} N/rad",
    )


@claim("4", "Table 7 holds values measured on the flat track (caption)", "flat track")
def caption_of_table_7(t: Tables) -> Outcome:
    length = t.tyre1_drum.length
    with_flat = np.degrees(t.tyre1.C) / length
    with_drum = t.tyre1_drum.K
    expected = t.tyre1.K
    off_flat, off_drum = (100 * float(np.abs(k / expected - 1).max()) for k in (with_flat, with_drum))
    return Outcome(
        f"K against Tables 2 and 6: off by up to {off_flat:.0f} % with Table 2, {off_drum:.1f} % with Table 3 (drum)",
        judge_all(off_flat < off_drum),
        {"with_table_2_percent": off_flat, "with_table_3_percent": off_drum},
        "the values are the drum's, as the symbol in the table says",
    )


@claim("2.2", "R^2 of eq. (6) is a correlation coefficient", "correlation coefficient")
def r_squared_is_no_correlation_coefficient(t: Tables) -> Outcome:
    data, model = t.tyre1.length.ravel(), t.tyre1_drum.length.ravel()
    r_squared = r_squared_of(data, model)
    correlation = float(np.corrcoef(data, model)[0, 1])
    return Outcome(
        f"Table 6 predicted by Table 7: eq. (6) {r_squared:.3f}, correlation coefficient {correlation:.3f}",
        judge_all(np.isclose(r_squared, correlation)),
        {"r_squared": r_squared, "correlation": correlation},
        "it is the coefficient of determination",
    )


@claim("2.2", "R^2 of eq. (6) varies between 0 and 1", "0 to 1")
def range_of_r_squared(t: Tables) -> Outcome:
    data, model = t.tyre1.C.ravel(), t.tyre1_drum.C.ravel()
    r_squared = r_squared_of(data, model)
    shown = f"Table 2 predicted by Table 3: {plain(r_squared, 2)}"
    remark = "negative for a model worse than the mean of the data"
    return Outcome(shown, judge_all(0 <= r_squared <= 1), {"r_squared": r_squared}, remark)
