"""The page on what was asked and measured says what the results of the validations say."""

import json
import re
from collections import Counter
from pathlib import Path

import pytest
from page_files import page
from scipy.stats import binom

from studies.validations.corrected_models import INSIDE, OUTSIDE, outcome
from studies.validations.free_decays import KINDS

ROOT = Path(__file__).parents[2]
PAGE = page("reliability")
ROWS = [[cell.strip() for cell in line.strip("|").split("|")] for line in PAGE.splitlines() if line.startswith("| ")]


def result(name):
    return json.loads((ROOT / "data" / "validation" / f"{name}.json").read_text(encoding="utf-8"))


def measured(start):
    (row,) = [row for row in ROWS if row[0].startswith(start)]
    return row[1]


def test_tyre():
    rig, repeats, faults = result("rig_coverage"), result("repeats")["share_percent"], result("sensor_faults")
    coverage, error = rig["coverage"], rig["error"]
    for start, one in (
        ("95 % intervals of the cornering", "cornering_stiffness"),
        ("the same, lateral", "lateral_stiffness"),
    ):
        assert measured(start) == f"{coverage[one]['share_percent']} % of {coverage[one]['cases']}"
    assert measured("bias of the cornering") == f"{error['cornering_stiffness']['mean_percent']:.2f} %"
    assert measured("bias of the lateral") == f"{error['lateral_stiffness']['mean_percent']:.2f} %"
    stated, twice = repeats["as stated"].values(), repeats["2.0"]
    assert measured("intervals hold with few") == f"{min(stated):.1f} to {max(stated):.1f} %"
    assert measured("the same, where it scatters") == (
        f"{twice['0']:.1f} % without repeats, {twice['30']:.1f} % with thirty pairs"
    )
    assert faults["sound_sweeps"] == 400
    assert set(faults["false_alarms_percent"].values()) == {0.0}
    found = [one["named_percent"] for one in faults["found"]["side_force flattens from 70% of its range on"].values()]
    assert measured("force cells") == ", ".join(f"{one:.0f}" for one in found) + " %"
    bent = faults["found"]["side_force flattens from 0% of its range on"].values()
    assert {one["named_percent"] for one in bent} == {0.0}


def test_bicycle():
    critical, derivatives = result("critical_speeds"), result("sensitivity_mpmath")
    assert critical["unexplained"] == critical["off_axis"] == []
    assert measured("every change") == "{0} of {0}, {1} models".format(critical["crossings"], critical["models"])
    assert measured("derivatives") == f"{derivatives['largest_relative_error']:.1e}, {derivatives['pairs']} pairs"
    written = [row["report_written"] for row in result("every_bicycle")["rows"]]
    assert measured("the main study") == f"{sum(written)} of {len(written)}"
    shares = [row["overhead_share"] * 100 for row in result("sweep_scale")["rows"][1:]]
    assert measured("overhead of a sweep") == f"{min(shares):.1f} to {max(shares):.1f} %"
    for number in re.findall(r"[\d.]+", " ".join(row[1] for row in ROWS if "[benchmarks]" in row[-1])):
        assert re.search(rf"\b{re.escape(number)}", page("benchmarks")), number
    again = (ROOT / "data/validation/benchmarks_again.md").read_text(encoding="utf-8")
    for what, of in re.findall(r"(\d+\.?\d*) times \((\d+) states\)", measured("the same as a sweep computes them")):
        assert re.search(rf"the same, {of} states, as a sweep .*\| {what} x ", again)
    for what in re.findall(
        r"[\d.]+(?= and|(?= times as quick))", measured("the same as a sweep").partition("one thread")[2]
    ):
        assert re.search(rf"states, in batches \(fast\) against one by one +\| >= 12 x +\| {what} x ", again)
    assert f"| {measured('the same on the slower machine')} " in again
    for number in re.findall(r"[\d.]+", " ".join(row[1] for row in ROWS if "[explorer]" in row[-1])):
        assert re.search(rf"\| (\d\.\d\d to )?{number} (s \||to \d)", page("explorer")), number


