"""Read a measurement file: what was measured, on which bicycle, and how well that bicycle is known.

kind = "modal"                      # or another of KINDS; "rig" is of a tyre, see `rig_recordings`
bicycle = "kooijman2008"            # a name, a file, or a table of parameters
[effects.NAME]                      # what the base model contains, as in a model file
[uncertainty]                       # 1-sigma of bicycle and effect parameters, 0 fixes one
[candidates.NAME]                   # what is known of a candidate: it is not fitted
[modal]
table = "weave.csv"
[histories]                         # or this: drop_first_s, [[histories.runs]], [histories.noise_sd]
[canonical]                         # or this: table, speeds_m_s, band_hz
[frequency_response]                # or this: table
[bench]                             # or this: table
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from bicycle.effect import effect_class, registry
from bicycle.files.model_file import build_model
from bicycle.model import Model
from studies.inference.joint import OF
from studies.missing_effect.interface import Measurement
from studies.missing_effect.kinds import KINDS, READERS, TABLES
from studies.missing_effect.motion.candidates import check_known
from studies.missing_effect.motion.joint_measurement import JointMeasurement
from studies.missing_effect.motion.measurements import BicycleMeasurement
from studies.missing_effect.motion.nuisances import nuisances
from studies.missing_effect.packaged import packaged_measurement
from studies.missing_effect.rig.measurement import NO_RIG, read_rig
from studies.missing_effect.rig.tables_forward import NO_TABLES, read_tyre_tables
from tyre.base.checks import any_table, anything, flag, list_of, refused, text
from tyre.base.errors import InputError, refuse_unknown
from tyre.base.plausible import WAY_OUT
from tyre.base.schema import Table, by_name, maybe, needed, read, table
from tyre.base.toml_file import read_toml

EVERY_KIND = (*KINDS, "joint", "rig", "tyre_tables")
MARKS = (OF, ".", "+")  # between a part and its sensors, an effect and its parameter, two effects
OWN_BICYCLE = ("bicycle", "effects", WAY_OUT, "uncertainty")
MODEL_KEYS = ("bicycle", "effects", WAY_OUT)
KIND = f"is not allowed; write one of {', '.join(map(repr, EVERY_KIND))}"
WORDS = text("must be words in quotes")
PARTS = "write [[part]] with name, kind and the table of that kind, two or more"
PART_KIND = f"is not allowed in [[part]]; write one of {', '.join(map(repr, TABLES))}"


def _name(value: Any) -> str:
    if not isinstance(value, str) or not value.strip() or any(mark in value for mark in MARKS):
        raise refused(value, f"must be a name in quotes without {', '.join(map(repr, MARKS))}, which join names")
    return value


PART = table(
    {
        needed("name", f"a part without a name; {PARTS}"): _name,
        needed("kind", f"a part without a kind; {PARTS}"): text(PART_KIND, allowed=TABLES),
    }
    | {maybe("bicycle"): anything, maybe("effects"): any_table, maybe(WAY_OUT): flag, maybe("uncertainty"): any_table}
    | dict.fromkeys(map(maybe, dict.fromkeys(TABLES.values())), any_table)
)


def _top(own: Mapping[Any, Any]) -> Table:
    common = {
        needed("kind", f"kind = None {KIND}"): text(KIND, allowed=EVERY_KIND),
        maybe("description", ""): WORDS, maybe("source", ""): WORDS,
    }  # fmt: skip
    return table(common | dict(own))


MOTION = _top(
    dict.fromkeys(map(maybe, MODEL_KEYS), anything)
    | {maybe("uncertainty", {}): any_table, maybe("candidates", {}): any_table}
    | dict.fromkeys(map(maybe, dict.fromkeys(TABLES.values())), any_table)
    | {maybe("part"): list_of(any_table, f"must be tables: {PARTS}", least=1)}
    | {maybe("common"): list_of(text("must be an effect in quotes"), "must be a list of effects", least=1)}
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
    if (kind == "joint") != ("part" in given):
        raise InputError(
            f"kind is {kind!r} but "
            + (f"there is no part: {PARTS}" if kind == "joint" else "[[part]] belongs to kind = 'joint'")
        )
    if kind == "joint" and len(given["part"]) < 2:
        raise InputError(
            f"there is one [[part]] only: {PARTS}; of one set of data, write its kind at the top and its table without "
            '"part."'
        )
    if kind == "joint" and (stray := [name for name in dict.fromkeys(TABLES.values()) if name in given]):
        raise InputError(f"kind is 'joint' but there is a table [{stray[0]}] at the top; write it as [part.{stray[0]}]")
    model = build_model({k: given[k] for k in MODEL_KEYS if k in given}, folder=path.parent)
    common: dict[str, Any] = words | {
        "model": model, "uncertainty": _uncertainty(given["uncertainty"]), "known": _known(given["candidates"], model),
    }  # fmt: skip
    nuisances(model, common["uncertainty"])  # complains here, where the file is known
    if kind != "joint":
        return _of_kind(kind, given, path.parent, common)
    parts, bicycles = _parts(given, path.parent, common)
    if "common" in given:
        if not bicycles:
            raise InputError("common: all parts are of one bicycle, which shares everything; take it out")
        refuse_unknown("effect", given["common"], registry(), where="common")
    return JointMeasurement(**common, parts=parts, bicycles=bicycles, common=tuple(given.get("common", ())))


def _parts(
    whole: Mapping[str, Any], folder: Path, common: Mapping[str, Any]
) -> tuple[tuple[tuple[str, BicycleMeasurement], ...], dict[str, str]]:
    """The parts by name, and of which bicycle those are that have one of their own."""
    found: dict[str, BicycleMeasurement] = {}
    bicycles: dict[str, str] = {}
    tables: Sequence[Mapping[str, Any]] = whole["part"]
    for number, content in enumerate(tables, 1):
        part = read(PART, content, section=f"part {number}")
        name = part["name"]
        if name in found:
            raise InputError(f"[[part]]: {name!r} is given twice; give each part a name of its own")
        try:
            given = common if "bicycle" not in part else _other_bicycle(part, whole, folder, common)
            extra = [key for key in OWN_BICYCLE if key in part]
            if extra and "bicycle" not in part:
                raise InputError(f"{extra[0]} belongs to a bicycle; give the part a bicycle, or write it at the top")
            found[name] = _of_kind(part["kind"], part, folder, given)
        except InputError as error:
            raise InputError(f"part {name!r}: {error}") from error
        if "bicycle" in part:
            own = Path(part["bicycle"]).stem if isinstance(part["bicycle"], str) else f"bicycle of {name}"
            bicycles[name] = own.translate(dict.fromkeys(map(ord, MARKS), "_"))
    if len(bicycles) == len(found):
        raise InputError("every [[part]] has a bicycle of its own; one at least must be of the bicycle at the top")
    taken = set(bicycles.values()) & set(found)
    if taken:
        raise InputError(f"[[part]]: {taken.pop()!r} is the name of a part and of a bicycle; call the part otherwise")
    return tuple(found.items()), bicycles


def _other_bicycle(
    part: Mapping[str, Any], whole: Mapping[str, Any], folder: Path, common: Mapping[str, Any]
) -> dict[str, Any]:
    """What is common to the whole, but for the bicycle: its effects are those at the top unless the part has them."""
    if part["bicycle"] == whole.get("bicycle"):
        raise InputError("bicycle is the one at the top; leave it out")
    effects = {**whole.get("effects", {}), **part.get("effects", {})}
    content = {"bicycle": part["bicycle"], "effects": effects}
    model = build_model(content | {k: part[k] for k in (WAY_OUT,) if k in part}, folder=folder)
    of_effects = {key: sd for key, sd in common["uncertainty"].items() if "." in key}
    uncertainty = of_effects | _uncertainty(part.get("uncertainty", {}))
    nuisances(model, uncertainty)
    return {**common, "model": model, "uncertainty": uncertainty}


def _of_kind(kind: str, given: Mapping[str, Any], folder: Path, common: Mapping[str, Any]) -> BicycleMeasurement:
    """A measurement of one kind, from the table of that name."""
    own = TABLES[kind]
    for other in dict.fromkeys(TABLES.values()):
        if (other in given) != (other == own):
            fault = f"the table [{own}] is missing" if other == own else f"the table [{other}] does not belong here"
            raise InputError(f"kind is {kind!r} but {fault}")
    return READERS[kind](given[own], folder, common)


def _uncertainty(table: Mapping[str, Any], prefix: str = "") -> dict[str, float]:
    flat: dict[str, float] = {}
    for key, value in table.items():
        if isinstance(value, Mapping) and not value:
            raise InputError(
                f"[uncertainty.{prefix}{key}] is empty; write the 1-sigma of its parameters or take it out"
            )
        if isinstance(value, Mapping):
            flat |= _uncertainty(value, f"{prefix}{key}.")
        else:
            flat[prefix + key] = value
    return flat


def _known(candidates: Mapping[str, Any], model: Model) -> dict[str, Mapping[str, Any]]:
    present = [effect.identifier for effect in model.effects]
    for identifier, parameters in candidates.items():
        try:
            names = [p.name for p in effect_class(identifier).parameters]
        except InputError as error:
            raise InputError(f"[candidates.{identifier}]: {error}") from error
        if identifier in present:
            raise InputError(f"[candidates.{identifier}]: the base model contains it already; take one of them out")
        read(by_name(anything, names, kind="parameter"), parameters, section=f"candidates.{identifier}")
        check_known(effect_class(identifier), parameters)
    return dict(candidates)
