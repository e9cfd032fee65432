"""Charts of bicycles: published critical speeds, exact boundaries, names, bands against draws, marks, the command."""

import json

import numpy as np
import pandas as pd
import pytest

from bicycle.model import build_model
from bicycle.stability import critical_speeds
from studies import chart as room
from studies.chart import Plane, Uncertain, stability_chart
from studies.cli import main
from tyre.ground import InputError
from tyre.maps import TyreMap

WHIPPLE = {"bicycle": "benchmark"}
SOFT = {
    "bicycle": "pista_charlie_drops",
    "effects": {
        "relaxation_length": {"tyre": "Tyre1", "pressure_bar": 5.5},
        "front_compliance": {"stiffness": 3000.0, "damping": 15.0, "joint_x": 0.85, "joint_z": -0.8},
    },
}


def softer(stiffness, content=SOFT, damping=15.0, **more):
    """The model file with another front."""
    front = content["effects"]["front_compliance"] | {"stiffness": stiffness, "damping": damping}
    return content | {"effects": content["effects"] | {"front_compliance": front}} | more


@pytest.fixture(scope="module")
def soft():
    return stability_chart(Plane.of(SOFT, "speed=2:25", "front_compliance.stiffness=1000:10000"))


def test_the_whipple_bicycle_crosses_where_published():
    # Meijaard et al. (2007): weave speed 4.29238253634111 m/s, capsize speed 6.02426201538837 m/s at c = 0.08 m
    table = stability_chart(Plane.of(WHIPPLE, "speed=1:10", "c=0.08:0.12")).frame()
    ends = table[table.c_m == 0.08].set_index("mode")
    assert ends.speed_m_s["weave"] == pytest.approx(4.29238253634111, rel=1e-11)
    assert ends.speed_m_s["capsize"] == pytest.approx(6.02426201538837, rel=1e-11)
    assert len(ends) == 2
    assert (table.unstable_roots_on_the_stable_side == 0).all()


def test_every_point_lies_on_the_axis(soft):
    """Eigenvalues by numpy of the model file with the point's numbers."""
    table = soft.frame()
    assert len(table) > 400
    assert (np.abs(table.residual_real_1_s) < 1e-9 * table.largest_root_1_s).all()
    for row in table.iloc[::25].itertuples():
        model = build_model(softer(row.front_compliance_stiffness_N_m_rad)).linear_model()
        roots = np.linalg.eigvals(model.state_matrix(row.speed_m_s))
        omega = 2 * np.pi * row.frequency_Hz
        assert np.abs(roots - 1j * omega).min() < 1e-9 * np.abs(roots).max()


def test_names_and_frequencies_are_those_of_the_critical_speeds(soft):
    table = soft.frame()
    for stiffness in (1500.0, 3000.0, 9500.0):
        known = [c for c in critical_speeds(build_model(softer(stiffness)), 25.0) if 2 < c.speed < 25]
        found = []
        for _, curve in table.groupby("boundary"):
            y, x, hertz = (
                curve[name].to_numpy() for name in ("front_compliance_stiffness_N_m_rad", "speed_m_s", "frequency_Hz")
            )
            for k in np.flatnonzero((y[1:] > stiffness) != (y[:-1] > stiffness)):
                t = (stiffness - y[k]) / (y[k + 1] - y[k])
                between = [float(a[k] + t * (a[k + 1] - a[k])) for a in (x, hertz)]
                found.append((between[0], curve["mode"].iloc[k], between[1]))
        assert len(found) == len(known)
        for (speed, mode, hertz), one in zip(sorted(found), known, strict=True):
            assert (speed, mode) == (pytest.approx(one.speed, abs=2e-3), one.mode)
            assert hertz == pytest.approx(one.frequency_hz, abs=2e-3)


def test_the_count_agrees_and_regions_are_what_the_roots_are(soft):
    assert not soft.check.wrong.any()
    assert soft.check.sides == 0
    assert soft.check.compared > 50
    share = np.linspace(0.05, 0.95, 7)
    regions = soft.regions(np.r_[0, share], np.r_[0, share])[1:, 1:]
    far = 0
    for i, j in np.ndindex(7, 7):
        point = np.array([share[i], share[j]])
        if min(curve.distance(point)[0] for curve in soft.curves) > 0.02:
            roots = build_model(softer(1000 + 9000 * share[j])).linear_model().eigenvalues(2 + 23 * share[i])
            assert regions[i, j] == (roots.real > 0).sum()
            far += 1
    assert far > 20


