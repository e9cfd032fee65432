"""A rider on the saddle, front wheel in the air: front frame and saddle from the same taps.

Right are the numbers of bicycles of finite rotations (:mod:`tests.validation.seated_bench`), which share no code with
the package.
"""

import math

import numpy as np
import pytest
from front_frame_command import refuse, run

from bicycle import load_bicycle
from bicycle.effects import effect_class
from bicycle.model import read_model
from bicycle.standing import Prediction, Readings, Tap
from studies.diagnosis import read_measurement
from studies.inference import fit
from tests.validation.seated_bench import Rider, Seated
from tyre.ground import read_toml

RIDDEN = load_bicycle("pista_charlie_drops")
PLACES = [(0.0, "front"), (0.6, "front"), (0.55, "frame")]
COLUMNS = "frequency_Hz,frequency_sd_Hz,damping_ratio,damping_ratio_sd"
RATIOS = (
    "stem_over_hub,stem_over_hub_imaginary,stem_over_hub_sd,frame_over_hub,frame_over_hub_imaginary,frame_over_hub_sd"
)
HEAD = """kind = "standing"
bicycle = "pista_charlie_drops"
[effects.rider_saddle]
mass = 78.745
x = 0.4776
z = -0.9862
Ixx = 6.82
Izz = 3.55
Ixz = 1.38
"""
TABLE = """[standing]
held = "rider seated"
vibrations = "taps.csv"
stem_above_hub_m = 0.6
frame_above_hub_m = 0.55
"""


def bicycle(stiffness=9000.0, damping=150.0):
    body = Rider(78.745, (0.4776, -0.9862), (6.82, 3.55, 1.38), 0.2, stiffness, damping)
    return Seated(RIDDEN.values, body, 4200.0, 3.0, 0.31, 1.2e5, 3e-4)


def write(folder, seated, *, which=(0, 1), ratios=True, head=HEAD, table=TABLE):
    """A measurement file with these of the two vibrations."""
    lines = [",".join([COLUMNS, "vibration", *([RATIOS] if ratios else [])])]
    for k in which:
        hertz, ratio, (stem, frame) = seated.vibrations(PLACES)[k]
        cells = [hertz, 1e-3 * hertz, ratio, 0.02 * ratio, k + 1]
        cells += [stem.real, stem.imag, 0.005, frame.real, frame.imag, 0.005] if ratios else []
        lines.append(",".join(f"{float(cell)!r}" for cell in cells))
    (folder / "taps.csv").write_text("\n".join(lines) + "\n")
    (folder / "seated.toml").write_text(head + table)
    return folder / "seated.toml"


def test_the_vibrations_give_front_and_saddle_with_their_covariance(tmp_path, capsys):
    target = tmp_path / "mine.toml"
    shown = run(capsys, write(tmp_path, bicycle(), which=(0, 1, 2)), "--out", target)
    assert shown.splitlines()[0] == "One hinge and a rider who yaws on the saddle explain the readings."
    model = read_model(target)
    right = {
        "front_compliance.stiffness": 4200.0,
        "front_compliance.damping": 3.0,
        "rider_saddle.stiffness": 9000.0,
        "rider_saddle.damping": 150.0,
    }
    for key, value in right.items():
        assert model.parameters[key] == pytest.approx(value, rel=0.02)
    sd = np.sqrt(np.diag(model.covariance.among(list(right)))) / list(right.values())
    assert (sd > 0.003).all()
    assert (sd < 0.1).all()
    assert model.covariance.among(["front_compliance.damping", "rider_saddle.stiffness"])[0, 1] != 0
    assert read_toml(target, "model file")["effects"]["rider_saddle"]["mass"] == 78.745


