"""Kind hands of ``velotyre diagnose``: SYNTHETIC ring-downs of one oscillator whose numbers are written here."""

import math

import numpy as np
import pytest
from small_library import among

from bicycle import load_bicycle
from bicycle.model import read_model
from studies.cli import main
from studies.diagnosis import diagnose, model_text, read_measurement
from tyre.ground import InputError

BICYCLE = load_bicycle("pista_rider")
ARMS = {"inertia": 0.11, "stiffness": 6.0, "damping": 1.2}  # kg m^2, N m/rad, N m s/rad
SPRINGS = (40.0, 300.0)  # N m/rad
HEAD = "grip,spring_N_m_per_rad,frequency_Hz,frequency_sd_Hz,damping_ratio,damping_ratio_sd,amplitude_deg"
FILE = 'kind = "hands"\nbicycle = "pista_rider"\n[hands]\ntable = "hands.csv"\n'


def steering():
    """Inertia (kg m^2) and stiffness of the weight (N m/rad) about the steer axis, by hand."""
    p = BICYCLE.values
    axis = np.array([math.sin(p["lam"]), 0.0, math.cos(p["lam"])])
    foot = np.array([p["w"] + p["c"], 0.0, 0.0])
    fork = np.array([[p["IHxx"], 0, p["IHxz"]], [0, 0, 0], [p["IHxz"], 0, p["IHzz"]]])
    wheel = np.diag([p["IFxx"], 0, p["IFxx"]])
    inertia, weight = 0.0, 0.0
    for mass, x, z, tensor in ((p["mH"], p["xH"], p["zH"], fork), (p["mF"], p["w"], -p["rF"], wheel)):
        lever = np.cross(axis, np.array([x, 0.0, z]) - foot)[1]
        inertia += axis @ tensor @ axis + mass * lever**2
        weight -= mass * 9.81 * axis[0] * lever
    return inertia, weight


def rows(rng, hidden, *, friction=0.0, grip="loose"):
    """Three decays on each spring, at 3, 6 and 9 degrees; friction T damps by 4 T / (pi omega A)."""
    inertia, weight = steering()
    total = inertia + hidden.get("inertia", 0.0)
    for spring in SPRINGS:
        for degrees in (3.0, 6.0, 9.0):
            omega = math.sqrt((spring + hidden.get("stiffness", 0.0) + weight) / total)
            damping = hidden.get("damping", 0.0) + 4 * friction / (math.pi * omega * math.radians(degrees))
            hertz, ratio = omega / (2 * math.pi), damping / (2 * omega * total)
            sds = 0.01 * hertz, 0.05 * ratio + 1e-3
            seen = hertz + sds[0] * rng.standard_normal(), abs(ratio + sds[1] * rng.standard_normal())
            yield f"{grip},{spring},{seen[0]},{sds[0]},{seen[1]},{sds[1]},{degrees}"


def measured(folder, hidden, *, text=FILE, seed=1, **how):
    (folder / "hands.csv").write_text("\n".join([HEAD, *rows(np.random.default_rng([6114, seed]), hidden, **how), ""]))
    (folder / "MEASUREMENT.toml").write_text(text)
    return read_measurement(folder / "MEASUREMENT.toml")


def test_hands_are_named_and_written_into_the_corrected_model(tmp_path):
    found = diagnose(measured(tmp_path, ARMS))
    assert (found.verdict.verdict, found.verdict.equivalent) == ("named", ("rider_arms",))
    for name, (value, sd) in found.verdict.effects[0].parameters.items():
        assert abs(value - ARMS[name]) < 3 * sd
        assert sd < 0.5 * ARMS[name]
    (tmp_path / "model.toml").write_text(model_text(found))
    model = read_model(tmp_path / "model.toml")
    assert model.sd["rider_arms.damping"] == pytest.approx(found.verdict.effects[0].parameters["damping"][1], rel=0.2)


