"""The first screen says what the numbers say: sign, size, how sure, and of which case."""

import re
from dataclasses import replace

import numpy as np
import pytest
from altered_study import HIGH, LOW, MIDDLE, STAY, altered, edges, first_sentence, least, told

from studies.main_study.answer import Tally, answer, tallied, verdict

NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?")


CLOSER = {LOW: (4.0, 25.0, -0.06), HIGH: (6.0, 22.0, -0.03)}


def test_four_sentences_and_the_question(racing):
    found = answer(racing)
    assert (
        found.question
        == "Does less air in Tyre1 (measured on a flat track) bring pista_charlie_drops closer to wobble?"
    )
    assert [label for label, _ in found.sentences] == [
        "Yes: closer.", "How sure:", "It hinges on", "How far to believe it:"
    ]  # fmt: skip
    assert found.sentences == answer(racing).sentences
    assert all(text.endswith(".") and ".." not in text for _, text in found.sentences)


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
    text = (told(racing) + " " + answer(racing).why).replace("Tyre1", "")
    assert [number for number in NUMBER.findall(text) if number not in allowed] == []


def test_a_band_at_both_pressures(racing):
    label, text = first_sentence(altered(racing, CLOSER, {LOW: STAY - 1}))
    assert label == "Yes: closer."
    assert text == (
        "At 3.5 bar instead of 7.5 bar, hands off the bar and with a flexible front, wobble is unstable from 4.0 to "
        "25.0 m/s (14 to 90 km/h) instead of from 6.0 to 22.0 m/s (22 to 79 km/h); its least damping ratio at 3 to "
        "20 m/s falls from -0.030 to -0.060."
    )


def test_a_band_at_one_pressure_only(racing):
    nan = np.full(20, np.nan)
    low = altered(racing, {LOW: (4.0, 25.0, -0.01), HIGH: (None, None, 0.02)}, {HIGH: nan})
    assert "unstable from 4.0 to 25.0 m/s (14 to 90 km/h) instead of stable up to 30.0 m/s" in first_sentence(low)[1]
    assert first_sentence(low)[0] == "Yes: closer."
    high = altered(racing, {HIGH: (4.0, 25.0, -0.01), LOW: (None, None, 0.02)}, {LOW: nan})
    assert "is stable up to 30.0 m/s (108 km/h) instead of unstable from 4.0 to 25.0 m/s" in first_sentence(high)[1]
    assert first_sentence(high)[0] == "No: farther away."
    assert "rises from -0.010 to 0.020" in first_sentence(high)[1]


def test_no_band_at_all(racing):
    nan = np.full(20, np.nan)
    study = altered(racing, {LOW: (None, None, 0.03), HIGH: (None, None, 0.05)}, {LOW: nan, HIGH: nan})
    label, text = first_sentence(study)
    assert label == "Closer, but stable."
    assert "wobble is stable up to 30.0 m/s (108 km/h), as before; its least damping ratio" in text
    assert "of 20 random bicycles with plausible fronts none wobbles, at either pressure." in told(study)
    assert "begin between" not in told(study)


def test_a_band_beyond_the_speeds_looked_at_is_none(racing):
    study = altered(racing, {LOW: (32.0, 38.0, 0.03), MIDDLE: (34.0, None, 0.04), HIGH: (None, None, 0.05)})
    assert "wobble is stable up to 30.0 m/s (108 km/h), as before" in first_sentence(study)[1]
    assert "32.0" not in told(study)
    assert "at its onset" not in told(study)


def test_the_opposite_sign_is_told(racing):
    study = altered(racing, {LOW: (6.0, 22.0, -0.03), HIGH: (4.0, 25.0, -0.06)}, {LOW: STAY + 1})
    assert first_sentence(study)[0] == "No: farther away."
    assert "none are unstable at more speeds with less air, 20 at fewer" in told(study)


def onsets(closer, farther, same):
    """Onsets at the lower pressure of random bicycles that begin at 5 m/s at the higher one."""
    return np.repeat([4.0, 6.0, 5.0], [closer, farther, same])


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
    study = altered(racing, CLOSER, {LOW: onsets(*counts)})
    assert first_sentence(study)[0] == label


def test_a_difference_that_nobody_sees(racing):
    same = {LOW: (4.0, 25.0, -0.060), HIGH: (4.1, 25.0, -0.0599)}
    study = altered(racing, same)
    assert first_sentence(study)[0] == "No difference that matters."
    assert "hardly moves, from -0.060 to -0.060" in first_sentence(study)[1]
    alike = altered(racing, {LOW: (4.01, 25.0, -0.06), HIGH: (4.02, 25.0, -0.06)})
    assert "wobble is unstable from 4.0 to 25.0 m/s (14 to 90 km/h), as before; its" in first_sentence(alike)[1]
    assert "the 3 that wobble begin at 0.0 m/s (0 km/h)" in told(
        altered(racing, CLOSER, {LOW: np.zeros(3), HIGH: STAY[:3]})
    )


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


