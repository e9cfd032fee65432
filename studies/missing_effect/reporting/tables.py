"""The tables of a report, rows of text."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from studies.inference.contradiction import PartAgainstRest
from studies.inference.fit import Fit
from studies.inference.joint import JointForward
from studies.inference.judge import Judgement
from studies.inference.limits import UpperLimit
from studies.inference.moved import Moved
from studies.inference.stability import Stability
from studies.missing_effect.gap_figures import MOST_SERIES, residuals
from studies.missing_effect.reporting.words import (
    explains,
    misfit,
    number,
    probability,
    said,
    titles,
    unit_of,
    values_of,
    without_number,
)  # fmt: skip
from studies.missing_effect.unfitted import Predicted

Table = list[list[str]]
MUCH = 0.5  # prior sd beyond which a parameter's way is on the first page
MOST_SINGLES, MOST_PAIRS, MOST_TRIPLES = 40, 6, 4  # hypotheses that are listed
WIDER = 1.01  # ratio of a reported sd to that of the fit alone that is told


def by_place(judgement: Judgement) -> Table:
    """Chi^2 by series, by condition and by third of the speeds, of the models of a ``judgement`` that differ."""
    rows, models = judgement.forward.rows, residuals(judgement)
    series = np.array(rows.series)
    edges = np.quantile(rows.abscissa, [0, 1 / 3, 2 / 3, 1])
    if len(set(rows.series)) > MOST_SERIES:
        series = rows.channels
    groups = {str(name): series == name for name in dict.fromkeys(series.tolist())}
    for k, name in enumerate(rows.condition):
        groups[name] = rows.abscissa == k
    for low, high in pairwise(edges) if rows.one_axis else ():
        inside = (rows.abscissa >= low) & ((rows.abscissa < high) | (high == edges[-1]))
        if inside.any() and high > low:
            groups[f"{low:.3g} to {high:.3g} m/s"] = inside
    return [
        [name, str(inside.sum()), *(misfit(float(r[inside] @ r[inside])) for r in models.values())]
        for name, inside in groups.items()
    ]


def together(judgement: Judgement, parts: Sequence[PartAgainstRest]) -> Table:
    """Each of the ``parts`` of a joint ``judgement``: numbers, chi^2 of the models, disagreement with the others, p."""
    forward = judgement.forward
    if not isinstance(forward, JointForward):
        return []
    models = residuals(judgement)
    return [
        [
            part.part, str(rows.stop - rows.start), *(misfit(float(r[rows] @ r[rows])) for r in models.values()),
            f"{part.sd:.1f} sd", probability(part.p),
        ]
        for part, rows in zip(parts, forward.slices(), strict=True)
    ]  # fmt: skip


def compared(parts: Sequence[PartAgainstRest]) -> Table:
    """Sizes of effects by each of the ``parts`` and by the others."""
    return [
        [
            f"{c.name} ({part.part})", f"{number(c.own, 4)} ± {number(c.own_sd, 2)}{unit_of(c.unit)}",
            f"{number(c.rest, 4)} ± {number(c.rest_sd, 2)}{unit_of(c.unit)}", f"{abs(c.difference):.1f} sd",
        ]
        for part in parts
        for c in part.effects
    ]  # fmt: skip


def predicted(judgement: Judgement, found: Sequence[Predicted]) -> Table:
    """How the models of a ``judgement`` predict runs that were never fitted: chi^2/n, the gap, and rms by channel."""
    table, models = [], list(predictors(judgement, found))
    for one in found:
        of = f"{one.part}: " if one.part else ""
        gap = one.gap
        table.append([f"{of}χ²/n of {one.numbers} numbers", *(f"{one.chi2[m] / one.numbers:.3g}" for m in models)])
        table.append([f"{of}gap", *("-" if (g := gap[m]) is None else f"{g:.2f}" for m in models)])
        for channel, rms in one.rms.items():
            table.append([f"{of}rms of what {channel} leaves", *(f"{rms[m]:.3g}" for m in models)])
    return table


def predictors(judgement: Judgement, found: Sequence[Predicted]) -> dict[str, str]:
    """The models of a ``judgement`` that runs were predicted by, and their names; with a residual torque one more."""
    more = any("with_torque" in one.chi2 for one in found)
    return titles(judgement) | ({"with_torque": "and the residual torque"} if more else {})


def tried(judgement: Judgement) -> Table:
    """Hypotheses of a ``judgement``, most probable first: name, P, chi^2, sizes, and what became of each."""
    known, posterior = judgement.hypotheses, judgement.hypotheses.posterior
    shown = [
        known.null, *known.best(1)[:MOST_SINGLES], *known.best(2)[:MOST_PAIRS], *known.best(3)[:MOST_TRIPLES],
    ]  # fmt: skip
    if judgement.final not in shown:
        shown.append(judgement.final)
    fates = fate(judgement)
    return [
        [explains(f), probability(posterior[f.name]), misfit(f.chi2), values_of(f) or "-", fates.get(f.name, "")]
        for f in sorted(shown, key=lambda f: -posterior[f.name])
    ]


def fate(judgement: Judgement) -> dict[str, str]:
    """What became of hypotheses of a ``judgement``, by the engine's name; of those that are neither, nothing."""
    verdict, known, final = judgement.verdict, judgement.hypotheses, judgement.final
    found = dict.fromkeys(verdict.equivalent, "in the class")
    refused = {name: rule for name, _, rule in verdict.refused_leaders}
    for f in known.fits:
        faults = [f"{name.partition('.')[0]} at its bound" for name in f.at_bound()]
        faults += [f"{name.partition('.')[0]} larger than occurs" for name in f.implausible()]
        if not f.converged:
            faults.append("the fit did not converge")
        if f.name in refused:
            found[f.name] = f"refused: {refused[f.name]}"
        elif faults and f.name not in found:
            found[f.name] = f"refused: {', '.join(faults)}"
    if verdict.equivalent:
        word = {"partial": "named in part", "tentative": "named, tentatively"}.get(verdict.verdict, "named")
        found[final.name] = "leads the class" if len(verdict.equivalent) > 1 and word == "named" else word
    elif verdict.verdict == "none":
        found[final.name] = "explains the data"
    return found


