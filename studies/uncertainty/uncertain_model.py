"""A model with what is uncertain about it: from standard normal numbers to bicycles.

Uncertain are what the bicycle file states (sd), the measured tyre (covariance of the tyre map at the wheel loads) and
any parameter given a standard deviation. Each measurement is a set of independent standard normal numbers z, from
which the sampler of the sweeps makes parameters: masses move wheel loads, wheel loads the tyre.
"""

from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.batch import Coefficients, coefficients
from bicycle.model import Model
from studies.sweeps.draws import normal
from studies.sweeps.points import ImpossibleItem, Points, Sampler
from studies.sweeps.sweep_file import build_sweep
from studies.sweeps.tyre_table import said_of_stiffness
from tyre.errors import InputError

Array = NDArray[np.float64]
STEP = 1e-3  # in standard deviations, of the smooth map from z to parameters
BATCH = 4096  # bicycles at a time


class UncertainModel:
    """A model with what is uncertain about it.

    Parameters
    ----------
    model : path or mapping
        Model file or its content.
    sd : mapping
        Standard deviations (SI) of further parameters, ``effect.name[.wheel]`` or bicycle keys.
    relative_cornering_stiffness_sd : float
        Assumed sd(C_Fy)/C_Fy, for tyre tables that state none.
    follow : function
        From all parameters (key -> number or array) to those that hang on others and move with them, for example a
        hinge that stays on the steer axis; default: none does.

    Raises
    ------
    InputError
        Nothing is uncertain, or a parameter is unknown.
    """

    def __init__(
        self,
        model: str | Path | Mapping[str, Any],
        *,
        sd: Mapping[str, float] | None = None,
        relative_cornering_stiffness_sd: float = 0.0,
        follow: Callable[[Mapping[str, Any]], Mapping[str, Any]] | None = None,
    ) -> None:
        self.follow = follow or (lambda parameters: {})
        content: dict[str, Any] = {"model": str(model) if isinstance(model, str | Path) else model}
        content |= {"outputs": ["parameters"], "samples": 2, "sampled": {k: {"sd": v} for k, v in (sd or {}).items()}}
        probe = build_sweep(content | {"sampled": {}, "samples": 1})
        tables = probe.model.get("effects", {}).values()
        stated = _stated_sd(content["model"])
        content["sampled"] |= {key: {"sd": value} for key, value in stated.items() if key not in content["sampled"]}
        if any("tyre" in table for table in tables):
            content["sampled"]["tyre_covariance"] = True
            content["sampled"]["relative_cornering_stiffness_sd"] = relative_cornering_stiffness_sd
        elif relative_cornering_stiffness_sd:
            raise InputError(
                "relative_cornering_stiffness_sd needs a measured tyre in the model file (tyre, pressure_bar)"
            )
        if not content["sampled"]:
            raise InputError(
                "nothing is uncertain: the bicycle states no sd and the model has no measured tyre; "
                "give standard deviations, for example --sd c=0.005"
            )
        self.sampler = Sampler(build_sweep(content))
        self.measurements = self.sampler.draws
        self.names = tuple(name for group in self.measurements.values() for name in group)

    def points(self, z: Array) -> Points:
        """Parameters of bicycles (m,) from standard normal numbers (m, names).

        Raises
        ------
        InputError
            One of them is physically impossible.
        """
        sampler = copy(self.sampler)
        sampler.sweep = replace(sampler.sweep, samples=max(len(z), 2))
        try:
            found = sampler.points(0, len(z), dict(zip(self.names, z.T, strict=True)))
        except ImpossibleItem as error:
            raise InputError(f"Monte Carlo {error.where}: {error.why}; give smaller standard deviations") from error
        return replace(found, values={**found.values, **self.follow(found.values)})

    @cached_property
    def nominal(self) -> Model:
        """The model at the means."""
        return self.sampler.variant(self.points(np.zeros((1, len(self.names)))), 0)

    @cached_property
    def jacobian(self) -> dict[str, Array]:
        """Derivative (names,) of every parameter with respect to the standard normal numbers."""
        steps = STEP * np.concatenate([np.eye(len(self.names)), -np.eye(len(self.names))])
        values = self.points(steps).values
        halves = {key: np.broadcast_to(value, len(steps)).reshape(2, -1) for key, value in values.items()}
        return {key: (more - less) / (2 * STEP) for key, (more, less) in halves.items()}

    def covariance(self) -> tuple[tuple[str, ...], Array]:
        """Free parameters of the model that are uncertain, or follow others, and their covariance to first order, SI.

        As :func:`bicycle.propagation.mode_sd` takes them.
        """
        entering = self.nominal.evaluator.symbolic.parameters
        rows = {
            key: row for key, row in self.jacobian.items()
            if row.any() and key not in self.sampler.tied and ("." in key or key in entering)
        }  # fmt: skip
        factor = np.array(list(rows.values()))
        return tuple(rows), factor @ factor.T

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the model says of its data, with what is assumed here of the cornering stiffness."""
        warnings = self.sampler.model.linear_model().warnings
        return said_of_stiffness(warnings, self.sampler.sweep.relative_cornering_stiffness_sd)

    def draw(self, samples: int, seed: int) -> Array:
        """Standard normal numbers (samples, names)."""
        return np.array([normal(seed=seed, name=name, start=0, stop=samples) for name in self.names]).T

    def matched_draw(self, samples: int, seed: int) -> Array:
        """The same, shifted and mixed so that their mean is 0 and their covariance 1 exactly.

        The sd of these samples then differs from the linear one by what is not linear, hardly by chance.

        Raises
        ------
        InputError
            Too few samples for so many numbers.
        """
        if samples <= len(self.names) + 1:
            raise InputError(f"{samples} samples of {len(self.names)} numbers cannot be matched; take more samples")
        z = self.draw(samples, seed)
        away = z - z.mean(0)
        return np.asarray(np.linalg.solve(np.linalg.cholesky(np.cov(away.T)), away.T).T)

    def gradient(self, slopes: Mapping[str, Any]) -> Array:
        """Derivative with respect to z from derivatives with respect to the free parameters."""
        total: Any = 0.0
        for key, slope in slopes.items():
            total = total + np.asarray(slope)[..., None] * self.jacobian[key]
        return np.asarray(total)

    def shares(self, gradient: Array) -> dict[str, float]:
        """Part of the linear variance that each measurement causes."""
        square, found, at = gradient**2, {}, 0
        for name, group in self.measurements.items():
            found[name] = float(square[at : at + len(group)].sum() / max(square.sum(), np.finfo(float).tiny))
            at += len(group)
        return found

    def batches(self, z: Array, size: int = BATCH) -> list[tuple[slice, Coefficients]]:
        """Coefficient matrices of bicycles (m, names), in batches.

        Raises
        ------
        InputError
            The equations switch at a speed, or a bicycle has no positive definite mass matrix.
        """
        linear, found = self.nominal.linear_model(), []
        if len(linear.ranges) > 1:
            raise InputError(
                "the equations of this model switch at a speed, which uncertainty propagation does not cover"
            )
        for start in range(0, len(z), size):
            rows = slice(start, min(start + size, len(z)))
            points = self.points(z[rows])
            matrices = coefficients(linear, self.nominal.evaluator, points.values, rows.stop - start)
            if matrices.refused.any():
                first = start + int(np.argmax(matrices.refused))
                raise InputError(
                    f"Monte Carlo sample {first}: the mass matrix is not positive definite "
                    f"({matrices.refused.sum()} of {len(matrices.refused)} bicycles); give smaller standard deviations"
                )
            found.append((rows, matrices))
        return found


def _stated_sd(model: Any) -> dict[str, float]:
    """Standard deviations of the bicycle file."""
    from bicycle.model_file import build_model, read_model
    from bicycle.parameters import UNITS

    nominal = read_model(model) if isinstance(model, str) else build_model(model)
    return {key: value for key, value in nominal.bicycle.sd.items() if value > 0 and key in UNITS}
