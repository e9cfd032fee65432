"""Root loci: every root in one continuous named branch, crossings at published values, refused input."""

import json

import numpy as np
import pandas as pd
import pytest
import wobble_onsets
from eigenvalue_sets import assert_same_eigenvalues
from matplotlib.figure import Figure

from bicycle import Model, effect_class, load_bicycle
from bicycle.model import ModelFamily, read_model
from bicycle.stability import critical_speeds
from studies.cli import main
from studies.motion import parameter_path, parse_range, root_locus
from tyre import TyreMap
from tyre.ground import InputError

RIGID = """bicycle = "benchmark"
[effects.relaxation_length]
cornering_stiffness = 6302.535746439056  # 110 N/deg
relaxation_length = {rear = 0.141, front = 0.141}
"""
SOFT = (
    RIGID
    + "[effects.front_compliance]\njoint_x = 0.8\njoint_z = -0.85\ndamping = 15.0  # N m s/rad: a band of wobble\n"
)
MEASURED = """bicycle = "pista_charlie_drops"
[effects.relaxation_length]
tyre = "Tyre1"
pressure_bar = {rear = 7.5, front = 5.5}
[effects.front_compliance]
joint_x = 0.8
joint_z = -0.85
"""


@pytest.fixture
def file(tmp_path):
    def write(text):
        (tmp_path / "m.toml").write_text(text)
        return tmp_path / "m.toml"

    return write


def crossings(locus, mode):
    return [(c.value, c.destabilising) for c in locus.crossings if c.mode == mode]


def test_speed_locus_of_the_whipple_bicycle_crosses_where_published(file):
    # Meijaard et al. (2007): weave speed 4.29238253634111 m/s, capsize speed 6.02426201538837 m/s
    locus = root_locus(parameter_path(file('bicycle = "benchmark"'), "speed", speed=None), parse_range("0:10:0.25"))
    assert crossings(locus, "weave") == [(pytest.approx(4.29238253634111, rel=1e-11), False)]
    assert crossings(locus, "capsize") == [(pytest.approx(6.02426201538837, rel=1e-11), True)]
    assert len(locus.crossings) == 2


@pytest.mark.parametrize(("length", "speed"), wobble_onsets.RIGID)
def test_relaxation_length_that_makes_wobble_unstable(file, length, speed):
    path = parameter_path(file(RIGID), "relaxation_length.relaxation_length", speed=speed)
    locus = root_locus(path, parse_range("0.06:0.25"))
    assert crossings(locus, "wobble") == [(pytest.approx(length, abs=2e-6), True)]  # 0.1 mm/s