def named(judgement: Judgement) -> Table:
    """What is named: effect, parameter, value, one sd, what it does."""
    table, tried = [], {c.identifier: c for c in (*judgement.forward.candidates, *judgement.final.candidates)}
    for e in judgement.verdict.effects:
        if not e.parameters:
            table.append([e.identifier, "-", without_number(tried[e.identifier]), "-", e.signature])
        for k, (name, (value, sd)) in enumerate(e.parameters.items()):
            unit = unit_of(e.units.get(name, "1"))
            table.append(
                [e.identifier if not k else "", name, f"{number(value, 4)}{unit}", f"± {number(sd, 2)}{unit}",
                 e.signature if not k else ""]
            )  # fmt: skip
    return table


def widened(judgement: Judgement) -> float:
    """The largest ratio of a reported sd to that of the final fit alone; 1 where nothing is named."""
    final, ratios = judgement.final, [1.0]
    for e in judgement.verdict.effects:
        c = next(c for c in final.candidates if c.identifier == e.identifier)
        reported = list(e.parameters.values())
        for k, (u, x) in enumerate(zip(c.unknowns, final.theta[final.columns(c)], strict=True)):
            place = final.columns(c).start + k
            own = u.slope(float(x)) * float(np.sqrt(final.covariance[place, place]))
            factor = float(next(iter(u.sets.values()), 1.0)) if len(set(u.sets.values())) > 1 else 1.0
            same = [sd for value, sd in reported if np.isclose(value, factor * float(u.value(x)))]
            ratios += [sd / (factor * own) for sd in same[:1] if own > 0]
    return max(ratios)


def moved(judgement: Judgement, found: tuple[Moved, ...]) -> tuple[Table, Table]:
    """How parameters moved in the models of a ``judgement`` that differ: those ``found`` to go far, and the rest."""
    models = len(titles(judgement)) - 1
    table: tuple[Table, Table] = ([], [])
    for m in found:
        unit = unit_of(m.unit) if m.unit else ""
        row = [
            m.name,
            *(f"{number(value, 4)} ± {number(sd, 2)}{unit}" for value, sd in ((m.prior, m.prior_sd), (m.value, m.sd))),
            *(f"{m.alone:+.1f}", f"{m.shift:+.1f}")[:models],
        ]  # fmt: skip
        table[max(abs(m.shift), abs(m.alone)) <= MUCH].append(row)
    return table


def limited(found: tuple[UpperLimit, ...]) -> tuple[Table, list[str]]:
    """Limits that the data give, and the names of what they do not limit."""
    table = [
        [u.identifier, *_limit(u), "less than 1 %" if u.share < 0.01 else f"{100 * u.share:.0f} %"]
        for u in found
        if u.limited
    ]
    return table, [f"{u.identifier} ({u.parameter})" for u in found if not u.limited]


def _limit(limit: UpperLimit) -> tuple[str, str]:
    sign = "≥" if limit.least else "≤"
    shown = []
    for name, value in limit.values.items():
        wheel = name.partition(".")[2]
        shown.append(f"{wheel} {sign} {number(value, 3)}".strip())
    return f"{'size of ' if limit.two_sided else ''}{limit.parameter}", f"{', '.join(shown)}{unit_of(limit.unit)}"


def varied(found: Stability) -> Table:
    """The verdict in each variant."""
    return [
        [one.what, one.verdict, ", ".join(map(said, one.names)) or "-", probability(one.nothing),
         "yes" if one.same else "no"]
        for one in found.outcomes
    ]  # fmt: skip


def penalty(hypothesis: Fit) -> float:
    """What a ``hypothesis`` pays for parameters and sizes away from the middle of their priors, in units of chi^2."""
    return hypothesis.objective - hypothesis.chi2
