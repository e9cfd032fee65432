"""A bicycle file from what its owner can measure: what follows from it, and which measurement would help most."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from bicycle.effects.effect import WHEELS
from bicycle.effects.effect_registry import effect_class
from bicycle.files import scaled_bicycle as scaled
from bicycle.files.bicycle_numbers import FORK_OFFSET, read_body, trail_of_offset
from bicycle.files.wheel_size import WheelSize, read_wheel_size
from bicycle.model.default_sd import DEFAULTS
from bicycle.model.model import Model
from bicycle.model.wheel_tyres import joint_wheel_tyres
from bicycle.parameters.bicycle import UNITS, Bicycle, doubts_about
from bicycle.parameters.front_hinge import height_above_hub, hinge_at
from bicycle.rider.rider_body import RigidBody
from bicycle.stability.critical import DESTABILISING, STABILISING, CriticalSpeed, critical_speeds
from bicycle.stability.propagation import critical_speed_gradients, model_covariance, standard_deviation
from studies.front_frame.hinge_report import default_damping, hinge_tables
from studies.front_frame.published import FrontHinge, PublishedFigures, map_figures, read_map
from studies.main_study.result import wobble_span
from studies.main_study.settings import Front, Ranges, assumed_front
from studies.reporting.markdown_text import render_file
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError


@dataclass(frozen=True)
class Limits:
    """Numbers of a guess: how it is reported, and what of wobble is assumed."""

    flattened: float = 0.93  # of the height of a tyre, left under a rider: 23 mm of a racing tyre roll on 332 mm
    rim_sd: float = 0.003  # m, of a radius from the words on a tyre
    spread: tuple[float, float] = (0.05, 0.95)  # quantiles of the plausible bicycles between which a speed is given
    draws: int = 300  # plausible bicycles for weave and capsize
    wobble_draws: int = 100  # of these for wobble, which takes longer
    fewest: int = 10  # of them that wobble, for an interval of its onset
    fastest: float = 15.0  # m/s, up to which weave and capsize are looked for
    ridden: float = 20.0  # m/s, and wobble
    tyre: str = "Tyre1"  # packaged tyre on both wheels for wobble
    bar: float = 5.5  # bar, its pressure
    stiffness: tuple[float, float] = Ranges.stiffness  # of a flexible front, N m/rad, drawn evenly in its logarithm
    damping_ratio: tuple[float, float] = Ranges.damping_ratio  # of that front, frame and seated rider, likewise
    friction: tuple[float, float] = Ranges.friction  # N m s/rad, viscous, of the steering, likewise
    # m, of its hinge on the steer axis
    height: tuple[float, float] = (Front.joint_height + Ranges.hinge[0], Front.joint_height + Ranges.hinge[1])


LIMITS = Limits()


@dataclass(frozen=True)
class Asked:
    """Measurements of an owner: lengths in m, the head angle in degrees from the horizontal, masses in kg."""

    wheelbase: float  # m
    head_angle: float  # degrees, steer axis above the horizontal
    wheel: str  # size in words as on a tyre, such as 28-622
    mass: float  # kg, of the bicycle without rider
    # m, positive where the steer axis meets the ground before the contact; None: from the fork offset
    trail: float | None = None
    fork_offset: float | None = None  # m, wheel centre before the steer axis; None: the trail is measured
    rider_height: float | None = None  # m, standing; None: no rider, or one by mass and place
    rider_mass: float | None = None  # kg; None: no rider
    rider_place: tuple[float, float] | None = None  # of the rider's mass centre: m before the rear contact, m up
    rider_inertia: tuple[float, ...] | None = None  # Ixx, Iyy, Izz, perhaps Ixz about it, kg m^2, z down
    posture: str = "hoods"  # how the rider sits, one of POSTURES
    front_wheel_mass: float | None = None  # kg, with tyre; None: guessed
    fork_mass: float | None = None  # kg, of fork and handlebar; None: guessed
    front_wheel_inertia: float | None = None  # kg m^2, about the axle; None: guessed
    published: PublishedFigures | None = None  # of the front frame; None: its stiffness is assumed

    @property
    def hinge(self) -> FrontHinge | None:
        """Hinge of the front frame by published figures; None without any."""
        return None if self.published is None else map_figures(self.published, read_map())

    @property
    def geometry(self) -> scaled.Geometry:
        """Checked geometry."""
        radius, lam = self.wheel_radius, math.radians(90 - self.head_angle)
        options = {"w": "wheelbase", "c": "trail", "lam": "head-angle", "rR": "wheel"}
        if self.fork_offset is not None:
            options["c"] = f"fork-offset {self.fork_offset:g}"
        for doubt in doubts_about({"w": self.wheelbase, "lam": lam, "rR": radius}):
            if doubt.key == "lam":
                raise InputError(f"--head-angle {self.head_angle:g}: give degrees from the horizontal, 56 to 90")
            raise InputError(f"--{options[doubt.key]}: {doubt.text}")
        trail = self._trail(lam, radius)
        for doubt in doubts_about({"c": trail}):
            raise InputError(f"--{options['c']}: {doubt.text}")
        if not 4 <= self.mass <= 60:
            raise InputError(f"--mass {self.mass:g} is the bicycle's without rider, 4 to 60 kg")
        return scaled.Geometry(self.wheelbase, trail, lam, radius, radius, self.mass)

    @property
    def rider_words(self) -> str:
        """The rider in a few words; empty without one."""
        if self.rider_mass is None:
            return ""
        if self.rider_place is None:
            return f", rider {self.rider_height:g} m, {self.rider_mass:g} kg, {self.posture}"
        x, height = self.rider_place
        size = "" if self.rider_inertia else ", a point"
        return f", rider {self.rider_mass:g} kg at {x:g} m, {height:g} m up{size}"

    @property
    def wheel_size(self) -> WheelSize:
        """Rim and tyre of both wheels."""
        try:
            return read_wheel_size(self.wheel)
        except InputError as error:
            raise InputError(f"--wheel {error}") from error

    @property
    def wheel_radius(self) -> float:
        """Radius (m) at which a wheel rolls under its load."""
        return (self.wheel_size.rim / 2 + LIMITS.flattened * self.wheel_size.width) / 1e3

    def _trail(self, lam: float, radius: float) -> float:
        """Trail (m) as it was measured, or as it follows from the offset of the fork."""
        if (self.trail is None) == (self.fork_offset is None):
            raise InputError("give one of --trail and --fork-offset (rake, the hub before the steer axis)")
        if self.trail is not None:
            return self.trail
        assert self.fork_offset is not None
        return trail_of_offset(self.fork_offset, lam, radius)

    @property
    def weighed(self) -> dict[str, tuple[float, float]]:
        """Features that the owner has measured, with their sd."""
        weighed, q = {}, self.geometry
        masses = {"mF": ("front-wheel-mass", self.front_wheel_mass), "mH": ("fork-mass", self.fork_mass)}
        for key, (option, value) in masses.items():
            if value is not None and not 0.02 * self.mass < value < 0.5 * self.mass:
                raise InputError(f"--{option} {value:g} kg is outside 2 to 50 % of the bicycle mass, {self.mass:g} kg")
            if value is not None:
                weighed[key] = (scaled.feature(key, value, q), DEFAULTS[key][0])
        if self.front_wheel_inertia is not None:
            if self.front_wheel_mass is None:
                raise InputError("--front-wheel-inertia needs --front-wheel-mass; weigh the wheel too")
            share = self.front_wheel_inertia / self.front_wheel_mass / q.rF**2
            if not 0.2 < share <= 1:
                raise InputError(
                    f"--front-wheel-inertia {self.front_wheel_inertia:g} kg m^2 is {share:.2g} of m r^2; a wheel has "
                    "0.3 to 0.9 of it about its axle"
                )
            inertia = scaled.feature("IFyy", self.front_wheel_inertia, q, self.front_wheel_mass)
            weighed["IFyy"] = (inertia, DEFAULTS["IFyy"][0])
        return weighed


@dataclass(frozen=True)
class Band:
    """A speed (m/s), and the ends between which nine of ten samples have it; NaN without one."""

    value: float  # m/s, of the guessed bicycle
    low: float  # m/s
    high: float  # m/s
    share: float  # of the plausible bicycles that have it


@dataclass(frozen=True)
class Help:
    """Options of a measurement that would help, and the sd (m/s) of weave and capsize without and with it."""

    options: str  # as typed in a terminal, with a placeholder for each number
    weave: tuple[float, float]  # m/s
    capsize: tuple[float, float]  # m/s


@dataclass(frozen=True)
class OwnBicycle:
    """A bicycle from what one has, and what follows from it."""

    bicycle: Bicycle  # measured and guessed parameters with their covariance
    measured_keys: tuple[str, ...]  # keys of the bicycle's parameters that were measured
    weave: Band  # speeds at which it becomes stable
    capsize: Band  # speeds at which it becomes unstable
    wobble: Band | None  # onset; its share is a probability; None where no front is known
    helps: tuple[Help, ...]  # measurements that would reduce the uncertainty, the easiest first
    outside_measured: Mapping[
        str, tuple[float, float, float]
    ]  # what no measured bicycle is like: value, their least and largest


def own_bicycle(measurements: Asked, name: str, *, seed: int = 45) -> OwnBicycle:
    """Guess what the owner did not measure, and compute critical speeds and which measurement would help."""
    guess = scaled.guess_bicycle(measurements.geometry).condition_on(measurements.weighed)
    rider, causes = _rider(measurements, guess)
    bicycle = guess.bicycle(name, "", "", rider=rider, causes=causes)
    nominal = critical_speeds(Model(bicycle), LIMITS.fastest)
    rng = np.random.default_rng(seed)
    plausible = [_vary_rider(scaled.with_rider(frame, rider), causes, rng) for frame in guess.draws(rng, LIMITS.draws)]
    crossings = [critical_speeds(Model(_make_bicycle(values)), LIMITS.fastest) for values in plausible]
    weave, capsize = (_band(nominal, crossings, mode) for mode in ("weave", "capsize"))
    wobble, hinge = None, measurements.hinge
    if hinge is not None:
        hinge.effect_numbers(bicycle)  # refuses a bicycle that is unlike the racing frames of the figures
    if assumed_front(bicycle):
        onsets = np.array([_onset(values, rng, hinge) for values in plausible[: LIMITS.wobble_draws]])
        wobbles = np.isfinite(onsets)
        ends = _ends(onsets) if wobbles.sum() >= LIMITS.fewest else (math.nan, math.nan)
        wobble = Band(math.nan, *ends, float(wobbles.mean()))
    measured_keys = ("w", "c", "lam", "rR", "rF", *measurements.weighed)
    helps = _helps(measurements, guess, rider, causes)
    outside = _find_outside_measured(guess.geometry)
    return OwnBicycle(bicycle, measured_keys, weave, capsize, wobble, helps, outside)


def _find_outside_measured(geometry: scaled.Geometry) -> dict[str, tuple[float, float, float]]:
    """Find what lies a tenth or more outside of all measured bicycles: its value, their least and their largest."""
    measured = [asdict(scaled.Geometry.of(bicycle.values)) for bicycle in scaled.measured_bicycles().values()]
    value_and_ends = {}
    for key, value in asdict(geometry).items():
        values = [bicycle[key] for bicycle in measured]
        value_and_ends[key] = value, min(values), max(values)
    return {key: ends for key, ends in value_and_ends.items() if not 0.9 * ends[1] <= ends[0] <= 1.1 * ends[2]}


def _rider(measurements: Asked, guess: scaled.Guess) -> tuple[RigidBody | None, dict[str, Array]]:
    """Make the rider's body on the bicycle, and changes of the rear frame by one sd of each of its causes."""
    if measurements.rider_place is not None or measurements.rider_inertia is not None:
        return _placed_rider(measurements), {}
    if measurements.rider_height is None and measurements.rider_mass is None:
        return None, {}
    if measurements.rider_height is None or measurements.rider_mass is None:
        raise InputError("--rider-height and --rider-mass need each other; omit both for a bicycle without rider")
    from bicycle.rider.rider_body import scaled_rider
    from bicycle.rider.rider_frame import rider_on_bicycle
    from bicycle.rider.rider_posture import SeatGeometry

    person = scaled_rider(height=measurements.rider_height, mass=measurements.rider_mass)
    seated = rider_on_bicycle(
        _make_bicycle(guess.values()), person, posture=measurements.posture, geometry=SeatGeometry()
    )
    return seated.body, dict(seated.causes)


