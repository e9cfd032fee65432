"""Names that users' models once had wrong: a wobble called rear_tyre, a wobble of bicycles that roll without slip."""

import numpy as np
import pytest
from built import built

from bicycle import Bicycle, Model, load_bicycle, modes
from bicycle.model import read_model
from bicycle.stability import critical_speeds
from studies.cli import main
from tyre.ground import InputError

TWELVE_HERTZ = """bicycle = "benchmark"
[effects.relaxation_length]
cornering_stiffness = 8279
relaxation_length = 0.142
[effects.camber_thrust]
camber_stiffness = 474.3
lag_share = 1.0
"""


def test_a_demand_on_wobble_binds_the_root_that_was_called_rear_tyre(tmp_path, monkeypatch, capsys):
    """From 39.4 m/s on the 12 Hz pair grows, so a design must change the model and end where that pair is damped."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "model.toml").write_text(TWELVE_HERTZ)
    main(["design", "model.toml", "--keep", "wobble", "stable", "--from", "3", "--up-to", "45",
          "--vary", "relaxation_length.relaxation_length", "--out", "better.toml"])  # fmt: skip
    assert "active constraint: wobble at 45 m/s (12." in capsys.readouterr().out
    better = read_model(tmp_path / "better.toml").linear_model()
    fast = better.eigenvalues(np.linspace(30.0, 45.0, 61))
    assert fast[(fast.imag > 2 * np.pi * 8)].real.max() < 0


COMMANDS = "critical", "modes --speeds 5:45:5", "sensitivity --mode wobble --speed 40", "uncertainty --samples 20"


@pytest.mark.parametrize("words", COMMANDS)
def test_commands_tell_where_modes_exchange_character(words, tmp_path, monkeypatch, capsys):
    """The 12 Hz pair was a tyre's at low speed, so somewhere below 39.4 m/s it becomes wobble."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "model.toml").write_text(TWELVE_HERTZ)
    command, *options = words.split()
    main([command, "model.toml", *options])
    (line,) = [line for line in capsys.readouterr().out.splitlines() if " veer; " in line]
    assert line.endswith("m/s: rear_tyre and wobble veer; their labels swap")
    assert 0 < float(line.split()[0]) < 39.4


@pytest.mark.parametrize("cornering", [8500.0, 10000.0, 12000.0])
def test_the_growing_pair_about_the_steer_axis_is_wobble_on_stiff_tyres_too(cornering):
    tyre = {"cornering_stiffness": cornering, "relaxation_length": 0.14}
    model = built(relaxation_length=tyre, camber_thrust={"camber_stiffness": 474.3, "lag_share": 1.0})
    (last,) = [c for c in critical_speeds(model) if c.speed > 20 and c.destabilising]
    assert last.mode == "wobble"
    assert last.frequency_hz == pytest.approx(12.02 * np.sqrt(cornering / 8279), rel=0.05)  # C x trail is its spring
    assert modes(model, [last.speed]).shape("wobble").magnitude["steer"][0] == pytest.approx(1.0)


RANGES = {  # lam, c: rear-steer-like, little trail ahead of a raked axis, much trail, behind
    "rear steer": ((-0.5, 0.0), (-0.15, -0.02)), "reversed": ((0.0, 0.5), (-0.1, 0.0)),
    "long trail": ((0.0, 0.5), (0.15, 0.5)), "tilted back": ((-0.3, 0.0), (0.0, 0.1)),
}  # fmt: skip


@pytest.mark.parametrize("which", RANGES)
def test_bicycles_that_roll_without_slip_have_the_modes_of_lean_and_steer_only(which):
    rng, made = np.random.default_rng(1), 0
    tilt, trail = RANGES[which]
    while made < 30:
        changes = {
            "lam": rng.uniform(*tilt), "c": rng.uniform(*trail), "xB": rng.uniform(0.25, 0.75),
            "mB": rng.uniform(10.0, 100.0), "xH": rng.uniform(0.8, 1.05),
        }  # fmt: skip
        try:
            found = modes(Model(Bicycle("odd", load_bicycle("benchmark").values | changes)), [1.0, 4.0, 8.0, 15.0])
        except InputError:
            continue
        made += 1
        assert {part for name in found.names for part in name.split("+")} <= {"weave", "capsize", "castering"}
