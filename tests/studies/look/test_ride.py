"""A ride without an impulse: `look` names the command that gives its wobble, and drafts a file for its spectra."""

import shlex

import numpy as np
import pytest
import scipy

from studies.cli import main
from studies.diagnosis import RideSpectra, read_measurement
from studies.look import look

RATE = 50.0  # Hz
WOBBLE = complex(-1.5, 37.7)  # 1/s


def ride(path, seconds, speed=None):
    """Write the rates of a wobble that noise drives, deg/s, and if it was recorded the ``speed``, km/h."""
    rng, n = np.random.default_rng(2), int(seconds * RATE)
    pole = np.exp(WOBBLE / RATE)
    driven = scipy.signal.lfilter([1.0], [1.0, -2 * pole.real, abs(pole) ** 2], rng.normal(0, 1, n))
    driven *= 8 / driven.std()
    columns = {"t [s]": np.arange(n) / RATE, "GyrX [deg/s]": 0.2 * driven + rng.normal(0, 1, n)}
    columns["GyrZ [deg/s]"] = driven + rng.normal(0, 1, n)
    if speed is not None:
        columns["speed [km/h]"] = speed + rng.normal(0, 0.1, n)
    table = np.column_stack([*columns.values()])
    np.savetxt(path, table, fmt="%.4f", delimiter=",", header=",".join(columns), comments="")
    return path


def of_ride(recording):
    (use,) = [use for use in recording.uses if use.name.startswith("ride")]
    return use


@pytest.mark.parametrize(("speed", "at"), [(None, "@SPEED"), (25.0, "")])
def test_the_command_of_a_ride_gives_its_wobble(tmp_path, capsys, no_pictures, speed, at):
    path = ride(tmp_path / "ride.csv", 80, speed)
    main(["look", str(path), "--out", str(tmp_path / "d")])
    shown = capsys.readouterr().out
    specified = "" if speed else "; specify the forward speed in m/s, after @"
    assert f"ride (wobble, spectra): usable{specified}\n" in shown
    (command,) = [line.partition("velotyre ")[2] for line in shown.splitlines() if " --ride " in line]
    assert command.startswith(f"modal {shlex.quote(f'{path}{at}')} --channels ")
    command = command.replace("@SPEED", "@6.94").replace("wobble.csv", str(tmp_path / "wobble.csv"))
    main(shlex.split(command))
    row = np.genfromtxt(tmp_path / "wobble.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    assert row["mode"] == "wobble"
    assert row["speed_m_s"] == pytest.approx(6.94, abs=0.02)
    assert row["imag_rad_s"] == pytest.approx(WOBBLE.imag, abs=1.0)
    assert f"{row['imag_rad_s'] / (2 * np.pi):.3g} Hz, decays with" in shown


def test_the_draft_for_spectra_is_read_once_the_speed_is_filled_in(tmp_path, capsys, no_pictures):
    path = ride(tmp_path / "ride.csv", 30)
    main(["look", str(path), "--out", str(tmp_path / "d")])
    shown = capsys.readouterr().out
    assert "ride (wobble, spectra): usable; specify the bicycle and the forward speed" in shown
    assert "not used: wobble: the segments last 30 s together, and 60 s are needed" in shown
    assert f"next: velotyre diagnose {tmp_path / 'd' / 'ride.spectra.toml'} --out diagnosis" in shown
    draft = tmp_path / "d" / "ride.spectra.toml"
    text = draft.read_text().replace('bicycle = ""', 'bicycle = "rigid_rider"')
    draft.write_text(text.replace('speed_m_s = ""', "speed_m_s = 6.94"))
    kind = read_measurement(draft)
    assert isinstance(kind, RideSpectra)
    assert [spectrum.speed for spectrum in kind.rides.spectra] == [6.94]


def test_a_ride_that_is_too_short_says_how_long_it_must_be(tmp_path):
    use = of_ride(look(ride(tmp_path / "ride.csv", 12)))
    assert not use.usable
    assert use.reasons[0].startswith("no part of the ride is steady for 20 s; the longest lasts 12 s")
    assert use.remedies == ("wobble of a ride needs 60 s or more straight ahead at one speed; it needs no impulse",)


def test_a_speed_with_few_samples_is_stated_by_its_median(tmp_path):
    """As of a GPS, once a second: mapped, it would cut the motion into pieces of one sample."""
    path = ride(tmp_path / "ride.csv", 80, 25.0)
    head, *lines = path.read_text().splitlines()
    sparse = [line if k % 50 == 0 else line.rpartition(",")[0] + "," for k, line in enumerate(lines)]
    path.write_text("\n".join([head, *sparse]) + "\n")
    use = of_ride(look(path))
    assert "@6.9" in use.next_step
    assert "the speed has fewer samples than the motion: its median is stated for the whole ride" in use.events[0].notes
