"""The answer: its word follows the stated rule, its table and sentences say what the numbers say, in few words."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from altered_study import HIGH, LOW, STAY, altered, told
from scipy.integrate import solve_ivp

from studies.main_study import (
    GRADE_RULES,
    LIMITS,
    Front,
    answer,
    first_screen,
    front_draws,
    grade,
    grade_samples,
    on_a_terminal,
    record,
    unmeasured,
)

CLOSER = {LOW: (4.0, 25.0, -0.06), HIGH: (6.0, 22.0, -0.03)}


def test_the_cases_are_those_of_the_results(racing):
    found = answer(racing)
    assert [one.setup for one in found.cases] == list(racing.settings.setups)
    for one in found.cases:
        low, high = (racing.result(one.setup, racing.subject[k]).wobble for k in (0, -1))
        assert one.spans == [low, high]
    assert [one.assumed for one in found.cases] == [True, True, True, False, False]
    assert [one.setup.hands_assumed for one in found.cases] == [False, True, True, False, True]


def test_the_samples_of_the_reference_case_give_the_grade(racing):
    found, (low, high) = answer(racing).graded, racing.samples[:2]
    change = np.nan_to_num(low.end - low.onset) - np.nan_to_num(high.end - high.onset)
    ridden = (low.speeds >= 3) & (low.speeds <= 20)
    growth = [np.maximum(one.growth[:, ridden].max(axis=1), 0.5) for one in (low, high)]
    faster = growth[0] - growth[1]
    worse, better = (change >= 1) | (faster >= 0.5), (change <= -1) | (faster <= -0.5)
    counts = (worse & ~better).sum(), (better & ~worse).sum(), len(change)
    assert (found.for_it, found.against, found.count) == counts
    numbers = {name: front_draws(racing.settings)[name] for name in
               ("stiffness", "damping_ratio", "hinge", "friction", "trail", "twisting", "camber_share")}  # fmt: skip
    assert found == grade_samples(1 * worse - 1 * better, numbers)


@pytest.mark.parametrize(("onsets", "words"), [
    (STAY - 1, "Yes. In 20 samples wobble is worse in 20, better in 0, about the same in 0."),
    (STAY + 1, "No. In 20 samples wobble is worse in 0, better in 20, about the same in 0."),
    (STAY - 0.9, "Little difference. In 20 samples wobble is worse in 0, better in 0, about the same in 20."),
    (np.where(np.arange(20) < 14, 4.0, 5.0), "Probably. In 20 samples wobble is worse in 14, better in 0,"),
])  # fmt: skip
def test_the_answer_is_the_grade_of_the_samples(racing, onsets, words):
    assert words in told(altered(racing, CLOSER, {LOW: onsets}, fronts=20))


def test_impossible_samples_are_counted(racing):
    study = altered(racing, CLOSER, {LOW: STAY - 1}, fronts=20)
    possible = np.arange(20) < 18
    study = replace(study, samples=tuple(replace(samples, computed=possible) for samples in study.samples))
    assert "In 18 samples (2 of 20 are impossible) wobble is worse in 18, better in 0" in told(study)


def test_an_assumption_on_which_the_answer_depends_is_named_with_its_cheapest_measurement(racing):
    stiffness = front_draws(replace(racing.settings, fronts=20))["stiffness"]
    onsets = np.where(stiffness < np.median(stiffness), 4.0, 5.0)
    text = told(altered(racing, CLOSER, {LOW: onsets}, fronts=20))
    assert "Depends on the stiffness of the front frame, which is assumed." in text
    assert "Wobble is worse in 100 % of the samples below its median and in 0 % above it." in text
    assert "Cheapest measurement: hang 20 kg sideways at the front hub and read the deflection." in text


def test_a_front_frame_of_the_file_is_no_assumption(racing):
    settings = replace(racing.settings, front=Front(from_file=True))
    assert set(unmeasured(racing.settings, ())) == {"stiffness", "damping_ratio", "hinge", "friction"}
    assert set(unmeasured(settings, ())) == {"friction"}
    assert set(unmeasured(replace(settings, front=Front(from_file=True, defaults=("damping_ratio",))), ("trail",))) == {
        "friction", "damping_ratio", "trail"
    }  # fmt: skip


def test_the_hands_are_no_promise(racing):
    """Arms that nobody measured: the share of the samples that wobble stands in the table and in a sentence."""
    low, high = racing.samples[2:4]
    hands = ("off", "relaxed", "tense", "off", "relaxed")
    assert [one.setup.hands for one in racing.samples] == [name for name in hands for _ in (LOW, HIGH)]
    onset = np.where(np.arange(6) < 3, 5.0, np.nan)
    low = replace(low, onset=onset, end=onset + 2.0, computed=np.ones(6, bool))
    high = replace(high, onset=np.full(6, np.nan), end=np.full(6, np.nan), computed=np.ones(6, bool))
    study = replace(racing, samples=(*racing.samples[:2], low, high, *racing.samples[4:]))
    text = told(study)
    assert "| relaxed, flexible* | 50 % | no 0 % | -, " in text
    assert "| relaxed, rigid* |" in text
    own = replace(racing.settings, arms=replace(racing.settings.arms, grip="", from_file=True))
    setups = [setup for setup in own.setups if setup.arms]
    relaxed = [setup for setup in racing.settings.setups if setup.hands == "relaxed"]
    renamed = dict(zip(relaxed, setups, strict=True))
    results = tuple(replace(r, setup=renamed.get(r.setup, r.setup)) for r in racing.results)
    assert "| on, rigid |" in told(replace(racing, results=results, settings=own))


def test_growth_is_compared_only_where_some_sample_wobbles_at_ridden_speeds(racing):
    setup = racing.settings.reference
    calm = tuple(
        replace(s, onset=np.full_like(s.onset, 25.0), end=np.full_like(s.onset, 29.0)) if s.setup == setup else s
        for s in racing.samples
    )
    case = answer(replace(racing, samples=calm)).cases[0]
    assert not case.change.some_wobble  # what wobbles at 25 m/s does not at 3 to 20 m/s
    assert answer(racing).cases[0].change.some_wobble


def test_a_sample_without_an_oscillation_of_wobbles_frequencies_is_calm(racing, monkeypatch):
    """Its growth is NaN at every speed; once the ranking of what to measure next ended in a traceback on it."""
    few = replace(LIMITS, fewest=3)  # there are six samples
    monkeypatch.setattr("studies.main_study.next_measurement.LIMITS", few)
    without = np.arange(6)[:, None] == 0  # the first of six samples
    calm = tuple(replace(s, growth=np.where(without, np.nan, s.growth)) for s in racing.samples)
    assert all(np.isfinite(gain.definite) for gain in answer(replace(racing, samples=calm)).gains)
    assert "nan" not in told(replace(racing, samples=calm))


def test_the_least_bump_is_the_amplitude_at_which_dry_friction_no_longer_stops_the_growth(racing):
    """Integrated in time with a torque of 0.1 N m against the steer rate: less of it decays, more of it grows."""
    amplitude, setup = racing.amplitudes[0], racing.settings.reference
    result = racing.result(setup, amplitude.case)
    speed, root, bump = result.wobble.fastest_at, result.wobble.eigenvalue, amplitude.least_bump
    space = result.modes.model.to_control(speed)
    steer, rate = (space.state_labels.index(name) for name in ("steer", "steer_rate"))
    torque = np.asarray(space.B)[:, space.input_labels.index("steer_torque")]
    values, shapes = np.linalg.eig(np.asarray(space.A))
    shape = shapes[:, np.argmin(np.abs(values - root))]

    def largest_steer(start):
        def motion(_, state):
            return np.asarray(space.A) @ state - torque * 0.1 * np.tanh(state[rate] / 1e-3)

        path = solve_ivp(motion, (0, 1.5), np.real(shape / shape[steer] * start), "LSODA", rtol=1e-6, max_step=4e-3)
        return np.abs(path.y[steer][path.t > 1.3]).max()

    assert largest_steer(0.85 * bump) < 0.3 * bump
    assert largest_steer(1.15 * bump) > 3 * bump
    assert f"a bump of {np.degrees(bump):.2g}° starts it" in told(racing)


def test_the_damping_of_a_bare_frame_under_a_fixed_rider_contradicts_what_riders_report(racing):
    words = "A damping ratio of 0.03 with a rider fixed to the frame contradicts what riders report; add effects."
    bare = replace(racing.settings, front=Front(damping_ratio=0.03, from_file=True))

    def screen_of(settings):
        renamed = dict(zip(racing.settings.setups, settings.setups, strict=False))  # a stated front is not rigid
        results = tuple(replace(r, setup=renamed[r.setup]) for r in racing.results if r.setup in renamed)
        return told(replace(racing, settings=settings, results=results))

    assert words in screen_of(bare)
    assert "contradicts" not in screen_of(replace(bare, further={"rider_saddle": {"mass": 70.0}}))
    assert "contradicts" not in screen_of(replace(bare, front=Front(from_file=True)))
    riderless = replace(bare, bicycle=bare.bicycle.replace(mB=9.0))
    assert "contradicts" not in screen_of(riderless)


def test_the_first_screen_is_short_and_true(racing, heavy):
    for study in (racing, heavy):
        screen = first_screen(study)
        words = [word for word in on_a_terminal(screen).split() if re.search(r"\w", word)]
        assert len(words) <= 180  # 34 of them for tense arms and the least bump
        assert "pista_charlie" not in screen
        assert not re.search(r"\bnan\b|\bNone\b|\binf\b", screen)
    text, found = told(racing), answer(racing)
    assert text.startswith("# Does lower pressure in Tyre1 (flat track) make a Pista track bicycle with a rider")
    low, high = (racing.result(racing.settings.reference, racing.subject[k]) for k in (0, -1))
    assert f"{low.wobble.low:.1f} to >30" in text
    assert f"{high.wobble.low:.1f} to " in text
    largest = [one.wobble for one in racing.amplitudes]
    size = f"its largest steer amplitude is {largest[0].largest:.1f}°, at {largest[0].at:.0f} m/s (7.5 bar: "
    assert f"; {size}{largest[1].largest:.1f}°); against" in text
    assert "steer amplitude" not in told(heavy)
    assert f"In 6 samples wobble is worse in {found.graded.for_it}, better in {found.graded.against}, " in text
    fastest = low.wobble
    assert f"At 3.5 bar wobble grows fastest at {fastest.fastest_at:.0f} m/s ({fastest.frequency_hz:.1f} Hz); " in text
    assert "steer amplitude" not in told(heavy)
    assert f"In 6 samples wobble is worse in {found.graded.for_it}, better in {found.graded.against}, " in text
    assert "Assumed (*): front frame; arms; pneumatic trail, twisting torque, camber stiffness of the tyre." in text
    assert "extrapolated" not in text
    assert "The tyre values are extrapolated." in told(heavy)


def test_what_could_not_be_compared_is_said(racing):
    unknown = replace(racing, samples=(), settings=replace(racing.settings, front=None))
    results = tuple(replace(r, setup=replace(r.setup, front=None)) for r in racing.results if r.setup.front)
    text = told(replace(unknown, results=results))
    assert "Inconclusive. The front frame of this bicycle is unknown, and none is assumed: add" in text
    assert "definite" not in text
    assert "Inconclusive. No sample could be computed." in told(replace(racing, samples=()))


def test_the_record_holds_worlds_word_and_rule(racing, monkeypatch, tmp_path, printed):
    found = record(racing, answer(racing))
    assert json.loads(json.dumps(found)) == found
    assert (found["answer"], len(found["cases"])) == (answer(racing).graded.grade, 5)
    first = found["cases"][0]
    assert (first["hands"], first["front_frame"], first["front_frame_assumed"]) == ("off", "flexible", True)
    assert first["low"]["from_m_s"] == racing.result(racing.settings.reference, racing.subject[0]).wobble.low
    assert first["low"]["to_m_s"] is None  # beyond the speeds looked at
    assert (first["low"]["growth"], found["cases"][3]["low"]["growth"]) == ("fast", "none")
    low, high = racing.samples[:2]
    change = first["change_by_lower_pressure"]["growth_1_s"]
    assert change["median"] == pytest.approx(np.median(low.peak - high.peak))
    assert change["low"] < change["median"] < change["high"]
    assert first["wobbles_at_ridden_speeds"][0]["share"] == (low.onset <= 20).sum() / 6
    assert found["samples"]["count"] == 6
    monkeypatch.setattr("studies.main_study.report.run_study", lambda *_, **__: racing)
    monkeypatch.setattr("studies.main_study.figures.drawings", lambda *_: [])
    assert json.loads(printed("run", "--out", str(tmp_path / "out"), "--workers", "1", "--json", "-")) == found


def test_the_rule_takes_no_other_option(refused):
    assert "--rule prints and ends; leave out --json" in refused("run", "--rule", "--json", "-")
    assert "leave out MODEL" in refused("run", "model.toml", "--rule")


def test_the_rule_is_printed_on_request(printed):
    text = " ".join(printed("run", "--rule").split())
    for rule in GRADE_RULES.agreement:
        assert f"at least {100 * rule.agree:.0f} % at most {100 * rule.oppose:.0f} %" in text
    assert f"its halves differ by at least {100 * GRADE_RULES.split:.0f} points" in text


def test_one_condition_says_in_how_many_samples_the_unstable_range_counts(racing):
    """The table counts each sample that is unstable at all; the answer those over at least 1 m/s."""
    low = racing.samples[0]
    end = np.array([5.5, 5.5, 8.0, 8.0, np.nan, np.nan])
    samples = replace(low, onset=np.where(np.isnan(end), np.nan, 5.0), end=end, computed=np.ones(6, bool))
    graded = grade(racing.settings, (), samples)
    assert (graded.grade, graded.for_it, graded.against) == ("probably_not", 2, 4)
    assert samples.wobbling_share == pytest.approx(4 / 6)
