"""Is a rider who turns on the saddle found? SYNTHETIC modal tables and rides of ridden bicycles that hide one.

A packaged bicycle is drawn within its measured uncertainty, and a body near that of a packaged rider is joined to it by
a sprung, damped hinge at the saddle. It moves by the equations of tests.validation.blind, which the fitter does not
know. The measurement file states the packaged bicycle with a rider who is fixed to the frame, on lagging tyres and with
a flexible front frame whose numbers were measured. A modal table has weave and wobble at twelve speeds with the ratios
of steer and yaw to lean. A ride is a set of runs hands off after torques on the handlebar.
"""

import math
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bicycle import Bicycle, load_bicycle
from tests.validation.blind.chain import Body
from tests.validation.blind.closing import Machine, build
from tests.validation.blind.generator import table_row, write_modal
from tests.validation.blind.hidden import bodies_exist, perturbed, uncertainty
from tests.validation.blind.histories import CHANNELS, CUT, SAMPLE, kicks, measure, write_histories
from tests.validation.blind.machine import tensor, without
from tests.validation.blind.motion import shapes
from tests.validation.cases import KeptCases, Row, attempted, share_of

Random = np.random.Generator
Table = dict[str, Any]

BARE = {"pista_charlie_drops": "pista", "pista_charlie_hoods": "pista", "pista_charlie_upright": "pista",
        "pista_rider": "pista", "rigid_rider_joined": "rigid"}  # fmt: skip
"""Packaged bicycle with rider -> the same without."""
RANGES = {
    "stiffness": (2e3, 4e4),  # N m/rad, of the hinge at the saddle; logarithmically even
    "ratio": (0.1, 0.5),  # of its critical damping
    "joint_x": (0.17, 0.23),  # m
    "front_stiffness": (2500.0, 1e4),  # N m/rad
    "front_ratio": (0.01, 0.1),  # of critical damping
    "cornering": (13.0, 18.0),  # 1/rad of the load
    "length": (0.08, 0.15),  # m, relaxation length
    "camber": (0.5, 0.9),  # 1/rad of the load
}
STATED = {  # relative standard uncertainty of what the file states
    "relaxation_length.cornering_stiffness": 0.03, "relaxation_length.relaxation_length": 0.05,
    "camber_thrust.camber_stiffness": 0.1, "front_compliance.stiffness": 0.05, "front_compliance.damping": 0.3,
}  # fmt: skip
FRONT_INERTIA = 0.4  # kg m^2, of a front frame about its hinge: sets the damping only
HINGE_HEIGHT = 0.65  # m above the ground, on the steer axis
LARGEST_CLASS = 3  # a class of more counts as nothing found
FAMILY = {"rider_saddle", "rider_saddle_roll", "rider_lean"}
SPEEDS, POINTS, RUNS, DURATION = (5.5, 14.0), 12, 8, 4.0
NOISE = 0.3  # of the blind test's: gyros of 0.003 to 0.006 rad/s, a steer encoder of 0.0012 rad
KINDS = ("modal", "ride")


def draw_number(name: str, rng: Random) -> float:
    """Draw a number of RANGES, logarithmically even."""
    low, high = RANGES[name]
    return float(low * (high / low) ** rng.random())


def body_of(p: Mapping[str, float]) -> Body:
    """The rear frame of a bicycle."""
    return Body(0, p["mB"], (p["xB"], 0.0, p["zB"]), tensor(p["IBxx"], p["IBzz"], p["IBxz"]))


def joined(frame: Body, rider: Body) -> dict[str, float]:
    """Keys of the rear frame of both bodies together."""
    nothing_taken = Body(0, -rider.mass, rider.centre, -rider.inertia)
    whole = without(frame, nothing_taken)
    (x, _, z), inertia = whole.centre, whole.inertia
    keys = {"mB": whole.mass, "xB": x, "zB": z, "IBxx": inertia[0, 0], "IBzz": inertia[2, 2], "IBxz": inertia[0, 2]}
    return {key: float(value) for key, value in keys.items()}


