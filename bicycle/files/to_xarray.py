"""Modes and responses as labelled ``xarray`` datasets with units; xarray is optional."""

from typing import Any

import numpy as np

from bicycle.modal.named_modes import Modes
from bicycle.responses.linear import FrequencyResponse, Response, unit_of


def modes_to_xarray(found: Modes) -> Any:
    """``xarray.Dataset``: eigenvalue (mode, speed, root) in 1/s, frequency in Hz and damping ratio (mode, speed).

    ``root`` counts the values of a mode at one speed (two after a pair has split); NaN where there is none.

    Raises
    ------
    ImportError
        xarray is not installed.
    """
    xarray = _xarray()
    width = max(values.shape[1] for values in found.branches.values())
    eigenvalues = np.full((len(found.names), len(found.speeds), width), np.nan, complex)
    for row, values in zip(eigenvalues, found.branches.values(), strict=True):
        row[:, : values.shape[1]] = values
    of_mode = {
        "frequency": (found.frequency, {"units": "Hz", "long_name": "damped frequency"}),
        "damping_ratio": (found.damping_ratio, {"units": "1"}),
    }
    variables: dict[str, Any] = {"eigenvalue": (("mode", "speed", "root"), eigenvalues, {"units": "1/s"})}
    for name, (function, attributes) in of_mode.items():
        variables[name] = (("mode", "speed"), np.array([function(mode) for mode in found.names]), attributes)
    return xarray.Dataset(
        variables,
        {"mode": list(found.names), "speed": ("speed", found.speeds, {"units": "m/s", "long_name": "forward speed"})},
        {"anchor_speed_m_s": found.anchor, "effects": ", ".join(found.model.effects)},
    )


def response_to_xarray(response: Response) -> Any:
    """``xarray.Dataset`` over time with one variable per output and input, units attached.

    Raises
    ------
    ImportError
        xarray is not installed.
    """
    named = {**response.outputs, **response.inputs}
    return _xarray().Dataset(
        {name: ("time", values, {"units": unit_of(name)}) for name, values in named.items()},
        {"time": ("time", response.time, {"units": "s"})},
        {"speed_m_s": response.speed},
    )


def frequency_response_to_xarray(response: FrequencyResponse) -> Any:
    """``xarray.Dataset`` over frequency (Hz) with one complex gain per output.

    Raises
    ------
    ImportError
        xarray is not installed.
    """
    per = f" / ({unit_of(response.input)})"
    return _xarray().Dataset(
        {name: ("frequency", gain, {"units": unit_of(name) + per}) for name, gain in response.outputs.items()},
        {"frequency": ("frequency", response.frequency_hz, {"units": "Hz"})},
        {"speed_m_s": response.speed, "input": response.input},
    )


def _xarray() -> Any:
    try:
        import xarray
    except ImportError as error:
        raise ImportError('xarray is not installed; install it with: pip install "velotyre[xarray]"') from error
    return xarray
