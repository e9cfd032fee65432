"""Find where simulation and measurement disagree, name the missing effect, show the discrepancy shrink."""

from dataclasses import dataclass

from bicycle.model.model import Model
from studies.inference.judge import Judgement, fit_effect_alone, judge
from studies.inference.kind import Kind
from studies.inference.preflight import preflight
from studies.inference.quick import judge_quickly
from tyre.ground.errors import InputError
from tyre.ground.progress import progress_bar
from tyre.ground.workers import one_blas_thread


@dataclass(frozen=True, eq=False, kw_only=True)
class Diagnosis(Judgement):
    """A judgement of a measurement."""

    model: Model | None = None  # the base model with what was named, where it is a bicycle's


@one_blas_thread()  # the matrices are small: threads make it ten times slower
def diagnose(
    measurement: Kind,
    model: Model | None = None,
    *,
    without: tuple[str, ...] = (),
    with_: tuple[str, ...] = (),
    progress: bool = False,
    as_read: bool = False,
    quick: bool = False,
) -> Diagnosis:
    """Diagnose a measurement.

    Parameters
    ----------
    measurement : Kind
        Of a bicycle or of a tyre; see :func:`studies.missing_effect.read_measurement`.
    model : Model, optional
        Base model in place of the measurement's own; of a bicycle only.
    without : tuple of str
        Effects that are not tried.
    with_ : tuple of str
        Motors that are tried: effects that are ``powered``, such as ``steer_assist``, are tried on request only.
    progress : bool
        Show a progress bar on standard error.
    as_read : bool
        Search though another unit or sign of a column explains the data far better.
    quick : bool
        Least squares over single effects and BIC: nothing is held out, and no two effects are tried.

    Returns
    -------
    Diagnosis
        Its ``verdict`` has the result.

    Raises
    ------
    InputError
        An effect in ``without`` or ``with_`` that does not exist, a bicycle model for a tyre, data that cannot be used
        or are in another unit or of another sign.
    """
    if model is not None:
        measurement = measurement.with_model(model)
    with progress_bar(desc="diagnose", unit=" fits", show=progress, leave=False) as bar:

        def advance(step: str) -> None:
            bar.set_postfix_str(step, refresh=False)
            bar.update()

        kind = measurement.prepare(without=without, also=with_)
        advance("units and signs")
        if not as_read and (wrong := preflight(kind)):
            raise InputError(
                f"{measurement.name}: {', or '.join(wrong.readings)}? Read so, with the parameters alone, chi^2 falls "
                f"from {wrong.before:.3g} to {wrong.after:.3g} per data point; correct the data (in a channel map "
                "`sign = -1` or, for a unit, `instead_of`; else the sign or the unit of the column), or search them as "
                "they are with --as-read"
            )
        judgement = (judge_quickly if quick else judge)(kind, progress=advance)
        effect_alone = fit_effect_alone(judgement)
    return Diagnosis(model=_build_corrected_model(judgement), **{**vars(judgement), "alone": effect_alone})


def _build_corrected_model(judgement: Judgement) -> Model | None:
    """The base model of the first bicycle with what was named; None if there is none, or it makes no model."""
    kind, named_fit = judgement.kind.bicycles(judgement.final).get("", (judgement.kind, judgement.final))
    try:
        model: Model | None = kind.corrected_model(named_fit)
    except InputError:
        return None
    return model
