"""Settings of the main study: a bicycle, four cases, and the ranges of the assumed values."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.effects.effect import WHEELS, Parameter
from bicycle.effects.effect_registry import effect_class
from bicycle.effects.sprung_joint import DAMPING_RATIO
from bicycle.files.bicycle_files import available_bicycles, load_bicycle
from bicycle.model.effect_numbers import plain_effects
from bicycle.model.model import DEFAULT_CONTACT, Model
from bicycle.model.model_file import read_model
from bicycle.model.rider_in_model import with_rider_body
from bicycle.model.wheel_tyres import MOST_BAR, located, values_of_tyres
from bicycle.parameters.bicycle import LIGHTEST_RIDDEN, Bicycle
from bicycle.parameters.front_hinge import critical_damping, front_inertia
from bicycle.parameters.parameter_covariance import ParameterCovariance, ParameterKey
from bicycle.rider.rider_posture import POSTURES, SeatGeometry, packaged_geometry, read_geometry
from studies.model_space.model_argument import find_bicycle
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.files import read_toml
from tyre.ground.number_with_unit import typed_numbers

Table = Mapping[str, Any]
LAW, CONTACT_LENGTH = "relaxation_length", "contact_length"  # effects
SADDLE = "rider_saddle"  # effect: the rider turns on the saddle
DEFAULT_BICYCLE, DEFAULT_POSTURE = "pista_charlie_drops", "drops"


PLAIN = {
    "balanceassistv1": "the riderless balance-assist e-bike", "benchmark": "the benchmark bicycle with a rigid rider",
    "browser": "the riderless Batavus Browser city bicycle", "crescendo": "the riderless Batavus Crescendo",
    "fisher": "the riderless Gary Fisher mountain bicycle", "kooijman2008": "the riderless bicycle of Kooijman (2008)",
    "pista": "the riderless Pista track bicycle", "pista_rider": "the Pista track bicycle with a rigid rider",
    "pista_charlie_drops": "a Pista track bicycle with a rider in the drops",
    "pista_charlie_hoods": "a Pista track bicycle with a rider on the hoods",
    "pista_charlie_upright": "a Pista track bicycle with an upright rider",
    "rigid": "the riderless Davis instrumented bicycle", "rigid_rider": "the Davis instrumented bicycle with a rider",
    "bicycle of the model file": "the bicycle of the model file",  # whose numbers it holds, without a name
    "rigid_rider_joined": "the Davis instrumented bicycle with a rigid rider",
}  # fmt: skip


def plain_name(bicycle: Bicycle) -> str:
    """Name a ``bicycle`` in words."""
    return PLAIN.get(bicycle.name, bicycle.name.replace("_", " "))


@dataclass(frozen=True)
class Limits:
    """Limits that decide a name or a verdict of the main study."""

    camber_share: float = 0.65  # 1/rad of the load, the middle of what Dressel (2013) measured
    camber_range: tuple[float, float] = (0.43, 0.94)  # 1/rad, from Dressel's 0.0075 per degree to the Schwalbe tyre
    arms: tuple[float, float] = (0.5, 2.0)  # assumed factor on the impedance of arms that was not measured
    written: float = 0.2  # relative variation of a number of a model file, a value of this bicycle
    ridden: tuple[float, float] = (3.0, 20.0)  # m/s, ridden speeds, at which the minimum damping ratio is sought
    growth: float = 0.5  # 1/s, tenfold in 5 s; slower growth of an oscillation is no wobble that a rider meets
    fast_growth: float = 2.0  # 1/s, tenfold in 1.2 s; from here on wobble grows fast
    hands_off: float = 4.0  # m/s; nobody rides hands off below it, or below the weave speed
    wobble_hz: float = 4.0  # weave is at 1 to 4 Hz, wobble at 4 to 10 Hz; decides where tracking gives both names
    tyres_hz: float = 15.0  # near rest the wheels vibrate on their tyres at 16 to 20 Hz
    typical_bar: float = 5.5  # the pressure nearest to it is studied in detail
    likely: tuple[float, float] = (0.05, 0.95)  # quantiles of the samples between which a band is drawn
    wheelbase: tuple[float, float] = (
        0.9,
        1.2,
    )  # m; front-frame compliance is assumed for bicycles like the packaged ones,
    wheel: tuple[float, float] = (0.28, 0.38)  # m, radius of the front wheel: it is that of a racing frame
    fewest: int = 10  # samples with unstable wobble: of fewer the band spans all
    practical: float = 1.0  # m/s of the wobble range: a smaller change is none that a rider meets
    practical_growth: float = 0.5  # 1/s of the fastest growth: likewise
    slowest: float = -12.0  # 1/s; faster decay is not drawn
    widest: float = 0.9  # of the relaxation length, which contains the half length of the contact


LIMITS = Limits()


@dataclass(frozen=True)
class Assumed:
    """An assumed value: the effect's parameter that declares it, and the value and range the study takes."""

    effect: str  # identifier of the effect
    name: str  # of its parameter
    value: float | None = None  # SI, in place of the declared default
    range: tuple[float, float] | None = None  # SI, in place of the typical range
    reason: str = ""  # of either

    @property
    def declared(self) -> Parameter:
        """The declaration of the effect."""
        return next(p for p in effect_class(self.effect).parameters if p.name == self.name)

    @property
    def usual(self) -> float:
        """Assumed value, SI."""
        return float(self.declared.default or 0.0) if self.value is None else self.value

    @property
    def ends(self) -> tuple[float, float]:
        """Lowest and highest value of the samples, SI."""
        return self.range or self.declared.typical


