"""Bicycles as files: TOML, flat text or YAML as neighbouring projects write them, and tables of many."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from bicycle.parameters import TYPICAL, UNITS, UNUSED, Bicycle, doubts_about
from tyre.errors import InputError, is_number, refuse_unknown, shown, unknown
from tyre.files import data_root, read_toml
from tyre.measured_number import MeasuredNumber, key_value_lines, measured_number, written
from tyre.plausible import WAY_OUT, Doubt, refuse_absurd
from tyre.sheet import ENDINGS, Sheet, read_sheet, split_unit
from tyre.units import factor_to_si, is_unit

LEFT_OUT = {"v": "", "yB": "", "yH": "", "IRzz": "IRxx", "IFzz": "IFxx"}  # key -> the key whose value it must have
KEYS = (*UNITS, *UNUSED)
WORDS = ("description", "source")
GROUPS = {"length": "m", "angle": "rad", "mass": "kg", "inertia": "kg m^2"}
"""Names under which a file states the unit of all parameters of one sort."""

NOT_USED = {
    "v": "{where}: the speed v = {number:g} m/s is not a property of the bicycle and is not used",
    "yB": "{where}: {key} = {number:g} is not used: the bicycle is taken as symmetric",
    "IRzz": "{where}: {key} = {number:g} is not used: a wheel is symmetric about its axle, so {twin} is taken",
}
NOT_USED |= {"yH": NOT_USED["yB"], "IFzz": NOT_USED["IRzz"]}
NAME_THE_UNIT = "write its unit behind the number (lam = 18.3 deg; TOML: in quotes) or in a table units (TOML, YAML)"


def si_unit(key: str) -> str:
    """The SI unit of a ``key`` of a bicycle file, also of one that is left out."""
    return "m/s" if key == "v" else "m" if key in ("yB", "yH") else UNITS.get(key, "kg m^2")


@dataclass
class GivenNumbers:
    """Content of a file: numbers, one :meth:`add` each, in its order, and the words beside them."""

    # unit of what is written without one, by key or by a name of :data:`GROUPS`; else SI
    units: Mapping[str, str] = field(default_factory=dict)
    values: dict[str, Any] = field(default_factory=dict)  # SI, lam in rad
    sd: dict[str, Any] = field(default_factory=dict)  # SI, lam in rad
    notes: list[str] = field(default_factory=list)  # what is not used
    words: dict[str, str] = field(default_factory=dict)  # ``description``, ``source``
    allow_unusual: bool = False  # the file lets values pass that are far from those of other bicycles
    _left_out: dict[str, tuple[str, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        refuse_unknown("key of units:", self.units, [*KEYS, *GROUPS])
        for key, unit in self.units.items():
            if not isinstance(unit, str):
                raise InputError(f'units: {key} = {shown(unit)} must be a unit in quotes, such as "mm"')
            factor_to_si(unit, GROUPS.get(key) or si_unit(key), where=f"units: {key}")

    def add(self, key: str, value: Any, *, where: str, unit: str = "") -> None:
        """Add the value of a parameter."""
        if key in self.values or key in self._left_out:
            raise InputError(f"{where}: {key} is given twice; keep one")
        if key not in KEYS and key not in LEFT_OUT:
            raise InputError(f"{where}: {unknown('key', key, KEYS)}")
        number = self._number(key, value, where, unit)
        if key in LEFT_OUT:
            self._left_out[key] = (where, number.value)
            return
        self.values[key] = number.value
        if number.sd is not None:
            self.sd[key] = number.sd

    def add_sd(self, key: str, value: Any, *, where: str, unit: str = "") -> None:
        """Add a standard deviation that stands by itself."""
        if key in self.sd:
            raise InputError(f"{where}: the standard deviation of {key} is given twice; keep one")
        if key in LEFT_OUT:
            return
        refuse_unknown("key", [key], KEYS, where=f"{where}: standard deviation")
        number = self._number(key, value, where, unit)
        if number.sd is not None:
            raise InputError(
                f"{where}: the standard deviation of {key} = {value!r} has one of its own; give one number"
            )
        self.sd[key] = number.value

    def add_word(self, key: str, text: str, where: str) -> None:
        """Add a text of :data:`WORDS`, or the flag that lets unusual values pass."""
        if key != WAY_OUT:
            self.words[key] = text
        elif text.strip() not in ("true", "false"):
            raise InputError(f"{where}: {WAY_OUT} = {text.strip()!r} must be true or false")
        else:
            self.allow_unusual = text.strip() == "true"

    def bicycle(self, name: str, kind: str, *, place: str = "", allow_unusual: bool = False) -> Bicycle:
        """The bicycle of a ``kind`` of file; ``place`` begins an error."""
        notes = list(self.notes)
        for key, (where, number) in self._left_out.items():
            twin = LEFT_OUT[key]
            if key == "v" or number != self.values.get(twin, 0.0):  # else symmetry gives its value
                notes.append(NOT_USED[key].format(where=where, key=key, number=number, twin=twin))
        try:
            if not (allow_unusual or self.allow_unusual):
                _refuse_other_units(self.values, self.sd, kind)
            return _named_cause(name, self, tuple(notes))
        except InputError as error:
            raise InputError(f"{place}: {error}" if place else str(error)) from error

    def _number(self, key: str, value: Any, where: str, unit: str) -> MeasuredNumber:
        si = si_unit(key)
        unit = unit or self.units.get(key) or next((u for n, u in self.units.items() if GROUPS.get(n) == si), si)
        if isinstance(value, str):
            return measured_number(value, where=where, key=key, si=si, unit=unit)
        if unit == si or not is_number(value) or value - value != 0:
            return MeasuredNumber(value)  # the bicycle itself refuses what is no finite number
        return MeasuredNumber(float(Fraction(float(value)) * factor_to_si(unit, si, where=where)))


def _named_cause(name: str, given: GivenNumbers, notes: tuple[str, ...]) -> Bicycle:
    """The bicycle; a centre of mass in cm is a wheel without load, so an error names the unusual number too."""
    try:
        return Bicycle(
            name, given.values, given.sd, given.words.get("description", ""), given.words.get("source", ""), notes
        )
    except InputError as error:
        doubts = [one for one in doubts_about(given.values) if one.explained]
        causes = [one.text for one in doubts if f"{one.key} = " not in str(error)]
        raise InputError("; ".join([str(error), *causes[:1], *([NAME_THE_UNIT] if doubts else [])])) from error


def _refuse_other_units(values: Mapping[str, Any], sd: Mapping[str, Any], kind: str) -> None:
    """Refuse numbers that are surely in other units: several lengths that are usual in one, large deviations."""
    doubts: list[Doubt] = doubts_about(values)
    way_out = f"or write {WAY_OUT} = true at the top of the {kind} if it is meant so"
    lengths = [one for one in doubts if UNITS[one.key] == "m"]
    for word, unit, metres in (("millimetres", "mm", 1e-3), ("centimetres", "cm", 1e-2), ("inches", "in", 0.0254)):
        usual = [TYPICAL[one.key][0] <= metres * values[one.key] <= TYPICAL[one.key][1] for one in lengths]
        if len(usual) >= 3 and all(usual):  # fewer are a slip of one of them
            raise InputError(
                f'{lengths[0].outside} ({word}?); give it in SI units, write length = "{unit}" in a table units (TOML, '
                f"YAML), as {len(lengths)} lengths look like {word}, {way_out}"
            )
    refuse_absurd(doubts, where=kind, remedy=NAME_THE_UNIT)
    for key, spread in sd.items():
        low, high = TYPICAL.get(key, (0.0, float("inf")))
        if is_number(spread) and spread > high - low:
            guess = {"m": " (millimetres?)", "rad": " (degrees?)", "kg": " (grams?)"}.get(UNITS[key], "")
            raise InputError(
                f"the standard deviation of {key} is {spread:g} {UNITS[key]}, more than its usual values {low:g} .. "
                f"{high:g} {UNITS[key]} differ{guess}; {NAME_THE_UNIT}, {way_out}"
            )


def read_flat_text(path: Path) -> GivenNumbers:
    """Read ``key = value+/-sd`` lines with the comments ``# description: ...`` and ``# source: ...``."""
    found = GivenNumbers()
    for where, key, text in key_value_lines(path):
        if key == WAY_OUT:
            found.add_word(key, text, where)
        else:
            found.add(key, text, where=where)
    for line in path.read_bytes().decode("utf-8-sig", errors="replace").split("\n"):
        mark, _, text = line.strip().partition(":")
        word = mark.removeprefix("#").strip()
        if mark.startswith("#") and word in WORDS and word not in found.words:
            found.words[word] = _unquoted(text.strip())
    return found


