"""``velotyre frequency-response``: from recorded runs, one unstable and held, to what is missing (synthetic)."""

import re

import numpy as np
import pytest
from published_bicycle import gains, held, state_matrix
from scipy.linalg import solve_continuous_are

from studies.cli import main
from studies.diagnosis import read_measurement, responses_of_runs
from tyre.ground import InputError

HEAD = "time_s,roll_rate_rad_s,steer_rad,steer_torque_N_m,push_N_m"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    root = tmp_path_factory.mktemp("runs")
    for speed in (4.0, 6.5):
        push = np.linalg.inv([[80.81722, 2.31941332208709], [2.31941332208709, 0.29784188199686]])[:, 1]
        b = np.concatenate([[0, 0], push])[:, None]
        feedback = (b.T @ solve_continuous_are(state_matrix(speed), b, np.diag([10, 10, 1, 1]), [[0.3]]))[0]
        time, x, torque, reference = held(speed, 90.0, seed=int(speed), noise=0.01, spring=3.0, feedback=feedback)
        table = np.column_stack([time, x[:, 2], x[:, 1], torque, reference])
        np.savetxt(root / f"run{speed:g}.csv", table, delimiter=",", header=HEAD, comments="", fmt="%.7g")
    return root


def test_runs_become_a_table_that_a_diagnosis_reads(folder, capsys, monkeypatch):
    monkeypatch.chdir(folder)
    words = "frequency-response run4.csv@4 run6.5.csv@6.5 --instrument push_N_m --segment 8 --out t.csv"
    main(words.split())
    said = capsys.readouterr()
    assert "steer torque to roll rate" in said.out
    relative = [float(line.split()[-1]) for line in said.out.splitlines() if "steer torque to" in line]
    assert all(0 < sd < 0.5 for sd in relative)
    assert "t.csv: " in said.out
    assert "biases" not in said.err  # a reference is there
    toml = 'kind = "frequency_response"\nbicycle = "benchmark"\n[frequency_response]\ntable = "t.csv"\n'
    (folder / "m.toml").write_text(toml)
    measurement = read_measurement(folder / "m.toml")
    assert any("coherence, averages: read, but not used" in note for note in measurement.notes)
    forward = measurement.prepare()
    z = []
    for p in forward.points:
        true = gains(p.speed, p.frequency, spring=3.0)[{"lean_rate": "roll_rate"}.get(p.output, p.output)][0]
        z += [(p.value.real - true.real) / p.sd, (p.value.imag - true.imag) / p.sd]
    assert np.mean(np.abs(z) < 1.96) > 0.9
    assert np.mean(np.square(z)) < 1.5
    theta = np.array([u.centre for u in forward.nuisances])
    spring = tuple(c for c in forward.candidates if c.identifier == "steer_spring")
    without, with_it = forward.residual((), theta)[0], forward.residual(spring, np.array([*theta, 3.0]))[0]
    assert np.mean(with_it**2) < 1.5 < 5 < np.mean(without**2)


def test_without_a_reference_it_is_said_what_that_assumes(folder, capsys, monkeypatch):
    monkeypatch.chdir(folder)
    options = ["--channel", "time=time_s s", "--channel", "roll_rate=roll_rate_rad_s deg/s -1",
               "--channel", "steer_torque=steer_torque_N_m Nm"]  # fmt: skip
    main(["frequency-response", "run4.csv@4", "--output", "roll_rate", "--segment", "8", *options, "--to-hz", "2"])
    said = capsys.readouterr()
    assert "name a reference that came from outside with --instrument" in " ".join(said.err.split())
    assert "0.25 to 2" in said.out


@pytest.mark.parametrize(("options", "words"), [
    (["run4.csv"], "'run4.csv': give a file and its speed in m/s"),
    (["run4.csv@90"], "give a file and its speed in m/s .up to 60."),
    (["run4.csv@4", "run4.csv@4"], "'run4.csv@4' is given twice"),
    (["run4.csv@4", "--input", "steer_tork"], "--input: unknown input 'steer_tork'; did you mean 'steer_torque'"),
    (["run4.csv@4", "--output", "roll"], "--output: unknown output 'roll'"),
    (["run4.csv@4", "--output", ","], "name each output once"),
    (["run4.csv@4", "--output", "steer,steer"], "name each output once"),
    (
        ["run4.csv@4", "--output", "yaw_rate"],
        "--output yaw_rate: yaw_rate_rad_s was not recorded; it holds roll_rate_rad_s",
    ),
    (["run4.csv@4", "--input", "lateral_push"], "--input lateral_push: lateral_push_N was not recorded"),
    (["run4.csv@4", "--segment", "0"], "--segment = 0 must be positive"),
    (["run4.csv@4", "--to-hz", "-1"], "--to-hz = -1 must be positive"),
    (["run4.csv@4", "--segment", "60"], "run4.csv: .* hold .* independent segments of 60 s"),
    (["run4.csv@4", "--segment", "0.01"], "segments of 0.01 s hold . samples .* take segments of .* s or more"),
    (["run4.csv@4", "--to-hz", "60"], "60 Hz is above 50 Hz, half the sample rate"),
    (["run4.csv@4", "copy.csv@4"], "copy.csv: the same recording as run4.csv; keep one, or it counts twice"),
    (["run4.csv@4", "run4.csv@5"], "run4.csv is given at 4 and at 5 m/s; a recording has one speed: keep one"),
    (
        ["run4.csv@4", "--input", "steer_torque", "--instrument", "steer_torque"],
        "--instrument steer_torque: this is the input itself, no reference from outside; leave --instrument out",
    ),
    (
        ["run4.csv@4", "--instrument", "nope"],
        "nope: there is no such column; it has time_s, .*push_N_m; .velotyre look",
    ),
])  # fmt: skip
def test_what_cannot_be_done(folder, tmp_path, monkeypatch, options, words, refused):
    monkeypatch.chdir(tmp_path)
    for name in ("run4.csv", "copy.csv"):
        (tmp_path / name).write_bytes((folder / "run4.csv").read_bytes())
    said = refused("frequency-response", "--instrument", "push_N_m", *options)
    assert re.search(words, " ".join(said.split()))


def test_runs_of_one_speed_need_one_sample_time(folder, tmp_path):
    lines = (folder / "run4.csv").read_text().splitlines()
    (tmp_path / "slow.csv").write_text("\n".join([lines[0], *lines[1::2]]) + "\n")
    given = [f"{folder}/run4.csv@4", f"{tmp_path}/slow.csv@4"]
    with pytest.raises(InputError, match="samples every 0.02 s, .* every 0.01 s; resample the runs of one speed alike"):
        responses_of_runs(given, "steer_torque", ["steer"], None, reference="push_N_m", segment_s=8, highest_hz=2)
