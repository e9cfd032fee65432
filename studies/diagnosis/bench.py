"""Bench tests of the steering: torque at the handlebar of a bicycle at rest.

The rear frame is held upright at its riding pitch; the handlebar is held or turned slowly. With the steer row of the
linear model at v = 0 (Meijaard et al. 2007, eq. 5.3) the torque is

    T = K steer + D rate + (T_f + T_s cos(tilt)) sign(direction)

K contains the front wheel load N times the trail, N (rho sin(tilt)^2 - c cos(tilt) sin(tilt)) with crown radius rho; a
lifted wheel has N = 0. T_f is the dry friction of the steering (half the width of a slow loop), T_s the scrub moment of
a tyre on the floor, 2/3 mu N a for a round patch of radius a (Pacejka, Tire and Vehicle Dynamics, ch. 9). Readings
taken before the patch slides, just after a reversal, must be left out. A tyre at rest has no slip force.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property, partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar, Self

import numpy as np

from bicycle.effects.effect import Effect
from bicycle.effects.effect_registry import registry
from bicycle.model.model import Model
from bicycle.motion.responses import LINEAR_UP_TO
from studies.diagnosis.bicycle_kind import BicycleKind, refuse_repeats
from studies.diagnosis.candidates import feedback_terms
from studies.diagnosis.doubts import ANGLES
from studies.diagnosis.family import Family, Settings
from studies.diagnosis.mistakes import FRICTION, error, friction_candidate, mistake
from studies.inference import kind as base
from studies.inference.evidence import folds
from studies.inference.kind import Candidates, Proposal, Rows, Series
from studies.inference.parameter import Candidate, central_differences
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, refuse_unknown, unknown
from tyre.ground.schema import Check, number, path_key, read, table
from tyre.ground.text_table import read_cells, read_columns
from tyre.ground.units import find_unit

# ---- the table of readings ----

# Column name without its unit -> quantity, SI unit, range in SI. Longer names first: the first that fits is taken.
QUANTITIES = {
    "steer_torque_sd": ("moment", "N_m", 0.0, 1e3), "steer_torque": ("moment", "N_m", -1e3, 1e3),
    "steer_rate": ("angular rate", "rad_s", -50.0, 50.0), "steer": ("angle", "rad", -LINEAR_UP_TO, LINEAR_UP_TO),
    "force_sd": ("force", "N", 0.0, 1e4), "force": ("force", "N", -1e4, 1e4), "lever_arm": ("length", "m", 0.0, 2.0),
    "front_load": ("force", "N", 0.0, 1e4),
}  # fmt: skip
TESTS = {"hold": "held still", "sweep": "turned slowly up and down", "damper": "turned at a steady rate"}
CONDITIONS = {
    "lifted": "front wheel off the ground",
    "free_plate": "front wheel on a plate that slides and turns freely",
    "floor": "front wheel on the floor",
}
DIRECTIONS = {"up": 1.0, "down": -1.0, "": 0.0}
ALLOWED_WORDS: dict[str, Mapping[str, Any]] = {"test": TESTS, "condition": CONDITIONS, "direction": DIRECTIONS}
TEXTS = ("test", "condition", "direction", "group")


@dataclass(frozen=True)
class Reading:
    test: str  # hold, sweep or damper
    condition: str  # lifted, free_plate or floor
    steer: float  # rad
    rate: float  # rad/s, 0 unless a damper test
    direction: float  # +1 turning right, -1 left, 0 held
    torque: float  # N m, positive to the right
    sd: float  # N m
    arm: float = 0.0  # m, lever arm of a force; 0 if the torque was read
    load: float = math.nan  # N on the front wheel; nan if not measured
    group: str = ""  # what readings share that lie together, such as a day; "" if not stated


def _read_readings(content: Mapping[str, Any], folder: Path) -> tuple[tuple[Reading, ...], tuple[str, ...]]:
    """Readings of the table, and notes on what was assumed."""
    path = folder / content["table"]
    units = _column_units(path)
    if not any(stem == "steer" for stem, _ in units.values()):
        raise InputError(f"{path}: the column steer_deg or steer_rad is missing; every reading is at a steer angle")
    cells = {name: _cell(stem, factor) for name, (stem, factor) in units.items()}
    columns = read_columns(path, numbers=cells, texts=TEXTS, needed=("test", "condition"))
    readings = []
    for row, line in enumerate(columns.lines):
        si = {stem: float(columns.numbers[name][row]) * factor for name, (stem, factor) in units.items()}
        words = {name: columns.texts[name][row] if name in columns.texts else "" for name in TEXTS}
        try:
            readings.append(_reading(si, words))
        except InputError as error:
            raise InputError(f"{path}, line {line}: {error}") from None
    refuse_repeats(path, columns.lines, map(repr, readings), "reading")  # in words, for nan != nan
    if len(readings) < 3:
        raise InputError(f"{path}: {len(readings)} row(s) cannot be diagnosed; give at least 3 readings")
    return tuple(readings), _notes(readings)


def _cell(stem: str, factor: float) -> Check:
    """Check a number in the unit of its column; an empty cell, if it may be one, is NaN."""
    _, _, least, most = QUANTITIES[stem]
    check = number(least=least / factor, most=most / factor)
    return lambda cell: math.nan if cell == "" and stem != "steer" else check(cell)


def _column_units(path: Path) -> dict[str, tuple[str, float]]:
    """Column name -> (quantity column it stands for, factor to SI)."""
    kind = "table; a path in a file is relative to that file"
    units: dict[str, tuple[str, float]] = {}
    for name in read_cells(path, kind=kind, example="test, condition").header:
        stem = next((s for s in QUANTITIES if name == s or name.startswith(f"{s}_")), None)
        if stem is None:
            more = "the name of a column contains its unit (steer_deg, lever_arm_mm)"
            examples = [f"{stem}_{unit}" for stem, (_, unit, _, _) in QUANTITIES.items()]
            refuse_unknown("column", [name], [*TEXTS, *examples], where=str(path), more=more)
            continue
        if any(stem == earlier for earlier, _ in units.values()):
            raise InputError(f"{path}: two columns give the {stem}; keep one")
        unit, quantity = name.removeprefix(stem).lstrip("_"), QUANTITIES[stem][0]
        if quantity in ("moment", "force", "length"):
            unit = unit.replace("_", "")
        units[name] = stem, find_unit(unit, quantity, where=f"{path}: column {name}").factor
    return units


def _reading(si: Mapping[str, float], words: Mapping[str, str]) -> Reading:
    """Reading of one row, its numbers ``si`` by quantity in SI, and its ``words``; InputError if they contradict."""
    for name, allowed in ALLOWED_WORDS.items():
        if words[name] not in allowed:
            raise InputError(unknown(name, words[name], [word for word in allowed if word]))
    test, condition, direction = words["test"], words["condition"], DIRECTIONS[words["direction"]]
    rate, load = si.get("steer_rate", math.nan), si.get("front_load", math.nan)
    torque, sd, arm = _torque(si)
    turned = math.copysign(1.0, rate)
    faults = {
        "a damper test needs a steer_rate other than 0": test == "damper" and not abs(rate) > 0,
        f"a {test} test has no steer_rate; call it a damper test, or leave the cell empty": test != "damper"
        and not (math.isnan(rate) or rate == 0),
        "a sweep needs a direction, up (to the right) or down": test == "sweep" and not direction,
        f"the direction {words['direction']} is not that of the steer_rate, {rate:g} rad/s": test == "damper"
        and direction not in (0.0, turned),
        "a lifted wheel carries no front_load; leave the cell empty": condition == "lifted" and load > 0,
    }
    for fault, present in faults.items():
        if present:
            raise InputError(fault)
    rate, direction = (rate, turned) if test == "damper" else (0.0, direction)
    return Reading(test, condition, si["steer"], rate, direction, torque, sd, arm, load, words["group"])


def _torque(si: Mapping[str, float]) -> tuple[float, float, float]:
    """Torque (N m), its sd, and the lever arm (m) if a force was read, else 0."""
    stems = [stem for stem in ("steer_torque", "force") if not math.isnan(si.get(stem, math.nan))]
    if len(stems) == 2:
        raise InputError("steer_torque and force give the same; keep one")
    if not stems:
        raise InputError("the torque is missing: give a torque, or a force and its lever_arm")
    (stem,) = stems
    by_force = stem == "force"
    arm = si.get("lever_arm", math.nan) if by_force else 1.0
    if not arm > 0:
        raise InputError("a force needs a positive lever_arm, its distance from the steer axis")
    sd = f"{stem}_sd"
    if not si.get(sd, math.nan) > 0:
        raise InputError(
            f"the column {sd} with its unit, such as {sd}_{QUANTITIES[sd][1]}, must be there and positive; give the "
            "scatter of repeated readings or the scale's division"
        )
    return si[stem] * arm, si[sd] * arm, arm if by_force else 0.0


def _notes(readings: Sequence[Reading]) -> tuple[str, ...]:
    """Notes on what the ``readings`` leave open and is assumed."""
    notes = {
        "a hold without a direction is treated as the middle of the friction band": any(
            r.test == "hold" and not r.direction for r in readings
        ),
        "front_load is not given: the front wheel load follows from the bicycle's parameters, rider included": any(
            r.condition != "lifted" and math.isnan(r.load) for r in readings
        ),
        "on the floor: the tyre slides in its patch, and the rear frame, held upright, is free to yaw": any(
            r.condition == "floor" for r in readings
        ),
    }
    return tuple(note for note, applies in notes.items() if applies)


# ---- the equation ----

SCRUB = "bench.contact_scrub"
TORQUE_GAIN, FORCE_GAIN, ARM_ERROR = "bench.torque_gain", "bench.force_gain", "bench.lever_arm_error"
TORQUE_ZERO, FORCE_ZERO, STEER_ZERO = "bench.torque_zero", "bench.force_zero", "bench.steer_zero"
CROWN = "crown_radius.crown_radius.front"


def arrays_of(readings: Sequence[Reading]) -> SimpleNamespace:
    """The ``readings`` as arrays (n,), one for each field of :class:`Reading`."""
    return SimpleNamespace(**{f.name: np.array([getattr(r, f.name) for r in readings]) for f in fields(Reading)})


def torques(family: Family, setup: SimpleNamespace, theta: Array) -> Array:
    """Torques (K, n), N m, that a bicycle at rest would have shown at coordinates ``theta`` (K, p)."""
    values, names = family.values(theta), family.symbolic
    system = family(theta, np.zeros(1))
    row, angle = names.states.index("steer_rate"), names.states.index("steer")
    stiffness, damping = (-system.dynamics[:, 0, row, j, None] / family.models.scale[j] for j in (angle, row))
    own_load = np.broadcast_to(family.models.evaluate(values).static_loads[..., 1], (len(theta), 1))
    load = np.where(setup.condition == "lifted", 0.0, np.where(np.isnan(setup.load), own_load, setup.load))
    tilt, trail, crown = values["lam"], values["c"], values.get(CROWN, np.zeros(1))
    per_load = crown * np.sin(tilt) ** 2 - trail * np.cos(tilt) * np.sin(tilt)  # m/rad

    def error(key: str) -> Array:
        return values.get(key, np.zeros((len(theta), 1)))

    friction = error(FRICTION) + error(SCRUB) * np.cos(tilt) * (setup.condition == "floor")
    torque = (stiffness + per_load * (load - own_load)) * (setup.steer + error(STEER_ZERO))
    torque = torque + damping * setup.rate + friction * setup.direction
    by_force = setup.arm > 0
    arm = np.where(by_force, setup.arm, 1.0)
    as_force = torque * (1 + error(FORCE_GAIN)) * arm / (arm + error(ARM_ERROR)) + error(FORCE_ZERO) * arm
    as_torque = torque * (1 + error(TORQUE_GAIN)) + error(TORQUE_ZERO)
    return np.asarray(np.where(by_force, as_force, as_torque))


# ---- candidates ----


def unseen(effect: type[Effect]) -> str:
    """Reason why an ``effect`` cannot act on a bicycle that stands; empty if it may."""
    if effect.powered or "motor command" in effect.requires:
        return "motors are off in a bench test"
    if effect.needs_rider:
        return "no rider in a bench test: the handlebar is free"
    rolling = effect.slot is not None or effect.requires or effect.identifier == "twisting_torque"
    if rolling:
        return "acts through a rolling tyre; a tyre at rest has no slip and no rolling force"
    return ""


# identifier, unit, key, prior sd, smallest size worth a name, lower bound, signature
MISTAKES = {
    "steer_torque": (
        ("steer_torque_scale", "1", TORQUE_GAIN, 0.1, 0.002,
         "the torque sensor reads wrong by a constant factor"),
        ("steer_torque_zero", "N m", TORQUE_ZERO, 0.1, 0.02, "the torque sensor does not read zero without load"),
    ),
    "force": (
        ("force_scale", "1", FORCE_GAIN, 0.1, 0.002,
         "the spring balance reads wrong by a constant factor"),
        ("force_zero", "N", FORCE_ZERO, 0.5, 0.1, "the spring balance does not read zero without load"),
    ),
}  # fmt: skip
NAMES = {"1": "scale", "N m": "offset", "N": "offset"}


def _distinct_arms(readings: Sequence[Reading]) -> list[float]:
    """Lever arms (m) that differ by more than 1 %."""
    arms: list[float] = []
    for arm in sorted({r.arm for r in readings if r.arm > 0}):
        if not arms or arm > arms[-1] * 1.01:
            arms.append(arm)
    return arms


# ---- the kind ----


@dataclass(frozen=True, kw_only=True)
class Bench(BicycleKind, kind="bench"):
    """Torques at the handlebar of a bicycle at rest."""

    keys: ClassVar[Any] = table(path_key("table", "FILE.csv"))
    columns: ClassVar[tuple[str, ...]] = (*TEXTS, *(f"{name}_..." for name in QUANTITIES))
    readings: tuple[Reading, ...]  # one a row of the table, in its order

    @classmethod
    def read(cls, content: Any, folder: Path, common: Mapping[str, Any]) -> "Bench":
        readings, notes = _read_readings(read(cls.keys, content, section="bench"), folder)
        return cls(**common, readings=readings, notes=notes)

    def prepare(self, **how: Any) -> Self:
        """Prepare the library without candidates that these readings cannot show."""

        def order(r: Reading) -> tuple[Any, ...]:
            return r.test, r.condition, 0.0 if r.rate else -r.direction, r.rate, r.steer

        prepared = super(Bench, replace(self, readings=tuple(sorted(self.readings, key=order)))).prepare(**how)
        acting = tuple(c for c in prepared.candidates if c.effect is None or not unseen(c.effect))
        shown_candidates = tuple(c for c in acting if c.effect is None or prepared._shows(c))
        hidden = {
            c.identifier: "does not change the torque at the handlebar in these tests"
            for c in acting
            if c not in shown_candidates
        }
        return replace(prepared, candidates=shown_candidates, refused={**prepared.refused, **hidden})

    def _shows(self, candidate: Candidate) -> bool:
        """True if a candidate changes any reading."""
        family = self.family((candidate,))
        theta = np.array([[*self.nominal, *candidate.starts[1]], [*self.nominal, *candidate.neutral]])
        torque_with, torque_without = (torques(family, self.setup, coordinates[None]) for coordinates in theta)
        return bool((np.abs(torque_with - torque_without) > 1e-9 * self.setup.sd).any())

    def mistakes(self) -> tuple[Candidate, ...]:
        """Scale and zero of the balance, by torque or by force, the lever arm, the zero of the angle; dry friction."""
        readings = self.readings
        candidates = [
            mistake(name, error(NAMES[unit], unit, key, sd, least=least), signature)
            for read_as, rows in MISTAKES.items()
            if any((r.arm > 0) == (read_as == "force") for r in readings)
            for name, unit, key, sd, least, signature in rows
        ]
        arms = _distinct_arms(readings)
        if len(arms) > 1:
            size = error("error", "m", ARM_ERROR, 0.005, least=1e-3, lowest=-0.5 * min(arms))
            candidates.append(
                mistake("lever_arm_error", size, "every lever arm is longer than stated by the same length")
            )
        size = error("offset", "rad", STEER_ZERO, 0.02, least=2e-3)
        candidates.append(mistake("steer_zero", size, "the steering is not straight where the angle reads zero"))
        if any(r.direction for r in readings):
            candidates.append(friction_candidate())
        if any(r.direction and r.condition == "floor" for r in readings):
            moment = error("moment", "N m", SCRUB, 3.0, least=0.05, lowest=0.0)
            candidates.append(
                Candidate("contact_scrub", (moment,), signature="the standing tyre rubs in its contact patch")
            )
        return tuple(candidates)

    def refusals(self) -> dict[str, str]:
        readings = self.readings
        reasons = {name: why for name, effect in registry().items() if (why := unseen(effect))}
        if len(_distinct_arms(readings)) == 1:
            reasons["lever_arm_error"] = (
                "one lever arm: an error of it looks like a scale of the balance, see force_scale"
            )
        if not any(r.direction for r in readings):
            reasons["steer_friction"] = "needs readings with a direction: a sweep up and down, or a damper test"
        floor = [r.direction for r in readings if r.condition == "floor"]
        if floor and not any(floor):
            reasons["contact_scrub"] = "needs readings with a direction: a sweep up and down"
        present = {effect.identifier for effect in self.model.effects}
        return {name: why for name, why in reasons.items() if name not in present}

    def assumptions(self) -> tuple[str, ...]:
        inactive = [e.identifier for e in self.model.effects if e.identifier != "no_slip" and unseen(type(e))]
        upright = "the rear frame was held upright, at the pitch at which it rides"
        if not inactive:
            return (upright,)
        return (upright, f"{', '.join(inactive)} of the base model: without effect at rest")

    # ---- physics ----

    @cached_property
    def setup(self) -> SimpleNamespace:
        """The readings as arrays."""
        return arrays_of(self.readings)

    @cached_property
    def _standing(self) -> tuple[Model, tuple[tuple[str, float], ...]]:
        """The base model at rest, without slip, and the parameters that have no part in it."""
        model = Model(self.model.bicycle, tuple(e for e in self.model.effects if not unseen(type(e))))
        return model, tuple((k, value) for k, value in self.model.parameters.items() if k not in model.parameters)

    def family(self, candidates: Candidates, settings: Settings = ()) -> Family:
        model, unused = self._standing
        return Family(model, self.nuisances, candidates, (*unused, *settings))

    @property
    def varied(self) -> bool:
        return bool(np.ptp(self.setup.steer) > 0 or np.ptp(self.setup.rate) > 0)

    @property
    def data(self) -> tuple[Array, Array]:
        return self.setup.torque, self.setup.sd

    @cached_property
    def rows(self) -> Rows:  # type: ignore[override]
        """A series is a test in one condition and direction, along angle or rate."""
        labels, series, place, group, displays = [], [], [], [], {}
        for r in self.readings:
            channel = f"{r.test}, {r.condition.replace('_', ' ')}"
            name = channel + {1.0: ", up", -1.0: ", down", 0.0: ""}[r.direction]
            damper = r.test == "damper"
            displays[name] = Series(name, "torque, N m", "steer rate, rad/s" if damper else "steer angle, rad")
            labels.append(f"{name}, {r.rate:g} rad/s" if damper else f"{name}, {r.steer:.3g} rad")
            series.append(name)
            place.append(r.rate if damper else r.steer)
            group.append(r.group or channel)
        fold = folds(group, place, [f"{k:06d}" for k in range(len(place))])
        return Rows(tuple(labels), np.array(place), tuple(series), fold, displays=displays, axis="steer angle, rad")

    def predict(self, candidates: Candidates, theta: Array) -> Array:
        return torques(self.family(candidates), self.setup, theta[None])[0]

    def value_and_jacobian(self, candidates: Candidates, theta: Array) -> base.Prediction:
        return self._torques(self.setup, candidates, theta)

    def _torques(self, setup: SimpleNamespace, candidates: Candidates, theta: Array) -> base.Prediction:
        family = self.family(candidates)
        batch, steps = family.stencil(theta)
        computed = torques(family, setup, batch)
        return computed[0], central_differences(computed, steps)

    def enabled_by(self, candidates: Candidates) -> Candidates:
        return ()  # at rest a tyre force makes no further effect possible

    def empirical_terms(self) -> Candidates:
        return self.directions()

    def directions(self) -> Candidates:
        return tuple(c for c in feedback_terms() if c.identifier.startswith("steer torque from steer"))

    def propose_measurements(self) -> tuple[Proposal, ...]:
        """Tests that were not made: a slow sweep and steady rates with the wheel lifted, a sweep on a free plate."""
        done_already = {(r.test, r.condition) for r in self.readings}
        sd = float(np.median(self.setup.sd))
        sweep = [(x, 0.0, d) for x in (-0.2, -0.1, 0.0, 0.1, 0.2) for d in (1.0, -1.0)]
        damper = [(0.0, rate, float(np.sign(rate))) for rate in (-2.0, -1.0, 1.0, 2.0)]
        up_and_down = "a slow sweep of the steer angle up and down, 0.2 rad to each side"
        tests = (
            ("sweep", "lifted", up_and_down, sweep),
            ("damper", "lifted", "the torque at steady steer rates up to 2 rad/s", damper),
            ("sweep", "free_plate", up_and_down, sweep),
        )
        proposals = []
        for test, condition, title, states in tests:
            if (test, condition) not in done_already:
                setup = arrays_of([Reading(test, condition, steer, rate, d, 0.0, sd) for steer, rate, d in states])
                predict = partial(self._torques, setup)
                proposals.append(Proposal(f"{title}, {CONDITIONS[condition]}", np.full(len(states), sd), predict))
        return tuple(proposals)

    def misreadings(self) -> Iterator[tuple[str, Self]]:
        """Torques, or forces, of the other sign or in kgf; the angle of the other sign or in degrees."""
        read = "force" if any(r.arm > 0 for r in self.readings) else "steer_torque"
        for reading, factor in {"of the opposite sign": -1.0, "in kgf": 9.80665}.items():
            corrected = (replace(r, torque=factor * r.torque, sd=abs(factor) * r.sd) for r in self.readings)
            yield f"{read} {reading}", replace(self, readings=tuple(corrected))
        for reading, factor in ANGLES.items():
            yield (
                f"steer {reading}",
                replace(self, readings=tuple(replace(r, steer=factor * r.steer) for r in self.readings)),
            )
