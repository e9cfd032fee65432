"""What `look` says is what `tyre fit`, `modal` and `diagnose` then do, with just those samples."""

import json
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lab_files import can_log, half_empty, imu_log, pull_export, rig_log

from bicycle.identification import identify, read_run, read_runs
from bicycle.identification import read_events as bicycle_events
from studies.cli import main
from studies.look import drafts, look, write_drafts
from tyre.fits import block_means, fit_slip_sweep, read_events, samples_used
from tyre.formats import ChannelMap
from tyre.ground import read_toml


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    """A log of a rig, what is in it, and drafts that are filled in."""
    folder = tmp_path_factory.mktemp("rig")
    truth = rig_log(folder / "log.csv")
    found = look(folder / "log.csv")
    write_drafts(drafts(found, folder), folder, force=False)
    filled(folder)
    return folder, truth, found


@pytest.fixture
def looked(monkeypatch, no_pictures):
    """Run `velotyre look` with drafts into a folder, and give what it found: one look takes seconds."""
    found = []

    def noted(*given):
        found.append(look(*given))
        return found[-1]

    def at(path, out):
        main(["look", str(path), "--out", str(out)])
        return found[-1]

    monkeypatch.setattr("studies.look.look", noted)
    return at


def use(found, name):
    return next(use for use in found.uses if use.name.startswith(name))


def filled(folder: Path, **values: str) -> list[Path]:
    """Fill in the marked places of all sidecars in a folder, as a user would."""
    given = {"tyre": '"A"', "pressure_bar": "5", "surface": '"flat"', "axes": '"adapted SAE"', "load_N": "400"} | values
    done = []
    for path in sorted(folder.glob("*.toml")):
        lines = path.read_text(encoding="utf-8").splitlines()
        for place, line in enumerate(lines):
            key = line.partition(" = ")[0]
            if "# FILL IN" in line and key in given:
                lines[place] = f"{key} = {given[key]}"
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        done.append(path)
    return done


def test_sweeps_and_steps_of_one_file_are_fitted_in_the_windows_of_the_draft(rig, tmp_path, capsys):
    folder, truth, found = rig
    sweeps, steps = use(found, "slip sweep"), use(found, "step")
    # the events lie where they were made, to a part in 400 of the recording and the rest of a step
    near = 0.01 * truth["samples"]
    assert [[e.first, e.last] for e in sweeps.events] == [pytest.approx(span, abs=near) for span in truth["sweeps"]]
    assert len(steps.events) == 2
    assert sorted(path.name for path in folder.glob("*.toml")) == ["log.toml", "log_step.toml"]
    main(["tyre", "fit", str(folder), "--out", str(tmp_path / "fit"), "--json", "-", "--jobs", "1"])
    conditions = json.loads(capsys.readouterr().out)["conditions"]
    assert {c["load_N"]: len(c["files"]) for c in conditions} == {300: 3, 500: 1}
    for condition in conditions:
        stiffness = condition["cornering_stiffness_N_per_rad"]["value"]
        assert stiffness == pytest.approx(truth["stiffness"][condition["load_N"]], rel=0.03)
    # the recordings that are fitted hold the samples that were named
    for name, run in read_events(folder / "log.toml").items():
        event = next(event for event in sweeps.events if event.name == name)
        assert event.last - event.first + 1 == run.time.size
        assert fit_slip_sweep(run).blocks.size.sum() == run.time.size
        assert run.time[0] == pytest.approx(found.opened.time[event.first - 1])


def test_samples_said_to_be_left_out_do_not_move_the_fit_and_others_do(rig):
    folder, _, found = rig
    run = next(iter(read_events(folder / "log.toml").values()))
    used = samples_used(run, block_means(run))
    event = use(found, "slip sweep").events[0]
    assert event.used == used.sum() < run.time.size
    before = fit_slip_sweep(run).cornering_stiffness.value
    for which, moves in ((~used, False), (used & (np.cumsum(used) < 200), True)):
        force = np.where(which, run.lateral_force + 30.0, run.lateral_force)
        after = fit_slip_sweep(replace(run, lateral_force=force)).cornering_stiffness.value
        assert (abs(after / before - 1) > 1e-6) == moves


def test_a_lateral_stiffness_test_of_a_testing_machine_is_fitted_once_the_draft_is_filled_in(looked, tmp_path, capsys):
    stiffness = pull_export(tmp_path / "pull.txt")
    (event,) = use(looked(tmp_path / "pull.txt", tmp_path / "drafts"), "lateral stiffness test").events
    capsys.readouterr()
    with pytest.raises(SystemExit):  # what is marked must be filled in
        main(["tyre", "fit", str(tmp_path / "drafts"), "--out", str(tmp_path / "fit"), "--jobs", "1"])
    assert "pull.pull.toml: tyre is empty" in capsys.readouterr().err
    filled(tmp_path / "drafts")
    main(["tyre", "fit", str(tmp_path / "drafts"), "--out", str(tmp_path / "fit"), "--json", "-", "--jobs", "1"])
    (condition,) = json.loads(capsys.readouterr().out)["conditions"]
    assert condition["lateral_stiffness_N_per_m"]["value"] == pytest.approx(stiffness, rel=0.02)
    (test,) = read_events(tmp_path / "drafts" / "pull.pull.toml").values()
    assert event.used == test.complete.sum() == event.last


