"""From a rig measurement to its forward model: recordings reduced, references found, candidates chosen."""

from studies.missing_effect.rig.candidates import Setting, chosen, rig_candidates, rig_nuisances
from studies.missing_effect.rig.data import Pull, Sweep, reduce_pull, reduce_sweep
from studies.missing_effect.rig.measurement import RigMeasurement
from studies.missing_effect.rig.recordings_forward import RigRecordingsForward
from studies.missing_effect.rig.reference import ALIKE, PEAK
from tyre.base.errors import InputError
from tyre.base.units import PASCAL_PER_BAR
from tyre.drum import log_curvature


def rig_forward_model(measurement: RigMeasurement, *, without: tuple[str, ...] = ()) -> RigRecordingsForward:
    """The forward model of a rig measurement.

    Raises
    ------
    InputError
        Recordings that cannot be used, or a reference that lacks what they need.
    """
    sweeps, notes = [], list(measurement.notes)
    for name, run in measurement.sweeps:
        sweep, said = reduce_sweep(name, run)
        sweeps.append(sweep)
        notes += said
    plate = measurement.pull_displacement == "plate"
    pulls = tuple(reduce_pull(name, test, plate=plate) for name, test in measurement.pulls)
    curves, radius = {}, measurement.wheel_radius
    every: list[Sweep | Pull] = [*sweeps, *pulls]
    for recording in every:
        needed = "cornering_stiffness" if isinstance(recording, Sweep) else "lateral_stiffness"
        curve = measurement.reference.at(recording.condition.load, recording.condition.pressure)
        if getattr(curve, needed) is None:
            raise InputError(
                f"{recording.name}: the reference ({measurement.reference.origin}) has no {needed.replace('_', ' ')} "
                f"at {curve.load:g} N, {curve.pressure / PASCAL_PER_BAR:g} bar; add it or leave the recording out"
            )
        curves[recording.label] = curve
    length = curves[sweeps[0].label].length if sweeps else None
    setting = Setting(tuple(sweeps), pulls, curves, measurement.calibration, length)
    bends = [
        log_curvature(wheel_radius=radius, drum_radius=s.condition.drum_radius)
        - log_curvature(wheel_radius=radius, drum_radius=curves[s.label].drum_radius)
        for s in sweeps
    ]
    off = any(abs(s.condition.load / curves[s.label].load - 1) > ALIKE for s in sweeps)
    found, refused = rig_candidates(setting, bends, off, all(s.speed for s in sweeps))
    found, included = chosen(found, refused, measurement.includes, without)
    notes += _assumed(measurement, setting, off)
    return RigRecordingsForward(
        measurement, tuple(sweeps), pulls, (*rig_nuisances(setting), *included), found, refused, tuple(notes), curves
    )


def _assumed(measurement: RigMeasurement, setting: Setting, off: bool) -> list[str]:
    notes = [f"reference: {measurement.reference.origin}"]
    if measurement.synthetic:
        notes.insert(0, "the recordings are synthetic")
    if measurement.includes:
        notes.append(f"the base model contains {', '.join(measurement.includes)}")
    if setting.sweeps and not any(c.peak for c in setting.curves.values()):
        notes.append(f"the reference has no curve: a peak of {PEAK:g} loads and a shape of 1.4 are assumed, 1 sd 10 %")
    if off:
        notes.append("loads that the reference does not have are computed with the cornering stiffness of the nearest")
    if setting.length is not None:
        label = setting.sweeps[0].label
        value, sd = setting.length
        notes.append(
            f"relaxation length at {label}: {1e3 * value:.0f} mm, 1 sd {1e3 * sd:.0f} mm before drum and load change it"
        )
    if setting.pulls and measurement.pull_displacement == "plate":
        notes.append("displacement of the pull tests is that of the plate; the rim's is ignored")
    return notes
