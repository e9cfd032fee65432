"""Judges of the names of modes that share nothing with the rules of naming: written before them and left alone since.

A small steer damper tells the wobble: of all pairs but the slowest, which is the weave, it moves that one most, because
wobble is an oscillation about the steer axis (Sharp 1971; Pacejka, Tire and Vehicle Dynamics, ch. 11). Derivatives are
differences of eigenvalues.
"""

from collections import Counter

import numpy as np
import pytest
from built import built

from bicycle import critical_speeds, load_bicycle, modes
from tyre.ground import InputError

DAMPER = 1e-4  # N m s/rad
SPEEDS = np.linspace(3.0, 30.0, 19)
HINGE = {"stiffness": 3000.0, "damping": 15.0, "joint_x": 0.8, "joint_z": -0.85}
RIDER = {"mass": 40.0, "x": 0.35, "z": -1.2, "Ixx": 1.0, "Izz": 0.5, "joint_z": -0.9, "stiffness": 1500.0}


def damped(bicycle, effects):
    """The model as it is, and with a little more steer damping."""
    damper = {"damping": effects.get("steer_damper", {}).get("damping", 0.0) + DAMPER}
    both = effects, effects | {"steer_damper": damper}
    return tuple(built(bicycle, **table).linear_model() for table in both)


def upper(model, speed):
    values = np.linalg.eigvals(model.matrices_at(speed)[0])
    return values[values.imag > 1e-9 * np.abs(values).max()]


def moved_most(models, speed):
    """Pair that a small steer damper moves most, the slowest pair left aside.

    None where that is not clear: without two pairs, where the two slowest are nearly as slow, where another pair is
    moved nearly as much, or where the slowest is moved twice as much.
    """
    before, after = (upper(model, speed) for model in models)
    if len(before) < 2 or len(after) != len(before):
        return None
    moved = np.abs(before[:, None] - after).min(1)
    slowest, size = np.abs(before).argmin(), np.abs(before)
    weave, moved[slowest] = moved[slowest], 0.0
    second = np.sort(moved)[-2]
    plain = 1.3 * size[slowest] <= np.delete(size, slowest).min()
    return before[moved.argmax()] if plain and moved.max() > max(1.3 * second, 0.5 * weave) else None


def random_bicycles(seed, count, **effects):
    """Packaged bicycles, all numbers off by up to 15 %, on random tyres."""
    rng = np.random.default_rng(seed)
    made = 0
    while made < count:
        base = load_bicycle(("benchmark", "pista_rider", "browser", "rigid_rider", "pista_charlie_drops")[made % 5])
        try:
            off = {key: x * (1 + rng.uniform(-0.15, 0.15)) for key, x in base.values.items() if key != "g"}
            bicycle = base.replace(**off)
            rear, front = (rng.uniform(8, 25) * load for load in bicycle.static_loads)
            stiffness = {"rear": rear, "front": front}
            tyre = {"cornering_stiffness": stiffness, "relaxation_length": rng.uniform(0.03, 0.25)}
            table = {"relaxation_length": tyre} | effects
            if rng.uniform() < 0.5:
                table["camber_thrust"] = {"camber_stiffness": rng.uniform(200, 600), "lag_share": rng.uniform()}
            built(bicycle, **table)
        except InputError:
            continue
        made += 1
        yield bicycle, table


def judged(seed, count, speeds=SPEEDS, **effects):
    """How often the pair that the damper moves most is called wobble, in doubt or plainly not; pairs in doubt."""
    told = Counter()
    for bicycle, table in random_bicycles(seed, count, **effects):
        models = damped(bicycle, table)
        found = modes(models[0], speeds)
        for k, speed in enumerate(speeds):
            named = [(name, z) for name, rows in found.branches.items() for z in rows[k] if z.imag > 0]
            told["pairs"] += len(named)
            told["in doubt"] += sum("+" in name for name, _ in named)
            pair = moved_most(models, speed)
            if pair is None:
                continue
            name = min(named, key=lambda one: abs(one[1] - pair))[0]
            told["points"] += 1
            told["agree"] += name.split("+")[0] == "wobble"
            told["otherwise"] += "wobble" not in name.split("+")
    return told