def draw_rider(ridden: Bicycle, bare: Bicycle, rng: Random) -> Body:
    """A body near that of the packaged rider."""
    rider = without(body_of(ridden.values), body_of(bare.values))
    x, _, z = rider.centre
    share = 1 + 0.03 * rng.standard_normal()
    moved = (x + 0.006 * rng.standard_normal(), 0.0, z + 0.006 * rng.standard_normal())
    return Body(0, rider.mass * (1 + 0.005 * rng.standard_normal()), moved, share * rider.inertia)


def draw_base(ridden: Bicycle, rng: Random) -> Table:
    """Tyres and front frame as they are."""
    camber, stiffness = draw_number("camber", rng), draw_number("front_stiffness", rng)
    cornering, front_ratio = draw_number("cornering", rng), draw_number("front_ratio", rng)
    loads = dict(zip(("rear", "front"), ridden.static_loads, strict=True))
    return {
        "relaxation_length": {
            "cornering_stiffness": {wheel: cornering * load for wheel, load in loads.items()},
            "relaxation_length": draw_number("length", rng),
        },
        "camber_thrust": {"camber_stiffness": {wheel: camber * load for wheel, load in loads.items()}},
        "front_compliance": {
            "stiffness": stiffness,
            "damping": 2 * front_ratio * math.sqrt(stiffness * FRONT_INERTIA),
            "joint_x": ridden["w"] + ridden["c"] - HINGE_HEIGHT * math.tan(ridden["lam"]),
            "joint_z": -HINGE_HEIGHT,
        },
    }


def misstate(effects: Table, rng: Random) -> tuple[Table, dict[str, float]]:
    """Tyres and front frame as they were measured, and the standard uncertainty of each number."""
    stated, sd = {name: dict(table) for name, table in effects.items()}, {}
    for name, relative in STATED.items():
        effect, _, key = name.partition(".")
        value, factor = stated[effect][key], math.exp(relative * rng.standard_normal())
        if isinstance(value, Mapping):
            stated[effect][key] = {wheel: factor * number for wheel, number in value.items()}
            sd |= {f"{name}.{wheel}": relative * factor * number for wheel, number in value.items()}
        else:
            stated[effect][key] = factor * value
            sd[name] = relative * factor * value
    return stated, sd


def draw_hidden(rider: Body, rng: Random) -> Table:
    """The effect that is hidden: the rider on a hinge."""
    stiffness, joint_x = draw_number("stiffness", rng), draw_number("joint_x", rng)
    x, _, z = rider.centre
    inertia = rider.inertia[2, 2] + rider.mass * (x - joint_x) ** 2
    return {
        "mass": rider.mass, "x": x, "z": z, "joint_x": joint_x, "stiffness": stiffness,
        "damping": 2 * draw_number("ratio", rng) * math.sqrt(stiffness * inertia),
        "Ixx": float(rider.inertia[0, 0]), "Izz": float(rider.inertia[2, 2]), "Ixz": float(rider.inertia[0, 2]),
    }  # fmt: skip


def make(folder: Path, kind: str, hidden: int, rng: Random) -> tuple[str, Table]:
    """Write MEASUREMENT.toml and its data, with so many riders ``hidden`` (0 or 1); the bicycle and what is hidden."""
    name = str(rng.choice(list(BARE)))
    ridden, bare = load_bicycle(name), load_bicycle(BARE[name])
    while True:
        real_bare, rider = perturbed(bare, uncertainty(bare), rng), draw_rider(ridden, bare, rng)
        real = {**real_bare.values, **joined(body_of(real_bare.values), rider)}
        if bodies_exist(ridden.replace(**real)):
            break
    effects = draw_base(ridden, rng)
    truth = {"rider_saddle": draw_hidden(rider, rng)} if hidden else {}
    stated, sd = misstate(effects, rng)
    machine = build(real, {**effects, **truth})
    (write_table if kind == "modal" else write_ride)(folder, name, machine, stated, uncertainty(ridden) | sd, rng)
    return name, truth


