"""The table [standing]: files, places, sensors, and what is refused in one line."""

import math

import numpy as np
import pytest

from bicycle import load_bicycle
from bicycle.standing import Place, read_standing
from tyre.ground import InputError

PISTA = load_bicycle("pista").values
HEAD = "force_N,force_above_hub_m,read_above_hub_m,deflection_mm,deflection_sd_mm"
ROWS = f"{HEAD}\n98.1,-0.334,0.0,5.65,0.05\n98.1,-0.334,0.6,-4.60,0.05\n"
TAPS = "frequency_Hz,frequency_sd_Hz,damping_ratio,damping_ratio_sd\n13.5,0.03,0.08,0.003\n"
HELD = {"held": "frame clamped"}


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "rows.csv").write_text(ROWS)
    (tmp_path / "taps.csv").write_text(TAPS)
    time = np.arange(400) / 400
    wave = np.where(time < 0.1, 0.0, np.exp(-2.5 * (time - 0.1)) * np.cos(2 * math.pi * 18 * (time - 0.1)))
    noise = 0.01 * np.random.default_rng(1).standard_normal((2, 400))
    lines = [f"{t:.4f},{a:.5f},{b:.5f}" for t, a, b in zip(time, wave + noise[0], -wave + noise[1], strict=True)]
    (tmp_path / "tap.csv").write_text("\n".join(["time_s,hub_lateral_m_s2,stem_lateral_m_s2", *lines, ""]))
    return tmp_path


def test_a_table_of_deflections(folder):
    found = read_standing({**HELD, "deflections": "rows.csv", "pose": "on its side"}, folder, PISTA)
    first, second = found.readings.deflections
    assert (first.force, first.value, first.sd) == (98.1, pytest.approx(5.65e-3), pytest.approx(5e-5))
    assert (first.loaded, first.read, second.read) == (Place(-0.334), Place(0.0), Place(0.6, "fork"))
    assert found.readings.on_side
    assert "weights are taken as right within 0.5 % (load_sd_percent)" in found.notes


def test_weights_words_and_the_frame(folder):
    rows = "load_kg,force_above_hub_m,read_above_hub_m,read_on,deflection_mm,deflection_sd_mm\n10,ground,axle,,5,0.1\n"
    (folder / "words.csv").write_text(f"{rows}10,ground,0.5,frame,0.1,0.05\n")
    found = read_standing({**HELD, "deflections": "words.csv", "load_sd_percent": 1.0}, folder, PISTA).readings
    assert found.deflections[0].force == pytest.approx(98.1)
    assert found.deflections[0].loaded.above_hub == pytest.approx(-PISTA["rF"] * math.cos(PISTA["lam"]))
    assert found.deflections[1].read == Place(0.5, "frame")
    assert found.reads_frame
    assert found.errors.load == pytest.approx(0.01)


def test_recordings_become_frequency_damping_and_signed_ratio(folder):
    content = {**HELD, "taps": ["tap.csv"], "stem_above_hub_m": 0.62}
    (tap,) = read_standing(content, folder, PISTA).readings.taps
    assert tap.frequency_hz == pytest.approx(math.hypot(2.5, 2 * math.pi * 18) / (2 * math.pi), rel=2e-3)
    assert tap.damping_ratio == pytest.approx(2.5 / math.hypot(2.5, 2 * math.pi * 18), rel=0.05)
    assert tap.ratios[0].value == pytest.approx(-1.0, abs=0.02)
    assert tap.ratios[0].read == Place(0.62, "fork")


