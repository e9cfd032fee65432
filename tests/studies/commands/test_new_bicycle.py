"""A bicycle of one's own from eight numbers: the file, what it says, and what the other commands make of it."""

import re
import tomllib

import numpy as np
import pytest

from bicycle import load_bicycle, read_model
from studies.bicycles import own_bicycle
from studies.cli import main
from studies.main_study import settings_of

EIGHT = ["--wheelbase", "1.02", "--trail", "0.06", "--head-angle", "72.5", "--wheel", "28-622", "--mass", "9"]
LIMITS = own_bicycle.LIMITS
RIDER = ["--rider-height", "1.80", "--rider-mass", "75", "--posture", "hoods"]


def test_a_bicycle_with_rider_is_written_and_used(tmp_path, capsys, monkeypatch, printed):
    pytest.importorskip("yeadon")
    monkeypatch.chdir(tmp_path)
    told, text = printed("new", "mine.toml", *EIGHT, *RIDER), (tmp_path / "mine.toml").read_text()
    weave, low, high = map(
        float, re.search(r"weave becomes stable at ([\d.]+) m/s \(([\d.]+) to ([\d.]+)\)", told).groups()
    )
    assert low < weave < high
    assert re.search(r"wobble below 20 m/s: probability \d+ %; onset then at \d+ to \d+ m/s", told)
    sds = [[float(x) for x in re.findall(r"[\d.]+", line)] for line in told.splitlines() if "--front-wheel-m" in line]
    assert all(after < before for one in sds for before, after in zip(one[:2], one[2:4], strict=True))
    assert sds[-1][2] < 0.5 * sds[-1][0]  # scale and pendulum
    found, content = load_bicycle("mine.toml"), tomllib.loads(text)
    assert found.warnings == ()
    assert "No measured bicycle has" not in told
    assert sum(found[key] for key in ("mR", "mB", "mH", "mF")) == pytest.approx(84.0, abs=1e-3)
    assert (found["w"], found["c"], found["lam"]) == pytest.approx((1.02, 0.06, np.radians(17.5)), rel=1e-5)
    assert set(found.covariance.names) | set(content["sd"]) | {"g"} == set(content["values"])
    assert text.count("ASSUMED\n") == len(found.covariance.names)
    (line,) = [line for line in printed("critical", "mine.toml").splitlines() if " weave " in line]
    assert float(line.split()[0]) == pytest.approx(weave, abs=0.05)
    main(["uncertainty", "mine.toml", "--tyre", "Tyre1", "--pressure", "5.5", "--samples", "100"])
    assert "18 correlated parameters (mR, …)" in capsys.readouterr().out


