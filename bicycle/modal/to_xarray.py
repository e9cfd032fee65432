"""Named modes as a labelled ``xarray`` dataset with units; xarray is optional."""

from typing import Any

import numpy as np

from tyre.base.optional import optional_module


def modes_to_xarray(found: Any) -> Any:
    """``xarray.Dataset``: eigenvalue (mode, speed, root) in 1/s, frequency in Hz and damping ratio (mode, speed).

    ``root`` counts the values of a mode at one speed (two after a pair has split); NaN where there is none.

    Parameters
    ----------
    found : bicycle.modal.named_modes.Modes

    Raises
    ------
    ImportError
        xarray is not installed.
    """
    xarray = optional_module("xarray", extra="xarray")
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