def read_flat_yaml(path: Path) -> GivenNumbers:
    """Read flat YAML, or the neighbours' nested form with the parameters below ``values``."""
    import yaml

    try:
        node = yaml.compose(path.read_bytes().decode("utf-8-sig", errors="replace"), Loader=yaml.SafeLoader)
    except yaml.YAMLError as error:
        raise InputError(f"{path}: not a YAML file: {' '.join(str(error).split())}") from error
    if not isinstance(node, yaml.MappingNode):
        raise InputError(f"{path}: expected one 'key: value' a line, for example 'w: 1.02'")
    top = _entries(node, path, ("values", "sd", "units"))
    inner = {name: top.pop(name)[1] for name in ("values", "sd", "units") if name in top}
    for name, value in inner.items():
        if not isinstance(value, yaml.MappingNode):
            raise InputError(f"{path}: {name} must hold one 'key: value' a line")
    tables = {name: _entries(value, path) for name, value in inner.items()}
    try:
        found = GivenNumbers({key: text for key, (_, text) in tables.get("units", {}).items()})
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    theirs = ("parameterization", "parameters", "rider", "name") if "values" in tables else ()
    for key, (where, text) in top.items():
        if key in (*WORDS, WAY_OUT):
            found.add_word(key, text, where)
        elif theirs and key == "parameterization":
            if text.strip().lower() not in ("benchmark", "meijaard2007"):
                raise InputError(
                    f"{where}: parameterization = {text.strip()!r} is another set of parameters than the one used here "
                    f"({', '.join(KEYS)}); write the bicycle out in these (benchmark, meijaard2007)"
                )
        elif key in theirs:
            found.notes.append(f"{where}: {key} = {text.strip()!r} is not used")
        elif theirs:
            raise InputError(f"{where}: {unknown('key', key, [*WORDS, WAY_OUT, *inner, 'sd', 'units', *theirs])}")
        else:
            found.add(key, text, where=where)
    for key, (where, text) in tables.get("values", {}).items():
        found.add(key, text, where=where)
    for key, (where, text) in tables.get("sd", {}).items():
        found.add_sd(key, text, where=where)
    return found


