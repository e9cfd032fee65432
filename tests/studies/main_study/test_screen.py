"""The answer: its word follows the stated rule, its table and sentences say what the numbers say, in few words."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from altered_study import HIGH, LOW, STAY, altered, told

from studies.main_study import Front, answer, first_screen, on_a_terminal, record, unstable_length, word_of

CLOSER = {LOW: (4.0, 25.0, -0.06), HIGH: (6.0, 22.0, -0.03)}
STILL = [(0, True), (0, True), (0, False), (0, False)]


@pytest.mark.parametrize(("worlds", "counts", "word"), [
    (STILL, (0, 0), "no practical difference"),
    (STILL, (3, 3), "no practical difference"),
    (STILL, (4, 3), "inconclusive"),  # more than a tenth of 64 moves
    ([(1, True), *STILL[1:]], (64, 0), "inconclusive"),  # a yes on an assumed front alone
    ([(1, False), *STILL[1:]], (64, 0), "yes"),  # the front is given
    ([(1, False), *STILL[1:]], (58, 0), "yes"),
    ([(1, False), *STILL[1:]], (57, 0), "inconclusive"),  # fewer than nine of ten of 64
    ([(1, True), (0, True), (1, False), (0, False)], (64, 0), "yes"),  # a rigid front says so too
    ([(1, False), (-1, False), *STILL[2:]], (64, 0), "inconclusive"),
    ([(-1, False), *STILL[1:]], (0, 60), "yes"),  # farther away
    ([(0, False), (0, False)], (0, 0), "inconclusive"),  # two worlds are not known
])  # fmt: skip
def test_the_word_follows_the_rule(worlds, counts, word):
    assert word_of(worlds, *counts, 64) == word


def test_the_word_of_a_tyre_of_one_condition():
    assert word_of(STILL, 0, 0, 64, two=False) == "no"
    assert word_of([(1, False), *STILL[1:]], 64, 0, 64, two=False) == "yes"
    assert word_of([(1, True), *STILL[1:]], 64, 0, 64, two=False) == "inconclusive"


def test_the_worlds_are_those_of_the_results(racing):
    found, limit = answer(racing), racing.settings.fastest
    assert [one.setup for one in found.worlds] == list(racing.settings.setups)
    for one in found.worlds:
        low, high = (racing.result(one.setup, racing.subject[k]).span(limit) for k in (0, -1))
        assert one.longer == pytest.approx(unstable_length(low, limit) - unstable_length(high, limit))
    assert [one.assumed for one in found.worlds] == [True, True, False, False]
    assert found.word == "inconclusive"
    change = [np.nan_to_num(p.end - p.onset) for p in racing.plausible]
    assert (found.longer, found.count) == ((change[0] - change[1] >= 1.0).sum(), 6)


def test_a_front_that_is_given_may_say_yes(racing):
    assert answer(altered(racing, CLOSER, {LOW: STAY - 1})).word == "inconclusive"
    own = Front(from_file=True)
    study = altered(racing, CLOSER, {LOW: STAY - 1})
    results = tuple(replace(r, setup=replace(r.setup, front=own)) if r.setup.front else r for r in study.results)
    outer = tuple(replace(p, setup=replace(p.setup, front=own)) for p in study.plausible)
    given = replace(study, results=results, plausible=outer, settings=replace(study.settings, front=own))
    assert answer(given).word == "yes"
    assert "Yes. unstable wobble" in told(given).replace("|", "").replace("  ", " ")
    assert "flexible front frame*" not in told(given)


def test_the_first_screen_is_short_and_true(racing, heavy):
    for study in (racing, heavy):
        screen = first_screen(study)
        assert len([word for word in on_a_terminal(screen).split() if re.search(r"\w", word)]) <= 155
        assert "pista_charlie" not in screen
        assert not re.search(r"\bnan\b|\bNone\b|\binf\b", screen)
    text, found = told(racing), answer(racing)
    assert text.startswith("# Does less air in Tyre1 (flat track) bring a Pista track bicycle with a rider in the")
    low, high = (racing.result(racing.settings.reference, racing.subject[k]) for k in (0, -1))
    assert f"{low.span(30.0).low:.1f} to >30 m/s" in text
    assert f"{high.span(30.0).low:.1f} to " in text
    assert f"goes from {high.least.damping_ratio:.3f} to {low.least.damping_ratio:.3f}, " in text
    sizes = [one.wobble.largest for one in racing.amplitudes]
    assert f"wobble at the bar from {sizes[1]:.1f}° to {sizes[0]:.1f}°." in text
    assert "at the bar" not in told(heavy)
    assert f"6 plausible bicycles: {found.longer} gain unstable speeds, {found.shorter} lose some, " in text
    size = racing.hinges[found.place - 1].size
    assert f"pressure, {size:.3f}, is number {found.place} of {len(racing.hinges)}" in text
    assert "Assumed, not measured: flexible front*; arms; trail, twisting torque, camber thrust of the tyre." in text
    assert "extrapolated" not in text
    assert "The tyre's values are extrapolated." in told(heavy)


def test_what_could_not_be_compared_is_said(racing):
    stable = altered(racing, {LOW: (None, None, 0.03), HIGH: (None, None, 0.05)}, {LOW: STAY - 2})
    assert "Inconclusive. Some plausible bicycles say otherwise than the four worlds." in told(stable)
    assert (
        "Less air leaves the unstable speeds as they are (hands off, flexible front frame); the least damping ratio"
        in told(stable)
    )
    gone = replace(racing, results=tuple(r for r in racing.results if r.setup != racing.settings.setups[3]))
    assert "Inconclusive. Not all four worlds could be computed." in told(gone)


def test_the_record_holds_worlds_word_and_rule(racing, monkeypatch, tmp_path, printed):
    found = record(racing, answer(racing))
    assert json.loads(json.dumps(found)) == found
    assert (found["word"], len(found["worlds"])) == ("inconclusive", 4)
    first = found["worlds"][0]
    assert (first["hands"], first["front"], first["front_assumed"]) == ("off", "flexible", True)
    assert first["low"]["from_m_s"] == racing.result(racing.settings.reference, racing.subject[0]).span(30.0).low
    assert first["low"]["to_m_s"] is None  # beyond the speeds looked at
    assert first["longer_m_s"] == pytest.approx(answer(racing).worlds[0].longer)
    assert found["rule"]["plausible_bicycles"] == 6
    monkeypatch.setattr("studies.main_study.report.run_study", lambda *_, **__: racing)
    monkeypatch.setattr("studies.main_study.figures.drawings", lambda *_: [])
    assert json.loads(printed("run", "--out", str(tmp_path / "out"), "--workers", "1", "--json", "-")) == found
