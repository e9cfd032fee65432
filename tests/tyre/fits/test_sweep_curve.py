"""The side-force curve of a sweep, seen through the lag."""

import numpy as np

from tyre.fits.sweep_curve import lagged_magic_formula


def test_derivatives_are_those_of_the_force():
    """Of all seven parameters, by central differences; the slip runs straight up, so that its pace is exact."""
    slip_time = np.linspace(0.0, 10.0, 101)
    given = {
        "time": np.linspace(3.0, 9.5, 8), "slip_time": slip_time, "slip": np.deg2rad(1.3) * (slip_time - 6.0),
        "direction": np.ones(8),
    }  # fmt: skip
    at = {
        "cornering_stiffness": 6000.0, "peak": 400.0, "shape": 1.4, "curvature": -0.4, "horizontal_shift": 0.003,
        "lag": 0.3, "hysteresis": 0.002,
    }  # fmt: skip
    _, derivatives = lagged_magic_formula(**given, **at)
    for (name, value), derivative in zip(at.items(), derivatives, strict=True):
        step = 1e-5 * abs(value)
        up, down = (lagged_magic_formula(**given, **at | {name: value + h})[0] for h in (step, -step))
        np.testing.assert_allclose(derivative, (up - down) / (2 * step), rtol=1e-6, atol=1e-9, err_msg=name)