ASSUMED: Mapping[str, Assumed] = {
    "stiffness": Assumed(
        "front_compliance", "stiffness", range=(2500.0, 10000.0), reason="a racing frame, not any bicycle"
    ),
    "damping_ratio": Assumed(
        "front_compliance",
        DAMPING_RATIO,
        0.25,
        (0.15, 0.40),
        "frame and seated rider together, where the rider is fixed to the frame; agrees with riders' reports",
    ),
    "bare_damping_ratio": Assumed(
        "front_compliance",
        DAMPING_RATIO,
        0.03,
        (0.01, 0.10),
        "of the frame alone, where the rider moves on the saddle (effect rider_saddle)",
    ),
    "joint_z": Assumed("front_compliance", "joint_z", -0.65, (-0.75, -0.55), "on the steer axis of a racing frame"),
    "friction": Assumed(
        "steer_damper",
        "damping",
        0.15,
        (0.05, 0.35),
        "measured on steering bearings (Moore 2012), no mounted damper",
    ),
    "saddle_stiffness": Assumed(SADDLE, "stiffness"),
    "saddle_damping_ratio": Assumed(
        SADDLE, DAMPING_RATIO, 0.2, (0.1, 0.5), "of the seated rider on the saddle, assumed; no measurement is public"
    ),
    "dry_friction": Assumed(
        "steer_damper", "dry friction", 0.10, (0.05, 0.15), "N m, measured likewise; in the smallest bump alone"
    ),
    "trail": Assumed(
        "pneumatic_trail",
        "trail",
        range=(0.012, 0.026),
        reason="of the packaged Schwalbe tyre at 300 to 600 N, 3 to 5 bar; a diagnosis starts from no pneumatic trail",
    ),
    "twisting": Assumed("twisting_torque", "twisting_stiffness"),
    "arm_inertia": Assumed("rider_arms", "inertia"),
    "arm_stiffness": Assumed("rider_arms", "stiffness"),
    "arm_damping": Assumed("rider_arms", "damping"),
    "tense_arm_inertia": Assumed("rider_arms", "inertia", 0.05, reason="a tense grip"),
    "tense_arm_stiffness": Assumed("rider_arms", "stiffness", 30.0, reason="a tense grip"),
    "tense_arm_damping": Assumed("rider_arms", "damping", 0.3, reason="a tense grip"),
}
"""Number of the study -> where it is declared; all that differs from the declaration is here, with its reason."""


OF_FRONT = ("stiffness", "damping_ratio")
OF_ARMS = ("inertia", "stiffness", "damping")
RELAXED, TENSE = "relaxed", "tense"  # grips