def test_the_band_is_what_draws_give():
    """Critical speeds of drawn bicycles, with one damping and one inertia uncertain."""
    content = softer(9500.0, bicycle=dict(build_model(SOFT).bicycle.values))
    content["effects"]["relaxation_length"] = {"cornering_stiffness": 6500.0, "relaxation_length": 0.11}
    plane = Plane.of(content, "speed=2:25", "front_compliance.stiffness=3000:8000")
    chart = stability_chart(plane, sd={"front_compliance.damping": 0.4, "IHzz": 0.0008})
    wave = next(b for b in chart.boundaries if "wobble" in b.distinct)
    points = plane.x(wave.curve.shares)
    k = int(np.abs(points[:, 1] - 5000.0).argmin())
    rng, found = np.random.default_rng(5), []
    for z in rng.normal(size=(150, 2)):
        bicycle = content["bicycle"] | {"IHzz": content["bicycle"]["IHzz"] + 0.0008 * z[1]}
        model = build_model(softer(points[k, 1], content, 15.0 + 0.4 * z[0], bicycle=bicycle))
        speeds = [c.speed for c in critical_speeds(model, 30.0) if c.mode == "wobble"]
        found.append(min(speeds, key=lambda v: abs(v - points[k, 0])))
    told = wave.spread[k, 0] * plane.spans[0].slope(wave.curve.shares[k, 0])
    assert told == pytest.approx(np.std(found), rel=0.2)  # 150 draws: 6 %, and what is not linear
    across = room.along_axes(wave.curve, wave.growth_sd)
    np.testing.assert_allclose(across[:, 2] ** -2, across[:, 0] ** -2 + across[:, 1] ** -2, rtol=1e-9)


def test_what_is_uncertain_leaves_the_axes_out():
    plane = Plane.of(SOFT, "speed=2:25", "c")
    stated = Uncertain.of(plane)
    assert "c" not in stated.names
    assert "relaxation_length.relaxation_length.front" in stated.names
    assert not Uncertain.of(Plane.of(WHIPPLE, "speed=1:10", "c"))
    curve = stability_chart(Plane.of(WHIPPLE, "speed=1:10", "c"), sd={"w": 0.01}).boundaries[0].curve
    one, two = (
        room.spread(
            Plane.of(WHIPPLE, "speed=1:10", "c"), curve, Uncertain(("w",), np.array([[sd**2]]), np.array([1.02]))
        )
        for sd in (0.01, 0.02)
    )
    np.testing.assert_allclose(two, 2 * one, rtol=1e-9)


def test_marks_of_tyres_stand_where_the_tyre_is():
    keys = [f"relaxation_length.{name}.front" for name in ("cornering_stiffness", "relaxation_length")]
    found = [
        m
        for m in room.marks(Plane.of(SOFT, f"{keys[0]}=3000:9000", f"{keys[1]}=0.05:0.3", speed=9.0))
        if m.kind.startswith("measured tyre")
    ]
    assert {m.label.split(" ")[0] for m in found} >= {"Tyre1", "Tyre2", "Tyre3"}
    load = build_model(SOFT).bicycle.static_loads[1]
    own = TyreMap.load("Tyre2").at(load=load, pressure=5.5e5)
    mark = next(m for m in found if m.label.startswith("Tyre2 5.5 bar"))
    assert (mark.x, mark.y) == (pytest.approx(own.cornering_stiffness), pytest.approx(own.relaxation_length))


def test_stable_or_unstable_everywhere(no_pictures, tmp_path):
    calm = stability_chart(Plane.of(WHIPPLE, "speed=4.9:5.1", "c=0.079:0.081"))
    assert calm.boundaries == ()
    assert room.describe_check(calm)[0] == "no boundary here: stable everywhere"
    room.draw_chart(calm, tmp_path / "calm", title="t")
    wild = stability_chart(Plane.of(WHIPPLE, "speed=1:2", "c=0.079:0.081"))
    assert room.describe_check(wild)[0] == "no boundary here: 2 unstable roots everywhere"
    assert list(wild.frame().columns)[:2] == ["speed_m_s", "c_m"]


