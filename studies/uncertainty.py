"""Measured uncertainty carried to frequency, damping ratio and critical speeds, linearly and by Monte Carlo.

Uncertain are what the bicycle file states (sd), the measured tyre (covariance of the tyre map at the wheel loads) and
any parameter given a standard deviation. Each measurement is a set of independent standard normal numbers z, from
which the sampler of the sweeps makes parameters: masses move wheel loads, wheel loads the tyre.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.batch import Coefficients, coefficients, follow_crossing, state_matrices
from bicycle.critical import CriticalSpeed, critical_speeds
from bicycle.eigen import eigenvalues
from bicycle.model import Model
from bicycle.modes import modes
from bicycle.propagation import damping_ratio_gradient, frequency_gradient
from bicycle.sensitivity import critical_speed_sensitivities, sensitivities
from bicycle.tracking import assign
from studies.sweep_draws import normal
from studies.sweep_file import build_sweep
from studies.sweep_points import Points, Sampler
from tyre.errors import InputError

Array = NDArray[np.float64]
STEP = 1e-3  # in standard deviations, of the smooth map from z to parameters
BATCH = 4096  # bicycles at a time
CONTINUATION = 32  # steps


@dataclass(frozen=True, eq=False)
class Quantity:
    """One result with its uncertainty.

    ``shares`` is the part of the linear variance each measurement causes; ``samples`` are the Monte Carlo values, NaN
    where the quantity does not exist or its root cannot be told from another.
    """

    name: str
    unit: str
    value: float
    gradient: Array  # per standard normal number
    shares: Mapping[str, float]
    samples: Array

    @property
    def linear_sd(self) -> float:
        """Standard deviation by linear propagation."""
        return float(np.linalg.norm(self.gradient))

    @property
    def lost(self) -> int:
        """Number of samples without this quantity."""
        return int(np.isnan(self.samples).sum())

    @property
    def sampled_sd(self) -> float:
        """Standard deviation of the samples that have it."""
        kept = self.samples[~np.isnan(self.samples)]
        return float(kept.std(ddof=1)) if len(kept) > 1 else float("nan")

    def band(self, share: float = 0.95) -> tuple[float, float]:
        """Central interval that holds so many of the samples."""
        low, high = np.nanquantile(self.samples, [(1 - share) / 2, (1 + share) / 2])
        return float(low), float(high)


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
    ) -> None:
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
        model.__dict__ = {**vars(self.sampler), "sweep": _with_samples(self.sampler.sweep, max(len(z), 2))}
        return model.points(0, len(z), dict(zip(self.names, z.T, strict=True)))

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

    def draw(self, samples: int, seed: int) -> Array:
        """Standard normal numbers (samples, names)."""
        return np.array([normal(seed=seed, name=name, start=0, stop=samples) for name in self.names]).T

    def quantities(
        self, speeds: Array, *, max_speed: float = 60.0, samples: int = 2000, seed: int = 0
    ) -> list[Quantity]:
        """Frequency and damping ratio of the named oscillations at speeds (m/s), and the critical speeds."""
        z = self.draw(samples, seed)
        return [*self._of_modes(np.atleast_1d(np.asarray(speeds, float)), z), *self._critical(z, max_speed)]

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

    def _of_modes(self, speeds: Array, z: Array) -> list[Quantity]:
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
                if not value.imag > 0:
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

    def _critical(self, z: Array, max_speed: float) -> list[Quantity]:
        found = self.crossings(max_speed)
        slopes = critical_speed_sensitivities(self.nominal, list(found.values()))
        result = []
        for k, (name, crossing) in enumerate(found.items()):
            gradient = self.gradient({key: value[k] for key, value in slopes.items()})
            samples = self.crossing_speeds(crossing, gradient, z)
            result.append(Quantity(name, "m/s", crossing.speed, gradient, self.shares(gradient), samples))
        return result


def total_effects(
    uncertainty: Uncertainty, name: str, *, max_speed: float = 60.0, base: int = 512, seed: int = 0
) -> dict[str, tuple[float, float, float]]:
    """Which measurement would narrow a critical speed most: variance-based indices of each (Saltelli et al. 2010).

    Returns measurement -> (first-order index, total index, its 95 % half-width). The first-order index is the part of
    the variance that vanishes on average when that measurement is made exact.

    Raises
    ------
    InputError
        SALib is missing, there is no such critical speed, or it vanishes for some of the bicycles.
    """
    try:
        from SALib.analyze import sobol
        from SALib.sample import sobol as sampling
    except ImportError as error:
        raise InputError("SALib is not installed; install it with pip install 'velotyre[sensitivity]'") from error
    crossings = uncertainty.crossings(max_speed)
    if name not in crossings:
        raise InputError(f"no critical speed {name!r}; this model has {', '.join(crossings) or 'none'}")
    crossing = crossings[name]
    slopes = critical_speed_sensitivities(uncertainty.nominal, [crossing])
    gradient = uncertainty.gradient({key: value[0] for key, value in slopes.items()})
    count = len(uncertainty.names)
    groups = [group for group, members in uncertainty.measurements.items() for _ in members]
    problem = {
        "num_vars": count, "names": list(uncertainty.names), "groups": groups,
        "bounds": [[0.0, 1.0]] * count, "dists": ["norm"] * count,
    }  # fmt: skip
    z = sampling.sample(problem, base, calc_second_order=False, seed=seed)
    speeds = uncertainty.crossing_speeds(crossing, gradient, z)
    lost = int(np.isnan(speeds).sum())
    if lost:
        raise InputError(
            f"{name} vanishes for {lost} of {len(z)} bicycles, so its variance is not defined; "
            "use smaller standard deviations or another critical speed"
        )
    found = sobol.analyze(problem, speeds, calc_second_order=False, seed=seed)
    return {
        group: (float(found["S1"][k]), float(found["ST"][k]), float(found["ST_conf"][k]))
        for k, group in enumerate(uncertainty.measurements)
    }


def _stated_sd(model: Any) -> dict[str, float]:
    """Standard deviations of the bicycle file."""
    from bicycle.model_file import build_model, read_model
    from bicycle.parameters import UNITS

    nominal = read_model(model) if isinstance(model, str) else build_model(model)
    return {key: value for key, value in nominal.bicycle.sd.items() if value > 0 and key in UNITS}


def _with_samples(sweep: Any, samples: int) -> Any:
    from dataclasses import replace

    return replace(sweep, samples=samples)
