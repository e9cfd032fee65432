"""Shipped ranges agree with what riders report, former and bare ones do not; directions that riders report come out."""

import pytest

from tests.validation import rider_rivals as rivals
from tests.validation.rider_populations import Assumption, Rival, at_values, pairs, populate
from tests.validation.what_riders_report import (
    BANDS,
    BARE,
    BASES,
    ROWS,
    SHIPPED,
    count,
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
    stiff = SHIPPED.with_ranges(stiffness=(1e6, 1e6), ratio=(1.0, 1.0), friction=(5.0, 5.0))
    still = populate(stiff, draws=2, seed=SEED, members=pairs()[:2]).counts() | {"stiff_pairs_on": 0}
    assert still["onset_off_m_s"] is None
    assert set(judge(still)) == set(BANDS) - {"off_slow", "stiff_pairs_on"}


@pytest.mark.parametrize("base", BASES)
def test_every_direction_that_riders_report_comes_out(base):
    assert [name for name, sign in signs(base).items() if not sign["as_reported"]] == []


@pytest.mark.parametrize("rival", ["saddle_yaw", "saddle_sway", "saddle_yaw_and_sway", "legs", "torsion"])
def test_a_body_on_stiff_joints_is_the_body_fixed_to_the_frame(rival):
    """Also checks that a body is put back where it was taken out."""
    joint: Rival = getattr(rivals, rival)
    stiff = {name: 1e9 if name.endswith("stiffness") else 0.5 for name in joint.ranges}
    held = BARE.with_rivals(Rival(joint.effect, at_values(stiff), joint.place, joint.inertia))
    free, fixed = (_growth(assumption) for assumption in (held, BARE))
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