@pytest.mark.parametrize(
    ("start", "cell"),
    [
        ("95 % intervals of eigenvalues", "white noise"), ("coloured noise", "coloured noise"),
        ("an offset in", "coloured noise and offset, 1.1 to 1.6 cycles"),
        ("a slow mode and", "slow mode and offset, 1.8 to 3 cycles"), ("a fast mode", "start transient (fast mode)"),
        ("an offset and", "offset, 1.1 to 1.4 cycles"), ("two modes", "weave and wobble"),
        ("a motion that", "driven by the ground"), ("noise half as", "noise half as large as the motion"),
        ("a capsize that", "capsize that dies out, 1.0 to 1.4 cycles"),
        ("the same, with a third", "driven faintly by the ground"),
        ("the same, 15 to 25", "driven by the ground, 15 to 25 cycles"),
    ],
)  # fmt: skip
def test_free_decays(start, cell):
    counted = result("free_decays_sets")
    one = counted["cells"][cell]
    shares = [[one[kind][part] for part in ("real", "imaginary")] for kind in KINDS.values()]
    assert re.findall(r"[\d.]+(?= %)", measured(start)) == [str(share) for both in shares for share in both]
    assert ("told that the ground drives it" in measured(start)) == ("driven" in cell)
    low, high = counted["target_percent"]
    (row,) = [row for row in ROWS if row[0].startswith(start)]
    words = [["yes" if low <= share <= high else "**no**" for share in both] for both in shares]
    alone, sets, told = (a if a == b else f"{a}, {b}" for a, b in words)
    assert row[2] == f"{alone}; sets {sets}; told {told}"


SECOND = (
    ("modal-none", "something_named"),
    ("modal-none-tight", "something_named"),
    ("history-none", "something_named"),
    ("history-none-tight", "something_named"),
    ("eigenvalues-none", "something_named"),
    ("modal-one", "detected"),
    ("modal-one", "right_when_named"),
    ("modal-one", "truth_inside_95"),
    ("history-one", "detected"),
    ("history-one", "right_when_named"),
    ("history-one", "truth_inside_95"),
    ("eigenvalues-one", "detected"),
    ("eigenvalues-one", "right_when_named"),
    ("eigenvalues-one", "truth_inside_95"),
    ("loud-one", "something_named"),
    ("loud-one", "right_when_named"),
    ("modal-unusual", "right_or_tentative_right"),
    ("history-unusual", "right_or_tentative_right"),
    ("modal-opposed", "right"),
    ("modal-opposed", "truth_inside_95"),
    ("history-opposed", "right"),
    ("history-opposed", "truth_inside_95"),
    ("modal-pair", "right"),
    ("modal-pair", "some_false_name"),
    ("modal-outside", "misnamed"),
    ("modal-outside", "some_false_name"),
    ("history-outside", "misnamed"),
    ("history-outside", "some_false_name"),
    ("modal-wrong-bicycle", "misnamed"),
    ("modal-wrong-bicycle", "some_false_name"),
    ("history-wrong-bicycle", "misnamed"),
    ("history-wrong-bicycle", "some_false_name"),
    ("modal-causes", "some_false_name"),
    ("history-causes", "some_false_name"),
    ("eigenvalues-offset", "some_false_name"),
    ("history-wrong-sensor", "some_false_name"),
    ("one-speed", "any_name"),
)  # fmt: skip


def test_histories_outside_the_library_again():
    found = result("history_outside")
    verdicts = [verdict for _, _, verdict, _ in found["rows"]]
    assert (len(verdicts), found["errors"]) == (found["cases"], 0)
    named = verdicts.count("named") + verdicts.count("class")
    partial = named + verdicts.count("partial")
    assert (found["named_or_class"], found["with_partial"]) == (named, partial)
    shares = [f"({count / len(verdicts):.0%})".replace("%", " %") for count in (named, partial)]
    said = f"{named} of {len(verdicts)} {shares[0]} and {partial} {shares[1]}"
    assert measured("the same with the search of now") == said


def test_single_effects_again():
    found = result("one_effect_again")
    rows = found["rows"]
    said = [(verdict, truth in members) for _, _, truth, verdict, members in rows if verdict not in ("none", "unknown")]
    named = [right for verdict, right in said if verdict == "named"]
    assert (len(rows), len(said), len(named)) == (found["cases"], found["detected"], found["named"])
    assert (sum(named), sum(right for _, right in said)) == (found["named_right"], found["with_the_truth"])
    words = f"{sum(named)} of {len(named)} (100 %), {len(said)} of {len(rows)} detected"
    assert measured("one effect hidden (modes, and") == words
    assert sum(named) == len(named)


