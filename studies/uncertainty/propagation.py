"""Measured uncertainty carried to modes, critical speeds and other outputs, linearly and by Monte Carlo."""

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from bicycle.model.default_sd import ASSUMED, EXACT, GIVEN
from bicycle.model.eigen import eigenvalues, oscillating
from bicycle.model.model_family import ModelFamily
from bicycle.parameters.bicycle import UNITS
from bicycle.parameters.parameter_covariance import ParameterCovariance, ParameterKey
from bicycle.stability.critical import CriticalSpeed, CrossingIdentity, by_identity, critical_speeds, follow_crossing
from bicycle.stability.named_modes import modes
from bicycle.stability.naming import NONE, Rules
from bicycle.stability.sensitivity import critical_speed_sensitivities, sensitivities
from studies.model_space.command_options import check_memory
from studies.model_space.outputs import MODE, OUTPUTS, ROOTS, Output
from studies.reporting.markdown_text import render_file
from studies.sweep.sampler import Points
from studies.sweep.worker import named_pair
from studies.uncertainty.uncertain_model import STEP, UncertainModel
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.progress import missing_package_text

LOOK = 0.5  # m/s between the speeds at which unstable roots are counted


@dataclass(frozen=True, eq=False)
class Quantity:
    """One result with its uncertainty."""

    name: str  # with the speed, as in tables
    unit: str  # of value, gradient and samples
    value: float  # of the nominal model, in ``unit``
    gradient: Array  # (p,), in ``unit`` for one standard deviation of each independent draw
    shares: Mapping[str, float]  # of the linear variance (sum 1), by what was measured together
    samples: Array  # (n,), in ``unit``; NaN: a random bicycle without it
    crossing: CrossingIdentity | None = None  # which critical speed it is; None: another quantity

    @property
    def linear_sd(self) -> float:
        """Standard deviation by linear propagation."""
        return float(np.linalg.norm(self.gradient))

    @property
    def lost(self) -> int:
        """Number of samples without this quantity."""
        return int(np.isnan(self.samples).sum())

    @property
    def kept(self) -> Array:
        """The samples that have it."""
        return self.samples[~np.isnan(self.samples)]

    @property
    def sampled_mean(self) -> float:
        """Mean of the samples that have it; NaN if none has."""
        return float(self.kept.mean()) if len(self.kept) else math.nan

    @property
    def sampled_sd(self) -> float:
        """Standard deviation of the samples that have it."""
        return float(self.kept.std(ddof=1)) if len(self.kept) > 1 else math.nan

    def band(self, share: float = 0.95) -> tuple[float, float]:
        """Central interval that holds a ``share`` of the samples that have it; NaN if none has."""
        if not len(self.kept):
            return math.nan, math.nan
        low, high = np.quantile(self.kept, [(1 - share) / 2, (1 + share) / 2])
        return float(low), float(high)


