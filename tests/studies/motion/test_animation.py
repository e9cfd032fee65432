"""Films of modes: the drawn bicycle is rigid and moves as the equations say."""

import numpy as np
import pytest
from PIL import Image

from bicycle import modes
from bicycle.model import read_model
from studies.cli import main
from studies.motion import bicycle_drawing, describe, film, modal_motion

MODEL = """bicycle = "benchmark"
[effects.relaxation_length]
cornering_stiffness = 6000.0
relaxation_length = 0.12
[effects.front_compliance]
joint_x = 0.8
joint_z = -0.85
[effects.rider_lean]
mass = 30.0
x = 0.3
z = -1.1
Ixx = 1.0
Izz = 0.5
joint_z = -0.9
"""
STILL = dict.fromkeys(("lean", "steer", "yaw", "rear_lateral_displacement", "front_compliance", "rider_lean"), 0.0)


@pytest.fixture
def file(tmp_path):
    (tmp_path / "m.toml").write_text(MODEL)
    return str(tmp_path / "m.toml")


@pytest.fixture
def drawn(file):
    return bicycle_drawing(read_model(file))


def point(drawn, body, coordinates, number=0):
    parts = [k for k, part in enumerate(drawn.parts) if part.body == body]
    return drawn.pose({**STILL, **coordinates})[parts[number]]


def test_bodies_stay_rigid(drawn):
    rng = np.random.default_rng(4)
    posed = drawn.pose({name: 0.4 * rng.standard_normal() for name in STILL}, rolled=0.7)
    for part, points in zip(drawn.parts, posed, strict=True):
        for end in range(len(points)):
            assert np.linalg.norm(points - points[end], axis=1) == pytest.approx(
                np.linalg.norm(part.points - part.points[end], axis=1), abs=1e-12
            )


def test_wheels_touch_the_ground_and_turn_forward(drawn):
    for body in ("rear wheel", "front wheel"):
        assert point(drawn, body, {})[:, 2].max() == pytest.approx(0.0, abs=1e-12)
    at_rest = point(drawn, "rear wheel", {}, number=1)
    top = int(at_rest[:, 0].argmax())  # the foremost end of a spoke goes down, z grows
    rolled = drawn.pose(STILL, rolled=0.03)
    number = [k for k, part in enumerate(drawn.parts) if part.body == "rear wheel"][1]
    assert rolled[number][top, 2] > at_rest[top, 2]


def test_front_contact_moves_by_the_trail_when_steered(drawn):
    # first order: the contact point of the front wheel moves -c cos(lam) per radian of steer, x w per radian of yaw
    # (Meijaard et al. 2007, appendix B: c = 0.08 m, lam = pi/10, w = 1.02 m)
    small = 1e-6
    contact = int(point(drawn, "front wheel", {})[:, 2].argmax())
    steered = point(drawn, "front wheel", {"steer": small})[contact]
    yawed = point(drawn, "front wheel", {"yaw": small})[contact]
    assert steered[1] / small == pytest.approx(-0.08 * np.cos(np.pi / 10), rel=1e-3)
    assert yawed[1] / small == pytest.approx(1.02, rel=1e-3)


def test_further_joints_move_what_they_carry(drawn):
    moved = {"rider_lean": 0.1}
    assert np.abs(point(drawn, "rider", moved)[:, 1]).max() == pytest.approx(0.2 * np.sin(0.1))  # 0.2 m above the hinge
    assert (point(drawn, "rear frame", moved) == point(drawn, "rear frame", {})).all()
    twisted = {"front_compliance": 0.1}
    assert np.abs(point(drawn, "front wheel", twisted)[:, 1]).max() > 0.05
    assert (point(drawn, "rear wheel", twisted) == point(drawn, "rear wheel", {})).all()


@pytest.mark.parametrize("name", ["weave", "wobble", "castering"])
def test_modal_motion_agrees_with_the_mode_shape(file, name):
    model = read_model(file).linear_model()
    found = modes(model, [5.0])
    root, shape = complex(found.branch(name)[0, 0]), found.shape(name)
    motion = modal_motion(model, speed=5.0, eigenvalue=root, amplitude=0.2, frames=24)
    for component in ("lean", "steer", "yaw", "lateral"):
        output = "rear_lateral_displacement" if component == "lateral" else component
        phasor = 0.2 * shape.magnitude[component][0] * np.exp(1j * shape.phase[component][0])
        turning = np.exp(1j * root.imag * motion.time) if root.imag else np.exp(root.real * motion.time)
        assert motion.outputs[output] == pytest.approx((phasor * turning).real, abs=1e-9)
    if root.imag:
        assert 24 * motion.time[1] == pytest.approx(2 * np.pi / root.imag)


def test_descriptions():
    assert describe(-1 + 2j * np.pi * 3) == "3.00 Hz, damping ratio 0.053"
    assert describe(-2.0 + 0j) == "decays by e in 0.5 s"
    assert describe(4.0 + 0j) == "grows by e in 0.25 s"
    assert describe(0j) == "neutral"


def test_the_command_writes_one_film(file, tmp_path, capsys, caplog):
    name, speed = "wobble_at_8.5", "8.5"
    film = tmp_path / f"{name}.gif"
    main(["animate", file, "--mode", "wobble", "--speed", speed, "--out", str(film), "--seconds", "0.2"])
    with Image.open(film) as image:
        assert (image.format, image.n_frames) == ("GIF", 4)
        first = np.asarray(image.convert("RGB"))
        image.seek(2)
        assert (np.asarray(image.convert("RGB")) != first).any(axis=2).sum() > 200
    assert {path.name for path in tmp_path.iterdir()} == {"m.toml", f"{name}.gif"}
    assert capsys.readouterr().out == f"film: {film}\n"
    assert not caplog.records  # no remark of matplotlib on limits and aspects


def test_a_metre_is_as_long_both_ways_in_every_view(file, drawn):
    model = read_model(file)
    linear = model.linear_model()
    motion = modal_motion(linear, speed=8.5, eigenvalue=-1 + 20j, amplitude=0.2, frames=4)
    with film(model, drawn, motion, "title") as (canvas, _):
        for axes in canvas.axes:
            right, down = axes.transData.transform([(1.0, 0.0), (0.0, 1.0)]) - axes.transData.transform((0.0, 0.0))
            assert abs(right[0]) == pytest.approx(abs(down[1]), rel=1e-6)
            assert right[0] > 0.0 > down[1]  # x and y to the right, z and the rider's right downwards


@pytest.mark.parametrize(("options", "words"), [
    (["--mode", "wobbl"], "--mode: unknown mode 'wobbl'; did you mean 'wobble'"),
    (["--mode", "wobble", "--out", "w.png"], "w.png: the ending '.png' is not known; a film is a .gif"),
    (["--mode", "wobble", "--amplitude", "90"], "'--amplitude': 90: give a number above 0 up to 45"),
    (["--mode", "wobble", "--seconds", "0"], "'--seconds': 0: give a number from 0.2 up to 60"),
    (["--mode", "wobble", "--speed", "-5"], "'--speed': -5: give a number from 0 up to 1000"),
])  # fmt: skip
def test_refused_films(options, words, file, tmp_path, refused):
    assert words in refused("animate", file, "--speed", "5", "--out", tmp_path / "w.gif", *options)


def test_a_mode_that_is_not_there_at_this_speed(tmp_path, refused):
    said = refused("animate", "browser", "--mode", "capsize", "--speed", "1", "--out", tmp_path / "w.gif")
    assert "there is no capsize at 1 m/s; there are weave, capsize+castering" in said