def write_table(
    folder: Path, name: str, machine: Machine, effects: Table, sd: Mapping[str, float], rng: Random
) -> None:
    """Write a modal table of weave and wobble."""
    speeds = np.sort(rng.uniform(*SPEEDS, POINTS).round(2))
    seen = [(float(v), shape) for v in speeds for mode, shape in shapes(machine, float(v)).items()]
    write_modal(folder, name, effects, sd, [table_row(v, shape, 1.0, rng, ratios=True) for v, shape in seen])


def write_ride(folder: Path, name: str, machine: Machine, effects: Table, sd: Mapping[str, float], rng: Random) -> None:
    """Write runs after torques on the handlebar, each cut before the bicycle falls."""
    time = np.arange(round(DURATION / SAMPLE) + 1) * SAMPLE
    made = kicks(machine, np.linspace(*SPEEDS, RUNS).round(2), time, rng, fastest=2 * SPEEDS[1], recording=CUT)
    levels, colour = {channel: NOISE * level for channel, (_, level) in CHANNELS.items()}, float(rng.uniform(0.2, 0.7))
    for run in made:
        measure(run, levels, colour, {}, rng)
    content = {"kind": "histories", "description": "synthetic", "bicycle": name, "effects": effects,
               "uncertainty": dict(sd), "histories": {"noise_sd": levels}}  # fmt: skip
    write_histories(folder, content, made)


def one_case(kind: str, hidden: int, seed: int) -> Row:
    """Make and diagnose one case."""
    return attempted({"kind": kind, "hidden": hidden, "seed": seed}, partial(_judged, kind, hidden, seed))


def _judged(kind: str, hidden: int, seed: int, folder: Path, row: Row) -> None:
    from studies.diagnosis import diagnose, read_measurement

    name, truth = make(folder, kind, hidden, np.random.default_rng([seed, KINDS.index(kind), hidden]))
    verdict = diagnose(read_measurement(folder / "MEASUREMENT.toml")).verdict
    members = [set(member.split("+")) for member in verdict.equivalent]
    values = {e.identifier: {key: float(pair[0]) for key, pair in e.parameters.items()} for e in verdict.effects}
    row |= {
        "bicycle": name, "truth": truth, "verdict": verdict.verdict, "class": list(verdict.equivalent),
        "found": len(members) <= LARGEST_CLASS and any("rider_saddle" in member for member in members),
        "family": len(members) <= LARGEST_CLASS and any(member & FAMILY for member in members),
        "effects": values,
    }  # fmt: skip


def run(*, out: Path, seed: int, tables: int = 20, rides: int = 20, none: int = 5, workers: int = 2) -> dict[str, Any]:
    """Diagnose ``tables`` and ``rides`` that hide a rider on the saddle, and ``none`` of each that hide nothing."""
    wanted = [("modal", 1, seed + k) for k in range(tables)] + [("ride", 1, seed + k) for k in range(rides)]
    wanted += [(kind, 0, seed + k) for kind in KINDS for k in range(none)]
    rows = KeptCases(out / "seated_rider_cases.jsonl", ("kind", "hidden", "seed")).computed(
        wanted, one_case, workers=workers, what="seated rider"
    )
    result: dict[str, Any] = {"errors": [row["error"] for row in rows if row["error"]]}
    for kind in KINDS:
        # a crash found nothing, and is counted
        some = [{"found": False, "family": False, "bicycle": ""} | row for row in rows if row["kind"] == kind]
        hidden = [row for row in some if row["hidden"]]
        by_bicycle = {name: [row for row in hidden if row["bicycle"] == name] for name in BARE}
        result[kind] = {
            "found_or_family": share_of(hidden, "family"),
            "found": share_of(hidden, "found"),
            "found_or_family_by_bicycle": {name: share_of(cases, "family") for name, cases in by_bicycle.items()},
            "family_named_where_none_is_hidden": share_of([row for row in some if not row["hidden"]], "family"),
        }
    return result