class Uncertainty(UncertainModel):
    """An uncertain model and the quantities that follow from it."""

    @property
    def given_anew(self) -> tuple[list[str], ParameterCovariance]:
        """Parameters whose covariance in the model does not hold, as the user gives their sd; and that covariance."""
        covariance = self._stated.covariance
        origin = {key: deviation.origin for key, deviation in self._own.items()}
        return [
            name for name in covariance.names if covariance.sd[name] and origin.get(name) in (GIVEN, EXACT)
        ], covariance

    def quantities(
        self,
        speeds: Array,
        *,
        max_speed: float = 60.0,
        samples: int = 2000,
        seed: int = 0,
        only: Collection[str] | None = None,
        matched: bool = False,
        outputs: Sequence[Output] = (),
    ) -> list[Quantity]:
        """Frequency and damping ratio of the named oscillations, the critical speeds, and further outputs."""
        v = np.atleast_1d(np.asarray(speeds, float))
        order = self.nominal.linear_model().order
        check_memory("samples", samples, 64 * (len(v) * order + len(self.names)))  # roots and frequencies, draws
        z = (self.matched_draw if matched and self.can_match(samples) else self.draw)(samples, seed)
        z, _ = self.filter_possible(z)
        quantities = [*self._of_modes(v, z, only), *self._critical(z, max_speed, only)]
        return quantities + [quantity for output in outputs for quantity in self._of_output(output, v, z, max_speed)]

    def left_out(self, *, samples: int = 2000, seed: int = 0) -> dict[str, int]:
        """Count the samples that are impossible and left out, by reason."""
        return self.filter_possible(self.draw(samples, seed))[1]

    def count_unlisted(
        self, quantities: Sequence[Quantity], *, max_speed: float = 60.0, samples: int = 2000, seed: int = 0
    ) -> int:
        """Count the samples, at least, with critical speeds up to ``max_speed`` (m/s) that the nominal model lacks."""
        listed = {q.crossing: q.samples for q in quantities}
        crossings = {which: crossing for which, crossing in self.crossings(max_speed).items() if which in listed}
        z, _ = self.filter_possible(self.draw(samples, seed))
        speeds = np.linspace(min(LOOK, max_speed), max_speed, max(2, round(max_speed / LOOK)))
        number = 0
        for rows, polynomial, *_ in self.batches(z, 64):  # bicycles at a time
            unstable = (eigenvalues(polynomial(speeds[None])).real > 0).sum(-1)  # (m, speeds)
            change = np.zeros_like(unstable)
            for which, crossing in crossings.items():
                at = listed[which][rows, None]
                change += crossing.unstable_roots * ((speeds[0] < at) & (at <= speeds))
            number += int((unstable - unstable[:, :1] != change).any(1).sum())
        return number

    def crossings(self, max_speed: float = 60.0) -> dict[CrossingIdentity, CriticalSpeed]:
        """Critical speeds of the nominal model up to ``max_speed`` (m/s), by mode, direction and occurrence."""
        return by_identity(critical_speeds(self.nominal.linear_model(), max_speed=max_speed))

    def crossing_speeds(
        self, crossing: CriticalSpeed, slopes: Mapping[str, float], z: Array, max_speed: float
    ) -> Array:
        """Follow a critical speed to other bicycles ``z`` (m, names): (m,), m/s; NaN where it has vanished.

        ``slopes`` are its derivatives with the free parameters, m/s each.
        """
        start = np.maximum(crossing.speed + self.change(slopes, z), 0.2 * crossing.speed)
        omega = crossing.angular_frequency
        result, _ = self._newton(crossing, z, start, np.full(len(z), omega))
        lost = np.flatnonzero(np.isnan(result))
        if lost.size:  # too far for one leap: from the nominal bicycle in small steps
            speeds, last = np.full((2, len(lost)), crossing.speed)
            frequency = np.full(len(lost), omega)
            for share in np.linspace(0, 1, 32 + 1)[1:]:  # steps
                tracked = ~np.isnan(speeds)
                guess = np.maximum(2 * speeds - last, 0.5 * speeds)[tracked]
                last = speeds.copy()
                now = self._newton(crossing, z[lost[tracked]], guess, frequency[tracked], share=float(share))
                speeds[tracked], frequency[tracked] = now
            result[lost] = speeds
        return np.where(result <= max_speed, result, np.nan)

    def _newton(
        self, crossing: CriticalSpeed, z: Array, start: Array, frequency: Array, *, share: float = 1.0
    ) -> tuple[Array, Array]:
        result, omega = np.full((2, len(z)), np.nan)
        for rows, polynomial, impossible, _ in self.batches(z, share=share):
            begin = start[rows], frequency[rows]
            v, w, converged = follow_crossing(polynomial, *begin, destabilising=crossing.destabilising)
            result[rows], omega[rows] = np.where(converged & ~impossible, v, np.nan), w
        return result, omega

    def _of_modes(self, speeds: Array, z: Array, only: Collection[str] | None) -> Iterator[Quantity]:
        if not speeds.size:
            return
        linear = self.nominal.linear_model()
        nominal = modes(linear, speeds)
        names = Rules.of(linear).names
        derivatives = sensitivities(self.nominal, speeds)
        gradients = self.gradient({key: derivatives.of(key) for key in derivatives.parameters})  # (m, n, names)
        mode_names = [name for name in nominal.names if "+" not in name and (only is None or name in only)]
        sampled = {name: np.full((len(z), len(speeds)), complex(np.nan, np.nan)) for name in mode_names}
        for rows, named, impossible in self.name_modes(z, speeds):
            for name, roots in sampled.items():
                of_mode = (named.first == names.index(name)) & (named.second == NONE) & ~impossible[:, None, None]
                roots[rows] = named_pair(named.values, of_mode)[..., 0]
        outputs = [output for output in OUTPUTS.values() if output.source == MODE and not output.complex_valued]
        for (k, speed), name in product(enumerate(speeds), mode_names):
            value = complex(nominal.branch(name)[k, 0])
            if value.imag > 0:
                at = int(np.abs(derivatives.eigenvalues[k] - value).argmin())
                root = complex(derivatives.eigenvalues[k, at])
                drawn = oscillating(sampled[name][:, k])
                for output in outputs:
                    gradient = output.root_gradient(root, gradients[k, at])
                    label, nominal_value = (
                        f"{name} {output.label} at {speed:g} m/s",
                        float(output.of_root(np.array(root))),
                    )
                    yield Quantity(
                        label, output.unit, nominal_value, gradient, self.shares(gradient), output.of_root(drawn)
                    )

    def _critical(self, z: Array, max_speed: float, only: Collection[str] | None) -> Iterator[Quantity]:
        all_crossings = self.crossings(max_speed).items()
        crossings = {which: crossing for which, crossing in all_crossings if only is None or crossing.mode in only}
        slopes = critical_speed_sensitivities(self.nominal, list(crossings.values()))
        for k, (which, crossing) in enumerate(crossings.items()):
            gradient = self.gradient({key: value[k] for key, value in slopes.items()})
            samples = self.crossing_speeds(crossing, {key: float(v[k]) for key, v in slopes.items()}, z, max_speed)
            yield Quantity(str(which), "m/s", crossing.speed, gradient, self.shares(gradient), samples, which)

    def _of_output(self, output: Output, speeds: Array, z: Array, max_speed: float) -> Iterator[Quantity]:
        """Yield an output of one number, at each of ``speeds`` (k,), m/s, if it has one; gradient by differences."""
        if output.by_speed and not speeds.size:
            raise InputError(f"output {output.name}: give --speeds (m/s) at which it is wanted")
        count = len(self.names)
        steps = self.points(STEP * np.concatenate([np.zeros((1, count)), np.eye(count), -np.eye(count)]), linear=True)
        values = self._values(output, speeds, steps, 2 * count + 1, max_speed)
        drawn = self._values(output, speeds, self.points(z), len(z), max_speed)
        for k in range(values.shape[1]):
            gradient = (values[1 : count + 1, k] - values[count + 1 :, k]) / (2 * STEP)
            label = f"{output.label} at {speeds[k]:g} m/s" if output.by_speed else output.label
            yield Quantity(label, output.unit, float(values[0, k]), gradient, self.shares(gradient), drawn[:, k])

    def _values(self, output: Output, speeds: Array, points: Points, count: int, max_speed: float) -> Array:
        """Evaluate an output (m, k) of ``count`` bicycles, at each speed if it has one, in its unit."""
        if output.source == ROOTS:
            polynomial, _ = ModelFamily(self.nominal).polynomials(points.harmless.values, count)
            return np.asarray(output.function(eigenvalues(polynomial(speeds[None]))))
        models = (self.sampler.variant(points, k) for k in range(count))
        return np.array([np.atleast_1d(output.function(model, speeds, max_speed)) for model in models], float)


