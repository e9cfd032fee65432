"""The corrected model of a diagnosis as a model file that every other command reads."""

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bicycle.effects.effect import Effect, effect_of
from bicycle.model.default_sd import MODEL_FILE
from bicycle.model.model import DEFAULT_CONTACT, Model
from bicycle.model.model_file import SECTION, build_model
from bicycle.parameters.bicycle import UNUSED, Bicycle
from bicycle.parameters.parameter_covariance import ParameterCovariance
from bicycle.parameters.possible_inertia import fitting_moments
from studies.diagnosis.correction import correction
from studies.diagnosis.diagnose import Diagnosis
from studies.diagnosis.family import WRONG, Family
from studies.diagnosis.labels import render, said
from studies.diagnosis.residual import EFFECT, Residual
from studies.inference import Fit
from studies.inference.parameter import slopes_of
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.measured.plausible import WAY_OUT


@dataclass(frozen=True)
class Corrected:
    """Texts of the corrected models by bicycle ("" is the one at the top); none of a tyre."""

    texts: Mapping[str, str]  # bicycle -> model file, TOML
    error: str = ""  # why there are none; "" if there are
    of_others: str = ""  # why there are none of the other bicycles; "" if there are, or no others


def corrected(diagnosis: Diagnosis, residual: Residual | None = None) -> Corrected:
    """Model files of all bicycles of one ``diagnosis``; a ``residual`` torque acts on the first bicycle alone."""
    first, *other_names = list(diagnosis.kind.bicycles(diagnosis.final)) or [""]
    try:
        text = model_text(diagnosis, residual)
        texts = {first: text} if text else {}
    except InputError as error:
        return Corrected({}, str(error))
    try:
        models = corrected_models(diagnosis, residual, other_names) if other_names else {}
        return Corrected(texts | {name: _text(diagnosis, model, residual, name) for name, model in models.items()})
    except InputError as error:
        return Corrected(texts, of_others=str(error))


def model_text(diagnosis: Diagnosis, residual: Residual | None = None) -> str:
    """Text of a model file with the corrected model of the bicycle at the top; empty of a tyre."""
    model = corrected_model(diagnosis, residual)
    return "" if model is None else _text(diagnosis, model, residual, "")


def corrected_model(diagnosis: Diagnosis, residual: Residual | None = None) -> Model | None:
    """The base model of the bicycle at the top with its parameters adjusted and with what was named; None of a tyre."""
    return corrected_models(diagnosis, residual, [""]).get("")


def corrected_models(
    diagnosis: Diagnosis, residual: Residual | None = None, names: Iterable[str] | None = None
) -> dict[str, Model]:
    """The corrected models of all bicycles, or of those with these ``names``."""
    models = {}
    for name, (kind, _) in diagnosis.kind.bicycles(diagnosis.final).items():
        if names is not None and name not in names:
            continue
        changes = correction(diagnosis, residual, name)
        fit = changes.fit
        try:
            model = kind.corrected_model(fit)
        except InputError as error:
            raise InputError(f"the base model cannot take the values of {said(fit.name)}: {error}") from error
        model = with_values(model, kind.model, fit)
        exact = [key for key, sd in kind.uncertainty.items() if sd == 0]  # known exactly, as the file states
        dropped = changes.torque.dropped if changes.torque else ()
        spread = covariance_of(fit, changes.covariance, model, dropped=dropped, exact=exact)
        if np.isfinite(spread.matrix).all():
            model = replace(model, sd=spread.sd, covariance=spread)
        models[name] = model
    return models


def with_values(named: Model, base: Model, final: Fit) -> Model:
    """The ``named`` model with all values of a ``final`` fit; what follows the bicycle in an effect still does."""
    unknowns = Family(base, final.nuisances, final.candidates)
    values = {key: float(column[0, 0]) for key, column in unknowns.values(np.asarray(final.theta)[None]).items()}
    old = named.bicycle
    followed = fitting_moments({key: values[key] for key in old.values})
    notes = tuple(
        f"{key}, which no motion shows, is {inertia:.4g} kg m^2 for {old[key]:.4g}, the nearest that a body with the "
        "adjusted inertias has"
        for key, inertia in followed.items()
    )
    values |= followed
    bicycle = Bicycle(
        f"{old.name}, corrected", {key: values[key] for key in old.values}, {}, old.description, old.source, notes
    )
    effects = tuple(effect_of(type(effect), values, _own_numbers(effect, named.tied)) for effect in named.effects)
    return Model(bicycle, effects)


def _own_numbers(effect: Effect, tied: Mapping[str, str]) -> list[str]:
    """Names of the parameters of an ``effect`` that do not follow the bicycle."""
    keys = {p.name: [f"{effect.identifier}.{entry}" for entry in p.entries()] for p in effect.parameters}
    return [name for name, entries in keys.items() if not all(key in tied for key in entries)]


def covariance_of(
    fit: Fit, covariance: Array, model: Model, *, dropped: Sequence[str] = (), exact: Iterable[str] = ()
) -> ParameterCovariance:
    """Covariance of the parameters of a corrected ``model``, SI."""
    rows: dict[str, Array] = {}
    size, count = len(covariance), len(fit.theta)
    for u, slope in zip(fit.unknowns, slopes_of(fit.unknowns, fit.theta), strict=True):
        for key, factor in u.sets.items():
            row = rows.setdefault(key.removeprefix(WRONG), np.zeros(size))
            row[:count] += factor * slope
    for candidate in fit.candidates:
        rows |= {key: rows[source] for key, source in candidate.ties.items() if source in rows}
    for column, name in enumerate(dropped, count):
        rows[f"{EFFECT}.{name}"] = np.eye(size)[column]
    fixed = (*exact, *(f"{EFFECT}.{name}" for name in ("middle_speed", "speed_span")))
    rows |= {key: np.zeros(size) for key in fixed if key not in rows}
    independent = {key for key in model.parameters if key not in model.tied and key not in UNUSED}
    names = tuple(key for key in rows if key in independent)
    slopes = np.array([rows[key] for key in names]).reshape(len(names), size)
    matrix = slopes @ covariance @ slopes.T
    return ParameterCovariance(names, (matrix + matrix.T) / 2, origin=MODEL_FILE)


def _text(diagnosis: Diagnosis, model: Model, residual: Residual | None, bicycle: str) -> str:
    """Text (TOML) of the file of one corrected ``model``: description, bicycle, effects and covariance."""
    import tomli_w

    changes = correction(diagnosis, residual, bicycle)
    about = render("model_description.txt.j2", d=diagnosis, c=changes, notes=model.bicycle.notes)
    content: dict[str, Any] = {
        "description": about,
        WAY_OUT: False,
        "bicycle": model.bicycle.table,
        "effects": {e.identifier: e.table for e in model.effects if e.identifier != DEFAULT_CONTACT},
    }
    names, matrix = model.covariance.names, model.covariance.matrix.tolist()
    rows = [f"  [{', '.join(format(x, '.10g') for x in row)}]," for row in matrix]  # a row of the matrix in a line
    listed = ", ".join(f'"{name}"' for name in names)
    spread = "\n".join([f"\n[{SECTION}]", f"parameters = [{listed}]", "matrix = [", *rows, "]", ""]) if names else ""
    try:
        build_model(content | tomllib.loads(spread))
    except InputError:
        content[WAY_OUT] = True  # far from other bicycles, but what the data say
        build_model(content | tomllib.loads(spread))
    return tomli_w.dumps(content) + spread
