"""SYNTHETIC taps on front frames with dry friction, or held by a seated rider alone: what becomes of k, c and hinge?

Equations of this file: small angles about axes in the plane of the bicycle, without weight (it lies on its side).
Dry friction is Coulomb's with sticking: between exact linear steps of 0.1 ms an impulse takes away as much of the rate
as friction can. The rider yaws on the saddle on a spring and damper; rear tyre and inertia hold the rest.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]
STEP = 1e-4  # s
RATE = 400.0  # Hz
TAP_S, END_S = 0.15, 1.6  # s
STEM, HEAD = 0.6, 0.55  # m above the hub
NOISE = 0.03  # m/s^2
STIFFNESS, RATIO, HEIGHT = (1500.0, 12000.0), (0.01, 0.10), (0.2, 0.5)  # N m/rad, 1, m above the hub
HEADSET = (0.05, 0.5)  # N m, of the steering, the handlebar free
RUBBING = (0.003, 0.10)  # dry friction of the hinge itself over the largest elastic moment of the tap
IMPULSES = (0.05, 0.3)  # N s
RIDERS = (2e3, 4e4)  # N m/rad, of a rider on the saddle in yaw
TAPS = 2
RIDER = {"mass": 75.0, "x": 0.35, "Izz": 3.0, "damping_ratio": 0.25}  # kg, m, kg m^2, 1


@dataclass(frozen=True)
class Turn:
    """Rotation of some bodies about an axis in the plane of the bicycle."""

    axis: Array  # (3,), unit vector
    point: Array  # (3,), m, on the axis
    carries: frozenset[str]
    stiffness: float = 0.0  # N m/rad
    damping: float = 0.0  # N m s/rad


@dataclass(frozen=True)
class Chain:
    """Bodies and their rotations."""

    bodies: Mapping[str, tuple[float, Array, Array]]  # mass kg, centre m, tensor kg m^2
    turns: tuple[Turn, ...]
    up: Array = field(repr=False)  # unit vector up the steer axis
    hub: Array = field(repr=False)  # m

    def row(self, point: Array, body: str) -> Array:
        """Lateral motion of a point per angle (n,)."""
        return np.array([np.cross(t.axis, point - t.point)[1] if body in t.carries else 0.0 for t in self.turns])

    def matrices(self) -> tuple[Array, Array, Array]:
        """Mass, damping and stiffness (n, n)."""
        mass = np.zeros((len(self.turns),) * 2)
        for name, (kilograms, centre, tensor) in self.bodies.items():
            row = self.row(centre, name)
            axes = np.array([t.axis if name in t.carries else np.zeros(3) for t in self.turns])
            mass += kilograms * np.outer(row, row) + axes @ tensor @ axes.T
        return mass, np.diag([t.damping for t in self.turns]), np.diag([t.stiffness for t in self.turns])

    def record(self, impulse: float, friction: Array, rng: Any, frame: float | None = None) -> dict[str, Array]:
        """Time (s) and accelerations (m/s^2) at hub and stem after an impulse (N s) at the hub; ``friction`` (n,), N m.

        With a ``frame`` (m above the hub) also there.
        """
        mass, damping, stiffness = self.matrices()
        n = len(mass)
        inverse = np.linalg.inv(mass)
        a = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ stiffness, -inverse @ damping]])
        flow = scipy.linalg.expm(a * STEP)
        places = [(0.0, "wheel"), (STEM, "front")] + ([(frame, "frame")] if frame is not None else [])
        rows = np.array([self.row(self.hub + above * self.up, body) for above, body in places])
        state = np.concatenate([np.zeros(n), impulse * inverse @ rows[0]])
        time = np.arange(0.0, END_S, 1 / RATE)
        signals = NOISE * rng.standard_normal((len(rows), len(time)))
        every = round(1 / RATE / STEP)
        rubs = np.flatnonzero(friction)
        for k in range(round(TAP_S * RATE), len(time)):
            before = state[n:].copy()
            for _ in range(every):
                state = flow @ state
                for j in rubs:  # the impulse that stops angle j, no larger than friction allows
                    wanted = -state[n + j] / inverse[j, j]
                    state[n:] += inverse[:, j] * np.clip(wanted, -friction[j] * STEP, friction[j] * STEP)
            signals[:, k] += rows @ (state[n:] - before) * RATE  # a sensor's mean over a sample
        names = ("hub", "stem", "frame")
        return {"time_s": time} | {f"{names[k]}_lateral_m_s2": signal for k, signal in enumerate(signals)}


def front(p: Mapping[str, float], stiffness: float, ratio: float, height: float, *, bar_free: bool = False,
          rider: float = 0.0) -> Chain:  # fmt: skip
    """A front on its hinge; with its steering free; or on a frame that a rider (N m/rad in yaw) holds."""
    sine, cosine = math.sin(p["lam"]), math.cos(p["lam"])
    up, hub = np.array([-sine, 0.0, -cosine]), np.array([p["w"], 0.0, -p["rF"]])

    def tensor(xx: float, zz: float, xz: float = 0.0) -> Array:
        return np.array([[xx, 0.0, xz], [0.0, 0.0, 0.0], [xz, 0.0, zz]])

    handlebar = (p["mH"], np.array([p["xH"], 0.0, p["zH"]]), tensor(p["IHxx"], p["IHzz"], p["IHxz"]))
    bodies = {"front": handlebar, "wheel": (p["mF"], hub, tensor(p["IFxx"], p["IFxx"]))}
    carried = frozenset(bodies)
    hinge = Turn(np.array([cosine, 0.0, -sine]), hub + height * up, carried, stiffness)
    mass, _, _ = Chain(bodies, (hinge,), up, hub).matrices()
    turns = [Turn(hinge.axis, hinge.point, carried, stiffness, 2 * ratio * math.sqrt(stiffness * mass[0, 0]))]
    if bar_free:
        turns.append(Turn(-up, np.array([p["w"] + p["c"], 0.0, 0.0]), carried))
    if rider:
        frame = {"frame": (p["mB"], np.array([p["xB"], 0.0, p["zB"]]), tensor(p["IBxx"], p["IBzz"], p["IBxz"])),
                 "rear wheel": (p["mR"], np.array([0.0, 0.0, -p["rR"]]), tensor(p["IRxx"], p["IRxx"])),
                 "rider": (RIDER["mass"], np.array([RIDER["x"], 0.0, -1.1]), tensor(9.0, RIDER["Izz"]))}  # fmt: skip
        bodies |= frame
        damping = 2 * RIDER["damping_ratio"] * math.sqrt(rider * RIDER["Izz"])
        vertical, level = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
        turns += [
            Turn(vertical, np.zeros(3), frozenset(bodies)),
            Turn(level, np.zeros(3), frozenset(bodies)),
            Turn(vertical, np.array([RIDER["x"], 0.0, -1.0]), frozenset({"rider"}), rider, damping),
        ]
    return Chain(bodies, tuple(turns), up, hub)


def measure(
    chain: Chain, bicycle: Any, impulse: float, friction: Any, rng: Any, *, bar_free: bool = False, frame: bool = False
) -> dict[str, Any]:
    """What two taps give: numbers of one hinge over the truth, and what is said of them."""
    from bicycle import Model
    from bicycle.standing import Place, Readings, TapRecording, identify_taps, measure_front
    from tyre.ground import InputError

    places = {
        "hub_lateral_m_s2": Place(0.0),
        "stem_lateral_m_s2": Place(STEM, "fork"),
        "frame_lateral_m_s2": Place(HEAD, "frame"),
    }
    recordings = []
    for k in range(TAPS):
        table = chain.record(impulse, friction, rng, HEAD if frame else None)
        recordings.append(TapRecording(f"tap{k}", table.pop("time_s"), table))
    try:
        taps = identify_taps(recordings, places)
        readings = Readings((), taps, bar_free=bar_free, on_side=True)
        result = measure_front(readings, Model(bicycle))
    except InputError as error:
        return {"outcome": "refused", "why": str(error)}
    fit = result.fits["one hinge"]
    row: dict[str, Any] = {"outcome": str(result.outcome), "not_exponential": readings.change is not None}
    true, height = chain.turns[0], float((chain.turns[0].point - chain.hub) @ chain.up)
    for name in ("stiffness", "damping"):
        key = f"front_compliance.{name}"
        low, high = fit.value_interval(key)
        row[name] = round(fit.values[key] / getattr(true, name), 4)
        row[f"{name}_holds"] = bool(low <= getattr(true, name) <= high)
    return row | {"height_mm": round(1e3 * (fit.height[0] - height), 2), "hold_checked": result.hold_checked}


def one(task: tuple[str, int]) -> dict[str, Any]:
    """One front of one kind: ``sound``, ``headset``, ``rubbing``, ``rider``, or ``rider, frame read``."""
    from bicycle.files import load_bicycle

    kind, seed = task
    rng = np.random.default_rng([611131, seed])
    bicycle = load_bicycle("pista")
    stiffness, ratio = (float(np.exp(rng.uniform(*np.log(ends)))) for ends in (STIFFNESS, RATIO))
    height, impulse = float(rng.uniform(*HEIGHT)), float(np.exp(rng.uniform(*np.log(IMPULSES))))
    share, torque, rider = (float(np.exp(rng.uniform(*np.log(ends)))) for ends in (RUBBING, HEADSET, RIDERS))
    of_rider = kind.startswith("rider")
    free = kind == "headset"
    chain = front(bicycle.values, stiffness, ratio, height, bar_free=free, rider=rider if of_rider else 0.0)
    mass = chain.matrices()[0][0, 0]
    largest = impulse * height * math.sqrt(stiffness / mass)  # N m, elastic moment
    friction = np.zeros(len(chain.turns))
    if kind == "rubbing":
        friction[0] = share * largest
    if free:
        friction[1] = torque
    row = {"kind": kind, "seed": seed, "true_ratio": round(ratio, 4), "impulse_N_s": round(impulse, 3)}
    row |= {"rubbing": {"share": round(share, 4)}, "headset": {"torque_N_m": round(torque, 3)}}.get(kind, {})
    row |= {"rider_N_m_per_rad": round(rider)} if of_rider else {}
    return row | measure(chain, bicycle, impulse, friction, rng, bar_free=free, frame=kind.endswith("read"))


KINDS = ("sound", "headset", "rubbing", "rider", "rider, frame read")


def run(*, out: Path, seed: int, fronts: int = 24, workers: int = 2) -> dict[str, Any]:
    """Measure ``fronts`` of each kind; every one goes to a file."""
    from bicycle.effects import model_workers

    with model_workers(workers) as pool:
        rows = list(pool.map(one, [(kind, seed + k) for kind in KINDS for k in range(fronts)]))
    by_kind = {kind: summary([row for row in rows if row["kind"] == kind]) for kind in KINDS}
    rubbing = [row for row in rows if row["kind"] == "rubbing"]
    for name, chosen in (("up to 3 %", [r for r in rubbing if r["share"] <= 0.03]),
                         ("above 3 %", [r for r in rubbing if r["share"] > 0.03])):  # fmt: skip
        by_kind[f"rubbing, {name}"] = summary(chosen)
    lines = "".join(json.dumps(row) + "\n" for row in rows)
    (out / "standing_friction_cases.jsonl").write_text(lines, encoding="utf-8")
    return {"summary": by_kind}


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Median and ends of what was found over the truth, and how often the intervals hold it."""
    measured = [row for row in rows if "stiffness" in row]
    result: dict[str, Any] = {"fronts": len(rows), "refused": len(rows) - len(measured)}
    if not measured:
        return result
    for name in ("stiffness", "damping", "height_mm"):
        values = [row[name] for row in measured]
        result[name] = [round(float(q), 3) for q in np.quantile(values, (0, 0.5, 1))]
    for name in ("stiffness_holds", "damping_holds", "not_exponential"):
        result[name] = sum(row[name] for row in measured)
    result["not_held"] = sum(row["outcome"] == "not_held" for row in measured)
    result["one_hinge"] = sum(row["outcome"] == "one_hinge" for row in measured)
    return result
