"""Synthetic rides of the benchmark bicycle from its published matrices, simulated here and by nothing of velotyre.

M q'' + v C1 q' + (g K0 + v^2 K2) q = T, q = (lean, steer): Meijaard et al. (2007), table 2 and equation 6.1.
"""

import numpy as np

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


def ride(speed, duration, torque, *, lean_rate=0.3, friction=0.0):
    """Time (s), states (n, 4) at 1 kHz by Runge and Kutta; ``torque`` of time in N m, ``friction`` dry, N m."""
    a, push = state_matrix(speed), np.linalg.solve(M, [0.0, 1.0])

    def rate(t, x):
        found = a @ x
        found[2:] += push * (torque(t) - friction * np.tanh(x[3] / SHARP))
        return found

    time = np.arange(round(duration / FINE) + 1) * FINE
    x = np.array([0.0, 0.0, lean_rate, 0.0])
    states = [x]
    for t in time[:-1]:
        k1 = rate(t, x)
        k2 = rate(t + FINE / 2, x + FINE / 2 * k1)
        k3 = rate(t + FINE / 2, x + FINE / 2 * k2)
        k4 = rate(t + FINE, x + FINE * k3)
        x = x + FINE / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        states.append(x)
    return time, np.array(states)