def test_second_edition():
    folder = ROOT / "studies/missing_effect/blind/results/second_edition"
    cells = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["cells"]
    rows = [row for row in ROWS if "[second edition]" in row[-1]]
    for (cell, key), row in zip(SECOND, rows[:-1], strict=True):
        one = cells[cell][key]
        share = f" ({one['share']:.0%})".replace("%", " %") if one["hits"] else ""
        assert row[1] == f"{one['hits']} of {one['of']}{share}", row[0]
        if asked := re.search(r"(\d+)(?: to (\d+))? %$", row[0]):
            least, most = int(asked[1]), int(asked[2] or asked[1])
            low = one["share"] * 100 >= least if "least" in row[0] or asked[2] else True
            high = one["share"] * 100 <= most if "most" in row[0] or asked[2] else True
            assert row[2] == ("yes" if low and high else "**no**"), row[0]
    crashed = [cell["crashed"] for cell in cells.values()]
    assert rows[-1][1] == f"{sum(one['hits'] for one in crashed)} of {sum(one['of'] for one in crashed)}"
    assert [cell["cases"] for cell in cells.values()] == [150] * 23


def test_the_chapter_says_of_the_second_edition_what_its_report_says():
    def rows(text):
        return [
            tuple(cell.strip() for cell in line.strip("|").split("|")) for line in text.splitlines() if line[:2] == "| "
        ]

    folder = ROOT / "studies/missing_effect"
    chapter = (folder / "README.md").read_text(encoding="utf-8").partition("All 23 cells were counted")[2]
    report = (folder / "blind/results/second_edition/report.md").read_text(encoding="utf-8").partition("| cell ")[0]
    told = rows(chapter.partition("What misses")[0])
    assert len(told) > 30
    assert told == rows(report)


def test_batches():
    counts = [result(f"batches{which}") for which in ("", "_again", "_third", "_fourth", "_fifth")]
    names, speeds = (
        [one for found in counts for one in found["different"] if ("at_m_s" in one) == of_names]
        for of_names in (True, False)
    )
    drawn, named, crossed = (sum(found[key] for found in counts) for key in ("models", "named", "with_critical_speeds"))
    assert measured("named modes and critical speeds in").startswith(
        f"names of {len(names)} of {named}, critical speeds of {len(speeds)} of {crossed} differ (of {drawn} drawn"
    )


def test_numpy_batches():
    counts = result("batches_numpy"), result("batches_numpy_again")
    assert [len(one["at_m_s"]) for found in counts for one in found["different"]] == [1]
    named, speeds, drawn = (sum(found[key] for found in counts) for key in ("named", "speeds_each", "models"))
    assert measured("names of plain numpy").startswith(
        f"names of 1 of {named} differ, at one speed of {speeds // 2} (of {drawn} drawn"
    )


def test_diagnosis():
    blind = (ROOT / "studies/missing_effect/blind/results/report.md").read_text(encoding="utf-8")
    counted = [row[1] for row in ROWS if "[blind test]" in row[-1]]
    for text in counted:
        share = re.match(r"(\d+ of \d+|1 %)", text)[1].replace("1 %", "1%")
        assert re.search(rf"\| {share}\b", blind) or f"| {share} " in blind, text
    optimum = result("search_optimum")
    (missed,) = optimum["missed"]
    assert missed["share_of_starts"] == 1 / 5
    assert measured("the search comes to the optimum") == (
        f"{optimum['cases_with_every_optimum_reached']} of {optimum['cases']} (in the other case one of five random "
        f"starts ends {missed['search'] - missed['random']:.1f} lower in chi^2, at the same hypothesis)"
    )
    for start, cell in (("residual torque", "modal-outside"), ("the same, histories", "history-outside")):
        torque = result("residual_torque")["cells"][cell]
        left = torque["held_out_gap_left"]
        assert measured(f"{start}: gap left") == f"{left['median']:.0%} ({left['of']} cases)".replace("%", " %")
        inside, within = torque["weave_inside_95"], torque["weave_inside_95_within_measured_speeds"]
        assert measured(f"{start}: interval of the weave") == (
            f"{inside['hits']} of {inside['of']} ({inside['share'] * 100:.0f} %), {inside['hits_with_one_limit']} of "
            f"them with one limit only; {within['hits']} of {within['of']} within the measured speeds; nothing said in "
            f"{inside['nothing_claimed']} more"
        )
    for start, name in (("verdict right", "measurement_plan"), ("the same with up to 6", "measurement_plan_six_runs")):
        after = result(name)["after_planned_runs"]
        assert measured(start) == f"{after['right']} of {after['cases']}, none named wrongly"
        assert result(name)["named_wrongly"] == 0