def test_a_figure_with_an_extrapolated_tyre_on_a_logarithmic_axis(tmp_path):
    hatched = stability_chart(Plane.of(SOFT, "pressure_bar.front=2:9", "c=0.05:0.06:log", speed=9))
    room.draw_chart(hatched, tmp_path / "hatched", title="t")
    for ending in ("png", "svg"):
        assert (tmp_path / f"hatched.{ending}").stat().st_size > 10_000


def test_usual_ranges():
    space = Plane.of(SOFT, "pressure_bar.front", "load_N.front", speed=9.0).space
    assert room.usual_range(space, space.axes[0]) == (3.5, 7.5)
    assert room.usual_range(space, space.axes[1]) == (340.0, 490.0)
    assert room.split_range("c") == ("c", None, False)
    assert room.split_range("c=0.1:1:log") == ("c", (0.1, 1.0), True)


@pytest.mark.parametrize(("x", "y", "speed", "message"), [
    ("speed=1:10", "speed=2:3", None, "both axes are speed; give two different ones"),
    ("speed=1:10", "c", 5.0, "--speed 5 is given, but the speed is an axis; leave --speed out"),
    ("w", "c", None, "no axis is the speed: give the --speed (m/s) of the chart, or --x speed"),
    ("speed=1-10", "c", None, "axis 'speed=1-10': give NAME, NAME=LOW:HIGH or NAME=LOW:HIGH:log"),
    ("speed=10:1", "c", None, "the range must be finite, LOW below HIGH"),
    ("speed=-1:10", "c", None, "speed -1 m/s is not allowed; give speeds >= 0 m/s"),
    ("speed=0:0.0001", "c", None, "nothing moves below"),
    ("c=-0.1:0.1:log", "w", 5.0, "equal ratios need a range above 0"),
    ("=1:2", "w", 5.0, "axis '=1:2': give NAME"),
    ("speed", "w=-1:2", None, "w = -1 m is not possible; give values from 0 to inf"),
    ("speed", "xB=-3:0.5", None, "the front wheel bears no load"),
    ("speed=1:5000", "c", None, "5000 m/s is not allowed"),
    ("w", "c", -3.0, "speed -3 m/s is not allowed"),
])  # fmt: skip
def test_what_is_no_chart(x, y, speed, message):
    with pytest.raises(InputError) as error:
        Plane.of(WHIPPLE, x, y, speed=speed)
    assert message in str(error.value)


def test_the_command(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    main(["chart", "benchmark", "--x", "speed=0:10", "--y", "c=-0.05:0.15", "--out", "o", "--sd", "w=0.01",
          "--json", "o.json"])  # fmt: skip
    shown = capsys.readouterr().out
    assert "at 0 of" not in shown
    assert "band: 95 % coverage, first order, of 1 uncertain parameter;" in shown
    assert "from 0.0032 m/s: slower is rest" in shown  # sqrt(9.81 x 1.02) / 1000
    table = pd.read_csv("o/stability_chart.csv")
    assert {"sd_speed_m_s", "sd_c_m", "mode", "frequency_Hz", "closed"} <= set(table.columns)
    told = json.loads((tmp_path / "o.json").read_text())
    assert [len(b["points"]) for b in told["boundaries"]] == table.groupby("boundary").size().tolist()
    assert told["check"]["not_explained"] == 0
    for name in ("stability_chart.png", "stability_chart.svg"):
        assert (tmp_path / "o" / name).stat().st_size > 10_000


def test_a_band_wider_than_the_chart_is_not_drawn_and_said():
    chart = stability_chart(Plane.of(WHIPPLE, "speed=4:7", "c=0.07:0.09"), sd={"w": 0.5, "lam": 0.3})
    assert not any(one.band_is_narrow for one in chart.boundaries)
    assert sum("its band is not drawn; it is wider than most of the chart" in text for text in chart.doubts) == 2
    narrow = stability_chart(Plane.of(WHIPPLE, "speed=4:7", "c=0.07:0.09"), sd={"w": 0.005})
    assert all(one.band_is_narrow for one in narrow.boundaries)
    assert narrow.doubts == []
