"""Claims of the paper about cornering stiffness (its Tables 2-5, Figs. 7-11)."""

import numpy as np

from studies.paper_audit.claim import (
    Outcome,
    PaperTables,
    claim,
    counted,
    judge_all,
    judge_number,
    percent_above,
    plain,
    signed,
)


@claim(section="3.2, 5", statement="C on flat track is on average 15 % higher than on the drum", text="15 %")
def cornering_stiffness_flat_over_drum(tables: PaperTables) -> Outcome:
    change = percent_above(tables.tyre1.cornering_stiffness, tables.tyre1_drum.cornering_stiffness)
    return Outcome(
        f"{change.mean():+.1f} % ({change.min():+.1f} to {change.max():+.1f})",
        judge_number(float(change.mean()), 15),
        {"mean_percent": float(change.mean())},
    )


@claim(section="3.2", statement="Flat track, Tyre1: 3.5 bar gives the lowest C at each load", text="each load")
def cornering_stiffness_at_3_5_bar_is_lowest(tables: PaperTables) -> Outcome:
    lowest = tables.tyre1.cornering_stiffness.argmin(axis=1) == 0
    return Outcome(
        f"{counted(lowest)} loads",
        judge_all(lowest),
        remark="at 340 and 400 N the lowest is at 7.5 bar (section 3.2 later)",
    )


@claim(section="3.2", statement="Drum at 340 N: the order over pressure is completely inverted", text="inverted")
def drum_cornering_stiffness_over_pressure_at_340_newton(tables: PaperTables) -> Outcome:
    drum = tables.tyre1_drum.cornering_stiffness[0]
    return Outcome(f"{plain(drum)} N/deg at 3.5, 5.5, 7.5 bar", judge_all(np.diff(drum) < 0))


@claim(section="3.2", statement="Flat track, Tyre1: C increases with load at 5.5 and 7.5 bar", text="increases")
def tyre1_cornering_stiffness_over_load(tables: PaperTables) -> Outcome:
    steps = np.diff(tables.tyre1.cornering_stiffness[:, 1:], axis=0)
    return Outcome(f"{counted(steps > 0)} steps of load", judge_all(steps > 0))


@claim(section="3.2", statement="Flat track, Tyre1, 3.5 bar: C decreases slightly above 400 N", text="slightly")
def tyre1_cornering_stiffness_above_400_newton(tables: PaperTables) -> Outcome:
    column = tables.tyre1.cornering_stiffness[:, 0]
    change = float(percent_above(column[2], column[1]))
    return Outcome(f"{change:+.1f} %", judge_all(-5 < change < 0), {"change_percent": change})


@claim(
    section="3.2", statement="Flat track, Tyre1, 340 N: C at 7.5 bar is smaller than at other pressures", text="smaller"
)
def tyre1_cornering_stiffness_at_340_newton(tables: PaperTables) -> Outcome:
    row = tables.tyre1.cornering_stiffness[0]
    return Outcome(f"{plain(row)} N/deg at 3.5, 5.5, 7.5 bar", judge_all(row[2] < row[:2]))


@claim(section="3.2", statement="Flat track, Tyre1, 490 N: the peak of C is at 7.5 bar", text="7.5 bar")
def tyre1_peak_cornering_stiffness_at_490_newton(tables: PaperTables) -> Outcome:
    row = tables.tyre1.cornering_stiffness[-1]
    peak = tables.tyre1.pressures[row.argmax()]
    return Outcome(f"{row.max():.1f} N/deg at {peak:g} bar", judge_all(peak == 7.5), {"pressure_bar": float(peak)})


@claim(section="3.2", statement="Drum: C increases with load", text="increases")
def drum_cornering_stiffness_over_load(tables: PaperTables) -> Outcome:
    steps = np.diff(tables.tyre1_drum.cornering_stiffness, axis=0)
    return Outcome(f"{counted(steps > 0)} steps of load", judge_all(steps > 0))


@claim(section="3.2", statement="Drum: at lower loads C is higher for low pressure", text="higher")
def drum_cornering_stiffness_at_low_load(tables: PaperTables) -> Outcome:
    low = tables.tyre1_drum.cornering_stiffness[:2]
    falls = np.diff(low, axis=1) < 0
    return Outcome(
        f"{counted(falls)} steps of pressure at 340 and 400 N",
        judge_all(falls),
        remark="at 400 N the highest is at 5.5 bar",
    )


@claim(section="3.2", statement="Drum, 340 N: C at 3.5 bar is 15 % higher than at 7.5 bar", text="15 %")
def drum_cornering_stiffness_at_3_5_against_7_5_bar(tables: PaperTables) -> Outcome:
    row = tables.tyre1_drum.cornering_stiffness[0]
    change = float(percent_above(row[0], row[2]))
    return Outcome(f"{change:+.1f} %", judge_number(change, 15), {"change_percent": change})


@claim(section="3.2", statement="Drum, 490 N: the peak of C is at 5.5 bar", text="5.5 bar")
def drum_peak_cornering_stiffness_at_490_newton(tables: PaperTables) -> Outcome:
    row = tables.tyre1_drum.cornering_stiffness[-1]
    peak = tables.tyre1_drum.pressures[row.argmax()]
    return Outcome(f"{row.max():.1f} N/deg at {peak:g} bar", judge_all(peak == 5.5), {"pressure_bar": float(peak)})


