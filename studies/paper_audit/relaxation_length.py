"""Claims of the paper about relaxation length (its Tables 6-9, Figs. 12-14)."""

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


@claim(
    section="Abstract",
    statement="Relaxation length on flat track is on average 15 % higher than on the drum",
    text="15 %",
)
def relaxation_length_flat_over_drum(tables: PaperTables) -> Outcome:
    change = percent_above(tables.tyre1.relaxation_length, tables.tyre1_drum.relaxation_length)
    return Outcome(
        f"{change.mean():+.1f} % ({change.min():+.1f} to {change.max():+.1f})",
        judge_number(float(change.mean()), 15),
        {"mean_percent": float(change.mean())},
    )


@claim(
    section="5",
    statement="Relaxation length on flat track is on average 11 % larger than on the drum at 7.5 bar",
    text="11 %",
)
def relaxation_length_flat_over_drum_at_7_5_bar(tables: PaperTables) -> Outcome:
    change = percent_above(tables.tyre1.relaxation_length, tables.tyre1_drum.relaxation_length).mean(axis=0)
    return Outcome(
        f"{change[2]:+.1f} %",
        judge_number(float(change[2]), 11),
        {"mean_percent": float(change[2]), "at_3_5_bar_percent": float(change[0])},
        f"{signed(change)} % at 3.5, 5.5, 7.5 bar: the number of the text is near the one at 3.5 bar",
    )


@claim(section="4", statement="Relaxation length is lower on the drum", text="generally lower")
def relaxation_length_is_lower_on_the_drum(tables: PaperTables) -> Outcome:
    lower = tables.tyre1_drum.relaxation_length < tables.tyre1.relaxation_length
    return Outcome(f"{counted(lower)} conditions", judge_all(lower))


@claim(section="4", statement="It is lower on the drum because of the smaller cornering stiffness", text="due to C")
def relaxation_length_follows_cornering_stiffness_on_the_drum(tables: PaperTables) -> Outcome:
    length = percent_above(tables.tyre1.relaxation_length, tables.tyre1_drum.relaxation_length)
    stiffness = percent_above(tables.tyre1.cornering_stiffness, tables.tyre1_drum.cornering_stiffness)
    gap = np.abs(length - stiffness)
    return Outcome(
        f"the two ratios differ by at most {gap.max():.2f} points",
        judge_all(gap < 0.5),
        {"largest_gap_points": float(gap.max())},
        "by construction: the drum values use the lateral stiffness of the flat track",
    )


@claim(section="4", statement="Tyre1: relaxation length tends to increase with load", text="tends to increase")
def tyre1_relaxation_length_over_load(tables: PaperTables) -> Outcome:
    steps = np.array([np.diff(grid.relaxation_length, axis=0) for grid in (tables.tyre1, tables.tyre1_drum)])
    return Outcome(
        f"{counted(steps > 0)} steps of load",
        judge_all(steps > 0),
        remark="the exception: flat track, 3.5 bar, 400 to 490 N",
    )


@claim(section="5", statement="Relaxation length increases with load (all tyres)", text="increases")
def relaxation_length_over_load(tables: PaperTables) -> Outcome:
    rises = {name: np.diff(grid.relaxation_length, axis=0) > 0 for name, grid in tables.all.items()}
    return Outcome(
        f"{counted(np.array(list(rises.values())))} steps of load",
        judge_all(np.array(list(rises.values()))),
        remark="; ".join(f"{name} {counted(rise)}" for name, rise in rises.items()),
    )


@claim(
    section="4", statement="Direction: relaxation length increases while pressure decreases (Fig. 12)", text="increases"
)
def direction_of_pressure_dependence(tables: PaperTables) -> Outcome:
    falls = {name: np.diff(grid.relaxation_length, axis=1) < 0 for name, grid in tables.all.items()}
    tyre1 = np.array([falls["Tyre1 flat"], falls["Tyre1 drum"]])
    return Outcome(
        f"{counted(tyre1)} steps of pressure for Tyre1",
        judge_all(tyre1),
        remark=f"not so for Tyre2 ({counted(falls['Tyre2 flat'])}) and Tyre3 ({counted(falls['Tyre3 flat'])})",
    )


@claim(
    section="4, 5",
    statement="Relaxation length of Tyre1 almost doubles over the range of pressure",
    text="almost doubled",
)
def almost_doubled(tables: PaperTables) -> Outcome:
    ratio = np.concatenate(
        [grid.relaxation_length[:, 0] / grid.relaxation_length[:, 2] for grid in (tables.tyre1, tables.tyre1_drum)]
    )
    return Outcome(
        f"factor {ratio.min():.2f} to {ratio.max():.2f}",
        judge_all(ratio >= 1.8),
        {"least_factor": float(ratio.min()), "largest_factor": float(ratio.max())},
        "almost doubled is read as a factor of at least 1.8: on the drum at 340 N only",
    )


@claim(
    section="4, 5", statement="Direction: it doubles when passing from 3.5 bar to 7.5 bar", text="rise with pressure"
)
def direction_of_the_doubling(tables: PaperTables) -> Outcome:
    change = np.concatenate(
        [
            percent_above(grid.relaxation_length[:, 2], grid.relaxation_length[:, 0])
            for grid in (tables.tyre1, tables.tyre1_drum)
        ]
    )
    return Outcome(
        f"{signed(change, 0)} %",
        judge_all(change > 0),
        {"largest_percent": float(change.max())},
        "it falls; the words belong to the way from 7.5 to 3.5 bar",
    )


