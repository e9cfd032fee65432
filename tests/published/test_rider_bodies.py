"""Three riders' bodies that another project computed with its own placement and equation solver, and ours.

Only the first was computed with the present yeadon and with the inputs that stand beside it. Its numbers come out to
the rounding of the wheelbase with yeadon's own sums; what is mended here (bicycle/rider/rider_body.py, checked against
thin slices in tests/bicycle) moves them by a known amount. The second was made by an older yeadon, whose solids
differ; the third with 72 kg and older measurements.
"""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

from bicycle.rider import Lengths, RigidBody, SeatGeometry, as_rear_frame, contacts, join, read_rider, sit
from bicycle.rider import rider_body as human

yeadon = pytest.importorskip("yeadon")
PUBLISHED = tomllib.loads((Path(__file__).parent / "data" / "rider_bodies.toml").read_text())
TO_BICYCLE = np.array([[0, -1, 0], [-1, 0, 0], [0, 0, -1.0]])


def seated(case, wheelbase=None):
    seat, bicycle = case["seat"], case["bicycle"] | ({"w": wheelbase} if wheelbase else {})
    geometry = SeatGeometry(
        {
            "chain_stay_m": seat["lcs"], "bottom_bracket_height_m": seat["hbb"],
            "seat_tube_angle_deg": math.degrees(seat["lamst"]), "saddle_distance_m": seat["lsp"] + seat["lst"],
            "hand_width_m": seat["whb"], "rear_hub_to_hand_m": seat["LhbR"], "front_hub_to_hand_m": seat["LhbF"],
        }
    )  # fmt: skip
    rider = read_rider("jason").weighing(case["body"]["mB"])
    at = contacts(geometry, bicycle)
    return rider, sit(Lengths.of(rider.lengths), at, torso_lean=case["torso_lean"]).configuration, at.hip


def ours(case):
    rider, configuration, hip = seated(case)
    return as_rear_frame(join([part.body for part in human.segments(rider, configuration, hip)]))


def as_yeadon_sums(case, wheelbase):
    """The human of yeadon itself, as it adds up its segments."""
    rider, configuration, hip = seated(case, wheelbase)
    with human.quiet_yeadon():
        body = yeadon.Human(dict(rider.lengths))
        body.set_CFG_dict(dict(configuration))
    factor = rider.mass / body.mass
    centre = np.array([hip[0], 0, hip[1]]) + TO_BICYCLE @ np.ravel(body.center_of_mass)
    return as_rear_frame(RigidBody(rider.mass, centre, factor * TO_BICYCLE @ body.inertia @ TO_BICYCLE.T))


@pytest.mark.skipif(yeadon.__version__ != "2.0.1", reason="what this version of yeadon does")
def test_the_balance_assist_rider_comes_out_as_published_with_yeadons_own_sums():
    case = PUBLISHED["balanceassistv1"]
    rounded, published = as_yeadon_sums(case, 1.113), case["body"]
    assert rounded == pytest.approx(published, rel=2e-4)
    # one wheelbase within its rounding to a millimetre explains all seven numbers
    assert as_yeadon_sums(case, 1.1132755) == pytest.approx(published, abs=2e-5)


@pytest.mark.parametrize(("name", "off"), [
    ("balanceassistv1", (-0.0021, -0.0049, -0.2412, -0.2445, -0.0333, -0.1724)),
    ("rigid", (-0.0030, 0.0125, 0.9198, 0.9703, -0.1540, 0.1020)),
    ("browser", (0.0228, 0.0055, 1.2945, 1.4487, -0.4396, 0.3606)),
])  # fmt: skip
def test_the_published_bodies_are_met_but_for_a_known_difference(name, off):
    """Stated in data/SOURCES.md: mended sums (first), an older yeadon (second), other inputs (third)."""
    found, published = ours(PUBLISHED[name]), PUBLISHED[name]["body"]
    assert found["mB"] == pytest.approx(published["mB"])
    for key, difference in zip(("xB", "zB", "IBxx", "IByy", "IBzz", "IBxz"), off, strict=True):
        assert found[key] - published[key] == pytest.approx(difference, abs=2e-4)
