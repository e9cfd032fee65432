"""``velotyre simulate``: what its options mean, what it writes, what it refuses."""

import numpy as np
import pandas as pd
import pytest

from bicycle.model import read_model
from bicycle.motion import respond
from studies.cli import main
from studies.motion import parse_initial, parse_inputs
from tests.shared.refusals import refuses
from tyre.ground import InputError

MODEL = """bicycle = "benchmark"
[effects.relaxation_length]
cornering_stiffness = 6000.0
relaxation_length = 0.12
"""
INPUTS = {"steer_torque": "N m", "lean_torque": "N m", "rear_slip": "rad"}


@pytest.fixture
def file(tmp_path):
    (tmp_path / "m.toml").write_text(MODEL)
    return str(tmp_path / "m.toml")


def test_linear_run_writes_the_response(no_pictures, file, tmp_path, capsys):
    out = tmp_path / "out"
    main(["simulate", file, "--speed", "6", "--duration", "1", "--step", "0.1", "--initial", "lean=0.02,steer_rate=0.1",
          "--input", "steer_torque:step:0.5@0.3", "--out", str(out)])  # fmt: skip
    assert {path.name for path in out.iterdir()} == {
        "response_linear.csv", "response.png", "response.svg", "simulate.manifest.json"
    }  # fmt: skip
    table = pd.read_csv(out / "response_linear.csv")
    assert table["time_s"].to_numpy() == pytest.approx(np.arange(11) * 0.1)
    assert table["steer_torque_N_m"].tolist() == [0, 0, 0] + [0.5] * 8
    inputs = parse_inputs(["steer_torque:step:0.5@0.3"], allowed=INPUTS)
    expected = respond(
        read_model(file).linear_model(), speed=6.0, time=table["time_s"], initial={"lean": 0.02, "steer_rate": 0.1},
        inputs=inputs,
    )  # fmt: skip
    assert table["lean_rad"].to_numpy() == pytest.approx(expected.outputs["lean"], rel=1e-12)
    assert "response_linear.csv" in capsys.readouterr().out


def test_nonlinear_run_and_frequency_response(file, tmp_path, capsys):
    out = tmp_path / "out"
    main(["simulate", file, "--speed", "6", "--duration", "2", "--initial", "lean=0.05", "--nonlinear",
          "--peak-factor", "0.2", "--input", "lateral_push:pulse:300@0+0.5", "--frequency-response", "steer_torque",
          "--out", str(out)])  # fmt: skip
    table = pd.read_csv(out / "response_magic_formula.csv")
    load = read_model(file).bicycle.static_loads[0]
    assert table["rear_lateral_force_N"].abs().max() <= 0.2 * load * (1 + 1e-12)
    assert pd.read_csv(out / "response_linear.csv")["rear_lateral_force_N"].abs().max() > 0.2 * load
    gains = pd.read_csv(out / "frequency_response.csv")
    assert gains["frequency_Hz"].iloc[[0, -1]].tolist() == pytest.approx([0.05, 20.0])
    assert (out / "frequency_response.png").stat().st_size > 10_000
    shown = capsys.readouterr().err
    assert "Magic Formula: the bicycle has fallen at" in shown
    assert "unstable at this speed: the frequency response only shows" in shown


def test_the_table_ends_with_the_fall(no_pictures, file, tmp_path, capsys):
    main(["simulate", file, "--speed", "1", "--duration", "6", "--step", "0.01", "--initial", "lean=0.1", "--nonlinear",
          "--out", str(tmp_path)])  # fmt: skip
    shown = capsys.readouterr().err
    for name in ("response_linear.csv", "response_magic_formula.csv"):
        table = pd.read_csv(tmp_path / name)
        fallen = (table[["lean_rad", "steer_rad"]].abs() > np.pi / 2).any(axis=1)
        assert fallen.tolist() == [False] * (len(table) - 1) + [True]
        assert f"{name} ends with the fall at {table['time_s'].iloc[-1]:.2f} s" in shown


def test_an_offset_alone_moves_the_bicycle(no_pictures, file, tmp_path):
    words = "--speed 5 --duration 0.5 --nonlinear --offset 0.01 --out"
    main(["simulate", file, *words.split(), str(tmp_path / "o")])
    assert pd.read_csv(tmp_path / "o" / "response_magic_formula.csv")["lean_rad"].abs().max() > 1e-4
    assert pd.read_csv(tmp_path / "o" / "response_linear.csv")["lean_rad"].abs().max() == 0


def test_inputs_from_a_file(tmp_path):
    (tmp_path / "t.csv").write_text("time_s,steer_torque_N_m\n0,1.5\n0.5,-2\n")
    found = parse_inputs(
        [f"steer_torque:steps:{tmp_path / 't.csv'}", "rear_slip:doublet:0.02@1+0.5", "lean_torque:step:3"],
        allowed=INPUTS,
    )
    assert found["steer_torque"].at([0.0, 0.49, 0.5]).tolist() == [1.5, 1.5, -2.0]
    assert found["rear_slip"].at([1.0, 1.25, 1.5]).tolist() == [0.02, -0.02, 0.0]
    assert found["lean_torque"].at([-0.1, 0.0]).tolist() == [0.0, 3.0]
    samples = parse_inputs([f"steer_torque:file:{tmp_path / 't.csv'}"], allowed=INPUTS)["steer_torque"]
    assert samples.at([-0.1, 0.0, 0.25, 0.5, 9.0]).tolist() == [0.0, 1.5, -0.25, -2.0, -2.0]
    assert samples.before([0.0, 0.5]).tolist() == [0.0, -2.0]