def test_joint_data():
    joint = result("joint_diagnosis")
    right = {name: f"{one['hits']} of {one['of']}" for name, one in joint["right"].items()}
    modes, kicks = (right[name].removesuffix(f" of {joint['cases']}") for name in ("modes", "kicks"))
    assert measured("joint data, 150 cases: names") == (
        f"{right['joint']}; modes alone {modes}, kicks {kicks}, pushes {right['pushes']}; one case that each part told "
        "was lost, and is told by the search of now"
    )
    cases = ROOT / "studies/missing_effect/blind/results/joint_cases.jsonl"
    rows = [json.loads(line) for line in cases.read_text(encoding="utf-8").splitlines()]
    rows = [row for row in rows if not row["planted"] and row["seed"] < joint["seed"] + joint["cases"]]
    lost = [row for row in rows if max(one["right"] for one in row["alone"].values()) > row["joint"]["right"]]
    assert [all(one["right"] for one in row["alone"].values()) for row in lost] == [True]
    ratios = []
    for row in rows:
        for key, (_, sd) in row["joint"]["sizes"].items() if row["joint"]["right"] else ():
            alone = [one["sizes"][key][1] for one in row["alone"].values() if one["right"] and key in one["sizes"]]
            if key.startswith(row["hidden"]) and alone:
                ratios.append((sd / min(alone), row["hidden"]))
    wider = [(ratio, hidden) for ratio, hidden in ratios if ratio > 1.001]
    assert {hidden for _, hidden in wider} == {"rider_lean"}
    assert measured("joint data: no interval") == (
        f"{len(ratios) - len(wider)} of {len(ratios)} ({len(wider)} are wider, by {max(wider)[0] - 1:.0%} or less; all "
        "are numbers of a swaying rider, and none is wider than that of a part at the same values)"
    ).replace("%", " %")
    found, claimed = joint["planted_found"], joint["false_contradiction"]
    assert measured("a mistake planted in one part") == f"{found['hits']} of {found['of']}"
    assert measured("none planted: a part") == f"{claimed['hits']} of {claimed['of']} ({claimed['share']:.0%})".replace(
        "%", " %"
    )


def test_damaged_recordings():
    damaged = result("damaged_recordings")
    counts = {}
    for one in damaged["by_format"].values():
        for what, count in one.items():
            counts[what] = counts.get(what, 0) + count
    (row,) = [row for row in ROWS if row[0].startswith("recordings in eleven formats")]
    assert len(damaged["by_format"]) == 11
    assert damaged["failures"] == []
    assert row[1] == str(sum(counts.values()))
    assert row[2] == (
        f"{counts['refused']} refused in words, {counts['right']} read right, {counts['altered']} altered, "
        "none read wrong, none crashed"
    )


def test_corrected_models():
    run = result("corrected_models")
    found = [one["inside_95"] for one in run["cells"].values()]
    assert all(one["high"] >= 0.95 for one in found)  # Wilson's limits: not clearly below what is claimed
    for none in (False, True):
        ends = [outcome(case) for case in run["cases"] if case["hidden"] and (case["verdict"] == "none") == none]
        found.append({"hits": ends.count(INSIDE), "of": ends.count(INSIDE) + ends.count(OUTSIDE)})
    assert re.findall(r"(\d+) of (\d+)", measured("corrected models")) == [
        (str(one["hits"]), str(one["of"])) for one in found
    ]
    nothing, *_, named, missed = found
    sound = [nothing[key] + named[key] for key in ("hits", "of")]
    said = "{} of {}, but in {} of {} where a hidden".format(*sound, missed["hits"], missed["of"])
    assert said in page("measurement_files").replace("\n", " ")


