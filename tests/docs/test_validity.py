"""What the page on limits says in numbers is what the package computes."""

import math
import re
import shlex

import numpy as np
import pytest
from pages import page, run_page, write_files

import studies.velotyre as vt
from studies.cli import main
from tyre import TyreMap

PAGE = page("validity")


def row(start):
    """Cells of the row of a table that starts so."""
    (line,) = [line for line in PAGE.splitlines() if line.startswith(f"| {start}")]
    return [cell.strip() for cell in line.strip("|").split("|")]


def test_what_it_shows_is_seen(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (shown,) = run_page(PAGE)
    assert "warning: Tyre1 on flat" in shown
    assert "extrapolated" in shown


@pytest.mark.parametrize(("degrees", "percent"), [(14, 1), (31, 5)])
def test_sine_and_angle(degrees, percent):
    angle = math.radians(degrees)
    assert angle / math.sin(angle) - 1 == pytest.approx(percent / 100, abs=0.001)
    assert f"{percent} % at {degrees}°" in PAGE


def test_share_of_the_linear_force():
    tyre = vt.read_tyre("Schwalbe 50km Energizer Plus 28 x 1.75")
    told = row("share of the linear force")[1:]
    for degrees, cell in zip((1, 2, 3, 4, 6), told, strict=True):
        shares = []
        for load in (300.0, 400.0, 600.0):
            for pressure in (3e5, 4e5, 5e5):
                turned = np.radians([degrees, -degrees, 0.01, -0.01])
                force = tyre.lateral_force(slip_angle=turned, load=load, pressure=pressure)
                slope = (force[2] - force[3]) / np.radians(0.02)
                shares.append((force[0] - force[1]) / 2 / (slope * np.radians(degrees)))
        assert cell == f"{min(shares):.2f} to {max(shares):.2f}"


def test_wavelengths_of_the_tutorials_bicycle(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write_files(page("tutorial"), tmp_path)
    (seated,) = re.findall(r"^velotyre (rider .*)$", page("tutorial"), flags=re.M)
    main(shlex.split(seated))
    capsys.readouterr()
    _, front = vt.load_bicycle("ridden.toml").static_loads
    length = vt.read_tyre("Tyre1").at(load=front, pressure=6e5).relaxation_length
    found = vt.critical_speeds(vt.read_model("model.toml"))
    weave, begins, _, ends, _ = found
    for start, one in (
        ("weave, becomes", weave),
        ("wobble, becomes unstable", begins),
        ("wobble, becomes stable", ends),
    ):
        _, at, wave, lengths = row(start)
        speed, frequency = (float(number) for number in re.findall(r"[\d.]+", at))
        assert speed == pytest.approx(one.speed, rel=0.02)
        assert frequency == pytest.approx(one.frequency_hz, rel=0.02)
        assert float(wave.split()[0]) == pytest.approx(one.speed / one.frequency_hz, rel=0.02)
        assert float(lengths) == pytest.approx(one.speed / one.frequency_hz / length, rel=0.05)


def test_the_errors_of_the_single_lag_are_those_of_the_page_on_physics():
    physics = page("physics").replace("−", "-")
    for told, cell in (
        ("2 % too small at 20 relaxation lengths", r"\(20\).*\| -2\.0 %"),
        ("17 % at 2", r"\(2\).*\| -17 %"),
    ):
        assert told in PAGE
        assert re.search(rf"^\| 0\.03 \| [\d.]+ {cell}, \S+ \|$", physics, re.M)


def test_the_drum_has_less():
    flat, drum = (TyreMap.load("Tyre1", surface=surface) for surface in ("flat", "drum"))
    for quantity in ("cornering_stiffness", "relaxation_length"):
        shares = [
            getattr(drum.at(load=load, pressure=bar * 1e5), quantity)
            / getattr(flat.at(load=load, pressure=bar * 1e5), quantity)
            for load in (340.0, 400.0, 490.0)
            for bar in (3.5, 5.5, 7.5)
        ]
        assert 1 - np.mean(shares) == pytest.approx(0.13, abs=0.005)
