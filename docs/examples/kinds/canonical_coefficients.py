"""A kind of measurement of your own: identified coefficients of the equations of motion, as Moore (2012) printed them.

    M q'' + v C1 q' + (g K0 + v^2 K2) q = T + H F,    q = (lean, steer)

Moore rode an instrumented bicycle with three riders on a treadmill and on a pavilion floor, and identified nine of
these coefficients from each subset of the runs by least squares; he held the others at those of Whipple's bicycle. A
model predicts what he would have found if he had identified it: its motion is computed at each speed and frequency,
and the same least squares is applied to it. An effect that keeps the form of the equations (a steering damper) changes
one coefficient; slip and lags change several, to those that fit best.

    python canonical_coefficients.py diagnose davis.toml --out report
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np

from bicycle.effects import registry
from bicycle.model import Model, angular_frequency
from studies.diagnosis import BicycleKind, delay_error, gain_error, speed_errors
from studies.inference import MOST_FOLDS, Candidate, Proposal, Rows, Series, central_differences
from tyre.ground import Array, InputError, list_of, needed, number, read, read_columns, refuse_unknown, table, text

ROLL = ("M_phi_delta", "C1_phi_delta", "K0_phi_delta")  # free in the equation of roll
STEER = ("M_delta_delta", "C1_delta_phi", "C1_delta_delta", "K0_delta_delta", "K2_delta_delta", "H_delta_F")
COEFFICIENTS = (*ROLL, *STEER)
UNITS = {"M": "kg m^2", "C1": "kg m", "K0": "kg m", "K2": "kg", "H": "m"}  # by the first part of the name
SENSORS = ("lean", "steer", "steer_torque", "lateral_push")  # signals of the regression
FREQUENCIES = 16  # number of frequencies of the predicted motion, evenly spaced in the logarithm
STEER_RATE, FORCE = 0.3, 20.0  # rad/s and N at each frequency; only their ratio matters


# ---- 1. The physics: what the identification would find ----


@dataclass(frozen=True)
class WhippleMatrices:
    """Matrices of the canonical equations of Whipple's bicycle; order lean, steer."""

    mass: Array  # M (2, 2), kg m^2
    c1: Array  # C1 (2, 2), kg m: N m per (m/s) (rad/s)
    k0: Array  # K0 (2, 2), kg m: stiffness over gravity
    k2: Array  # K2 (2, 2), kg: N m/rad per (m/s)^2
    force: Array  # H (2,), m: lean and steer torque per lateral force
    gravity: float  # m/s^2

    @classmethod
    def of_bicycle(cls, model: Model) -> Self:
        """Take the matrices of the bicycle of ``model``, without its effects."""
        linear = Model(model.bicycle).linear_model()
        matrices = linear.ranges[0].matrices
        gravity = model.bicycle["g"]
        rates = [linear.states.index(name) for name in ("lean_rate", "steer_rate")]
        angles = [linear.states.index(name) for name in ("lean", "steer")]
        constant, linear_in_v, square_in_v = (-matrices.dynamics.coefficient(power)[rates] for power in (0, 1, 2))
        return cls(
            mass=matrices.mass[np.ix_(rates, rates)],
            c1=linear_in_v[:, rates],
            k0=constant[:, angles] / gravity,
            k2=square_in_v[:, angles],
            force=matrices.input_matrix[0][rates, linear.inputs.index("lateral_push")],
            gravity=gravity,
        )

    @property
    def free(self) -> Array:
        """Coefficients (9,), SI, that the identification leaves free, in the order of ``COEFFICIENTS``."""
        m, c1, k0, k2 = self.mass, self.c1, self.k0, self.k2
        return np.array([m[0, 1], c1[0, 1], k0[0, 1], m[1, 1], c1[1, 0], c1[1, 1], k0[1, 1], k2[1, 1], self.force[1]])


@dataclass(frozen=True)
class RecordedMotion:
    """Complex amplitudes (K, speeds, frequencies, motions) of the recorded signals of K models."""

    lean: np.ndarray  # rad
    steer: np.ndarray  # rad
    torque: np.ndarray  # steer torque, N m
    force: np.ndarray  # lateral force on the frame, N
    s: np.ndarray  # (frequencies, 1), 1/s: i omega
    v: Array  # (speeds, 1, 1), m/s


