"""What the first page needs beyond the verdict: what moved, what could still be there, what next, how stable."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from bicycle.effect.workers import model_workers
from studies.inference.checks import with_wider_nuisances
from studies.inference.contradiction import PartAgainstRest, parts_against_rest
from studies.inference.identifiability import Separation, separating
from studies.inference.joint import JointForward
from studies.inference.limits import UpperLimit, upper_limits
from studies.inference.moved import Moved, moved
from studies.inference.odd_part import WithoutOne, fits, odd_ones, without_each
from studies.inference.stability import Stability, stability
from studies.missing_effect.diagnose import Diagnosis
from studies.missing_effect.leading import CLEAR, Standing, doubled, leading_two, settled, standing
from studies.missing_effect.reporting.doubts import doubts
from studies.missing_effect.reporting.kgf import in_kgf
from studies.missing_effect.residual.kept import Kept, keep, record
from studies.missing_effect.unfitted import Predicted, predicted
from tyre.base.parallel import one_blas_thread

LEAST_GAIN = 0.05  # standard deviations; what would tell less is no advice: a report would print 0.0
WORTH_IT = 1.0  # the same where the verdict is clear already


@dataclass(frozen=True)
class Findings:
    """What a report says beyond the verdict.

    Attributes
    ----------
    moved : tuple of Moved
        How far each parameter went.
    limits : tuple of UpperLimit
        What could still be there beside the final hypothesis.
    between : tuple of str
        Hypotheses that ``further`` tells apart, the leader first; fewer than two where none are to be told apart.
    further : tuple of Separation
        What to measure next, best first.
    doubts : tuple of str
        Units and signs that are surely wrong, in words.
    stability : Stability, optional
        The verdict in variants, where they were judged.
    parts : tuple of PartAgainstRest
        Of joint data: each part against the others.
    without : mapping of str to WithoutOne
        What is judged without a part that contradicts the others, or without each where they do not fit together; the
        part first without which the others fit best.
    joint_fits : bool
        Whether the final hypothesis fits all data together.
    predicted : tuple of Predicted
        Of runs that were held out of every fit.
    kept : Kept, optional
        What could not be named, where the verdict leaves a gap; it is no part of the verdict.
    settled : str
        Why no two hypotheses are to be told apart, in words, where that is so.
    doubled : bool
        Whether ``further`` has the uncertainty of the parameters doubled, because a tentative name fails by that.
    standing : Standing, optional
        Of a verdict that names an effect or nothing: what ``further`` would only make surer.
    least_gain : float
        Standard deviations that an advice in ``further`` brings at least.
    """

    moved: tuple[Moved, ...]
    limits: tuple[UpperLimit, ...]
    between: tuple[str, ...]
    further: tuple[Separation, ...]
    doubts: tuple[str, ...]
    stability: Stability | None = None
    parts: tuple[PartAgainstRest, ...] = ()
    without: Mapping[str, WithoutOne] = field(default_factory=dict)
    joint_fits: bool = True
    predicted: tuple[Predicted, ...] = ()
    kept: Kept | None = None
    settled: str = ""
    doubled: bool = False
    standing: Standing | None = None
    least_gain: float = LEAST_GAIN

    @property
    def odd(self) -> list[WithoutOne]:
        """Parts without which everything else fits clearly, where all together do not fit."""
        return [] if self.joint_fits else odd_ones(self.without)

    @property
    def ranked(self) -> list[PartAgainstRest]:
        """The parts, first those without which the others fit best."""
        place = {name: k for k, name in enumerate(self.without)}
        return sorted(self.parts, key=lambda part: place.get(part.part, len(place)))

    def to_dict(self) -> dict[str, Any]:
        """For JSON, beside the verdict."""
        return {
            "moved": [
                {
                    "parameter": m.name, "unit": m.unit, "prior": m.prior, "prior_sd": m.prior_sd, "value": m.value,
                    "sd": m.sd, "shift_parameters_only": m.alone, "shift": m.shift,
                }
                for m in self.moved
            ],
            "upper_limits": [
                {
                    "effect": u.identifier, "parameter": u.parameter, "unit": u.unit,
                    "limit": dict(u.values),
                    "kind": "at least" if u.least else "size at most" if u.two_sided else "at most",
                    "limited_by_data": u.limited,
                }
                for u in self.limits
            ],
            "measure_next": {
                "between": list(self.between),
                "measurements": [{"what": s.what, "gain": s.gain} for s in self.further],
                "nothing_to_tell_apart": self.settled, "uncertainty_doubled": self.doubled,
                "stands": None if self.standing is None else asdict(self.standing),
            },
            "doubts": list(self.doubts),
            "parts": [
                {
                    "part": p.part, "disagreement_sd": p.sd, "p": p.p, "contradicts": p.contradicts,
                    "joint_fits": self.joint_fits,
                    "effects": [{**asdict(c), "difference_sd": c.difference} for c in p.effects],
                    "not_compared": list(p.unseen),
                    "without_it": self.without[p.part].rest.to_dict() if p.part in self.without else None,
                }
                for p in self.ranked
            ],
            "predicted": [p.to_dict() for p in self.predicted],
            "stability": None if self.stability is None else self.stability.to_dict(),
            "residual_torque": record(self.kept),
        }  # fmt: skip


@one_blas_thread()
def find(diagnosis: Diagnosis) -> Findings:
    """All but the variants of a ``diagnosis``, which take as long as it took itself."""
    known, final, forward = diagnosis.hypotheses, diagnosis.final, diagnosis.forward
    least = WORTH_IT if diagnosis.verdict.verdict in CLEAR else LEAST_GAIN
    between, further = _next(diagnosis, least)
    parts = parts_against_rest(forward, final) if isinstance(forward, JointForward) else ()
    kept = keep(diagnosis)
    torque = kept.residual.fit if kept is not None and kept.residual is not None else None
    without = _without(diagnosis, parts)
    return Findings(
        moved=moved(known.null, final), limits=upper_limits(forward, known, final), between=between, further=further,
        doubts=(*in_kgf(diagnosis, without), *doubts(diagnosis, torque)), parts=parts, without=without,
        joint_fits=fits(diagnosis.verdict), predicted=predicted(diagnosis, torque), kept=kept,
        settled=settled(diagnosis), doubled=doubled(diagnosis),
        standing=standing(diagnosis), least_gain=least,
    )  # fmt: skip


def _next(diagnosis: Diagnosis, least: float) -> tuple[tuple[str, ...], tuple[Separation, ...]]:
    """Which hypotheses are to be told apart, and what would, best first, by ``least`` sd; members of a class by any."""
    known, verdict = diagnosis.hypotheses, diagnosis.verdict
    between, further, rivals = verdict.equivalent, verdict.separating_measurements, leading_two(diagnosis)
    if len(between) > 1 and known.null in rivals:  # a class, all of which may be nothing
        rivals = (*rivals, *(f for f in known.fits if f.name in between[1:]))
        further = ()
    if not further and (len(rivals) > 1 or len(between) < 2):
        between = tuple(f.name for f in rivals)
        if doubled(diagnosis):
            wide = with_wider_nuisances(diagnosis.forward, known, [f for f in rivals if f.candidates])
            rivals = tuple(wide.find(f.identifiers) or f for f in rivals)
        further = tuple(separating(diagnosis.forward, list(rivals))) if len(rivals) > 1 else ()
        return between, tuple(s for s in further if s.gain >= least)
    return between, tuple(s for s in further if s.gain >= LEAST_GAIN)


def _without(diagnosis: Diagnosis, parts: tuple[PartAgainstRest, ...]) -> dict[str, WithoutOne]:
    """What the others say without each part that contradicts them.

    Where all together do not fit, how far a part is from the others is linear about a fit that is wrong: any is left
    out in its turn.
    """
    forward, together = diagnosis.forward, fits(diagnosis.verdict)
    if not isinstance(forward, JointForward):
        return {}
    return without_each(forward, [p.part for p in parts if p.contradicts or not together], single_out=not together)


@one_blas_thread()
def with_stability(
    findings: Findings, diagnosis: Diagnosis, progress: Callable[[str], None] | None = None, *, workers: int = 1
) -> Findings:
    """The ``findings`` of a ``diagnosis`` with its variants judged.

    Parameters
    ----------
    findings : Findings
    diagnosis : Diagnosis
    progress : callable, optional
        Told the words of each variant that is done.
    workers : int
        Number of processes.
    """
    if workers == 1:
        return replace(findings, stability=stability(diagnosis, progress=progress))
    with model_workers(workers) as pool:
        return replace(findings, stability=stability(diagnosis, run=pool.map, progress=progress))
