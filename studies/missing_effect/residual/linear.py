"""The fit of a residual torque, linearised: all terms as columns, those that were not chosen too."""

import numpy as np

from studies.inference.fit import Fit, prior
from studies.inference.forward import Forward
from studies.missing_effect.residual.selection import Linear
from studies.missing_effect.residual.terms import PAIRS, SpeedScale, candidate


def linearised(forward: Forward, about: Fit, scale: SpeedScale) -> Linear:
    """The problem linearised about a fit, with all terms.

    Parameters
    ----------
    forward : Forward
    about : Fit
    scale : SpeedScale

    Returns
    -------
    Linear
        Columns: what floats beside the torque, then all terms in the order of :func:`.keys`.
    """
    named = tuple(c for c in about.candidates if not is_torque(c.identifier))
    joined = (*named, candidate(dict.fromkeys(PAIRS, scale.most), scale))
    first = first_of(about)
    known = dict(zip((u.name for u in about.unknowns[first:]), about.theta[first:], strict=True))
    theta = np.concatenate([about.theta[:first], [known.get(u.name, 0.0) for u in joined[-1].unknowns]])
    residual, jacobian = forward.residual(joined, theta)
    unknowns = (*about.unknowns[:first], *joined[-1].unknowns)
    centre, sd = prior(unknowns, joined, 1.0)
    scaled = jacobian * sd
    return Linear(scaled, scaled @ ((theta - centre) / sd) - residual, forward.rows.fold)


def first_of(found: Fit) -> int:
    """Number of coordinates of a fit before those of its residual torque.

    Parameters
    ----------
    found : Fit
    """
    own = [c for c in found.candidates if is_torque(c.identifier)]
    return found.columns(own[0]).start if own else len(found.theta)


def is_torque(identifier: str) -> bool:
    """Whether a candidate is a residual torque, by its ``identifier``.

    Parameters
    ----------
    identifier : str
    """
    return identifier.startswith("residual torque (")
