"""Find where simulation and measurement disagree, name the missing effect, show the gap shrink."""

from dataclasses import replace

from bicycle.effect import registry
from bicycle.model import Model
from studies.inference.fit import Fit
from studies.inference.forward import Forward
from studies.inference.judge import Diagnosis, Subject, judge
from studies.inference.parameter import Candidate
from studies.missing_effect.measurement import Measurement
from studies.missing_effect.motion.candidates import find_candidates, physical
from studies.missing_effect.motion.canonical_forward import canonical_forward, sensor_candidates
from studies.missing_effect.motion.history_forward import HistoryForward, history_candidates
from studies.missing_effect.motion.modal_forward import ModalForward, measurement_candidates
from studies.missing_effect.motion.nuisances import nuisances
from studies.missing_effect.rig.measurement import RigMeasurement
from studies.missing_effect.rig.setup import rig_forward_model
from studies.missing_effect.rig.tables_forward import TyreTables, tables_forward_model
from tyre.base.errors import InputError, unknown
from tyre.base.parallel import one_blas_thread


def forward_model(measurement: Measurement, *, without: tuple[str, ...] = ()) -> Forward:
    """The forward model of a measurement with its candidates; ``without`` names effects that are not tried.

    Raises
    ------
    InputError
        An effect in ``without`` that does not exist.
    """
    model = measurement.model
    if measurement.coefficients is not None:
        _check_names(without, sensor_candidates())
        return canonical_forward(measurement, measurement.coefficients, without)
    unknowns, notes = nuisances(model, measurement.uncertainty)
    found, refused = find_candidates(model, measurement.known, without)
    notes = (*measurement.notes, *notes)
    if measurement.points:
        points = tuple(sorted(measurement.points, key=lambda p: (p.mode, p.speed)))
        ratios = tuple(dict.fromkeys(name for p in points for name in p.ratios))
        every = measurement_candidates(ratios)
        _check_names(without, every)
        sensors = tuple(c for c in every if c.identifier not in without)
        return ModalForward(
            base=model, nuisances=unknowns, candidates=(*found, *sensors), refused=refused, notes=notes, points=points
        )
    every = history_candidates(measurement.runs[0])
    _check_names(without, every)
    sensors = tuple(c for c in every if c.identifier not in without)
    return HistoryForward.of_runs(
        measurement.runs, measurement.noise_sd,
        base=model, nuisances=unknowns, candidates=(*found, *sensors), refused=refused, notes=notes,
    )  # fmt: skip


def _check_names(without: tuple[str, ...], sensors: tuple[Candidate, ...]) -> None:
    known = {*registry(), *(c.identifier for c in sensors)}
    for name in without:
        if name not in known:
            raise InputError(f"--without: {unknown('effect', name, known)}")


@one_blas_thread()  # the matrices are small: threads make it ten times slower
def diagnose(
    measurement: Measurement | RigMeasurement | TyreTables,
    model: Model | None = None,
    *,
    without: tuple[str, ...] = (),
    progress: bool = False,
) -> Diagnosis:
    """Diagnose a measurement.

    Parameters
    ----------
    measurement : Measurement, RigMeasurement or TyreTables
    model : Model, optional
        Base model in place of the measurement's own; of a bicycle only.
    without : tuple of str
        Effects that are not tried.
    progress : bool
        Show a progress bar on standard error.

    Returns
    -------
    Diagnosis
        Its ``verdict`` has the result.
    """
    subject = Subject(measurement.name, measurement.description, measurement.source)
    if isinstance(measurement, RigMeasurement | TyreTables):
        if model is not None:
            raise InputError("a measurement of a tyre has a reference tyre, no bicycle model; leave the model out")
        if isinstance(measurement, TyreTables):
            return judge(tables_forward_model(measurement, without=without), subject, progress=progress)
        return judge(rig_forward_model(measurement, without=without), subject, progress=progress)
    if model is not None:
        measurement = replace(measurement, model=model)
    found = judge(forward_model(measurement, without=without), subject, progress=progress)
    return replace(found, model=_with_effects(measurement.model, found.final))


def _with_effects(model: Model | None, final: Fit) -> Model | None:
    """The base model with the named effects, bicycle parameters as they were; None where it is not a valid model."""
    try:
        for c in sorted(final.candidates, key=lambda c: c.replaces is None):
            if c.effect is not None and model is not None:
                model = model.with_effect(physical(c, final.theta[final.columns(c)].tolist()))
    except InputError:
        return None
    return model