@pytest.mark.parametrize(("seed", "count", "effects"), [
    (20, 40, {}), (21, 20, {"front_compliance": HINGE}),
], ids=["eight states", "flexible front"])  # fmt: skip
def test_wobble_is_the_pair_that_a_steer_damper_moves_most(seed, count, effects):
    told = judged(seed, count, **effects)
    assert told["points"] > 0.5 * count * len(SPEEDS)
    assert told["agree"] >= 0.985 * told["points"], told
    assert told["otherwise"] <= 0.01 * told["points"], told
    assert told["in doubt"] <= 0.05 * told["pairs"], told


def test_the_case_of_twelve_hertz_is_wobble():
    tyre = {"cornering_stiffness": 8279.0, "relaxation_length": 0.142}
    camber = {"camber_stiffness": 474.3, "lag_share": 1.0}
    model = built(relaxation_length=tyre, camber_thrust=camber)
    (wobble,) = [c for c in critical_speeds(model) if c.speed > 30.0]
    assert (wobble.mode, wobble.direction) == ("wobble", "destabilising")
    assert wobble.speed == pytest.approx(39.392, abs=5e-4)
    assert wobble.frequency_hz == pytest.approx(12.02, abs=5e-3)
    shape = modes(model, [wobble.speed]).shape("wobble").magnitude
    assert shape["steer"][0] == pytest.approx(1.0)
    assert max(shape["yaw"][0], shape["lean"][0]) < 0.2


ODD = {
    "recumbent": {"w": 1.6, "lam": 0.35, "c": 0.06, "xB": 0.7, "zB": -0.55, "zH": -0.45, "xH": 1.45},
    "child": {"w": 0.75, "mB": 25.0, "IBxx": 1.2, "IByy": 1.4, "IBzz": 0.5, "IBxz": 0.3, "zB": -0.65, "rR": 0.2,
              "rF": 0.2, "xH": 0.65, "zH": -0.5, "xB": 0.25},
    "penny-farthing": {"w": 0.8, "rF": 0.7, "rR": 0.2, "zB": -1.5, "xB": 0.55, "c": 0.03, "lam": 0.15, "xH": 0.75,
                       "zH": -0.9, "IFxx": 0.8, "IFyy": 1.6, "mF": 6.0},
    "Long John": {"w": 1.95, "xB": 0.5, "xH": 1.8, "zH": -0.55},
    "reversed fork": {"c": -0.05},
    "rear steer": {"lam": -0.2, "c": -0.1, "xB": 0.7},
}  # fmt: skip
TYRE = {"relaxation_length": {"cornering_stiffness": {"rear": 8000.0, "front": 6000.0}, "relaxation_length": 0.1}}


@pytest.mark.parametrize("changes", ODD.values(), ids=ODD)
@pytest.mark.parametrize("seed", range(3))
def test_rigid_bicycles_that_roll_without_slip_have_no_wobble(changes, seed):
    rng = np.random.default_rng(seed)
    base = load_bicycle("benchmark").replace(**changes)
    moved = {key: x * (1 + 0.1 * rng.uniform(-1, 1) * (seed > 0)) for key, x in base.values.items() if key != "g"}
    found = modes(built(base.replace(**moved)), np.linspace(0.0, 15.0, 40))
    assert {part for name in found.names for part in name.split("+")} <= {"weave", "capsize", "castering"}


@pytest.mark.parametrize("changes", ODD.values(), ids=ODD)
def test_odd_bicycles_on_tyres_have_every_root_once_and_the_wobble_of_the_damper(changes):
    bicycle = load_bicycle("benchmark").replace(**changes)
    models = damped(bicycle, TYRE)
    speeds = np.linspace(2.0, 25.0, 24)
    found = modes(models[0], speeds)
    wrong = 0
    for k, speed in enumerate(speeds):
        named = [(name, z) for name, rows in found.branches.items() for z in rows[k] if not np.isnan(z)]
        assert sum(2 if z.imag else 1 for _, z in named) == models[0].order
        pair = moved_most(models, speed)
        if pair is not None:
            wrong += "wobble" not in min(named, key=lambda one: abs(one[1] - pair))[0].split("+")
    assert wrong <= 1
    assert "wobble" in found.names


def test_weave_is_the_slow_pair_and_capsize_the_slowest_real_root_of_an_ordinary_bicycle():
    """From 8 m/s on: weave is below 5 Hz, capsize slower than 5 1/s."""
    for bicycle, table in random_bicycles(30, 15):
        found = modes(built(bicycle, **table), np.linspace(8.0, 20.0, 7))
        assert np.nanmax(found.frequency("weave")) < 5.0
        capsize = found.branch("capsize")[:, 0]
        assert (capsize.imag == 0).all()
        assert np.abs(capsize).max() < 5.0
