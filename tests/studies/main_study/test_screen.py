"""The first screen says what the numbers say: sign, size, how sure, what it hinges on, and of which case."""

import re
from dataclasses import replace

import numpy as np
import pytest
from altered_study import HIGH, LOW, MIDDLE, STAY, altered, told

from studies.main_study import Front, Tally, answer, first_screen, tallied

NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?")
CLOSER = {LOW: (4.0, 25.0, -0.06), HIGH: (6.0, 22.0, -0.03)}


def labels(study) -> list[str]:
    return re.findall(r"^- \*\*(.*?)\*\*", first_screen(study), re.MULTILINE)


def test_the_question_and_four_sentences(racing):
    screen = first_screen(racing)
    assert screen.startswith("# Does less air in Tyre1 (measured on a flat track) bring pista_charlie_drops closer to ")
    assert labels(racing) == ["Yes: closer.", "How sure:", "It hinges on", "How far to believe it:"]
    lines = [line for line in screen.splitlines() if line.startswith("- ")]
    assert all(line.endswith(".") and ".." not in line and "  " not in line for line in lines)


def test_every_number_of_the_first_screen_stands_in_the_results(racing):
    """Numbers of spans, damping ratios, counts and ranges, computed anew from the study."""
    s, reference = racing.settings, racing.settings.reference
    mine = racing.of(reference, racing.names[0])
    speeds = [speed for r in mine for c in r.crossings for speed in (c.speed,)] + [30.0, 3.0, 20.0]
    speeds += [end for p in racing.plausible for edge in ("onset", "end") for end in p.likely(edge) or ()]
    ends = [end for hinge in racing.hinges for end in (hinge.low, hinge.high)]
    ends += [end for one in racing.contact_lengths for end in (one.lag, one.string)]
    speeds += [end.span.low for end in ends if end.span] + [end.span.high for end in ends if end.span]
    allowed = {f"{v:.1f}" for v in speeds} | {f"{3.6 * v:.0f}" for v in speeds if np.isfinite(v)}
    allowed |= {f"{one.least.damping_ratio:.3f}" for one in (*mine, *ends)}
    allowed |= {f"{bar:g}" for case in racing.subject for bar in case.pressures_bar} | {"3", "20"}
    allowed |= {text for end in ends for text in NUMBER.findall(end.what)}
    high, low = (racing.outer(mine[k]) for k in (-1, 0))
    change = np.nan_to_num(low.end - low.onset) - np.nan_to_num(high.end - high.onset)
    allowed |= {f"{n}" for n in ((change > 0).sum(), (change < 0).sum(), (change == 0).sum(), len(change))}
    wobble = sum(~np.isnan(low.onset))
    allowed |= {f"{wobble}", f"{len(change) - wobble}"} | {"1", "2", "4", "7", "8"}  # ranks of hinges
    start = mine[0].bands(30.0)[0].start
    wave = start.speed / start.frequency_hz
    allowed |= {f"{wave:.2f}", f"{wave / mine[0].case.contact[3]:.1f}"}
    allowed |= {f"{1e3 * sum(one.half_length):.0f}" for one in racing.contact_lengths}
    focus = racing.result(reference, racing.focus).least.eigenvalue.real
    allowed |= {f"{np.log(2) / focus:.2f}", f"{3.6 * racing.result(reference, racing.focus).least.speed:.0f}",
                f"{racing.result(reference, racing.focus).least.speed:.1f}", f"{s.front.stiffness:g}",
                f"{s.front.damping:g}"}  # fmt: skip
    text = told(racing).partition("Uncertainty of")[0].replace("Tyre1", "")
    assert [number for number in NUMBER.findall(text) if number not in allowed] == []


def test_bands_at_both_pressures_at_one_and_at_none(racing):
    nan = np.full(20, np.nan)
    both = told(altered(racing, CLOSER, {LOW: STAY - 1}))
    assert "Yes: closer. At 3.5 bar instead of 7.5 bar" in both
    assert "from 4.0 to 25.0 m/s (14 to 90 km/h) instead of from 6.0 to 22.0 m/s (22 to 79 km/h)" in both
    assert "falls from -0.030 to -0.060." in both
    low = altered(racing, {LOW: (4.0, 25.0, -0.01), HIGH: (None, None, 0.02)}, {HIGH: nan})
    assert labels(low)[0] == "Yes: closer."
    assert "unstable from 4.0 to 25.0 m/s (14 to 90 km/h) instead of stable up to 30.0 m/s" in told(low)
    high = altered(racing, {HIGH: (4.0, 25.0, -0.01), LOW: (None, None, 0.02)}, {LOW: nan})
    assert labels(high)[0] == "No: farther away."
    assert "rises from -0.010 to 0.020" in told(high)
    none = altered(racing, {LOW: (None, None, 0.03), HIGH: (None, None, 0.05)}, {LOW: nan, HIGH: nan})
    assert labels(none)[0] == "Closer, but stable."
    assert "none wobbles, at either pressure" in told(none)
    assert "begin between" not in told(none)


@pytest.mark.parametrize(
    ("counts", "label"),
    [
        ((20, 0, 0), "Yes: closer."), ((19, 1, 0), "Yes: closer."), ((18, 2, 0), "Yes, probably: closer."),
        ((16, 4, 0), "Yes, probably: closer."), ((15, 5, 0), "It depends on the front."),
        ((0, 20, 0), "It depends on the front."),  # against the damping of the assumed front
        ((3, 0, 17), "Yes: closer."), ((2, 0, 18), "Closer."),
        ((0, 2, 18), "Closer."),
    ],
)  # fmt: skip
def test_how_sure_the_sign_is(racing, counts, label):
    found = answer(altered(racing, CLOSER, {LOW: np.repeat([4.0, 6.0, 5.0], counts)}))
    assert found.verdict == label
    assert (found.tally.more, found.tally.fewer, found.tally.neither) == counts


