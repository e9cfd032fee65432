"""The corrected model of a diagnosis as a model file that every other command reads."""

import tomllib
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from bicycle.effect import Effect
from bicycle.effect.numbers import effect_of
from bicycle.files.model_file import build_model
from bicycle.files.stated_covariance import SECTION
from bicycle.model import DEFAULT_CONTACT, Model
from bicycle.parameter_covariance import ParameterCovariance
from bicycle.parameters import Bicycle
from studies.inference.account import widened
from studies.inference.fit import Fit
from studies.missing_effect.diagnose import Diagnosis
from studies.missing_effect.motion.family import Family
from studies.missing_effect.motion.joint_measurement import JointMeasurement, of_first
from studies.missing_effect.motion.measurements import BicycleMeasurement
from studies.missing_effect.reporting.words import explains
from studies.missing_effect.residual.fitting import Residual
from studies.missing_effect.residual.spread import covariance_of
from tyre.base.errors import InputError
from tyre.base.plausible import WAY_OUT


def corrected_model(diagnosis: Diagnosis, residual: Residual | None = None) -> Model | None:
    """The base model with its parameters adjusted and with what was named; None of a tyre.

    Errors of the measurement have no part in it. The model holds the covariance of all that was fitted, so that what
    follows from it has the uncertainty that the data leave: about the final fit, of effects widened as in the verdict,
    times the misfit where chi^2 is too large (Birge 1932, Phys. Rev. 40). It holds a residual torque, too.

    Parameters
    ----------
    diagnosis : Diagnosis
    residual : Residual, optional
        What could not be named, fitted.

    Raises
    ------
    InputError
        The values make no bicycle, effect or combination.
    """
    measurement = diagnosis.measurement
    if not isinstance(measurement, BicycleMeasurement):
        return None
    if residual is None:
        return _known_so_well(measurement, of_first(_judged(diagnosis)))
    corrected = _with_values(measurement, of_first(residual.fit))
    spread = covariance_of(
        residual.fit, residual.covariance, corrected, dropped=residual.dropped, exact=_exact(measurement)
    )
    return replace(corrected, sd=spread.sd, covariance=spread)


def _judged(diagnosis: Diagnosis) -> Fit:
    """The final fit with the covariance that the verdict tells: effects averaged over their class, times misfit."""
    final = diagnosis.final
    told, fitted = widened(diagnosis.hypotheses, final), final.covariance.diagonal()
    wider = np.sqrt(np.divide(told, fitted, out=np.ones_like(fitted), where=(told > fitted) & (fitted > 0)))
    misfit = max(1.0, final.objective / len(final.residual))
    return replace(final, covariance=misfit * final.covariance * np.outer(wider, wider))


def _known_so_well(measurement: BicycleMeasurement, final: Fit) -> Model:
    """The base model with the values of a ``final`` fit and their covariance, where that is finite."""
    corrected = _with_values(measurement, final)
    spread = covariance_of(final, final.covariance, corrected, exact=_exact(measurement))
    return replace(corrected, sd=spread.sd, covariance=spread) if np.isfinite(spread.matrix).all() else corrected


def _exact(measurement: BicycleMeasurement) -> list[str]:
    """Parameters of the bicycle that the file of a measurement states to be exact."""
    return [key for key, sd in measurement.uncertainty.items() if sd == 0]


def other_models(diagnosis: Diagnosis) -> dict[str, Model]:
    """The same of each further bicycle of a measurement of several, by what it is called.

    What could not be named is kept of the first bicycle alone.

    Parameters
    ----------
    diagnosis : Diagnosis

    Raises
    ------
    InputError
        The values make no bicycle, effect or combination.
    """
    return {name: _known_so_well(part, final) for name, (part, final) in _others(diagnosis).items()}


def _others(diagnosis: Diagnosis) -> dict[str, tuple[BicycleMeasurement, Fit]]:
    measurement = diagnosis.measurement
    if not isinstance(measurement, JointMeasurement):
        return {}
    return measurement.of_others(diagnosis.forward, _judged(diagnosis))


def _with_values(measurement: BicycleMeasurement, final: Fit) -> Model:
    """The base model of ``measurement`` with all values of a ``final`` fit in its names."""
    try:
        model = measurement.with_named(final)
    except InputError as error:
        raise InputError(f"the base model cannot take the values of {explains(final)}: {error}") from error
    floating = final.unknowns[: final.effect_columns.start]
    unknowns = Family(measurement.model, floating, final.candidates)
    values = {key: float(found[0, 0]) for key, found in unknowns.values(np.asarray(final.theta)[None]).items()}
    base = model.bicycle
    bicycle = Bicycle(
        f"{base.name}, corrected", {key: values[key] for key in base.values}, {}, base.description, base.source
    )
    return Model(bicycle, tuple(_at(effect, values) for effect in model.effects))


