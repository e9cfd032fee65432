"""The figures of joint data: those of each part, of what the joint hypotheses say of it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from studies.inference.fit import Fit
from studies.inference.joint import JointForward
from studies.inference.judge import Judgement
from studies.missing_effect.interface import Figure


@dataclass(frozen=True)
class _FitOfPart(Fit):
    """What a joint fit says of one part, under the name of the ``whole``."""

    whole: str = ""

    @property
    def name(self) -> str:
        return self.whole


def of_part(judgement: Judgement, number: int) -> Judgement:
    """What a ``judgement`` of joint data says of the part with this ``number``: its rows, and what acts on it.

    Parameters
    ----------
    judgement : Judgement
    number : int
    """
    forward = judgement.forward
    assert isinstance(forward, JointForward)
    rows = forward.slices()[number]

    def restricted(f: Fit) -> Fit:
        kept, places = forward.of_part(number, f.candidates)
        return _FitOfPart(
            kept, tuple(f.unknowns[k] for k in places), f.theta[places], f.covariance[places][:, places],
            f.residual[rows], f.jacobian[rows][:, places], f.objective, f.log_evidence, f.nuisance_scale, f.converged,
            whole=f.name,
        )  # fmt: skip

    known = judgement.hypotheses
    null = restricted(known.null)
    final = null if judgement.final is known.null else restricted(judgement.final)
    return replace(
        judgement, forward=forward.parts[number].forward, hypotheses=replace(known, null=null), final=final,
        nominal=judgement.nominal[rows],
    )  # fmt: skip


def figures_of_parts(figures: Mapping[str, Mapping[str, Figure]]) -> dict[str, Figure]:
    """Figures of joint data by name, such as ``gap_1``: those of each part, which are given by the parts' names.

    Parameters
    ----------
    figures : mapping of str to mapping
        Part -> its ``gap`` and ``before_after``, in the order of the parts.
    """
    return {
        f"{kind}_{number + 1}": _of(number, part, figure)
        for number, (part, own) in enumerate(figures.items())
        for kind, figure in own.items()
    }


def _of(number: int, part: str, figure: Figure) -> Figure:
    draw, caption = figure

    def drawn(judgement: Judgement, target: Path) -> bool:
        return draw(of_part(judgement, number), target)

    return drawn, f"{part}: {caption}"
