"""A bicycle from what one has: its 24 numbers by scaling from measured bicycles, with a joint covariance.

Each measured bicycle is written as numbers without a unit (:data:`FEATURES`): masses of the parts, places over
wheelbase and wheel radius, squares of radii of gyration. Their mean over the makes gives the numbers of another bicycle
of known geometry and mass. Their covariance is how far they are off if one make is left out at a time, inflated as few
makes were measured, with a quarter of each correlation, which so few can only hint at.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from bicycle.files.bicycle_files import load_bicycle, read_flat_text
from bicycle.parameters.bicycle import UNITS, Bicycle
from bicycle.parameters.parameter_covariance import ParameterCovariance
from bicycle.rider.rider_body import RigidBody, as_rear_frame, join, rear_frame
from tyre.ground.arrays import Array
from tyre.ground.files import data_root

MAKES = {
    "balanceassistv1": "Gazelle", "browser": "Batavus", "crescendo": "Batavus", "fisher": "Fisher", "pista": "Bianchi",
    "rigid": "Davis", "Yellow": "Yellow",
}  # fmt: skip
"""Measured bicycles without rider, with a fork as usual (that of kooijman2008 is reversed), and their makes."""


@dataclass(frozen=True)
class Scaling:
    """Numbers by which a bicycle is guessed from others."""

    inflation: float = 1.3  # of the scatter between makes
    kept: float = 0.25  # share of a correlation
    power: float = (
        0.25  # of the whole mass, with which wheels and front frame grow; with 1 makes left out fare twice as bad
    )


SCALING = Scaling()
FEATURES = (
    "mR", "mF", "mH", "IRyy", "IRxx", "IFyy", "IFxx", "xB", "zB", "IBxx", "IBzz", "IBxz", "xH", "zH", "IHxx", "IHzz",
    "IHxz",
)  # fmt: skip
"""Logarithms of m over a power of the whole mass, of I / (m r^2) and of Ixx / Iyy of a wheel; places over wheelbase or
radius, xH before the steer axis; the inverse tanh of the correlation Ixz / sqrt(Ixx Izz)."""
GIVEN = ("w", "c", "lam", "g", "rR", "rF")
SCALED = tuple(key for key in UNITS if key not in GIVEN)


@dataclass(frozen=True)
class Geometry:
    """Measurements of an owner: wheelbase and trail (m), tilt of the steer axis (rad), wheel radii (m), mass (kg)."""

    w: float  # m
    c: float  # m, positive behind the steer axis
    lam: float  # rad from the vertical
    rR: float  # m
    rF: float  # m
    mass: float  # kg, of the whole bicycle without rider
    g: float = 9.81  # m/s^2

    @classmethod
    def of(cls, p: Mapping[str, float]) -> "Geometry":
        """The geometry and mass of a parameter set."""
        mass = sum(p[key] for key in ("mR", "mB", "mH", "mF"))
        return cls(p["w"], p["c"], p["lam"], p["rR"], p["rF"], mass, p["g"])


def features_of(p: Mapping[str, float]) -> Array:
    """The :data:`FEATURES` (17,), no unit, of a parameter set (SI)."""
    log, r, whole = math.log, (p["rR"] + p["rF"]) / 2, SCALING.power * math.log(Geometry.of(p).mass)
    return np.array(
        [
            log(p["mR"]) - whole,
            log(p["mF"]) - whole,
            log(p["mH"]) - whole,
            log(p["IRyy"] / p["mR"] / p["rR"] ** 2),
            log(p["IRxx"] / p["IRyy"]),
            log(p["IFyy"] / p["mF"] / p["rF"] ** 2),
            log(p["IFxx"] / p["IFyy"]),
            p["xB"] / p["w"],
            -p["zB"] / r,
            log(p["IBxx"] / p["mB"] / r**2),
            log(p["IBzz"] / p["mB"] / r**2),
            math.atanh(p["IBxz"] / math.sqrt(p["IBxx"] * p["IBzz"])),
            ((p["xH"] - p["w"] - p["c"]) * math.cos(p["lam"]) - p["zH"] * math.sin(p["lam"])) / r,
            -p["zH"] / r,
            log(p["IHxx"] / p["mH"] / r**2),
            log(p["IHzz"] / p["mH"] / r**2),
            math.atanh(p["IHxz"] / math.sqrt(p["IHxx"] * p["IHzz"])),
        ]
    )


def values_of(features: Array, q: Geometry) -> dict[str, float]:
    """The parameter set (SI) of a bicycle of the geometry ``q`` that has these ``features`` (17,)."""
    z, r = dict(zip(FEATURES, features.tolist(), strict=True)), (q.rR + q.rF) / 2
    p = {"w": q.w, "c": q.c, "lam": q.lam, "g": q.g, "rR": q.rR, "rF": q.rF}
    parts = {key: math.exp(z[key]) * q.mass**SCALING.power for key in ("mR", "mF", "mH")}
    parts["mB"] = max(q.mass - sum(parts.values()), 0.1 * q.mass)  # a draw must leave something of the frame
    p |= {key: q.mass * part / sum(parts.values()) for key, part in parts.items()}
    for wheel in "RF":
        p[f"I{wheel}yy"] = math.exp(z[f"I{wheel}yy"]) * p[f"m{wheel}"] * p[f"r{wheel}"] ** 2
        p[f"I{wheel}xx"] = math.exp(z[f"I{wheel}xx"]) * p[f"I{wheel}yy"]
    for part in "BH":
        xx, zz = (math.exp(z[f"I{part}{axes}"]) * p[f"m{part}"] * r**2 for axes in ("xx", "zz"))
        p |= {f"I{part}xx": xx, f"I{part}zz": zz, f"I{part}xz": math.tanh(z[f"I{part}xz"]) * math.sqrt(xx * zz)}
    p |= {"xB": z["xB"] * q.w, "zB": -z["zB"] * r, "zH": -z["zH"] * r}
    p["xH"] = q.w + q.c + (z["xH"] * r + p["zH"] * math.sin(q.lam)) / math.cos(q.lam)
    return {key: p[key] for key in UNITS}


@cache
def measured_bicycles() -> Mapping[str, Bicycle]:
    """The bicycles of :data:`MAKES`."""
    text = data_root().joinpath("bicycle_text", "YellowBenchmark.txt")
    bicycles = {name: load_bicycle(name) for name in MAKES if name != "Yellow"}
    return bicycles | {"Yellow": read_flat_text(text).bicycle("Yellow", "bicycle file")}


def _mean(*without: str) -> Array:
    """Mean (17,) of the features over the makes, each with one vote, leaving out those named ``without``."""
    rows: dict[str, list[Array]] = {}
    for name, bicycle in measured_bicycles().items():
        rows.setdefault(MAKES[name], []).append(features_of(bicycle.values))
    return np.asarray(np.mean([np.mean(several, axis=0) for make, several in rows.items() if make not in without], 0))


@dataclass(frozen=True)
class Guess:
    """Features (p,) of a bicycle that was not measured, and their covariance (p, p)."""

    geometry: Geometry  # what was measured
    mean: Array  # (p,), no unit
    covariance: Array  # (p, p), no unit

    def condition_on(self, known: Mapping[str, tuple[float, float]]) -> "Guess":
        """The guess if some of the features are measured: value and sd of each, as of a normal distribution."""
        places = [FEATURES.index(name) for name in known]
        value, sd = np.array(list(known.values())).T.reshape(2, -1)
        gain = np.linalg.solve(self.covariance[np.ix_(places, places)] + np.diag(sd**2), self.covariance[places]).T
        mean = self.mean + gain @ (value - self.mean[places])
        return replace(self, mean=mean, covariance=self.covariance - gain @ self.covariance[places])

    def values(self) -> dict[str, float]:
        """The parameter set (SI) in the mean."""
        return values_of(self.mean, self.geometry)

    def draws(self, rng: np.random.Generator, count: int) -> list[dict[str, float]]:
        """Draw ``count`` plausible parameter sets (SI) from the normal distribution of the features."""
        z = rng.standard_normal((count, len(FEATURES))) @ self._root().T
        return [values_of(self.mean + change, self.geometry) for change in z]

    def bicycle(
        self,
        name: str,
        description: str,
        source: str,
        *,
        rider: RigidBody | None = None,
        causes: Mapping[str, Array] | None = None,
        mass_sd: float = 0.01,
    ) -> Bicycle:
        """The bicycle, perhaps with a rider joined to its rear frame, with the joint covariance of :data:`SCALED`.

        ``causes`` are changes (7,) of the rear frame's numbers by one standard deviation of each cause of the rider's,
        ``mass_sd`` is relative, of the bicycle's mass.
        """
        root, q = self._root(), self.geometry

        def numbers(shift: Array, mass: float = 0.0) -> Array:
            frame = values_of(self.mean + shift, replace(q, mass=q.mass * (1 + mass)))
            return np.array([with_rider(frame, rider)[key] for key in SCALED])

        zero = np.zeros(len(FEATURES))
        columns = [(numbers(step) - numbers(-step)) / 2 for step in root.T]
        columns.append((numbers(zero, mass_sd) - numbers(zero, -mass_sd)) / 2)
        of_rider = ("xB", "zB", "mB", "IBxx", "IBzz", "IBxz")
        for step in (causes or {}).values():
            by_key = dict(zip(of_rider, step[[0, 1, 2, 3, 5, 6]].tolist(), strict=True))
            columns.append(np.array([by_key.get(key, 0.0) for key in SCALED]))
        factor = np.array(columns).T
        values = with_rider(self.values(), rider)
        return Bicycle(
            name,
            {key: values[key] for key in UNITS},
            {},
            description,
            source,
            covariance=ParameterCovariance(SCALED, factor @ factor.T, origin="bicycle file"),
        )

    def _root(self) -> Array:
        values, vectors = np.linalg.eigh(self.covariance)
        return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def guess_bicycle(geometry: Geometry, without: str = "") -> Guess:
    """A bicycle of this geometry and mass, from the measured ones (for a test ``without`` one of the makes)."""
    used = {name: bicycle for name, bicycle in measured_bicycles().items() if MAKES[name] != without}
    off = np.array([features_of(b.values) - _mean(without, MAKES[name]) for name, b in used.items()])
    spread = SCALING.inflation**2 * off.T @ off / len(off)
    return Guess(geometry, _mean(without), SCALING.kept * spread + (1 - SCALING.kept) * np.diag(np.diag(spread)))


def with_rider(frame: Mapping[str, float], rider: RigidBody | None) -> dict[str, float]:
    """A parameter set (SI) whose rear frame carries a rider; without one as it is."""
    return dict(frame) if rider is None else {**frame, **as_rear_frame(join([rider, rear_frame(frame)]))}


def feature(key: str, value: float, geometry: Geometry, mass: float = 0.0) -> float:
    """The feature of a measured mass (kg), or of a wheel's spin inertia (kg m^2) at its ``mass`` (kg)."""
    if key[0] == "m":
        return math.log(value) - SCALING.power * math.log(geometry.mass)
    return math.log(value / mass / getattr(geometry, f"r{key[1]}") ** 2)