def _entries(node: Any, path: Path, nested: tuple[str, ...] = ()) -> dict[str, tuple[str, Any]]:
    """Key -> place and text of the value; the value's node for the keys in ``nested``."""
    import yaml

    found: dict[str, tuple[str, Any]] = {}
    for key_node, value_node in node.value:
        where = f"{path}, line {key_node.start_mark.line + 1}"
        key = key_node.value if isinstance(key_node, yaml.ScalarNode) else None
        if key is not None and key in found:
            raise InputError(f"{where}: {key} is given twice; keep one")
        if key is None or not (key in nested or isinstance(value_node, yaml.ScalarNode)):
            raise InputError(f"{where}: expected one 'key: value' a line, found a nested value")
        found[key] = (where, value_node if key in nested else value_node.value)
    return found


def _unquoted(text: str) -> str:
    try:
        return str(json.loads(text)) if text.startswith('"') else text
    except ValueError:
        return text


ROW = "#"  # bicycles.csv#NAME is one of the bicycles
SD = "_sd"


def is_bicycle_table(text: str) -> bool:
    """True if ``text`` names a table of bicycles, or one of its rows."""
    return Path(text.rpartition(ROW)[0] or text).suffix.lower() in ENDINGS or Path(text).suffix.lower() in ENDINGS


