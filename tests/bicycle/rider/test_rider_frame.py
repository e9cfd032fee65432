"""Rear frame with rider: signs, conservation, and what the uncertainty is made of."""

import math

import numpy as np
import pytest

from bicycle import load_bicycle
from bicycle.rider import (
    ANGLE_SD,
    FRAME_KEYS,
    SeatGeometry,
    packaged_geometry,
    read_geometry,
    read_rider,
    rider_on_bicycle,
    scaled_rider,
)
from tyre.ground import InputError

pytest.importorskip("yeadon")
PISTA = load_bicycle("pista")


def on_pista(posture="hoods", rider="charlie", geometry=None, **angles):
    known = geometry or read_geometry(packaged_geometry("pista"), posture)
    return rider_on_bicycle(PISTA, read_rider(rider), posture=posture, geometry=known, **angles)


@pytest.fixture(scope="module")
def hoods():
    return on_pista()


def test_masses_add_and_the_centre_lies_between(hoods):
    values = hoods.values
    assert values["mB"] == pytest.approx(PISTA["mB"] + 78.745)
    for key, rider in (("xB", hoods.body.centre[0]), ("zB", hoods.body.centre[2])):
        assert values[key] == pytest.approx((PISTA["mB"] * PISTA[key] + 78.745 * rider) / values["mB"])
    assert hoods.body.centre[1] == pytest.approx(0, abs=1e-12)
    made = hoods.bicycle("me", "", "")
    assert sum(made.static_loads) == pytest.approx(
        (PISTA["mR"] + PISTA["mH"] + PISTA["mF"] + values["mB"]) * PISTA["g"]
    )
    assert made["IHxx"] == PISTA["IHxx"]


def test_the_cause_torso_lean_is_half_the_difference_of_two_postures(hoods):
    """With saddle and bar where they are."""
    near = SeatGeometry({"reach_m": 0.65, "drop_m": 0.15}, {"reach_m": 0.01, "drop_m": 0.01})
    found = on_pista("drops", geometry=near)
    more, less = (
        on_pista("drops", geometry=found.geometry, torso_lean=found.angles.torso_lean + s * ANGLE_SD).values
        for s in (1, -1)
    )
    half = np.array([(more[key] - less[key]) / 2 for key in FRAME_KEYS])
    np.testing.assert_allclose(found.causes["torso lean"], half, atol=1e-9)
    assert math.degrees(ANGLE_SD) == 5


def test_a_scaled_rider_is_less_certain(hoods):
    scaled = rider_on_bicycle(
        PISTA, scaled_rider(height=1.75, mass=78.745), posture="hoods",
        geometry=read_geometry(packaged_geometry("pista"), "hoods"),
    )  # fmt: skip
    for key in ("IBxx", "IBzz", "IBxz"):
        assert scaled.sd[key] > hoods.sd[key]
        # six measured people scaled to one body differ by 0.57, 0.22 and 0.22 kg m^2
        assert scaled.sd[key] > {"IBxx": 0.57, "IBzz": 0.22, "IBxz": 0.22}[key]


def test_a_frame_without_pitch_inertia_keeps_none():
    values = {key: value for key, value in PISTA.values.items() if key != "IByy"}
    found = rider_on_bicycle(
        type(PISTA)("mine", values), read_rider("jason"), posture="drops", geometry=SeatGeometry()
    )  # fmt: skip
    assert "IByy" not in found.values
    assert set(found.sd) == set(FRAME_KEYS) - {"IByy"}


def test_what_is_refused():
    with pytest.raises(
        InputError, match="weighs 76.49 kg, so it carries a rider already .limit 60 kg.; give a bicycle"
    ):
        rider_on_bicycle(
            load_bicycle("pista_rider"), read_rider("jason"), posture="drops", geometry=SeatGeometry()
        )  # fmt: skip
    with pytest.raises(InputError, match="torso lean = 120 deg must lie between -60 and 90 degrees"):
        on_pista(torso_lean=math.radians(120))
    with pytest.raises(InputError, match="elbows out = nan deg must lie"):
        on_pista(elbows_out=math.nan)
