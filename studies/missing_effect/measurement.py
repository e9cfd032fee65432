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
from studies.missing_effect.rig.measurement import NO_RIG, read_rig
from studies.missing_effect.rig.tables_forward import NO_TABLES, read_tyre_tables
from tyre.base.checks import any_table, anything, text
from tyre.base.errors import InputError
from tyre.base.plausible import WAY_OUT
from tyre.base.schema import Table, by_name, maybe, needed, read, table
from tyre.base.toml_file import read_toml

KINDS = ("modal", "histories", "canonical")
EVERY_KIND = (*KINDS, "rig", "tyre_tables")
MODEL_KEYS = ("bicycle", "effects", WAY_OUT)
KIND = f"is not allowed; write one of {', '.join(map(repr, EVERY_KIND))}"
WORDS = text("must be words in quotes")


def _top(own: Mapping[Any, Any]) -> Table:
    common = {
        needed("kind", f"kind = None {KIND}"): text(KIND, allowed=EVERY_KIND),
        maybe("description", ""): WORDS, maybe("source", ""): WORDS,
    }  # fmt: skip
    return table(common | dict(own))


MOTION = _top(
    dict.fromkeys(map(maybe, MODEL_KEYS), anything)
    | {maybe("uncertainty", {}): any_table, maybe("candidates", {}): any_table}
    | dict.fromkeys(map(maybe, KINDS), any_table)
)
TOP_KEYS = MOTION.keys
OF_A_TYRE = {
    "rig": _top({needed("rig", NO_RIG): anything}),
    "tyre_tables": _top({needed("tyre_tables", NO_TABLES): anything}),
}


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
    given = read(OF_A_TYRE.get(str(content.get("kind")), MOTION), content)
    kind = given["kind"]
    words = {"name": path.stem, "description": given["description"], "source": given["source"]}
    if kind == "rig":
        return read_rig(given["rig"], path.parent, **words)
    if kind == "tyre_tables":
        return read_tyre_tables(given["tyre_tables"], path.parent, **words)
    for other in KINDS:
        if (other in given) != (other == kind):
            fault = f"the table [{kind}] is missing" if other == kind else f"the table [{other}] does not belong here"
            raise InputError(f"kind is {kind!r} but {fault}")
    model = build_model({k: given[k] for k in MODEL_KEYS if k in given}, folder=path.parent)
    common: dict[str, Any] = words | {
        "model": model, "uncertainty": _uncertainty(given["uncertainty"]), "known": _known(given["candidates"], model),
    }  # fmt: skip
    nuisances(model, common["uncertainty"])  # complains here, where the file is known
    if kind == "modal":
        points, notes = read_modal(given["modal"], path.parent, model, common["uncertainty"])
        common["uncertainty"] |= {key: 0.0 for key, _ in points[0].settings}
        return ModalMeasurement(**common, points=points, notes=notes)
    if kind == "canonical":
        coefficients, notes = read_canonical(given["canonical"], path.parent)
        return CanonicalMeasurement(**common, coefficients=coefficients, notes=notes)
    runs, noise, notes = read_runs(given["histories"], path.parent)
    return HistoryMeasurement(**common, runs=runs, noise_sd=noise, notes=notes)


def _uncertainty(table: Mapping[str, Any], prefix: str = "") -> dict[str, float]:
    flat: dict[str, float] = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            flat |= _uncertainty(value, f"{prefix}{key}.")
        else:
            flat[prefix + key] = value
    return flat


def _known(candidates: Mapping[str, Any], model: Model) -> dict[str, Mapping[str, Any]]:
    present = [effect.identifier for effect in model.effects]
    for identifier, parameters in candidates.items():
        names = [p.name for p in effect_class(identifier).parameters]
        if identifier in present:
            raise InputError(f"[candidates.{identifier}]: the base model contains it already; take one of them out")
        read(by_name(anything, names, kind="parameter"), parameters, section=f"candidates.{identifier}")
        check_known(effect_class(identifier), parameters)
    return dict(candidates)