def test_the_model_of_a_bicycle_is_written_and_its_wobble_depends_on_an_assumed_front_frame(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    main(
        [
            "new",
            "mine.toml",
            *EIGHT,
            "--rider-mass",
            "75",
            "--rider-place",
            "0.42,1.06",
            "--rider-inertia",
            "7.5,8,2.7,0.9",
        ]
    )
    shown = capsys.readouterr().out.splitlines()
    assert shown[-1] == "mine.toml and mine_model.toml: next: velotyre critical mine_model.toml"
    text = (tmp_path / "mine_model.toml").read_text()
    content = tomllib.loads(text)
    assert content["bicycle"] == "mine.toml"
    assert content["effects"]["relaxation_length"]["tyre"] == LIMITS.tyre
    low, high = LIMITS.stiffness
    assert f"# stiffness = 5000  # N m/rad; ASSUMED, range {low:g} to {high:g}" in text
    assert "velotyre run takes 0.15 to 0.4 of critical" in text
    model, bicycle = read_model("mine_model.toml"), load_bicycle("mine.toml")
    assert model.bicycle == bicycle
    assert model.parameters["front_compliance.stiffness"] == 5000.0  # that of the main study
    stated = tmp_path / "stated.toml"  # the numbers behind a # are those that every command takes without them
    stated.write_text(text.replace("# stiffness =", "stiffness =").replace("# damping =", "damping ="))
    assert read_model(str(stated)).parameters == model.parameters
    x, z = (model.parameters[f"front_compliance.joint_{axis}"] for axis in "xz")
    assert x == pytest.approx(bicycle["w"] + bicycle["c"] + z * np.tan(bicycle["lam"]), abs=1e-4)  # on the steer axis
    main(["critical", "mine_model.toml"])
    shown = capsys.readouterr()
    assert " wobble " in shown.out
    assert "front frame is rigid" not in shown.err
    # the study takes what is left out for assumed, over its full range
    settings = settings_of("mine_model.toml")
    assert settings.front.defaults == ("stiffness", "damping_ratio")
    assert settings.ranges.stiffness == LIMITS.stiffness


def test_a_model_beside_it_is_never_overwritten_by_chance(tmp_path, refused):
    (tmp_path / "mine_model.toml").write_text("another")
    told = refused("new", tmp_path / "mine.toml", *EIGHT)
    assert "mine_model.toml exists, where the model of" in told
    assert (tmp_path / "mine_model.toml").read_text() == "another"
    assert not (tmp_path / "mine.toml").exists()
    main(["new", str(tmp_path / "mine.toml"), *EIGHT, "--force"])
    assert read_model(tmp_path / "mine_model.toml").bicycle == load_bicycle(tmp_path / "mine.toml")


def test_a_model_begins_with_a_bicycle_of_a_file(tmp_path, monkeypatch, printed, refused):
    monkeypatch.chdir(tmp_path)
    main(["new", "mine.toml", *EIGHT])
    (tmp_path / "models").mkdir()
    for target in ("model.toml", "models/model.toml"):
        assert f"velotyre modes {target}" in printed("new", target, "--bicycle", "mine.toml")
        assert read_model(target).bicycle == load_bicycle("mine.toml")
        assert 'bicycle = "../mine.toml"' in (tmp_path / target).read_text() or "/" not in target
    assert "no such bicycle file" in refused("new", "other.toml", "--bicycle", "yours.toml")
    assert "is a model file, not a bicycle file" in refused("new", "other.toml", "--bicycle", "mine_model.toml")
    assert not (tmp_path / "other.toml").exists()


@pytest.mark.parametrize("call", [
    "critical benchmark", "critical benchmark --tyre Tyre1 --pressure 5.5 --json -",
    "sensitivity benchmark --mode weave --speed 5",
    "design benchmark --keep weave stable --from 5 --up-to 6 --vary c --out better.toml",
])  # fmt: skip
def test_wobble_on_a_rigid_front_frame_is_said_not_to_be_judged(call, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    main(call.split())
    told = [line for line in capsys.readouterr().err.splitlines() if "front frame" in line]
    assert told == [
        "note: the front frame is rigid; wobble needs front-frame compliance to be judged ([effects.front_compliance])"
    ]


def test_what_is_weighed_is_taken_and_not_asked_for_again(tmp_path, capsys):
    weighed = ["--front-wheel-mass", "1.5", "--fork-mass", "2.5", "--front-wheel-inertia", "0.09"]
    main(["new", str(tmp_path / "mine.toml"), *EIGHT, *weighed])
    found = load_bicycle(tmp_path / "mine.toml")
    assert (found["mF"], found["mH"], found["IFyy"]) == pytest.approx((1.5, 2.5, 0.09), rel=0.01)
    assert "Measurements that reduce" not in capsys.readouterr().out


def test_no_front_is_assumed_for_a_cargo_bicycle(tmp_path, printed):
    """As in the main study: the front of a racing frame says nothing of a Long John."""
    told = printed("new", str(tmp_path / "long.toml"), *EIGHT, "--wheelbase", "1.95")
    assert "weave becomes stable at" in told
    assert "wobble: not judged" in told
    assert "probability" not in told
    text = (tmp_path / "long_model.toml").read_text()
    assert "relaxation_length" in tomllib.loads(text)["effects"]
    assert "front_compliance" not in tomllib.loads(text)["effects"]
    assert "wobble cannot be judged" in text
    assert "No measured bicycle has w = 1.95 (0.989 to 1.12): the uncertainty is larger" in told


def test_luggage_is_joined_by_the_theorem_of_steiner(tmp_path):
    main(["new", str(tmp_path / "mine.toml"), *EIGHT])
    text = (tmp_path / "mine.toml").read_text()
    plain = load_bicycle(tmp_path / "mine.toml")
    body, rest = text.partition("# [[bodies]]")[2].splitlines()[1:], text.partition("# [[bodies]]")[0]
    lines = [line.removeprefix("# ") for line in body]
    (tmp_path / "loaded.toml").write_text(rest + "[[bodies]]\n" + "\n".join(lines) + "\n")
    found = load_bicycle(tmp_path / "loaded.toml")
    m, x, z, width, height = 8.0, -0.1, -0.8, 0.3, 0.3
    whole = plain["mB"] + m
    both = plain["mB"] * m / whole
    assert found["xB"] == pytest.approx((plain["mB"] * plain["xB"] + m * x) / whole)
    own = m * (width**2 + height**2) / 12
    assert found["IBxx"] == pytest.approx(plain["IBxx"] + own + both * (plain["zB"] - z) ** 2)
    assert found["IBxz"] == pytest.approx(plain["IBxz"] - both * (plain["xB"] - x) * (plain["zB"] - z))
    assert found.sd["xB"] == pytest.approx(
        np.hypot(plain["mB"] / whole * plain.sd["xB"], plain.sd["mB"] * (plain["xB"] - found["xB"]) / whole), rel=0.3
    )
    assert found["mH"] == plain["mH"]
    front = rest + "[[bodies]]\nmass = 3.0\nplace = [1.0, 0.9]\non = 'front'\n"
    (tmp_path / "bag.toml").write_text(front)
    assert load_bicycle(tmp_path / "bag.toml")["mH"] == pytest.approx(plain["mH"] + 3.0)
    (tmp_path / "bag.toml").write_text(front.replace("mass = 3.0", "mass = -3.0"))
    with pytest.raises(ValueError, match=r"\[\[bodies\]\] number 1: mass = -3 must be a mass in kg"):
        load_bicycle(tmp_path / "bag.toml")


@pytest.mark.parametrize(("options", "words"), [
    (EIGHT[2:], "your own bicycle needs --wheelbase"),
    ([*EIGHT, "--trail", "60"], "--trail: c = 60 m is far outside the usual -0.05 .. 0.2 m (millimetres?)"),
    ([*EIGHT, "--head-angle", "17.5"], "--head-angle 17.5: give degrees from the horizontal, 56 to 90"),
    ([*EIGHT, "--wheel", "28 inch"], "--wheel '28 inch': this may be several rims: 622 mm (28 x a decimal"),
    ([*EIGHT, "--mass", "90"], "--mass 90 is the bicycle's without rider, 4 to 60 kg"),
    ([*EIGHT, "--rider-height", "1.8"], "--rider-height and --rider-mass need each other"),
    ([*EIGHT, "--front-wheel-mass", "1500"], "--front-wheel-mass 1500 kg is outside 2 to 50 % of the bicycle"),
    ([*EIGHT, "--front-wheel-inertia", "0.1"], "--front-wheel-inertia needs --front-wheel-mass"),
    ([*EIGHT, "--front-wheel-mass", "1.5", "--front-wheel-inertia", "0.9"], "is 5.3 of m r^2; a wheel has 0.3 to"),
    ([*EIGHT, "--kind", "sensors"], "--kind is not used for your own bicycle; leave it out"),
    ([*EIGHT, "--tyre", "Tyre2"], "--tyre is not used for your own bicycle; leave it out, and change the tyre in "),
    (["--posture", "drops"], "your own bicycle needs --wheelbase, --head-angle, --wheel, --mass, --trail or"),
])  # fmt: skip
def test_what_makes_no_bicycle_is_refused(tmp_path, options, words, refused):
    assert words in refused("new", tmp_path / "mine.toml", *options)
    assert not (tmp_path / "mine.toml").exists()


@pytest.mark.parametrize("wheel", ["28-622", "622x28", "700x28C", "28 x 1.10 (28-622)"])
def test_a_wheel_is_read_as_it_stands_on_the_tyre(tmp_path, wheel):
    """622 / 2 + 0.93 * 28 mm."""
    main(["new", str(tmp_path / "mine.toml"), *EIGHT, "--wheel", wheel])
    found = load_bicycle(tmp_path / "mine.toml")
    assert (found["rR"], found["rF"]) == pytest.approx((0.33704, 0.33704), abs=1e-9)
    assert "wheels 28-622" in found.description


def test_what_is_typed_with_units_is_the_same_bicycle(tmp_path):
    main(["new", str(tmp_path / "si.toml"), *EIGHT])
    typed = ["--wheelbase", "102cm", "--trail", "60 mm", "--head-angle", "1.2653637076958888rad", "--mass", "9000g"]
    main(["new", str(tmp_path / "typed.toml"), *EIGHT, *typed])
    si, other = (load_bicycle(tmp_path / f"{name}.toml") for name in ("si", "typed"))
    assert dict(other.values) == pytest.approx(dict(si.values), rel=1e-12)


def test_the_offset_of_the_fork_stands_for_the_trail(tmp_path, refused):
    """c = (rF sin lam - offset) / cos lam; the trail then hangs together with head angle and radius."""
    without_trail = [*EIGHT[:2], *EIGHT[4:]]
    main(["new", str(tmp_path / "mine.toml"), *without_trail, "--fork-offset", "45mm"])
    found = load_bicycle(tmp_path / "mine.toml")
    lam = np.radians(17.5)
    assert found["c"] == pytest.approx((0.33704 * np.sin(lam) - 0.045) / np.cos(lam), rel=1e-5)
    assert "fork_offset = 0.045" in (tmp_path / "mine.toml").read_text()
    assert found.covariance.among(["c", "lam"])[0, 1] > 0
    assert "give one of --trail and --fork-offset" in refused("new", tmp_path / "b.toml", *EIGHT, "--fork-offset", "1")
    told = refused("new", tmp_path / "b.toml", *without_trail, "--fork-offset", "45")
    assert "--fork-offset 45: c = " in told


def test_a_rider_by_mass_and_place_needs_no_body_model(tmp_path, refused):
    """The same by the file's own numbers and by the bodies of a file."""
    rider = ["--rider-mass", "75kg", "--rider-place", "42cm,106 cm", "--rider-inertia", "7.5,8,2.7,0.9"]
    main(["new", str(tmp_path / "frame.toml"), *EIGHT])
    main(["new", str(tmp_path / "ridden.toml"), *EIGHT, *rider])
    placed = ["--mass", "75", "--place", "0.42,1.06", "--inertia", "7.5,8,2.7,0.9"]
    main(["rider", str(tmp_path / "frame.toml"), *placed, "--out", str(tmp_path / "placed.toml")])
    ridden, other = (load_bicycle(tmp_path / f"{name}.toml") for name in ("ridden", "placed"))
    assert dict(other.values) == pytest.approx(dict(ridden.values), rel=1e-4)
    assert dict(other.sd) == pytest.approx(dict(ridden.sd), rel=0.02)  # one of them with six digits
    assert "rider 75 kg at 0.42 m, 1.06 m up" in ridden.description
    assert "--rider-place and --rider-inertia need" in refused("new", tmp_path / "b.toml", *EIGHT, *rider[2:])
    told = refused("rider", "pista", *placed, "--posture", "hoods", "--out", tmp_path / "b.toml")
    assert "--place needs no body model: leave out --posture" in told
    assert "give 3 or 4 numbers in kg m^2" in refused(
        "rider", "pista", *placed[:4], "--inertia", "1", "--out", "b.toml"
    )
    assert "give --posture" in refused("rider", "pista", "--mass", "75", "--out", tmp_path / "b.toml")