@dataclass(frozen=True)
class Front:
    """Front-frame compliance: joint at ``joint_height`` (m) on the steer axis, SI units."""

    stiffness: float = ASSUMED["stiffness"].usual  # N m/rad, of the joint
    damping_ratio: float = ASSUMED["damping_ratio"].usual  # of the front frame on its joint, rear frame held
    joint_height: float = -ASSUMED["joint_z"].usual  # m above the ground
    joint_x: float | None = None  # m before the rear contact; None: on the steer axis
    # rad, joint axis above the horizontal, forward end up; None: perpendicular to the steer axis
    axis_tilt: float | None = None
    from_file: bool = False  # True: of a model file; False: assumed
    defaults: tuple[str, ...] = ()  # of stiffness and damping ratio, those that the model file omits

    def hinge_x(self, p: Table) -> Any:
        """Place of the joint, m before the rear contact of a parameter set."""
        return p["w"] + p["c"] - self.joint_height * np.tan(p["lam"]) if self.joint_x is None else self.joint_x

    def damping(self, p: Table) -> Any:
        """Damping of the joint, N m s/rad, on a bicycle with the parameters ``p``."""
        tilt = p["lam"] if self.axis_tilt is None else self.axis_tilt
        place = {"joint_x": self.hinge_x(p), "joint_z": -self.joint_height, "axis_tilt": tilt}
        return self.damping_ratio * critical_damping(self.stiffness, front_inertia(p, **place))


@dataclass(frozen=True)
class Arms:
    """Both hands on the handlebar: impedance of the arms about the steer axis, SI units (effect ``rider_arms``)."""

    inertia: float = ASSUMED["arm_inertia"].usual  # kg m^2, about the steer axis
    stiffness: float = ASSUMED["arm_stiffness"].usual  # N m/rad, against steering
    damping: float = ASSUMED["arm_damping"].usual  # N m s/rad, against steering
    grip: str = RELAXED  # RELAXED or TENSE; empty: of a model file
    from_file: bool = False  # True: of a model file; False: assumed
    defaults: tuple[str, ...] = ()  # those that the model file omits


TENSE_ARMS = Arms(
    ASSUMED["tense_arm_inertia"].usual,
    ASSUMED["tense_arm_stiffness"].usual,
    ASSUMED["tense_arm_damping"].usual,
    grip=TENSE,
)


def shifts(assumed: Assumed) -> tuple[float, float]:
    """Range of a parameter less its assumed value, SI, rounded as the table states it."""
    low, high = (round(end - assumed.usual, 9) for end in assumed.ends)
    return low, high


@dataclass(frozen=True)
class Ranges:
    """Ranges of the assumed values: (low, high) of each, SI; ``hinge`` as a shift, those of the arms as factors."""

    stiffness: tuple[float, float] = ASSUMED["stiffness"].ends  # N m/rad, of the front frame
    damping_ratio: tuple[float, float] = ASSUMED["damping_ratio"].ends  # of the front frame on its joint
    hinge: tuple[float, float] = shifts(ASSUMED["joint_z"])  # m, added to the height of the joint
    friction: tuple[float, float] = ASSUMED["friction"].ends  # N m s/rad, of the steering
    camber_share: tuple[float, float] = LIMITS.camber_range  # 1/rad of the load; of a stated camber stiffness a factor
    trail: tuple[float, float] = ASSUMED["trail"].ends  # m, of either tyre
    twisting: tuple[float, float] = ASSUMED["twisting"].ends  # N m/rad, of either tyre
    arm_inertia: tuple[float, float] = LIMITS.arms  # of the inertia of the case
    arm_stiffness: tuple[float, float] = LIMITS.arms  # of its stiffness
    arm_damping: tuple[float, float] = LIMITS.arms  # of its damping
    # N m/rad, of the seated rider on the saddle, and share of critical damping; None: the rider is fixed, or known
    saddle_stiffness: tuple[float, float] | None = None
    saddle_damping_ratio: tuple[float, float] | None = None

    @property
    def drawn(self) -> dict[str, tuple[float, float]]:
        """Ranges of what the samples vary."""
        return {name: ends for name, ends in vars(self).items() if ends is not None}


PerWheel = float | tuple[float, float]
HANDS = {"off": "hands off", "on": "hands on", RELAXED: "relaxed hands on", TENSE: "tense hands on"}


