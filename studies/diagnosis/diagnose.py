"""Find where simulation and measurement disagree, name the missing effect, show the gap shrink."""

from dataclasses import dataclass

from bicycle.model import Model
from studies.inference.judge import Judgement, judge
from studies.inference.kind import Kind
from tyre.progress import progress_bar
from tyre.workers import one_blas_thread


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

    Returns
    -------
    Diagnosis
        Its ``verdict`` has the result.

    Raises
    ------
    InputError
        An effect in ``without`` or ``with_`` that does not exist, a bicycle model for a tyre, data that cannot be used.
    """
    if model is not None:
        measurement = measurement.on(model)
    with progress_bar(desc="diagnose", unit=" fits", show=progress, leave=False) as bar:

        def advance(what: str) -> None:
            bar.set_postfix_str(what, refresh=False)
            bar.update()

        judgement = judge(measurement.ready(without=without, also=with_), progress=advance)
    return Diagnosis(model=measurement.model_with(judgement.final), **vars(judgement))