def total_effects(
    uncertainty: Uncertainty, name: str | CrossingIdentity, *, max_speed: float = 60.0, base: int = 512, seed: int = 0
) -> dict[str, tuple[float, float, float]]:
    """Compute by measurement the first-order and total index of a critical speed and the 95 % half width of the total.

    Shares of its variance (Saltelli et al. 2010): which measurement would narrow it most.
    """
    try:
        from SALib.analyze import sobol
        from SALib.sample import sobol as sampling
    except ImportError as error:
        raise InputError(missing_package_text("SALib", extra="sensitivity")) from error
    crossings = uncertainty.crossings(max_speed)
    crossing = next((crossing for which, crossing in crossings.items() if str(which) == str(name)), None)
    if crossing is None:
        raise InputError(f"no critical speed {str(name)!r}; this model has {', '.join(map(str, crossings)) or 'none'}")
    slopes = critical_speed_sensitivities(uncertainty.nominal, [crossing])
    count = len(uncertainty.names)
    groups = [group for group, members in uncertainty.measurements.items() for _ in members]
    problem = {
        "num_vars": count,
        "names": list(uncertainty.names),
        "groups": groups,
        "bounds": [[0.0, 1.0]] * count,
        "dists": ["norm"] * count,
    }
    z = sampling.sample(problem, base, calc_second_order=False, seed=seed)
    speeds = uncertainty.crossing_speeds(crossing, {key: float(v[0]) for key, v in slopes.items()}, z, max_speed)
    lost = int(np.isnan(speeds).sum())
    if lost:
        raise InputError(
            f"{name} is missing up to {max_speed:g} m/s for {lost} of {len(z)} bicycles, so its variance is not "
            "defined; ask for another critical speed, or a higher --max-speed"
        )
    indices = sobol.analyze(problem, speeds, calc_second_order=False, seed=seed)
    rows = zip(uncertainty.measurements, indices["S1"], indices["ST"], indices["ST_conf"], strict=True)
    return {group: (float(first), float(total), float(half)) for group, first, total, half in rows}


