"""Lateral stiffness from a static pull."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray
from scipy.special import fdtrc

from tyre.errors import InputError
from tyre.friction import dahl_after
from tyre.preflight import reading_step
from tyre.properties import Calibration, Estimate
from tyre.recording import Channel, PullTest


@dataclass(frozen=True)
class PullTestFit:
    """Result of one pull test (SI units, adapted SAE)."""

    # K_y = dFy/d(plate - rim) at the origin, N/m, with fit, stated repeatability and calibration in its interval
    lateral_stiffness: Estimate
    fit_sd: float  # standard deviation of K_y from this test's residuals alone, N/m
    friction: float  # half height of the hysteresis loop, N; 0 if loading alone was recorded
    presliding: float  # deflection over which friction builds up after a reversal (and from the origin), m
    offset: float  # force at zero deflection midway between the branches, N
    drift: float  # walk of the force's zero over the test, N; 0 with fewer than three strokes
    curvature: float  # quadratic term k2 of F = K x (1 + k2 |x|), 1/m; 0 if a line describes the test
    linear_range: float  # deflection up to which F departs from K x by less than 2 %, m, within the recorded ones
    departure: float  # relative departure from the initial slope at the largest deflection
    resolution: float  # reading step of the gauges found in the data, m; 0 if none is visible
    rim_share: float  # rim displacement over plate displacement
    r_squared: float  # of the force
    residual_sd: float  # of the force
    strokes: int
    readings: int
    notes: tuple[str, ...]
    deflection: Channel
    force: Channel
    fitted: Channel


def fit_pull_test(test: PullTest, *, calibration: Calibration | None = None) -> PullTestFit:
    """Fit the force of a pull test over the deflection of the tyre, plate minus rim (Dell'Orto et al., eqs. 7 and 8).

    F = F0 + K x (1 + k2 |x|) + T, where friction T goes to +-f by Dahl's law, T = s f + (T_reversal - s f)
    exp(-|x - x_reversal| / l), s the direction of motion: loading and unloading share one slope, and stiction at the
    origin is the first build-up of T. A straight line through all points would take the loop for stiffness. From
    three strokes on the zero of the force cell may drift. k2 is used only where it is significant (p < 0.001) and
    changes the force by more than 1 %. A stroke ends where the deflection turns back by more than 2 % of its whole
    range, or by three reading steps where these are more.

    Parameters
    ----------
    test : PullTest
        At least 6 readings, in the order they were taken.
    calibration : Calibration, optional

    Returns
    -------
    PullTestFit

    Raises
    ------
    InputError
        For too few readings, a deflection hidden by the gauge's resolution, or a force that falls with deflection.
    """
    where = str(test.source or test.condition.tyre)
    calibration = calibration or Calibration()
    notes = list(test.notes)
    good = test.complete
    if not good.all():
        notes.append(f"{int(np.sum(~good))} readings with a missing value left out")
    deflection, force = test.tyre_deflection[good], test.side_force[good]
    if deflection.size < 6:
        raise InputError(f"{where}: {deflection.size} readings are too few for a pull test; at least 6 are needed")
    resolution = max(reading_step(test.plate_displacement[good]), reading_step(test.rim_displacement[good]))
    span = float(np.ptp(deflection))
    if span <= 20.0 * max(resolution, 1e-7):
        raise InputError(
            f"{where}: the tyre deflects by {1e3 * span:.3f} mm, less than 20 reading steps "
            f"({1e3 * resolution:.3f} mm); pull further or use a finer gauge"
        )
    turns = _turns(deflection, max(3.0 * resolution, 0.02 * span))
    if np.polyfit(deflection, force, 1)[0] <= 0.0:
        raise InputError(f"{where}: the side force falls with plate - rim displacement; check their signs")
    clock = np.arange(deflection.size, dtype=np.float64) if test.time is None else test.time[good]
    clock = (clock - clock.mean()) / max(float(np.ptp(clock)), 1e-12)
    line, curve = (_fit_loop(deflection, force, clock, turns, curved=curved) for curved in (False, True))
    gained = (line["cost"] - curve["cost"]) / max(curve["cost"] / max(deflection.size - curve["terms"], 1), 1e-300)
    reach = float(np.max(np.abs(deflection)))
    bent = fdtrc(1, max(deflection.size - curve["terms"], 1), gained) < 1e-3
    chosen = curve if bent and abs(curve["k2"]) * reach > 0.01 else line
    stiffness, k2 = chosen["K"], chosen["k2"]
    departure = k2 * reach
    if abs(departure) > 0.02:
        notes.append(f"force departs {100 * departure:+.1f} % from the initial slope at {1e3 * reach:.2f} mm")
    if turns.size == 1:
        notes.append("loading only: friction cannot be told from the offset")
    plate = float(np.ptp(test.plate_displacement[good]))
    rim_share = float(np.ptp(test.rim_displacement[good])) / plate if plate > 0.0 else 0.0
    if rim_share == 0.0:
        notes.append("the rim did not move at all: a laboratory rim, or a rim gauge that was not recorded")
    # rounding of two gauges is a floor for the scatter of the force, even if residuals happen to be smaller
    inflation = max(1.0, stiffness * resolution / np.sqrt(6.0) / max(chosen["sd"], 1e-300))
    # a rim that moves by few reading steps is rounded the same way in every cycle: that error does not average out
    step = reading_step(test.rim_displacement[good])
    coarse = step > 0.0 and float(np.ptp(test.rim_displacement[good])) < 10.0 * step
    fit_sd = float(np.hypot(chosen["K_sd"] * inflation, stiffness * step / np.sqrt(12.0) / span if coarse else 0.0))
    dof = max(deflection.size - chosen["terms"], 1)
    total_squares = float(np.sum((force - force.mean()) ** 2))
    return PullTestFit(
        lateral_stiffness=calibration.estimate(stiffness, fit_sd, dof, calibration.displacement), fit_sd=fit_sd,
        friction=abs(chosen["f"]),
        presliding=chosen["l"], offset=chosen["F0"], drift=chosen["drift"], curvature=k2,
        linear_range=reach if abs(departure) <= 0.02 else 0.02 / abs(k2), departure=departure, resolution=resolution,
        rim_share=rim_share, r_squared=1.0 - chosen["cost"] / total_squares, residual_sd=chosen["sd"],
        strokes=turns.size, readings=int(deflection.size), notes=tuple(notes), deflection=deflection,
        force=force, fitted=chosen["fitted"],
    )  # fmt: skip


def _turns(deflection: Channel, threshold: float) -> NDArray[np.int64]:
    """Readings at which the strokes begin."""
    turns, extreme, direction = [0], 0, 0.0
    for index in range(1, deflection.size):
        moved = deflection[index] - deflection[extreme]
        ahead = moved * (direction or np.sign(moved))
        if direction == 0.0:
            if ahead > threshold:
                direction, extreme = float(np.sign(deflection[index] - deflection[turns[0]])), index
        elif ahead >= 0.0:
            extreme = index
        elif -ahead > threshold:
            turns.append(extreme)
            direction, extreme = -direction, index
    return np.array(turns)


def _fit_loop(
    deflection: Channel, force: Channel, clock: Channel, turns: NDArray[np.int64], *, curved: bool
) -> dict[str, Any]:
    """Fit the loop of n readings, whose strokes begin at ``turns``; ``clock`` runs from -1/2 to 1/2 or so."""
    span, drifting = float(np.ptp(deflection)), turns.size >= 3
    corners = deflection[np.append(turns, deflection.size - 1)]
    directions, ways = np.sign(np.diff(corners)), np.abs(np.diff(corners))

    def friction(length: float) -> Channel:
        """Dahl friction over its final value, from -1 to 1; starts from zero at the first reading."""
        state, shape = 0.0, np.empty(deflection.size)
        for n, (begin, direction, way) in enumerate(zip(turns, directions, ways, strict=True)):
            mine = slice(begin + (n > 0), None)  # the next stroke writes over the rest
            travelled = np.maximum(direction * (deflection[mine] - deflection[begin]), 0.0)
            shape[mine] = dahl_after(state, travel=travelled, direction=direction, presliding=length)
            state = float(dahl_after(state, travel=way, direction=direction, presliding=length))
        return shape

    def design(length: float) -> NDArray[np.float64]:
        columns = [np.ones_like(force), deflection]
        shape = friction(length)
        if turns.size > 1 or shape.min() < 0.9:
            columns.append(shape)
        columns += [clock] * drifting + [deflection * np.abs(deflection)] * curved
        return np.column_stack(columns)

    def projected(z: Channel) -> Channel:
        matrix = design(float(np.exp(z[0])))
        return force - matrix @ np.linalg.lstsq(matrix, force, rcond=None)[0]

    low, high = np.log(2e-4 * span), np.log(0.1 * span)
    trial = np.linspace(low, high, 7)
    costs = [float(np.sum(projected(np.array([z])) ** 2)) for z in trial]
    begin = float(np.clip(trial[int(np.argmin(costs))], low + 1e-3, high - 1e-3))
    found: Any = scipy.optimize.least_squares(projected, [begin], bounds=([low], [high]))
    length = float(np.exp(found.x[0]))
    matrix = design(length)
    values = np.linalg.lstsq(matrix, force, rcond=None)[0]
    fitted = matrix @ values
    cost = float(np.sum((force - fitted) ** 2))
    terms, step = matrix.shape[1] + 1, 1e-3
    by_length = (design(length * (1 + step)) - design(length * (1 - step))) @ values / (2 * step)
    full = np.column_stack([matrix, by_length])
    variance = cost / max(force.size - terms, 1)
    covariance = np.linalg.pinv(full.T @ full, rcond=1e-15) * variance
    stiffness = float(values[1])
    return {
        "F0": float(values[0]), "K": stiffness, "K_sd": float(np.sqrt(covariance[1, 1])),
        "f": float(values[2]) if turns.size > 1 else 0.0, "l": length,
        "k2": float(values[-1]) / stiffness if curved else 0.0,
        "drift": float(values[-1 - int(curved)]) if drifting else 0.0, "cost": cost, "sd": float(np.sqrt(variance)),
        "terms": terms, "fitted": fitted,
    }  # fmt: skip