def identify(motion: RecordedMotion, fixed: WhippleMatrices) -> Array:
    """Identify the coefficients (K, 9), SI, by least squares of the equation of roll, then of that of steer."""
    phi, delta, s, v, g = motion.lean, motion.steer, motion.s, motion.v, fixed.gravity
    m, c1, k0, k2 = fixed.mass, fixed.c1, fixed.k0, fixed.k2
    known = (m[0, 0] * s**2 + v * c1[0, 0] * s + g * k0[0, 0] + v**2 * k2[0, 0]) * phi + v**2 * k2[0, 1] * delta
    roll = solve_least_squares([s**2 * delta, v * s * delta, g * delta], fixed.force[0] * motion.force - known)

    # M and K0 are symmetric: what the equation of roll gave is held fixed in that of steer.
    m_delta_phi, k0_delta_phi = (roll[:, k, None, None, None] for k in (0, 2))
    known = (m_delta_phi * s**2 + g * k0_delta_phi + v**2 * k2[1, 0]) * phi
    columns = [s**2 * delta, v * s * phi, v * s * delta, g * delta, v**2 * delta, -motion.force]
    return np.hstack([roll, solve_least_squares(columns, motion.torque - known)])


def solve_least_squares(columns: list[np.ndarray], right: np.ndarray) -> Array:
    """Solve complex equations (K, ...) for real coefficients (K, columns), one for each of the ``columns``."""

    def real_rows(side: np.ndarray) -> Array:
        flat = np.broadcast_to(side, right.shape).reshape(len(right), -1)
        return np.concatenate([flat.real, flat.imag], axis=1)

    q, r = np.linalg.qr(np.stack([real_rows(column) for column in columns], -1))
    return np.linalg.solve(r, np.swapaxes(q, 1, 2) @ real_rows(right)[..., None])[..., 0]


# ---- 2. The data: a table, checked where it is read ----

Cell = tuple[float, float, float]  # value and its standard deviation, SI; difference to Whipple's value, per cent
Cells = dict[tuple[str, str, str], Cell]  # by rider, environment and coefficient


@dataclass(frozen=True)
class CoefficientTable:
    """Coefficients in the order of ``COEFFICIENTS``, SI, of subsets of the runs that share none."""

    subsets: tuple[str, ...]  # "rider on environment" of each row
    value: Array  # (subsets, 9), SI
    sd: Array  # (subsets, 9), SI: of the regression, of the scatter between subsets and of the printed digits
    whipple: Array  # (subsets, 9), SI: of the Whipple model of each rider, which the printed differences imply


def read_cells(path: Path) -> Cells:
    """Read a table of one coefficient a row; InputError names the line of what is wrong."""
    texts, numbers = ("rider", "environment", "coefficient", "unit"), ("value", "sd", "difference_percent")
    columns = read_columns(path, texts=texts, numbers=numbers, needed=(*texts, *numbers))
    words = [columns.texts[key] for key in texts]
    rows = zip(columns.lines, *words, *(columns.numbers[key] for key in numbers), strict=True)
    cells: Cells = {}
    for line, rider, environment, coefficient, unit, value, sd, percent in rows:
        where = f"{path}, line {line}"
        refuse_unknown("coefficient", [coefficient], COEFFICIENTS, where=where)
        if unit != unit_of(coefficient):
            raise InputError(f"{where}: {coefficient} is in {unit!r}; give it in {unit_of(coefficient)!r}")
        if not sd > 0:
            raise InputError(f"{where}: sd = {sd:g} must be above 0; no identification is free of noise")
        if (rider, environment, coefficient) in cells:
            raise InputError(f"{where}: {coefficient} of {rider} on {environment} is given twice; keep one")
        cells[rider, environment, coefficient] = float(value), float(sd), float(percent)
    return cells


def unit_of(coefficient: str) -> str:
    """SI unit of a ``coefficient``."""
    return UNITS[coefficient.split("_")[0]]


def read_coefficients(path: Path) -> CoefficientTable:
    """Read the table at ``path`` and estimate the noise of its coefficients from the scatter between subsets."""
    cells = read_cells(path)
    subsets = [key for key in dict.fromkeys(key[:2] for key in cells) if "A" not in key]  # A: all of them, no own runs
    if len(subsets) < 4:
        raise InputError(f"{path}: {len(subsets)} subsets that share no runs; a scatter needs at least 4")
    for rider, environment in subsets:
        missing = [name for name in COEFFICIENTS if (rider, environment, name) not in cells]
        if missing:
            raise InputError(f"{path}: rider {rider}, environment {environment} lacks {', '.join(missing)}")

    printed = np.array([[cells[rider, place, name] for name in COEFFICIENTS] for rider, place in subsets])
    implied = np.array([[imply_whipple(cells, rider, name) for name in COEFFICIENTS] for rider, _ in subsets])
    value, stated_sd = printed[..., 0], printed[..., 1]
    whipple, rounding_sd = implied[..., 0], implied[..., 1]

    # Subsets scatter more than their regressions say. The scatter has few degrees of freedom: variance of Student's t.
    n = len(subsets)
    scatter = (value - whipple).var(axis=0, ddof=1)
    beyond_stated = np.maximum(scatter - (stated_sd**2).mean(axis=0), 0.0) * (n - 1) / (n - 3)
    return CoefficientTable(
        subsets=tuple(f"{rider} on {environment}" for rider, environment in subsets),
        value=value,
        sd=np.sqrt(stated_sd**2 + beyond_stated + rounding_sd**2),
        whipple=whipple,
    )