@claim(section="3.2", statement="Load influences C less on flat track than on the drum", text="smaller")
def influence_of_load_on_cornering_stiffness(tables: PaperTables) -> Outcome:
    flat, drum = (
        percent_above(grid.cornering_stiffness[2], grid.cornering_stiffness[0])
        for grid in (tables.tyre1, tables.tyre1_drum)
    )
    return Outcome(
        f"340 to 490 N: {signed(flat)} % on flat track, {signed(drum)} % on the drum",
        judge_all(flat < drum),
        {"flat_mean_percent": float(flat.mean()), "drum_mean_percent": float(drum.mean())},
    )


@claim(section="3.2", statement="C of Tyre1 is higher than that of Tyre2 for each pressure and load", text="each")
def cornering_stiffness_of_tyre1_against_tyre2(tables: PaperTables) -> Outcome:
    change = percent_above(tables.tyre1.cornering_stiffness, tables.tyre2.cornering_stiffness)
    return Outcome(
        f"{counted(change > 0)} conditions, {change.min():+.1f} to {change.max():+.1f} %",
        judge_all(change > 0),
        {"least_percent": float(change.min())},
        "equal at 490 N and 3.5 bar" if change[2, 0] == 0 else "",
    )


@claim(
    section="3.2",
    statement="490 N: the peak of C is at 7.5 bar for Tyre1, at 3.5 bar for Tyre2",
    text="7.5 and 3.5 bar",
)
def pressures_of_the_peaks_at_490_newton(tables: PaperTables) -> Outcome:
    peaks = [grid.pressures[grid.cornering_stiffness[-1].argmax()] for grid in (tables.tyre1, tables.tyre2)]
    return Outcome(f"{peaks[0]:g} and {peaks[1]:g} bar", judge_all([peaks[0] == 7.5, peaks[1] == 3.5]))


@claim(section="3.2", statement="Tyre2: C increases with load at each pressure", text="increasing")
def tyre2_cornering_stiffness_over_load(tables: PaperTables) -> Outcome:
    steps = np.diff(tables.tyre2.cornering_stiffness, axis=0)
    return Outcome(f"{counted(steps > 0)} steps of load", judge_all(steps > 0))


@claim(section="3.2", statement="490 N: C of Tyre2 equals that of Tyre1", text="equal")
def cornering_stiffness_of_tyre2_at_490_newton(tables: PaperTables) -> Outcome:
    change = percent_above(tables.tyre2.cornering_stiffness[-1], tables.tyre1.cornering_stiffness[-1])
    return Outcome(
        f"Tyre2 {signed(change)} % at 3.5, 5.5, 7.5 bar",
        judge_all(np.abs(change) < 1),
        {"least_percent": float(change.min())},
    )


@claim(section="3.2", statement="Tyre1 is past saturation at 490 N: its C decreases", text="decrease")
def tyre1_saturation_at_490_newton(tables: PaperTables) -> Outcome:
    change = percent_above(tables.tyre1.cornering_stiffness[2], tables.tyre1.cornering_stiffness[1])
    return Outcome(f"400 to 490 N: {signed(change)} % at 3.5, 5.5, 7.5 bar", judge_all(change < 0))


@claim(section="3.2, 5", statement="C of Tyre3 is higher than that of Tyre2 for each pressure and load", text="each")
def cornering_stiffness_of_tyre3_against_tyre2(tables: PaperTables) -> Outcome:
    change = percent_above(tables.tyre3.cornering_stiffness, tables.tyre2.cornering_stiffness)
    return Outcome(
        f"{counted(change > 0)} conditions, {change.min():+.1f} to {change.max():+.1f} %", judge_all(change > 0)
    )


@claim(section="3.2", statement="Tyre2 and Tyre3: C still increases at 490 N", text="no saturation")
def cornering_stiffness_of_tyre2_and_tyre3_up_to_490_newton(tables: PaperTables) -> Outcome:
    steps = np.array([np.diff(grid.cornering_stiffness, axis=0) for grid in (tables.tyre2, tables.tyre3)])
    return Outcome(f"{counted(steps > 0)} steps of load", judge_all(steps > 0))


@claim(section="3.2", statement="Mean difference of C between Tyre3 and Tyre2 is 8 N/deg", text="8 N/deg")
def mean_difference_of_tyre3_and_tyre2(tables: PaperTables) -> Outcome:
    mean = float((tables.tyre3.cornering_stiffness - tables.tyre2.cornering_stiffness).mean())
    return Outcome(f"{mean:.1f} N/deg", judge_number(mean, 8), {"mean_N_per_deg": mean})


@claim(section="3.2, 5", statement="C of Tyre3 is on average 6 % higher than that of Tyre2", text="6 %")
def mean_ratio_of_tyre3_and_tyre2(tables: PaperTables) -> Outcome:
    mean = float(percent_above(tables.tyre3.cornering_stiffness, tables.tyre2.cornering_stiffness).mean())
    return Outcome(f"{mean:+.1f} %", judge_number(mean, 6), {"mean_percent": mean})
