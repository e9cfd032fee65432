"""What an uncertain result hangs on: its variance by groups of measurements, what is assumed, what counts as exact."""

from collections.abc import Mapping

import numpy as np

from bicycle.default_sd import ASSUMED, EXACT
from bicycle.parameter_key import ParameterKey
from bicycle.parameters import UNITS
from studies.uncertainty.uncertain_model import UncertainModel
from tyre.base.arrays import Array

MASS_CENTRES = ("xB", "zB", "xH", "zH")
AT_CONDITIONS = "where it was measured; its source states no uncertainty, elsewhere the misfit of the table counts"
INERTIAL = ("kg", "kg m^2")


def group_of(measurement: str) -> str:
    """Group of a ``measurement``: a stiffness of the tyre, a kind of parameter of the bicycle, or the effect's name."""
    key = measurement.split(", ")[0]
    if key not in UNITS and "." in key:
        return ParameterKey.parse(key).effect
    if key not in UNITS:
        return measurement  # of the tyre
    if key in MASS_CENTRES:
        return "mass centres"
    return "masses and inertias" if UNITS[key] in INERTIAL else "bicycle geometry"


def by_group(shares: Mapping[str, float]) -> dict[str, float]:
    """Shares of the linear variance by group, from ``shares`` by measurement."""
    found: dict[str, float] = {}
    for measurement, share in shares.items():
        found[group_of(measurement)] = found.get(group_of(measurement), 0.0) + share
    return found


def by_origin(model: UncertainModel, shares: Mapping[str, float]) -> dict[str, float]:
    """Shares of the linear variance by where standard deviations come from, from ``shares`` by measurement."""
    found: dict[str, float] = {}
    for measurement, share in shares.items():
        found[model.origin(measurement)] = found.get(model.origin(measurement), 0.0) + share
    return found


def known_exactly(model: UncertainModel, measurement: str, gradient: Array) -> dict[str, float]:
    """Of numbers known together: how much of a result's linear variance goes where one of them is known exactly.

    That is the squared correlation of the number and the result. Numbers that are correlated tell of each other, so
    these shares overlap and need not add up to one.

    Parameters
    ----------
    model : UncertainModel
    measurement : str
        One of ``model.measurements``.
    gradient : ndarray, shape (names,)
        Of the result, over the standard normal numbers of the model.

    Returns
    -------
    dict
        Share (0 to 1) by parameter, the largest first.
    """
    rows = {key: model.jacobian[key] for key in model.measurements[measurement] if key in model.jacobian}
    total = gradient @ gradient
    found = {
        key: float((row @ gradient) ** 2 / (row @ row) / total) for key, row in rows.items() if row.any() and total
    }
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def counted_as_exact(model: UncertainModel) -> dict[str, str]:
    """Parameters of the equations that have no standard deviation -> why not."""
    entering = model.nominal.evaluator.symbolic.parameters
    found = {key: d.why for key, d in model.deviations.items() if d.origin == EXACT and key in entering}
    return found | dict.fromkeys(model.unstated_stiffnesses, AT_CONDITIONS)


def assumed(model: UncertainModel) -> dict[str, float]:
    """Standard deviations (SI) that no source states, by parameter."""
    entering = model.nominal.evaluator.symbolic.parameters
    return {key: d.sd for key, d in model.deviations.items() if d.origin == ASSUMED and key in entering}


def exact_words(model: UncertainModel) -> str:
    """Say what is counted as exact, by reason; empty where nothing is."""
    reasons: dict[str, list[str]] = {}
    for key, why in counted_as_exact(model).items():
        reasons.setdefault(why, []).append(key)
    return (
        "counted as exact: " + "; ".join(f"{', '.join(keys)} ({why})" for why, keys in reasons.items())
        if reasons
        else ""
    )


def assumed_words(model: UncertainModel) -> str:
    """Say what is assumed; empty where nothing is."""
    values = model.nominal.parameters
    said = [f"{key} {values[key]:.4g} ± {_plain(sd)}" for key, sd in assumed(model).items()]
    return f"assumed, as no source states it (one standard deviation, SI): {', '.join(said)}" if said else ""


def _plain(sd: float) -> str:
    """Two digits, never as a power of ten."""
    return np.format_float_positional(sd, precision=2, fractional=False, trim="-")
