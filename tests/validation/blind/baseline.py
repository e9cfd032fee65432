"""The baseline of the blind test: sparse regression of the torque that the stated model leaves over.

As in SINDy (Brunton, Proctor & Kutz 2016, PNAS 113): the measured channels are differentiated, the torques on lean and
steer that the stated bicycle (rolling without slip, two equations) leaves over are regressed on a library of terms, and
terms that contribute little are dropped, one after the other. The torque of the terms that survive is compared with
that of the change which each known effect makes to the same terms; the closest gives the name.

Limits: noise is differentiated; tyres, a flexible front and a rider who sways have states of their own, so they have no
entry in the table and cannot be named; stated uncertainties of the bicycle are not used, so it knows no ``partial``.
"""

import csv
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import savgol_filter

from bicycle import load_bicycle
from tests.validation.blind.closing import canonical
from tests.validation.blind.machine import Coefficients, Extras, coefficients
from tyre.arrays import Array

WINDOW, DEGREE = 21, 3  # samples and degree of the smoothing polynomial that is differentiated
TERMS = (
    "lean acceleration", "steer acceleration", "lean rate", "steer rate", "v lean rate", "v steer rate", "lean",
    "steer", "v^2 steer",
)  # fmt: skip
LEAST = 0.05
"""Share of the base model's own torque (root mean square) below which a term is dropped."""
ALIKE = 0.8
"""Cosine between the torque of the terms found and that of an effect, from which on it is named."""
TIED = 0.02
"""Effects whose cosines differ by less are a class."""
RIDGE = 0.02
"""Of the regression, with terms scaled to 1: the terms are nearly dependent."""
TERM = 0.2
"""Share of the largest term below which another is dropped."""


def known_changes(values: Mapping[str, float]) -> dict[str, Array]:
    """The table: effect -> change of the terms' coefficients (2, terms), at a usual size, for Meijaard's ``values``."""
    plain = terms_of(coefficients(values, {}))
    changed = {
        "steer_damper": coefficients(values, {"steer_damper": {"damping": 1.0}}),
        "steer_spring": coefficients(values, {"steer_spring": {"stiffness": 3.0}}),
        "pneumatic_trail": coefficients(values, {"pneumatic_trail": {"trail": 0.02}}),
        "crown_radius": coefficients(values, {"crown_radius": {"crown_radius": 0.02}}),
        "twisting_torque": coefficients(values, {"twisting_torque": {"twisting_stiffness": 1.5}}),
        "luggage_rear": coefficients(values, {}, Extras(rack=5.0)),
        "luggage_bar": coefficients(values, {}, Extras(bar=5.0)),
    }
    return {name: terms_of(c) - plain for name, c in changed.items()}


def terms_of(c: Coefficients) -> Array:
    """Coefficients (2, terms) of :data:`TERMS` in the equations of lean and steer, of small motion ``c``."""
    mass, damping, stiffness = canonical(c, 0.0)
    _, fast, stiff = canonical(c, 1.0)
    columns = [*mass.T, *damping.T, *(fast - damping).T, *stiffness.T, (stiff - stiffness)[:, 1]]
    return np.array(columns).T


def baseline(folder: Path, without: tuple[str, ...] = ()) -> dict[str, Any]:
    """Answer for the measurement in a ``folder``, in the keys of a verdict; effects ``without`` which it has to do."""
    content = tomllib.loads((folder / "MEASUREMENT.toml").read_text(encoding="utf-8"))
    values = load_bicycle(content["bicycle"]).values
    own = terms_of(coefficients(values, {}))
    columns, torque, scale = (_modal if content["kind"] == "modal" else _histories)(folder, content, own)
    found = np.zeros_like(own)
    for equation in (0, 1):
        if len(torque[equation]):
            found[equation] = sparse(columns[equation], torque[equation], LEAST * scale[equation])
    table = {name: change for name, change in known_changes(values).items() if name not in without}
    names = _names(found, columns, scale, table)
    verdict = "none" if not found.any() else ("unknown", "named", "class")[min(len(names), 2)]
    return {"verdict": verdict, "class": names, "effects": [], "held_out_gap": {"nominal": None, "final": None}}


