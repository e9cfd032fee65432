"""What floats in every fit of rig recordings, and which rig effects may be missing from the base model.

The effects are those of :mod:`tyre.rig.effects`, each with its own term of the fit; none is listed here.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from studies.inference.parameter import Candidate, UncertainParameter
from studies.missing_effect.rig.data import PullReadings, SweepBlocks
from studies.missing_effect.rig.reference import Curve
from tyre.base.errors import InputError, refuse_unknown
from tyre.estimate import Calibration
from tyre.rig.regression import Recorded, RigParameter, Term, needs_pull, needs_sweep

PEAK_SD, SHAPE_SD, CURVATURE_SD = 0.1, 0.15, 0.5  # of the curve: 4 deg of slip do not tell them one by one
DRIFT = 3.0  # N over a recording
ZERO, SLIP_ZERO = 1.0, 1e-4  # N and rad, of the force cell and of the slip-angle sensor
BEND = 0.02  # relative departure of a pull from a straight line at its largest displacement
LOAD = 0.005  # relative error of the load


def rig_nuisances(
    sweeps: Sequence[SweepBlocks], pulls: Sequence[PullReadings], curves: Mapping[str, Curve], c: Calibration
) -> tuple[UncertainParameter, ...]:
    """Tyre parameters with the reference's uncertainty, scatter of one recording, drifts, certified calibration.

    Parameters
    ----------
    sweeps, pulls : sequences
        The reduced recordings.
    curves : mapping of str to Curve
        The reference by the label of a condition.
    c : Calibration
    """
    unknowns = []

    def add(key: str, scale: float, unit: str = "1") -> None:
        if scale > 0:
            unknowns.append(UncertainParameter(key, unit, {key: 1.0}, 0.0, scale))

    for label in dict.fromkeys(s.label for s in sweeps):
        value, sd = curves[label].cornering_stiffness or (1.0, 0.0)
        add(f"cornering stiffness, {label}", sd / value)
        add(f"peak, {label}", PEAK_SD)
    for label in dict.fromkeys(p.label for p in pulls):
        value, sd = curves[label].lateral_stiffness or (1.0, 0.0)
        add(f"lateral stiffness, {label}", sd / value)
    if sweeps:
        add("shape", SHAPE_SD)
        add("curvature", CURVATURE_SD)
        add("load gain", LOAD)
        add("slip gain", c.slip)
        add("slip zero", SLIP_ZERO, "rad")
    add("force gain", c.force)
    for s in sweeps:
        add(f"repeatability, {s.name}", c.repeatability)
        add(f"drift, {s.name}", DRIFT, "N")
        add(f"zero, {s.name}", ZERO, "N")
    for p in pulls:
        add(f"repeatability, {p.name}", c.repeatability)
        add(f"drift, {p.name}", DRIFT, "N")
        add(f"zero, {p.name}", ZERO, "N")
        add(f"bend, {p.name}", BEND)
    if pulls:
        add("displacement gain", c.displacement)
    return tuple(unknowns)


def rig_candidates(terms: Sequence[Term], recorded: Recorded) -> tuple[tuple[Candidate, ...], dict[str, str]]:
    """Rig effects that may be missing, and why others cannot be tried.

    Parameters
    ----------
    terms : sequence of Term
        All that are known.
    recorded : Recorded
        What the recordings have.
    """
    refused = {term.identifier: why for term in terms if (why := term.needs(recorded))}
    candidates = (
        Candidate(
            term.identifier, tuple(unknown_of(term, p, recorded) for p in term.parameters), signature=term.signature
        )
        for term in terms
        if term.identifier not in refused
    )
    return tuple(candidates), refused


def unknown_of(term: Term, p: RigParameter, recorded: Recorded) -> UncertainParameter:
    """The unknown of a parameter of a term, with the prior that its declaration gives.

    A size is normal about zero, the upper end of its typical range being two sigma; another one is normal in the
    logarithm, its typical range being +-2 sigma. One that the reference knows has that prior, and is no size.

    Parameters
    ----------
    term : Term
    p : RigParameter
        One of its own.
    recorded : Recorded
    """
    sets, (low, high) = {term.key(p): 1.0}, p.typical
    if p.name in recorded.known:
        value, sd = recorded.known[p.name]
        return UncertainParameter(p.name, p.unit, sets, value, sd, p.bounds[0])
    if p.size:
        return UncertainParameter(
            p.name, p.unit, sets, 0.0, 0.5 * max(abs(low), abs(high)), *p.bounds, size=True, least=p.least
        )
    return UncertainParameter(p.name, p.unit, sets, 0.5 * math.log(low * high), math.log(high / low) / 4, power=0)


def chosen(
    candidates: tuple[Candidate, ...],
    refused: Mapping[str, str],
    includes: Sequence[str],
    without: Sequence[str],
    also: Sequence[str] = (),
) -> tuple[tuple[Candidate, ...], tuple[UncertainParameter, ...]]:
    """Candidates that are tried, and the unknowns of those that the base model includes.

    Parameters
    ----------
    candidates : tuple of Candidate
        All that the recordings can show.
    refused : mapping
        Why they cannot show the others.
    includes, without, also : sequence of str
        Effects of the base model, effects that are not tried, and effects of which only the name is checked.

    Raises
    ------
    InputError
        An effect that does not exist or that these recordings cannot show.
    """
    can = {c.identifier: c for c in candidates}
    known = {*can, *refused}
    for what, names in (("[rig]: includes", includes), ("--without", without), ("--with", also)):
        refuse_unknown("rig effect", names, known, where=what)
    for name in includes:
        if name in refused:
            raise InputError(f"[rig]: includes {name!r}, but: {refused[name]}; take it out")
    gone = {*includes, *without}
    unknowns = tuple(u for name in includes for u in can[name].unknowns)
    return tuple(c for c in candidates if c.identifier not in gone), unknowns


def _asymmetry(terms: Any, *, gain: Any) -> None:  # functions of a module, not lambdas: workers get them by name
    terms.add(asymmetry=gain)


def _bend(terms: Any, **share: Any) -> None:
    terms.add(bend=next(iter(share.values())))


FROM_SLIP_SQUARED = Term(
    "side force from slip squared", "side force that grows with slip squared",
    (RigParameter("gain", "N/rad^2", (-4000.0, 4000.0)),),
    sweep=_asymmetry, needs=needs_sweep,
)  # fmt: skip
SOFTENING = Term(
    "pull force bends", "pull force that falls behind with displacement",
    (RigParameter("share at the end", "1", (-0.2, 0.2)),),
    pull=_bend, needs=needs_pull,
)  # fmt: skip
PHENOMENOLOGICAL = (FROM_SLIP_SQUARED, SOFTENING)
"""Terms without a cause."""
