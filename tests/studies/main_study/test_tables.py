"""Tidy tables that agree with the study, and published ranges beside ours."""

import math

import numpy as np
import pandas as pd
import pytest
from by_hand import ARMS, FRONT, by_hand
from eigenvalue_sets import assert_same_eigenvalues

from studies.main_study import Comparison, Finding, compare_findings, findings, model, tables, write_tables


@pytest.fixture(scope="module")
def every(racing):
    return tables(racing)


def finding(low, high, quantity="onset_m_s"):
    return Finding("X (2000)", "model", quantity, low, high, "words", "abstract only", "a journal")


def ours(study, who, quantity):
    (one,) = (
        one for one in compare_findings(study) if one.finding.who.startswith(who) and one.finding.quantity == quantity
    )
    return one.ours


NAMES = [
    "tyre_properties", "eigenvalues", "damping_ratios", "critical_speeds", "decomposition_damping_ratio",
    "decomposition_critical_speed", "wobble", "one_at_a_time", "front_frame_samples", "published", "monte_carlo",
]  # fmt: skip
CONDITION = ["bicycle", "tyre", "surface", "pressure_rear_bar", "pressure_front_bar", "hands", "front", "extrapolated"]


def test_tables_are_tidy(racing, every):
    assert list(every) == NAMES
    for name in ("eigenvalues", "damping_ratios", "critical_speeds", "wobble", "front_frame_samples", "monte_carlo"):
        assert list(every[name])[: len(CONDITION)] == CONDITION, name
    lengths = {name: len(table) for name, table in every.items()}
    assert lengths["tyre_properties"] == 2 * 5
    assert lengths["wobble"] == 5 * 3 + 2
    assert lengths["one_at_a_time"] == 2 * len(racing.hinges)
    assert lengths["front_frame_samples"] == 6 * len(racing.samples)
    assert lengths["critical_speeds"] == sum(len(r.crossings) for r in racing.results)
    keys = ["tyre", "surface", "pressure_rear_bar", "hands", "front"]
    assert not every["wobble"].duplicated(keys).any()
    assert not every["eigenvalues"].duplicated([*keys, "speed_m_s", "mode", "branch"]).any()
    assert not every["tyre_properties"].duplicated(["tyre", "surface", "pressure_bar", "wheel"]).any()


def test_every_eigenvalue_is_in_the_table_once(racing, every):
    case, setup = racing.cases[1], racing.settings.setups[1]
    table = every["eigenvalues"]
    mine = table[
        (table["tyre"] == case.tyre) & (table["pressure_rear_bar"] == case.pressure_bar) & (table["hands"] == "relaxed")
        & (table["front"] == "flexible") & (table["speed_m_s"] == 10.0)
    ]  # fmt: skip
    values = model(racing.settings, setup, case.contact).linear_model().eigenvalues(10.0)
    printed = mine["real_1_s"].to_numpy() + 1j * mine["imaginary_rad_s"].to_numpy()
    assert_same_eigenvalues(printed, values[values.imag >= 0], rtol=1e-9)
    moving = mine[mine["imaginary_rad_s"] > 0]
    ratio = -moving["real_1_s"] / np.hypot(moving["real_1_s"], moving["imaginary_rad_s"])
    np.testing.assert_allclose(moving["damping_ratio"], ratio)
    np.testing.assert_allclose(moving["frequency_Hz"], moving["imaginary_rad_s"] / (2 * np.pi))


def test_wobble_lies_within_the_critical_speeds(every):
    """It counts from a growth of 0.5 1/s on, so from a little above the onset, and not below 4 m/s."""
    keys = ["tyre", "surface", "pressure_rear_bar", "hands", "front"]
    critical = every["critical_speeds"]
    wobble = every["wobble"].set_index(keys).sort_index()
    for key, group in critical[(critical["mode"] == "wobble") & (critical["speed_m_s"] <= 30)].groupby(keys):
        row = wobble.loc[key]
        if not row["wobbles"]:  # unstable, and nowhere faster than 0.5 1/s
            assert row["min_damping_ratio"] > -0.01
            continue
        assert max(4.0, group["speed_m_s"].min()) <= row["from_m_s"]
        assert row["growth_1_s"] >= 0.5
        if len(group) > 1:
            assert row["from_m_s"] < row["to_m_s"] < group["speed_m_s"].max()
    calm = wobble[~wobble["wobbles"]]
    assert len(calm) == 3 * 3 + 2  # relaxed arms, rigid front frames, and tense arms at two pressures
    assert calm["from_m_s"].isna().all()
    assert (calm["min_damping_ratio"] > -0.01).all()


