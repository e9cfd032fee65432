"""The packaged synthetic kicks, made anew: full nonlinear chain of rigid bodies with dry friction at the steer.

The chain is `tests.validation.blind`, which imports nothing of `bicycle` but the reader of parameters.
"""

import numpy as np

from bicycle import load_bicycle
from tests.validation.blind.closing import build, ground
from tests.validation.blind.motion import Nonlinear, simulate_nonlinear

BICYCLE, FRICTION = "benchmark", 0.15  # N m
SPEEDS, KICKS = (4.6, 5.2, 5.8, 6.4), ("a", "b")
STEP, EVERY, DURATION = 1e-3, 20, 2.4  # s, samples, s
NOISE = {"roll_rate_rad_s": 0.01, "steer_rad": 0.002}


def torque(time, kick):
    """N m; the second kick of a speed is another torque."""
    slow, fast = ((0.7, 1.9), (0.9, 1.6))[KICKS.index(kick)]
    return 1.0 * np.sin(2 * np.pi * slow * time) + 0.5 * np.sin(2 * np.pi * fast * time + 1)


def kick_table(speed, kick):
    """Columns time, roll rate, steer, torque of one run (SI)."""
    machine = build(dict(load_bicycle(BICYCLE).values), {})
    space = machine.space(speed)
    time = np.arange(0, DURATION + STEP / 2, STEP)
    start = np.zeros(len(space.matrix))
    x = simulate_nonlinear(space, ground({}), speed, Nonlinear(friction=FRICTION), (start, torque(time, kick), STEP))
    rng = np.random.default_rng([SPEEDS.index(speed), KICKS.index(kick)])
    time, x = time[::EVERY], x[::EVERY]
    seen = [x @ space.outputs[name] for name in ("lean_rate", "steer")]
    noisy = [s + sd * rng.standard_normal(len(time)) for s, sd in zip(seen, NOISE.values(), strict=True)]
    return np.column_stack([time, *noisy, torque(time, kick)])


def kick_text(speed, kick):
    """The CSV of one run."""
    rows = (f"{t:.2f},{rate:.4f},{steer:.5f},{pull:.4f}" for t, rate, steer, pull in kick_table(speed, kick))
    return "time_s,roll_rate_rad_s,steer_rad,steer_torque_N_m\n" + "\n".join(rows) + "\n"