def test_decays_are_identified_in_the_windows_of_the_draft(looked, tmp_path, capsys):
    log, out = tmp_path / "my | log ä" / "imu.csv", tmp_path / "my drafts"
    log.parent.mkdir()
    truth = imu_log(log)
    decay = use(looked(log, out), "free decay")
    assert [e.start_s for e in decay.events] == [pytest.approx(kick, abs=0.6) for kick in truth["kicks"]]
    shown = capsys.readouterr().out
    (line,) = [line for line in shown.splitlines() if "next: velotyre modal" in line]
    command = line.partition("next: velotyre ")[2].replace("modal.csv", str(tmp_path / "modal.csv"))
    main(shlex.split(command))
    rows = (tmp_path / "modal.csv").read_text().splitlines()
    assert len(rows) == 1 + len(truth["kicks"])
    channel_map = ChannelMap.from_file(out / "imu.decays.toml")
    for event, run in zip(decay.events, bicycle_events(log, 5.0, channel_map=channel_map), strict=True):
        assert (run.time.size, run.time[0]) == (event.used, pytest.approx(event.start_s))
        root = identify(run, thorough=False).eigenvalue
        assert (root.real, root.imag) == pytest.approx((truth["decay"], 2 * np.pi * truth["hertz"]), rel=0.05)


@pytest.mark.parametrize("write", [half_empty, can_log])
def test_histories_are_read_by_the_draft(looked, tmp_path, write):
    path = write(tmp_path)
    (event,) = use(looked(path, tmp_path / "drafts"), "replay").events
    content = read_toml(tmp_path / "drafts" / f"{path.stem}.measurement.toml", "measurement")
    (run,), _, _ = read_runs(content["histories"], tmp_path / "drafts")
    assert (run.time.size, run.time[0]) == (event.used, pytest.approx(event.start_s))
    assert "steer_torque_N_m" in run.inputs


def test_a_window_that_tells_more_is_taken_before_a_whole_recording_that_would_do(looked, tmp_path, capsys):
    """A second, slower push: the whole is fitted as the decay after the first one, with R^2 = 0.93.

    A quick fit of the whole says so; only windows that are told are fitted as `modal` does.
    """
    root, rng, t = complex(-0.7, 4.4), np.random.default_rng(5), np.arange(0, 10, 0.01)
    late = np.maximum(t - 5, 0)
    wave = np.exp(root * t) + 0.5j * np.exp(root * late) * (1 - np.exp(-((late / 0.7) ** 2)))
    motion = {"roll_rate_rad_s": 0.5 * wave.real, "steer_rate_rad_s": ((0.6 - 0.5j) * wave).real}
    columns = [t, *(x + 0.005 * rng.standard_normal(t.size) for x in motion.values())]
    path = tmp_path / "ridden.csv"
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=",".join(["time_s", *motion]), comments="")
    whole = identify(read_run(path, 5.0), drift="parabola", thorough=False)
    assert whole.rejected == ""
    assert 0.8 < whole.r_squared < 0.95
    (event,) = use(looked(path, tmp_path / "drafts"), "free decay").events
    assert (event.start_s, event.end_s) == (pytest.approx(0.0, abs=0.5), pytest.approx(4.0, abs=1.1))
    shown = capsys.readouterr().out
    assert (
        f"not used: the whole recording: R^2 = {whole.r_squared:.2f}; the stretches after impulses fit better" in shown
    )
    found = identify(read_run(path, 5.0), first_s=event.start_s, last_s=event.end_s)
    assert abs(found.eigenvalue - root) < 4 * max(found.sd) < 2 * max(whole.sd)


@pytest.mark.parametrize(("hertz", "named"), [(6.0, True), (3.0, False)])
def test_a_decay_in_the_band_of_wobble_is_named_wobble(tmp_path, hertz, named):
    time, rng = np.arange(0, 3, 0.01), np.random.default_rng(1)
    roll_rate = np.exp(-0.9 * time) * np.cos(2 * np.pi * hertz * time) + rng.normal(0, 0.01, time.size)
    np.savetxt(tmp_path / "a.csv", np.c_[time, roll_rate], delimiter=",", header="time_s,roll_rate_rad_s", comments="")
    decay = use(look(tmp_path / "a.csv"), "free decay")
    assert decay.events[0].notes[0].startswith(f"{hertz:g} Hz, decays with ")
    assert ("--mode wobble" in decay.next_step) is named
