"""Synthetic rides of the benchmark bicycle from its published matrices, simulated here and by nothing of velotyre.

M q'' + v C1 q' + (g K0 + v^2 K2) q = T, q = (lean, steer): Meijaard et al. (2007), table 2 and equation 6.1.
"""

import numpy as np
from scipy.linalg import expm
from scipy.signal import butter, lfilter

M = np.array([[80.81722, 2.31941332208709], [2.31941332208709, 0.29784188199686]])
C1 = np.array([[0.0, 33.86641391492494], [-0.85035641456978, 1.68540397397560]])
K0 = np.array([[-80.95, -2.59951685249872], [-2.59951685249872, -0.80329488458618]])
K2 = np.array([[0.0, 76.59734589573222], [0.0, 2.65431523794604]])
G = 9.81
FINE = 1e-3  # s
SHARP = 2e-3  # rad/s over which the sign of the steer rate changes


def state_matrix(speed):
    """Of the states lean, steer and their rates (4, 4)."""
    inverse = np.linalg.inv(M)
    return np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ (G * K0 + speed**2 * K2), -inverse @ C1 * speed]])


def weave(speed):
    """Weave eigenvalue and its ratio of steer to lean."""
    values, vectors = np.linalg.eig(state_matrix(speed))
    k = int(np.argmax(np.where(values.imag > 0, np.abs(values.imag), -1)))
    return complex(values[k]), complex(vectors[1, k] / vectors[0, k])


def ride(speed, duration, torque, *, lean_rate=0.3, friction=0.0, lean_torque=np.zeros_like):
    """Time (s), states (n, 4) at 1 kHz by Runge and Kutta; torques of times in N m, ``friction`` dry, N m."""
    a, push = state_matrix(speed), np.vstack([np.zeros((2, 2)), np.linalg.inv(M)])

    def step(x, begin, middle, end):
        def rate(x, torques):
            rubbing = push[:, 1] * friction * np.tanh(x[3] / SHARP) if friction else 0.0
            return a @ x + push @ torques - rubbing

        k1 = rate(x, begin)
        k2 = rate(x + FINE / 2 * k1, middle)
        k3 = rate(x + FINE / 2 * k2, middle)
        k4 = rate(x + FINE * k3, end)
        return x + FINE / 6 * (k1 + 2 * k2 + 2 * k3 + k4)

    time = np.arange(round(duration / FINE) + 1) * FINE
    halves = np.arange(2 * len(time) - 1) * FINE / 2
    torques = np.array([one(halves) + 0.0 * halves for one in (lean_torque, torque)])
    given = np.concatenate([torques[:, :-2:2], torques[:, 1::2], torques[:, 2::2]]).T
    states = np.empty((len(time), 4))
    states[0] = 0.0, 0.0, lean_rate, 0.0
    whole = None if friction else step(np.eye(10)[:4], *np.eye(10)[4:].reshape(3, 2, 10))  # then a step is one matrix
    for k, each in enumerate(given):
        states[k + 1] = step(states[k], *each.reshape(3, 2)) if friction else whole @ (*states[k], *each)
    return time, states


TILT, TRAIL, BASE = np.pi / 10, 0.08, 1.02  # rad, m, m: steer axis tilt, trail and wheelbase, table 1


def gains(speed, hertz, source="steer_torque", *, spring=0.0, damper=0.0):
    """Motion per input, by output, at frequencies ``hertz`` (m,); lateral contact velocity zero at both wheels."""
    found = {}
    for f in np.atleast_1d(hertz):
        s = 2j * np.pi * f
        matrix = M * s**2 + speed * C1 * s + G * K0 + speed**2 * K2 + np.diag([0, spring + damper * s])
        lean, steer = np.linalg.solve(matrix, {"steer_torque": [0, 1], "lean_torque": [1, 0]}[source])
        yaw_rate = (speed + TRAIL * s) * np.cos(TILT) * steer / BASE
        motion = {"lean": lean, "roll_rate": s * lean, "steer": steer, "steer_rate": s * steer, "yaw_rate": yaw_rate}
        for name, gain in motion.items():
            found.setdefault(name, []).append(gain)
    return {name: np.array(values) for name, values in found.items()}


def held(speed, duration, *, seed, noise=0.0, spring=0.0, level=3.0, feedback=None):
    """A run of the bicycle under a random torque from outside, which ``feedback`` (4,) of the noisy states joins.

    Steps of 1 ms with the torque held, every tenth kept: time, noisy states (n, 4), torque that acted, torque from
    outside.
    """
    rng = np.random.default_rng(seed)
    a, push = state_matrix(speed), np.linalg.solve(M, [0.0, 1.0])
    a = a.copy()
    a[2:, 1] -= push * spring
    block = np.zeros((5, 5))
    block[:4, :4], block[2:4, 4] = a, push
    step = expm(block * FINE)
    n = round(duration / FINE)
    from_outside, errors = (
        9 * lfilter(*butter(2, edge * 2 * FINE), rng.standard_normal((n, width)), axis=0)
        for edge, width in ((5, 1), (8, 4))
    )
    gain, push = np.zeros(4) if feedback is None else np.asarray(feedback), step[:4, 4]
    outside = level * from_outside[:, 0] - noise * errors @ gain
    roots, modes = np.linalg.eig(step[:4, :4] - np.outer(push, gain))
    drives = np.linalg.solve(modes, push)
    each = [lfilter([0, drive], [1, -root], outside) for root, drive in zip(roots, drives, strict=True)]
    states = (modes @ each).real.T + noise * errors
    torques = level * from_outside[:, 0] - states @ gain
    return np.arange(n)[::10] * FINE, states[::10], torques[::10], level * from_outside[::10, 0]


FRONT = ((4.0, 0.9, -0.7), (3.0, 1.02, -0.35))  # mass (kg), x, z (m) of the front frame and the front wheel, table 1
REST = ((2.0, 0.0, -0.3), (85.0, 0.3, -0.9))  # the same of rear wheel and rear frame


def bar_stiffness(*, lifted):
    """Torque at the bar over steer angle of the bicycle at rest, upright (N m/rad), of its weight alone."""
    ahead = sum(m * ((x - BASE - TRAIL) * np.cos(TILT) - z * np.sin(TILT)) for m, x, z in FRONT)
    load = G * sum(m * x for m, x, z in (*FRONT, *REST)) / BASE
    ground = 0.0 if lifted else load * TRAIL * np.cos(TILT)
    return -np.sin(TILT) * (G * ahead + ground)
