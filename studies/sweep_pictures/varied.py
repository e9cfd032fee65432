"""The parameters that were varied, bicycle by bicycle: grid values, and draws made again from seed and name."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.sampling.bounded_draws import BoundedDraws
from studies.sampling.draws import normal, uniform
from studies.sweep_pictures.stored import Stored
from studies.sweeps.made_of import differences
from studies.sweeps.points import TYRE_DRAWS, Sampler
from studies.sweeps.spec import SPEED, bounds_of
from tyre.base.arrays import Array
from tyre.base.errors import InputError

TYRE_WORDS = {
    "cornering_stiffness": "cornering stiffness {} / table", "lateral_stiffness": "lateral stiffness {} / table",
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Varied:
    """One parameter that was varied.

    Attributes
    ----------
    name, unit : str
        Unit is empty for a name and for a ratio.
    values : ndarray, shape (cells, 1) or (1, samples)
        Along the grid or along the samples.
    """

    name: str
    unit: str
    values: NDArray[Any]

    @property
    def sampled(self) -> bool:
        """Whether it was drawn, not set on the grid."""
        return self.values.shape[0] == 1 and self.values.shape[1] > 1

    @property
    def named(self) -> bool:
        """Whether its values are names."""
        return self.values.dtype.kind not in "fiu"

    @property
    def label(self) -> str:
        """Name and unit."""
        return f"{self.name}, {self.unit}" if self.unit else self.name


def grid_parameters(stored: Stored) -> list[Varied]:
    """Parameters on the grid with more than one value, in the order of the file."""
    shape = stored.sweep.shape[:-1]
    found = []
    for k, axis in enumerate(stored.sweep.axes):
        if len(axis.values) > 1:
            values = np.array(axis.values)[np.indices(shape)[k].ravel()]
            found.append(Varied(axis.name, stored.unit(axis.name), values[:, None]))
    return found


def sampled_parameters(stored: Stored) -> tuple[list[Varied], str]:
    """Parameters that were drawn, and a remark on those that cannot be told.

    The result need not hold them: they follow from the seed. That is so only where tyre data, source and software are
    those of the result; else the output ``parameters`` tells them, if it was asked for.
    """
    sweep = stored.sweep
    if not sweep.random or stored.reduced:
        return [], ""
    try:
        same = sweep.fingerprint == stored.fingerprint
        changed = "" if same else differences(stored.made_of or None, sweep.made_of)
    except InputError as error:
        same, changed = False, str(error)
    if same:
        return _drawn_again(stored), ""
    if "parameters" in stored.data:
        return _from_output(stored), ""
    return [], (
        f"the sampled parameters cannot be drawn again as in {stored.path.name}, since this has changed: {changed}; "
        "so what hangs on them is not drawn. Compute the sweep anew, or ask for the output parameters"
    )


def _drawn_again(stored: Stored) -> list[Varied]:
    sweep, count = stored.sweep, stored.samples
    sampler = Sampler(sweep)

    def standard(name: str) -> Array:
        return normal(seed=sweep.seed, name=name, start=0, stop=count)

    found = []
    for group in sweep.normals:
        draws = BoundedDraws(group.mean, group.factor, [bounds_of(sampler.model, name) for name in group.names])
        for name, values in zip(group.names, draws(np.array([standard(name) for name in group.names])), strict=True):
            found.append(Varied(name, stored.unit(name), values[None]))
    for one in sweep.uniforms:
        share = uniform(seed=sweep.seed, name=one.name, start=0, stop=count)
        found.append(Varied(one.name, stored.unit(one.name), (one.low + (one.high - one.low) * share)[None]))
    for key in {key: None for each in sweep.bicycle_sd.values() for key in each}:
        found.append(Varied(f"{key} / its sd", "", standard(key)[None]))
    if sweep.tyre_covariance:
        found += _tyres(sampler, standard, count)
    return [one for one in found if np.ptp(one.values) > 0]


def _tyres(sampler: Sampler, standard: Any, count: int) -> list[Varied]:
    """What the tyre's covariance did to C and K of each wheel, in the first cell of the grid."""
    draws = {name: standard(name) for names in sampler.draws.values() for name in names}
    drawn = sampler.points(0, count, draws).values
    plain = sampler.points(0, count, draws | dict.fromkeys(TYRE_DRAWS, np.zeros(count))).values
    found = []
    for wheel in ("rear", "front"):
        ratios = {}
        for name in ("cornering_stiffness", "relaxation_length"):
            key = next((key for key in sampler.taken if key.endswith(f".{name}.{wheel}")), None)
            if key:
                with np.errstate(invalid="ignore", divide="ignore"):
                    ratios[name] = np.broadcast_to(np.asarray(drawn[key] / plain[key], float), count)
        if "cornering_stiffness" in ratios and "relaxation_length" in ratios:
            ratios["lateral_stiffness"] = ratios["cornering_stiffness"] / ratios.pop("relaxation_length")
        for name, ratio in ratios.items():
            known = np.isfinite(ratio)
            found.append(Varied(TYRE_WORDS[name].format(wheel), "", np.where(known, ratio, 1.0)[None]))
    return found


def _from_output(stored: Stored) -> list[Varied]:
    names = {name for one in stored.sweep.normals for name in one.names} | {one.name for one in stored.sweep.uniforms}
    held = [str(name) for name in stored.data["parameter"].values]
    found = []
    for name in sorted(names):
        key = next((one for one in held if one == name or one.startswith(f"{name}.")), None)
        if key:
            values = stored.rows("parameters", parameter=key)[0]
            found.append(Varied(name, stored.unit(name), values[None]))
    return found


def growth_rates_at(stored: Stored, speed: float) -> Array | None:
    """Largest growth rates (1/s) at one speed, computed anew where the sweep can be repeated; None where it cannot.

    Parameters
    ----------
    stored : Stored
    speed : float
        m/s.

    Returns
    -------
    ndarray, shape (cells, samples), or None
    """
    from studies.sweeps.chunk import compute

    sweep = stored.sweep
    try:
        if sweep.fingerprint != stored.fingerprint or SPEED in sweep.varied:
            return None
        output = "largest_growth_rate"
        fewer = replace(sweep, outputs=(output,), speeds=(speed,), quantiles=None)
        if stored.samples == sweep.samples:
            return np.asarray(compute(fewer, 0, sweep.items)[output]).reshape(stored.cells, stored.samples)
        firsts = [cell * sweep.samples for cell in range(stored.cells)]
        rows = [compute(fewer, first, first + stored.samples)[output][:, 0] for first in firsts]
    except InputError:
        return None
    return np.array(rows)
