"""A .tir or Pacejka-89 tyre under a bicycle: values of its effects against the equations by hand, and refusals."""

import math

import pytest

from bicycle import load_bicycle
from bicycle.effects import WHEELS
from bicycle.model import build_model, read_model
from tests.shared.formula_tyres import MODEL, PACEJKA89, TIR
from tyre.ground import InputError

BICYCLE = load_bicycle("benchmark")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "my.tir").write_text(TIR)
    (tmp_path / "my89.toml").write_text(PACEJKA89)
    return tmp_path


def model_of(folder, tyre, pressure=5):
    (folder / "model.toml").write_text(MODEL.format(tyre=tyre, pressure=pressure))
    return read_model(folder / "model.toml")


def mf61_by_hand(load, pressure):
    """Besselink, Schmeitz & Pacejka (2010); Pacejka (2012), eqs. 4.E25, 4.E30, 4.E42, 4.E32 and 4.E74, A3.9."""
    dfz, dpi, fz0, r0 = load / 450 - 1, pressure / 5e5 - 1, 450.0, 0.336
    kya = -17 * fz0 * (1 + 0.2 * dpi) * math.sin(2 * math.atan(load / (1.8 * (1 + 0.5 * dpi) * fz0)))
    cy = 60000 * (1 + 0.2 * dfz) * (1 + 0.5 * dpi)
    camber = -load * (-0.8 + 0.1 * dfz) * (1 - 0.3 * dpi) * 0.9
    trail = load * r0 / fz0 * (0.05 + 0.01 * dfz) * (1 - 0.2 * dpi) * 1.1
    residual = load * r0 * (0.045 + 0.004 * dfz) * (1 - 0.1 * dpi)
    return {
        "relaxation_length.cornering_stiffness": -kya,
        "relaxation_length.relaxation_length": abs(kya / cy),
        "camber_thrust.camber_stiffness": camber,
        "pneumatic_trail.trail": trail,
        "twisting_torque.twisting_stiffness": residual + trail * camber,  # the trail acts on the force without camber
    }


def pacejka89_by_hand(load):
    """The hard set, at its own pressure: no shifts without camber, so slopes are BCD at X = 0."""
    fz, degree = load / 1e3, math.pi / 180
    slope = 110 * math.sin(2 * math.atan(fz / 0.7))
    moment = -4 * fz
    camber = (slope * 0.05 + 2 * fz) / degree
    return {
        "relaxation_length.cornering_stiffness": slope / degree,
        "relaxation_length.relaxation_length": slope / degree / 70e3,
        "camber_thrust.camber_stiffness": camber,
        "pneumatic_trail.trail": -moment / slope,
        "twisting_torque.twisting_stiffness": (moment * 0.05 + 0.3 * fz) / degree - moment / slope * camber,
    }


@pytest.mark.parametrize("tyre", ["my.tir", "my89.toml"])
def test_every_value_is_that_of_the_equations_at_the_wheel_loads(folder, tyre):
    model = model_of(folder, tyre)
    for wheel, load in zip(WHEELS, BICYCLE.static_loads, strict=True):
        expected = mf61_by_hand(load, 5e5) if tyre == "my.tir" else pacejka89_by_hand(load)
        for key, value in expected.items():
            assert model.parameters[f"{key}.{wheel}"] == pytest.approx(value, rel=1e-12), (key, wheel)
    assert any("states no uncertainty" in note for note in model.notes)
    assert any("synthetic" in note for note in model.notes)


