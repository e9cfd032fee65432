"""The bicycles of a table as an axis of a sweep: each with its own parameters, loads and standard deviations."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bicycle.files.bicycle_file import bicycle_place
from bicycle.files.bicycle_table import is_bicycle_table, read_bicycles, split_row
from bicycle.parameters import BOUNDS, UNITS, Bicycle, bodies, static_loads
from studies.sampling.bounded_draws import BoundedDraws, possible_moments
from tyre.base.arrays import Array
from tyre.base.errors import InputError, shown

BICYCLE = "bicycle"
"""Name of the axis."""


def read_bicycle_axis(given: Any, folder: Path, *, allow_unusual: bool) -> tuple[Bicycle, ...]:
    """The bicycles of ``[grid] bicycle = "bicycles.csv"``.

    Parameters
    ----------
    given : object
        The value of that key.
    folder : Path
        What files are relative to.
    allow_unusual : bool
        Take values far outside what bicycles have.

    Raises
    ------
    InputError
        No table of bicycles, or a row or column of it that makes none.
    """
    if not isinstance(given, str) or not is_bicycle_table(given) or split_row(given)[1]:
        raise InputError(f'grid.{BICYCLE} = {shown(given)}: give a table of bicycles, for example "bicycles.csv"')
    return tuple(read_bicycles(Path(bicycle_place(given, folder)), allow_unusual=allow_unusual))


def stated_sd(bicycles: tuple[Bicycle, ...]) -> dict[str, dict[str, float]]:
    """Standard deviations (SI) above 0 that the ``bicycles`` of a table state, by name and key.

    Raises
    ------
    InputError
        There is none, or one that no quantity within its bounds has.
    """
    found = {b.name: {key: sd for key, sd in b.sd.items() if sd > 0 and key in UNITS} for b in bicycles}
    if not any(found.values()):
        raise InputError(f"sampled.bicycle_sd: no bicycle of grid.{BICYCLE} states standard deviations")
    for one in bicycles:
        for key, sd in found[one.name].items():
            possible_moments(f"bicycle {one.name}: {key}", one[key], sd, BOUNDS[key])
    return found


class ManyBicycles:
    """Parameters of the bicycles of a table, for many items at once.

    Parameters
    ----------
    values : mapping of str to mapping of str to float
        By name and key, SI.
    sd : mapping of str to mapping of str to float
        What is sampled around them, likewise.
    """

    def __init__(self, values: Mapping[str, Mapping[str, float]], sd: Mapping[str, Mapping[str, float]]) -> None:
        self.values, self.sd = values, sd
        self.sampled = tuple(key for key in UNITS if any(key in one for one in sd.values()))

    def parameters(
        self, names: NDArray[np.str_], standard: Callable[[str], Array], *, linear: bool, share: float
    ) -> dict[str, Array]:
        """Every parameter of the items.

        Parameters
        ----------
        names : ndarray of str, shape (m,)
            Bicycle of each item.
        standard : function
            From a key to standard normal numbers, (m,).
        linear, share : bool, float
            As of :meth:`studies.sweeps.points.Sampler.points`.
        """
        found = {key: _each(names, {one: of[key] for one, of in self.values.items()}) for key in UNITS}
        for key in self.sampled:
            z = standard(key)
            for one in np.unique(names):
                sd, here, mean = self.sd[one].get(key, 0.0), names == one, self.values[one][key]
                if sd:
                    joint = BoundedDraws((mean,), ((sd,),), [BOUNDS[key]])
                    drawn = joint.linear(z[None, here]) if linear else joint(z[None, here])
                    found[key][here] = mean + share * (drawn[0] - mean)
        return found

    def loads(self, names: NDArray[np.str_]) -> tuple[Array, Array]:
        """Static wheel loads (N) of the items before anything is drawn, rear and front.

        Parameters
        ----------
        names : ndarray of str, shape (m,)
            Bicycle of each item.
        """
        loads = {one: static_loads(bodies(v), v["w"], v["g"]) for one, v in self.values.items()}
        rear, front = ({one: float(both[wheel]) for one, both in loads.items()} for wheel in (0, 1))
        return _each(names, rear), _each(names, front)


def _each(names: NDArray[np.str_], value: Mapping[str, float]) -> Array:
    different, place = np.unique(names, return_inverse=True)
    return np.array([value[str(one)] for one in different], dtype=np.float64)[place]