@pytest.mark.parametrize(("key", "span"), [
    ("IFyy", "0.05:0.5"), ("lam", "0.1:0.6"), ("relaxation_length.cornering_stiffness.front", "2000:12000"),
    ("front_compliance.stiffness", "300:10000"), ("front_compliance.damping", "0:40"), ("speed", "0.5:25"),
])  # fmt: skip
def test_every_root_is_in_one_continuous_branch(file, key, span):
    path = parameter_path(file(SOFT), key, speed=None if key == "speed" else 7.0)
    locus = root_locus(path, parse_range(span))
    model = read_model(file(SOFT))
    for k in (0, len(locus.values) // 3, -1):
        value = float(locus.values[k])
        expected = (
            model.linear_model().eigenvalues(value) if key == "speed"
            else ModelFamily(model, (key,)).with_values({key: value}).linear_model().eigenvalues(7.0)
        )  # fmt: skip
        assert_same_eigenvalues(locus.eigenvalues[k], expected, atol=1e-9 * np.abs(expected).max())
    step = np.abs(np.diff(locus.eigenvalues, axis=0)).max(axis=1)
    fine = np.abs(locus.eigenvalues).max()
    assert step.max() < 0.05 * fine
    for name in ("weave", "wobble"):
        assert locus.names.count(name) == 2


def test_a_parameter_that_does_not_matter_leaves_the_roots_alone(file):
    text = RIGID + "[effects.steer_damper]\ndamping = 0.0\n[effects.steer_assist]\ngain = 3.0\nfade_speed = 6.0\n"
    path = parameter_path(file(text), "steer_assist.lean_gain", speed=5.0)  # acts above the fade speed only
    locus = root_locus(path, parse_range("0:3:0.5"))
    assert np.ptp(locus.eigenvalues, axis=0).max() < 1e-9
    faded = root_locus(parameter_path(file(text), "steer_assist.fade_speed", speed=5.0), np.array([3.0, 4.0, 4.5]))
    plain = read_model(file(RIGID)).linear_model().eigenvalues(5.0)
    assert_same_eigenvalues(faded.eigenvalues[0], plain, rtol=1e-5, atol=1e-9)


@pytest.mark.parametrize("tyre", ["Tyre1", "own.csv"])
def test_pressure_of_a_measured_tyre(file, tmp_path, tyre):
    TyreMap.load("Tyre1").to_file(tmp_path / "own.csv")
    model = MEASURED.replace("Tyre1", tyre)
    path = parameter_path(file(model), "pressure_bar.front", speed=6.0)
    assert path.space.base[0] == 5.5
    locus = root_locus(path, parse_range("3:9:0.5"))
    text = model.replace("front = 5.5", "front = 7.0")
    expected = read_model(file(text)).linear_model().eigenvalues(6.0)
    found = locus.eigenvalues[np.searchsorted(locus.values, 7.0)]
    assert_same_eigenvalues(found, expected, atol=1e-9 * np.abs(expected).max())
    measured = (locus.values >= 3.5) & (locus.values <= 7.5)
    assert not locus.measured[~measured].any()
    rear, _ = read_model(file(model)).bicycle.static_loads
    heavier = parameter_path(file(model), "load_N", speed=6.0)
    assert np.isnan(heavier.space.base[0])
    one = parameter_path(file(model), "load_N.rear", speed=6.0)
    assert one.space.base[0] == pytest.approx(rear)
    same = np.linalg.eigvals(one.matrices(np.array([rear]))[0])
    here = read_model(file(model)).linear_model().eigenvalues(6.0)
    assert_same_eigenvalues(same, here, atol=1e-9 * np.abs(here).max())


@pytest.mark.parametrize(("key", "span", "mode"), [
    ("relaxation_length.relaxation_length.rear", "0.03:0.25", "rear_tyre"),  # real part from -115 to -13 1/s
    ("front_compliance.damping", "5:40", "front_compliance"),  # at 193 rad/s, five times as fast as wobble
    ("front_compliance.stiffness", "500:9000", "wobble"),
])  # fmt: skip
def test_the_mode_that_a_parameter_moves_is_in_view(file, tmp_path, monkeypatch, key, span, mode):
    labels = []
    monkeypatch.setattr(Figure, "legend", lambda _, handles, texts, **__: labels.extend(texts))
    main(["root-locus", str(file(SOFT)), "--parameter", key, "--range", span, "--speed", "7",
          "--out", str(tmp_path / "out")])  # fmt: skip
    assert {mode.replace("_", " "), "weave", "wobble", "capsize"} <= set(labels)  # none "(out of view)"


def test_tied_defaults_follow_the_bicycle(file):
    # the axis of front_compliance is perpendicular to the steer axis, whatever its tilt
    path = parameter_path(file(SOFT), "lam", speed=5.0)
    effects = (
        effect_class("relaxation_length")(cornering_stiffness=6302.535746439056, relaxation_length=0.141),
        effect_class("front_compliance")(joint_x=0.8, joint_z=-0.85, damping=15.0, axis_tilt=0.4),
    )
    expected = Model(load_bicycle("benchmark").replace(lam=0.4), effects).linear_model().eigenvalues(5.0)
    found = np.linalg.eigvals(path.matrices(np.array([0.4]))[0])
    assert_same_eigenvalues(found, expected, atol=1e-9 * np.abs(expected).max())


def test_command_writes_figure_table_and_crossings(file, tmp_path, capsys):
    out = tmp_path / "out"
    main(["root-locus", str(file(SOFT)), "--parameter", "front_compliance.stiffness", "--range", "500:9000:500",
          "--speed", "7", "--out", str(out), "--json", str(tmp_path / "c.json")])  # fmt: skip
    assert {path.name for path in out.iterdir()} == {
        "root_locus.csv", "root_locus.png", "root_locus.svg", "root_locus.manifest.json"
    }  # fmt: skip
    table = pd.read_csv(out / "root_locus.csv")
    assert sorted(set(table["front_compliance.stiffness_N_m_rad"])) == list(range(500, 9001, 500))
    assert {"mode", "real_1_s", "imaginary_rad_s", "frequency_Hz", "damping_ratio"} < set(table.columns)
    record = json.loads((tmp_path / "c.json").read_text())
    assert (record["unit"], record["speed_m_s"]) == ("N m/rad", 7.0)
    assert [c["mode"] for c in record["crossings"]] == ["wobble"] * len(record["crossings"])
    for crossing in record["crossings"]:
        assert crossing["frequency_rad_s"] == pytest.approx(2 * np.pi * crossing["frequency_Hz"])
        assert 4 < crossing["frequency_Hz"] < 10  # wobble of a soft front; in rad/s it would be above 25
    assert "with increasing value" in capsys.readouterr().out


def test_crossings_along_speed_have_the_names_of_the_critical_speeds(file):
    where = file(MEASURED)
    locus = root_locus(parameter_path(where, "speed", speed=None), parse_range("0.5:30:0.5"))
    critical = critical_speeds(read_model(where).linear_model(), max_speed=30)
    assert [c.mode for c in locus.crossings] == [c.mode for c in critical]
    assert [c.value for c in locus.crossings] == pytest.approx([c.speed for c in critical], rel=1e-8)


@pytest.mark.parametrize(("text", "key", "span", "speed", "words"), [
    (MEASURED, "pressure_bar", "4:700", 7.0, "pressure_bar = 700 bar is not possible; give"),
    (SOFT, "front_compliance.stifness", "1:2", 7.0, "unknown parameter 'front_compliance.stifness'; did you mean"),
    (SOFT, "steer_damper.damping", "0:2", 7.0, "unknown parameter 'steer_damper.damping'"),
    (SOFT, "front_compliance.stiffness", "-5:2", 7.0, "stiffness = -5 N m/rad is outside 0 .. inf"),
    (SOFT, "w", "-1:2", 7.0, "w = -1 m must be positive"),
    (SOFT, "IFyy", "0:1", None, "parameter 'IFyy': give the --speed"),
    (SOFT, "IFy", "0:1", None, "unknown parameter 'IFy'; did you mean 'IFyy'?"),
    (SOFT, "IFyy", "0:1", -2.0, "speed -2 m/s is not allowed"),
    (SOFT, "speed", "-1:1", None, "speed -1 m/s is not allowed"),
    (SOFT, "pressure_bar", "3:9", 7.0, "pressure_bar needs a measured tyre in the model file"),
    (MEASURED, "pressure_bar.left", "3:9", 7.0, "parameter 'pressure_bar.left': unknown wheel 'left'"),
    (MEASURED, "load_N", "-3:9", 7.0, "load_N = -3 N is not possible; give"),
    (SOFT, "IFyy", "1", 7.0, "range '1': give start:stop or start:stop:step"),
    (SOFT, "IFyy", "a:b", 7.0, "range 'a:b': give start:stop or start:stop:step"),
    (SOFT, "IFyy", "1:0", 7.0, "range '1:0': give start:stop or start:stop:step with start < stop"),
    (SOFT, "IFyy", "0:1:0", 7.0, "range '0:1:0': give start:stop"),
    (
        'allow_unusual = true\nbicycle = "benchmark"\n[effects.steer_damper]\ndamping = 1e300\n', "c", "0.05:0.1",
        5.0, "the model is too stiff to be computed",
    ),
    (SOFT, "IFyy", "0:1:1e-7", 7.0, "10000000 values are more than 100000; take a larger step"),
])  # fmt: skip
def test_refused_loci(file, text, key, span, speed, words):
    with pytest.raises(InputError) as error:
        root_locus(parameter_path(file(text), key, speed=speed), parse_range(span))
    assert words in str(error.value)


def test_mass_matrix_within_the_range_is_checked(file):
    path = parameter_path(file(SOFT), "IHxz", speed=5.0)
    with pytest.raises(InputError, match="IHxz = 30: the mass matrix is not positive definite; take another range"):
        path.matrices(np.array([0.0, 30.0]))


def test_speed_as_parameter_and_as_option_is_refused(tmp_path, refused):
    said = refused("root-locus", "pista", "--parameter", "speed", "--range", "1:9", "--speed", 5, "--out", tmp_path)
    assert "--speed 5 is given, but the speed is the parameter; leave --speed out" in said


@pytest.mark.parametrize(("low", "high", "mode"), [("4.5", "6", "no mode"), ("6.5", "9", "capsize")])
def test_without_a_crossing_it_is_said_what_is_unstable(no_pictures, tmp_path, capsys, low, high, mode):
    """Meijaard et al. (2007): all stable from 4.29 to 6.02 m/s, capsize alone unstable above."""
    main(["root-locus", "benchmark", "--parameter", "speed", "--range", f"{low}:{high}",
          "--out", str(tmp_path / "out"), "--json", str(tmp_path / "c.json")])  # fmt: skip
    said = [f"no mode becomes stable or unstable from {low} to {high} m/s", f"unstable over the full range: {mode}"]
    assert capsys.readouterr().out.splitlines() == said
    record = json.loads((tmp_path / "c.json").read_text())
    assert (record["crossings"], record["unstable_throughout"]) == ([], [mode] if mode == "capsize" else [])
