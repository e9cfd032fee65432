"""A bicycle with Magic Formula tyres at one speed, put together from the linear model with its contacts left open.

With the contacts open (:class:`bicycle.responses.open_contact.OpenContact`) the side forces act as free inputs, and
slip, camber and loads are read off as probes; what the tyre makes of them closes the model again.
"""

from dataclasses import dataclass

import numpy as np

from bicycle.effect import WHEELS, Effect, registry
from bicycle.model import Model
from bicycle.responses.linear import units_of
from bicycle.responses.magic_formula import MagicFormulaModel, MagicTyre
from bicycle.responses.open_contact import LAGS, PROBES, OpenContact, takes_magic_tyres
from tyre.base.arrays import Array
from tyre.base.errors import InputError


@dataclass(frozen=True)
class _OpenModel:
    """x' = A x + P F + B u without a law between slip and side forces F (2,), and what a tyre would see."""

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]  # without side forces
    units: dict[str, str]
    state_matrix: Array  # (n, n)
    force_matrix: Array  # (n, 2)
    input_matrix: Array  # (n, inputs)
    output_matrix: Array  # (outputs, n)
    slip: Array  # (2, n): slip velocity, m/s
    slip_input: Array  # (2, inputs)
    lagged_camber: Array  # (2, n): camber force, N
    direct_camber: Array  # (2, n)
    compliance: Array  # (2,): in series with the tyre, m/N
    loads: Array  # (2,): N


@dataclass(frozen=True)
class _Closing:
    """Effective slip angle (2,) = S x + T u, and the equations of the transient slips, where there are any."""

    slip_matrix: Array  # (2, n) or (2, n + 2)
    slip_input: Array  # (2, inputs)
    lag: Array  # (0, n) or (2, n + 2): rates of the transient slips
    lag_input: Array  # (0, inputs) or (2, inputs)


def magic_formula_model(
    model: Model, *, speed: float, rear: MagicTyre | None = None, front: MagicTyre | None = None
) -> MagicFormulaModel:
    """Put Magic Formula tyres under a model whose contact law is linear in the slip, with or without one lag.

    Parameters
    ----------
    model : Model
        Its contact law has a ``cornering_stiffness`` and, where it provides a ``relaxing contact``, a
        ``relaxation_length``.
    speed : float
        m/s.
    rear, front : MagicTyre, optional
        By default those of :class:`MagicTyre`.

    Returns
    -------
    MagicFormulaModel

    Raises
    ------
    InputError
        Another contact law, a contact with a length, a speed that is not allowed, or a wheel that the drag lifts off.
    """
    law = _law(model)
    stiffness = _of_wheels(model, law, "cornering_stiffness")
    if (stiffness == 0).any():
        raise InputError("nonlinear tyres need a cornering_stiffness > 0 on both wheels")
    if LAGS in law.provides:
        opened = _opened(model, speed)
        closing = _relaxing(opened, speed, stiffness, _of_wheels(model, law, "relaxation_length"))
    else:
        model.linear_model().check_speeds(speed)  # slip without relaxation is singular at rest
        opened = _opened(model, speed)
        closing = _static(opened, speed, stiffness)
    extra = len(closing.lag)
    transient = tuple(f"{wheel}_transient_slip" for wheel in WHEELS)[:extra]
    still = np.zeros((len(opened.states), extra))
    return MagicFormulaModel(
        speed=float(speed),
        states=(*opened.states, *transient),
        inputs=opened.inputs,
        outputs=opened.outputs,
        state_matrix=np.vstack([np.hstack([opened.state_matrix, still]), closing.lag]),
        force_matrix=np.vstack([opened.force_matrix, np.zeros((extra, 2))]),
        slip_matrix=closing.slip_matrix,
        slip_input=closing.slip_input,
        input_matrix=np.vstack([opened.input_matrix, closing.lag_input]),
        output_matrix=np.hstack([opened.output_matrix, np.zeros((len(opened.outputs), extra))]),
        cornering_stiffness=stiffness,
        loads=opened.loads,
        tyres=(rear or MagicTyre(), front or MagicTyre()),
        units={**opened.units, **dict.fromkeys(transient, "rad")},
    )


