"""Model files: one TOML with a bicycle and a table per effect; tyre values may come from a measured tyre."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from bicycle.default_sd import CORNERING_STIFFNESS
from bicycle.effect import WHEELS, Effect, effect_class
from bicycle.files.bicycle_file import checked_bicycle, load_bicycle
from bicycle.model import Model
from bicycle.parameter_key import ParameterKey
from bicycle.parameters import Bicycle, doubts_about
from tyre import TyreMap
from tyre.base import schema
from tyre.base.checks import anything, flag, refused
from tyre.base.errors import InputError, is_number, shown
from tyre.base.notes import Note
from tyre.base.plausible import WAY_OUT, refuse_absurd
from tyre.base.toml_file import read_toml
from tyre.maps.reach import out_of_reach
from tyre.maps.table_io import is_file_name
from tyre.properties import TyreProperties

TYRE_KEYS = ("tyre", "surface", "pressure_bar")
EXTRAPOLATE = "extrapolate"
PASCAL_PER_BAR = 1e5


def _bicycle_given(value: Any) -> Any:
    if not isinstance(value, str | Mapping):
        raise refused(value, "must be a name, a file or a table of parameters")
    return value


MODEL = schema.table(
    {
        schema.needed(
            "bicycle", "the key 'bicycle' is missing: give a packaged bicycle, a file, or a table of parameters"
        ): (_bicycle_given),
        schema.maybe("effects", {}): schema.tables_by_name,
        schema.maybe("description", ""): anything,
        schema.maybe(WAY_OUT, False): flag,
    }
)
MOST_BAR = 20.0  # no bicycle tyre holds more; a pressure in kPa or Pa is caught here


def read_model(path: str | Path) -> Model:
    """Read a model file.

    Raises
    ------
    InputError
        No such file, not TOML, an unknown key, or values that make no bicycle, effect or combination.
    """
    path = Path(path)
    content = read_toml(path, "model file")
    try:
        return build_model(content, folder=path.parent)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def build_model(content: Mapping[str, Any], *, folder: Path = Path()) -> Model:
    """Build a model from the content of a model file; files it names are relative to ``folder``.

    Values far outside their typical range are refused unless the content has ``allow_unusual = true``.
    """
    given = schema.read(MODEL, content)
    allow = given[WAY_OUT]
    bicycle = _bicycle(given["bicycle"], folder, allow_unusual=allow)
    tables = given["effects"]
    effects: list[Effect] = []
    notes: list[str] = []
    sd: dict[str, float] = {}
    assumed: list[str] = []
    for identifier, table in tables.items():
        kind = effect_class(identifier)
        if any(key in table for key in TYRE_KEYS):
            table, found, known, unstated = from_tyre(kind, located(table, folder), bicycle)
            notes += found
            sd |= known
            assumed += unstated
        effects.append(kind(**table))
        if not allow:
            refuse_absurd(effects[-1].doubts().values(), where="model file")
    return Model(bicycle, tuple(effects), tuple(notes), sd, tuple(assumed))


def allows_unusual(content: Mapping[str, Any]) -> bool:
    """Whether a model file lets values pass that are far outside their typical range (``allow_unusual = true``)."""
    return bool(schema.read(flag, content.get(WAY_OUT, False), section=WAY_OUT))


def refuse_absurd_values(model: Model, values: Mapping[str, Iterable[float]]) -> None:
    """Refuse values of a model's parameters, ``effect.name[.wheel]`` or of the bicycle, far outside the typical range.

    Other keys (speed, pressure, load) are left alone.
    """
    declared = {f"{e.identifier}.{p.name}": p for e in model.effects for p in e.parameters}
    for key, given in values.items():
        parameter = declared.get(str(ParameterKey.parse(key).whole))
        numbers = [number for number in given if is_number(number) and number]
        for number in sorted({min(numbers), max(numbers), min(numbers, key=abs)}) if numbers else []:
            if parameter and not parameter.bounds[0] <= number <= parameter.bounds[1]:
                continue  # impossible: the effect says so in its own words
            doubts = [parameter.doubt(key, number)] if parameter else doubts_about({key: number})
            refuse_absurd([found for found in doubts if found], where="model file")


def from_tyre(
    kind: type[Effect], table: Mapping[str, Any], bicycle: Bicycle
) -> tuple[dict[str, Any], list[str], dict[str, float], list[str]]:
    """Replace ``tyre``, ``surface``, ``pressure_bar`` by the tyre's values at the static wheel loads.

    A tyre is the name of a packaged one, or the file of a table such as ``velotyre tyre fit`` writes. Conditions
    farther outside the measured loads or pressures than their range is wide are refused unless ``extrapolate = true``
    stands in the table.

    Returns
    -------
    table : dict
        The table with ``cornering_stiffness`` and, where the effect has it, ``relaxation_length`` per wheel.
    notes : list of str
        What must be told of each wheel's tyre: assumptions, borrowed values, misfit, extrapolation.
    sd : dict
        One standard deviation of each value filled in, by parameter key.
    assumed : list of str
        Those of its keys whose source states none: ``CORNERING_STIFFNESS`` of :mod:`bicycle.default_sd` stands for it.
    """
    if kind.slot != "contact law" or not kind.parameters:
        raise InputError(f"effect {kind.identifier!r} does not take a tyre; only side_slip and relaxation_length do")
    filled = [p.name for p in kind.parameters if p.name in ("cornering_stiffness", "relaxation_length")]
    for name in filled:
        if name in table:
            raise InputError(
                f"effect {kind.identifier!r}: give either tyre, surface and pressure_bar or {name}, not both"
            )
    properties = wheel_tyres(
        tyre=_need(kind, table, "tyre"), surface=table.get("surface"),
        pressure_bar=_need(kind, table, "pressure_bar"), bicycle=bicycle,
        extrapolate=table.get(EXTRAPOLATE, False),
    )  # fmt: skip
    rest = {key: value for key, value in table.items() if key not in (*TYRE_KEYS, EXTRAPOLATE)}
    for name in filled:
        rest[name] = {wheel: getattr(p, name) for wheel, p in properties.items()}
    sd = {f"{kind.identifier}.{n}.{wheel}": getattr(p, f"{n}_sd") for wheel, p in properties.items() for n in filled}
    unstated = [wheel for wheel, p in properties.items() if not p.cornering_stiffness_sd_stated]
    return rest, tyre_notes(properties), sd, [f"{kind.identifier}.cornering_stiffness.{wheel}" for wheel in unstated]


def tyre_notes(properties: Mapping[str, TyreProperties]) -> list[str]:
    """What must be told of each wheel's tyre, once for both wheels where it is the same."""
    inside = all(p.inside for p in properties.values())
    said: dict[tuple[str, str, str], list[str]] = {}
    conditions: dict[str, list[str]] = {}
    for wheel, p in properties.items():
        condition = f"{wheel} {p.load:.0f} N, {p.pressure / PASCAL_PER_BAR:g} bar, {p.origin}"
        conditions.setdefault(f"{p.tyre} on {p.surface}", []).append(condition + ", synthetic" * p.synthetic)
        for note in p.notes:
            said.setdefault((p.tyre, p.surface, note), []).append(condition)
    return [
        Note(f"{subject} ({'; '.join(at)}): {note}", subject, "; ".join(conditions[subject]), inside)
        for (name, surface, note), at in said.items()
        for subject in [f"{name} on {surface}"]
    ]


