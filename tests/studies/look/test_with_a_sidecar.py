"""Recordings that have their sidecar: `look` says what `tyre fit` does with them as they are."""

import numpy as np
import pytest

from studies.cli import main
from studies.look import drafts, look

SIDECAR = 'tyre = "A"\nload_N = 400\npressure_bar = 5\nsurface = "flat"\naxes = "adapted SAE"\nspeed_km_h = 9\n'


def recording(tmp_path, slip, more="", names="time_s,slip_angle_deg,lateral_force_N,vertical_load_N"):
    rng = np.random.default_rng(0)
    time = np.arange(slip.size) / 50
    lagged = np.zeros(slip.size)
    for k in range(1, slip.size):
        lagged[k] = lagged[k - 1] + (slip[k - 1] - lagged[k - 1]) * 2.5 / 50 / 0.2
    force = 440 * np.sin(1.3 * np.arctan(6400 * np.radians(lagged) / 572)) + rng.normal(0, 1, slip.size)
    rows = zip(time, slip + rng.normal(0, 0.005, slip.size), force, 400 + rng.normal(0, 1, slip.size), strict=True)
    path = tmp_path / "a.csv"
    path.write_text("\n".join([names, *(",".join(f"{x:.4f}" for x in row) for row in rows), ""]), encoding="utf-8")
    path.with_suffix(".toml").write_text(SIDECAR + more, encoding="utf-8")
    return path


SWEEP = np.tile(np.interp(np.arange(500), [0, 125, 375, 500], [0, 4, -4, 0]), 2)
STEP = np.repeat([0.0, 1.0], [200, 400])


def by_name(path):
    return {use.name.partition(" (")[0]: use for use in look(path).uses}


def test_a_sweep_is_used_and_its_sidecar_kept(tmp_path):
    path = recording(tmp_path, SWEEP)
    uses = by_name(path)
    (event,) = uses["slip sweep"].events
    assert (event.first, event.last) == (1, SWEEP.size)
    assert 0 < event.used < SWEEP.size
    assert uses["slip sweep"].next_step == f"velotyre tyre fit {tmp_path} --out fit"
    assert "the sidecar and the channels make it a slip sweep" in uses["lateral stiffness test"].reasons[0]
    assert "a lateral stiffness test needs" in uses["lateral stiffness test"].remedies[0]
    assert drafts(look(path), tmp_path) == []


def test_a_step_must_be_declared(tmp_path):
    uses = by_name(recording(tmp_path, STEP))
    assert not uses["step"].usable
    assert "slip range is" in uses["step"].reasons[0]
    assert 'it is a step: write kind = "slip_step"' in uses["step"].reasons[0]
    uses = by_name(recording(tmp_path, STEP, 'kind = "slip_step"\n'))
    (event,) = uses["step"].events
    assert event.used == STEP.size


def test_the_wrong_axes_are_told_as_the_fit_tells_them(tmp_path, capsys):
    path = recording(tmp_path, SWEEP)
    path.with_suffix(".toml").write_text(SIDECAR.replace("adapted SAE", "ISO"), encoding="utf-8")
    (reason,) = by_name(path)["slip sweep"].reasons
    with pytest.raises(SystemExit):
        main(["tyre", "fit", str(tmp_path), "--out", str(tmp_path / "fit"), "--jobs", "1"])
    assert "wrong sign: lateral force falls with slip" in reason
    assert reason[:60] in " ".join(capsys.readouterr().err.split())


def test_a_map_in_the_sidecar_with_windows_is_what_is_judged(tmp_path):
    channels = (
        '[channels]\ntime = {column = "t", unit = "s"}\nslip_angle = {column = "a", unit = "deg"}\n'
        'lateral_force = {column = "f", unit = "N"}\nvertical_load = {column = "z", unit = "N"}\n'
        '[[windows]]\nname = "one"\nfrom_s = 2\nto_s = 12\n'
    )
    path = recording(tmp_path, SWEEP, channels, names="t,a,f,z")
    (event,) = by_name(path)["slip sweep"].events
    assert (event.first, event.last) == (101, 601)
    path.with_suffix(".toml").write_text(SIDECAR + channels.replace('"z"', '"nothing"'), encoding="utf-8")
    assert "no column 'nothing'" in by_name(path)["slip sweep"].reasons[0]


def test_a_rim_that_cannot_move_is_declared(tmp_path, capsys):
    rows = [f"{60 * x:.2f},{x:.3f}" for x in np.concatenate([np.linspace(0, 4, 60), np.linspace(4, 0, 60)])]
    path = tmp_path / "p.csv"
    path.write_text("\n".join(["lateral_force_N,plate_displacement_mm", *rows, ""]), encoding="utf-8")
    path.with_suffix(".toml").write_text(SIDECAR, encoding="utf-8")
    assert "rim_displacement" in by_name(path)["lateral stiffness test"].reasons[0]
    path.with_suffix(".toml").write_text(SIDECAR + "rigid_rim = true\n", encoding="utf-8")
    assert by_name(path)["lateral stiffness test"].events[0].used == 120
    names = "lateral_force_N,plate_displacement_mm,rim_displacement_mm"
    path.write_text("\n".join([names, *(f"{row},0" for row in rows), ""]), encoding="utf-8")
    assert "rigid_rim = true, but rim_displacement is recorded" in by_name(path)["lateral stiffness test"].reasons[0]
