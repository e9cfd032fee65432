"""Rear triangle and wheel in deflections of a standing bicycle: they act where the hold allows it.

Right are closed forms: a hinge of stiffness k at a distance a from the load and b from the gauge deflects by F a b / k,
hinges one after the other add, and so do rim and spokes under a load at the rim, F / K.
"""

import math

import pytest

from bicycle import load_bicycle
from studies.diagnosis import read_measurement
from studies.inference import fit

PISTA = load_bicycle("pista")
FORCE, FRONT, HINGE = 98.1, 4200.0, 0.31  # N, N m/rad, m above the hub
REAR, REAR_HEIGHT = 12000.0, 0.3  # N m/rad, m above the ground: a level axis
SPOKES = 60e3  # N/m
RIM = -0.32  # m above the hub
LAW = "[effects.relaxation_length]\ncornering_stiffness = 8000.0\nrelaxation_length = 0.1\n"


def deflection(loaded, read, *, on_frame=False, rear=math.inf, spokes=math.inf):
    """Deflection in mm."""
    rise = math.cos(PISTA["lam"])
    levers = [PISTA["rF"] + above * rise - REAR_HEIGHT for above in (loaded, read)]
    way = levers[0] * levers[1] / rear
    if not on_frame:
        way += (HINGE - loaded) * (HINGE - read) / FRONT
    if loaded == read == RIM:
        way += 1 / spokes
    return 1000 * FORCE * way


def measurement(folder, rows, held, head="", **shown):
    """Read deflections of (load, gauge, part)."""
    lines = ["force_N,force_above_hub_m,read_above_hub_m,read_on,deflection_mm,deflection_sd_mm"]
    for loaded, read, on in rows:
        way = deflection(loaded, read, on_frame=on == "frame", **shown)
        lines.append(f"{FORCE},{loaded},{read},{on},{way!r},0.01")
    (folder / "readings.csv").write_text("\n".join(lines) + "\n")
    text = f'kind = "standing"\nbicycle = "pista"\n{head}[standing]\nheld = "{held}"\npose = "on its side"\n'
    (folder / "standing.toml").write_text(text + 'deflections = "readings.csv"\n')
    return read_measurement(folder / "standing.toml").prepare()


def fitted(kind, *names):
    """Parameters of the model with these effects, fitted."""
    chosen = {c.identifier: c for c in kind.candidates}
    return kind.corrected_model(fit(kind, tuple(chosen[name] for name in names))).parameters


FRONT_ROWS = [(RIM, 0.0, "wheel"), (RIM, 0.6, "stem"), (0.0, 0.0, "wheel")]


@pytest.mark.parametrize("held", ["dropouts", "trainer"])
def test_the_rear_triangle_acts_where_the_axle_is_held(tmp_path, held):
    rows = [*FRONT_ROWS, (RIM, 0.55, "frame"), (0.0, 0.55, "frame"), (0.6, 0.55, "frame")]
    head = f"[candidates.rear_compliance]\njoint_x = 0.42\njoint_z = {-REAR_HEIGHT}\naxis_tilt = 0.0\n"
    kind = measurement(tmp_path, rows, held, head, rear=REAR)
    found = fitted(kind, "front_compliance", "rear_compliance")
    assert found["rear_compliance.stiffness"] == pytest.approx(REAR, rel=0.03)
    assert found["front_compliance.stiffness"] == pytest.approx(FRONT, rel=0.03)


def test_rim_and_spokes_act_where_the_rim_is_read_under_a_weight_at_the_rim(tmp_path):
    rows = [*FRONT_ROWS, (RIM, RIM, "wheel")]
    kind = measurement(tmp_path, rows, "saddle and bottom bracket", LAW, spokes=SPOKES)
    found = fitted(kind, "front_compliance", "wheel_compliance")
    assert found["wheel_compliance.stiffness.front"] == pytest.approx(SPOKES, rel=0.1)
    assert found["front_compliance.stiffness"] == pytest.approx(FRONT, rel=0.03)


def test_what_does_not_act_is_refused_with_its_reason(tmp_path):
    kind = measurement(tmp_path, FRONT_ROWS, "saddle and bottom bracket", LAW)
    assert not {"rear_compliance", "wheel_compliance", "rider_saddle"} & {c.identifier for c in kind.candidates}
    why = kind.refused
    assert why["rear_compliance"] == (
        "the main frame was held (saddle and bottom bracket): nothing loads the rear triangle"
    )
    assert why["wheel_compliance"].startswith("no deflection was read at the rim under a weight at the rim")
    assert why["rider_saddle"] == "no rider: the rear frame was held (saddle and bottom bracket)"


def test_without_a_tyre_that_lags_a_wheel_is_refused_for_the_model(tmp_path):
    kind = measurement(tmp_path, [*FRONT_ROWS, (RIM, RIM, "wheel")], "saddle and bottom bracket")
    assert kind.refused["wheel_compliance"].startswith("needs a lagged force")


def test_a_wheel_of_the_base_model_gives_way_as_well(tmp_path):
    """What the base model already has is no candidate, and is in the front frame's numbers."""
    head = LAW + f"[effects.wheel_compliance]\nstiffness = {SPOKES}\n"
    kind = measurement(tmp_path, [*FRONT_ROWS, (RIM, RIM, "wheel")], "saddle and bottom bracket", head, spokes=SPOKES)
    found = fitted(kind, "front_compliance")
    assert found["front_compliance.stiffness"] == pytest.approx(FRONT, rel=0.01)
