"""A case of the main study as a model: bicycle, tyre, and what is beside the tyre in a world."""

from collections.abc import Mapping, Sequence
from typing import Any

from bicycle.effect import WHEELS, effect_class
from bicycle.linear_model import LinearModel
from bicycle.model import Model
from bicycle.parameter_key import ParameterKey
from bicycle.parameters import UNITS, bodies, static_loads
from studies.main_study.cases import CONTACT
from studies.main_study.settings import CONTACT_LENGTH, Settings, Setup
from tyre.base.arrays import Array

CAMBER = tuple(f"camber_thrust.camber_stiffness.{wheel}" for wheel in WHEELS)
FRICTION = "steer_damper"


def model(settings: Settings, setup: Setup, contact: Sequence[float] | Array) -> Model:
    """A bicycle on tyres with the four numbers of ``contact`` (N/rad and m, rear then front)."""
    effects = {**beside(settings, setup), **contact_law(setup, contact)}
    return Model(settings.bicycle, tuple(effect_class(name)(**table) for name, table in effects.items()))


def build(settings: Settings, setup: Setup, contact: Sequence[float] | Array) -> LinearModel:
    """The linear model of :func:`model`; ``contact`` (4,) as there."""
    return model(settings, setup, contact).linear_model()


def contact_law(setup: Setup, contact: Sequence[float] | Array) -> dict[str, dict[str, Any]]:
    """The tyre as a table of a model file; ``contact`` (4,) in the order of :data:`CONTACT`, N/rad and m."""
    rear_stiffness, rear_length, front_stiffness, front_length = (float(value) for value in contact)
    table: dict[str, Any] = {
        "cornering_stiffness": {"rear": rear_stiffness, "front": front_stiffness},
        "relaxation_length": {"rear": rear_length, "front": front_length},
    }
    return {ParameterKey.parse(CONTACT[0]).effect: table}


def beside(settings: Settings, setup: Setup) -> dict[str, dict[str, Any]]:
    """The effects beside the tyre, as tables of a model file; what the user gave comes before what is assumed."""
    p, front, arms = settings.bicycle.values, setup.front, setup.arms
    rear_camber, front_camber = camber_stiffness(setup, p)
    tables: dict[str, dict[str, Any]] = {
        "camber_thrust": {"camber_stiffness": {"rear": float(rear_camber), "front": float(front_camber)}}
    }
    tables |= {name: dict(table) for name, table in settings.further.items()}
    if arms:
        tables["rider_arms"] = {"inertia": arms.inertia, "stiffness": arms.stiffness, "damping": arms.damping}
    if front:
        tables["front_compliance"] = {
            "stiffness": front.stiffness, "damping": front.damping,
            "joint_x": float(front.hinge_x(p)), "joint_z": -front.joint_height,
        } | ({} if front.axis_tilt is None else {"axis_tilt": front.axis_tilt})  # fmt: skip
        own = settings.further.get(FRICTION, {})
        default = next(one.default for one in effect_class(FRICTION).parameters if one.name == "damping")
        given = float(own.get("damping", default)) if FRICTION in settings.further else 0.0
        tables[FRICTION] = {**own, "damping": given + front.friction}
    if setup.contact_half_length:
        tables[CONTACT_LENGTH] = {"half_length": dict(zip(WHEELS, setup.contact_half_length, strict=True))}
    return tables


def camber_stiffness(setup: Setup, p: Mapping[str, Any]) -> tuple[Any, Any]:
    """Camber stiffness (N/rad) of rear and front wheel on the loads of a parameter set ``p`` (Meijaard's keys, SI)."""
    rear, front = static_loads(bodies(p), p["w"], p["g"])
    return setup.camber_share * rear, setup.camber_share * front


def content(settings: Settings, setup: Setup, tyre: Mapping[str, Any]) -> dict[str, Any]:
    """A case as the content of a model file, with ``tyre`` as the table of its contact law."""
    law = ParameterKey.parse(CONTACT[0]).effect
    return {
        "bicycle": {key: settings.bicycle[key] for key in UNITS},
        "effects": {law: dict(tyre), **beside(settings, setup)},
    }


def follow(settings: Settings, setup: Setup, p: Mapping[str, Any]) -> dict[str, Any]:
    """What hangs on the bicycle ``p`` (Meijaard's keys): assumed camber thrust on the loads, an assumed hinge."""
    found: dict[str, Any] = {}
    if "camber_thrust" not in settings.further:
        found |= dict(zip(CAMBER, camber_stiffness(setup, p), strict=True))
    if setup.front and setup.front.joint_x is None:
        found["front_compliance.joint_x"] = setup.front.hinge_x(p)
    return found