def test_the_moment_of_camber_of_the_book_is_chosen_in_the_model_file(folder):
    """4.E49: the trail acts on the camber force, too, so less of it stands in the twisting torque."""
    tables = {"relaxation_length": {"tyre": "my.tir", "pressure_bar": 5, "camber_moment": "book"}, "pneumatic_trail":
              {"trail": "tyre"}, "twisting_torque": {"twisting_stiffness": "tyre"}}  # fmt: skip
    model = build_model({"bicycle": "benchmark", "effects": tables}, folder=folder)
    for wheel, load in zip(WHEELS, BICYCLE.static_loads, strict=True):
        hand = mf61_by_hand(load, 5e5)
        part = hand["pneumatic_trail.trail"] * hand["camber_thrust.camber_stiffness"]
        expected = hand["twisting_torque.twisting_stiffness"] - part
        assert model.parameters[f"twisting_torque.twisting_stiffness.{wheel}"] == pytest.approx(expected, rel=1e-12)
    tables["relaxation_length"]["tyre"] = "my89.toml"
    with pytest.raises(InputError, match=r"camber_moment = 'book' is of a \.tir file"):
        build_model({"bicycle": "benchmark", "effects": tables}, folder=folder)


@pytest.mark.parametrize("pressure", ["", "[OPERATING_CONDITIONS]\nINFLPRES = 400000\n"])
def test_a_pressure_that_changes_nothing_is_not_asked_for(folder, pressure):
    (folder / "old.tir").write_text("[UNITS]\nLENGTH='meter'\n" + pressure + "[MODEL]\nFITTYP=6\nUNLOADED_RADIUS=0.3\n"
                                    "FNOMIN=500\nPKY1=-14\nPKY2=2\nPTY1=0.4\nPTY2=2\n")  # fmt: skip
    model = build_model({"bicycle": "benchmark", "effects": {"relaxation_length": {"tyre": "old.tir"}}}, folder=folder)
    for wheel, load in zip(WHEELS, BICYCLE.static_loads, strict=True):
        expected = 14 * 500 * math.sin(2 * math.atan(load / 1000))
        assert model.parameters[f"relaxation_length.cornering_stiffness.{wheel}"] == pytest.approx(expected)
    assert not any("nan" in note for note in model.notes)


def test_uncertainty_of_a_formula_is_assumed_and_said_so(folder):
    model = model_of(folder, "my.tir")
    law = "relaxation_length"
    for wheel in WHEELS:
        stiffness = model.parameters[f"{law}.cornering_stiffness.{wheel}"]
        length = model.parameters[f"{law}.relaxation_length.{wheel}"]
        assert model.sd[f"{law}.cornering_stiffness.{wheel}"] == pytest.approx(0.03 * stiffness)
        assert model.sd[f"{law}.relaxation_length.{wheel}"] == pytest.approx(math.sqrt(2) * 0.03 * length)
    assert set(model.assumed_sd) == set(model.sd)


def test_aligning_moment_and_crown_radius_of_the_tyre(folder):
    tables = {
        "side_slip": {"tyre": str(folder / "my.tir"), "pressure_bar": 5},
        "aligning_moment": {"aligning_stiffness": "tyre", "relaxation_length": "tyre"},
        "crown_radius": {"crown_radius": "tyre"},
    }
    found = build_model({"bicycle": "benchmark", "effects": tables}).parameters
    for wheel, load in zip(WHEELS, BICYCLE.static_loads, strict=True):
        hand = mf61_by_hand(load, 5e5)
        moment = hand["pneumatic_trail.trail"] * hand["relaxation_length.cornering_stiffness"]
        assert found[f"aligning_moment.aligning_stiffness.{wheel}"] == pytest.approx(moment, rel=1e-12)
        length = hand["relaxation_length.relaxation_length"]
        assert found[f"aligning_moment.relaxation_length.{wheel}"] == pytest.approx(length, rel=1e-12)
        assert found[f"crown_radius.crown_radius.{wheel}"] == pytest.approx(0.336 * 0.04 * 0.95, rel=1e-12)


def test_a_tyre_without_a_relaxation_length_takes_one_beside_it():
    schwalbe = {"tyre": "Schwalbe 50km Energizer Plus 28 x 1.75", "pressure_bar": 4}
    beside = schwalbe | {"relaxation_length": 0.11}
    model = build_model({"bicycle": "benchmark", "effects": {"relaxation_length": beside}})
    assert model.parameters["relaxation_length.relaxation_length.front"] == 0.11
    assert "relaxation_length.relaxation_length.front" not in model.sd
    with pytest.raises(
        InputError, match=r"holds no relaxation length; give relaxation_length a number \(m, typical 0.05"
    ):
        build_model({"bicycle": "benchmark", "effects": {"relaxation_length": schwalbe}})
    with pytest.raises(InputError, match="give either tyre, surface and pressure_bar or cornering_stiffness, not both"):
        build_model({"bicycle": "benchmark", "effects": {"side_slip": schwalbe | {"cornering_stiffness": 5000.0}}})