def split_row(text: str) -> tuple[Path, str]:
    """The file of a table and the name of the row, empty where none is named (``FILE#NAME``)."""
    file, mark, name = text.rpartition(ROW)
    if mark and Path(file).suffix.lower() in ENDINGS and not Path(text).is_file():
        return Path(file), name
    return Path(text), ""


def read_bicycles(path: Path, *, allow_unusual: bool = False) -> list[Bicycle]:
    """Read all bicycles of a table, in its order."""
    sheet = read_sheet(path, kind="bicycles")
    columns = [_column(name, sheet) for name in sheet.header]
    keys = [key for key, _ in columns]
    for key in keys:
        if keys.count(key) > 1:
            raise InputError(f"{path}: two columns are of {key}; keep one")
    missing = [key for key in ("name", *UNITS) if key not in keys]
    if missing:
        raise InputError(f"{path}: the column {', '.join(missing)} is missing; a row needs a name and every parameter")
    found: dict[str, Bicycle] = {}
    for place, cells in sheet.rows:
        row = dict(zip(keys, zip(cells, (unit for _, unit in columns), sheet.header, strict=True), strict=True))
        one = _row_bicycle(f"{path}, {place}", row, allow_unusual=allow_unusual)
        if one.name in found:
            raise InputError(f"{path}, {place}, column 'name': {one.name!r} is there already; give each its own name")
        found[one.name] = one
    return list(found.values())


def _column(name: str, sheet: Sheet) -> tuple[str, str]:
    """The key of a column, with ``_sd`` for a standard deviation, and its unit (empty: SI)."""
    words, known = ("name", *WORDS, WAY_OUT), (*KEYS, *LEFT_OUT)
    allowed = {*words, *known, *(key + SD for key in known)}
    base, unit = split_unit(name)
    if base not in allowed and not unit:
        start, _, end = base.partition("_")
        with_sd = end == "sd" or end.startswith("sd_")
        key, rest = (start + SD, end[3:]) if with_sd else (start, end)
        base, unit = (key, rest) if key in allowed and is_unit(rest) else (base, unit)
    if base not in allowed:
        raise InputError(f"{sheet.path}: {unknown('column', name, [*words, *KEYS])}; KEY_sd is a standard deviation")
    if unit and base in words:
        raise InputError(f"{sheet.path}: the column {name!r} has no unit")
    if unit:
        factor_to_si(unit, si_unit(base.removesuffix(SD)), where=f"{sheet.path}, column {name!r}")
    return base, unit


def _row_bicycle(place: str, row: dict[str, tuple[Any, str, str]], *, allow_unusual: bool) -> Bicycle:
    words = {key: str(row.pop(key)[0]) for key in ("name", *WORDS, WAY_OUT) if key in row}
    name, flag = words.pop("name"), words.pop(WAY_OUT, "").lower()
    if not name or ROW in name:
        raise InputError(f"{place}, column 'name': {name!r} must be a name without {ROW!r}")
    if flag not in ("", "true", "false"):
        raise InputError(f"{place}, column {WAY_OUT!r}: {flag!r} must be true or false")
    numbers = GivenNumbers(words=words)
    for key, (cell, unit, column) in sorted(row.items(), key=lambda item: item[0].endswith(SD)):
        where, of = f"{place} ({name}), column {column!r}", key.removesuffix(SD)
        if cell == "" and key in UNITS:
            raise InputError(f"{where}: the cell is empty; every bicycle needs {key} ({si_unit(key)})")
        if cell == "":
            continue
        if key.endswith(SD):
            numbers.add_sd(of, cell, where=where, unit=unit or row[of][1] if of in row else unit)
        else:
            numbers.add(key, cell, where=where, unit=unit)
    return numbers.bicycle(
        name, "table (a column of its own)", place=f"{place} ({name})", allow_unusual=allow_unusual or flag == "true"
    )


