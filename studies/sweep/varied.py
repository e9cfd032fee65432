"""Parameters that were varied and outputs that depend on them, bicycle by bicycle, as figures compare them."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.parameters.parameter_covariance import WHEELS
from studies.model_space.outputs import OUTPUTS, Output
from studies.model_space.sampling import normal, uniform
from studies.sweep.sampler import TYRE_DRAWS, Sampler
from studies.sweep.specification import SPEED, differences
from studies.sweep.stored import CRITICAL, Stored
from studies.sweep.worker import compute
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError

LEAST_SHARE = 0.1  # of the bicycles: an output that fewer have is not drawn over parameters
OCCURRENCE = ("", ", second", ", third", ", fourth")
GROWTH = "max_growth_rate"


@dataclass(frozen=True, eq=False)
class Varied:
    """A parameter that was varied."""

    name: str  # parameter, or what is drawn of it
    unit: str  # empty of a name or a ratio
    values: NDArray[Any]  # (cells, 1) along the grid, or (1, samples)

    @property
    def sampled(self) -> bool:
        """True if it was drawn, not set on the grid."""
        return self.values.shape[0] == 1 and self.values.shape[1] > 1

    @property
    def named(self) -> bool:
        """True if its values are names."""
        return self.values.dtype.kind not in "fiu"

    @property
    def label(self) -> str:
        """Name and unit."""
        return f"{self.name}, {self.unit}" if self.unit else self.name


def grid_parameters(stored: Stored) -> list[Varied]:
    """Parameters on the grid with more than one value, in the order of the file."""
    return [
        Varied(axis.name, stored.unit(axis.name), np.array(axis.values)[place.ravel()][:, None])
        for axis, place in zip(stored.sweep.axes, np.indices(stored.sweep.shape[:-1]), strict=True)
        if len(axis.values) > 1
    ]


def sampled_parameters(stored: Stored) -> tuple[list[Varied], str]:
    """Parameters that were drawn, drawn again, and a remark if they cannot be."""
    sweep = stored.sweep
    if not sweep.random or stored.reduced:
        return [], ""
    try:
        changed = "" if sweep.fingerprint == stored.fingerprint else differences(stored.made_of or None, sweep.made_of)
    except InputError as error:
        changed = str(error)
    if changed:
        return [], (
            f"the sampled parameters cannot be drawn again as in {stored.path.name}, since this has changed: {changed}"
            "; so figures over them are not drawn. Recompute the sweep"
        )
    sampler, count = Sampler(sweep), stored.samples
    parameters: list[Varied] = []

    def standard(name: str) -> Array:
        return normal(seed=sweep.seed, name=name, start=0, stop=count)

    for group, joint in zip(sweep.normals, sampler.joint, strict=True):
        draws = joint(np.array([standard(name) for name in group.names]))
        parameters += [Varied(name, stored.unit(name), row[None]) for name, row in zip(group.names, draws, strict=True)]
    for spread in sweep.uniforms:
        share = uniform(seed=sweep.seed, name=spread.name, start=0, stop=count)
        values = spread.low + (spread.high - spread.low) * share
        parameters.append(Varied(spread.name, stored.unit(spread.name), values[None]))
    keys = dict.fromkeys(key for sd in sweep.bicycle_sd.values() for key in sd)
    parameters += [Varied(f"{key} / its sd", "", standard(key)[None]) for key in keys]
    if sweep.tyre_covariance:
        names = [name for group in sampler.draws.values() for name in group]
        parameters += _draw_tyre_ratios(sampler, {name: standard(name) for name in names}, count)
    return [parameter for parameter in parameters if np.ptp(parameter.values) > 0], ""


def _draw_tyre_ratios(sampler: Sampler, draws: dict[str, Array], count: int) -> list[Varied]:
    """Ratios to the table of C and K of each wheel, drawn from the tyre's covariance, in the first cell of the grid."""
    drawn = sampler.points(0, count, draws).values
    plain = sampler.points(0, count, draws | dict.fromkeys(TYRE_DRAWS, np.zeros(count))).values
    ratios_to_table = list[Varied]()
    for wheel in WHEELS:
        ratios = {}
        for name in ("cornering_stiffness", "relaxation_length"):
            key = f"{sampler.contact}.{name}.{wheel}"
            if key in sampler.tyre_values:
                with np.errstate(invalid="ignore", divide="ignore"):
                    ratios[name] = np.broadcast_to(np.asarray(drawn[key] / plain[key], float), count)
        if len(ratios) == 2:
            ratios["lateral_stiffness"] = ratios["cornering_stiffness"] / ratios.pop("relaxation_length")
        ratios_to_table += [
            Varied(f"{name.replace('_', ' ')} {wheel} / table", "", np.where(np.isfinite(ratio), ratio, 1.0)[None])
            for name, ratio in ratios.items()
        ]
    return ratios_to_table


