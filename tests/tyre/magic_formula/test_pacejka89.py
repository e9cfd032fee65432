"""Pacejka-89: formula against its own derivative and hand computation, ranges, sanity checks, file format."""

from dataclasses import replace
from importlib.resources.abc import Traversable

import numpy as np
import pytest

from tyre.base.errors import InputError
from tyre.base.paths import data_root
from tyre.magic_formula.pacejka89 import Pacejka89
from tyre.magic_formula.pacejka89_file import check_coefficients, read_pacejka89

# A made-up but sound tyre: no shifts, no camber, 100 N/deg at the load of the largest slope.
LATERAL = (1.3, 0.0, 1000.0, 100.0, 0.5, 0.0, 0.0, -1.0, 0.05, 0.0, 0.0, 5.0, 0.0, 0.0)
ALIGNING = (2.2, 0.0, 10.0, 0.0, -4.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
FIT = Pacejka89("made-up", 4e5, 1000.0, LATERAL, ALIGNING)


def test_side_force_by_hand():
    # 500 N: BCD = 100 sin(2 atan(0.5/0.5)) = 100 N/deg, D = 500 N, B = 100 / (1.3 * 500) per deg, E = -1
    b = 100.0 / 650.0
    x = 2.0 * b
    expected = 500.0 * np.sin(1.3 * np.arctan(x + (x - np.arctan(x))))
    assert FIT.side_force(slip_angle=np.deg2rad(2.0), load=500.0) == pytest.approx(expected, rel=1e-13)
    assert FIT.cornering_stiffness(load=500.0) == pytest.approx(100.0 * 180.0 / np.pi, rel=1e-13)
    assert FIT.aligning_stiffness(load=500.0) == pytest.approx(2.0 * 180.0 / np.pi, rel=1e-13)
    assert FIT.pneumatic_trail(load=500.0) == pytest.approx(0.02, rel=1e-13)
    # camber: shift of 0.05 deg per deg at 100 N/deg, and 5 N/deg per kN
    assert FIT.camber_stiffness(load=500.0) == pytest.approx((100.0 * 0.05 + 2.5) * 180.0 / np.pi, rel=1e-13)


@pytest.mark.parametrize("load", [250.0, 400.0, 700.0])
@pytest.mark.parametrize("shift", [0.0, 0.7])
def test_stiffnesses_are_the_slopes_of_the_curves(load, shift):
    lateral, aligning = list(LATERAL), list(ALIGNING)
    lateral[10], lateral[13], aligning[13] = shift, 20.0, -shift
    fit = replace(FIT, side_force_coefficients=tuple(lateral), aligning_moment_coefficients=tuple(aligning))
    h = 1e-5
    for curve, slope, sign in (
        (fit.side_force, fit.cornering_stiffness, 1.0),
        (fit.aligning_moment, fit.aligning_stiffness, -1.0),
    ):
        central = (curve(slip_angle=h, load=load) - curve(slip_angle=-h, load=load)) / (2 * h)
        assert slope(load=load) == pytest.approx(sign * central, rel=1e-6)
    side = [fit.side_force(slip_angle=0.0, load=load, camber=c) for c in (h, -h)]
    assert fit.camber_stiffness(load=load) == pytest.approx((side[0] - side[1]) / (2 * h), rel=1e-6)


def test_slip_in_radians_is_the_same_formula():
    deg = np.pi / 180.0
    lateral = list(LATERAL)
    lateral[3] /= deg  # N/deg -> N/rad
    lateral[8] *= deg  # shift of slip
    rad = replace(FIT, side_force_coefficients=tuple(lateral), slip_unit="rad")
    slip = np.linspace(-0.1, 0.1, 7)
    np.testing.assert_allclose(
        rad.side_force(slip_angle=slip, load=400.0, camber=0.1), FIT.side_force(slip_angle=slip, load=400.0, camber=0.1)
    )
    assert rad.cornering_stiffness(load=400.0) == pytest.approx(FIT.cornering_stiffness(load=400.0))


def test_shapes_broadcast():
    force = FIT.side_force(slip_angle=np.zeros((3, 1)), load=np.array([300.0, 400.0]))
    assert force.shape == (3, 2)


@pytest.mark.parametrize("load", [0.0, -100.0, 1001.0, np.nan])
def test_loads_beyond_the_fit_are_refused(load):
    with pytest.raises(InputError, match="is outside of the fit, which holds above 0 and up to 1000 N"):
        FIT.side_force(slip_angle=0.0, load=load)


def test_a_set_without_moment_says_so():
    with pytest.raises(InputError, match="the set has no aligning moment"):
        replace(FIT, aligning_moment_coefficients=None).pneumatic_trail(load=400.0)


def coefficients(position, value, which=LATERAL):
    return tuple(value if index == position else number for index, number in enumerate(which))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"side_force_coefficients": coefficients(3, 8000.0)}, "cornering stiffness at 200 N is 5517 N/deg"),
        ({"side_force_coefficients": coefficients(3, -100.0)}, "cornering stiffness at 200 N is -68.97 N/deg"),
        ({"side_force_coefficients": coefficients(13, 900.0)}, "its sign must follow the slip"),
        ({"side_force_coefficients": coefficients(2, 1600.0, coefficients(0, 2.0))}, "times the load, allowed is 1.5"),
        ({"aligning_moment_coefficients": coefficients(4, 4.0, ALIGNING)}, "pneumatic trail at 200 N is -11.6 mm"),
    ],
)
def test_unsound_coefficients_are_refused(change, message):
    check_coefficients(FIT)
    with pytest.raises(InputError, match=message):
        check_coefficients(replace(FIT, **change))