@dataclass(frozen=True)
class Setup:
    """One case: front-frame compliance (None: rigid), hands on the handlebar (None: off), further tyre properties.

    ``trail`` (m), ``twisting`` (N m/rad) and ``camber_share`` (1/rad of the load) are of both wheels, or rear and
    front; with a ``contact_half_length`` (m) the tyre is a string with its own pneumatic trail.
    """

    front: Front | None  # None: rigid front frame
    arms: Arms | None = None  # None: hands off
    friction: float = ASSUMED["friction"].usual  # N m s/rad, viscous, of the steering; 0 where a model file states it
    camber_share: PerWheel = LIMITS.camber_share
    trail: PerWheel = ASSUMED["trail"].usual
    twisting: PerWheel = ASSUMED["twisting"].usual
    contact_half_length: tuple[float, float] | None = None

    @property
    def front_name(self) -> str:
        """``rigid`` or ``flexible``."""
        return "flexible" if self.front else "rigid"

    @property
    def hands(self) -> str:
        """``off``, ``relaxed`` or ``tense``, or ``on`` with the arms of a model file."""
        return (self.arms.grip or "on") if self.arms else "off"

    @property
    def label(self) -> str:
        """Name of the case, as a heading."""
        return f"{HANDS[self.hands]}, {self.front_name} front frame"

    @property
    def assumed(self) -> bool:
        """True if the front frame of the case is assumed, not measured."""
        return self.front is not None and (not self.front.from_file or bool(self.front.defaults))

    @property
    def hands_assumed(self) -> bool:
        """True if the arms on the handlebar are assumed."""
        return self.arms is not None and (not self.arms.from_file or bool(self.arms.defaults))