LAW = {"tyre": "Tyre1", "pressure_bar": 5.5}


@pytest.mark.parametrize(("tables", "message"), [
    ({"relaxation_length": LAW, "camber_thrust": {"camber_stiffness": "tyre"}},
     r"'camber_thrust': Tyre1 on flat holds no camber stiffness; give camber_stiffness a number \(N/rad, typical"),
    ({"camber_thrust": {"camber_stiffness": "tyre"}},
     r'camber_stiffness = "tyre" needs a tyre: give \[effects.relaxation_length\] or \[effects.side_slip\] a tyre'),
    ({"relaxation_length": {"tyre": "my.tir", "pressure_bar": 5}, "camber_thrust": {}},
     r"camber_stiffness is missing; give a number \(N/rad\), or \"tyre\" for what the tyre holds"),
    ({"relaxation_length": LAW, "steer_damper": {"damping": "tyre"}},
     r'damping = "tyre", but a tyre does not hold it; give a number \(N m s/rad\)'),
    ({"side_slip": {"tyre": "my.tir", "pressure_bar": 5}, "twisting_torque": {"twisting_stiffness": "tyre"}},
     r"that of pneumatic_trail; add \[effects.pneumatic_trail\] or give a number"),
    ({"relaxation_length": LAW, "side_slip": LAW},
     "effects 'relaxation_length' and 'side_slip' exclude each other: both are the contact law"),
    ({"relaxation_length": {"tyre": "my.tir", "pressure_bar": 12}},
     r"wheel: 12 bar is more than one range width outside the 3-7 bar for which Made-up 28 on flat \(my.tir\) holds; "
      "use .* extrapolate = true"),
    ({"relaxation_length": {"tyre": "my89.toml", "pressure_bar": 7.5}},
     "7.5 bar is more than one range width outside the 3-5 bar for which Made-up 89 on flat holds"),
    ({"relaxation_length": {"tyre": "none.tir", "pressure_bar": 7.5}}, r"none\.tir: cannot be read"),
    ({"relaxation_length": LAW | {"surface": "road"}}, "Tyre1 was not measured on surface 'road'"),
])  # fmt: skip
def test_what_cannot_be_is_refused(folder, tables, message):
    with pytest.raises(InputError, match=message):
        build_model({"bicycle": "benchmark", "effects": tables}, folder=folder)


def test_a_table_of_several_tyres_gives_each_wheel_its_own_with_its_camber_stiffness(tmp_path):
    """SYNTHETIC; between its two loads the camber stiffness is linear."""
    head = "tyre,load_N,p [bar],C [N/deg],K [N/mm],Camber stiffness (N/deg),Comment\n"
    rows = "A,300,4,80,60,5,\nA,900,4,170,62,17,re-run\nB,200,4,60,75,4,\nB,400,4,110,77,10,\n"
    (tmp_path / "two.csv").write_text(head + rows)
    (tmp_path / "model.toml").write_text(
        'bicycle = "benchmark"\n[effects.relaxation_length]\ntyre = {rear = "two.csv#A", front = "two.csv#B"}\n'
        'pressure_bar = 4\n[effects.camber_thrust]\ncamber_stiffness = "tyre"\n'
    )
    model = read_model(tmp_path / "model.toml")
    rear, front = model.bicycle.static_loads
    degree = math.pi / 180
    expected = {"rear": (5 + 12 * (rear - 300) / 600) / degree, "front": (4 + 6 * (front - 200) / 200) / degree}
    for wheel, value in expected.items():
        assert model.parameters[f"camber_thrust.camber_stiffness.{wheel}"] == pytest.approx(value, rel=1e-9)