def _placed_rider(measurements: Asked) -> RigidBody:
    """The rider by mass, place and perhaps inertia, which are treated as exact."""
    if measurements.rider_place is None or measurements.rider_mass is None or measurements.rider_height is not None:
        raise InputError("--rider-place and --rider-inertia need --rider-mass and exclude --rider-height")
    entry: dict[str, Any] = {"mass": measurements.rider_mass, "place": list(measurements.rider_place), "name": "rider"}
    inertia = {} if measurements.rider_inertia is None else {"inertia": list(measurements.rider_inertia)}
    return read_body(entry | inertia)


def _make_bicycle(values: Mapping[str, float]) -> Bicycle:
    return Bicycle("plausible", {key: values[key] for key in UNITS})


def _vary_rider(values: dict[str, float], causes: Mapping[str, Array], rng: np.random.Generator) -> dict[str, float]:
    """Draw a rider near the guessed one: the ``values`` (SI) with each of the ``causes`` moved by a normal number."""
    from bicycle.rider.rider_frame import FRAME_KEYS

    changes = sum((rng.standard_normal() * np.nan_to_num(step) for step in causes.values()), np.zeros(len(FRAME_KEYS)))
    return values | {key: values[key] + float(by) for key, by in zip(FRAME_KEYS, changes, strict=True) if key in values}