@dataclass(frozen=True)
class Settings:
    """One main study."""

    bicycle: Bicycle  # with its rider, if there is one
    # (n,), m/s, rising, at which modes are computed
    speeds: Array = field(default_factory=lambda: np.linspace(0, 30, 121))
    front: Front | None = field(default_factory=Front)  # None: unknown, and none is assumed
    arms: Arms = field(default_factory=Arms)  # of the cases with hands on; assumed ones are relaxed
    camber_share: float = LIMITS.camber_share  # 1/rad of the load, assumed camber stiffness of a tyre that states none
    trail: float = ASSUMED["trail"].usual  # m, likewise
    twisting: float = ASSUMED["twisting"].usual  # N m/rad, likewise
    further: Mapping[str, Table] = field(default_factory=dict)  # other effects of the model file and their tables
    # of front frame, hands and other effects, as the model file states it
    measured: ParameterCovariance = field(default_factory=ParameterCovariance)
    tyre: str = ""  # packaged, or a file; empty: every packaged one
    surface: str | None = None  # of the tyre, as its file names it; None: not chosen
    pressures: tuple[float, ...] = ()  # bar, rising; empty: those that were measured
    contact: Table | None = None  # table of the contact law in the model file; None: tyres are measured ones
    postures: tuple[Bicycle, ...] = ()  # the same bicycle with its rider in each posture; empty: none is known
    common_error: float = 1.0  # share of the variance of a tyre's numbers common to its pressures, as of one rig
    report_speed: float = 15.0  # m/s, at which frequency and damping ratio are reported
    max_speed: float = 60.0  # m/s, up to which critical speeds are searched
    samples: int = 500  # Monte Carlo samples that check each linear standard uncertainty
    seed: int = 0  # of all random numbers
    fronts: int = 64  # samples for each case

    @property
    def fastest(self) -> float:
        """Highest speed studied, m/s."""
        return float(self.speeds[-1])

    @property
    def has_moment(self) -> bool:
        """True if the model file gives the tyres an aligning moment of their own."""
        slot = effect_class(ASSUMED["trail"].effect).slot
        return any(effect_class(name).slot == slot for name in self.further)

    @property
    def reference(self) -> Setup:
        """Reference case, with the least damped wobble: hands off, flexible front frame if one is known."""
        return self.setups[0]

    @property
    def friction(self) -> float:
        """Viscous friction of the steering, N m s/rad; 0 if the model file states the damping of the steering."""
        return 0.0 if "steer_damper" in self.further else ASSUMED["friction"].usual

    @property
    def grips(self) -> tuple[Arms, ...]:
        """Arms of the cases with hands on: those of the model file, or relaxed and tense ones."""
        return (self.arms,) if self.arms.from_file else (self.arms, TENSE_ARMS)

    @property
    def setups(self) -> tuple[Setup, ...]:
        """Cases, the reference first: hands off and every grip, then hands off and relaxed with a rigid front frame.

        A front frame whose stiffness the model file states is not rigid.
        """
        hands = [(self.front, arms) for arms in (None, *self.grips)]
        if self.front and not self.front_stated:
            hands += [(None, arms) for arms in (None, self.arms)]
        return tuple(
            Setup(front, arms, self.friction, self.camber_share, self.trail, self.twisting) for front, arms in hands
        )

    @property
    def front_stated(self) -> bool:
        """True if the model file states the stiffness of the front frame."""
        return self.front is not None and self.front.from_file and "stiffness" not in self.front.defaults

    @property
    def ranges(self) -> Ranges:
        """Ranges around the assumed values; a number of a model file is varied by 20 %."""
        stated: dict[str, float] = {}  # number of the model file, SI
        if self.front and self.front.from_file:
            of_front = [name for name in OF_FRONT if name not in self.front.defaults]
            stated |= {name: getattr(self.front, name) for name in of_front}
        if self.arms.from_file:
            of_arms = [name for name in OF_ARMS if name not in self.arms.defaults]
            stated |= dict.fromkeys((f"arm_{name}" for name in of_arms), 1.0)
        if "camber_thrust" in self.further:
            stated["camber_share"] = 1.0
        within = 1 - LIMITS.written
        ranges = {name: (within * value, value / within) for name, value in stated.items()}
        ranges |= {name: self._two_sd(name, value) for name, value in stated.items() if self._measured_sd(name)}
        if self.front and "damping_ratio" not in stated and SADDLE in self.further:
            ranges["damping_ratio"] = ASSUMED["bare_damping_ratio"].ends
        saddle = self.further.get(SADDLE)
        if saddle is not None and "stiffness" not in saddle:
            ranges["saddle_stiffness"] = ASSUMED["saddle_stiffness"].ends
        if saddle is not None and not {"damping", DAMPING_RATIO} & set(saddle):
            ranges["saddle_damping_ratio"] = ASSUMED["saddle_damping_ratio"].ends
        if self.front and self.front.from_file:
            height_sd = self.measured.sd.get("front_compliance.joint_z", 0.01)  # m
            ranges["hinge"] = (-2 * height_sd, 2 * height_sd)
        if "steer_damper" in self.further:
            ranges["friction"] = (0.0, 0.0)
        return Ranges(**ranges)

    def _measured_sd(self, name: str) -> float:
        """Relative standard uncertainty that the model file states of a number of :class:`Ranges`; 0: none."""
        if not self.front:
            return 0.0
        damping = float(self.front.damping(self.bicycle.values))
        numbers = {
            "stiffness": ("front_compliance.stiffness", self.front.stiffness),
            "damping_ratio": ("front_compliance.damping", damping),
        } | {f"arm_{name}": (f"rider_arms.{name}", getattr(self.arms, name)) for name in OF_ARMS}
        key, value = numbers.get(name, ("", 0.0))
        return self.measured.sd.get(key, 0.0) / value if value else 0.0

    def _two_sd(self, name: str, value: float) -> tuple[float, float]:
        """Range of two standard uncertainties about a stated ``value``, from half of it on, which stays positive."""
        relative = self._measured_sd(name)
        return value * max(1 - 2 * relative, 0.5), value * (1 + 2 * relative)

    @property
    def left_out(self) -> tuple[str, ...]:
        """Names of the values of front frame and arms that a model file omits, which are assumed."""
        of_front = [name.replace("_", " ") for name in self.front.defaults] if self.front else []
        return (*(f"front-frame {name}" for name in of_front), *(f"arm {name}" for name in self.arms.defaults))


def assumed_front(bicycle: Bicycle, *, moving_rider: bool = False) -> Front | None:
    """Assume front-frame compliance for a ``bicycle``; None if it is unlike the measured ones, as a cargo bicycle.

    With a rider that moves on the saddle the damping is that of the frame alone.
    """
    if not LIMITS.wheelbase[0] <= bicycle["w"] <= LIMITS.wheelbase[1]:
        return None
    if not LIMITS.wheel[0] <= bicycle["rF"] <= LIMITS.wheel[1]:
        return None
    return Front(damping_ratio=assumed_ratio(moving_rider=moving_rider))


def assumed_ratio(*, moving_rider: bool) -> float:
    """Assumed damping ratio of the front: of the frame alone, or of the frame with a rider fixed to it."""
    return ASSUMED["bare_damping_ratio" if moving_rider else "damping_ratio"].usual


