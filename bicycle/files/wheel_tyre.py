"""Tables of a model file filled in from the measured tyre: values, what must be told of them, their covariance."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bicycle.effect import WHEELS, Effect
from bicycle.parameter_covariance import ParameterCovariance
from tyre.base.notes import Note
from tyre.maps.joint import QUANTITIES, JointProperties
from tyre.maps.tables import PASCAL_PER_BAR
from tyre.properties import TyreProperties


@dataclass(frozen=True)
class FilledTable:
    """The table of an effect with values of the measured tyre.

    Attributes
    ----------
    table : dict
        Parameters as the effect takes them.
    notes : tuple of str
        What must be told of the values.
    covariance : ParameterCovariance
        Of the values filled in.
    assumed : tuple of str
        Those of its names whose source states no standard deviation.
    """

    table: dict[str, Any]
    notes: tuple[str, ...]
    covariance: ParameterCovariance
    assumed: tuple[str, ...] = ()


def filled_names(kind: type[Effect]) -> list[str]:
    """Parameters of a contact law that a measured tyre gives.

    Parameters
    ----------
    kind : type of Effect
    """
    return [p.name for p in kind.parameters if p.name in ("cornering_stiffness", "relaxation_length")]


def contact_law_table(kind: type[Effect], rest: Mapping[str, Any], tyres: JointProperties) -> FilledTable:
    """The table of a contact law with cornering stiffness and, where it has one, relaxation length of each wheel.

    Parameters
    ----------
    kind : type of Effect
        A contact law.
    rest : mapping
        What its table says beside the tyre.
    tyres : JointProperties
        Of rear and front wheel.
    """
    filled = filled_names(kind)
    by_wheel = dict(zip(WHEELS, tyres.properties, strict=True))
    table = dict(rest) | {name: {wheel: getattr(p, name) for wheel, p in by_wheel.items()} for name in filled}
    names = [f"{kind.identifier}.{name}.{wheel}" for wheel in WHEELS for name in filled]
    places = [3 * row + QUANTITIES.index(name) for row in range(len(WHEELS)) for name in filled]
    chosen = np.ix_(places, places)
    covariance = ParameterCovariance(
        tuple(names), tyres.covariance[chosen], tuple(part[chosen] for part in tyres.joint.variance_spread or ())
    )
    unstated = [wheel for wheel, p in by_wheel.items() if not p.cornering_stiffness_sd_stated]
    assumed = tuple(f"{kind.identifier}.cornering_stiffness.{wheel}" for wheel in unstated)
    return FilledTable(table, tuple(tyre_notes(by_wheel)), covariance, assumed)


def offered_table(kind: type[Effect], table: Mapping[str, Any], tyres: JointProperties) -> FilledTable:
    """The table of another effect with what the measured tyre knows of it and the table does not give.

    Parameters
    ----------
    kind : type of Effect
    table : mapping
        Of the effect in the model file.
    tyres : JointProperties
        Of rear and front wheel.
    """
    filled, notes, covariance = dict(table), [], ParameterCovariance()
    for name, source, values in _offers(kind, tyres):
        if name in table:
            continue
        filled[name] = dict(zip(WHEELS, values, strict=True))
        if source == "pneumatic_trail" and tyres.trails is not None:
            keys = tuple(f"{kind.identifier}.{name}.{wheel}" for wheel in WHEELS)
            spread = ParameterCovariance(keys, tyres.trails.covariance, tyres.trails.variance_spread)
            covariance = covariance.and_also(spread)
        notes.append(_about(tyres, f"{kind.identifier}.{name} is that measured with the tyre, {_words(values)}"))
    return FilledTable(filled, tuple(notes), covariance)


def unused_offers(kind: type[Effect], tyres: JointProperties) -> list[str]:
    """Notes on what the measured tyre knows of an effect that the model does not have.

    Parameters
    ----------
    kind : type of Effect
    tyres : JointProperties
        Of rear and front wheel.
    """
    return [
        _about(tyres, f"{name} for the effect {kind.identifier} was measured too, {_words(values)}, but is not used; "
                      f"[effects.{kind.identifier}] takes it")
        for name, _, values in _offers(kind, tyres)
    ]  # fmt: skip


def tyre_notes(properties: Mapping[str, TyreProperties]) -> list[str]:
    """What must be told of each wheel's tyre, once for both wheels where it is the same.

    Parameters
    ----------
    properties : mapping
        Of each wheel by its name.
    """
    inside = all(p.inside for p in properties.values())
    said: dict[tuple[str, str], list[str]] = {}
    headlines = _headlines(properties)
    for wheel, p in properties.items():
        for note in p.notes:
            said.setdefault((_subject(p), note), []).append(_condition(wheel, p))
    return [
        Note(f"{subject} ({'; '.join(at)}): {note}", subject, headlines[subject], inside)
        for (subject, note), at in said.items()
    ]


def _subject(p: TyreProperties) -> str:
    return f"{p.tyre} on {p.surface}"


def _condition(wheel: str, p: TyreProperties) -> str:
    return f"{wheel} {p.load:.0f} N, {p.pressure / PASCAL_PER_BAR:g} bar, {p.origin}"


def _headlines(properties: Mapping[str, TyreProperties]) -> dict[str, str]:
    """The conditions of the wheels by tyre."""
    found: dict[str, list[str]] = {}
    for wheel, p in properties.items():
        found.setdefault(_subject(p), []).append(_condition(wheel, p) + ", synthetic" * p.synthetic)
    return {subject: "; ".join(conditions) for subject, conditions in found.items()}


def _offers(kind: type[Effect], tyres: JointProperties) -> list[tuple[str, str, list[float]]]:
    """Parameters of an effect that the tyres of both wheels know: name, field of the properties, value per wheel."""
    offers = []
    for parameter in kind.parameters:
        if parameter.tyre_property:
            values = [getattr(p, parameter.tyre_property) for p in tyres.properties]
            if None not in values:
                offers.append((parameter.name, parameter.tyre_property, values))
    return offers


def _words(values: list[float]) -> str:
    return ", ".join(f"{wheel} {value:.4g}" for wheel, value in zip(WHEELS, values, strict=True)) + " (SI)"


def _about(tyres: JointProperties, text: str) -> Note:
    headlines = _headlines(dict(zip(WHEELS, tyres.properties, strict=True)))
    subject = " / ".join(headlines)
    inside = all(p.inside for p in tyres.properties)
    return Note(f"{subject}: {text}", subject, "; ".join(headlines.values()), inside)
