"""A model with what is uncertain about it: from standard normal numbers to bicycles.

Uncertain are what the bicycle file states (sd), the measured tyre (covariance of the tyre map at the wheel loads), any
parameter given a standard deviation and, with ``defaults``, what is not stated (:mod:`bicycle.model.default_sd`). Each
measurement is a set of independent standard normal numbers z, from which the sampler of the sweeps makes parameters:
masses move wheel loads, wheel loads the tyre.

The nominal model and linear propagation take parameter = mean + factor z. Samples keep the mean and standard
deviation but stay within what is physically possible (:mod:`studies.model_space.sampling`: a stiffness is lognormal),
so z = 0 is the median of a draw, not the nominal bicycle.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from copy import copy
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.equations.speed_polynomial import SpeedPolynomial
from bicycle.model.default_sd import ASSUMED, CORNERING_STIFFNESS, GIVEN, Deviation, standard_deviations
from bicycle.model.model import Model
from bicycle.model.model_family import ModelFamily
from bicycle.model.model_file import build_model, read_model
from bicycle.parameters.parameter_covariance import FILE, MODEL_FILE, TABLE, ParameterCovariance, ParameterKey
from bicycle.stability.naming import Named, Rules, name_stack
from studies.model_space.command_options import check_memory
from studies.model_space.sampling import normal
from studies.sweep.file import build_sweep
from studies.sweep.sampler import TYRE_DRAWS, Points, Sampler, stiffness_warnings
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError

STEP = 1e-3  # in standard deviations, of the smooth map from z to parameters
BATCH = 4096  # bicycles at a time


class NothingUncertain(InputError):
    """A model of which nothing is uncertain."""


class UncertainModel:
    """A model with what is uncertain about it."""

    def __init__(
        self,
        model: str | Path | Mapping[str, Any],
        *,
        sd: Mapping[str, float] | None = None,
        relative_cornering_stiffness_sd: float | None = None,
        follow: Callable[[Mapping[str, Any]], Mapping[str, Any]] | None = None,
        defaults: bool = False,
        bicycle_sd: Mapping[str, float] | None = None,
        bicycle_covariance: ParameterCovariance | None = None,
    ) -> None:
        self.follow = follow or (lambda parameters: {})
        source = str(model) if isinstance(model, str | Path) else model
        content: dict[str, Any] = {"model": source, "outputs": ["parameters"]}
        base = read_model(source) if isinstance(source, str) else build_model(source)
        if bicycle_sd is not None:
            covariance = bicycle_covariance or ParameterCovariance()
            base = replace(base, bicycle=replace(base.bicycle, sd=bicycle_sd, covariance=covariance))
        self._stated = base
        # an unknown name is refused before the equations are derived
        deviations = standard_deviations(base, sd or {}, assume=defaults)
        probe = build_sweep(content)
        measured = any("tyre" in table for table in probe.model.get("effects", {}).values())
        if relative_cornering_stiffness_sd and not measured:
            raise InputError(
                "relative_cornering_stiffness_sd needs a measured tyre in the model file (tyre, pressure_bar)"
            )
        relative = relative_cornering_stiffness_sd
        self.relative = (CORNERING_STIFFNESS if defaults else 0.0) if relative is None else relative
        self._relative_given = bool(relative)
        laws = [e.identifier for e in self._stated.effects if e.slot == "contact law"]  # drawn as the tyre is
        self._of_tyre = tuple(key for key in self._stated.sd if measured and ParameterKey.parse(key).effect in laws)
        followers = set(self.follow(self._stated.parameters))
        self._own = {
            key: deviation for key, deviation in deviations.items() if key in (sd or {}) or key not in followers
        }
        correlated = [  # correlated, but not drawn with a tyre's stiffnesses: its trail, a stated covariance
            key
            for key in self._stated.covariance.names
            if key not in self._of_tyre and key in self._own and self._own[key].origin in (TABLE, FILE, MODEL_FILE)
        ]
        single = dict(sd or {}) | {
            key: deviation.sd
            for key, deviation in self._own.items()  # as given, perhaps one number for both wheels
            if not {key, str(ParameterKey.parse(key).whole)} & set(sd or {})
            and key not in (*self._of_tyre, *correlated)
        }
        sampled: dict[str, Any] = {key: {"sd": value} for key, value in single.items() if value}
        joint = (
            {"parameters": correlated, "covariance": self._stated.covariance.among(correlated).tolist()}
            if correlated
            else {}
        )
        sampled |= {"joint": [joint]} if correlated else {}
        sampled |= {"tyre_covariance": True, "relative_cornering_stiffness_sd": self.relative} if measured else {}
        if not sampled:
            stated_sd = "an sd of 0" if self._stated.bicycle.sd else "no sd"
            raise NothingUncertain(
                f"nothing is uncertain: the bicycle states {stated_sd} "
                "and the model has no measured tyre; give some (--sd c=0.005) or take the defaults for the rest"
            )
        self.sampler = Sampler(build_sweep(content | {"samples": 2, "sampled": sampled}))
        self.measurements = self.sampler.draws
        self.names = tuple(name for group in self.measurements.values() for name in group)

    @property
    def unstated_stiffnesses(self) -> tuple[str, ...]:
        """Cornering stiffnesses whose source states no standard deviation, where none is assumed either."""
        return () if self.relative else self._stated.assumed_sd

    @cached_property
    def deviations(self) -> dict[str, Deviation]:
        """Key -> :class:`bicycle.model.default_sd.Deviation` of every parameter that does not follow another."""
        deviations = dict(self._own)
        columns = [self.names.index(name) for name in TYRE_DRAWS if name in self.names]
        for key in self._of_tyre:  # what the tyre's covariance gives, with what is assumed here
            origin, why = TABLE, ""
            if key in self._stated.assumed_sd and self.relative:
                origin = GIVEN if self._relative_given else ASSUMED
                either = ParameterKey.parse(key).name == "relaxation_length"
                of = "of either stiffness" if either else "at each measured condition"
                why = f"{100 * self.relative:.3g} % {of}, the tyre's source states none"
            deviations[key] = Deviation(float(np.linalg.norm(self.jacobian[key][columns])), origin, why)
        return deviations

    def origin(self, measurement: str) -> str:
        """Origin of the standard deviation of ``measurement``, one of the ``measurements``."""
        names = self.measurements[measurement]
        if names[0] not in TYRE_DRAWS:
            origins = ((d.origin, {key, str(ParameterKey.parse(key).whole)}) for key, d in self._own.items())
            return next(origin for origin, keys in origins if keys & set(names))
        unstated = ("cornering_stiffness", "relaxation_length")[TYRE_DRAWS.index(names[0])]
        if not (self.relative and any(ParameterKey.parse(key).name == unstated for key in self._stated.assumed_sd)):
            return TABLE
        return GIVEN if self._relative_given else ASSUMED

    def points(self, z: Array, *, linear: bool = False, share: float = 1.0) -> Points:
        """Compute the parameters (SI) of bicycles from standard normal numbers ``z`` (m, names); impossible are marked.

        ``linear``: mean + factor z; ``share``: of the way from the nominal bicycle.
        """
        sampler = copy(self.sampler)
        sampler.sweep = replace(sampler.sweep, samples=max(len(z), 2))
        draws = dict(zip(self.names, np.ascontiguousarray(z.T), strict=True))
        points = sampler.points(0, len(z), draws, linear=linear, share=share)
        with np.errstate(all="ignore"):  # of what is marked
            return replace(points, values={**points.values, **self.follow(points.values)})

    def filter_possible(self, z: Array) -> tuple[Array, dict[str, int]]:
        """Select the rows of ``z`` (m, names) that make a bicycle; also count the others by reason."""
        possible, counts = [], Counter[str]()
        for start in range(0, len(z), BATCH):
            rows = z[start : start + BATCH]
            impossible = self.points(rows).refused
            possible.append(rows[~impossible.mask])
            counts.update(impossible.counts)
        return np.concatenate(possible), dict(counts)

    @cached_property
    def nominal(self) -> Model:
        """The model at the means."""
        return self.sampler.variant(self.points(np.zeros((1, len(self.names))), linear=True), 0)

    @cached_property
    def jacobian(self) -> dict[str, Array]:
        """Derivative (names,) of every parameter, SI, with respect to the standard normal numbers."""
        steps = STEP * np.concatenate([np.eye(len(self.names)), -np.eye(len(self.names))])
        values = self.points(steps, linear=True).values
        halves = {key: np.broadcast_to(value, len(steps)).reshape(2, -1) for key, value in values.items()}
        return {key: (more - less) / (2 * STEP) for key, (more, less) in halves.items()}

    def covariance(self) -> tuple[tuple[str, ...], Array]:
        """List the p free parameters that are uncertain, or follow others; and their covariance (p, p), linear, SI."""
        entering = self.nominal.evaluator.symbolic.parameters
        rows = {
            key: row
            for key, row in self.jacobian.items()
            if row.any() and key not in self.sampler.tied and ("." in key or key in entering)
        }
        factor = np.array(list(rows.values()))
        return tuple(rows), factor @ factor.T

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings of the model on its data, with what is assumed here of the cornering stiffness."""
        warnings = self._stated.linear_model().warnings
        return (*stiffness_warnings(warnings, self.sampler.sweep.relative_cornering_stiffness_sd), *self.sampler.notes)

    def draw(self, samples: int, seed: int) -> Array:
        """Draw standard normal numbers (samples, names) from ``seed``."""
        check_memory("samples", samples, 32 * len(self.names))  # 8 bytes each, drawn, turned, sorted out and matched
        return np.array([normal(seed=seed, name=name, start=0, stop=samples) for name in self.names]).T

    def can_match(self, samples: int) -> bool:
        """True if :meth:`matched_draw` has enough with a number ``samples``."""
        return samples > len(self.names) + 1

    def matched_draw(self, samples: int, seed: int) -> Array:
        """Draw standard normal numbers (samples, names) whose mean is 0 and whose covariance is 1 exactly."""
        if not self.can_match(samples):
            raise InputError(f"{samples} samples of {len(self.names)} numbers cannot be matched; take more samples")
        z = self.draw(samples, seed)
        deviation = z - z.mean(0)
        return np.asarray(np.linalg.solve(np.linalg.cholesky(np.atleast_2d(np.cov(deviation.T))), deviation.T).T)

    def gradient(self, slopes: Mapping[str, Any]) -> Array:
        """Convert derivatives ``slopes`` (...) with the free parameters to derivatives (..., names) with z."""
        parts = (np.asarray(slope)[..., None] * self.jacobian[key] for key, slope in slopes.items())
        return np.asarray(sum(parts, 0.0))

    def change(self, slopes: Mapping[str, Any], z: Array) -> Array:
        """Compute first-order changes (m, ...) by derivatives ``slopes``, of samples ``z`` (m, names)."""
        if not len(z):
            return np.zeros((0, *np.shape(next(iter(slopes.values())))))
        values, nominal = self.points(z).harmless.values, self.nominal.parameters
        change = {key: np.broadcast_to(np.asarray(values[key]) - nominal[key], len(z)) for key in slopes}
        return np.asarray(sum(np.multiply.outer(change[key], slope) for key, slope in slopes.items()))

    def shares(self, gradient: Array) -> dict[str, float]:
        """Compute the share of the linear variance of each measurement, from the ``gradient`` (names,) in z."""
        square, ends = gradient**2, np.cumsum([len(group) for group in self.measurements.values()])
        parts = zip(self.measurements, np.split(square, ends[:-1]), strict=True)
        return {name: float(part.sum() / max(square.sum(), np.finfo(float).tiny)) for name, part in parts}

    def batches(
        self, z: Array, size: int = BATCH, *, share: float = 1.0
    ) -> Iterator[tuple[slice, SpeedPolynomial, NDArray[np.bool_], Mapping[str, Any]]]:
        """Yield batches of ``size``: rows of ``z``, state matrices, True where not to be used, parameters (SI)."""
        family = ModelFamily(self.nominal)
        if len(self.nominal.linear_model().ranges) > 1:
            raise InputError(
                "the equations of this model switch at a speed, which uncertainty propagation does not cover"
            )
        for start in range(0, len(z), size):
            rows = slice(start, min(start + size, len(z)))
            points = self.points(z[rows], share=share)
            polynomial, impossible = family.polynomials(points.harmless.values, rows.stop - start)
            yield rows, polynomial, points.refused.mask | impossible, points.harmless.values

    def name_modes(self, z: Array, speeds: Array) -> Iterator[tuple[slice, Named, NDArray[np.bool_]]]:
        """Yield batches: rows of ``z``, named roots (m, k, n) at ``speeds`` (k,), m/s, True where not to be used."""
        rules = Rules.of(self.nominal.linear_model())
        for rows, polynomial, impossible, values in self.batches(z, max(1, BATCH // len(speeds))):
            count = rows.stop - rows.start
            gravity, wheelbase = (np.broadcast_to(np.asarray(values[key], float), count) for key in "gw")
            at = np.broadcast_to(speeds, (count, len(speeds)))
            yield rows, name_stack(rules, polynomial, np.sqrt(gravity * wheelbase), gravity, at), impossible