def test_the_opposite_sign_and_a_difference_that_nobody_sees(racing):
    opposite = altered(racing, {LOW: (6.0, 22.0, -0.03), HIGH: (4.0, 25.0, -0.06)}, {LOW: STAY + 1})
    assert answer(opposite).verdict == "No: farther away."
    same = altered(racing, {LOW: (4.0, 25.0, -0.060), HIGH: (4.1, 25.0, -0.0599)})
    assert answer(same).verdict == "No difference that matters."
    assert "hardly moves, from -0.060 to -0.060" in told(same)
    alike = altered(racing, {LOW: (4.01, 25.0, -0.06), HIGH: (4.02, 25.0, -0.06)})
    assert "wobble is unstable from 4.0 to 25.0 m/s (14 to 90 km/h), as before; its" in told(alike)


def test_tally_counts_the_same_bicycles_and_leaves_out_what_could_not_be_computed(racing):
    high, low = (racing.outer(racing.of(racing.settings.reference, "Tyre1 flat")[k]) for k in (-1, 0))
    found = tallied(
        replace(high, onset=np.array([5, 5, np.nan, np.nan, 5.0]), end=np.array([20, 20, np.nan, np.nan, 20.0]),
                computed=np.array([1, 1, 1, 1, 0], bool)),
        replace(low, onset=np.array([4, 6, 8, np.nan, 4.0]), end=np.array([20, 20, 9, np.nan, 20.0]),
                computed=np.ones(5, bool)),
    )  # fmt: skip
    assert found == Tally(2, 1, 1)
    assert found.count == 4
    assert tallied(None, low) == Tally(0, 0, 0)


def test_extrapolated_tyres_are_told(racing, heavy):
    assert "extrapolated" not in told(racing)
    assert "The tyre's values are extrapolated." in told(heavy)
    far = replace(heavy, results=tuple(replace(r, case=replace(r.case, out_of_reach=True)) for r in heavy.results))
    assert "so far outside the tyre tests that its values are a guess." in told(far)


def test_a_tyre_of_one_condition_is_compared_with_the_others(racing):
    cases = tuple(case for case in racing.cases if case.name != "Tyre1 flat" or case.condition == "5.5 bar")
    study = replace(racing, cases=cases)
    text, (own,) = told(study), study.of(study.settings.reference, "Tyre1 flat")
    assert text.startswith("# Does pista_charlie_drops wobble on Tyre1 at 5.5 bar (measured on a flat track)? - Yes.")
    assert f"is {own.least.damping_ratio:.3f}, at 15.0 m/s (54 km/h)." in text
    others = [r.least.damping_ratio for r in racing.of(study.settings.reference, "Tyre3 flat")]
    assert max(others) < own.least.damping_ratio
    assert (answer(study).others, answer(study).worse) == (2, 2)
    outer = study.outer(own)
    assert f"How sure: {outer.count - outer.without} of 6 random bicycles with plausible fronts wobble; the " in text
    stable = altered(study, {}, {MIDDLE: np.full(5, np.nan)})
    assert "How sure: none of 5 random bicycles with plausible fronts wobbles." in told(stable)


def test_the_case_of_a_model_file_comes_before_less_air(racing):
    study = replace(racing, settings=replace(racing.settings, contact={"tyre": "Tyre1", "pressure_bar": 5.5}))
    assert told(study).startswith("# Does pista_charlie_drops wobble on Tyre1 at 5.5 bar")
    assert labels(study)[:2] == ["Yes.", "Less air: yes: closer."]


def test_why_this_bicycle_wobbles(racing):
    why = answer(racing).why
    assert why.span.low == racing.result(racing.settings.reference, racing.focus).span(30.0).low
    assert [end for _, end in why.gone] == [
        end.what for one in racing.hinges for end in (one.low, one.high) if end.span is None and one.what != "pressure"
    ]
    assert "in the model at 5.5 bar because nobody touches the bar, the steering has no friction and the assumed" in (
        told(racing)
    )
    damped = told(altered(racing, {}, further={"steer_damper": {"damping": 0.2}}))
    assert "nobody touches the bar and the assumed front" in damped
    late = dict.fromkeys((LOW, MIDDLE, HIGH), (22.0, 28.0, 0.02))
    assert answer(altered(racing, late)).why is None
    none = dict.fromkeys((LOW, MIDDLE, HIGH), (None, None, 0.02))
    assert answer(altered(racing, none)).why is None
    own = Front(given=True)
    results = tuple(replace(r, setup=replace(r.setup, front=own)) if r.setup.front else r for r in racing.results)
    given = replace(racing, results=results, settings=replace(racing.settings, front=own))
    assert "the given front is flexible" in told(given)


def test_hinges_are_ranked_and_pressure_has_its_place(racing):
    ranked = [one.what for one in racing.hinges]
    named = [(rank, one.what) for rank, one in answer(racing).named]
    place = 1 + ranked.index("pressure")
    assert named == [*enumerate(ranked[:4], 1), (place, "pressure")]
    assert f"; and, {place}. of {len(ranked)}, pressure (3.5 bar" in told(racing)


def test_a_single_lag_is_fair_where_the_wave_is_long(racing):
    assert "a tyre with a single lag is a coarse description" in told(racing)
    fast = dict.fromkeys((LOW, MIDDLE, HIGH), (12.0, 28.0, -0.02))  # 12 m/s at 7 Hz: 1.7 m
    assert "a tyre with a single lag is a fair description" in told(altered(racing, fast))
