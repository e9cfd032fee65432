"""Time histories and frequency responses as data, with the unit of everything that is in them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bicycle.linear_model import LinearModel
from tyre.base.arrays import Array, Complex
from tyre.base.csv_text import write_csv

if TYPE_CHECKING:
    import pandas as pd


PATH = {"yaw": "rad", "rear_lateral_displacement": "m"}  # carried along beside the model's outputs, with unit
LINEAR_UP_TO = 0.35  # rad: the geometry is linear in lean and steer; sin and tan leave it by 2 to 4 % here


def units_of(model: LinearModel) -> dict[str, str]:
    """SI unit of every state, input and output of a model, of the yaw angle and of the lateral displacement.

    Parameters
    ----------
    model : LinearModel
    """
    return {**PATH, **model.declared.units}


def column(name: str, unit: str) -> str:
    """Column name with unit: ``yaw_rate`` in rad/s -> ``yaw_rate_rad_s``.

    Parameters
    ----------
    name, unit : str
    """
    return f"{name}_{unit.replace('/', '_').replace(' ', '_')}"


@dataclass(frozen=True)
class Response:
    """A time history at constant speed.

    Attributes
    ----------
    time : ndarray, shape (m,)
        s.
    speed : float
        m/s.
    outputs, inputs : mapping of str to ndarray, shape (m,)
        SI units; an input is given from each sample on.
    units : mapping of str to str
        Unit of every output and input by name, as the model declares it (:func:`units_of`).
    """

    time: Array
    speed: float
    outputs: Mapping[str, Array]
    inputs: Mapping[str, Array] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Where the motion leaves what linear geometry can describe."""
        largest = {name: float(np.abs(self.outputs[name]).max()) for name in ("lean", "steer")}
        fallen = [] if self.fall is None else [f"the bicycle has fallen at {self.time[self.fall]:.2f} s"]
        return (*fallen, *(
            f"{name} reaches {value:.2g} rad, but the geometry is linear and holds up to about {LINEAR_UP_TO} rad"
            for name, value in largest.items()
            if value > LINEAR_UP_TO
        ))  # fmt: skip

    @property
    def fall(self) -> int | None:
        """Number of the first sample with lean or steer beyond 90 degrees, None if there is none."""
        fallen = np.maximum(np.abs(self.outputs["lean"]), np.abs(self.outputs["steer"])) > np.pi / 2
        return int(fallen.argmax()) if fallen.any() else None

    def until_fall(self) -> "Response":
        """The same history up to and with the sample :attr:`fall`; all of it if the bicycle does not fall."""
        kept = slice(None if self.fall is None else self.fall + 1)
        outputs, inputs = ({name: x[kept] for name, x in of.items()} for of in (self.outputs, self.inputs))
        return Response(self.time[kept], self.speed, outputs, inputs, self.units)

    def frame(self) -> "pd.DataFrame":
        """A row per sample: time_s, outputs, inputs, with the unit in every column name."""
        import pandas as pd

        named = {**self.outputs, **self.inputs}
        return pd.DataFrame({"time_s": self.time, **{column(n, self.units[n]): x for n, x in named.items()}})

    def to_csv(self, path: str | Path) -> None:
        """Write :meth:`frame` as CSV with all digits.

        Parameters
        ----------
        path : str or Path
        """
        write_csv(path, self.frame())


@dataclass(frozen=True)
class FrequencyResponse:
    """Complex gains ``outputs[name]`` (m,) from one input, SI, at ``frequency_hz`` (m,); ``units`` by name."""

    frequency_hz: Array
    speed: float
    input: str
    outputs: Mapping[str, Complex]
    units: Mapping[str, str] = field(default_factory=dict)

    def frame(self) -> "pd.DataFrame":
        """A row per frequency: Hz, then gain and phase (rad, unwrapped) of each output."""
        import pandas as pd

        columns, per = {"frequency_Hz": self.frequency_hz}, column(self.input, self.units[self.input])
        for name, gain in self.outputs.items():
            columns[f"{column(name, self.units[name])}_per_{per}"] = np.abs(gain)
            columns[f"{name}_phase_rad"] = np.unwrap(np.angle(gain))
        return pd.DataFrame(columns)