def model_text(diagnosis: Diagnosis, residual: Residual | None = None) -> str:
    """Text of a model file with the corrected model of a ``diagnosis``; empty of a tyre.

    Parameters
    ----------
    diagnosis : Diagnosis
    residual : Residual, optional
        What could not be named, fitted.

    Raises
    ------
    InputError
        See :func:`corrected_model`.
    """
    model = corrected_model(diagnosis, residual)
    return "" if model is None else _text(diagnosis, model, diagnosis.final, residual)


def why_none(diagnosis: Diagnosis, residual: Residual | None = None) -> str:
    """Why there is no corrected model of a ``diagnosis``, with the value and what to do; empty where there is one.

    Parameters
    ----------
    diagnosis : Diagnosis
    residual : Residual, optional
        What could not be named, fitted.
    """
    try:
        model_text(diagnosis, residual)
    except InputError as error:
        named = [c.identifier for c in diagnosis.final.candidates if c.effect is not None]
        asked = "check the bicycle of the measurement file and what it states of its uncertainty"
        if named:
            one = next((name for name in named if f"'{name}'" in str(error)), named[0])
            asked = f"state what is known of it in [candidates.{one}] of the measurement file, or try --without {one}"
        return f"There is no corrected model: {error}. No bicycle has such values, so do not build on them: {asked}."
    return ""


def other_texts(diagnosis: Diagnosis) -> dict[str, str]:
    """Texts of model files with :func:`other_models`, by what each bicycle is called.

    Parameters
    ----------
    diagnosis : Diagnosis

    Raises
    ------
    InputError
        See :func:`other_models`.
    """
    found = _others(diagnosis).items()
    return {name: _text(diagnosis, _known_so_well(part, final), final) for name, (part, final) in found}


def _text(diagnosis: Diagnosis, model: Model, final: Fit, residual: Residual | None = None) -> str:
    import tomli_w

    name, verdict = diagnosis.measurement.name, diagnosis.verdict.verdict
    what = f"with {explains(final)}" if final.candidates else "nothing added"
    kept = "" if residual is None else f"; {_kept(residual)}"
    content: dict[str, Any] = {
        "description": (
            f"Corrected by velotyre diagnose from {name}: verdict {verdict}, {what}, parameters adjusted{kept}."
        ),
        WAY_OUT: False, "bicycle": dict(model.bicycle.values),
        "effects": {e.identifier: _table(e) for e in model.effects if e.identifier != DEFAULT_CONTACT},
    }  # fmt: skip
    spread = _covariance_text(model.covariance)
    try:
        build_model(content | tomllib.loads(spread))
    except InputError:
        content[WAY_OUT] = True  # far from other bicycles, but what the data say
        build_model(content | tomllib.loads(spread))
    return tomli_w.dumps(content) + spread


def _kept(residual: Residual) -> str:
    """What a reader of the file must know of its residual torque."""
    low, high = residual.scale.ends
    good = "" if residual.describes else ", does not describe the data"
    return (
        "values are those fitted with residual_torque, which may differ from those named; "
        f"residual_torque holds what could not be named: it is no cause{good}, and is extrapolated outside {low:.3g} "
        f"to {high:.3g} m/s, where the report tells critical speeds as intervals"
    )


def _covariance_text(covariance: ParameterCovariance) -> str:
    """The table of a model file, a row of the matrix in a line; empty where nothing is stated."""
    if not covariance.names:
        return ""
    names = ", ".join(f'"{name}"' for name in covariance.names)
    rows = [f"  [{', '.join(format(x, '.10g') for x in row)}]," for row in covariance.matrix.tolist()]
    return "\n".join([f"\n[{SECTION}]", f"parameters = [{names}]", "matrix = [", *rows, "]", ""])


def _at(effect: Effect, values: Mapping[str, float]) -> Effect:
    """The same kind of effect with the numbers of ``values``; what follows the bicycle still does."""
    return effect_of(type(effect), values, [p.name for p in effect.parameters if hasattr(effect, p.name)])


def _table(effect: Effect) -> dict[str, Any]:
    given = {}
    for p in effect.parameters:
        if hasattr(effect, p.name):
            value = getattr(effect, p.name)
            given[p.name] = {"rear": value.rear, "front": value.front} if p.per_wheel else float(value)
    return given
