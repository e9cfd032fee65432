"""What other programs get: control systems, xarray datasets, parameter files."""

import numpy as np
import pytest
from built import linear
from eigenvalue_sets import assert_same_eigenvalues

from bicycle import load_bicycle, modes
from studies.cli import main


@pytest.fixture(scope="module")
def model():
    law, hinge = {"cornering_stiffness": 6000.0, "relaxation_length": 0.12}, {"joint_x": 0.8, "joint_z": -0.85}
    return linear(relaxation_length=law, front_compliance=hinge, camber_thrust={"camber_stiffness": 400.0})


@pytest.mark.parametrize("speed", [0.0, 5.0, 17.0])
def test_control_round_trip(model, speed):
    every = list(model.inputs)
    system = model.to_control(speed, inputs=every)
    assert (system.state_labels, system.input_labels) == (list(model.states), every)
    assert system.output_labels == list(model.outputs)
    state, inputs, outputs = model.matrices_at(speed)
    for theirs, ours in ((system.A, state), (system.B, inputs), (system.C, outputs)):
        assert np.array_equal(theirs, ours)
    expected = model.eigenvalues(speed)
    assert_same_eigenvalues(system.poles(), expected, atol=1e-10 * np.abs(expected).max())
    for omega in (0.3, 6.0, 45.0):
        gain = outputs @ np.linalg.solve(1j * omega * np.eye(len(state)) - state, inputs)
        assert np.allclose(system(1j * omega), gain, rtol=1e-9, atol=1e-12 * np.abs(gain).max())


@pytest.mark.parametrize(("speed", "name"), [
    (0.0, "bicycle at 0 m/s"), (6, "bicycle at 6 m/s"), (5.5, "bicycle at 5,5 m/s"), (7.25, "bicycle at 7,25 m/s"),
    (1 / 3, "bicycle at 0,333333 m/s"), (np.float64(1e-5), "bicycle at 1e-05 m/s"),
])  # fmt: skip
def test_control_at_any_speed_has_a_name_that_connects(model, speed, name):
    """control reads ``system.signal`` at the first dot, so a system's name must have none."""
    control = pytest.importorskip("control")
    system = model.to_control(speed, inputs=["steer_torque"], outputs=["lean_rate", "steer"])
    assert system.name == name
    gain = control.tf([3.0], [1.0], inputs=["e"], outputs=["torque"], name="rider")
    loop = control.interconnect(
        [system, gain],
        connections=[[f"{name}.steer_torque", "rider.torque"], ["rider.e", f"-{name}.lean_rate"]],
        inplist=["rider.e"], outlist=[f"{name}.steer"],
    )  # fmt: skip
    state, torque, rates = system.A, system.B, system.C[[0]]
    closed = state - 3 * torque @ rates
    response = system.C[[1]] @ np.linalg.solve(5j * np.eye(len(state)) - closed, 3 * torque)
    assert loop(5j) == pytest.approx(response.item(), rel=1e-9)


def test_modes_as_dataset(model):
    pytest.importorskip("xarray")
    found = modes(model, [3.0, 6.0, 9.0])
    data = found.to_xarray()
    assert data.sizes == {"mode": len(found.names), "speed": 3, "root": 2}
    assert data["speed"].attrs["units"] == "m/s"
    assert data["frequency"].attrs["units"] == "Hz"
    pair = data["eigenvalue"].sel(mode="wobble", speed=6.0)[0].item()
    assert pair == found.branch("wobble")[1, 0]
    assert data["frequency"].sel(mode="wobble", speed=6.0).item() == pytest.approx(pair.imag / (2 * np.pi))
    between = modes(model, [5.5, 6.25]).to_xarray()
    assert between.sel(speed=5.5)["eigenvalue"].shape == (len(found.names), 2)
    assert data["damping_ratio"].sel(mode="wobble", speed=6.0).item() == pytest.approx(-pair.real / abs(pair))
    assert data.attrs["effects"] == "camber_thrust, front_compliance, relaxation_length"


@pytest.mark.parametrize("ending", ["toml", "yml", "yaml", "txt"])
@pytest.mark.parametrize("name", ["benchmark", "pista", "pista_charlie_drops"])
def test_convert_keeps_every_digit(name, ending, tmp_path, capsys):
    target = tmp_path / f"{name}.{ending}"
    main(["convert", name, "--to", str(target)])
    original, written = load_bicycle(name), load_bicycle(target)
    assert dict(written.values) == dict(original.values)
    shown = capsys.readouterr()
    assert f"{len(original.values)} parameters" in shown.out
    assert (written.sd, written.source, written.description) == (original.sd, original.source, original.description)
    assert f"sd of {len(original.sd)}" in shown.out or not original.sd


@pytest.mark.parametrize(("arguments", "words"), [
    (["benchmark", "--to", "{}/b.csv"], "the ending '.csv' is not known; write .toml, .yml, .yaml, .txt"),
    (["benchmark", "--to", "{}/there.toml"], "there.toml exists; give --force to overwrite it or another name"),
    (["benchmrk", "--to", "{}/b.toml"], "unknown bicycle 'benchmrk'; did you mean 'benchmark'"),
])  # fmt: skip
def test_refused_conversions(arguments, words, tmp_path, refused):
    (tmp_path / "there.toml").write_text("mine")
    assert words in refused("convert", *(a.format(tmp_path) for a in arguments))
    assert (tmp_path / "there.toml").read_text() == "mine"