@claim(section="4", statement="Relaxation length of Tyre2 is more sensitive to load than that of Tyre1", text="more")
def sensitivity_to_load_of_tyre2_against_tyre1(tables: PaperTables) -> Outcome:
    one, two = (
        percent_above(grid.relaxation_length.max(axis=0), grid.relaxation_length.min(axis=0))
        for grid in (tables.tyre1, tables.tyre2)
    )
    return Outcome(f"spread over load {plain(one, 0)} % for Tyre1, {plain(two, 0)} % for Tyre2", judge_all(two > one))


@claim(section="4", statement="7.5 bar: Tyre2 lies on average 13 % above Tyre1", text="13 %")
def shift_of_tyre2_at_7_5_bar(tables: PaperTables) -> Outcome:
    change = percent_above(tables.tyre2.relaxation_length, tables.tyre1.relaxation_length)[:, 2]
    return Outcome(
        f"{change.mean():+.1f} % ({signed(change)})",
        judge_number(float(change.mean()), 13),
        {"mean_percent": float(change.mean())},
    )


@claim(section="4", statement="3.5 bar: Tyre2 has its peak at 490 N, 24 % above Tyre1", text="+24 %")
def peak_of_tyre2_at_3_5_bar(tables: PaperTables) -> Outcome:
    column = tables.tyre2.relaxation_length[:, 0]
    change = float(percent_above(column[2], tables.tyre1.relaxation_length[2, 0]))
    verdict = judge_number(change, 24) if column.argmax() == 2 else "fails"
    return Outcome(f"{change:+.1f} %", verdict, {"change_percent": change})


@claim(
    section="4",
    statement="The lowest relaxation length is that of Tyre2 at 490 N and 5.5 bar",
    text="Tyre2, 490 N, 5.5 bar",
)
def lowest_relaxation_length(tables: PaperTables) -> Outcome:
    def lowest(names: list[str]) -> tuple[str, float]:
        name = min(names, key=lambda key: tables.all[key].relaxation_length.min())
        grid = tables.all[name]
        row, column = np.unravel_index(grid.relaxation_length.argmin(), grid.relaxation_length.shape)
        value = float(grid.relaxation_length[row, column])
        return f"{name}, {grid.loads[row]:g} N, {grid.pressures[column]:g} bar ({value:.1f} mm)", value

    claimed = float(tables.tyre2.relaxation_length[tables.tyre2.row(490), tables.tyre2.column(5.5)])
    places = {
        "of all tables": lowest(list(tables.all)),
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


@claim(
    section="4, 5",
    statement="The 28 mm tyre (Tyre3) has a higher relaxation length than the 26 mm one (Tyre2)",
    text="higher",
)
def relaxation_length_of_tyre3_against_tyre2(tables: PaperTables) -> Outcome:
    change = percent_above(tables.tyre3.relaxation_length, tables.tyre2.relaxation_length)
    gap = float((tables.tyre3.relaxation_length - tables.tyre2.relaxation_length).min())
    return Outcome(
        f"{counted(change > 0)} conditions, {change.min():+.1f} to {change.max():+.1f} %",
        judge_all(change > 0),
        {"least_percent": float(change.min())},
        f"the least gap, {gap:.1f} mm, is within the stated 3 mm of each value" if gap < 3 * np.sqrt(2) else "",
    )


@claim(section="4", statement="Tyre2 and Tyre3: relaxation length is higher at 7.5 bar than at 5.5 bar", text="higher")
def relaxation_length_at_7_5_against_5_5_bar(tables: PaperTables) -> Outcome:
    change = np.array(
        [
            percent_above(grid.relaxation_length[:, 2], grid.relaxation_length[:, 1])
            for grid in (tables.tyre2, tables.tyre3)
        ]
    )
    return Outcome(
        f"{counted(change > 0)} conditions",
        judge_all(change > 0),
        {"mean_percent": float(change.mean())},
        f"340, 400, 490 N: Tyre2 {signed(change[0])} %, Tyre3 {signed(change[1])} %: a fall at 340 N, a rise above",
    )


@claim(
    section="4",
    statement="Slip between the layers at high pressure decreases the relaxation length of Tyre2 and Tyre3",
    text="decrease",
)
def explanation_by_slip_between_layers(tables: PaperTables) -> Outcome:
    change = np.array(
        [grid.relaxation_length[1:, 2] - grid.relaxation_length[1:, 1] for grid in (tables.tyre2, tables.tyre3)]
    )
    return Outcome(
        f"5.5 to 7.5 bar at 400 and 490 N: {signed(change.ravel())} mm",
        judge_all(change < 0),
        {"least_mm": float(change.min())},
        "the sentence before says it rises; slip between layers softens the tyre, and a lower K lengthens it",
    )


@claim(
    section="5", statement="Tyre1: relaxation length is much more sensitive to pressure than to load", text="much more"
)
def sensitivity_to_pressure_against_load(tables: PaperTables) -> Outcome:
    length = tables.tyre1.relaxation_length
    over_pressure = percent_above(length.max(axis=1), length.min(axis=1))
    over_load = percent_above(length.max(axis=0), length.min(axis=0))
    return Outcome(
        f"spread over pressure {plain(over_pressure, 0)} %, over load {plain(over_load, 0)} %",
        judge_all(over_pressure.min() > 2 * over_load.max()),
        {
            "least_over_pressure_percent": float(over_pressure.min()),
            "largest_over_load_percent": float(over_load.max()),
        },
    )


@claim(section="4", statement="All values exceed the 40-60 mm that reference [30] measured", text="40-60 mm")
def values_against_reference_30(tables: PaperTables) -> Outcome:
    lowest = min(float(grid.relaxation_length.min()) for grid in tables.all.values())
    return Outcome(f"lowest {lowest:.1f} mm", judge_all(lowest > 60), {"lowest_mm": lowest})
