"""Shipped ranges agree with what riders report, former and bare ones do not; directions that riders report come out."""

from dataclasses import replace

import numpy as np
import pytest

from bicycle import load_bicycle
from bicycle.model import frequency_hz
from studies.main_study import Settings, model, tyre_cases
from tests.validation import rider_rivals as rivals
from tests.validation.rider_populations import (
    ON,
    RELAXED,
    SPEEDS,
    TENSE,
    WOBBLE_HZ,
    Assumption,
    Rival,
    at_values,
    pairs,
    populate,
    within,
)
from tests.validation.what_riders_report import (
    BANDS,
    BARE,
    BASES,
    ROWS,
    SHIPPED,
    count,
    growths,
    judge,
    read_reports,
    reported_speeds,
    signs,
)

DRAWS, SEED = 40, 20261129


@pytest.fixture(scope="module")
def counts():
    return {
        name: count(ROWS[name], draws=DRAWS, seed=SEED, members=pairs())[1] for name in ("former", "bare", "shipped")
    }


def test_there_are_24_pairs_of_four_frames():
    assert len(pairs()) == 24
    assert len({pair.frame for pair in pairs()}) == 4


def test_the_shipped_ranges_agree_with_the_reports(counts):
    assert judge(counts["shipped"]) == []


@pytest.mark.parametrize(("name", "expected"), [
    ("former", {"off_slow"}),
    ("bare", {"off", "off_slow", "on", "onset_off_m_s"}),
])  # fmt: skip
def test_the_same_judgement_says_no_to_former_and_bare_ranges(counts, name, expected):
    assert expected <= set(judge(counts[name]))


def test_a_population_that_never_wobbles_is_outside_too():
    stiff = SHIPPED.with_ranges(stiffness=(1e6, 1e6), damping_ratio=(1.0, 1.0), friction=(5.0, 5.0))
    still = populate(stiff, draws=2, seed=SEED, members=pairs()[:2]).counts() | {"stiff_pairs_on": 0}
    assert still["onset_off_m_s"] is None
    assert set(judge(still)) == set(BANDS) - {"off_slow", "stiff_pairs_on"}


@pytest.mark.parametrize("base", BASES)
def test_every_direction_that_riders_report_comes_out(base):
    assert [name for name, sign in signs(base).items() if not sign["as_reported"]] == []


@pytest.mark.parametrize(
    "names", [["sway_alone"], ["yaw", "sway"], ["yaw", "roll"], ["legs"], ["yaw", "legs"], ["torsion"]]
)
def test_bodies_on_stiff_joints_are_fixed_to_the_frame(names):
    """Also checks that a body is put back where it was taken out."""
    stiff = []
    for name in names:
        joint: Rival = getattr(rivals, name)
        ranges = {key: 1e9 if key.endswith("stiffness") else 0.5 for key in joint.ranges}
        stiff.append(replace(joint, ranges=at_values(ranges)))
    free, fixed = (_growth(assumption) for assumption in (BARE.with_rivals(*stiff), BARE))
    assert free == pytest.approx(fixed, abs=2e-3)


def _growth(assumption: Assumption):
    return populate(assumption, draws=3, seed=SEED, members=pairs()[:1]).off.growth[..., 4:20]


def test_reports_carry_a_source_and_say_what_is_no_ride():
    rows = read_reports()
    assert len(rows) == 41
    assert all(row["url"] for row in rows)
    assert sum(row["kind"] == "model" for row in rows) == 2
    assert {row["kind"] for row in rows} == {"report", "measurement", "model"}
    off, on = reported_speeds("off"), reported_speeds("on")
    assert (len(off), off[0], off[-1]) == (10, 5.4, 13.4)
    assert (len(on), on[0], on[-1]) == (17, 11.1, 26.4)


def test_the_default_bicycle_is_that_of_the_main_study():
    settings = Settings(load_bicycle("pista_charlie_drops"), tyre="Tyre1", pressures=(5.5,))
    (case,) = tyre_cases(settings).studied
    off, relaxed, tense = settings.setups[:3]
    expected = []
    for setup in (off, relaxed, tense):
        linear = model(settings, case.apply_to(setup), case.contact).linear_model()
        roots = np.array([linear.eigenvalues(speed) for speed in SPEEDS[within(ON)]])
        hertz = frequency_hz(roots)
        expected.append(roots.real[(hertz >= WOBBLE_HZ[0]) & (hertz < WOBBLE_HZ[1])].max())
    here = growths({}, RELAXED)
    assert [here["off"], here["on"], growths({}, TENSE)["on"]] == pytest.approx(expected, abs=0.006)