def _speed(crossings: tuple[CriticalSpeed, ...], mode: str) -> float:
    """Last speed (m/s) at which weave becomes stable, or the first at which capsize becomes unstable; NaN: none."""
    ordered, direction = (crossings[::-1], STABILISING) if mode == "weave" else (crossings, DESTABILISING)
    return next((c.speed for c in ordered if c.mode == mode and c.direction == direction), math.nan)


def _ends(speeds: Array) -> tuple[float, float]:
    """Quantiles :attr:`Limits.spread` of ``speeds`` (m/s) without those that are NaN; NaN without any."""
    if not np.isfinite(speeds).any():
        return math.nan, math.nan
    low, high = np.nanquantile(speeds, LIMITS.spread)
    return float(low), float(high)


def _band(nominal: tuple[CriticalSpeed, ...], samples: list[tuple[CriticalSpeed, ...]], mode: str) -> Band:
    """The speed of a ``mode`` of the ``nominal`` bicycle, its interval and share in the ``samples``."""
    speeds = np.array([_speed(crossings, mode) for crossings in samples])
    return Band(_speed(nominal, mode), *_ends(speeds), float(np.isfinite(speeds).mean()))


def _onset(values: dict[str, float], rng: np.random.Generator, published: FrontHinge | None) -> float:
    """Find the first speed (m/s) of wobble, hands off, on a measured tyre with a sampled front frame; NaN without.

    Stiffness and place of the hinge are drawn from their assumed ranges, or as ``published`` figures leave them open.
    """
    bicycle, per_wheel = _make_bicycle(values), ("cornering_stiffness", "relaxation_length")
    condition: dict[str, Any] = {"tyre": LIMITS.tyre, "surface": None, "pressure_bar": LIMITS.bar, "extrapolate": True}
    tyres = joint_wheel_tyres(bicycle=bicycle, **condition).properties
    contact = {key: dict(zip(WHEELS, (getattr(tyre, key) for tyre in tyres), strict=True)) for key in per_wheel}
    sampled = (LIMITS.stiffness, LIMITS.damping_ratio, LIMITS.friction)
    stiffness, damping_ratio, friction = (math.exp(rng.uniform(*np.log(ends))) for ends in sampled)
    joint_z = -rng.uniform(*LIMITS.height)
    joint_x = values["w"] + values["c"] + joint_z * math.tan(values["lam"])
    if published is not None:
        departure = rng.multivariate_normal((0.0, 0.0), published.covariance)
        stiffness = published.stiffness * math.exp(departure[0])
        joint_x, joint_z = hinge_at(values, published.height + departure[1])
    hinge = effect_class("front_compliance")(
        stiffness=stiffness, damping_ratio=damping_ratio, joint_x=joint_x, joint_z=joint_z
    )
    tyre, steering = effect_class("relaxation_length")(**contact), effect_class("steer_damper")(damping=friction)
    linear = Model(bicycle, (tyre, steering, hinge)).linear_model()
    critical = critical_speeds(linear, LIMITS.ridden)
    span = wobble_span(linear, critical, hands_on=False, limit=LIMITS.ridden)
    return span.low if span else math.nan