def available_bicycles() -> tuple[str, ...]:
    """Names of the packaged bicycles, sorted."""
    return tuple(sorted(f.name.removesuffix(".toml") for f in _folder().iterdir() if f.name.endswith(".toml")))


def _folder() -> Traversable:
    return data_root().joinpath("bicycles")


def load_bicycle(name_or_path: str | Path, *, allow_unusual: bool = False) -> Bicycle:
    """A packaged bicycle by name, one of a file, or one of a table of bicycles (``bicycles.csv#NAME``).

    A TOML file has ``description``, ``source``, a table ``[values]`` with Meijaard's keys (SI, lam in rad) and
    optionally ``[sd]`` and ``[units]``. A YAML or text file is flat, one ``key: value`` a line. Values may be text such
    as ``0.375 +/- 0.026``, ``0.375(26)`` or ``18.3 deg`` (:mod:`tyre.measured_number`).
    Values far outside what bicycles have (other units?) are refused unless ``allow_unusual``, here or in the file, is
    true.

    Parameters
    ----------
    name_or_path : str or Path
    allow_unusual : bool, optional

    Raises
    ------
    InputError
        No such bicycle or file, unreadable text, or a parameter set that is not a bicycle.
    """
    path, text = Path(name_or_path), str(name_or_path)
    if is_bicycle_table(text):
        return _one_of_table(text, allow_unusual=allow_unusual)
    if path.suffix.lower() in WRITERS:
        if not path.is_file():
            raise InputError(f"{path}: no such bicycle file; packaged bicycles: {', '.join(available_bicycles())}")
        return (_toml if path.suffix.lower() == ".toml" else _flat)(path, allow_unusual=allow_unusual)
    if text not in available_bicycles():
        endings = ", ".join([*WRITERS, *ENDINGS])
        raise InputError(f"{unknown('bicycle', name_or_path, available_bicycles())}; or give a file ({endings})")
    return _toml(_folder().joinpath(f"{text}.toml"))


def _one_of_table(text: str, *, allow_unusual: bool) -> Bicycle:
    """The bicycle ``FILE#NAME``, or the only one of ``FILE``."""
    path, name = split_row(text)
    found = {one.name: one for one in read_bicycles(path, allow_unusual=allow_unusual)}
    if not name and len(found) > 1:
        raise InputError(
            f"{path}: the table has {len(found)} bicycles ({', '.join(list(found)[:4])}{', ...' * (len(found) > 4)}); "
            f"name one of them: {path.name}{ROW}{next(iter(found))}"
        )
    if name and name not in found:
        raise InputError(f"{path}: {unknown('bicycle', name, found)}")
    return found[name] if name else next(iter(found.values()))


def bicycle_place(text: str, folder: Path) -> str:
    """Argument of :func:`load_bicycle` for a bicycle named in a file: its own file may be relative to ``folder``."""
    path, row = split_row(text)
    if not (folder / path).is_file():
        return text
    return (folder / path).resolve().as_posix() + (f"{ROW}{row}" if row else "")