def test_without_random_bicycles_the_damping_tells(racing):
    high, low = racing.of(racing.settings.reference, "Tyre1 flat")[::-2]
    assert verdict(replace(high, least=least(0.02)), replace(low, least=least(0.01)), Tally(0, 0, 0)) == "Closer."
    assert verdict(replace(high, least=None), low, Tally(0, 0, 0)) == "No difference that matters."


def test_few_that_wobble_are_counted_and_many_have_quantiles(racing):
    nan = np.full(17, np.nan)
    few = told(altered(racing, CLOSER, {LOW: [4.0, 5.0, 7.0, *nan], HIGH: [5.0, 6.0, 8.0, *nan]}))
    assert "at 3.5 bar the 3 that wobble begin between 4.0 and 7.0 m/s (25 km/h), and 17 of 20 do not wobble" in few
    one = told(altered(racing, CLOSER, {LOW: [4.0, *nan], HIGH: [5.0, *nan]}))
    assert "1 is unstable at more speeds" in one
    assert "the only one that wobbles begins at 4.0 m/s (14 km/h), and 17 of 18" in one
    many = told(altered(racing, CLOSER, {LOW: np.linspace(2, 4, 21)[:20], HIGH: STAY}))
    assert "nine of ten of those that wobble begin between" in many
    assert "do not wobble" not in many


def test_the_other_worlds_are_told_apart(racing):
    text = told(racing)
    assert (
        "With hands on and a flexible front, hands off and a rigid front, hands on and a rigid front wobble is stable "
        "up to 30.0 m/s (108 km/h)." in text
    )
    setup = racing.settings.setups[1]
    results = tuple(
        replace(r, crossings=edges(9.0, 14.0)) if r.setup == setup and r.case.condition == LOW else r
        for r in racing.results
    )
    assert "with hands on and a flexible front it is unstable at 1 of 3 pressures from 9.0 to 14.0 m/s" in told(
        replace(racing, results=results)
    )


def test_extrapolated_tyres_are_told(racing, heavy):
    assert "extrapolated" not in told(racing)
    assert first_sentence(heavy)[1].endswith("The tyre's values are extrapolated.")
    far = replace(heavy, results=tuple(replace(r, case=replace(r.case, out_of_reach=True)) for r in heavy.results))
    assert first_sentence(far)[1].endswith("so far outside the tyre tests that its values are a guess.")


def test_a_tyre_of_one_condition_is_compared_with_the_others(racing):
    cases = tuple(case for case in racing.cases if case.name != "Tyre1 flat" or case.condition == "5.5 bar")
    study = replace(racing, cases=cases)
    found = answer(study)
    assert found.question == "Does pista_charlie_drops wobble on Tyre1 at 5.5 bar (measured on a flat track)?"
    label, text = found.sentences[0]
    (own,) = study.of(study.settings.reference, "Tyre1 flat")
    assert label == "Yes."
    assert text == (
        f"With hands off the bar and a flexible front, wobble is unstable {own.span(30.0).words}; its least damping "
        f"ratio at 3 to 20 m/s is {own.least.damping_ratio:.3f}, at 15.0 m/s (54 km/h)."
    )
    others = [r.least.damping_ratio for r in racing.of(study.settings.reference, "Tyre3 flat")]
    assert max(others) < own.least.damping_ratio
    assert "Of 2 conditions of other tyres, wobble is less damped at 3 to 20 m/s on 2 and more on none." in told(study)


def test_random_bicycles_of_one_condition_are_counted(racing):
    cases = tuple(case for case in racing.cases if case.name != "Tyre1 flat" or case.condition == MIDDLE)
    study = replace(racing, cases=cases)
    outer = study.outer(study.of(study.settings.reference, "Tyre1 flat")[0])
    wobble = outer.count - outer.without
    assert f"How sure: {wobble} of 6 random bicycles with plausible fronts wobble; the {wobble} that wobble" in told(
        study
    )
    stable = altered(study, {}, {MIDDLE: np.full(5, np.nan)})
    assert "How sure: none of 5 random bicycles with plausible fronts wobbles." in told(stable)


def test_the_case_of_a_model_file_comes_before_less_air(racing):
    study = replace(racing, settings=replace(racing.settings, contact={"tyre": "Tyre1", "pressure_bar": 5.5}))
    found = answer(study)
    assert found.question == "Does pista_charlie_drops wobble on Tyre1 at 5.5 bar (measured on a flat track)?"
    assert [label for label, _ in found.sentences[:2]] == ["Yes.", "Less air: yes: closer."]
    assert "At 3.5 bar instead of 7.5 bar" in found.sentences[1][1]