AT_CONDITIONS = "where it was measured; its source states no uncertainty, elsewhere the misfit of the table counts"
LEAST = 40  # draws, of which one lies below 2.5 % on average and one above 97.5 %


def group_of(measurement: str) -> str:
    """Name the group of a ``measurement``: a tyre's stiffness, a kind of parameter of the bicycle, or an effect."""
    key = measurement.split(", ")[0]
    if key not in UNITS:
        return ParameterKey.parse(key).effect if "." in key else measurement  # the latter of the tyre
    if key in ("xB", "zB", "xH", "zH"):
        return "mass centres"
    return "masses and inertias" if UNITS[key] in ("kg", "kg m^2") else "bicycle geometry"


def by_group(shares: Mapping[str, float], group: Callable[[str], str] = group_of) -> dict[str, float]:
    """Sum the shares of the linear variance by group, from ``shares`` by measurement."""
    share_by_group: dict[str, float] = {}
    for measurement, share in shares.items():
        share_by_group[group(measurement)] = share_by_group.get(group(measurement), 0.0) + share
    return share_by_group


def known_exactly(model: UncertainModel, measurement: str, gradient: Array) -> dict[str, float]:
    """Compute by how much (share) a result's linear variance falls if one number of a ``measurement`` were exact.

    ``gradient`` (names,) is that of the result in z; the largest first.
    """
    rows = {key: model.jacobian[key] for key in model.measurements[measurement] if key in model.jacobian}
    total = gradient @ gradient
    shares = {k: float((row @ gradient) ** 2 / (row @ row) / total) for k, row in rows.items() if row.any() and total}
    return dict(sorted(shares.items(), key=lambda item: -item[1]))


def counted_as_exact(model: UncertainModel) -> dict[str, str]:
    """List the parameters of the equations that have no standard deviation, and why not."""
    entering = model.nominal.evaluator.symbolic.parameters
    reasons = {key: d.why for key, d in model.deviations.items() if d.origin == EXACT and key in entering}
    return reasons | dict.fromkeys(model.unstated_stiffnesses, AT_CONDITIONS)


def assumed_sd(model: UncertainModel) -> dict[str, float]:
    """List the assumed standard deviations (SI), which no source states, by parameter."""
    entering = model.nominal.evaluator.symbolic.parameters
    return {key: d.sd for key, d in model.deviations.items() if d.origin == ASSUMED and key in entering}


def remarks(quantities: Sequence[Quantity], unlisted: int, samples: int, max_speed: float) -> tuple[str, ...]:
    """Write remarks on what some samples do not have, and where linear propagation fails; ``max_speed`` in m/s."""
    content = {"found": quantities, "unlisted": unlisted, "samples": samples, "max_speed": max_speed, "least": LEAST}
    return _render_lines("remarks", content | {"differs": differs})


def describe_assumptions(model: UncertainModel) -> tuple[str, ...]:
    """Write lines on numbers that are treated as exact, by reason, and on deviations that are assumed."""
    exact: dict[str, list[str]] = {}
    for key, why in counted_as_exact(model).items():
        exact.setdefault(why, []).append(key)
    values = model.nominal.parameters
    sds = [  # with two digits, never as a power of ten
        (key, values[key], np.format_float_positional(sd, precision=2, fractional=False, trim="-"))
        for key, sd in assumed_sd(model).items()
    ]
    return _render_lines("stated", {"exact": exact, "assumed": sds})


def _render_lines(name: str, content: Mapping[str, Any]) -> tuple[str, ...]:
    return tuple(render_file("studies.uncertainty", f"{name}.txt.j2", content, escaped=False).splitlines())


def dropped_correlations(uncertainty: Uncertainty) -> tuple[str, ...]:
    """Write remarks on correlations in a model that are dropped because the user gives an sd."""
    names, covariance = uncertainty.given_anew
    correlated = len(covariance.names) - len(names)
    return tuple(
        f"{name}: the sd given replaces its correlation with {correlated} other parameters ({covariance.origin}); "
        "results may have a larger uncertainty than with it"
        for name in names
        if correlated
    )


def differs(q: Quantity) -> bool:
    """True if the two sd differ by more than a tenth and more than chance explains, 3 sd of the sampled sd."""
    chance = 3.0 / math.sqrt(2 * max(len(q.kept) - 1, 1))
    return not abs(q.sampled_sd - q.linear_sd) <= max(0.1, chance) * q.linear_sd + 1e-9 * abs(q.value)
