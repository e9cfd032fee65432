"""Identified coefficients of the canonical equations M q'' + v C1 q' + (g K0 + v^2 K2) q = T + H F, q = (lean, steer).

A row of the table is one coefficient of one subset of the runs (a rider in an environment). ``difference_percent`` is
that to Whipple's value of the same rider. ``A`` stands for all riders or environments: such unions hold the data of
other rows and count only for Whipple's values.

The prediction applies the identification to the model's own harmonic motion. An effect that keeps the form of the
equations gives its coefficients exactly; slip, lags, hinges and dampers give effective ones, the best of the equation
error. The motion: at every speed and frequency once the rider steers and nobody pushes, once a lateral force pushes
and the steering is held. Steering prescribed, not its torque, keeps the bicycle's own resonances out of the weights.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np

from bicycle.effects.effect_registry import registry
from bicycle.identification.canonical import Canonical, Motion, identify
from bicycle.model.eigen import angular_frequency
from studies.diagnosis.bicycle_kind import FASTEST, BicycleKind, refuse_repeats
from studies.diagnosis.candidates import compliance
from studies.diagnosis.mistakes import DELAY, GAIN, delay_error, gain_error, speed_errors
from studies.inference import kind as base
from studies.inference.evidence import MOST_FOLDS
from studies.inference.kind import Candidates, Proposal, Rows, Series
from studies.inference.parameter import Candidate
from tyre.ground.arrays import Array, Complex
from tyre.ground.errors import InputError, is_number, unknown
from tyre.ground.schema import Check, maybe, number, path_key, read, refused, remarked, table
from tyre.ground.text_table import read_columns
from tyre.measured.plausible import LARGEST, SMALLEST

# ---- the table ----

ROLL = ("M_phi_delta", "C1_phi_delta", "K0_phi_delta")
STEER = ("M_delta_delta", "C1_delta_phi", "C1_delta_delta", "K0_delta_delta", "K2_delta_delta", "H_delta_F")
COEFFICIENTS = (*ROLL, *STEER)
"""Coefficients that the regressions of the roll and of the steer equation leave free (Moore 2012)."""

UNITS = {"M": "kg m^2", "C1": "kg m", "K0": "kg m", "K2": "kg", "H": "m"}
ALL = "A"
TEXTS = ("rider", "environment", "coefficient", "unit")
NUMBERS = {
    "value": number(least=-LARGEST, most=LARGEST),
    "sd": number(
        least=SMALLEST,
        most=LARGEST,
        outside=f"must be a number from {SMALLEST:g} to {LARGEST:g}: no identification is free of noise",
    ),
    "difference_percent": number(least=-LARGEST, most=LARGEST),
}
SPEEDS = (2.0, 3.0, 4.0, 5.0, 6.0, 7.0)  # m/s
BAND = (0.3, 3.0)  # Hz
FEWEST = 4  # subsets from which a scatter can be had: Student's t with fewer has no variance
PERCENT = 0.1 / math.sqrt(12)  # rounding of a printed percentage


def unit(coefficient: str) -> str:
    """SI unit of a ``coefficient``."""
    return UNITS[coefficient.split("_")[0]]


def _ascending(highest: float, what: str, *, pair: bool = False) -> Check:
    def check(given: Any) -> tuple[float, ...]:
        if not isinstance(given, list) or len(given) < 2 or not all(is_number(x) for x in given):
            raise refused(given, f"must be a list of two or more numbers in {what}")
        numbers = [float(x) for x in given]
        if not all(0 < x <= highest for x in numbers) or sorted(set(numbers)) != numbers:
            raise refused(given, f"must rise and lie within 0 .. {highest:g} {what}")
        if pair and len(numbers) != 2:
            raise remarked(f"has {len(numbers)} numbers; write [lowest, highest]")
        return tuple(numbers)

    return check


@dataclass(frozen=True)
class CanonicalTable:
    """Coefficients (subsets, 9) in the order of :data:`COEFFICIENTS`, SI, and how they were excited."""

    subsets: tuple[str, ...]  # "rider on environment" of each row
    value: Array  # (subsets, 9), SI
    sd: Array  # (subsets, 9), SI: as stated, with the scatter between subsets and the rounding
    # (subsets, 9), SI, of each rider's Whipple model; None if the table has no differences
    whipple: Array | None
    speeds: tuple[float, ...] = SPEEDS  # m/s, ascending, at which the bicycle was excited
    band: tuple[float, float] = BAND  # Hz, lowest and highest frequency of the excitation


Cells = dict[tuple[str, str, str], tuple[float, float, float]]
"""(rider, environment, coefficient) -> value, sd, difference in per cent."""


def _read_table(given: Mapping[str, Any], folder: Path) -> tuple[CanonicalTable, list[str]]:
    path = folder / given["table"]
    cells, differs = _cells(path)
    subsets = _subsets(path, cells)
    value, stated = (np.array([[cells[*s, name][k] for name in COEFFICIENTS] for s in subsets]) for k in (0, 1))
    for place, name in enumerate(COEFFICIENTS):
        size = np.abs(value[:, place])
        for row, (rider, environment) in enumerate(subsets):
            others = float(np.delete(size, row).max())
            if others > 0 and size[row] > 100 * others:  # no rider makes that
                raise InputError(
                    f"{path}: {name} = {value[row, place]:g} {unit(name)} of {rider}, {environment} is "
                    f"{size[row] / others:.3g} times the largest of the other subsets; is it in another unit?"
                )
    whipple, rounding = None, np.zeros_like(value)
    if differs:
        both = np.array([[_whipple(path, cells, s[0], name) for name in COEFFICIENTS] for s in subsets])
        whipple, rounding = both[..., 0], both[..., 1]
    between, note = _between(value if whipple is None else value - whipple, stated)
    notes = [note]
    unions = sorted({"-".join(key[:2]) for key in cells if ALL in key[:2]})
    if unions:
        notes.append(f"not used, because they hold the runs of other subsets: {', '.join(unions)}")
    names = tuple(f"{rider} on {environment}" for rider, environment in subsets)
    sd = np.sqrt(stated**2 + between + rounding**2)
    return CanonicalTable(names, value, sd, whipple, tuple(given["speeds_m_s"]), tuple(given["band_hz"])), notes


def _subsets(path: Path, cells: Cells) -> list[tuple[str, str]]:
    """Rider and environment of the subsets that share no runs, each with every coefficient."""
    subsets = [key for key in dict.fromkeys(key[:2] for key in cells) if ALL not in key]
    if len(subsets) < FEWEST:
        raise InputError(
            f"{path}: {len(subsets)} subsets that share no runs ({ALL} is all of them); at least {FEWEST} are needed, "
            "for the scatter between them is their noise"
        )
    for subset in subsets:
        missing = [name for name in COEFFICIENTS if (*subset, name) not in cells]
        if missing:
            raise InputError(f"{path}: rider {subset[0]}, environment {subset[1]} lacks {', '.join(missing)}")
    return subsets


def _between(differences: Array, stated: Array) -> tuple[Array, str]:
    """Variance (9,) between subsets beyond the stated sd (subsets, 9), and a note on it."""
    n = len(differences)
    scatter = differences.var(0, ddof=1)
    times = np.sqrt(scatter / (stated**2).mean(0))
    note = (
        f"noise: the scatter between {n} subsets of the runs, {times.min():.2g} to {times.max():.2g} times the stated "
        f"sd, widened for its {n - 1} degrees of freedom (variance of Student's t); coefficients count as independent. "
        f"Being taken from these rows, it leaves a perfect model with chi^2 of about {len(COEFFICIENTS) * (n - 3)} of "
        f"{stated.size}: goodness of fit says little here, held-out subsets and the posterior decide"
    )
    if times.max() < 0.01:
        note += (
            ". The stated sd of every coefficient is more than 100 times that scatter and hides whatever is missing: "
            "see their units"
        )
    return np.maximum(scatter - (stated**2).mean(0), 0) * (n - 1) / (n - 3), note


def _cells(path: Path) -> tuple[Cells, bool]:
    """The cells, and whether there are differences."""
    columns = read_columns(path, numbers=NUMBERS, texts=TEXTS, needed=(*TEXTS, "value", "sd"))
    numbers, words = columns.numbers, columns.texts
    cells: Cells = {}
    for row, name in enumerate(words["coefficient"]):
        where, key = f"{path}, line {columns.lines[row]}", (words["rider"][row], words["environment"][row], name)
        if name not in COEFFICIENTS:
            raise InputError(f"{where}: {unknown('coefficient', name, COEFFICIENTS)}")
        if words["unit"][row] != unit(name):
            raise InputError(f"{where}: {name} is in {words['unit'][row]!r}; give it in {unit(name)!r}")
        if "" in key:
            raise InputError(f"{where}: rider and environment need a name; {ALL} stands for all of them")
        differs = float(numbers["difference_percent"][row]) if "difference_percent" in numbers else math.nan
        cells[key] = float(numbers["value"][row]), float(numbers["sd"][row]), differs
    keys = zip(words["rider"], words["environment"], words["coefficient"], strict=True)
    refuse_repeats(path, columns.lines, keys, "rider, environment and coefficient")
    return cells, "difference_percent" in numbers


def _whipple(path: Path, cells: Cells, rider: str, name: str) -> tuple[float, float]:
    """Whipple's value of a rider and its sd, from value / (1 + difference) of every row, weighted by their rounding."""
    rows = [c for (who, _, what), c in cells.items() if (who, what) == (rider, name)]
    value, sd, percent = np.array(rows).T
    ratio = 1 + percent / 100
    used = np.abs(ratio) > PERCENT / 100  # elsewhere zero over zero
    if not used.any():
        raise InputError(f"{path}: {name} of rider {rider} is zero in every row: Whipple's value cannot be had from it")
    value, ratio, digit = value[used], ratio[used], 10.0 ** np.floor(np.log10(sd[used]) + 1e-9) / math.sqrt(12)
    found = value / ratio
    error = np.hypot(digit / ratio, found / ratio * PERCENT / 100)
    weight = 1 / error**2
    mean = float(weight @ found / weight.sum())
    if (np.abs(found - mean) > 5 * error).any():
        raise InputError(
            f"{path}: the rows of rider {rider} disagree on Whipple's {name} (value / (1 + difference_percent/100) is "
            f"{', '.join(f'{x:.4g}' for x in found)}); correct value or difference_percent"
        )
    return mean, float(1 / np.sqrt(weight.sum()))


