"""Shooting for motions that mirror themselves after half a period, and equations of a bicycle written here."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from bicycle.model import build_model

FRONT = {"stiffness": 4000, "damping": 12, "joint_x": 0.86, "joint_z": -0.65}
TYRE = {"tyre": "Tyre1", "pressure_bar": 5.5}
WHEELS = ("rear", "front")
STIFFNESS = "relaxation_length.cornering_stiffness.{}"


def build(*, bicycle="pista_charlie_drops", front=FRONT, tyre=TYRE, **effects):
    """Build the bicycle of docs/amplitude.md, or one like it."""
    content = {"relaxation_length": tyre} | ({"front_compliance": front} if front else {}) | effects
    return build_model({"bicycle": bicycle, "effects": content})


def own_equations(model, speed, *, friction=0.8, shape=1.3, curvature=0.0):
    """Rate of the linear model's states, whose lateral forces C s stand for lagged slips s, with curves written here.

    States may be stacked (n, m); a number of the curve may be one a wheel.
    """
    linear = model.linear_model()
    a = linear.matrices_at(speed)[0]
    forces = [linear.states.index(f"{wheel}_lateral_force") for wheel in WHEELS]
    entry = a[:, forces].copy()
    entry[forces] = 0.0  # the lag is of C s itself
    numbers = [np.broadcast_to(one, 2) for one in (np.multiply(friction, linear.static_loads), shape, curvature)]
    d, c, e = numbers
    curves = (d, c, e, 1 / (c * d)), tuple(one[:, None] for one in (d, c, e, 1 / (c * d)))
    bent = np.any(e)

    def rate(t, x):
        d, c, e, per_force = curves[x.ndim - 1]
        lagged = x[forces]
        u = per_force * lagged  # B s
        force = d * np.sin(c * np.arctan(u - e * (u - np.arctan(u)) if bent else u))
        return a @ x + entry @ (force - lagged)

    assert all(linear.parameters[STIFFNESS.format(wheel)] > 0 for wheel in WHEELS)
    return rate, list(linear.states)


def state_at_turn(system, cycle, name):
    """States of a cycle by name when ``name`` is at its largest, near enough for Newton's method."""
    phase = np.linspace(0, 2 * np.pi, 400)
    x = (np.exp(1j * np.outer(phase, cycle.orders)) @ cycle.states).real
    return dict(zip(system.states, x[x[:, system.states.index(name)].argmax()], strict=True))


def own_state(model, found, cycle):
    """State of the own equations when the bar is at its largest angle in a ``cycle``."""
    linear, at = model.linear_model(), state_at_turn(found.system.at_one_speed, cycle, "steer")
    for wheel in WHEELS:
        at[f"{wheel}_lateral_force"] = at[f"{wheel}_transient_slip"] * linear.parameters[STIFFNESS.format(wheel)]
    return np.array([at[name] for name in linear.states])


def shoot(rate, start, half_period, pinned, *, tolerance=1e-10):
    """Half a period (s) and the states (n, times) over it of a motion that is then its mirror image.

    Newton's method; the derivative of the map is by differences of motions that are integrated together.
    """
    n = len(start)
    x, half = np.array(start, float), half_period
    for _ in range(15):
        size = 1e-6 * (np.abs(x) + 1e-3 * np.abs(x).max())
        beside = np.column_stack([x, x[:, None] + np.diag(size)])

        def stacked(t, z, n=n):
            return rate(t, z.reshape(n, -1)).ravel()

        ends = solve_ivp(stacked, (0, half), beside.ravel(), "DOP853", rtol=tolerance, atol=1e-14).y[:, -1]
        ends = ends.reshape(n, -1)
        residual = np.append(ends[:, 0] + x, x[pinned])
        jacobian = np.zeros((n + 1, n + 1))
        jacobian[:n, :n] = (ends[:, 1:] - ends[:, :1]) / size + np.eye(n)
        jacobian[:n, n], jacobian[n, pinned] = rate(half, ends[:, 0]), 1.0
        step = np.linalg.solve(jacobian, residual)
        x, half = x - step[:n], half - step[n]
        if np.abs(step[:n]).max() < 1e-7 * np.abs(x).max() and abs(step[n]) < 1e-7 * half:  # the next is far below
            break
    else:
        raise AssertionError("shooting does not converge")
    times = np.linspace(0, half, 2001)
    return half, solve_ivp(rate, (0, half), x, "DOP853", t_eval=times, rtol=tolerance, atol=1e-14).y


def compare(found, cycle, rate, names, start):
    """Compare period and amplitude of a ``cycle`` with those of shooting."""
    half, states = shoot(rate, start, cycle.period / 2 * 1.002, names.index("steer_rate"))
    assert 2 * half == pytest.approx(cycle.period, rel=1e-6)
    assert np.abs(states[names.index("steer")]).max() == pytest.approx(found.amplitude(cycle), rel=1e-5)


def compare_with_own_equations(model, found, speed, cycle, **curve):
    """Compare a ``cycle`` with shooting on the own equations, from a state beside it."""
    rate, names = own_equations(model, speed, **curve)
    compare(found, cycle, rate, names, own_state(model, found, cycle) * 1.002)
