"""The study beside what others found: verdicts, our ranges computed anew, and the data file."""

import math
import tomllib

import numpy as np
import pytest
from by_hand import ARMS, FRONT, by_hand

from studies.main_study import published
from studies.main_study.published import MEASURES, UNITS, Comparison, Finding, compared, findings
from tyre.base.errors import InputError
from tyre.base.paths import data_root


def finding(low, high, quantity="onset_m_s"):
    return Finding("X (2000)", quantity, low, high, "words", "abstract only", "a journal")


@pytest.mark.parametrize(
    ("ours", "verdict"),
    [
        ((4.2, 4.4), "inside"), ((4.0, 6.0), "inside"), ((3.0, 5.0), "partly inside"), ((5.0, 9.0), "partly inside"),
        ((3.0, 9.0), "partly inside"), ((1.0, 3.9), "outside"), ((6.1, 8.0), "outside"), ((6.0, 8.0), "partly inside"),
        (None, "none here"), ((5.0, math.inf), "partly inside"),
    ],
)  # fmt: skip
def test_verdicts(ours, verdict):
    assert Comparison(finding(4.0, 6.0), ours).verdict == verdict


def test_an_open_range_contains_what_goes_on():
    assert Comparison(finding(18.0, math.inf), (20.0, math.inf)).verdict == "inside"
    assert Comparison(finding(18.0, math.inf), (15.0, math.inf)).verdict == "partly inside"


def test_ranges_in_words():
    assert Comparison(finding(4, 6), (4.04, math.inf)).shown == "4.0 to beyond m/s"
    assert Comparison(finding(4, 6), (4.04, 4.01)).shown == "4.0 m/s"
    assert Comparison(finding(4, 6), None).shown == "-"
    assert Comparison(finding(0, 0.1, "frequency_change"), (0.23, 0.281)).shown == "23% to 28%"


def test_every_finding_of_the_data_is_said_with_its_source():
    found = findings()
    assert {one.quantity for one in found} <= set(UNITS) == set(MEASURES)
    for one in found:
        assert one.low < one.high
        assert one.hands in ("", "on", "off")
        assert "abstract only" in one.read or "Moore & Reijne (2020)" in one.read  # none was read in the original
        assert one.source
        assert one.words


def test_findings_are_the_numbers_that_were_read():
    """Ploechl 2012 and Klinger 2014 as read by Moore & Reijne (2020); abstracts of Dressel 2013 and VTI 2018."""
    found = {(one.who.split(",")[0].split(" (")[0], one.quantity): (one.low, one.high) for one in findings()}
    assert found["Plöchl", "wobble_frequency_Hz"] == (6, 9)
    assert found["Klinger", "wobble_frequency_Hz"] == (8, 12)
    assert found["Klinger", "onset_m_s"] == (2, 6)
    assert found["Klinger", "steer_over_roll"] == (3, 5)
    assert found["Dressel", "cornering_stiffness_over_load_per_deg"] == (0.15, 0.35)
    assert found["Dressel", "camber_stiffness_over_load_per_deg"] == (0.0075, 0.015)
    assert found["VTI", "relaxation_length_mm"] == (200, 300)


def ours(study, who, quantity):
    (one,) = (one for one in compared(study) if one.finding.who.startswith(who) and one.finding.quantity == quantity)
    return one.ours


def test_our_tyres_are_those_of_the_table(racing):
    loads = racing.settings.bicycle.static_loads
    stiffness = [case.contact[2 * k] * np.pi / 180 / loads[k] for case in racing.cases for k in (0, 1)]
    lengths = [case.contact[k] * 1e3 for case in racing.cases for k in (1, 3)]
    assert ours(racing, "Dressel", "cornering_stiffness_over_load_per_deg") == pytest.approx(
        (min(stiffness), max(stiffness))
    )
    assert ours(racing, "VTI", "relaxation_length_mm") == pytest.approx((min(lengths), max(lengths)))
    assert ours(racing, "Dressel", "camber_stiffness_over_load_per_deg") == pytest.approx((0.65 * np.pi / 180,) * 2)