def test_faults_put_into_the_source():
    run, survivors = result("mutation"), result("mutation_survivors")
    by_run, killed = sum(run["all"].values()), run["all"]["killed"] + run["all"].get("killed by time", 0)
    assert by_run + len(run["not_judged"]) == run["mutants"]
    assert {one["name"] for one in survivors["survivors"]} == set(run["survivors"])
    assert len(run["survivors"]) == by_run - killed == sum(survivors["counts"].values())
    assert sorted(one["name"] for one in survivors["judged_later"]) == sorted(run["not_judged"])
    for rows, told in (("survivors", "counts"), ("judged_later", "counts_later")):
        assert Counter(one["class"] for one in survivors[rows]) == survivors[told]
        assert all(one["why"] for one in survivors[rows])
    counts = Counter(survivors["counts"]) + Counter(survivors["counts_later"])
    judged, noticed = by_run + len(survivors["judged_later"]), killed + counts.pop("noticed")
    tried = (ROOT / "docs" / "included" / "what_was_tried.md").read_text(encoding="utf-8")
    shown = re.findall(r"\| ([^|]+) \| (\d+)(?: \(([\d.]+) %\))? \|", tried.partition("### Faults put into")[2])
    numbers = [int(number) for _, number, _ in shown][:8]
    now = noticed + sum(counts[kind] for kind in ("hole killed", "equivalent", "dead, removed"))
    assert numbers == [
        judged, noticed, *(counts[kind] for kind in ("hole killed", "equivalent", "dead, removed")),
        counts["tolerance"], counts["open"], now,
    ]  # fmt: skip
    assert float(shown[7][2]) == pytest.approx(100 * now / judged, abs=0.051)
    assert sum(counts.values()) == judged - noticed


def test_joint_data_again():
    again = result("joint_diagnosis_again")
    right = {name: f"{one['hits']} of {one['of']}" for name, one in again["right"].items()}
    modes, kicks = (right[name].removesuffix(f" of {again['cases']}") for name in ("modes", "kicks"))
    assert again["told_by_a_part_and_lost"] == 0
    assert measured(f"the same, {again['cases']} further cases") == (
        f"{right['joint']}; modes alone {modes}, kicks {kicks}, pushes {right['pushes']}; none was lost that a part "
        "told"
    )
    sd, claimed = again["sd_joint_over_best_part"], again["false_contradiction"]
    assert measured("the same, further cases") == (
        f"{sd['of'] - sd['wider']} of {sd['of']} ({sd['wider']} are wider, by {sd['largest'] - 1:.0%} or less; all are "
        "numbers of a swaying rider)"
    ).replace("%", " %")
    assert measured("none planted, further") == (
        f"{claimed['hits']} of {claimed['of']} ({claimed['share']:.0%})"
    ).replace("%", " %")


def test_what_is_said_of_free_decays_in_sum():
    """Shares of the eigenvalue within the target, and their means, alone, in sets and told what drives."""
    counted = result("free_decays_sets")
    low, high = counted["target_percent"]
    text = " ".join(page("reliability").split())
    faint, still = [], []
    begins = "One by one {} do, at {:.1f} %", "of one test, {}, at {:.1f} %", "(`--driven yes` or `no`) {}, at {:.1f} %"
    for begin, kind in zip(begins, KINDS.values(), strict=True):
        cells = {name: [cell[kind][part] for part in ("real", "imaginary")] for name, cell in counted["cells"].items()}
        every = [share for both in cells.values() for share in both]
        assert begin.format(sum(low <= share <= high for share in every), sum(every) / len(every)) in text
        faint.append("{:.0f} to {:.0f} %".format(*sorted(cells["driven faintly by the ground"])))
        undriven = [share for name, both in cells.items() if "driven" not in name for share in both]
        still.append(f"{sum(undriven) / len(undriven):.1f} %")
    assert f"**{faint[0]}** where it is alone, in {faint[1]} in sets and in {faint[2]} where it is told" in text
    assert "are held in {}, {} and {} on average".format(*still) in text
    drawn = counted["draws_per_cell"]
    chance = sum(low <= round(100 * k / drawn, 1) <= high for k in binom.rvs(drawn, 0.95, size=4000, random_state=1))
    assert f"some {chance / 4000 * len(every):.0f} of these {len(every)} would lie within" in text
    breaks = sum(cell["break_claimed"] for cell in counted["cells"].values())
    assert f"Of the {drawn * len(counted['cells'])} decays {breaks} " in text