def test_one_vibration_leaves_the_saddle_open_and_says_so(tmp_path, capsys):
    """A rider softly seated hardly moves in the vibration of the front: the inertia alone is left."""
    shown = run(capsys, write(tmp_path, bicycle(3000.0, 80.0), which=(1,)))
    assert "The readings leave the stiffness of the saddle open: the assumed range is in the covariance." in shown
    assert "A second vibration, in which the frame yaws under the rider, measures it." in shown


def test_without_ratios_front_and_rider_cannot_be_told_apart(tmp_path, capsys):
    shown = run(capsys, write(tmp_path, bicycle(), which=(1,), ratios=False))
    assert "These readings do not separate the front frame from the seated rider." in shown


def test_what_a_seated_rider_cannot_be_is_refused(tmp_path, capsys):
    bare = write(tmp_path, bicycle(), head='kind = "standing"\nbicycle = "pista"\n')
    assert "a rider sat on the saddle, and the bicycle has none" in refuse(capsys, bare)
    side = write(tmp_path, bicycle(), table=TABLE + 'pose = "on its side"\n')
    assert 'held = "rider seated" and pose = "on its side" exclude each other' in refuse(capsys, side)


def test_diagnose_fits_front_and_rider_together(tmp_path):
    head = HEAD.replace("[effects.rider_saddle]", "[candidates.rider_saddle]")
    measurement = read_measurement(write(tmp_path, bicycle(), head=head)).prepare()
    chosen = {c.identifier: c for c in measurement.candidates}
    assert {"front_compliance", "rider_saddle", "rear_compliance"} <= set(chosen)
    assert "support" not in chosen
    together = tuple(chosen[name] for name in ("front_compliance", "rider_saddle", "rear_tyre"))
    found = measurement.corrected_model(fit(measurement, together)).parameters
    assert found["front_compliance.stiffness"] == pytest.approx(4200.0, rel=0.03)
    assert found["rider_saddle.stiffness"] == pytest.approx(9000.0, rel=0.1)
    assert found["rider_saddle.damping"] == pytest.approx(150.0, rel=0.1)


def test_frame_and_rider_are_two_inertias_with_a_spring_between():
    """Saddle above the rear contact, front rigid, no lean: f^2 = k (1/J1 + 1/J2), zeta = c/2 sqrt((1/J1 + 1/J2) / k).

    J1 and J2 are those of bicycle and rider about the vertical through the rear contact, by the parallel axes.
    """
    p = dict(RIDDEN.values)
    rider = p["mB"] * 0.9 * p["xB"] ** 2 + 0.8 * p["IBzz"]
    whole = p["IBzz"] + p["mB"] * p["xB"] ** 2 + p["IRxx"] + p["IHzz"] + p["mH"] * p["xH"] ** 2
    whole += p["IFxx"] + p["mF"] * p["w"] ** 2
    inverse = 1 / rider + 1 / (whole - rider)
    values = p | {"IBxx": 1e9, "front_compliance.stiffness": 1e9, "front_compliance.damping": 0.0}
    values |= {
        f"front_compliance.{key}": x for key, x in (("joint_x", 1.0), ("joint_z", -0.6), ("axis_tilt", p["lam"]))
    }
    of_rider = {"mass": p["mB"], "mass_share": 0.9, "x": p["xB"], "z": p["zB"], "Ixx": p["IBxx"], "Izz": p["IBzz"]}
    of_rider |= {"Ixz": p["IBxz"], "inertia_share": 0.8, "joint_x": 0.0, "stiffness": 9000.0, "damping": 150.0}
    values |= {f"rider_saddle.{key}": x for key, x in of_rider.items()}
    hertz = math.sqrt(9000.0 * inverse) / (2 * math.pi)
    readings = Readings((), (Tap("tap", hertz, 0.01),), seated=True)
    effects = (effect_class("front_compliance"), effect_class("rider_saddle"))
    found = Prediction(readings, effects, ridden=True)({key: np.array([x]) for key, x in values.items()})
    assert found[0] == pytest.approx([hertz, 75.0 * math.sqrt(inverse / 9000.0)], rel=1e-4)
