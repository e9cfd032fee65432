"""A bicycle with a point mass in one of its frames, by hand."""

import numpy as np

from bicycle import Bicycle


def enlarged(bicycle: Bicycle, part: str, mass: float, x: float, z: float) -> Bicycle:
    """The bicycle with a point mass rigidly in one of its frames, from total mass, mass centre and inertia alone."""
    masses = np.array([bicycle[f"m{part}"], mass])
    places = np.array([[bicycle[f"x{part}"], bicycle[f"z{part}"]], [x, z]])
    centre = masses @ places / masses.sum()
    dx, dz = (places - centre).T
    return bicycle.replace(**{
        f"m{part}": masses.sum(), f"x{part}": centre[0], f"z{part}": centre[1],
        f"I{part}xx": bicycle[f"I{part}xx"] + masses @ dz**2,
        f"I{part}zz": bicycle[f"I{part}zz"] + masses @ dx**2,
        f"I{part}xz": bicycle[f"I{part}xz"] - masses @ (dx * dz),
    })  # fmt: skip