def shimmy(study, **parts):
    """Frequencies (Hz) and steer over lean of the flexing front's wobble at the ridden speeds, case by case."""
    frequencies, ratios = [], []
    for case in study.cases:
        model = by_hand(study.settings.bicycle, case.contact, front=FRONT, **parts)
        mine = []
        for speed in study.settings.speeds[(study.settings.speeds >= 3) & (study.settings.speeds <= 20)]:
            values, vectors = np.linalg.eig(model.state_matrix(float(speed)))
            hertz = values.imag / (2 * np.pi)
            at = np.flatnonzero((hertz > 4) & (hertz < 11))
            k = at[np.argmax(values[at].real)]
            steer, lean = (abs(vectors[model.states.index(name), k]) for name in ("steer", "lean"))
            mine.append(hertz[k])
            ratios.append(steer / lean)
        frequencies.append(mine)
    return frequencies, ratios


def test_our_frequencies_and_shapes_are_those_of_the_eigenvalues(racing):
    off, _ = shimmy(racing)
    every = [value for one in off for value in one]
    assert ours(racing, "Plöchl", "wobble_frequency_Hz") == pytest.approx((min(every), max(every)))
    changes = [(max(one) - min(one)) / np.mean(one) for one in off]
    assert ours(racing, "Tomiati", "frequency_change") == pytest.approx((min(changes), max(changes)))
    on, ratios = shimmy(racing, arms=ARMS)
    every = [value for one in on for value in one]
    assert ours(racing, "Klinger", "wobble_frequency_Hz") == pytest.approx((min(every), max(every)))
    assert ours(racing, "Klinger", "steer_over_roll") == pytest.approx((min(ratios), max(ratios)))


def test_our_edges_and_weave_speeds_are_those_of_the_results(racing):
    reference = racing.settings.reference
    spans = [r.span(30.0) for r in racing.of(reference)]
    assert ours(racing, "Plöchl", "onset_m_s") == (min(s.low for s in spans), max(s.low for s in spans))
    assert ours(racing, "Plöchl", "end_m_s") == (min(s.high for s in spans), math.inf)
    assert ours(racing, "Klinger", "onset_m_s") is None
    weave = {
        r.case.name + r.case.condition: c.speed for r in racing.of(reference) for c in r.crossings if c.mode == "weave"
    }
    shifts = [abs(weave[f"{name}3.5 bar"] - weave[f"{name}7.5 bar"]) for name in racing.names]
    assert ours(racing, "Bulsink", "weave_shift_m_s") == pytest.approx((min(shifts), max(shifts)))


def test_what_a_study_does_not_have_is_not_compared(heavy):
    assert ours(heavy, "Plöchl", "onset_m_s") is None
    assert ours(heavy, "Plöchl", "wobble_frequency_Hz") is not None  # stable wobble has a frequency too


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"lo": 1.0}, "unknown key 'lo'"), ({"quantity": "onset"}, "unknown quantity 'onset'"),
        ({"low": "4"}, "low"), ({"low": 9.0}, "low"), ({"hands": "one"}, "hands"), ({"who": None}, "who"),
    ],
)  # fmt: skip
def test_a_data_file_that_is_wrong_is_refused(change, words, tmp_path, monkeypatch):
    entry = {
        "who": "X (2000)", "quantity": "onset_m_s", "low": 4.0, "high": 6.0, "words": "w", "read": "abstract only",
        "source": "s",
    } | change  # fmt: skip
    lines = [f"{key} = {value!r}" for key, value in entry.items() if value is not None]
    (tmp_path / "published").mkdir()
    (tmp_path / "published" / "wobble.toml").write_text("[[finding]]\n" + "\n".join(lines) + "\n")
    monkeypatch.setattr(published, "data_root", lambda: tmp_path)
    with pytest.raises(InputError, match=words):
        findings()


def test_the_data_file_has_no_other_fields():
    content = tomllib.loads(data_root().joinpath("published", "wobble.toml").read_text(encoding="utf-8"))
    fields = {"who", "quantity", "low", "high", "words", "read", "source", "hands"}
    assert all(set(one) <= fields for one in content["finding"])
    assert set(content) == {"finding"}
