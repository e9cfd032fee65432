"""What a table states of its uncertainty beside two standard deviations: read, checked, carried between conditions."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.shared.refusals import refuses
from tyre import InputError, MeasuredTable, TyreMap
from tyre.maps import predicted_column, read_table, write_table
from tyre.measured import CommonCalibration, MeasuredColumn, wheel_properties

GAINS = CommonCalibration(force=0.006, slip=0.004, displacement=0.003)
LOAD, PRESSURE = (np.array([300.0, 500.0, 300.0, 500.0]), np.array([4e5, 4e5, 6e5, 6e5]))
C, K = np.array([5200.0, 6900.0, 5000.0, 7100.0]), np.array([50e3, 52e3, 61e3, 64e3])
SMOOTH = 8000.0 * 2 * (LOAD / 700.0) / (1 + (LOAD / 700.0) ** 2)  # sin(2 atan x), the law of the map itself
HEAD = (
    "load_N,pressure_bar,cornering_stiffness_N_per_deg,cornering_stiffness_sd_N_per_deg,lateral_stiffness_N_per_mm,"
    "lateral_stiffness_sd_N_per_mm"
)
ROWS = ("300,4,90,1.8,50,1", "500,4,120,2.4,52,1")
TOML = 'tyre = "mine"\nsurface = "flat"\nsource = "made up"\nsynthetic = true\n'
CALIBRATION = "[calibration]\nforce = 0.006\nslip = 0.004\ndisplacement = 0.003\n"


def table(**changes):
    known = {"tyre": "T", "surface": "flat", "load": LOAD, "pressure": PRESSURE, "synthetic": True}
    known |= {"cornering_stiffness": C, "cornering_stiffness_sd": 0.012 * C, "calibration": GAINS}
    known |= {"lateral_stiffness": K, "lateral_stiffness_sd": 0.009 * K}
    return MeasuredTable(**known | changes)


def put(folder: Path, more: str = "", cells: tuple[str, str] = ("", ""), toml: str = "") -> Path:
    lines = [HEAD + more, *(row + cell for row, cell in zip(ROWS, cells, strict=True))]
    (folder / "mine.csv").write_text("\n".join(lines) + "\n")
    (folder / "mine.toml").write_text(TOML + toml)
    return folder / "mine.csv"


def relative(properties, covariance):
    values = [v for p in properties for v in (p.cornering_stiffness, p.lateral_stiffness, p.relaxation_length)]
    return covariance / np.outer(values, values)


def test_calibration_alone_is_one_common_error_at_any_condition():
    """No scatter beside the gains, a law without misfit: C, K and length move by the gains, all conditions together."""
    common = GAINS.relative_covariance
    smooth = table(
        lateral_stiffness=np.full(4, 55e3), lateral_stiffness_sd=np.full(4, 55e3 * np.sqrt(common[1, 1])),
        cornering_stiffness=SMOOTH, cornering_stiffness_sd=SMOOTH * np.sqrt(common[0, 0]),
    )  # fmt: skip
    found = TyreMap(smooth).joint([(300.0, 4e5), (417.0, 4.7e5), (560.0, 6.5e5)])
    gains = np.array([[1, -1, 0], [1, 0, -1], [0, -1, 1]]) * [0.006, 0.004, 0.003]  # of C, K, C/K
    np.testing.assert_allclose(relative(*found), np.tile(gains @ gains.T, (3, 3)), rtol=1e-6)


def test_scatter_is_each_conditions_own_and_the_gains_are_not_averaged_out():
    """Half way between four conditions bilinear weights are 1/4: a quarter of the mean scatter, all of the gains."""
    tyre = TyreMap(table(cornering_stiffness=SMOOTH, cornering_stiffness_sd=SMOOTH * 0.012,
                         lateral_stiffness=np.full(4, 55e3), lateral_stiffness_sd=np.full(4, 550.0)))  # fmt: skip
    (one,), covariance = tyre.joint([(400.0, 5e5)])
    assert one.lateral_stiffness_sd**2 == pytest.approx(55e3**2 * (4.5e-5 + (0.01**2 - 4.5e-5) / 4), rel=1e-9)
    assert covariance[0, 1] == pytest.approx(one.cornering_stiffness * 55e3 * 0.006**2, rel=1e-6)


def test_correlation_of_a_row_is_taken_as_it_stands():
    correlation = np.array([0.5, 0.2, 0.34, 0.4])
    properties, covariance = TyreMap(table(stiffness_correlation=correlation)).joint(
        list(zip(LOAD, PRESSURE, strict=True))
    )
    for row, one in enumerate(properties):
        expected = correlation[row] * 0.012 * C[row] * 0.009 * K[row]
        assert one.covariance[0, 1] == pytest.approx(expected, rel=1e-12)
        square = 0.012**2 + 0.009**2 - 2 * correlation[row] * 0.012 * 0.009
        assert one.relaxation_length_sd / one.relaxation_length == pytest.approx(np.sqrt(square), rel=1e-12)
    assert covariance[0, 4] == pytest.approx(C[0] * K[1] * 0.006**2, rel=1e-9)
    lone, _ = TyreMap(table(calibration=None, stiffness_correlation=correlation)).joint([(300.0, 4e5)])
    assert lone[0].covariance[0, 1] == pytest.approx(0.5 * 0.012 * C[0] * 0.009 * K[0], rel=1e-12)


def test_degrees_of_freedom_of_pooled_scatter_do_not_add_up():
    """Between conditions the scatter of each is known equally badly: that of the mean has no more than one of them."""
    flat = table(
        cornering_stiffness=SMOOTH, cornering_stiffness_sd=SMOOTH * 0.012, calibration=None,
        lateral_stiffness=np.full(4, 55e3), lateral_stiffness_sd=np.full(4, 550.0),
        cornering_stiffness_dof=np.full(4, 12.0), lateral_stiffness_dof=np.full(4, 7.0),
    )  # fmt: skip
    at = TyreMap(flat).at(load=400.0, pressure=5e5)
    assert at.degrees_of_freedom[1] == pytest.approx(7.0, rel=1e-6)
    parts = (at.cornering_stiffness_sd / at.cornering_stiffness) ** 2, (at.lateral_stiffness_sd / 55e3) ** 2
    together = sum(parts) ** 2 / (parts[0] ** 2 / at.degrees_of_freedom[0] + parts[1] ** 2 / 7.0)
    assert at.degrees_of_freedom[2] == pytest.approx(together, rel=1e-6)
    assert TyreMap(table()).at(load=400.0, pressure=5e5).degrees_of_freedom is None


def test_trail_is_linear_between_the_conditions_that_have_it():
    column = MeasuredColumn([0.018, 0.022, np.nan, 0.020], [1e-4, 2e-4, np.nan, 2e-4], [5.0, 5.0, np.nan, np.inf])
    tyre = TyreMap(table(pneumatic_trail=column))
    assert tyre.at(load=300.0, pressure=4e5).pneumatic_trail == pytest.approx(0.018)
    between = tyre.at(load=400.0, pressure=4e5)
    assert (between.pneumatic_trail, between.pneumatic_trail_sd) == pytest.approx((0.020, np.hypot(1e-4, 2e-4) / 2))
    assert tyre.at(load=300.0, pressure=6e5).pneumatic_trail == pytest.approx(0.016)  # the plane through three
    alone = MeasuredColumn([0.018, 0.022, np.nan, np.nan], [1e-4, 2e-4, np.nan, np.nan], np.full(4, np.inf))
    tyre = TyreMap(table(pneumatic_trail=alone))
    assert tyre.at(load=400.0, pressure=4e5).pneumatic_trail == pytest.approx(0.020)
    assert tyre.at(load=400.0, pressure=5e5).pneumatic_trail is None
    assert TyreMap(table()).at(load=400.0, pressure=5e5).pneumatic_trail is None


@pytest.mark.parametrize("unit", [1.0, 9.80665])
def test_a_trail_whose_load_and_pressure_grew_together_leans_on_both_by_their_relative_change(unit):
    """The smallest a, b with 0.25 a + 0.2 b = 2 mm (5 bar and 400 N in the middle), whatever unit the load has."""
    load, pressure = unit * np.array([300.0, 400.0, 500.0]), np.array([4e5, 5e5, 6e5])
    column = MeasuredColumn([0.018, 0.020, 0.022], [1e-4] * 3, [np.inf] * 3)
    three = MeasuredTable("T", "flat", load, pressure, C[:3], K[:3], 0.01 * K[:3])
    found, _ = predicted_column(three, column, unit * np.array([500.0, 400.0, 500.0]), np.array([5e5, 6e5, 6e5]))
    by_load, by_pressure = (0.002 * share**2 / (0.25**2 + 0.2**2) for share in (0.25, 0.2))
    expected = 0.020 + np.array([by_load, by_pressure, 0.002])
    np.testing.assert_allclose([one.value for one in found], expected, rtol=1e-9)


def test_wheels_share_what_one_table_shares_and_nothing_else():
    tyre = TyreMap(table())
    other = TyreMap(replace(table(), tyre="other"))
    at = [(300.0, 4e5), (500.0, 4e5)]
    same = wheel_properties([tyre, tyre], at)
    np.testing.assert_array_equal(same.covariance, tyre.joint(at)[1])
    apart = wheel_properties([tyre, other], at)
    assert not apart.covariance[:3, 3:].any()
    np.testing.assert_array_equal(apart.covariance[3:, 3:], other.joint(at[1:])[1])
    assert [p.tyre for p in apart.properties] == ["T", "other"]


def test_file_with_all_of_it(tmp_path):
    more = (
        ",stiffness_correlation,cornering_stiffness_dof,lateral_stiffness_dof,pneumatic_trail_mm,pneumatic_trail_sd_mm"
    )
    path = put(tmp_path, more, (",0.2,8,inf,17.5,0.3", ",0.25,8,6,,"), CALIBRATION)
    found = read_table(path)
    assert found.calibration == GAINS
    np.testing.assert_array_equal(found.stiffness_correlation, [0.2, 0.25])
    np.testing.assert_array_equal(found.lateral_stiffness_dof, [np.inf, 6])
    np.testing.assert_allclose(found.pneumatic_trail.value, [0.0175, np.nan])
    np.testing.assert_array_equal(found.pneumatic_trail.known, [True, False])
    write_table(found, tmp_path / "again.csv")
    again = read_table(tmp_path / "again.csv")
    np.testing.assert_allclose(again.pneumatic_trail.sd, found.pneumatic_trail.sd)
    assert again.calibration == found.calibration


@pytest.mark.parametrize(("more", "cells", "toml", "message"), [
    (",stiffness_correlation", (",1.2", ",0"), "", r"line 2: stiffness_correlation = 1.2 must be from -1 to 1"),
    (",cornering_stiffness_dof", (",0", ",1"), "", r"line 2: cornering_stiffness_dof = 0 must be > 0 \(inf"),
    (",cornering_stiffness_dof", (",4", ",4"), "", "degrees of freedom of one stiffness only; give those of both"),
    (",pneumatic_trail_mm", (",17", ",18"), "", "pneumatic_trail_mm and pneumatic_trail_sd_mm belong together"),
    (",pneumatic_trail_mm,pneumatic_trail_sd_mm", (",17,0.3", ",18,"), "",
     "pneumatic_trail_mm of condition 2 has a value without its standard deviation"),
    (",pneumatic_trail_mm,pneumatic_trail_sd_mm", (",17,0.3", ",inf,1"), "",
     "line 3: pneumatic_trail_mm = inf must be finite, or empty where it was not measured"),
    (",pneumatic_trail_mm,pneumatic_trail_sd_mm", (",17,-0.3", ",,"), "",
     "line 2: pneumatic_trail_sd_mm = -0.3 must be finite and >= 0"),
    (",pneumatic_tail_mm", (",17", ",18"), "", r"column 'pneumatic_tail_mm'; did you mean 'pneumatic_trail"),
    ("", ("", ""), "[calibration]\nforce = 0.003\n", r"calibration: give 'force', 'slip', 'displacement'"),
    ("", ("", ""), CALIBRATION.replace("slip", "slipp"), r"key of calibration: 'slipp'; did you mean 'slip'"),
    ("", ("", ""), CALIBRATION.replace("0.003", "0.9"), "calibration.displacement = 0.9 must be a relative"),
    ("", ("", ""), CALIBRATION.replace("0.003", "true"), "calibration.displacement = True must be a number"),
])  # fmt: skip
def test_bad_columns_and_keys(tmp_path, more, cells, toml, message):
    refuses(message, read_table, put(tmp_path, more, cells, toml))


def test_columns_of_both_stiffnesses_need_both(tmp_path):
    path = put(tmp_path, toml=CALIBRATION)
    head = HEAD.replace("lateral_stiffness_N_per_mm,lateral_stiffness_sd_N_per_mm", "relaxation_length_mm,x")
    path.write_text(head.replace(",x", "") + "\n300,4,90,1.8,100\n500,4,120,2.4,120\n")
    refuses("calibration is about both stiffnesses; give the column lateral_stiffness_N_", read_table, path)
    with pytest.raises(InputError, match="calibration is given, but no standard deviation of the cornering stiffness"):
        table(cornering_stiffness_sd=None)


@pytest.mark.parametrize(("changes", "message"), [
    (
        {"cornering_stiffness_sd": 0.005 * C},
        r"T on flat, 300 N at 4 bar: the standard deviation of the cornering stiffness is 0.5 %, less than the "
        r"0.721 % of the calibration that is common",
    ),
    ({"stiffness_correlation": np.full(4, -0.9)}, "a correlation of -0.9 between cornering and lateral stiffness"),
    (
        {"calibration": None, "lateral_stiffness_shared_over": ("load", "pressure"),
         "stiffness_correlation": np.array([0.9, 0.9, -0.9, -0.9])},
        r"cannot have these correlations with their cornering stiffnesses; leave stiffness_correlation out",
    ),
])  # fmt: skip
def test_contradictions_are_refused(changes, message):
    refuses(message, TyreMap, table(**changes))


def test_columns_of_a_table_must_fit():
    short = MeasuredColumn([0.02], [0.001], [3.0])
    refuses(r"pneumatic_trail has shape \(1,\); every column needs the shape of load", table, pneumatic_trail=short)
    refuses("condition 1 has -2 degrees of freedom; there must be more than 0", MeasuredColumn, [0.02], [0.001], [-2.0])
    refuses("value, sd and dof have shapes", MeasuredColumn, [0.02], [0.001, 0.001], [2.0])
    refuses("condition 1 is 0.02 with a standard deviation of -0.001", MeasuredColumn, [0.02], [-0.001], [2.0])
