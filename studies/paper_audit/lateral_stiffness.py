"""Claims of the paper about lateral stiffness (its Figs. 5 and 6), tested on C_Fy / relaxation length of its tables."""

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


@claim(section="3.1", statement="Tyre1: K depends largely on pressure", text="largely")
def tyre1_lateral_stiffness_over_pressure(tables: PaperTables) -> Outcome:
    means = tables.tyre1.lateral_stiffness.mean(axis=0)
    rise = percent_above(means[-1], means[0])
    return Outcome(
        f"{plain(means)} N/mm at {plain(tables.tyre1.pressures)} bar, {signed(rise)} %",
        judge_all(np.diff(means) > 0),
        {"rise_percent": float(rise)},
    )


@claim(section="3.1", statement="Tyre1: load has hardly any influence on K at 3.5 and 5.5 bar", text="not great")
def tyre1_lateral_stiffness_over_load_at_low_pressure(tables: PaperTables) -> Outcome:
    stiffness = tables.tyre1.lateral_stiffness[:, :2]
    spread = percent_above(stiffness.max(axis=0), stiffness.min(axis=0))
    return Outcome(
        f"spread {plain(spread, 2)} %", judge_all(spread < 5), {"largest_spread_percent": float(spread.max())}
    )


@claim(section="3.1", statement="Tyre1: K varies with load at 7.5 bar in the order of 10 %", text="10 %")
def tyre1_lateral_stiffness_over_load_at_7_5_bar(tables: PaperTables) -> Outcome:
    spreads, means = [], []
    for grid in (tables.tyre1, tables.tyre1_drum):
        stiffness = grid.lateral_stiffness
        spreads.append(percent_above(stiffness.max(axis=0), stiffness.min(axis=0))[-1])
        means.append(stiffness.mean(axis=0))
    common = np.mean(means, axis=0)
    return Outcome(
        f"{spreads[0]:.2f} % on flat track, {spreads[1]:.2f} % on the drum",
        judge_number(spreads[0], 10),
        {
            "spread_percent": float(spreads[0]),
            **{
                f"K_at_{pressure:g}_bar_N_per_mm": float(value)
                for pressure, value in zip(tables.tyre1.pressures, common, strict=True)
            },
        },
        f"K is one value per pressure, {plain(common)} N/mm, for all loads and both surfaces within the printed digits",
    )


@claim(section="3.1", statement="Tyre2: K changes with load as well as with pressure", text="affected by both")
def tyre2_lateral_stiffness_over_load_and_pressure(tables: PaperTables) -> Outcome:
    stiffness = tables.tyre2.lateral_stiffness
    over_load = percent_above(stiffness.max(axis=0), stiffness.min(axis=0))
    over_pressure = percent_above(stiffness.max(axis=1), stiffness.min(axis=1))
    return Outcome(
        f"spread over load {plain(over_load, 0)} %, over pressure {plain(over_pressure, 0)} %",
        judge_all(np.concatenate([over_load, over_pressure]) > 5),
        {"least_spread_percent": float(min(over_load.min(), over_pressure.min()))},
    )


@claim(section="3.1", statement="At 3.5 bar K of Tyre1 and Tyre2 is almost the same", text="almost the same")
def lateral_stiffness_of_tyre2_against_tyre1_at_3_5_bar(tables: PaperTables) -> Outcome:
    change = percent_above(tables.tyre2.lateral_stiffness, tables.tyre1.lateral_stiffness)[:, 0]
    return Outcome(
        f"Tyre2 {signed(change)} % of Tyre1 at 340, 400, 490 N",
        judge_all(np.abs(change) < 5),
        {"largest_difference_percent": float(np.abs(change).max())},
        "almost the same is read as within 5 %",
    )


@claim(section="3.1", statement="Tyre2 at 3.5 bar: K rises by up to 20 % from 340 to 400 N", text="20 %")
def tyre2_lateral_stiffness_from_340_to_400_newton(tables: PaperTables) -> Outcome:
    stiffness = tables.tyre2.lateral_stiffness[:, 0]
    rise = float(percent_above(stiffness[1], stiffness[0]))
    return Outcome(
        f"{rise:+.1f} % ({plain(stiffness[:2])} N/mm)",
        judge_number(rise, 20),
        {"rise_percent": rise},
        f"and it falls to {stiffness[2]:.1f} N/mm at 490 N",
    )


@claim(section="3.1", statement="Tyre2 at 5.5 bar: K rises with load", text="increasing")
def tyre2_lateral_stiffness_over_load_at_5_5_bar(tables: PaperTables) -> Outcome:
    stiffness = tables.tyre2.lateral_stiffness[:, 1]
    return Outcome(f"{plain(stiffness)} N/mm", judge_all(np.diff(stiffness) > 0))


@claim(section="3.1", statement="Tyre2: K at 5.5 bar reaches higher values than at 7.5 bar", text="higher")
def tyre2_lateral_stiffness_at_5_5_against_7_5_bar(tables: PaperTables) -> Outcome:
    stiffness = tables.tyre2.lateral_stiffness
    change = percent_above(stiffness[:, 1], stiffness[:, 2])
    return Outcome(
        f"{signed(change)} % at 340, 400, 490 N",
        judge_all(stiffness[:, 1].max() > stiffness[:, 2].max()),
        {"largest_percent": float(change.max())},
        "true from 400 N; at 340 N it is lower" if change[0] < 0 else "",
    )


@claim(section="3.1", statement="At 7.5 bar K of Tyre2 is 25 % lower than that of Tyre1", text="-25 %")
def lateral_stiffness_of_tyre2_against_tyre1_at_7_5_bar(tables: PaperTables) -> Outcome:
    change = percent_above(tables.tyre2.lateral_stiffness, tables.tyre1.lateral_stiffness)[:, -1]
    return Outcome(
        f"{change.mean():+.1f} % on average ({signed(change)})",
        judge_number(-float(change.mean()), 25),
        {"mean_percent": float(change.mean())},
    )


@claim(section="3.1", statement="K of Tyre2 is larger than that of Tyre3 at the same pressure", text="larger")
def lateral_stiffness_of_tyre2_against_tyre3(tables: PaperTables) -> Outcome:
    change = percent_above(tables.tyre2.lateral_stiffness, tables.tyre3.lateral_stiffness)
    return Outcome(
        f"{counted(change > 0)} conditions, {change.min():+.1f} to {change.max():+.1f} %",
        judge_all(change > 0),
        {"least_percent": float(change.min())},
        "" if change.min() > 0 else "the exception, 340 N and 5.5 bar, is within the stated uncertainty",
    )


@claim(section="3.1", statement="Tyre3: K at 5.5 bar is higher than at 7.5 bar above 400 N", text="higher")
def tyre3_lateral_stiffness_at_5_5_against_7_5_bar(tables: PaperTables) -> Outcome:
    stiffness = tables.tyre3.lateral_stiffness
    change = percent_above(stiffness[:, 1], stiffness[:, 2])
    above = tables.tyre3.loads > 400
    return Outcome(
        f"{signed(change)} % at 340, 400, 490 N",
        judge_all(change[above] > 0),
        {"at_490_N_percent": float(change[-1])},
        "and at 400 N already" if change[tables.tyre3.row(400)] > 0 else "",
    )