def test_between_pressures_values_are_linear_and_beyond_refused():
    tyre = read_pacejka89("schwalbe_energizer_plus_28x1.75")
    low, middle, high = (float(tyre.cornering_stiffness(load=400.0, pressure=p)) for p in (3e5, 3.5e5, 4e5))
    assert middle == pytest.approx((low + high) / 2)
    assert float(tyre.aligning_moment(slip_angle=0.01, load=400.0, pressure=5e5)) < 0.0
    with pytest.raises(InputError, match="pressure 5.5 bar is outside of the fitted 3 to 5 bar"):
        tyre.side_force(slip_angle=0.0, load=400.0, pressure=5.5e5)


TEXT = f"""kind = "pacejka89"
tyre = "T"
surface = "flat"
load_max_N = 1000
source = "test"
licence = "none"
[[set]]
label = "only"
pressure_kPa = 400.0
side_force = {list(LATERAL)}
"""


def test_a_file_of_ones_own(tmp_path):
    path = tmp_path / "t.toml"
    path.write_text(TEXT)
    assert read_pacejka89(path).cornering_stiffness(load=500.0, pressure=4e5) == pytest.approx(100.0 * 180.0 / np.pi)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("pacejka89", "map"), "kind = 'map' must be 'pacejka89'"),
        (("licence", "license"), "unknown key 'license'; did you mean 'licence'"),
        (("label", "name"), "number 1: unknown key 'name'"),
        (('source = "test"\n', ""), "source is missing"),
        (("[1.3, ", "["), r"number 1: side_force = \[.*must be a list of 14 numbers"),
        (("100.0", "8000.0"), "the fit is not usable"),
        (('licence = "none"', 'licence = "none"\nslip_unit = "grad"'), "slip_unit = 'grad' is neither"),
        (("[[set]]", "[[set"), "not a TOML file"),
        (("[1.3, ", "[1e13, "), "side_force = .* must be a list of 14 numbers"),
        (("[1.3, ", "[" + "9" * 400 + ", "), "side_force = .* must be a list of 14 numbers"),
        (("[1.3, ", "[true, "), "side_force = .* must be a list of 14 numbers"),
        (('surface = "flat"', "surface = 3"), "surface = 3 must be text in quotes"),
        (('licence = "none"', 'licence = "none"\nnote = [1]'), "note = .* must be text in quotes"),
    ],
)
def test_malformed_files_are_refused(tmp_path, change, message):
    path = tmp_path / "t.toml"
    path.write_text(TEXT.replace(*change))
    with pytest.raises(InputError, match=message):
        read_pacejka89(path)


def test_unknown_tyres_are_refused():
    with pytest.raises(InputError, match=r"none\.toml: no such file of Pacejka-89 coefficients"):
        read_pacejka89("none")


def test_every_packaged_tyre_of_this_kind_can_be_read():
    def files(folder: Traversable):
        return [f for f in folder.iterdir() if f.name.endswith(".toml") and 'kind = "pacejka89"' in f.read_text()]

    tyres = [read_pacejka89(file) for file in files(data_root() / "tyres")]
    assert len(tyres) >= 1
    assert all(tyre.notes and tyre.source for tyre in tyres)


@pytest.mark.parametrize("camber", [-0.06, 0.0, 0.11])
@pytest.mark.parametrize("slip", [-0.05, 0.0, 0.03])
def test_the_moment_of_a_leaning_tyre_by_the_formula(slip, camber):
    """Bakker, Pacejka & Lidner (1989), SAE 890087, eqs. of M_z with camber, written out; load in kN, angles in deg."""
    c = (2.3, -1.1, 6.5, -0.8, -3.2, 0.12, 0.031, 0.07, -0.24, -2.1, 0.023, 0.041, -0.06, 0.21, -0.017, 0.29, 0.4, -0.9)
    fit, fz, x, g = replace(FIT, aligning_moment_coefficients=c), 0.45, np.degrees(slip), np.degrees(camber)
    d = c[1] * fz**2 + c[2] * fz
    b = (c[3] * fz**2 + c[4] * fz) * (1 - c[6] * abs(g)) * np.exp(-c[5] * fz) / (c[0] * d)
    e = (c[7] * fz**2 + c[8] * fz + c[9]) * (1 - c[10] * abs(g))
    x = x + c[11] * g + c[12] * fz + c[13]
    phi = (1 - e) * x + e / b * np.arctan(b * x)
    moment = d * np.sin(c[0] * np.arctan(b * phi)) + (c[14] * fz**2 + c[15] * fz) * g + c[16] * fz + c[17]
    assert fit.aligning_moment(slip_angle=slip, load=450.0, camber=camber) == pytest.approx(moment, rel=1e-12)


def test_a_coefficient_that_is_no_number_is_refused():
    for value in (np.nan, np.inf, -2e12):
        with pytest.raises(InputError, match=r"a3 = .* must be a number up to 1e\+12 in size"):
            replace(FIT, side_force_coefficients=(*LATERAL[:3], value, *LATERAL[4:]))


def test_coefficients_that_make_no_number_are_refused_without_a_warning():
    with pytest.raises(InputError, match="the fit is not usable"):
        check_coefficients(replace(FIT, side_force_coefficients=(*LATERAL[:4], 0.0, *LATERAL[5:])))
