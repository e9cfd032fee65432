"""A standing bicycle, its weave and wobble under way and its tyre on a rig as one measurement (synthetic).

Each part has equations of its own: finite rotations of rigid bodies (standing), those of the blind test (modes), and
stiffnesses in proportion to the load (tyre).
"""

import math

import numpy as np
import pytest

from bicycle import load_bicycle
from bicycle.parameters import hinge_at
from studies.diagnosis import read_measurement
from studies.inference import fit
from tests.shared.refusals import refuses
from tests.validation.blind.closing import build
from tests.validation.blind.motion import shapes
from tests.validation.standing_bench import Stand

PISTA = load_bicycle("pista")
STAND = Stand(PISTA.values, 3500.0, 7.0, 0.31)
PER_LOAD, LENGTH = 12.0, 0.1  # 1/rad, m: the true tyre
STEM = 0.6  # m above the hub
HEAD = """kind = "joint"
bicycle = "pista"
[effects.relaxation_length]
cornering_stiffness = {{rear = {}, front = {}}}
relaxation_length = 0.1
[uncertainty.relaxation_length]
cornering_stiffness = 500.0
relaxation_length = 0.01
"""
PARTS = {
    "stand": """[[part]]
name = "stand"
kind = "standing"
[part.standing]
held = "saddle and bottom bracket"
vibrations = "taps.csv"
stem_above_hub_m = 0.6
""",
    "modes": '[[part]]\nname = "modes"\nkind = "modal"\n[part.modal]\ntable = "modes.csv"\n',
    "rig": '[[part]]\nname = "rig"\nkind = "rig"\n[part.rig]\ntyre = "tyre.csv"\npressure_bar = 5.0\n',
}


def write_taps(folder):
    hertz, ratio, (stem,) = STAND.vibration([(0.0, False), (STEM, False)])
    head = "frequency_Hz,frequency_sd_Hz,damping_ratio,damping_ratio_sd,stem_over_hub,stem_over_hub_sd"
    row = f"{hertz:.5f},0.01,{ratio:.6f},0.001,{stem:.5f},0.005"
    (folder / "taps.csv").write_text(f"{head}\n{row}\n")


def write_modes(folder):
    x, z = hinge_at(PISTA.values, STAND.height)
    rear, front = (PER_LOAD * load for load in PISTA.static_loads)
    law = {"cornering_stiffness": {"rear": rear, "front": front}, "relaxation_length": LENGTH}
    hinge = {"stiffness": STAND.stiffness, "damping": STAND.damping, "joint_x": float(x), "joint_z": float(z)}
    machine = build(dict(PISTA.values), {"relaxation_length": law, "front_compliance": hinge})
    lines = ["speed_m_s,mode,real_1_s,imag_rad_s,real_sd_1_s,imag_sd_rad_s"]
    for speed in (5.0, 6.0, 7.0, 8.0):
        for name, shape in shapes(machine, speed).items():
            lines.append(f"{speed},{name},{shape.root.real:.6f},{abs(shape.root.imag):.6f},0.1,0.1")
    (folder / "modes.csv").write_text("\n".join(lines) + "\n")


def write_tyre(folder):
    head = "load_N,pressure_bar,cornering_stiffness_N_per_deg,lateral_stiffness_N_per_mm"
    rows = [head + ",cornering_stiffness_sd_N_per_deg,lateral_stiffness_sd_N_per_mm"]
    for load in (20, 40, 60, 80, 100, 120):
        for bar in (4.0, 6.0):
            c, k = math.radians(PER_LOAD * load), PER_LOAD * load / LENGTH / 1e3
            rows.append(f"{load},{bar},{c:.5f},{k:.5f},{0.01 * c:.5f},{0.01 * k:.5f}")
    (folder / "tyre.csv").write_text("\n".join(rows) + "\n")
    (folder / "tyre.toml").write_text('tyre = "Example"\nsurface = "flat"\nsource = "made up"\nsynthetic = true\n')


def measurement(folder, *names):
    """A joint measurement of these parts; the stated tyre is 10 % too stiff."""
    write_taps(folder)
    write_modes(folder)
    write_tyre(folder)
    head = HEAD.format(*(1.1 * PER_LOAD * load for load in PISTA.static_loads))
    (folder / "joint.toml").write_text(head + "".join(PARTS[name] for name in names))
    return read_measurement(folder / "joint.toml").prepare()


def found_in(kind):
    """Fit of one hinge of the front: values and sd by parameter."""
    (front,) = (c for c in kind.candidates if c.identifier == "front_compliance")
    final = fit(kind, (front,))
    sd = dict(zip((u.name for u in final.unknowns), np.sqrt(np.diag(final.covariance)), strict=True))
    return kind.corrected_model(final).parameters, sd, final


def test_all_parts_share_front_and_tyre(tmp_path):
    values, sd, final = found_in(measurement(tmp_path, "stand", "modes", "rig"))
    assert values["front_compliance.stiffness"] == pytest.approx(3500.0, rel=0.02)
    assert values["front_compliance.damping"] == pytest.approx(7.0, rel=0.03)
    key = "relaxation_length.cornering_stiffness.front"
    place = [u.name for u in final.unknowns].index(key)
    true = PER_LOAD * PISTA.static_loads[1]
    assert final.theta[place] == pytest.approx(true, rel=0.02)
    without, wider, _ = found_in(measurement(tmp_path, "modes", "rig"))
    assert without["front_compliance.stiffness"] == pytest.approx(3500.0, rel=0.2)
    assert sd["damping"] < 0.8 * wider["damping"]


def test_errors_of_the_hold_belong_to_the_part(tmp_path):
    kind = measurement(tmp_path, "stand", "modes")
    names = {c.identifier for c in kind.candidates}
    assert "stand/support" in names
    assert kind.refused["rear_compliance"]


def test_a_rider_who_sat_on_a_bicycle_without_one_is_refused(tmp_path):
    write_taps(tmp_path)
    write_modes(tmp_path)
    head = HEAD.format(*(PER_LOAD * load for load in PISTA.static_loads))
    seated = PARTS["stand"].replace("saddle and bottom bracket", "rider seated")
    (tmp_path / "joint.toml").write_text(head + seated + PARTS["modes"])
    joint = read_measurement(tmp_path / "joint.toml")
    refuses("a rider sat on the saddle, and the bicycle has none: mB", joint.prepare)
