"""Read a measurement file: what was measured, on which bicycle, and how well that bicycle is known.

kind = "modal"                      # or "histories", "canonical"; "rig" is of a tyre, see `rig_recordings`
bicycle = "kooijman2008"            # a name, a file, or a table of parameters
[effects.NAME]                      # what the base model contains, as in a model file
[uncertainty]                       # 1-sigma of bicycle and effect parameters, 0 fixes one
[candidates.NAME]                   # what is known of a candidate: it is not fitted
[modal]
table = "weave.csv"
[histories]                         # or this: drop_first_s, [[histories.runs]], [histories.noise_sd]
[canonical]                         # or this: table, speeds_m_s, band_hz
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bicycle.effect import effect_class
from bicycle.files.model_file import build_model
from bicycle.identification.recording import read_runs
from bicycle.model import Model
from studies.missing_effect.interface import Measurement
from studies.missing_effect.motion.candidates import check_known
from studies.missing_effect.motion.canonical_table import read_canonical
from studies.missing_effect.motion.measurements import CanonicalMeasurement, HistoryMeasurement, ModalMeasurement
from studies.missing_effect.motion.modal_table import read_modal
from studies.missing_effect.motion.nuisances import nuisances
from studies.missing_effect.packaged import packaged_measurement
from studies.missing_effect.rig.measurement import read_rig
from studies.missing_effect.rig.tables_forward import read_tyre_tables
from tyre.base.errors import InputError, shown, unknown
from tyre.base.plausible import WAY_OUT
from tyre.base.toml_file import read_toml

KINDS = ("modal", "histories", "canonical")
EVERY_KIND = (*KINDS, "rig", "tyre_tables")
MODEL_KEYS = ("bicycle", "effects", WAY_OUT)
TOP_KEYS = ("kind", "description", "source", *MODEL_KEYS, "uncertainty", "candidates", *KINDS)


def read_measurement(path: str | Path) -> Measurement:
    """Read the file at ``path`` and the tables it names; a packaged one is given by its name.

    Raises
    ------
    InputError
        Anything missing, unknown, out of range or not finite, with file, row or key and the remedy.
    """
    with packaged_measurement(path) as file:
        return _read(file)


def _read(path: Path) -> Measurement:
    content = read_toml(path, "measurement file")
    try:
        return _measurement(content, path)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _measurement(content: Mapping[str, Any], path: Path) -> Measurement:
    for key in ("description", "source"):
        if not isinstance(content.get(key, ""), str):
            raise InputError(f"{key} = {shown(content[key])} must be words in quotes")
    if content.get("kind") == "rig":
        return read_rig(content, path)
    if content.get("kind") == "tyre_tables":
        return read_tyre_tables(content, path)
    for key in content:
        if key not in TOP_KEYS:
            raise InputError(unknown("key", key, TOP_KEYS))
    kind = content.get("kind")
    if kind not in KINDS:
        raise InputError(f"kind = {kind!r} is not allowed; write one of {', '.join(map(repr, EVERY_KIND))}")
    for other in KINDS:
        if (other in content) != (other == kind):
            needed = f"the table [{kind}] is missing" if other == kind else f"the table [{other}] does not belong here"
            raise InputError(f"kind is {kind!r} but {needed}")
    model = build_model({k: content[k] for k in MODEL_KEYS if k in content}, folder=path.parent)
    common: dict[str, Any] = {
        "name": path.stem, "model": model, "uncertainty": _uncertainty(_table(content, "uncertainty")),
        "known": _known(_table(content, "candidates"), model),
        "description": content.get("description", ""), "source": content.get("source", ""),
    }  # fmt: skip
    nuisances(model, common["uncertainty"])  # complains here, where the file is known
    if kind == "modal":
        points, notes = read_modal(_table(content, "modal"), path.parent)
        return ModalMeasurement(**common, points=points, notes=notes)
    if kind == "canonical":
        coefficients, notes = read_canonical(_table(content, "canonical"), path.parent)
        return CanonicalMeasurement(**common, coefficients=coefficients, notes=notes)
    runs, noise, notes = read_runs(_table(content, "histories"), path.parent)
    return HistoryMeasurement(**common, runs=runs, noise_sd=noise, notes=notes)


def _table(content: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    table = content.get(key, {})
    if not isinstance(table, Mapping):
        raise InputError(f"{key} = {table!r} must be a table: write [{key}] and the keys below it")
    return table


def _uncertainty(table: Mapping[str, Any], prefix: str = "") -> dict[str, float]:
    flat: dict[str, float] = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            flat |= _uncertainty(value, f"{prefix}{key}.")
        else:
            flat[prefix + key] = value
    return flat


def _known(table: Mapping[str, Any], model: Model) -> dict[str, Mapping[str, Any]]:
    present = [effect.identifier for effect in model.effects]
    for identifier, parameters in table.items():
        names = [p.name for p in effect_class(identifier).parameters]
        if identifier in present:
            raise InputError(f"[candidates.{identifier}]: the base model contains it already; take one of them out")
        if not isinstance(parameters, Mapping):
            raise InputError(f"[candidates] holds tables: write [candidates.{identifier}] and parameters below it")
        for name in parameters:
            if name not in names:
                raise InputError(f"[candidates.{identifier}]: {unknown('parameter', name, names)}")
        check_known(effect_class(identifier), parameters)
    return dict(table)
