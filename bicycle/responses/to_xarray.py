"""Responses as labelled ``xarray`` datasets with units; xarray is optional."""

from typing import Any

from bicycle.responses.linear import FrequencyResponse, Response
from tyre.base.optional import optional_module


def response_to_xarray(response: Response) -> Any:
    """``xarray.Dataset`` over time with one variable per output and input, units attached.

    Parameters
    ----------
    response : Response

    Raises
    ------
    ImportError
        xarray is not installed.
    """
    named = {**response.outputs, **response.inputs}
    return optional_module("xarray", extra="xarray").Dataset(
        {name: ("time", values, {"units": response.units[name]}) for name, values in named.items()},
        {"time": ("time", response.time, {"units": "s"})},
        {"speed_m_s": response.speed},
    )


def frequency_response_to_xarray(response: FrequencyResponse) -> Any:
    """``xarray.Dataset`` over frequency (Hz) with one complex gain per output.

    Parameters
    ----------
    response : FrequencyResponse

    Raises
    ------
    ImportError
        xarray is not installed.
    """
    per = f" / ({response.units[response.input]})"
    return optional_module("xarray", extra="xarray").Dataset(
        {name: ("frequency", gain, {"units": response.units[name] + per}) for name, gain in response.outputs.items()},
        {"frequency": ("frequency", response.frequency_hz, {"units": "Hz"})},
        {"speed_m_s": response.speed, "input": response.input},
    )