@pytest.mark.parametrize(
    ("hidden", "friction", "name"),
    [({"damping": 0.8}, 0.0, "steer_damper"), ({}, 0.2, "steer_friction")],
)
def test_other_causes_are_not_called_hands(hidden, friction, name, tmp_path):
    measurement = measured(tmp_path, hidden, friction=friction)
    found = among(measurement, ("rider_arms", "steer_damper", "steer_spring", "steer_friction")).verdict
    assert (found.verdict, found.equivalent) == ("named", (name,))
    value, sd = next(iter(found.effects[0].parameters.values()))
    assert abs(value - (friction or hidden["damping"])) < 3 * sd


def test_a_spring_beside_a_known_damper(tmp_path):
    text = FILE + "[effects.steer_damper]\ndamping = 0.8\n"
    measurement = measured(tmp_path, {"stiffness": 12.0, "damping": 0.8}, text=text)
    found = among(measurement, ("rider_arms", "steer_spring", "steer_friction")).verdict
    assert (found.verdict, found.equivalent) == ("named", ("steer_spring",))
    value, sd = found.effects[0].parameters["stiffness"]
    assert abs(value - 12.0) < 3 * sd


def test_a_free_handlebar_lacks_nothing(tmp_path):
    found = among(measured(tmp_path, {}), ("rider_arms", "steer_damper", "steer_friction")).verdict
    assert found.verdict == "none"


def test_a_bench_test_with_free_handlebar_takes_the_cables_from_the_hands(tmp_path):
    """Cables of 4 N m/rad: ring-downs alone call them hands, the free handlebar does not."""
    _, weight = steering()
    cables = 4.0  # N m/rad
    both = {**ARMS, "stiffness": ARMS["stiffness"] + cables}
    torques = [f"hold,lifted,{a},{(cables + weight) * a},0.02" for a in (-0.2, -0.1, 0.1, 0.2)]
    head = "test,condition,steer_rad,steer_torque_N_m,steer_torque_sd_N_m"
    (tmp_path / "bench.csv").write_text("\n".join([head, *torques, ""]))
    joint = 'kind = "joint"\nbicycle = "pista_rider"\n'
    for kind in ("hands", "bench"):
        joint += f'[[part]]\nname = "{kind}1"\nkind = "{kind}"\n[part.{kind}]\ntable = "{kind}.csv"\n'
    found = among(measured(tmp_path, both, text=joint), ("rider_arms", "steer_spring")).verdict
    assert found.verdict == "named"
    sizes = {effect.identifier: effect.parameters for effect in found.effects}
    for effect, truth in (("rider_arms", ARMS["stiffness"]), ("steer_spring", cables)):
        value, sd = sizes[effect]["stiffness"]
        assert abs(value - truth) < 3 * sd


def test_what_is_refused(tmp_path, capsys):
    measurement = measured(tmp_path, ARMS).prepare()
    assert "has no part in a steering that oscillates" in measurement.refused["front_compliance"]
    firm = [line.replace("loose", "firm") for line in (tmp_path / "hands.csv").read_text().splitlines()[1:]]
    (tmp_path / "hands.csv").write_text((tmp_path / "hands.csv").read_text() + "\n".join([*firm, ""]))
    with pytest.raises(InputError, match=r"the grips 'loose', 'firm'; each is a case of its own, write grip = "):
        read_measurement(tmp_path / "MEASUREMENT.toml")
    (tmp_path / "MEASUREMENT.toml").write_text(FILE + 'grip = "tight"\n')
    with pytest.raises(SystemExit):
        main(["diagnose", str(tmp_path / "MEASUREMENT.toml")])
    assert "'tight'" in capsys.readouterr().err
    (tmp_path / "MEASUREMENT.toml").write_text(FILE + 'grip = "firm"\n')
    assert len(read_measurement(tmp_path / "MEASUREMENT.toml").ring_downs) == 6
    text = "\n".join(line.rpartition(",")[0] for line in (tmp_path / "hands.csv").read_text().splitlines())
    (tmp_path / "hands.csv").write_text(text + "\n")
    assert "amplitude_deg" in read_measurement(tmp_path / "MEASUREMENT.toml").prepare().refused["steer_friction"]
