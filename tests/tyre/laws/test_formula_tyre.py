"""What .tir files and Pacejka-89 coefficients hold near straight running, against their equations by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.shared.formula_tyres import PACEJKA89, TIR, tir_text
from tests.shared.refusals import refuses
from tyre import InputError, TyreMap, read_tyre
from tyre.laws import Pacejka89Tyre, parse_tir
from tyre.measured import out_of_reach


def tir(text=TIR):
    return parse_tir(text, source="made_up.tir")


@pytest.fixture
def made_up_89(tmp_path):
    (tmp_path / "t.toml").write_text(PACEJKA89)
    return read_tyre(tmp_path / "t.toml")


def test_camber_and_moments_of_mf61_by_hand():
    """Pacejka (2012), eqs. 4.E30, 4.E42, 4.E49 and 4.E69 in ISO axes, turned to x forward, y right, z down."""
    load, pressure = 380.0, 6e5
    dfz, dpi = 380 / 450 - 1, 0.2
    found = tir().at(load=load, pressure=pressure)
    camber_iso = 380 * (-0.8 + 0.1 * dfz) * (1 - 0.3 * dpi) * 0.9
    trail = 380 * 0.336 / 450 * (0.05 + 0.01 * dfz) * (1 - 0.2 * dpi) * 1.1
    residual_iso = 380 * 0.336 * (-0.045 - 0.004 * dfz) * (1 - 0.1 * dpi)
    overturning = 0.336 * 380 * 0.04 * (1 + 0.1 * dpi) * 0.95
    assert (found.camber_stiffness, found.pneumatic_trail) == pytest.approx((-camber_iso, trail), rel=1e-13)
    assert found.aligning_stiffness == pytest.approx(trail * found.cornering_stiffness, rel=1e-13)
    assert found.overturning_stiffness == pytest.approx(overturning, rel=1e-13)
    assert found.crown_radius == pytest.approx(0.336 * 0.04 * (1 + 0.1 * dpi) * 0.95, rel=1e-13)
    # the whole moment of camber about an axis that points up: Fz R0 (...) of 4.E32 and 4.E74, where the trail has the
    # force without camber; less Dt0 Kyg0 in 4.E49
    book = replace(tir(), camber_moment="book").at(load=load, pressure=pressure)
    for one, whole in ((found, residual_iso), (book, residual_iso - trail * camber_iso)):
        assert one.twisting_stiffness - trail * one.camber_stiffness == pytest.approx(-whole, rel=1e-13)
    assert any("camber_moment = 'book' takes the other" in note for note in found.notes)


def test_the_overturning_couple_with_all_its_terms():
    """By differences of eq. 4.E69 without lateral force."""
    text = TIR.replace("PPMX1", "QSX4 = 0.02\nQSX5 = 0.7\nQSX6 = 0.9\nQSX7 = 0.5\nQSX10 = 0.01\nQSX11 = 1.3\nPPMX1")
    fz, dpi, r0 = 380 / 450, 0.2, 0.336

    def mx(camber):
        bent = 0.02 * math.cos(0.7 * math.atan((0.9 * fz) ** 2)) * math.sin(0.5 * camber)
        share = -0.04 * camber * (1 + 0.1 * dpi) + bent + 0.01 * math.atan(1.3 * fz) * camber
        return r0 * 380 * share * 0.95

    found = tir(text).at(load=380.0, pressure=6e5)
    assert found.overturning_stiffness == pytest.approx(-(mx(1e-4) - mx(-1e-4)) / 2e-4, rel=1e-7)


def test_adapted_sae_signs_are_the_same_tyre():
    """A file that keeps adapted SAE signs (PKY1 > 0) has camber force and its moment with the other sign, too."""
    text = TIR
    for old, new in (("PKY1 = -17", "PKY1 = 17"), ("PKY6 = -0.8", "PKY6 = 0.8"), ("PKY7 = 0.1", "PKY7 = -0.1"),
                     ("QDZ8 = -", "QDZ8 = "), ("QDZ9 = -", "QDZ9 = ")):  # fmt: skip
        assert old in text
        text = text.replace(old, new)
    one, other = (source.at(load=380.0, pressure=6e5) for source in (tir(), tir(text)))
    for name in ("cornering_stiffness", "camber_stiffness", "pneumatic_trail", "twisting_stiffness", "crown_radius"):
        assert getattr(other, name) == pytest.approx(getattr(one, name), rel=1e-13)
    assert any("adapted SAE signs" in note for note in other.notes)


def test_mf52_camber_and_moments_by_hand():
    text = tir_text({
        "FITTYP": 52, "UNLOADED_RADIUS": 0.33, "INFLPRES": 500000, "FNOMIN": 450, "LGAY": 0.9, "LMUY": 0.8, "LGAZ": 1.2,
        "PKY1": -16, "PKY2": 1.2, "PTY1": 0.4, "PTY2": 1.5, "PHY3": 0.03, "PVY3": -0.4, "PVY4": 0.2, "QDZ1": 0.05,
        "QDZ8": -0.03, "QSX2": 0.05,
    })  # fmt: skip
    found = tir(text).at(load=400.0, pressure=5e5)
    kya = -16 * 450 * math.sin(2 * math.atan(400 / (1.2 * 450)))
    camber_iso = 0.9 * (0.03 * kya + 400 * (-0.4 + 0.2 * (400 / 450 - 1)) * 0.8)
    assert (found.cornering_stiffness, found.camber_stiffness) == pytest.approx((-kya, -camber_iso), rel=1e-13)
    assert found.pneumatic_trail == pytest.approx(400 * 0.05 * 0.33 / 450, rel=1e-13)
    assert found.twisting_stiffness == pytest.approx(400 * 0.33 * 0.03 * 0.8 * 1.2, rel=1e-13)
    assert found.crown_radius == pytest.approx(0.33 * 0.05, rel=1e-13)
    assert any("states no range of loads" in note for note in found.notes)
    assert tir(text).at(load=4000.0, pressure=5e5).inside  # nothing is stated, so nothing can be said


def test_what_a_file_does_not_hold_is_none():
    gone = ("PKY6", "PKY7", "PPY5", "QDZ", "QSX", "LATERAL_STIFFNESS")
    text = "\n".join(line for line in TIR.splitlines() if not line.startswith(gone))
    found = tir(text).at(load=380.0, pressure=6e5)
    assert math.isnan(found.lateral_stiffness)
    assert math.isnan(found.relaxation_length)
    for name in ("camber_stiffness", "pneumatic_trail", "aligning_stiffness", "twisting_stiffness", "crown_radius"):
        assert getattr(found, name) is None
    assert any("holds no lateral stiffness" in note for note in found.notes)


@pytest.mark.parametrize(("load", "pressure"), [(330.0, 3e5), (330.0, 5e5), (520.0, 5e5)])
def test_pacejka89_near_straight_running_by_differences(made_up_89, load, pressure):
    """Slopes of the published curves themselves, lateral force and moment over slip and camber."""
    found, h, at = made_up_89.at(load=load, pressure=pressure), 1e-6, {"load": load, "pressure": pressure}

    def slope(curve, **step):
        up, down = (curve(**({"slip_angle": 0.0} | {k: s * v for k, v in step.items()}), **at) for s in (1, -1))
        return float(up - down) / (2 * h)

    side, moment = made_up_89.lateral_force, made_up_89.aligning_moment
    assert found.cornering_stiffness == pytest.approx(slope(side, slip_angle=h), rel=1e-7)
    assert found.camber_stiffness == pytest.approx(slope(side, camber=h), rel=1e-6)
    assert found.aligning_stiffness == pytest.approx(-slope(moment, slip_angle=h), rel=1e-7)
    whole = found.twisting_stiffness - found.pneumatic_trail * found.camber_stiffness
    assert whole == pytest.approx(slope(moment, camber=h), rel=1e-5, abs=1e-5)
    assert found.lateral_stiffness == pytest.approx(45e3 if pressure == 3e5 else 70e3)
    assert found.relaxation_length == pytest.approx(found.cornering_stiffness / found.lateral_stiffness, rel=1e-13)


def test_between_and_beyond_the_pressures_of_pacejka89(made_up_89):
    low, high = (made_up_89.at(load=400.0, pressure=p).cornering_stiffness for p in (3e5, 5e5))
    assert made_up_89.at(load=400.0, pressure=4e5).cornering_stiffness == pytest.approx((low + high) / 2)
    beyond = made_up_89.at(load=400.0, pressure=6e5)
    assert beyond.cornering_stiffness == pytest.approx(high + (high - low) / 2)
    assert not beyond.inside
    assert any("extrapolated beyond the 0-1000 N and 3-5 bar for which" in note for note in beyond.notes)
    assert out_of_reach(made_up_89, load=400.0, pressure=6.9e5) is None
    said = out_of_reach(made_up_89, load=400.0, pressure=7.1e5)
    assert said == ("7.1 bar is more than one range width outside the 3-5 bar for which Made-up 89 on flat holds")


def test_a_tir_file_says_where_it_holds():
    assert tir().at(load=200.0, pressure=7e5).inside
    for load, pressure in ((199.0, 5e5), (801.0, 5e5), (400.0, 2.9e5), (400.0, 7.1e5)):
        beyond = tir().at(load=load, pressure=pressure)
        assert beyond.origin == "extrapolated"
        assert any("beyond the 200-800 N and 3-7 bar for which Made-up 28 on flat" in note for note in beyond.notes)
    assert "1401 N is more than one range width outside the 200-800 N" in out_of_reach(tir(), load=1401.0, pressure=5e5)


def test_assumed_uncertainty_is_common_to_all_conditions():
    properties, covariance = tir().assuming(0.03).joint([(300.0, 4e5), (500.0, 6e5)])
    scale = np.array([v for p in properties for v in (p.cornering_stiffness, p.lateral_stiffness, p.relaxation_length)])
    relative = covariance / np.outer(scale, scale)
    r = 0.03**2
    one = np.array([[r, 0, r], [0, r, -r], [r, -r, 2 * r]])  # d(ln length) = d(ln C) - d(ln K)
    np.testing.assert_allclose(relative, np.block([[one, one], [one, one]]), atol=1e-15)
    for n, p in enumerate(properties):
        own = slice(3 * n, 3 * n + 3)
        np.testing.assert_array_equal(p.covariance, covariance[own, own])
    assert not properties[0].cornering_stiffness_sd_stated
    assert not properties[0].lateral_stiffness_sd_stated
    assert any("assumed: 3 %" in note for note in properties[0].notes)


@pytest.mark.parametrize("name", ["Tyre1", "tir", "89"])
def test_many_conditions_at_once_are_those_one_by_one(made_up_89, name):
    tyre = {"tir": tir(), "89": made_up_89}.get(name) or TyreMap.load(name)
    load, pressure = np.array([250.0, 400.0, 610.0]), np.array([3.5e5, 5e5, 5.1e5])
    held = tyre.linear(load=load, pressure=pressure)
    for n in range(3):
        one = tyre.at(load=load[n], pressure=pressure[n])
        for field, values in held.items():
            assert values[n] == pytest.approx(getattr(one, field), rel=1e-12)


def test_every_kind_of_file_is_read(tmp_path):
    (tmp_path / "a.tir").write_text(TIR)
    (tmp_path / "b.toml").write_text(PACEJKA89)
    TyreMap.load("Tyre1").to_file(tmp_path / "c.csv")
    names = [read_tyre(tmp_path / name).tyre for name in ("a.tir", "b.toml", "c.csv", "c.toml")]
    assert names == ["Made-up 28", "Made-up 89", "Tyre1", "Tyre1"]
    assert read_tyre("Tyre1", surface="drum").surface == "drum"
    assert read_tyre("Schwalbe 50km Energizer Plus 28 x 1.75").surface == "flat"
    assert read_tyre(tmp_path / "a.tir").synthetic
    assert read_tyre(tmp_path / "b.toml").synthetic
    with pytest.raises(InputError, match=r"a\.tir was not measured on surface 'drum', only on: flat; leave surface"):
        read_tyre(tmp_path / "a.tir", surface="drum")
    refuses(r"did you mean 'Tyre2'\?\); available are Schwalbe .*, Tyre1, .*\.tir", read_tyre, "Tyr2")
    (tmp_path / "d.toml").write_text('kind = "brush"\n')
    refuses("kind = 'brush'; a tyre is a table without a kind, or kind = 'pacejka89'", read_tyre, tmp_path / "d.toml")


def test_impossible_conditions_are_refused(made_up_89):
    refuses("load is 0 N; it must be finite and > 0", tir().at, load=0.0, pressure=5e5)
    with pytest.raises(InputError, match="give a lateral stiffness of -.* N/m, which is not physical; stay nearer to"):
        tir(TIR.replace("PCFY3 = 0.5", "PCFY3 = 9")).at(load=400.0, pressure=3e5)
    refuses("no condition asked for", made_up_89.joint, [])
    refuses(r"relative_stiffness_sd is -1; it must be finite and >= 0", tir().assuming, -1.0)
    with pytest.raises(InputError, match="FZMIN = 900 is above FZMAX = 800; exchange them"):
        tir(TIR.replace("FZMIN = 200", "FZMIN = 900")).at(load=400.0, pressure=3e5)
    single = Pacejka89Tyre("one", "flat", made_up_89.sets[:1], "made up")
    assert single.at(load=400.0, pressure=3e5).inside
    refuses("pressure is 4 bar, but it was fitted at 3 bar only", single.at, load=400.0, pressure=4e5)
