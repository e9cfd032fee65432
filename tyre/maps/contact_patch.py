"""Length of the contact of a tyre with a flat road, and the stiffness on a drum."""

import math
from typing import Any

import numpy as np

from tyre.ground.errors import InputError, is_number, shown


def string_trail(*, half_length: Any, relaxation_length: Any) -> Any:
    """Pneumatic trail (m) of a stretched string in contact over 2a, t = (L^3 - (L - a)^3) / (3 L^2).

    L is the cornering over the lateral stiffness, sigma + a. Of a short contact it is a, of one without free ends a/3.
    Source: von Schlippe & Dietrich (1941); Pacejka, Tire and Vehicle Dynamics, ch. 5.
    """
    free = 1 - half_length / relaxation_length
    return relaxation_length / 3 * (1 - free**3)


def half_length_under_load(*, load: float, pressure: float, wheel_radius: float, tyre_width: float) -> float:
    """Estimate half the length (m) of the contact ellipse of a tyre: a = sqrt(N/(pi p) sqrt(R/rho)).

    The air carries the load, pi a b = N/p, and the ellipse has the ratio of a torus of the radii R and rho = width/2
    pressed on a plane, a/b = sqrt(R/rho). A stiff casing shortens the contact, thick rubber lengthens it.
    """
    arguments = {"load": load, "pressure": pressure, "wheel_radius": wheel_radius, "tyre_width": tyre_width}
    for name, value in arguments.items():
        if not is_number(value) or not 0 < value < math.inf:
            raise InputError(f"{name} = {shown(value)} must be a positive number in SI units")
    return math.sqrt(load / (math.pi * pressure) * math.sqrt(2 * wheel_radius / tyre_width))


def log_curvature(*, wheel_radius: float, drum_radius: float | None) -> float:
    """Return ln(1 + R / R_drum), which the exponent multiplies in ln(C_flat / C_drum)."""
    return float(np.log1p(wheel_radius / drum_radius)) if drum_radius else 0.0
