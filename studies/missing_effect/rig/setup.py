"""From a rig measurement to its forward model: recordings reduced, references found, candidates chosen."""

from studies.missing_effect.rig.candidates import PHENOMENOLOGICAL, chosen, rig_candidates, rig_nuisances
from studies.missing_effect.rig.data import PullReadings, SweepBlocks, reduce_pull, reduce_sweep
from studies.missing_effect.rig.recordings import RigRecordings
from studies.missing_effect.rig.recordings_forward import RigRecordingsForward
from studies.missing_effect.rig.reference import ALIKE, PEAK, Curve
from tyre.base.errors import InputError
from tyre.base.units import PASCAL_PER_BAR
from tyre.drum import log_curvature
from tyre.rig.effect import rig_terms
from tyre.rig.regression import Recorded

SAME_TRACK = 1e-9  # of ln(1 + R/Rd)


def rig_forward_model(
    recordings: RigRecordings, *, without: tuple[str, ...] = (), also: tuple[str, ...] = ()
) -> RigRecordingsForward:
    """The forward model of rig recordings.

    Parameters
    ----------
    recordings : RigRecordings
    without : tuple of str
        Effects that are not tried.
    also : tuple of str
        Effects of which only the name is checked: none of a rig is tried on request only.

    Raises
    ------
    InputError
        Recordings that cannot be used, or a reference that lacks what they need.
    """
    sweeps, notes = [], list(recordings.notes)
    for name, run in recordings.sweeps:
        sweep, said = reduce_sweep(name, run)
        sweeps.append(sweep)
        notes += said
    plate = recordings.pull_displacement == "plate"
    pulls = tuple(reduce_pull(name, test, plate=plate) for name, test in recordings.pulls)
    curves, radius = {}, recordings.wheel_radius
    every: list[SweepBlocks | PullReadings] = [*sweeps, *pulls]
    for recording in every:
        needed = "cornering_stiffness" if isinstance(recording, SweepBlocks) else "lateral_stiffness"
        curve = recordings.reference.at(recording.condition.load, recording.condition.pressure)
        if getattr(curve, needed) is None:
            raise InputError(
                f"{recording.name}: the reference ({recordings.reference.origin}) has no {needed.replace('_', ' ')} "
                f"at {curve.load:g} N, {curve.pressure / PASCAL_PER_BAR:g} bar; add it or leave the recording out"
            )
        curves[recording.label] = curve
    length = curves[sweeps[0].label].length if sweeps else None
    bends = [
        log_curvature(wheel_radius=radius, drum_radius=s.condition.drum_radius)
        - log_curvature(wheel_radius=radius, drum_radius=curves[s.label].drum_radius)
        for s in sweeps
    ]
    off = any(abs(s.condition.load / curves[s.label].load - 1) > ALIKE for s in sweeps)
    recorded = Recorded(
        sweeps=bool(sweeps), pulls=bool(pulls),
        both_branches=len({float(way) for s in sweeps for way in s.direction}) > 1,
        both_signs=any(s.slip.min() < 0 < s.slip.max() for s in sweeps),
        speeds=all(s.speed for s in sweeps), other_track=max(map(abs, bends), default=0.0) > SAME_TRACK,
        other_loads=off, known={} if length is None else {"relaxation_length": length},
    )  # fmt: skip
    terms = (*rig_terms(), *PHENOMENOLOGICAL)
    candidates, refused = rig_candidates(rig_terms(), recorded)
    candidates, included = chosen(candidates, refused, recordings.includes, without, also)
    without_cause, _ = rig_candidates(PHENOMENOLOGICAL, recorded)
    floating = rig_nuisances(sweeps, pulls, curves, recordings.calibration)
    notes += _assumed(recordings, sweeps, pulls, curves, off=off)
    return RigRecordingsForward(
        recordings=recordings, sweeps=tuple(sweeps), pulls=pulls, nuisances=(*floating, *included),
        candidates=candidates, refused=refused, notes=tuple(notes), curves=curves, terms=terms,
        without_cause=without_cause,
    )  # fmt: skip


def _assumed(
    recordings: RigRecordings, sweeps: list[SweepBlocks], pulls: tuple[PullReadings, ...], curves: dict[str, Curve],
    *, off: bool,
) -> list[str]:  # fmt: skip
    notes = [f"reference: {recordings.reference.origin}"]
    if recordings.synthetic:
        notes.insert(0, "the recordings are synthetic")
    if recordings.includes:
        notes.append(f"the base model contains {', '.join(recordings.includes)}")
    if sweeps and not any(c.peak for c in curves.values()):
        notes.append(f"the reference has no curve: a peak of {PEAK:g} loads and a shape of 1.4 are assumed, 1 sd 10 %")
    for pull in pulls:
        curve = curves[pull.label]
        if abs(pull.condition.load / curve.load - 1) > ALIKE:
            notes.append(
                f"{pull.name}: at {pull.condition.load:g} N the reference has no lateral stiffness; that at "
                f"{curve.load:g} N stands for it"
            )
    if off:
        notes.append("loads that the reference does not have are computed with the cornering stiffness of the nearest")
    length = curves[sweeps[0].label].length if sweeps else None
    if length is not None:
        label = sweeps[0].label
        value, sd = length
        notes.append(
            f"relaxation length at {label}: {1e3 * value:.0f} mm, 1 sd {1e3 * sd:.0f} mm before drum and load change it"
        )
    if pulls and recordings.pull_displacement == "plate":
        notes.append("displacement of the pull tests is that of the plate; the rim's is ignored")
    return notes