@dataclass(frozen=True, eq=False)
class Stability:
    """Largest growth rates (cells, samples), 1/s, of bicycles at a speed (m/s; None: each at its own)."""

    speed: float | None
    growth: Array  # (cells, samples), 1/s, above 0: unstable
    anew: bool = False  # True: computed for the figure, the result does not hold them

    @property
    def where(self) -> str:
        """The speed, in words."""
        return "at its own speed" if self.speed is None else f"at {self.speed:.4g} m/s"


def stability(stored: Stored, at: float | None) -> Stability | None:
    """Growth rates at the speed ``at`` (m/s), else where most differ in stability; None if it cannot be found."""
    growth, speeds, requested = stored.scalar(OUTPUTS[GROWTH]), stored.speeds, at
    nearest: Stability | None = None
    if growth is not None and not speeds.size:
        return Stability(None, growth[..., 0])
    if growth is not None:
        share = (growth > 0).sum((0, 1)) / np.maximum(np.isfinite(growth).sum((0, 1)), 1)
        k = int((np.abs(share - 0.5) if at is None else np.abs(speeds - at)).argmin())
        nearest = Stability(float(speeds[k]), growth[..., k])
        if 0 < share[k] < 1 if at is None else abs(speeds[k] - at) < 1e-9 * max(at, 1):
            return nearest
    if at is None and CRITICAL in stored.data:
        limits = [limit.speeds[np.isfinite(limit.speeds)] for limit in stored.limits]
        at = float(f"{np.median(np.concatenate(limits)):.3g}") if limits else None
    if at is None and nearest is None and speeds.size:
        at = float(speeds[len(speeds) // 2])
    anew = None if at is None else _growth_rates_at(stored, at)
    if at is not None and anew is not None:
        return Stability(at, anew, anew=True)
    if requested is not None:
        nearest_speeds = ", ".join(f"{speed:g}" for speed in speeds[np.argsort(np.abs(speeds - requested))[:2]])
        how = f"give one that it holds, the nearest are {nearest_speeds} m/s" if nearest_speeds else "leave --at out"
        raise InputError(
            f"--at {requested:g}: {stored.path.name} has no result at this speed, and its inputs have changed since, "
            f"so it cannot be recomputed; {how}"
        )
    return nearest


def _growth_rates_at(stored: Stored, speed: float) -> Array | None:
    """Largest growth rates (cells, samples) in 1/s at one speed, computed again; None if impossible."""
    sweep = stored.sweep
    try:
        if sweep.fingerprint != stored.fingerprint or SPEED in sweep.varied:
            return None
        fewer = replace(sweep, outputs=(GROWTH,), speeds=(speed,), quantiles=None)
        if stored.samples == sweep.samples:
            return np.asarray(compute(fewer, 0, sweep.items)[GROWTH]).reshape(stored.cells, stored.samples)
        firsts = range(0, sweep.items, sweep.samples)
        return np.array([compute(fewer, first, first + stored.samples)[GROWTH][:, 0] for first in firsts])
    except InputError:
        return None


def targets(stored: Stored, stable: Stability | None) -> dict[str, Array]:
    """Outputs by label with the unit, the main ones first: (cells, samples), NaN where a bicycle does not have it."""
    outputs: dict[str, Array] = {
        f"{limit.words}{occurrence}, m/s": limit.speeds[..., k]
        for limit in stored.limits
        for k, occurrence in enumerate(OCCURRENCE[: limit.speeds.shape[-1]])
        if np.isfinite(limit.speeds[stored.possible, k]).mean() >= LEAST_SHARE
    }
    speeds = stored.speeds
    at = None if stable is None else stable.speed
    k = len(speeds) // 2 if at is None else int(np.abs(speeds - at).argmin()) if speeds.size else 0
    for output in OUTPUTS.values():
        label, unit = output.label[0].lower() + output.label[1:], _unit(output)
        if output.scalar and not output.by_speed and output.name in stored.data:
            outputs[f"{label}{unit}"] = stored.rows(output.name)
        elif stable is not None and output.name == GROWTH:
            outputs[f"{label} {stable.where}{unit}"] = stable.growth
        elif stable is not None and output.scalar and output.by_speed and not stable.anew and at is not None:
            values = stored.scalar(output)
            outputs |= {} if values is None else {f"{label} {stable.where}{unit}": values[..., k]}
    for mode, by_output in stored.named.items():
        for name in [name for name in by_output if name != "frequencies" or "damping_ratios" not in by_output]:
            values_at_speed, output = by_output[name][..., k], OUTPUTS[name]
            if np.isfinite(values_at_speed).mean() >= LEAST_SHARE and np.nanmax(np.abs(values_at_speed)) > 0:
                label = f"{mode.replace('_', ' ')}: {output.label} at {speeds[k]:.4g} m/s{_unit(output)}"
                outputs[label] = values_at_speed
    return outputs


def _unit(output: Output) -> str:
    return "" if output.unit == "1" else f", {output.unit}"