# ---- the kind ----

FREQUENCIES = 16  # spaced in the logarithm
STEER_RATE, FORCE = 0.3, 20.0  # rad/s and N at each frequency; only their ratio counts
MEASURED = "it acts through the {}, which was measured"
SENSORS = ("lean", "steer", "steer_torque", "lateral_force")


@dataclass(frozen=True, kw_only=True)
class CanonicalCoefficients(BicycleKind, kind="canonical"):
    """Identified coefficients of the canonical equations."""

    keys: ClassVar[Any] = table(
        {
            **path_key("table", "FILE.csv"),
            maybe("speeds_m_s", list(SPEEDS)): _ascending(FASTEST, "m/s"),
            maybe("band_hz", list(BAND)): _ascending(50.0, "Hz", pair=True),
        }
    )
    columns: ClassVar[tuple[str, ...]] = (*TEXTS, *NUMBERS)
    coefficients: CanonicalTable
    barred: tuple[str, ...] = ()  # effects that are never tried, whatever makes them possible

    @classmethod
    def read(cls, content: Any, folder: Path, common: Mapping[str, Any]) -> "CanonicalCoefficients":
        coefficients, notes = _read_table(read(cls.keys, content, section="canonical"), folder)
        return cls(**common, coefficients=coefficients, notes=tuple(notes))

    def ready(self, *, without: tuple[str, ...] = (), also: tuple[str, ...] = ()) -> Self:
        """Prepare the library without effects that are part of what was measured."""
        found = super().ready(without=without, also=also)
        inside = {
            name: MEASURED.format(effect.acts_through.replace("_", " "))
            for name, effect in registry().items()
            if effect.acts_through in SENSORS
        }
        candidates = tuple(_by_compliance(c) for c in found.candidates if c.identifier not in inside)
        return replace(found, candidates=candidates, refused={**found.refused, **inside}, barred=(*inside, *without))

    def mistakes(self) -> tuple[Candidate, ...]:
        """The speed; gain and delay of each signal (a delay of all does nothing)."""
        signals = (error(name, name) for name in SENSORS for error in (gain_error, delay_error))
        return (*speed_errors(self.coefficients.speeds), *signals)

    def assumptions(self) -> tuple[str, ...]:
        data = self.coefficients
        speeds = ", ".join(f"{v:g}" for v in data.speeds)
        found = [
            f"the identification is imitated at {speeds} m/s, {data.band[0]:g}-{data.band[1]:g} Hz, with uncorrelated "
            f"steering ({STEER_RATE:g} rad/s) and lateral force ({FORCE:g} N) at each frequency and signals free of "
            "noise"
        ]
        if data.whipple is not None:
            away = np.abs(data.whipple / self.whipple.free - 1)[:, :-1].max(1)
            far = ", ".join(f"{name} {share:.1%}" for name, share in zip(data.subsets, away, strict=True))
            found.append(
                "the base of each subset is its rider's Whipple coefficients as the table implies them; the bicycle "
                f"only gives the change. It differs from them, at most (without H_delta_F): {far}"
            )
        return tuple(found)

    # ---- physics ----

    @cached_property
    def whipple(self) -> Canonical:
        """The bicycle's own Whipple coefficients, which the identification holds fixed."""
        return Canonical.of_whipple(self.model)

    @cached_property
    def rows(self) -> Rows:  # type: ignore[override]
        """Rows coefficient by coefficient; each subset is held out."""
        subsets = self.coefficients.subsets
        where = tuple(f"{name}, {subset}" for name in COEFFICIENTS for subset in subsets)
        series = tuple(name for name in COEFFICIENTS for _ in subsets)
        shown = {name: Series(name, f"value, {unit(name)}") for name in COEFFICIENTS}
        number = np.tile(np.arange(len(subsets), dtype=float), len(COEFFICIENTS))
        return Rows(where, number, series, number.astype(np.intp) % MOST_FOLDS, condition=subsets, shown=shown)

    @property
    def data(self) -> tuple[Array, Array]:
        return self.coefficients.value.T.ravel(), self.coefficients.sd.T.ravel()

    def identified(self, candidates: Candidates, theta: Array) -> Array:
        """Coefficients (K, 9) that the identification would give at ``theta`` (K, p), a stencil about the first."""
        family, speeds = self.family(candidates), np.array(self.coefficients.speeds)
        names, omega = family.symbolic, angular_frequency(np.geomspace(*self.coefficients.band, FREQUENCIES))
        response = family(theta, speeds).responses_about_the_first(  # (K, speeds, frequencies, lean and steer, inputs)
            omega,
            inputs=[names.inputs.index(name) for name in ("steer_torque", "lateral_force")],
            outputs=[names.outputs.index(name) for name in ("lean", "steer")],
        )
        steer, force = np.zeros((2, *omega.shape, 2))
        steer[:, 0], force[:, 1] = STEER_RATE / omega, FORCE
        torque = (steer - response[..., 1, 1, None] * force) / response[..., 1, 0, None]
        lean = response[..., 0, 0, None] * torque + response[..., 0, 1, None] * force
        values = family.values(theta)
        s = 1j * omega[:, None]

        def recorded(name: str, signal: Complex | Array) -> Complex:
            gain, delay = (values.get(key.format(name), np.zeros((1, 1)))[..., None, None] for key in (GAIN, DELAY))
            return np.asarray(np.broadcast_to((1 + gain) * np.exp(-s * delay) * signal, lean.shape))

        motion = Motion(
            recorded("lean", lean),
            recorded("steer", steer),
            recorded("steer_torque", torque),
            recorded("lateral_force", force),
            np.asarray(s),
            speeds[:, None, None],
        )
        return identify(motion, self.whipple)

    @cached_property
    def _base(self) -> tuple[Array, Array]:
        """Whipple's coefficients of each subset, and how a change carries over to it; (subsets, 9)."""
        own, given = self.whipple.free, self.coefficients.whipple
        carried = np.ones((len(self.coefficients.subsets), len(own)))
        if given is None:
            return np.broadcast_to(own, carried.shape), carried
        carried[:, -1] = given[:, -1] / own[-1]
        return given, carried

    def _computed(self, candidates: Candidates, batch: Array) -> Array:
        """Values (K, n) in the order of the rows."""
        whipple, carried = self._base
        change = self.identified(candidates, batch) - self.whipple.free
        computed = whipple + carried * change[:, None]  # (K, subsets, 9)
        return computed.swapaxes(1, 2).reshape(len(batch), -1)

    def predict(self, candidates: Candidates, theta: Array) -> Array:
        return self._computed(candidates, theta[None])[0]

    def value_and_jacobian(self, candidates: Candidates, theta: Array) -> base.Prediction:
        batch, steps = self.family(candidates).stencil(theta)
        every = self._computed(candidates, batch)
        return every[0], base.central_differences(every, steps)

    @property
    def speeds(self) -> Array:
        return np.array(self.coefficients.speeds, float)

    def enabled_by(self, candidates: Candidates) -> Candidates:
        return tuple(c for c in super().enabled_by(candidates) if c.identifier not in self.barred)

    def proposed(self) -> tuple[Proposal, ...]:
        """Forced responses at the highest speed and above."""
        return self.forced(max(self.coefficients.speeds))


def _by_compliance(candidate: Candidate) -> Candidate:
    """A ``candidate`` tyre in place of rolling without slip by 1/C: the slip is gone at zero, where a search begins."""
    if candidate.replaces is None or candidate.effect is None:
        return candidate
    declared = {p.name: p for p in candidate.effect.parameters}
    unknowns = tuple(
        replace(compliance(declared[u.name], u.sets), labels=u.labels) if u.name == "cornering_stiffness" else u
        for u in candidate.unknowns
    )
    return replace(candidate, unknowns=unknowns)