def _helps(
    measurements: Asked, guess: scaled.Guess, rider: RigidBody | None, causes: Mapping[str, Array]
) -> tuple[Help, ...]:
    """List the measurements that are not made yet, from the easiest on, with the sds that each would leave."""
    options = {"mF": "--front-wheel-mass KG", "mH": "--fork-mass KG", "IFyy": "--front-wheel-inertia KG_M2"}
    bicycle = guess.bicycle("nominal", "", "", rider=rider, causes=causes)
    before, helps = _sds(bicycle, bicycle), {}
    for keys in (("mF",), ("mH",), ("mF", "mH"), ("mF", "mH", "IFyy")):
        new = [key for key in keys if key not in measurements.weighed]
        words = " ".join(options[key] for key in new)
        if new and words not in helps:
            measured = {key: (float(guess.mean[scaled.FEATURES.index(key)]), DEFAULTS[key][0]) for key in new}
            better = guess.condition_on(measured).bicycle("known", "", "", rider=rider, causes=causes)
            after = _sds(bicycle, better)
            helps[words] = Help(words, (before[0], after[0]), (before[1], after[1]))
    return tuple(helps.values())


def _sds(bicycle: Bicycle, spread: Bicycle) -> tuple[float, float]:
    """Sd (m/s) of the weave and the capsize speed of a bicycle by the covariance of ``spread``, to first order."""
    crossings = critical_speeds(Model(bicycle), LIMITS.fastest)
    names, covariance = model_covariance(Model(spread))
    sds = []
    for mode in ("weave", "capsize"):
        speed = _speed(crossings, mode)
        slopes = critical_speed_gradients(Model(bicycle), [c for c in crossings if c.speed == speed], names)
        sds.append(float(standard_deviation(slopes[0], covariance)) if len(slopes) else math.nan)
    return sds[0], sds[1]


