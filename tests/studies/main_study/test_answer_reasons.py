"""What the answer hinges on, how far to believe it, and why this bicycle wobbles."""

from dataclasses import replace

from altered_study import HIGH, LOW, MIDDLE, altered, told

from studies.main_study.answer import answer
from studies.main_study.settings import Front


def test_a_tyre_of_numbers_has_no_pressure_and_a_string_no_lag(racing):
    given = replace(racing.focus, pressures_bar=())
    results = tuple(replace(r, case=given) if r.case is racing.focus else r for r in racing.results)
    study = replace(racing, results=results, cases=(given, *racing.cases[3:]), focus=given, contact_lengths=())
    text = f"{told(study)} {answer(study).why}"
    assert "as given" not in text
    assert "at its onset the wavelength" in text
    assert "does in the model because" in text
    string = replace(study, settings=replace(study.settings, further={"contact_length": {}}))
    assert "single lag" not in told(string)


def test_why_this_bicycle_wobbles(racing):
    why = answer(racing).why
    low = racing.result(racing.settings.reference, racing.focus).span(30.0).low
    assert why.startswith(
        f"Real bicycles seldom wobble from {low:.1f} m/s ({3.6 * low:.0f} km/h) on. This one does in the model at 5.5 "
        "bar because nobody touches the bar, the steering has no friction and the assumed front is flexible (5000 N"
    )
    gone = [one.high.what for one in racing.hinges if one.high.span is None and one.what != "pressure"]
    assert gone
    taken = why.split("takes the unstable wobble away up to 30.0 m/s (108 km/h): ")[1].split(". ")[0]
    assert all(words in taken for words in gone)
    assert len(taken.split(", ")) == len(gone)


def test_why_does_not_say_what_is_not_so(racing):
    damped = answer(altered(racing, {}, further={"steer_damper": {"damping": 0.2}})).why
    assert "no friction" not in damped
    assert "nobody touches the bar and the assumed front" in damped
    own = Front(given=True)
    results = tuple(replace(r, setup=replace(r.setup, front=own)) if r.setup.front else r for r in racing.results)
    given = answer(replace(racing, results=results, settings=replace(racing.settings, front=own))).why
    assert "the given front is flexible" in given
    late = dict.fromkeys((LOW, MIDDLE, HIGH), (22.0, 28.0, 0.02))
    assert answer(altered(racing, late)).why == ""
    none = dict.fromkeys((LOW, MIDDLE, HIGH), (None, None, 0.02))
    assert answer(altered(racing, none)).why == ""


def test_hinges_are_ranked_and_pressure_has_its_place(racing):
    (text,) = (text for label, text in answer(racing).sentences if label == "It hinges on")
    ranked = [one.what for one in racing.hinges]
    assert "moves the least damping ratio at 3 to 20 m/s at 5.5 bar) 1. front (flexible" in text
    assert [text.index(f"{k}. {what} (") for k, what in enumerate(ranked[:4], 1)] == sorted(
        text.index(f"{k}. {what} (") for k, what in enumerate(ranked[:4], 1)
    )
    assert f"and, {1 + ranked.index('pressure')}. of {len(ranked)}, pressure (3.5 bar" in text


def test_a_single_lag_is_fair_where_the_wave_is_long(racing):
    assert "a tyre with a single lag is a coarse description" in told(racing)
    fast = dict.fromkeys((LOW, MIDDLE, HIGH), (12.0, 28.0, -0.02))  # 12 m/s at 7 Hz: 1.7 m
    assert "a tyre with a single lag is a fair description" in told(altered(racing, fast))
