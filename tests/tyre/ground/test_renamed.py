"""An old name of the public API is refused with the new one, wherever a user writes it."""

import pytest

import velotyre as vt
from tyre.ground import InputError, new_name, unknown

MODEL = 'description = "own"\nbicycle = "benchmark"\n[effects.bar_bag]\nmass = 3.0\nx = 0.9\nz = -0.9\n'
TYRE = (
    'kind = "pacejka89"\n[[set]]\npressure_bar = 4\nside_force = [1.3, 0, 1000, 110, 0.7, 0, 0, -1, 0, 0, 0, 2, 0, 0]\n'
)


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (["ride", "benchmark"], "the command 'ride' is now called 'closed-loop'"),
        (["amplitude", "benchmark", "--kick", "steer"], "the option --kick is now called --impulse"),
        (["amplitude", "benchmark", "--friction", "0.3"], "the option --friction is now called --peak-factor"),
        (["simulate", "benchmark", "--friction", "0.3"], "the option --friction is now called --peak-factor"),
        (
            ["uncertainty", "benchmark", "--sd", "mB=2", "--output", "largest_growth_rate"],
            "the output 'largest_growth_rate' is now called 'max_growth_rate'",
        ),
        (
            ["uncertainty", "benchmark", "--sd", "mB=2", "--output", "smallest_damping_ratio"],
            "the output 'smallest_damping_ratio' is now called 'min_damping_ratio'",
        ),
        (
            ["simulate", "benchmark", "--speed", "5", "--input", "lateral_force:pulse:50@1+0.2", "--out", "runs"],
            "the input 'lateral_force' is now called 'lateral_push'",
        ),
        (["modes", "model.toml"], "the effect 'bar_bag' is now called 'handlebar_bag'"),
        (["modes", "benchmark", "--tyre", "tyre.toml"], "the key 'side_force' is now called 'lateral_force'"),
    ],
)
def test_a_command_names_the_successor(command, words, refused, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "model.toml").write_text(MODEL)
    (tmp_path / "tyre.toml").write_text(TYRE)
    assert words in refused(*command)


@pytest.mark.parametrize(
    ("use", "words"),
    [
        (lambda: vt.fit_pull_test, "'fit_lateral_stiffness'"),
        (lambda: vt.BarBag, "'HandlebarBag'"),
        (lambda: vt.effects.ResidualTorque, "'UnmodelledTorque'"),
    ],
)
def test_the_library_names_the_successor(use, words):
    with pytest.raises(AttributeError, match=f"it is now called {words}"):
        use()


def test_the_library_refuses_an_old_input():
    with pytest.raises(InputError, match="the input 'lateral_force' is now called 'lateral_push'"):
        vt.simulate("benchmark", speed=5.0, inputs={"lateral_force": 1.0})


@pytest.mark.parametrize(
    ("old", "allowed", "new"),
    [
        ("side_force_N", ["lateral_force_N"], "lateral_force_N"),
        ("front_side_force", ["front_lateral_force"], "front_lateral_force"),
        ("bar_bag.mass", ["handlebar_bag.mass"], "handlebar_bag.mass"),
        ("lateral_force", ["lateral_push"], "lateral_push"),  # of a rider's run; a tyre's force keeps the name
        ("side_force", ["lateral_push"], ""),  # never a name that is not allowed there
        ("sidecar", ["lateral_force"], ""),
    ],
)
def test_a_name_keeps_its_wheel_unit_and_parameter(old, allowed, new):
    assert new_name(old, allowed) == new
    assert ("is now called" in unknown("name", old, allowed)) == bool(new)