def settings_of(
    model: str | None = None,
    *,
    bicycle: str | None = None,
    tyre: str | None = None,
    surface: str | None = None,
    pressures: str | None = None,
    rider: str | None = None,
    posture: str | None = None,
    common_error: float = 1.0,
    rider_saddle: bool = False,
) -> Settings:
    """Read the study of a model file, or of a bicycle with everything else assumed."""
    tyre_options: dict[str, Any] = {
        "tyre": tyre or "",
        "surface": surface,
        "pressures": read_pressures(pressures),
        "common_error": common_error,
    }
    if surface is not None and tyre is None:
        raise InputError(f"--surface {surface} applies to a measured tyre; give --tyre too, for example --tyre Tyre1")
    named_bicycle = None if model is None else find_bicycle(model)
    if named_bicycle is not None:
        if bicycle is not None:
            raise InputError(f"two bicycles, {model} and --bicycle {bicycle}; remove one")
        model, bicycle = None, named_bicycle
    if posture is not None and rider is None:
        raise InputError(f"--posture {posture} requires --rider, or a packaged bicycle with a rider in this posture")
    if model is not None:
        if rider_saddle:
            raise InputError(f"--rider-saddle: write [effects.{SADDLE}] into {model} instead")
        for option, value in (("bicycle", bicycle), ("rider", rider)):
            if value is not None:
                raise InputError(
                    f"--{option} {value}: a model file names its own bicycle; remove --{option} or change 'bicycle' "
                    f"in {model}"
                )
        content = _read_model_file(model)
        assumed = assumed_front(content["bicycle"], moving_rider=SADDLE in content["further"])
        if tyre is not None and "contact" in content:
            law = f"its own contact law, [effects.{LAW}]"
            raise InputError(f"{model} has {law}; change the tyre there, or remove --tyre")
        return Settings(**{"front": assumed} | content | tyre_options)
    if rider is not None:
        if bicycle is None:
            raise InputError(f"--rider {rider} requires --bicycle, for example --bicycle pista")
        chosen, postures = _with_rider(bicycle, rider, posture)
    else:
        chosen = load_bicycle(bicycle or DEFAULT_BICYCLE)
        postures = _packaged_postures(chosen)
    if rider_saddle and chosen["mB"] < LIGHTEST_RIDDEN:
        raise InputError(f"--rider-saddle: {chosen.name} has no rider; choose a bicycle with one, or give --rider")
    further: dict[str, Table] = {SADDLE: {}} if rider_saddle else {}
    front = assumed_front(chosen, moving_rider=rider_saddle)
    return Settings(chosen, front=front, further=further, postures=postures, **tyre_options)


def read_pressures(text: str | None) -> tuple[float, ...]:
    """Read pressures in bar from a ``text`` like ``3.5,5,7``, ascending."""
    if text is None:
        return ()
    bars = typed_numbers(text.split(","), "bar")
    if not bars:
        raise InputError(f"--pressures {text!r}: give bar, for example 3.5,5,7, or the unit after the last: 50,80psi")
    for bar in bars:
        if not (math.isfinite(bar) and 0 < bar <= MOST_BAR):
            raise InputError(f"--pressures {text!r}: {bar:g} is out of range; give above 0 and up to {MOST_BAR:g} bar")
    if len(set(bars)) < len(bars):
        raise InputError(f"--pressures {text!r} repeats a pressure; give each once")
    return tuple(sorted(bars))