@pytest.mark.parametrize(("content", "words"), [
    ({}, r"\[standing\]: held is missing; write what held the frame: saddle and bottom bracket"),
    ({"held": "my hands"}, "held = 'my hands' must be one of saddle and bottom bracket"),
    (HELD, "nothing was read; give deflections, taps or vibrations"),
    ({**HELD, "colour": "red"}, "unknown key 'colour'"),
    ({**HELD, "bar": "loose", "vibrations": "taps.csv"}, "bar = 'loose' must be strapped or free"),
    ({**HELD, "taps": "tap.csv"}, r"taps = 'tap.csv' must be a list of files"),
    ({**HELD, "taps": ["tap.csv"]}, "tap.csv: the place of the stem sensor is not given; write stem_above_hub_m"),
    ({**HELD, "taps": ["tap.csv", "tap.csv"], "stem_above_hub_m": 0.6}, "the same recording as tap.csv; keep one"),
    ({**HELD, "taps": ["tap.csv"], "stem_above_hub_m": 620}, "stem_above_hub_m = 620 must be a place in m"),
    ({**HELD, "place_sd_mm": -1, "vibrations": "taps.csv"}, "place_sd_mm = -1 must be a length from 0 to 100 mm"),
    ({**HELD, "with_mass": [{"taps": ["tap.csv"], "added_kg": 1.0}]}, "added_above_hub_m is missing"),
])  # fmt: skip
def test_a_wrong_table_is_refused(folder, content, words):
    with pytest.raises(InputError, match=words):
        read_standing(content, folder, PISTA)


@pytest.mark.parametrize(("name", "text", "words"), [
    ("rows.csv", ROWS.replace("98.1", "0", 1), "line 2: force_N = 0 deflects nothing; take the row out"),
    ("rows.csv", ROWS.replace("-0.334", "rim", 1), "line 2: force_above_hub_m = 'rim' must be m above the hub, or one"),
    ("rows.csv", ROWS.replace("force_N", "force_kN"), "unknown column 'force_kN'"),
    ("rows.csv", ROWS.replace("5.65", "5650"), "deflection_mm = 5650 must be a deflection in mm, up to 300"),
    ("rows.csv", ROWS.replace(",0.05", ",0"), "deflection_sd_mm = 0 must be a standard uncertainty in mm, above 0"),
    ("rows.csv", "read_on," + ROWS.replace("98.1", "saddle,98.1"), "read_on = 'saddle' must be one of wheel, fork"),
    ("taps.csv", TAPS.replace("13.5", "1350"), "frequency_Hz = 1350 must be a frequency in Hz, above 0 and up to 200"),
    ("taps.csv", TAPS.replace("0.03", "1e-9"), "frequency_sd_Hz = 1e-09 must be a standard uncertainty, 1e-5 or more"),
    ("taps.csv", TAPS.replace(",damping_ratio_sd", ",added_kg"), "needs the column"),
    ("tap.csv", "time_s,hub_lateral_m_s2\n0,1\n", "1 samples are too few for a vibration"),
])  # fmt: skip
def test_a_wrong_file_is_refused(folder, name, text, words):
    (folder / name).write_text(text)
    content = {"rows.csv": {"deflections": name}, "taps.csv": {"vibrations": name}, "tap.csv": {"taps": [name]}}[name]
    with pytest.raises(InputError, match=words):
        read_standing({**HELD, **content}, folder, PISTA)


def test_an_uneven_clock_and_a_tap_that_was_not_are_refused(folder):
    lines = (folder / "tap.csv").read_text().splitlines()
    (folder / "gap.csv").write_text("\n".join([*lines[:100], *lines[150:], ""]))
    content = {**HELD, "stem_above_hub_m": 0.62}
    with pytest.raises(InputError, match="time_s steps by .* where 0.0025 s is usual; resample to even steps"):
        read_standing({**content, "taps": ["gap.csv"]}, folder, PISTA)
    noise = np.random.default_rng(2).standard_normal(400)
    rows = [f"{k / 400:.4f},{x:.4f}" for k, x in enumerate(noise)]
    (folder / "noise.csv").write_text("\n".join(["time_s,hub_lateral_m_s2", *rows, ""]))
    with pytest.raises(InputError, match="noise.csv: .*; tap again, or leave the recording out"):
        read_standing({**content, "taps": ["noise.csv"]}, folder, PISTA)