def imply_whipple(cells: Cells, rider: str, coefficient: str) -> tuple[float, float]:
    """Whipple's value and its sd, SI: mean of value / (1 + difference) over the rows of a rider, by their rounding."""
    rows = [cell for (who, _, what), cell in cells.items() if (who, what) == (rider, coefficient)]
    value, sd, percent = np.array(rows).T
    ratio, ratio_sd = 1 + percent / 100, 1e-3 / math.sqrt(12)  # percentages are printed to 0.1
    usable = np.abs(ratio) > ratio_sd  # elsewhere zero over zero
    value, ratio, sd = value[usable], ratio[usable], sd[usable]
    value_sd = 10.0 ** np.floor(np.log10(sd) + 1e-9) / math.sqrt(12)  # values are printed to the first digit of the sd
    weight = 1 / (np.hypot(value_sd, value / ratio * ratio_sd) / ratio) ** 2
    return float(weight @ (value / ratio) / weight.sum()), float(1 / np.sqrt(weight.sum()))


# ---- 3. The kind: what the diagnosis asks of a measurement ----


@dataclass(frozen=True, kw_only=True)
class CanonicalCoefficients(BicycleKind, kind="canonical"):
    """Identified coefficients of the canonical equations; ``kind="canonical"`` registers it for measurement files."""

    keys: ClassVar[Any] = table(
        {
            needed("table"): text('must be a path in quotes; write table = "FILE.csv"'),
            needed("speeds_m_s"): list_of(number(above=0, most=60), "must be a list of speeds in m/s", least=2),
            needed("band_hz"): list_of(number(above=0, most=50), "must be [lowest, highest] in Hz", least=2),
        }
    )
    coefficients: CoefficientTable
    excited_speeds: tuple[float, ...]  # m/s, at which the bicycle was excited
    band: tuple[float, ...]  # Hz, lowest and highest frequency of the excitation

    @classmethod
    def read(cls, content: Any, folder: Path, common: Mapping[str, Any]) -> Self:
        """Read the table [canonical] of a measurement file; ``common`` are bicycle, uncertainties and words."""
        given = read(cls.keys, content, section="canonical")
        return cls(
            **common,
            coefficients=read_coefficients(folder / given["table"]),
            excited_speeds=tuple(given["speeds_m_s"]),
            band=tuple(given["band_hz"]),
        )

    # -- the numbers, and where each of them stands --

    @property
    def data(self) -> tuple[Array, Array]:
        """Measured values and their sd (n,), coefficient by coefficient."""
        return self.coefficients.value.T.ravel(), self.coefficients.sd.T.ravel()

    @cached_property
    def rows(self) -> Rows:  # type: ignore[override]
        """Name and series of each number (n,), and the fold in which it is held out: a subset at a time."""
        subsets = self.coefficients.subsets
        number = np.tile(np.arange(len(subsets)), len(COEFFICIENTS))
        return Rows(
            places=tuple(f"{name}, {subset}" for name in COEFFICIENTS for subset in subsets),
            abscissa=number.astype(float),
            series=tuple(name for name in COEFFICIENTS for _ in subsets),
            fold=number % MOST_FOLDS,
            condition=subsets,
            displays={name: Series(name, f"value, {unit_of(name)}") for name in COEFFICIENTS},
        )

    # -- what a model predicts --

    def predict(self, candidates: tuple[Candidate, ...], theta: Array) -> Array:
        """Values (n,) of the model with ``candidates`` at the coordinates ``theta`` (p,)."""
        return self._predict_batch(candidates, theta[None])[0]

    def value_and_jacobian(self, candidates: tuple[Candidate, ...], theta: Array) -> tuple[Array, Array]:
        """Values (n,) and their derivatives (n, p): all models of the differences at once, which is much faster."""
        batch, steps = self.family(candidates).stencil(theta)
        values = self._predict_batch(candidates, batch)
        return values[0], central_differences(values, steps)

    def _predict_batch(self, candidates: tuple[Candidate, ...], batch: Array) -> Array:
        """Values (K, n) at K sets of coordinates (K, p), of which the others are close to the first."""
        # The base of each subset is the Whipple model of its rider; the model of the file gives the change.
        change = self.identified(candidates, batch) - self.whipple.free
        carried = np.ones_like(self.coefficients.whipple)
        carried[:, -1] = self.coefficients.whipple[:, -1] / self.whipple.free[-1]  # H: the force acted elsewhere
        values = self.coefficients.whipple + carried * change[:, None]  # (K, subsets, 9)
        return values.swapaxes(1, 2).reshape(len(batch), -1)

    @cached_property
    def whipple(self) -> WhippleMatrices:
        """Whipple's matrices of the bicycle of the file, which the identification holds fixed."""
        return WhippleMatrices.of_bicycle(self.model)

    def identified(self, candidates: tuple[Candidate, ...], batch: Array) -> Array:
        """Coefficients (K, 9), SI, that the identification would find at K sets of coordinates (K, p)."""
        family, speeds = self.family(candidates), np.array(self.excited_speeds)
        names, omega = family.symbolic, angular_frequency(np.geomspace(*self.band, FREQUENCIES))
        response = family(batch, speeds).responses_about_the_first(  # (K, speeds, frequencies, outputs, inputs)
            omega,
            inputs=[names.inputs.index(name) for name in ("steer_torque", "lateral_push")],
            outputs=[names.outputs.index(name) for name in ("lean", "steer")],
        )
        # Two motions: the rider steers and nobody pushes; a force pushes and the steering is held. The steer angle is
        # prescribed, not its torque, so that resonances of the bicycle do not weigh more than the rest.
        steer, force = np.zeros((2, *omega.shape, 2))
        steer[:, 0], force[:, 1] = STEER_RATE / omega, FORCE
        torque = (steer - response[..., 1, 1, None] * force) / response[..., 1, 0, None]
        lean = response[..., 0, 0, None] * torque + response[..., 0, 1, None] * force

        # Each sensor may have a wrong gain or a delay: the candidates of ``mistakes`` set these parameters.
        parameters = family.values(batch)
        s = 1j * omega[:, None]
        nothing = np.zeros((1, 1))

        def record(sensor: str, signal: np.ndarray) -> np.ndarray:
            gain = parameters.get(f"measurement.{sensor}_gain", nothing)[..., None, None]
            delay = parameters.get(f"measurement.{sensor}_delay", nothing)[..., None, None]
            return np.broadcast_to((1 + gain) * np.exp(-s * delay) * signal, lean.shape)

        motion = RecordedMotion(
            lean=record("lean", lean),
            steer=record("steer", steer),
            torque=record("steer_torque", torque),
            force=record("lateral_push", force),
            s=s,
            v=speeds[:, None, None],
        )
        return identify(motion, self.whipple)

    # -- what may be wrong with the measurement, and what cannot be tried --

    def mistakes(self) -> tuple[Candidate, ...]:
        """A wrong speed; a wrong gain and a delay of each signal."""
        errors = [error(sensor, sensor) for sensor in SENSORS for error in (gain_error, delay_error)]
        return (*speed_errors(self.excited_speeds), *errors)

    def refusals(self) -> dict[str, str]:
        """Effects that act through what was measured: the rider's arms are part of the recorded steer torque."""
        within = {
            name: f"it acts through the {effect.acts_through.replace('_', ' ')}, which was measured"
            for name, effect in registry().items()
            if effect.acts_through in SENSORS
        }
        return super().refusals() | within

    def prepare(self, *, without: tuple[str, ...] = (), also: tuple[str, ...] = ()) -> Self:
        """Prepare the candidates, without those that cannot be tried."""
        return super().prepare(without=tuple({*without, *self.refusals()}), also=also)

    def enabled_by(self, candidates: tuple[Candidate, ...]) -> tuple[Candidate, ...]:
        """Further candidates that ``candidates`` make possible, again without those."""
        return tuple(c for c in super().enabled_by(candidates) if c.identifier not in self.refusals())

    # -- for the report --

    @property
    def speeds(self) -> Array:
        """Measured speeds, m/s."""
        return np.array(self.excited_speeds)

    def assumptions(self) -> tuple[str, ...]:
        """Assumptions about the data, in words."""
        low, high = self.band
        return (
            f"the identification is imitated at {', '.join(f'{v:g}' for v in self.excited_speeds)} m/s, "
            f"{low:g} to {high:g} Hz, with signals free of noise",
            "noise is the scatter between subsets; held-out subsets and the posterior decide, not the goodness of fit",
        )

    def propose_measurements(self) -> tuple[Proposal, ...]:
        """Further measurements: frequency responses at the highest speed and above."""
        return self.propose_forced_response(max(self.excited_speeds))


if __name__ == "__main__":
    from studies.cli import main

    main()
