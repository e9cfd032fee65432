"""Does the model agree with what riders report of wobble?

Populations of bicycles with riders (``rider_populations``) under several assumptions about what nobody measured, each
with the share that wobbles: hands off from 5 to 15 m/s, hands off at 4 m/s or below, hands on from 5 to 22 m/s. The
comparison uses bands, set by judgement from data/validation/shimmy_reports.csv: no base rate of wobble is
known. Then the rivals of a rider who turns on the saddle (``rider_rivals``), one at a time and together, the signs that
riders report, and knees on the top tube.
"""

import csv
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from bicycle import effect_class
from studies.main_study import ASSUMED, LIMITS, Ranges
from studies.reporting import drawing
from tests.validation import rider_rivals as rivals
from tests.validation.rider_populations import (
    CITY,
    GROWTH,
    HANDS_OFF,
    LIGHT,
    ON,
    RELAXED,
    SPEEDS,
    TENSE,
    Array,
    Assumption,
    Pair,
    Population,
    Rival,
    arms,
    at_values,
    family,
    pairs,
    parameters,
    populate,
    within,
    wobble,
)
from tyre.ground import data_root

BANDS: Mapping[str, tuple[float, float]] = {
    "off": (0.30, 0.70),  # share of the samples: some bicycles
    "off_slow": (0.0, 0.20),  # nobody reports one
    "on": (0.03, 0.20),  # rare, often with a trigger
    "onset_off_m_s": (5.0, 9.0),
    "hertz_off": (6.0, 10.0),
    "hertz_on": (5.0, 8.5),
    "stiff_pairs_on": (0.0, 0.0),  # pairs that wobble with relaxed arms and a front frame of STIFF
}
STIFF = 10000.0  # N m/rad


def shipped_ranges(arms_of_case: Mapping[str, float]) -> dict[str, tuple[float, float]]:
    """Ranges of the package's main study, SI; arms of a case, relaxed or tense, are varied by a factor."""
    ranges = dict(Ranges().drawn)
    middle = -ASSUMED["joint_z"].usual
    low, high = ranges.pop("hinge")
    ranges["height"] = (middle + low, middle + high)
    for name, value in arms_of_case.items():
        low, high = ranges[name]
        ranges[name] = (value * low, value * high)
    return ranges


SHIPPED = Assumption(shipped_ranges(RELAXED))
FORMER = Assumption(
    {
        **{name: SHIPPED.ranges[name] for name in ("stiffness", "height", "camber_share", "trail", "twisting")},
        "damping": (5.0, 40.0),  # N m s/rad
        "friction": (0.0, 1.0),
        "arm_inertia": (0.05, 0.2),
        "arm_stiffness": (0.0, 30.0),
        "arm_damping": (0.2, 3.0),
    }
)
"""As assumed until November 2026: the front frame's damping without its inertia, one range for all arms."""
BARE = SHIPPED.with_ranges(damping_ratio=ASSUMED["bare_damping_ratio"].ends)
TURNING = BARE.with_rivals(rivals.yaw)
ROLLING = TURNING.with_rivals(rivals.roll)
ROWS = {
    "former": FORMER,
    "bare": BARE,
    "bare_turning_rider": TURNING,
    "bare_turning_and_rolling_rider": ROLLING,
    "shipped": SHIPPED,
}
RIVALS: Mapping[str, Assumption] = {
    "roll on the saddle": BARE.with_rivals(rivals.roll_alone),
    "sideways on the saddle": BARE.with_rivals(rivals.sway_alone),
    "legs that swing": BARE.with_rivals(rivals.legs),
    "torsion of the main frame": BARE.with_rivals(rivals.torsion),
    "wheel compliance": BARE.with_rivals(rivals.wheels),
    "contact length": BARE.with_ranges(trail=(0.0, 0.0)).with_rivals(rivals.contact_length),
    "yaw and sideways": TURNING.with_rivals(rivals.sway),
    "yaw and legs": TURNING.with_rivals(rivals.legs),
    "yaw, roll and legs": ROLLING.with_rivals(rivals.legs),
    "yaw and torsion": TURNING.with_rivals(rivals.torsion),
    "legs and torsion": BARE.with_rivals(rivals.legs, rivals.torsion),
    "rider, legs and torsion": ROLLING.with_rivals(rivals.sway, rivals.legs, rivals.torsion),
}


