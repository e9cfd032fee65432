"""``velotyre simulate --sensors``: the file, the recording that it writes, and what is refused."""

import pytest

from bicycle.identification import read_run
from studies.cli import main
from studies.motion import Sensor, read_sensors
from tyre.ground import InputError

pytestmark = pytest.mark.usefixtures("no_pictures")
FILE = "rate_hz = 50\n[channels.roll_rate_rad_s]\nnoise_sd = 0.01\n[channels.steer_rad]\n"
RIDE = ["--speed", "5", "--duration", "1", "--initial", "lean_rate=0.3"]


@pytest.fixture
def file(tmp_path):
    (tmp_path / "sensors.toml").write_text(FILE)
    return tmp_path / "sensors.toml"


def simulate(*options):
    main(["simulate", "benchmark", *RIDE, *map(str, options)])


def test_the_file_is_read(file):
    found = read_sensors(file)
    assert found.rate_hz == 50
    assert found.channels == {"roll_rate_rad_s": Sensor(noise_sd=0.01), "steer_rad": Sensor()}


@pytest.mark.parametrize(("content", "words"), [
    ("[channels.steer_rad]", "rate_hz is missing; give the samples per second, rate_hz = 100"),
    ("rate_hz = 100", "no channels; write .channels.roll_rate_rad_s. and the keys below it"),
    ("rate_hz = 1\n[channels.steer_rad]", "rate_hz = 1 must be the samples per second, 2.5 to 100000 Hz"),
    ("rate_hz = 100\n[channels]", "no motion is recorded; add one of roll_rate_rad_s, lean_rad"),
    ("rate_hz = 100\n[channels.steer_torque_N_m]", "no motion is recorded"),
    ("rate_hz = 100\n[channels.roll_rate]", "unknown channel 'roll_rate'; did you mean 'roll_rate_rad_s'"),
    ("rate_hz = 100\n[channels.lateral_acceleration_m_s2]", "unknown channel 'lateral_acceleration_m_s2'"),
    ("rate_hz = 100\n[channels.steer_rad]\nnoise = 1", "unknown key 'noise'; did you mean 'noise_sd'"),
    ("rate_hz = 100\nseed = 1\n[channels.steer_rad]", "unknown key 'seed'"),
    ("rate_hz = 100\n[channels.steer_rad]\nnoise_sd = -1", "noise_sd = -1 must be a standard deviation >= 0"),
    ("rate_hz = 100\n[channels.steer_rad]\ncorrelation = 1", "must be the correlation of neighbouring samples"),
    ("rate_hz = 100\n[channels.steer_rad]\ndelay_s = -0.1", "delay_s = -0.1 must be a time from 0 to 1 s"),
    ("rate_hz = 100\n[channels.steer_rad]\nlow_pass_hz = 0", "low_pass_hz = 0 must be a frequency above 0 in Hz"),
    ("rate_hz = 100\n[channels.steer_rad]\nresolution = 0", "resolution = 0 must be a step above 0"),
    ("rate_hz = 100\n[channels.steer_rad]\nscale_error = -1", "must be reading over truth minus one"),
    ("rate_hz = 100\n[channels.steer_rad]\noffset = 'a'", "offset = 'a' must be a finite number"),
    (
        "rate_hz = 100\n[channels.steer_rad]\ncorrelation = 0.1\nbandwidth_hz = 3",
        "correlation and bandwidth_hz give the same; keep one",
    ),
])  # fmt: skip
def test_refused_files(content, words, file):
    file.write_text(content)
    with pytest.raises(InputError, match=f"sensors.toml: .*{words}"):
        read_sensors(file)


def test_the_recording_is_labelled_and_read(file, tmp_path, capsys):
    simulate("--sensors", file, "--noise", "--seed", 4, "--out", tmp_path / "a")
    assert "recording.csv" in capsys.readouterr().out
    text = (tmp_path / "a" / "recording.csv").read_text()
    assert text.startswith("# SYNTHETIC: computed by velotyre simulate and not measured: benchmark linear at 5 m/s")
    assert "noise seed 4\ntime_s,roll_rate_rad_s,steer_rad\n" in text
    assert len(read_run(tmp_path / "a" / "recording.csv", 5.0).time) == 51
    simulate("--sensors", file, "--noise", "--seed", 4, "--out", tmp_path / "b")
    assert (tmp_path / "b" / "recording.csv").read_text() == text
    simulate("--sensors", file, "--noise", "--out", tmp_path / "b")  # its own seed, which repeats it
    drawn = (tmp_path / "b" / "recording.csv").read_text()
    seed = drawn.partition("\n")[0].split()[-1]
    simulate("--sensors", file, "--noise", "--seed", seed, "--out", tmp_path / "a")
    assert (tmp_path / "a" / "recording.csv").read_text() == drawn != text
    simulate("--sensors", file, "--out", tmp_path / "a")
    assert "and no noise\n" in (tmp_path / "a" / "recording.csv").read_text()


def test_the_motion_on_saturating_tyres_is_recorded(file, tmp_path, capsys):
    model = tmp_path / "m.toml"
    model.write_text('bicycle = "benchmark"\n[effects.side_slip]\ncornering_stiffness = 6000.0\n')
    options = ["--peak-factor", "0.1", "--input", "lateral_push:pulse:60@0+0.3", "--sensors", file]
    runs = []
    for more in (["--nonlinear"], []):
        kept = options if more else options[2:]
        main(list(map(str, ["simulate", model, *RIDE, *kept, *more, "--out", tmp_path / "o"])))
        assert "the input lateral_push is not recorded" in capsys.readouterr().err
        runs.append(read_run(tmp_path / "o" / "recording.csv", 5.0).channels["roll_rate_rad_s"])
    both = min(map(len, runs))  # one may fall before the other
    assert abs(runs[0][:both] - runs[1][:both]).max() > 0.01


@pytest.mark.parametrize(("options", "words"), [
    (["--noise"], "--noise is of sensors; add --sensors FILE.toml"),
    (["--seed", "3"], "--seed 3 is of the noise; add --noise or leave --seed out"),
    (["--sensors", "absent.toml"], "absent.toml: no such sensor file"),
    (["--sensors", "FILE", "--step", "0.05"], "step = 0.05 s is longer than the 0.02 s between samples"),
    (["--sensors", "FILE", "--duration", "0.2"], "11 samples at 50 Hz until 0.2 s are too few"),
])  # fmt: skip
def test_refused_options(options, words, file, tmp_path, refused):
    given = [str(file) if option == "FILE" else option for option in options]
    assert words in refused("simulate", "benchmark", *RIDE, *given, "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_sensors_need_a_motion(file, tmp_path, refused):
    options = ["--speed", "5", "--frequency-response", "steer_torque", "--sensors", file, "--out", tmp_path / "out"]
    assert "nothing moves the bicycle; give --initial" in refused("simulate", "benchmark", *options)


def test_the_example_records_as_it_is(tmp_path, monkeypatch, refused, printed):
    monkeypatch.chdir(tmp_path)
    assert "velotyre simulate benchmark" in printed("new", "sensors.toml", "--kind", "sensors")
    simulate("--sensors", "sensors.toml", "--noise", "--out", "ride")
    assert read_sensors(tmp_path / "sensors.toml").channels["steer_rad"].resolution == 0.0015
    assert "--tyre is of a model file" in refused("new", "b.toml", "--kind", "sensors", "--tyre", "Tyre2")
    assert "exists; give --force" in refused("new", "sensors.toml", "--kind", "sensors")