def file_text(guessed: OwnBicycle, measurements: Asked, command: str, model_file: str) -> str:
    """Text of the bicycle's file, which names the ``command`` that wrote it and the model file to go on with."""
    matrix = guessed.bicycle.covariance.matrix
    sd = np.sqrt(np.diag(matrix))
    values, vectors = np.linalg.eigh(matrix / np.outer(sd, sd))
    significant = values > 1e-6 * values[-1]
    factor = (sd[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))[:, significant]
    forks = {} if measurements.fork_offset is None else {FORK_OFFSET: measurements.fork_offset}
    sd_of = {"w": "w", FORK_OFFSET if forks else "c": "c", "lam": "lam"}
    exact = {key: DEFAULTS[like][0] for key, like in sd_of.items()} | dict.fromkeys(("rR", "rF"), LIMITS.rim_sd)
    content: dict[str, Any] = {
        "own": guessed,
        "asked": measurements,
        "forks": forks,
        "command": command,
        "model_file": model_file,
        "units": UNITS,
        "makes": len(set(scaled.MAKES.values())),
        "frames": len(scaled.MAKES),
        "limits": LIMITS,
        "scaled": scaled.SCALED,
        "factor": factor,
        "sd": exact,
    }
    return render_file("studies.reporting", "own_bicycle.toml.j2", content, escaped=False)


def model_text(guessed: OwnBicycle, measurements: Asked, bicycle_file: str, file: str) -> str:
    """Text of a model ``file``: the bicycle of ``bicycle_file`` on a measured tyre, with a flexible front frame.

    A bicycle unlike those whose front frames were measured has a rigid one.

    Stiffness and damping of the front frame are left at their defaults, so that every command knows them as assumed;
    with published figures its stiffness and place are those that follow.
    """
    published, hinge = measurements.published, measurements.hinge
    bicycle, front = guessed.bicycle, assumed_front(guessed.bicycle)
    place = {"joint_x": front.hinge_x(bicycle.values), "joint_z": -front.joint_height} if front else {}
    content = {
        "bicycle": bicycle,
        "bicycle_file": bicycle_file,
        "file": file,
        "limits": LIMITS,
        "loads": bicycle.static_loads,
        "hinge": front
        and {
            **place,
            "stiffness": front.stiffness,
            "height": height_above_hub(bicycle.values, -front.joint_height),
        },
        "default": front and default_damping(bicycle, place),
        "published": hinge_tables(hinge, published, bicycle) if hinge and published else "",
    }
    return render_file("studies.reporting", "own_model.toml.j2", content, escaped=False)