def _read_model_file(model: str) -> dict[str, Any]:
    """Read the fields of :class:`Settings` that a model file gives; refuse a contact law other than a lag."""
    whole = read_model(model)  # reports all errors of the file
    law = next(effect.identifier for effect in whole.effects if effect.slot == "contact law")
    if law not in (LAW, DEFAULT_CONTACT):
        raise InputError(
            f"{model}: the main study requires tyres with a relaxation length, but the file has {law}; use {LAW}, or "
            f"velotyre critical {model} for this model"
        )
    plain_tables, _ = plain_effects(read_toml(Path(model), "model file").get("effects", {}))
    folder = Path(model).parent
    with_rider = {
        name: with_rider_body(effect_class(name), table, whole.bicycle, folder) for name, table in plain_tables.items()
    }
    tables = _with_numbers(with_rider, whole)
    contact, front, arms = (tables.pop(name, None) for name in (LAW, "front_compliance", "rider_arms"))
    tables.pop(DEFAULT_CONTACT, None)
    for name in ("trail", "twisting"):  # an empty table states no number: the study assumes one of every tyre
        if not tables.get(ASSUMED[name].effect, True):
            del tables[ASSUMED[name].effect]
    of_effects = [name for name in whole.covariance.of_file if ParameterKey.parse(name).effect not in ("", LAW)]
    measured = ParameterCovariance(tuple(of_effects), whole.covariance.among(of_effects))
    content: dict[str, Any] = {"bicycle": whole.bicycle, "further": tables, "measured": measured}
    if contact is not None:
        content["contact"] = located(contact, Path(model).parent)
    if front is not None:
        content["front"] = _read_front(front, whole.bicycle, moving_rider=SADDLE in tables)
    if arms is not None:
        effect = effect_class("rider_arms")(**arms)
        numbers = {name: float(getattr(effect, name)) for name in OF_ARMS}
        defaults = tuple(name for name in OF_ARMS if name not in arms)
        content["arms"] = Arms(**numbers, grip="", from_file=True, defaults=defaults)
    return content


def _read_front(table: Table, bicycle: Bicycle, *, moving_rider: bool) -> Front:
    """Read the front frame of the model file's ``table``; a damping that it omits is assumed."""
    values = effect_class("front_compliance")(**table).values(bicycle.values)
    number = {ParameterKey.parse(key).entry: value for key, value in values.items()}
    place = {name: number[name] for name in ("joint_x", "joint_z", "axis_tilt")}
    ratio = number["damping"] / critical_damping(number["stiffness"], front_inertia(bicycle.values, **place))
    omitted = [] if "stiffness" in table else ["stiffness"]
    if "damping" not in table and DAMPING_RATIO not in table:
        omitted.append("damping_ratio")
        ratio = assumed_ratio(moving_rider=moving_rider)
    return Front(
        number["stiffness"],
        float(ratio),
        -number["joint_z"],
        number["joint_x"],
        number["axis_tilt"],
        from_file=True,
        defaults=tuple(omitted),
    )


def _with_numbers(tables: Mapping[str, Any], model: Model) -> dict[str, Any]:
    """Copy the tables of effects; further properties of the tyre become numbers."""
    numbers = {name: dict(table) for name, table in tables.items()}
    for text in values_of_tyres(tables):
        key = ParameterKey.parse(text)
        if key.effect != LAW:
            value = numbers[key.effect][key.name]
            by_wheel = dict(value) if isinstance(value, Mapping) else dict.fromkeys(WHEELS, value)
            numbers[key.effect][key.name] = by_wheel | {key.wheel: model.parameters[text]}
    return numbers


def _with_rider(frame: str, rider: str, posture: str | None) -> tuple[Bicycle, tuple[Bicycle, ...]]:
    """Put a rider on a frame; also return the bicycles with this rider in every possible posture."""
    from bicycle.rider.rider_body import read_rider
    from bicycle.rider.rider_frame import rider_on_bicycle
    from studies.reporting.rider_report import with_provenance

    person = read_rider(rider)
    frame_without_rider = load_bicycle(frame)
    geometry_file = packaged_geometry(frame)

    def seat(posture: str) -> Bicycle:
        geometry = read_geometry(geometry_file, posture) if geometry_file else SeatGeometry()
        cyclist = rider_on_bicycle(frame_without_rider, person, posture=posture, geometry=geometry)
        return with_provenance(cyclist, f"{frame_without_rider.name}_{Path(rider).stem}_{posture}")

    chosen = seat(posture or DEFAULT_POSTURE)
    bicycles = []
    for name in POSTURES:
        try:
            bicycles.append(chosen if chosen.name.endswith(f"_{name}") else seat(name))
        except InputError:  # out of reach in this posture
            continue
    return chosen, tuple(bicycles)


def _packaged_postures(bicycle: Bicycle) -> tuple[Bicycle, ...]:
    """Load the packaged bicycles that differ from a packaged one by the rider's posture; none without such a family."""
    stem, _, posture = bicycle.name.rpartition("_")
    family = [f"{stem}_{name}" for name in POSTURES]
    packaged = posture in POSTURES and set(family) <= set(available_bicycles())
    if not packaged or load_bicycle(bicycle.name).values != bicycle.values:  # or a user's file with the same name
        return ()
    return tuple(load_bicycle(name) for name in family)
