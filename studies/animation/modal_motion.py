"""One mode as a motion to be looked at: an oscillation held at constant amplitude, a real root from small to large."""

import numpy as np

from bicycle.eigenvalues.oscillation import frequency_hz
from bicycle.linear_model import LinearModel
from bicycle.responses.linear import Response, modal_response

SPAN = 1.0  # of a real root, in time constants
SLOWEST = 1e-3  # 1/s: slower real roots are shown as that slow


def modal_motion(model: LinearModel, *, speed: float, eigenvalue: complex, amplitude: float, frames: int) -> Response:
    """One period of a pair, without growth so that a film can repeat it, or one time constant of a real root.

    Parameters
    ----------
    model : LinearModel
    speed : float
        m/s.
    eigenvalue : complex
        1/s.
    amplitude : float
        The largest of lean, steer and yaw, rad.
    frames : int
        Number of samples.
    """
    if eigenvalue.imag:
        time = np.arange(frames) / frames / abs(frequency_hz(eigenvalue))
        envelope = amplitude * np.exp(-eigenvalue.real * time)
    else:
        rate = max(abs(eigenvalue.real), SLOWEST)
        time = SPAN / rate * np.arange(frames) / frames
        envelope = np.full(frames, amplitude * (np.exp(-SPAN) if eigenvalue.real > 0 else 1.0))
    motion = modal_response(model, speed=speed, eigenvalue=eigenvalue, time=time)
    outputs = {name: values * envelope for name, values in motion.outputs.items()}
    return Response(time, motion.speed, outputs, units=motion.units)