@pytest.mark.parametrize(("text", "words"), [
    ("steer_torque", "write NAME:step:SIZE"), ("steer_torque:step:", "write NAME:step:SIZE"),
    ("steer_torque:step:a", "write NAME:step:SIZE"), ("steer_torque:step:inf", "write NAME:step:SIZE"),
    ("steer_torque:step:1@0+3", "write NAME:step:SIZE"),
    ("steer_torque:pulse:1@0", "NAME:pulse:SIZE@START.DURATION"),
    ("steer_torque:pulse:1@0+0", "the duration of a pulse is 0 s"),
    ("steer_torque:stp:1", "unknown shape 'stp'; did you mean 'step'"),
    ("steer_torque:file:absent.csv", "absent.csv"), ("steer_torque:steps:absent.csv", "absent.csv"),
])  # fmt: skip
def test_refused_inputs(text, words):
    with pytest.raises((InputError, FileNotFoundError), match=words):
        parse_inputs([text], allowed=INPUTS)


@pytest.mark.parametrize(("content", "words"), [
    ("time_s,torque\n0,1\n", "the column steer_torque_N_m is missing; there are time_s, torque"),
    ("t,steer_torque_N_m\n0,1\n", "the column time_s is missing"),
    ("", "the file is empty; the first line must name the columns: time_s, steer_torque_N_m"),
    ("time_s,steer_torque_N_m\n", "the table has no rows"),
    ("time_s,steer_torque_N_m\n0,high\n", "steer_torque_N_m = 'high' is not a finite number"),
    ("time_s,steer_torque_N_m\n0,1\n0,2\n", "the times of an input must increase"),
])  # fmt: skip
def test_refused_input_files(content, words, tmp_path):
    (tmp_path / "t.csv").write_text(content)
    refuses(f"t.csv(, line 2)?: {words}", parse_inputs, [f"steer_torque:file:{tmp_path / 't.csv'}"], allowed=INPUTS)


@pytest.mark.parametrize(
    ("text", "words"),
    [("lean", "write STATE=NUMBER"), ("lean=a", "write STATE=NUMBER"), ("lean=1,lean=2", "lean is given twice")],
)
def test_refused_initial_states(text, words):
    refuses(words, parse_initial, text)


@pytest.mark.parametrize(("options", "words"), [
    ([], "nothing moves the bicycle; give --initial or --input"),
    (["--initial", "lean=1", "--duration", "0"], "duration = 0 s must be positive"),
    (["--initial", "lean=1", "--step", "-1"], "step = -1 s must be positive"),
    (["--initial", "lean=1", "--step", "9", "--duration", "2"], "step = 9 s is longer than duration = 2 s"),
    (["--input", "steer_torque:step:1@9", "--duration", "2"], "steer_torque starts at 9 s, outside the simulated"),
    (["--input", "steer_torque:step:1@2", "--duration", "2"], "starts at 2 s, outside the simulated time 0 .. 2 s"),
    (["--input", "steer_torque:step:1@-1"], "steer_torque starts at -1 s, outside the simulated time 0 .. 5 s"),
    (["--initial", "lean=1", "--peak-factor", "0.8"], "--peak-factor is an option of the Magic Formula tyre; add"),
    (["--initial", "lean=1", "--shape-factor", "1"], "--shape-factor is an option of the Magic Formula tyre"),
    (["--initial", "lean=1", "--curvature-factor", "0"], "--curvature-factor is an option of the Magic Formula tyre"),
    (["--offset", "0.01"], "--offset is an option of the Magic Formula tyre"),
    (["--input", "foo:file:absent.csv"], "unknown input 'foo'; known: "),
    (["--initial", "lean=1", "--step", "1e-9"], "samples are more than a million"),
    (["--initial", "lena=1"], "unknown state 'lena'; did you mean 'lean'"),
    (["--input", "steer:step:1"], "unknown input 'steer'"),
    (["--initial", "lean=0.1", "--nonlinear", "--peak-factor", "9"], "peak_factor = 9 is outside 0 .. 3"),
])  # fmt: skip
def test_refused_commands(options, words, file, tmp_path, refused):
    assert words in refused("simulate", file, "--speed", "5", "--out", tmp_path / "out", *options)
    assert not (tmp_path / "out").exists()


def test_what_is_typed_with_units():
    found = parse_initial("lean=2deg,steer_rate=90deg/s", {"lean": "rad", "steer_rate": "rad/s"})
    assert found == pytest.approx({"lean": np.radians(2), "steer_rate": np.radians(90)})
    inputs = parse_inputs(["lateral_push:pulse:10kg@1+200ms"], allowed={"lateral_push": "N"})
    history = inputs["lateral_push"]
    assert history.value.max() == pytest.approx(98.0665)
    assert history.time == pytest.approx([1.0, 1.2])  # the unit of the duration is not that of the start
    with pytest.raises(InputError, match="lean: 2 kg: unit 'kg' is not a unit of angle"):
        parse_initial("lean=2 kg", {"lean": "rad"})
