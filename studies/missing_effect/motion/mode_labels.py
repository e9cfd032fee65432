"""Whether rows of a modal table lie on another mode of the base model than the one they are called."""

from collections.abc import Sequence

import numpy as np

from bicycle.modal.named_modes import modes
from bicycle.model import Model
from studies.missing_effect.motion.modal_table import ModalPoint

CLEAR = 5.0  # times nearer to the other mode than to the one that is named, in every row


def misnamed(points: Sequence[ModalPoint], model: Model) -> tuple[str, ...]:
    """Notes on names of modes that the base model contradicts: each row is fitted by the root that it lies nearest to.

    Parameters
    ----------
    points : sequence of ModalPoint
        Those with settings of their own are passed over.
    model : Model
        The base model.

    Returns
    -------
    tuple of str
    """
    notes = []
    for name in dict.fromkeys(point.mode for point in points):
        rows = sorted((p for p in points if p.mode == name and not p.settings), key=lambda p: p.speed)
        speeds = sorted({p.speed for p in rows})
        if len(speeds) < 2:
            continue
        found = modes(model.linear_model(), speeds)
        roots = np.array([p.eigenvalue for p in rows])
        at = np.searchsorted(speeds, [p.speed for p in rows])
        away = {other: np.nan_to_num(abs(found.branch(other)[at, 0] - roots), nan=np.inf) for other in found.names}
        named = away.pop(name, np.full(len(rows), np.inf))
        for other, distance in away.items():
            if (CLEAR * distance < named).all():
                lies = f"{named.min():.3g} 1/s or more" if np.isfinite(named).all() else "not there"
                notes.append(
                    f"every row called {name} lies on the {other} of the base model (up to {distance.max():.3g} 1/s "
                    f"away; its {name}: {lies}) and is compared with that root; if the name is wrong, correct it"
                )
                break
    return tuple(notes)