def located(table: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """The table of a contact law with the files of tyre tables, relative to ``folder``, made absolute."""
    tyre = table.get("tyre")
    if isinstance(tyre, Mapping):
        return dict(table) | {"tyre": {wheel: tyre_file(one, folder) for wheel, one in tyre.items()}}
    return dict(table) | ({"tyre": tyre_file(tyre, folder)} if "tyre" in table else {})


def tyre_file(tyre: Any, folder: Path) -> Any:
    """An absolute path where a tyre is given by the file of its table; else what was given."""
    return (folder / tyre).resolve().as_posix() if isinstance(tyre, str) and is_file_name(tyre) else tyre


def wheel_maps(tyre: Mapping[str, Any], surface: Mapping[str, Any]) -> dict[str, TyreMap]:
    """The measured tyre of each wheel; without a surface, a packaged one is flat and a file has its own.

    Where a table states no standard deviation of the cornering stiffness, the default one is assumed.
    """
    for name, choice in (("tyre", tyre), ("surface", surface)):
        for wheel, value in choice.items():
            if not isinstance(value, str) and not (name == "surface" and value is None):
                raise InputError(f"{name} = {value!r} of the {wheel} wheel must be a name in quotes")
    return {wheel: TyreMap.of(tyre[wheel], surface=surface[wheel]).assuming(CORNERING_STIFFNESS) for wheel in WHEELS}


def wheel_tyres(
    *, tyre: Any, surface: Any, pressure_bar: Any, bicycle: Bicycle, extrapolate: Any = False
) -> dict[str, TyreProperties]:
    """Measured tyre properties at each wheel's static load; every argument is one value or {rear, front}.

    Raises
    ------
    InputError
        A value that is not allowed, or a condition out of reach of the measured ones, unless ``extrapolate`` is True.
    """
    if not isinstance(extrapolate, bool):
        raise InputError(f"{EXTRAPOLATE} = {shown(extrapolate)} must be true or false")
    choices = {}
    for name, value in (("tyre", tyre), ("surface", surface), ("pressure_bar", pressure_bar)):
        per_wheel = value if isinstance(value, Mapping) else dict.fromkeys(WHEELS, value)
        if set(per_wheel) != set(WHEELS):
            raise InputError(f"{name} has the keys {', '.join(map(str, per_wheel))}; give rear and front, or one value")
        choices[name] = per_wheel
    maps = wheel_maps(choices["tyre"], choices["surface"])
    found = {}
    for wheel, load in zip(WHEELS, bicycle.static_loads, strict=True):
        pressure = choices["pressure_bar"][wheel]
        if not is_number(pressure) or not 0 < pressure <= MOST_BAR:
            raise InputError(
                f"pressure_bar = {shown(pressure)} of the {wheel} wheel must be a number above 0 "
                f"and up to {MOST_BAR:g} bar"
            )
        beyond = out_of_reach(maps[wheel], load=load, pressure=pressure * PASCAL_PER_BAR)
        if beyond and not extrapolate:
            raise InputError(
                f"{wheel} wheel: {beyond}; take a bicycle and pressures nearer to the tests, or, if a guess will do, "
                f"{EXTRAPOLATE} = true in the table of the effect (--{EXTRAPOLATE} on the command line)"
            )
        found[wheel] = maps[wheel].at(load=load, pressure=pressure * PASCAL_PER_BAR)
    return found


def _need(kind: type[Effect], table: Mapping[str, Any], key: str) -> Any:
    if key not in table:
        raise InputError(
            f"effect {kind.identifier!r}: {key} is missing; a measured tyre needs tyre and pressure_bar (and surface)"
        )
    return table[key]


def _bicycle(given: Any, folder: Path, *, allow_unusual: bool) -> Bicycle:
    if isinstance(given, Mapping):
        return checked_bicycle("bicycle of the model file", given, where="model file", allow_unusual=allow_unusual)
    return load_bicycle(folder / given if (folder / given).is_file() else given, allow_unusual=allow_unusual)
