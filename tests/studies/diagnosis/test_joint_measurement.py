"""One bicycle measured twice: weave and rides of the published benchmark, by nothing of velotyre (synthetic)."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from published_bicycle import ride, weave
from small_library import among

from studies.cli import main
from studies.diagnosis import JointData, draw_all, find, read_measurement, terminal
from tests.shared.refusals import refuses

HEAD = """
kind = "joint"
bicycle = "benchmark"
description = "Synthetic."

[uncertainty]
"""
MODES = """
[[part]]
name = "modes"
kind = "modal"
[part.modal]
table = "weave.csv"
"""
KICKS = """
[[part]]
name = "kicks"
kind = "histories"
[part.histories]
noise_sd = {roll_rate_rad_s = 0.004, steer_rad = 0.002}
"""
SPEEDS = (4.6, 6.4)
FEW = ("kicks/steer_scale", "kicks/steer_delay", "kicks/roll_rate_scale", "modes/steer_sensor_scale", "steer_damper",
       "steer_spring")  # fmt: skip


def torque(t):
    return 2.0 * np.sin(2 * np.pi * 0.9 * t) + 1.0 * np.sin(2 * np.pi * 2.3 * t + 1)


def written(folder, *, steer_scale=1.0, uncertainty="lam = 0.003\nIBxx = 0.2\nc = 0.002\n", roots_scale=1.0):
    """A joint measurement: 8 weave points with ratios, two rides of which the steer angle is read too large."""
    rng = np.random.default_rng(8)
    lines = [
        "speed_m_s,mode,real_1_s,imag_rad_s,real_sd_1_s,imag_sd_rad_s,steer_over_lean_re,steer_over_lean_im,steer_over_lean_sd"
    ]
    for speed in np.linspace(4.5, 8.0, 8):
        root, ratio = weave(speed * roots_scale)
        true, sd = (root.real, root.imag, ratio.real, ratio.imag), (0.03, 0.03, 0.02, 0.02)
        a, b, c, d = (x + s * rng.standard_normal() for x, s in zip(true, sd, strict=True))
        lines.append(f"{float(speed)!r},weave,{a!r},{b!r},0.03,0.03,{c!r},{d!r},0.02")
    (folder / "weave.csv").write_text("\n".join(lines) + "\n")
    text = HEAD + uncertainty + MODES + KICKS
    for speed in SPEEDS:
        time, x = ride(speed, 2.5, torque)
        time, x = time[::20], x[::20]
        table = np.column_stack([
            time, x[:, 2] + 0.004 * rng.standard_normal(len(time)),
            steer_scale * x[:, 1] + 0.002 * rng.standard_normal(len(time)), torque(time),
        ])  # fmt: skip
        head = "time_s,roll_rate_rad_s,steer_rad,steer_torque_N_m"
        np.savetxt(folder / f"ride{speed}.csv", table, delimiter=",", comments="", header=head)
        text += f'[[part.histories.runs]]\nfile = "ride{speed}.csv"\nspeed_m_s = {speed}\n'
    (folder / "MEASUREMENT.toml").write_text(text)
    return folder / "MEASUREMENT.toml"


@pytest.fixture(scope="module")
def off(tmp_path_factory):
    measurement = read_measurement(written(tmp_path_factory.mktemp("off"), steer_scale=1.08))
    return among(measurement, FEW)


def test_a_sensor_of_one_part_is_named_as_that_part_s(off):
    assert isinstance(off.kind, JointData)
    assert (off.verdict.verdict, off.verdict.equivalent) == ("named", ("kicks/steer_scale",))
    scale, sd = off.verdict.effects[0].parameters["scale"]
    assert scale == pytest.approx(0.08, abs=4 * sd)
    assert off.model.effects == off.kind.model.effects  # nothing of the bicycle


def test_parts_agree_once_the_sensor_is_named(off):
    found = find(off)
    assert [p.part for p in found.parts] == ["modes", "kicks"]
    assert not any(p.contradicts for p in found.parts)
    assert found.without == {}


def test_a_part_that_contradicts_the_rest_is_named(tmp_path):
    """Weave as at 1.3 times the stated speed: no effect and no parameter explains it beside the rides."""
    other = among(read_measurement(written(tmp_path, roots_scale=1.3)), ("kicks/steer_scale",))
    found = find(other)
    assert (other.verdict.verdict, found.joint_fits, found.odd_names) == ("unknown", False, ["modes"])
    first = next(line for line in terminal(other, found).splitlines() if line.startswith("check first: "))
    counts = re.search(r"Without modes all other data fit \((\d+) of (\d+) data points\)\.", first)
    assert int(counts[2]) - int(counts[1]) == 8 * 4  # eight points of weave: two parts of the root, two of the ratio
    assert "Check the set-up and the sensors of modes." in first


def test_each_part_has_its_own_figures(off, tmp_path, no_pictures):
    """What a part shows is its rows of the joint fits, under the name of the joint hypothesis."""
    captions = draw_all(off, find(off), tmp_path)
    for number, name in ((1, "modes"), (2, "kicks")):
        figure = f"before_after_{number}"
        assert captions[figure].startswith(f"{name}: ")
        assert (tmp_path / f"{figure}.png").exists()
    views = [off.kind.view_part(off, number) for number in range(2)]
    for residual, whole in (("nominal", off.nominal), ("final", off.final.residual)):
        parts = [v.nominal if residual == "nominal" else v.final.residual for v in views]
        np.testing.assert_array_equal(np.concatenate(parts), whole)
    for view in views:
        assert view.final.name == "kicks/steer_scale"
        again, _ = view.kind.residual(view.final.candidates, view.final.theta)
        np.testing.assert_allclose(again, view.final.residual, atol=1e-9)
    assert [[c.identifier for c in view.final.candidates] for view in views] == [[], ["steer_scale"]]


def test_nothing_is_missing_where_both_are_of_the_bicycle(tmp_path):
    measurement = read_measurement(written(tmp_path))
    found = among(measurement, FEW)
    assert found.verdict.verdict == "none"


def test_a_recorded_torque_takes_the_motor_out_of_the_part_that_holds_it(tmp_path):
    motor = "steer_assist = {gain = 0.8}\n[effects.steer_assist]\ngain = 8.0\n[effects.steer_motor]\n"
    measurement = read_measurement(written(tmp_path, uncertainty=f"lam = 0.003\n{motor}"))
    modes, kicks = (part.kind for part in measurement.parts)
    assert [e.identifier for e in modes.model.effects] == ["no_slip", "steer_assist", "steer_motor"]
    assert [e.identifier for e in kicks.model.effects] == ["no_slip"]
    assert any(
        "kicks: steer_assist, steer_motor: removed from the base model, as the recorded" in n
        for n in measurement.prepare().notes
    )
    assert "steer_assist.gain" in {u.name for u in measurement.prepare().nuisances}


def test_what_simulate_writes_of_a_bicycle_with_a_motor_is_explained_by_it(tmp_path):
    """The recorded torque is the input alone there: with the motor left out, the rides would be of another bicycle."""
    model = 'bicycle = "balanceassistv1"\n[effects.steer_assist]\ngain = 5.0\nfade_speed = 5.0\nlean_gain = 0.0\n'
    (tmp_path / "on.toml").write_text(model)
    torque = ["--input", "steer_torque:doublet:3@0.1+0.3", "--duration", "3", "--step", "0.01"]
    (tmp_path / "s.toml").write_text("rate_hz = 100\n[channels.roll_rate_rad_s]\n[channels.steer_torque_N_m]\n")
    place = ["--sensors", str(tmp_path / "s.toml"), "--out", str(tmp_path / "run")]
    main(["simulate", str(tmp_path / "on.toml"), "--speed", "2.75", *torque, *place])
    runs = '[[histories.runs]]\nfile = "run/recording.csv"\nspeed_m_s = 2.75\n'
    noise = "[histories.noise_sd]\nroll_rate_rad_s = 0.001\n"
    gaps = []
    for key in ("", "motor_in_torque = false\n"):
        file = tmp_path / "MEASUREMENT.toml"
        file.write_text(f'kind = "histories"\n{model}[histories]\nchannels = ["roll_rate_rad_s"]\n{key}{runs}{noise}')
        forward = read_measurement(file).prepare()
        residual, _ = forward.residual((), np.array([u.centre for u in forward.nuisances]), slopes=False)
        gaps.append(float(residual @ residual) / len(residual))
    assert gaps[0] > 100 > 1e-3 > gaps[1]
    assert any(n.startswith("steer_assist: acts in addition to the recorded steer torque") for n in forward.notes)


@pytest.mark.parametrize(("change", "words"), [
    (lambda t: t.replace(MODES, ""), r"one \[\[part\]\] only: write \[\[part\]\] .*kind and .* two or more"),
    (lambda t: t.replace('kind = "joint"', 'kind = "joint"\npart = 3').split("[[part]]")[0], "must be tables:"),
    (lambda t: t.replace("part.modal", "part.modals"), "known: .* frequency_response, hands, histories, kind"),
    (lambda t: t.replace("[uncertainty]", "[candidates.motor]\n[uncertainty]"), r"\[candidates.motor\]: unkn"),
    (lambda t: t.replace('name = "modes"', ""), "part 1.*: a part without a name; write"),
    (lambda t: t.replace('"modes"', '"a/b"'), "'a/b' must be a name in quotes without '/'"),
    (lambda t: t.replace('"modes"', '"kicks"'), "'kicks' is given twice; give each part a name of its own"),
    (lambda t: t.replace('kind = "modal"', ""), "part 1.*: a part without a kind"),
    (lambda t: t.replace('"modal"', '"tyre_tables"'), r"'tyre_tables' is not allowed in .*part"),
    (lambda t: t.replace("part.modal", "part.bench"), r"part 'modes': .* the table \[modal\] is missing"),
    (lambda t: t.replace("weave.csv", "wave.csv"), "part 'modes': .*wave.csv"),
    (lambda t: t.replace('"joint"', '"modal"'), r"kind is 'modal' but \[\[part\]\] belongs to kind = 'joint'"),
    (lambda t: t.split("[[part]]")[0], "kind is 'joint' but there is no part"),
])  # fmt: skip
def test_files_that_cannot_be_read(tmp_path, change, words):
    file = written(tmp_path)
    file.write_text(change(file.read_text()))
    refuses(words, read_measurement, file)


def test_a_name_that_no_part_knows_is_refused(tmp_path):
    measurement = read_measurement(written(tmp_path))
    refuses("--without.*kicks/steer_skale", measurement.prepare, without=("kicks/steer_skale",))
    tried = {c.identifier for c in measurement.prepare(without=("kicks/steer_scale", "steer_damper")).candidates}
    assert {"kicks/steer_scale", "steer_damper"}.isdisjoint(tried)
    assert "modes/steer_sensor_scale" in tried


def test_a_process_that_imports_the_door_alone_reads_joint_data():
    """A kind is known once its file is imported, which other tests of this process do."""
    example = Path(__file__).parents[3] / "docs" / "examples" / "measurements" / "joint" / "MEASUREMENT.toml"
    code = "import sys; from studies.diagnosis import read_measurement; read_measurement(sys.argv[1])"
    subprocess.run([sys.executable, "-c", code, str(example)], check=True)