def test_files_hold_the_tables(racing, every, tmp_path):
    written = write_tables(racing, tmp_path)
    assert sorted(file.name for file in tmp_path.iterdir()) == sorted(f"{name}.csv" for name in NAMES)
    back = pd.read_csv(written["critical_speeds"])
    np.testing.assert_allclose(back["speed_m_s"], every["critical_speeds"]["speed_m_s"], rtol=1e-9)
    assert list(back) == list(every["critical_speeds"])
    assert b"\r" not in written["wobble"].read_bytes()


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


def test_findings_are_the_numbers_that_were_read():
    """Ploechl 2012 and Klinger 2014 as cited by Moore & Reijne (2020); abstracts of Dressel 2013 and VTI 2018."""
    found = {(one.who.split(",")[0].split(" (")[0], one.quantity): (one.low, one.high) for one in findings()}
    assert found["Plöchl", "wobble_frequency_Hz"] == (6, 9)
    assert found["Klinger", "wobble_frequency_Hz"] == (8, 12)
    assert found["Klinger", "onset_m_s"] == (2, 6)
    assert found["Klinger", "steer_over_roll"] == (3, 5)
    assert found["Dressel", "cornering_stiffness_over_load_per_deg"] == (0.15, 0.35)
    assert found["Dressel", "camber_stiffness_over_load_per_deg"] == (0.0075, 0.015)
    assert found["VTI", "relaxation_length_mm"] == (200, 300)
    kinds = {one.who.split(",")[0].split(" (")[0]: one.kind for one in findings()}
    assert kinds == {
        "Plöchl": "model", "Klinger": "model", "Bulsink": "model", "Tomiati": "both", "Dressel": "measurement",
        "VTI": "measurement",
    }  # fmt: skip


def test_our_tyres_are_those_of_the_table(racing):
    loads = racing.settings.bicycle.static_loads
    stiffness = [case.contact[2 * k] * np.pi / 180 / loads[k] for case in racing.cases for k in (0, 1)]
    lengths = [case.contact[k] * 1e3 for case in racing.cases for k in (1, 3)]
    ends = ours(racing, "Dressel", "cornering_stiffness_over_load_per_deg")
    assert ends == pytest.approx((min(stiffness), max(stiffness)))
    assert ours(racing, "VTI", "relaxation_length_mm") == pytest.approx((min(lengths), max(lengths)))
    assert ours(racing, "Dressel", "camber_stiffness_over_load_per_deg") == pytest.approx((0.65 * np.pi / 180,) * 2)


def shimmy(study, cases, **parts):
    """Frequencies (Hz) and steer over lean of the flexing front's wobble at the ridden speeds, case by case."""
    frequencies, ratios = [], []
    for case in cases:
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
    off, _ = shimmy(racing, racing.cases)
    every = [value for one in off for value in one]
    assert ours(racing, "Plöchl", "wobble_frequency_Hz") == pytest.approx((min(every), max(every)))
    on, ratios = shimmy(racing, racing.subject, arms=ARMS)
    changes = [(max(one) - min(one)) / np.mean(one) for one in on]  # they rode with hands on
    assert ours(racing, "Tomiati", "frequency_change") == pytest.approx((min(changes), max(changes)))
    every = [value for one in on for value in one]
    assert ours(racing, "Klinger", "wobble_frequency_Hz") == pytest.approx((min(every), max(every)))
    assert ours(racing, "Klinger", "steer_over_roll") == pytest.approx((min(ratios), max(ratios)))


def test_our_edges_and_weave_speeds_are_those_of_the_results(racing):
    reference = racing.settings.reference
    bands = [band for r in racing.results_of(reference) for band in r.bands(30.0)]
    onsets, ends = [band.start.speed for band in bands], [band.end.speed for band in bands]
    assert ours(racing, "Plöchl", "onset_m_s") == (min(onsets), max(onsets))
    assert ours(racing, "Plöchl", "end_m_s") == (min(ends), max(ends))
    assert ours(racing, "Klinger", "onset_m_s") is None
    found = [(r.case, c) for r in racing.results_of(reference) for c in r.crossings if c.mode == "weave"]
    weave = {case.name + case.condition: c.speed for case, c in found}
    shifts = [abs(weave[f"{name}3.5 bar"] - weave[f"{name}7.5 bar"]) for name in racing.names]
    assert ours(racing, "Bulsink", "weave_shift_m_s") == pytest.approx((min(shifts), max(shifts)))