def sparse(columns: Array, torque: Array, least: float) -> Array:
    """Sequentially thresholded ridge regression: coefficients (terms,), zero where dropped."""
    size = np.sqrt(np.mean(columns**2, axis=0))
    kept = size > 0
    found = np.zeros(columns.shape[1])
    while kept.any():
        found[:] = 0.0
        unit = columns[:, kept] / size[kept]
        grip = unit.T @ unit / len(unit) + RIDGE * np.eye(unit.shape[1])
        found[kept] = np.linalg.solve(grip, unit.T @ torque / len(unit)) / size[kept]
        share = np.where(kept, np.abs(found) * size, np.inf)
        if share.min() >= max(least, TERM * share[kept].max()):
            break
        found[np.argmin(share)], kept[np.argmin(share)] = 0.0, False
    return found


def _names(
    found: Array, columns: tuple[Array, Array], scale: tuple[float, float], table: Mapping[str, Array]
) -> list[str]:
    """Effects whose torque has the course of that which was found, both equations over their scales."""

    def torque(terms: Array) -> Array:
        return np.concatenate([columns[k] @ terms[k] / scale[k] for k in (0, 1)])

    seen, alike = torque(found), {}
    for name, change in table.items():
        own = torque(change)
        alike[name] = float(seen @ own) / max(float(np.linalg.norm(seen)) * float(np.linalg.norm(own)), 1e-300)
    best = max(alike.values())
    return sorted((name for name, c in alike.items() if c >= max(ALIKE, best - TIED)), key=lambda n: -alike[n])


Parts = tuple[tuple[Array, Array], tuple[Array, Array], tuple[float, float]]


def _histories(folder: Path, content: Mapping[str, Any], own: Array) -> Parts:
    """Terms and torques left over at every sample; constants of each run are taken out (lean is integrated)."""
    columns, left, torques = [], [], []
    for run in content["histories"]["runs"]:
        with (folder / run["file"]).open(encoding="utf-8") as file:
            table = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
        time, rate, steer = (np.array([row[k] for row in table]) for k in ("time_s", "roll_rate_rad_s", "steer_rad"))
        step, v = time[1] - time[0], run["speed_m_s"]
        smooth = {"window_length": WINDOW, "polyorder": DEGREE, "delta": step}
        p, dp = savgol_filter(rate, deriv=0, **smooth), savgol_filter(rate, deriv=1, **smooth)
        s, ds, dds = (savgol_filter(steer, deriv=k, **smooth) for k in (0, 1, 2))
        lean = np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2) * step])
        terms = np.array([dp, dds, p, ds, v * p, v * ds, lean, s, v * v * s]).T
        pull = np.array([row.get("steer_torque_N_m", 0.0) for row in table])
        whole = [term - term.mean(axis=0) for term in (terms[WINDOW:-WINDOW], pull[WINDOW:-WINDOW])]
        columns.append(whole[0])
        left.append(-whole[0] @ own.T + np.array([np.zeros(len(whole[1])), whole[1]]).T)
        torques.append(whole[0][:, None, :] * own)
    terms, over, own_torque = np.concatenate(columns), np.concatenate(left), np.concatenate(torques)
    scale = np.sqrt(np.mean(own_torque**2, axis=0)).max(axis=1)
    return (terms, terms), (over[:, 0], over[:, 1]), (float(scale[0]), float(scale[1]))


def _modal(folder: Path, content: Mapping[str, Any], own: Array) -> Parts:
    """Real and imaginary parts of the torques over lean, from eigenvalues and measured steer over lean."""
    columns, shaped = [], True
    with (folder / content["modal"]["table"]).open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        z, v = complex(float(row["real_1_s"]), float(row["imag_rad_s"])), float(row["speed_m_s"])
        lean, turn = np.array([z * z, 0, z, 0, v * z, 0, 1, 0, 0]), np.array([0, z * z, 0, z, 0, v * z, 0, 1, v * v])
        if "steer_over_lean_re" in row:
            shape = complex(float(row["steer_over_lean_re"]), float(row["steer_over_lean_im"]))
        else:
            shape, shaped = -(own[0] @ lean) / (own[0] @ turn), False
        terms = (lean + shape * turn) / np.sqrt(1 + abs(shape) ** 2)
        columns += [terms.real, terms.imag]
    terms = np.array(columns)
    left = -terms @ own.T
    scale = np.sqrt(np.mean((terms[:, None, :] * own) ** 2, axis=0)).max(axis=1)
    nothing = np.zeros((0, len(TERMS)))
    return (
        (terms if shaped else nothing, terms),
        (left[:, 0] if shaped else np.zeros(0), left[:, 1]),
        (float(scale[0]), float(scale[1])),
    )