def read_reports() -> list[dict[str, str]]:
    """Rows of the collected reports."""
    with data_root().joinpath("validation", "shimmy_reports.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def reported_speeds(hands: str) -> list[float]:
    """Speeds (m/s) of reports with the hands ``off`` or ``on``: the lower one where a row states two."""
    rides = [row for row in read_reports() if row["kind"] == "report" and row["hands"].partition(" ")[0] == hands]
    return sorted(float(row["speed_low_m_s"]) for row in rides if row["speed_low_m_s"])


def judge(counts: Mapping[str, float | None]) -> list[str]:
    """Name what lies outside the bands; a missing median does."""
    outside = []
    for name, (low, high) in BANDS.items():
        value = counts[name]
        if value is None or not low <= value <= high:
            outside.append(name)
    return outside


def count(
    assumption: Assumption, *, draws: int, seed: int, members: tuple[Pair, ...]
) -> tuple[Population, dict[str, Any]]:
    """Compute a population and all that is judged of it."""
    population = populate(assumption, draws=draws, seed=seed, members=members)
    stiff = assumption.with_ranges(**at_values(RELAXED | {"stiffness": STIFF}))
    wobbling = populate(stiff, draws=draws, seed=seed, members=members).on.wobbling(ON)
    return population, population.counts() | {"stiff_pairs_on": int(wobbling.any(1).sum())}


# The default of the main study: a Pista with charlie in the drops on Tyre1 at 5.5 bar, every range at its middle.
DEFAULT = "pista charlie drops"
USUAL = {name: ASSUMED[name].usual for name in ("stiffness", "damping_ratio", "friction", "trail", "twisting")}
USUAL |= {"height": -ASSUMED["joint_z"].usual, "camber_share": LIMITS.camber_share}
ALONE = {"damping_ratio": ASSUMED["bare_damping_ratio"].usual}  # of the frame without its rider
TURNS = {"stiffness": 12000.0, "ratio": 0.2}  # N m/rad; share of critical damping
ROLLS = {"stiffness": 3000.0, "ratio": 0.2}
BASES: Mapping[str, tuple[dict[str, float], dict[Rival, dict[str, float]]]] = {
    "fixed_rider": ({}, {}),
    "turning_rider": (ALONE, {rivals.yaw: TURNS}),
    "turning_and_rolling_rider": (ALONE, {rivals.yaw: TURNS, rivals.roll: ROLLS}),
}
"""Changes of USUAL, and further effects, of a rider fixed to the frame and of one who moves on the saddle."""
STANDING = {"stiffness": 1000.0, "ratio": 0.3}  # the legs hold the body, softer than the softest saddle
THREE = 1 / math.sqrt(3)  # of a damping ratio where damping stays and stiffness triples
KNEES = {
    "damping": {"ratio": (0.25, 1.25)},  # 2.5 times
    "stiffness": {"stiffness": (6e3, 1.2e5), "ratio": (0.1 * THREE, 0.5 * THREE)},  # 3 times, damping as it is
}
"""Knees on the top tube: changed ranges of the rider's yaw on the saddle."""
BAG = {"mass": 4.5, "x": 0.85, "z": -0.9}
BEHIND = {"mass": 10.0, "x": 0.05, "z": -0.8}
bag, luggage = Rival(effect_class("handlebar_bag"), {}), Rival(effect_class("luggage"), {})


def default_pair() -> Pair:
    """The default bicycle with its rider."""
    return next(pair for pair in pairs(("pista",), ("charlie",)) if pair.name == DEFAULT)


def growths(
    further: Mapping[Rival, Mapping[str, float]], hands: Mapping[str, float] = RELAXED, **changes: float
) -> dict[str, float]:
    """Largest growth (1/s) of wobble from 5 to 22 m/s on the default bicycle, hands off and on.

    ``further`` effects come with their numbers; a mass among them loads the tyres, too.
    """
    pair = default_pair()
    p = pair.bicycle.values
    rear, front = pair.bicycle.static_loads
    for rival, values in further.items():
        if rival in (bag, luggage):
            share = values["x"] / p["w"]
            rear, front = rear + (1 - share) * p["g"] * values["mass"], front + share * p["g"] * values["mass"]
    drawn = {name: np.array([value]) for name, value in (USUAL | changes).items()}
    numbers = parameters(pair, drawn, (np.array([0]), np.array([5.5e5])), (rear, front))
    for rival, values in further.items():
        numbers |= rival.numbers(pair, values)
    models = family(pair, [rival.effect for rival in further])
    largest = {}
    for name, impedance in (("off", HANDS_OFF), ("on", hands)):
        growth, _ = wobble(models, numbers | arms(impedance))
        largest[name] = round(float(growth[:, within(ON)].max()), 2)
    return largest


def signs(base: str) -> dict[str, dict[str, Any]]:
    """Growth (1/s) before and after each change whose direction riders report, and whether it comes out."""
    changes, further = BASES[base]
    usual = growths(further, **changes)
    more, softer = USUAL["friction"] + 0.3, 0.7 * USUAL["stiffness"]
    standing = growths({rivals.yaw: STANDING}, **changes)
    # name: growths after the change, the case of the hands, 1 where it must raise growth
    after: dict[str, tuple[dict[str, float], str, int]] = {
        "tense arms": (growths(further, TENSE, **changes), "on", 1),
        "friction + 0.3 N m s/rad, hands off": (growths(further, **changes, friction=more), "off", -1),
        "friction + 0.3 N m s/rad, hands on": (growths(further, **changes, friction=more), "on", -1),
        "front stiffness x 0.7, hands off": (growths(further, **changes, stiffness=softer), "off", 1),
        "front stiffness x 0.7, hands on": (growths(further, **changes, stiffness=softer), "on", 1),
        "4.5 kg on the handlebar": (growths({**further, bag: BAG}, **changes), "on", 1),
        "10 kg behind": (growths({**further, luggage: BEHIND}, **changes), "on", 1),
        "saddle unloaded, hands off": (standing, "off", -1),
        "saddle unloaded, hands on": (standing, "on", -1),
    }
    table = {"hands on": _compared(usual["off"], usual["on"], -1)}
    return table | {name: _compared(usual[hands], new[hands], way) for name, (new, hands, way) in after.items()}


def _compared(before: float, after: float, way: int) -> dict[str, Any]:
    return {"before": before, "after": after, "as_reported": math.copysign(1, after - before) == way}


def knees(base: str) -> dict[str, dict[str, float]]:
    """Growth (1/s) with knees on the top tube, as 2.5 times the damping or 3 times the stiffness in yaw."""
    changes, further = BASES[base]
    clamped = {
        "seated": TURNS,
        "yaw damping x 2.5": TURNS | {"ratio": 2.5 * TURNS["ratio"]},
        "yaw stiffness x 3": {"stiffness": 3 * TURNS["stiffness"], "ratio": THREE * TURNS["ratio"]},
    }
    return {name: growths({**further, rivals.yaw: values}, **changes) for name, values in clamped.items()}


STYLES = (":", "--", "-.", (0, (5, 1, 1, 1, 1, 1)), "-")
LABELS = {
    "former": "rider fixed, front 20 N m s/rad (5 to 40), as assumed before",
    "bare": "rider fixed, front as bare structures, 1 to 10 %",
    "bare_turning_rider": "bare, the rider turns on the saddle",
    "bare_turning_and_rolling_rider": "bare, the rider turns and rolls on the saddle",
    "shipped": "rider fixed, 15 to 40 % for frame and rider together",
}


def draw_figure(populations: Mapping[str, Population], target: Path) -> None:
    """Draw the share of the samples that wobble at each speed, and the speeds of the reports."""
    with drawing(target, width=8.0, height=6.0) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True)
        for axes, hands in ((upper, "off"), (lower, "on")):
            for (name, population), style in zip(populations.items(), STYLES, strict=True):
                shares = _share_at_each_speed(getattr(population, hands).growth)
                axes.plot(SPEEDS, 100 * shares, linestyle=style, label=LABELS[name])
            speeds = reported_speeds(hands)
            axes.plot(speeds, np.full(len(speeds), -6.0), "|", color="black", ms=9, label="speeds that riders report")
            axes.set(ylabel="Samples that wobble, %", ylim=(-12, 102), xlim=(0, SPEEDS[-1]))
            axes.set_title(f"Hands {hands}: growth above {GROWTH:g} 1/s at this speed")
        lower.set_xlabel("Speed, m/s")
        figure.legend(*upper.get_legend_handles_labels(), loc="outside lower center", ncols=2)


