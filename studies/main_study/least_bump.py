"""Smallest bump at the handlebar from which wobble grows against the dry friction of the steering."""

import numpy as np
from scipy.optimize import brentq

from bicycle.effects.effect_registry import effect_class
from bicycle.model.model import Model
from bicycle.model.model_family import ModelFamily
from studies.main_study.result import FRICTION, Span, nearest_root

MOST_DAMPING = 100.0  # N m s/rad, beyond any damper; wobble that it does not stop needs no bump


def least_bump(model: Model, span: Span, dry_friction: float) -> float | None:
    """Find the smallest steer amplitude (rad) that grows, at the speed of the fastest growth of a ``span``.

    A torque of dry friction T takes from an oscillation of amplitude A and angular frequency omega the energy of a
    damper 4 T / (pi omega A) (describing function; Gelb & Vander Velde 1968). The smaller the motion, the more it
    damps. The smallest amplitude is the one at which this damper just stops the growth; None if no damper stops it.

    Parameters
    ----------
    model : Model
        A bicycle whose wobble grows.
    span : Span
        The speeds at which it grows.
    dry_friction : float
        Torque of dry friction about the steer axis, N m.
    """
    speed = span.fastest_at
    if FRICTION not in {effect.identifier for effect in model.effects}:
        model = Model(model.bicycle, (*model.effects, effect_class(FRICTION)(damping=0.0)))
    family, viscous = ModelFamily(model), model.parameters[f"{FRICTION}.damping"]

    def root_near(damper: float, root: complex) -> complex:
        damping = {f"{FRICTION}.damping": viscous + damper}
        return nearest_root(family.linear_model(model.parameters | damping), speed, root)

    # The root is followed to the least damper that stops it: more may lock the steering and let another motion grow.
    root, weaker = span.eigenvalue, 0.0
    for damper in np.geomspace(1e-2, MOST_DAMPING, 60):
        after = root_near(damper, root)
        if after.real <= 0:
            break
        root, weaker = after, damper
    else:
        return None
    enough = float(brentq(lambda extra: root_near(extra, root).real, weaker, damper, xtol=1e-9))
    return float(4 * dry_friction / (np.pi * root_near(enough, root).imag * enough))