def _toml(path: Traversable, *, allow_unusual: bool = False) -> Bicycle:
    from tyre.schema import any_table, anything, flag, maybe, needed, read, table

    missing = "the table [values] with the bicycle's parameters is missing"
    declared = {maybe(key, ""): anything for key in WORDS} | {
        needed("values", missing): any_table, maybe("sd", {}): any_table, maybe("units", {}): any_table,
        maybe(WAY_OUT, False): flag,
    }  # fmt: skip
    given = read_toml(path, "bicycle file")
    if "bicycle" in given and "values" not in given:
        what = "its table [bicycle]" if isinstance(given["bicycle"], Mapping) else f"bicycle = {given['bicycle']!r}"
        added = given.get("effects") or {}
        torque = " (a measurement file without residual_torque)" if "residual_torque" in added else ""
        effects = f" and its [effects.NAME]{torque}" if added else ""
        raise InputError(
            f"{path}: is a model file, not a bicycle file; write {what}{effects} into the file that names it, in place "
            "of the name"
        )
    content = read(table(declared), given, where=str(path))
    try:
        numbers = given_numbers(content["values"], content["sd"], content["units"])
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    numbers.words = {word: str(content[word]) for word in WORDS}
    name, allow = path.name.rsplit(".", 1)[0], allow_unusual or content[WAY_OUT]
    return numbers.bicycle(name, "bicycle file", place=str(path), allow_unusual=allow)


def given_numbers(
    values: Mapping[str, Any], sd: Mapping[str, Any] | None = None, units: Mapping[str, Any] | None = None, *,
    place: str = "[values]",
) -> GivenNumbers:  # fmt: skip
    """Numbers of the tables of a TOML file, each a number or text such as ``"18.3(2) deg"``."""
    numbers = GivenNumbers(units or {})
    for key, value in values.items():
        numbers.add(key, value, where=place)
    for key, value in (sd or {}).items():
        numbers.add_sd(key, value, where="[sd]")
    return numbers


def _flat(path: Path, *, allow_unusual: bool = False) -> Bicycle:
    found = (read_flat_text if path.suffix.lower() == ".txt" else read_flat_yaml)(path)
    if found.sd and not any(found.sd.values()):  # their way to say that it is not known
        found.notes.append(
            f"{path}: every standard deviation is 0, so its values count as exact; take +/-0 out where it is not known"
        )
    return found.bicycle(path.name.rsplit(".", 1)[0], "bicycle file", place=str(path), allow_unusual=allow_unusual)


def to_toml(bicycle: Bicycle, *, allow_unusual: bool = False) -> str:
    """Text of a TOML file of ``bicycle`` that :func:`load_bicycle` reads back exactly."""
    import tomli_w

    content: dict[str, Any] = {WAY_OUT: True} if allow_unusual else {}
    content |= {"description": bicycle.description, "source": bicycle.source, "values": dict(bicycle.values)}
    return tomli_w.dumps(content | ({"sd": dict(bicycle.sd)} if bicycle.sd else {}))


def to_yaml(bicycle: Bicycle, *, allow_unusual: bool = False) -> str:
    """Flat ``key: value`` YAML, the neighbouring projects' form: first the numbers, then words and ``sd``."""
    import yaml

    words = {"description": bicycle.description, "source": bicycle.source, WAY_OUT: allow_unusual}
    content = dict(bicycle.values) | {key: value for key, value in words.items() if value}
    content |= {"sd": dict(bicycle.sd)} if bicycle.sd else {}
    return str(yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=2**31 - 1))


def to_text(bicycle: Bicycle, *, allow_unusual: bool = False) -> str:
    """``key = value+/-sd`` lines, the neighbouring projects' form, with the words in comments."""
    lines = []
    for key in WORDS:
        text = getattr(bicycle, key)
        plain = text.isprintable() and text == text.strip() and not text.startswith('"')
        lines += [f"# {key}: {text if plain else json.dumps(text)}\n"] if text else []
    lines += [f"{WAY_OUT} = true\n"] if allow_unusual else []
    return "".join([*lines, *(f"{key} = {written(x, bicycle.sd.get(key))}\n" for key, x in bicycle.values.items())])


WRITERS = {".toml": to_toml, ".yml": to_yaml, ".yaml": to_yaml, ".txt": to_text}
"""Writer of a bicycle by the ending of its file."""
