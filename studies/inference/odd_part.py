"""Joint data without one of their parts: which part is the odd one where no hypothesis fits all of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from studies.inference.attempts import POOR_FIT
from studies.inference.fit import Fit
from studies.inference.joint import JointForward
from studies.inference.judge import judge
from studies.inference.verdict import Verdict

CLEAR = ("none", "named", "class")  # verdicts that rest on a fit that explains the data, and on no reservation


@dataclass(frozen=True)
class WithoutOne:
    """What the others say without one part.

    Attributes
    ----------
    part : str
        What is left out.
    rest : Verdict
        Of the others.
    alone : Verdict, optional
        Of the part by itself, where it is the odd one.
    final : Fit, optional
        The model of the others: with what was named.
    """

    part: str
    rest: Verdict
    alone: Verdict | None = None
    final: Fit | None = None

    @property
    def clear(self) -> bool:
        """Whether everything else fits, with a clear verdict."""
        return self.rest.verdict in CLEAR and fits(self.rest)


def fits(verdict: Verdict) -> bool:
    """Whether the final model of a ``verdict`` fits its data by the rule of acceptance."""
    return verdict.goodness_of_fit_p > POOR_FIT


def without_each(forward: JointForward, names: Sequence[str], *, single_out: bool) -> dict[str, WithoutOne]:
    """What the others say without each of some parts, the part first without which the others fit best.

    Parameters
    ----------
    forward : JointForward
    names : sequence of str
        Of the parts that are left out, one at a time.
    single_out : bool
        Judge those by themselves, too, without which everything else fits clearly.
    """
    found = []
    for part in forward.parts if len(forward.parts) > 1 else ():
        if part.name in names:
            rest = tuple(other for other in forward.parts if other is not part)
            judged = judge(JointForward(rest))
            found.append(WithoutOne(part.name, judged.verdict, final=judged.final))
    ranked = {one.part: one for one in sorted(found, key=_order)}
    if single_out:
        ranked |= {name: replace(one, alone=_alone(forward, ranked, name)) for name, one in ranked.items() if one.clear}
    return ranked


def odd_ones(without: Mapping[str, WithoutOne]) -> list[WithoutOne]:
    """Of what was judged ``without`` each part of data that do not fit together: where everything else fits clearly."""
    return [one for one in without.values() if one.clear]


def _order(one: WithoutOne) -> tuple[bool, float, float]:
    """Clear verdicts first, then by p and, where that is too small to be one, by what is left a number."""
    chi2 = one.rest.chi2
    return not one.clear, -one.rest.goodness_of_fit_p, (chi2["final"] + chi2["penalty"]) / chi2["n"]


def _alone(forward: JointForward, known: Mapping[str, WithoutOne], name: str) -> Verdict:
    """Of two parts, one alone is what is left without the other."""
    (part,) = (part for part in forward.parts if part.name == name)
    others = [other.name for other in forward.parts if other is not part]
    if len(others) == 1 and others[0] in known:
        return known[others[0]].rest
    return judge(JointForward((part,))).verdict