def _law(model: Model) -> Effect:
    """The contact law of a model that takes Magic Formula tyres."""
    law = next(effect for effect in model.effects if effect.slot == "contact law")
    if not takes_magic_tyres(type(law)):
        laws = sorted(filter(takes_magic_tyres, registry().values()), key=lambda effect: len(effect.parameters))
        raise InputError(
            f"nonlinear tyres need the effect {' or '.join(effect.identifier for effect in laws)}; "
            f"this model rolls with {law.identifier!r}"
        )
    given = {thing for effect in model.effects if effect is not law for thing in effect.provides}
    given |= set(OpenContact.provides)
    for effect in model.effects:
        if set(effect.requires) - given:
            raise InputError(
                f"nonlinear tyres touch the ground at a point; the effect {effect.identifier!r} is linear only: "
                "leave it out"
            )
    return law


def _of_wheels(model: Model, law: Effect, name: str) -> Array:
    return np.array([model.parameters[f"{law.identifier}.{name}.{wheel}"] for wheel in WHEELS])


def _opened(model: Model, speed: float) -> _OpenModel:
    """The model with its contacts open: rows and columns of side forces and probes taken apart from its states."""
    linear = model.with_effect(OpenContact()).linear_model()
    a, b, c = linear.matrices_at(speed)
    forces = [linear.states.index(f"{wheel}_side_force") for wheel in WHEELS]
    probe = {name: [linear.states.index(f"{wheel} {name}") for wheel in WHEELS] for name in PROBES}
    kept = [k for k, name in enumerate(linear.states) if k not in forces and k not in np.ravel(list(probe.values()))]
    outputs = tuple(name for name in linear.outputs if not name.endswith("_side_force"))
    loads = np.array(linear.static_loads) + np.array([1.0, -1.0]) * a[probe["load transfer"], forces]
    if (loads <= 0).any():
        lifted = WHEELS[int(loads.argmin())]
        raise InputError(f"at {speed:g} m/s the drag lifts the {lifted} wheel off the road; ride slower")
    return _OpenModel(
        states=tuple(linear.states[k] for k in kept),
        inputs=linear.inputs,
        outputs=outputs,
        units=dict(units_of(linear)),
        state_matrix=a[np.ix_(kept, kept)],
        force_matrix=a[np.ix_(kept, forces)],
        input_matrix=b[kept],
        output_matrix=c[np.ix_([linear.outputs.index(name) for name in outputs], kept)],
        slip=a[np.ix_(probe["slip velocity"], kept)],
        slip_input=b[probe["slip velocity"]],
        lagged_camber=a[np.ix_(probe["lagged camber force"], kept)],
        direct_camber=a[np.ix_(probe["direct camber force"], kept)],
        compliance=a[probe["series compliance"], forces],
        loads=loads,
    )


def _static(opened: _OpenModel, speed: float, stiffness: Array) -> _Closing:
    """Side force of the slip angle and camber of the moment."""
    camber = (opened.direct_camber + opened.lagged_camber) / stiffness[:, None]
    none = np.zeros((0, len(opened.states))), np.zeros((0, len(opened.inputs)))
    return _Closing(camber - opened.slip / speed, -opened.slip_input / speed, *none)


def _relaxing(opened: _OpenModel, speed: float, stiffness: Array, length: Array) -> _Closing:
    """Side force of a transient slip that follows slip and lagged camber over the relaxation length, as a state."""
    whole = (length + stiffness * opened.compliance)[:, None]
    lagged = opened.lagged_camber / stiffness[:, None]
    lag = np.hstack([(speed * lagged - opened.slip) / whole, np.diag(-speed / whole[:, 0])])
    seen = np.hstack([opened.direct_camber / stiffness[:, None], np.eye(2)])
    return _Closing(seen, np.zeros_like(opened.slip_input), lag, -opened.slip_input / whole)
