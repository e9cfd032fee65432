"""Lateral stiffness from a static test."""

from dataclasses import dataclass

import numpy as np

from tyre.fits.pull_curve import LawFit, Pull, PullCurve, find_strokes, fit_curve, gauge_noise, used_readings
from tyre.ground.errors import InputError
from tyre.ground.number_with_sd import with_sd
from tyre.measured.properties import Calibration, Estimate
from tyre.recordings.recording import Channel, LateralStiffnessTest
from tyre.recordings.run_checks import reading_step


@dataclass(frozen=True)
class LateralStiffnessFit:
    """Result of one lateral stiffness test (SI units, adapted SAE)."""

    # K_y = dFy/d(plate - rim) at the origin, N/m, with fit, stated repeatability and calibration in its interval
    lateral_stiffness: Estimate
    fit_sd: float  # standard deviation of K_y from this test's residuals alone, N/m
    fit_dof: float  # degrees of freedom behind it
    friction: float  # half height of the hysteresis loop, N; 0 if loading alone was recorded
    # deflection over which friction builds up after a reversal (and from the origin), m; 0 without friction
    presliding: float
    offset: float  # force at zero deflection midway between the branches, N
    drift: float  # walk of the force's zero over the test, N; 0 of loading alone
    reach: float  # largest deflection of the readings used, m
    linear_range: float  # deflection up to which F departs from K x by less than 2 %, m, within those used
    departure: float  # relative departure from the initial slope at the largest deflection used
    resolution: float  # reading step of the gauges found in the data, m; 0 if none is visible
    rim_share: float  # rim displacement over plate displacement
    r_squared: float  # of the force of the readings used
    residual_sd: float  # likewise, N
    strokes: int  # how many loadings and unloadings are in the readings used
    readings: int  # complete ones
    readings_used: int  # without those beyond ``reach``, where the tyre slides
    notes: tuple[str, ...]  # what a reader of the numbers must know
    deflection: Channel  # (n,), m, plate minus rim, of the complete readings
    force: Channel  # (n,), N, lateral force
    fitted: Channel  # (n,), N; NaN where the readings are not used

    def __repr__(self) -> str:
        k = self.lateral_stiffness.scaled(1e-3)
        return (
            f"<LateralStiffnessFit: {self.readings_used} of {self.readings} readings used, strokes: {self.strokes}, "
            f"R^2 {self.r_squared:.4f}, residual sd {self.residual_sd:.3g} N\n"
            f" lateral stiffness {with_sd(k.value, k.sd, places=1)} N/mm, friction {self.friction:.3g} N\n"
            f" linear within 2 % up to {1e3 * self.linear_range:.3g} mm of {1e3 * self.reach:.3g} mm; "
            f"notes: {len(self.notes)}>"
        )