def _share_at_each_speed(growth: Array) -> Array:
    return np.asarray((growth > GROWTH).mean(axis=(0, 1)))


def run(*, out: Path, seed: int, draws: int = 240) -> dict[str, Any]:
    """Count every population, judge the four main ones, and draw them."""
    members, populations, rows = pairs(), {}, {}
    for name, assumption in ROWS.items():
        populations[name], counts = count(assumption, draws=draws, seed=seed, members=members)
        rows[name] = {"counts": _rounded(counts), "outside": judge(counts), "by_frame": populations[name].by_frame()}
    cases = {
        "shipped_tense_arms": (Assumption(shipped_ranges(TENSE)), members),
        "shipped_city_bicycles": (SHIPPED, pairs(tuple(CITY))),
        "bare_light_bicycles": (BARE, pairs(LIGHT)),
        "bare_turning_rider_light_bicycles": (TURNING, pairs(LIGHT)),
        "bare_turning_and_rolling_rider_light_bicycles": (ROLLING, pairs(LIGHT)),
    }
    for clamped, ranges in KNEES.items():
        held = replace(rivals.yaw, ranges={**rivals.yaw.ranges, **ranges})
        cases[f"yaw, knees as {clamped}"] = BARE.with_rivals(held), members
        cases[f"yaw and roll, knees as {clamped}"] = BARE.with_rivals(held, rivals.roll), members
    cases |= {name: (assumption, members) for name, assumption in RIVALS.items()}
    others = {
        name: _rounded(populate(assumption, draws=draws, seed=seed, members=those).counts())
        for name, (assumption, those) in cases.items()
    }
    draw_figure(populations, out / "what_riders_report")
    return {
        "reports": {hands: _described(reported_speeds(hands)) for hands in ("off", "on")},
        "bands": {name: list(band) for name, band in BANDS.items()},
        "rows": rows,
        "others": others,
        "signs": {base: signs(base) for base in BASES},
        "knees": {base: knees(base) for base in ("turning_rider", "turning_and_rolling_rider")},
    }


def _described(speeds: list[float]) -> dict[str, float]:
    return {"count": len(speeds), "lowest": speeds[0], "highest": speeds[-1], "median": median(speeds)}


def _rounded(counts: Mapping[str, float | None]) -> dict[str, float | None]:
    return {name: value if value is None else round(value, 3) for name, value in counts.items()}
