"""Measured uncertainty carried to frequency, damping ratio and critical speeds, linearly and by Monte Carlo.

Uncertain are what the bicycle file states (sd), the measured tyre (covariance of the tyre map at the wheel loads) and
any parameter given a standard deviation. Each measurement is a set of independent standard normal numbers z, from
which the sampler of the sweeps makes parameters: masses move wheel loads, wheel loads the tyre.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.batch import Coefficients, coefficients, follow_crossing, state_matrices
from bicycle.critical import CriticalSpeed, critical_speeds
from bicycle.eigen import eigenvalues
from bicycle.matching import assign
from bicycle.model import Model
from bicycle.modes import modes
from bicycle.propagation import damping_ratio_gradient, frequency_gradient
from bicycle.sensitivity import critical_speed_sensitivities, sensitivities
from studies.sweeps.draws import normal
from studies.sweeps.points import Points, Sampler
from studies.sweeps.sweep_file import build_sweep
from studies.sweeps.tyre_table import said_of_stiffness
from studies.uncertainty.quantity import Quantity
from tyre.errors import InputError

Array = NDArray[np.float64]
STEP = 1e-3  # in standard deviations, of the smooth map from z to parameters
BATCH = 4096  # bicycles at a time
CONTINUATION = 32  # steps


class Uncertainty:
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
        """Parameters of bicycles (m,) from standard normal numbers (m, names)."""
        model = Sampler.__new__(Sampler)
        model.__dict__ = {**vars(self.sampler), "sweep": replace(self.sampler.sweep, samples=max(len(z), 2))}
        found = model.points(0, len(z), dict(zip(self.names, z.T, strict=True)))
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

    def quantities(
        self,
        speeds: Array,
        *,
        max_speed: float = 60.0,
        samples: int = 2000,
        seed: int = 0,
        only: Collection[str] | None = None,
        matched: bool = False,
    ) -> list[Quantity]:
        """Frequency and damping ratio of the named oscillations at speeds (m/s), and the critical speeds.

        ``only`` names the modes that are wanted, None is all of them; ``matched`` as in :meth:`matched_draw`.
        """
        z = (self.matched_draw if matched else self.draw)(samples, seed)
        v = np.atleast_1d(np.asarray(speeds, float))
        return [*self._of_modes(v, z, only), *self._critical(z, max_speed, only)]

    def crossings(self, max_speed: float = 60.0) -> dict[str, CriticalSpeed]:
        """Critical speeds of the nominal model, by a name of their own."""
        found: dict[str, CriticalSpeed] = {}
        for one in critical_speeds(self.nominal.linear_model(), max_speed=max_speed):
            name = f"{one.mode} {'unstable' if one.direction == 'destabilising' else 'stable'} above"
            number = 1 + sum(other.startswith(name) for other in found)
            found[name if number == 1 else f"{name} ({number})"] = one
        return found

    def crossing_speeds(self, crossing: CriticalSpeed, gradient: Array, z: Array) -> Array:
        """A critical speed (m/s) of bicycles with numbers z (m, names); NaN where it has vanished."""
        start = np.maximum(crossing.speed + z @ gradient, 0.2 * crossing.speed)
        result, _ = self._newton(crossing, z, start, np.full(len(z), crossing.frequency))
        lost = np.flatnonzero(np.isnan(result))
        if lost.size:  # too far for one leap: from the nominal bicycle in small steps
            speeds, last = np.full((2, len(lost)), crossing.speed)
            frequency = np.full(len(lost), crossing.frequency)
            for share in np.linspace(0, 1, CONTINUATION + 1)[1:]:
                kept = ~np.isnan(speeds)
                ahead = np.maximum(2 * speeds - last, 0.5 * speeds)[kept]
                last = speeds.copy()
                speeds[kept], frequency[kept] = self._newton(crossing, share * z[lost[kept]], ahead, frequency[kept])
            result[lost] = speeds
        return result

    def _newton(self, crossing: CriticalSpeed, z: Array, start: Array, frequency: Array) -> tuple[Array, Array]:
        result, omega = np.full((2, len(z)), np.nan)
        destabilising = crossing.direction == "destabilising"
        for rows, found in self._batches(z):
            v, w, there = follow_crossing(found, start[rows], frequency[rows], destabilising=destabilising)
            result[rows], omega[rows] = np.where(there, v, np.nan), w
        return result, omega

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

    def _batches(self, z: Array) -> list[tuple[slice, Coefficients]]:
        linear, found = self.nominal.linear_model(), []
        if len(linear.ranges) > 1:
            raise InputError(
                "the equations of this model switch at a speed, which uncertainty propagation does not cover"
            )
        for start in range(0, len(z), BATCH):
            rows = slice(start, min(start + BATCH, len(z)))
            points = self.points(z[rows])
            found.append((rows, coefficients(linear, self.nominal.evaluator, points.values, rows.stop - start)))
        return found

    def _of_modes(self, speeds: Array, z: Array, only: Collection[str] | None) -> list[Quantity]:
        if not speeds.size:
            return []
        named = modes(self.nominal.linear_model(), speeds)
        slopes = sensitivities(self.nominal, speeds)
        gradients = self.gradient({key: slopes.of(key) for key in slopes.parameters})  # (m, n, names)
        sampled = self._followed(speeds, slopes.eigenvalues, gradients, z)
        result = []
        for k, speed in enumerate(speeds):
            for name in named.names:
                value = complex(named.branch(name)[k, 0])
                if not value.imag > 0 or (only is not None and name not in only):
                    continue
                at = int(np.abs(slopes.eigenvalues[k] - value).argmin())
                root, slope, drawn = slopes.eigenvalues[k, at], gradients[k, at], sampled[k, :, at]
                with np.errstate(invalid="ignore"):
                    oscillates = np.where(drawn.imag > 0, drawn, np.nan)
                pairs = (
                    ("frequency", "Hz", root.imag / (2 * np.pi), frequency_gradient(slope),
                     oscillates.imag / (2 * np.pi)),
                    ("damping ratio", "1", -root.real / abs(root), damping_ratio_gradient(complex(root), slope),
                     -oscillates.real / np.abs(oscillates)),
                )  # fmt: skip
                for what, unit, nominal, gradient, samples in pairs:
                    label = f"{name} {what} at {speed:g} m/s"
                    result.append(Quantity(label, unit, float(nominal), gradient, self.shares(gradient), samples))
        return result

    def _followed(self, speeds: Array, roots: Any, gradients: Any, z: Array) -> Any:
        """Eigenvalues (speeds, samples, n) in the order of the nominal ``roots``; NaN where two are confused."""
        result = np.full((len(speeds), len(z), roots.shape[1]), np.nan + 0j)
        for rows, found in self._batches(z):
            values = eigenvalues(state_matrices(found, speeds[None]))
            for k in range(len(speeds)):
                expected = roots[k] + z[rows] @ gradients[k].T
                cost = np.abs(expected[:, :, None] - values[:, k, None, :])
                order = assign(cost)
                error = np.take_along_axis(cost, order[:, :, None], 2)[..., 0]
                rival = np.where(order[:, :, None] == np.arange(roots.shape[1]), np.inf, cost).min(2)
                chosen = np.take_along_axis(values[:, k], order, 1)
                result[k, rows] = np.where(error < rival, chosen, np.nan)
        return result

    def _critical(self, z: Array, max_speed: float, only: Collection[str] | None) -> list[Quantity]:
        found = {name: one for name, one in self.crossings(max_speed).items() if only is None or one.mode in only}
        slopes = critical_speed_sensitivities(self.nominal, list(found.values()))
        result = []
        for k, (name, crossing) in enumerate(found.items()):
            gradient = self.gradient({key: value[k] for key, value in slopes.items()})
            samples = self.crossing_speeds(crossing, gradient, z)
            result.append(Quantity(name, "m/s", crossing.speed, gradient, self.shares(gradient), samples))
        return result


def _stated_sd(model: Any) -> dict[str, float]:
    """Standard deviations of the bicycle file."""
    from bicycle.model_file import build_model, read_model
    from bicycle.parameters import UNITS

    nominal = read_model(model) if isinstance(model, str) else build_model(model)
    return {key: value for key, value in nominal.bicycle.sd.items() if value > 0 and key in UNITS}