def fit_lateral_stiffness(test: LateralStiffnessTest, *, calibration: Calibration | None = None) -> LateralStiffnessFit:
    """Fit the force of a lateral stiffness test over the deflection of the tyre, plate minus rim (Dell'Orto et al.,
    eqs. 7 and 8).

    F = F0 + K x (1 + c1 |x| + c2 x^2 + c3 |x|^3) + T, where friction T goes to +-f by Dahl's law, T = s f +
    (T_reversal - s f) exp(-|x - x_reversal| / l), s the direction of motion: loading and unloading share one slope, and
    stiction at the origin is the first build-up of T. A straight line through all points would take the loop for
    stiffness. From two strokes on the zero of the force cell may drift.

    How many powers of x are needed, and up to which deflection the law holds, is left to the data. A tyre that begins
    to slide bends the curve, and one that slides as a whole follows no such law: then the readings from there on are
    left out. Every law and range counts by its chi^2, its numbers and the readings that it leaves out
    (:func:`tyre.fits.pull_curve.fit_curve`); what they differ by is in the interval. A stroke ends where the deflection
    turns back by more than the noise of the gauge.

    Parameters
    ----------
    test : LateralStiffnessTest
        At least 6 readings, in the order they were taken.
    calibration : Calibration, optional

    Returns
    -------
    LateralStiffnessFit

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
        notes.append(f"{int(np.sum(~good))} readings with a missing value rejected")
    deflection, force = test.tyre_deflection[good], test.lateral_force[good]
    if deflection.size < 6:
        raise InputError(
            f"{where}: {deflection.size} readings are too few for a lateral stiffness test; at least 6 are needed"
        )
    resolution = max(reading_step(test.plate_displacement[good]), reading_step(test.rim_displacement[good]))
    span = float(np.ptp(deflection))
    if span <= 20.0 * max(resolution, 1e-7):
        raise InputError(
            f"{where}: the tyre deflects by {1e3 * span:.3f} mm, less than 20 reading steps "
            f"({1e3 * resolution:.3f} mm); increase the deflection or use a finer gauge"
        )
    if np.polyfit(deflection, force, 1)[0] <= 0.0:
        raise InputError(f"{where}: the lateral force falls with plate - rim displacement; check their signs")
    clock = np.arange(deflection.size, dtype=np.float64) if test.time is None else test.time[good]
    clock = (clock - clock.mean()) / max(float(np.ptp(clock)), 1e-12)
    if np.min(np.abs(deflection)) > 0.5 * span:
        notes.append(f"the deflection begins at {1e3 * deflection[0]:.2f} mm, far from zero; it is counted from there")
        deflection = deflection - deflection[0]
    noise = gauge_noise(deflection, force)
    pull = Pull(deflection, force, clock, find_strokes(deflection, noise=noise, resolution=resolution))
    # rounding of two gauges is a floor for the scatter of the force, even if residuals happen to be smaller
    rounding = float(np.polyfit(deflection, force, 1)[0]) * resolution / np.sqrt(6.0)
    floor = max(rounding, 1e-9 * float(np.ptp(force)))
    curve = fit_curve(pull, noise_floor=floor, least_span=20.0 * max(resolution, noise))
    leader, stiffness = curve.leader, curve.stiffness
    if stiffness <= 0.0:
        raise InputError(f"{where}: the lateral force does not grow with plate - rim displacement near the origin")
    used = used_readings(pull, leader.law)
    reach = float(np.max(np.abs(deflection[used])))
    departure = float(leader.departure(pull, np.array([reach]))[0])
    notes += _notes(curve, reach, departure)
    plate = float(np.ptp(test.plate_displacement[good]))
    rim_share = float(np.ptp(test.rim_displacement[good])) / plate if plate > 0.0 else 0.0
    if rim_share == 0.0:
        notes.append("the rim did not move at all: a laboratory rim, or a rim gauge that was not recorded")
    left_over = (force - leader.force(pull))[used]
    # a rim that moves by few reading steps is rounded the same way in every cycle: that error does not average out
    step = reading_step(test.rim_displacement[good])
    coarse = step > 0.0 and float(np.ptp(test.rim_displacement[good])) < 10.0 * step
    by_rim = stiffness * step / np.sqrt(12.0) / span if coarse else 0.0
    rounded = max(1.0, rounding / max(float(np.std(left_over)), 1e-300))
    fit_sd = float(np.hypot(curve.stiffness_sd * rounded, by_rim))
    friction = abs(float(leader.values[1 + leader.law.terms])) if leader.law.friction else 0.0
    strokes = int(np.sum(pull.turns < used.stop - 1))
    total = float(np.sum((force[used] - force[used].mean()) ** 2))
    return LateralStiffnessFit(
        lateral_stiffness=calibration.estimate(stiffness, fit_sd, curve.dof, calibration.displacement),
        fit_sd=fit_sd,
        fit_dof=curve.dof,
        friction=friction if strokes > 1 else 0.0,
        presliding=leader.presliding,
        offset=float(leader.values[0]),
        drift=float(leader.values[-1]) if leader.law.drift else 0.0,
        reach=reach,
        linear_range=_linear_range(pull, leader, reach),
        departure=departure,
        resolution=resolution,
        rim_share=rim_share,
        r_squared=1.0 - float(left_over @ left_over) / total,
        residual_sd=float(np.std(left_over)),
        strokes=strokes,
        readings=int(deflection.size),
        readings_used=used.stop,
        notes=tuple(notes),
        deflection=deflection,
        force=force,
        fitted=leader.force(pull),
    )


def _linear_range(pull: Pull, law: LawFit, reach: float) -> float:
    """Deflection (m) up to which a law departs from the initial slope by less than 2 %."""
    deflection = np.linspace(0.0, reach, 1001)
    departs = np.abs(law.departure(pull, deflection)) > 0.02
    return float(deflection[np.argmax(departs)]) if departs.any() else reach


def _notes(curve: PullCurve, reach: float, departure: float) -> list[str]:
    """Describe the misfit of the law of a lateral stiffness test, and its curvature."""
    pull, law = curve.pull, curve.leader.law
    used = used_readings(pull, law).stop
    notes = []
    if used < pull.force.size:
        notes.append(
            f"the tyre or a gauge slides beyond {1e3 * reach:.2f} mm: {pull.force.size - used} of {pull.force.size} "
            "readings fit no law of an adhering tyre and are rejected"
        )
    if abs(departure) > 0.02:
        side = "below" if departure < 0 else "above"
        notes.append(f"at {1e3 * reach:.2f} mm the force is {abs(100 * departure):.1f} % {side} the initial tangent")
    if np.sum(pull.turns < used - 1) == 1:
        notes.append("loading only: friction and offset are not separable")
    if curve.poor:
        notes.append(
            f"residuals of the fit, {curve.leader.left_over:.2g} N, exceed the noise between readings "
            f"({curve.noise:.2g} N); the interval is widened"
        )
    return notes
