"""Bicycles as files: TOML, JSON, flat text, MATLAB or YAML as neighbouring projects write them, and tables of many."""

import json
import re
from collections.abc import Callable, Mapping, Sequence
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from bicycle.files.bicycle_numbers import (
    BODIES,
    COVARIANCE,
    FLAGS,
    FORK_OFFSET,
    KEYS,
    LEFT_OUT,
    NAMES,
    WORDS,
    GivenNumbers,
    covariance_table,
    si_unit,
)
from bicycle.parameters.bicycle import KINDS, UNITS, Bicycle
from tyre.formats.sheet import ENDINGS, ROW, Sheet, read_sheet, split_row, split_unit
from tyre.ground import schema
from tyre.ground.errors import InputError, shown, unknown
from tyre.ground.files import data_root, read_toml, refuse_deep, refuse_without_ending
from tyre.ground.number_with_sd import key_value_lines, number_text
from tyre.ground.units import factor_to_si, is_unit
from tyre.measured.plausible import WAY_OUT


def read_flat_text(path: Path | Traversable) -> GivenNumbers:
    """Read ``key = value+/-sd`` lines with the comments ``# description: ...`` and ``# source: ...``.

    A ``.m`` file of MATLAB assigns the fields of a struct: ``P.w = 1.02; % m``.
    """
    numbers = GivenNumbers()
    if path.read_bytes().removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"{"):
        raise InputError(f"{path}: holds JSON; let its name end in .json")
    for where, key, text in key_value_lines(path):
        if text.startswith("struct("):
            raise InputError(
                f"{where}: {key} = struct(...) is not read; write one number per line, such as {key}.w = 1.02;"
            )
        key = re.sub(r"^[A-Za-z]\w*\.(?=[A-Za-z]\w*$)", "", key)
        if key in FLAGS:
            numbers.add_word(key, text.rstrip("; "), where=where)
        else:
            numbers.add(key, text.rstrip("; "), where=where)
    for line in path.read_bytes().decode("utf-8-sig", errors="replace").split("\n"):
        mark, _, text = line.strip().partition(":")
        word = mark.lstrip("#%").strip()
        text = _unquote(text.strip())
        comment = word == "kind" and text not in KINDS
        if mark[:1] in ("#", "%") and word in WORDS and word not in numbers.words and not comment:
            numbers.words[word] = text
    return numbers


def read_mapping(path: Path | Traversable) -> GivenNumbers:
    """Read TOML, JSON or YAML: parameters below ``values``, with tables ``sd`` and ``units``, or at the top."""
    ending = path.name.lower().rpartition(".")[2]
    if ending in ("yml", "yaml"):
        top = _yaml(path)
    else:
        content = read_toml(path, "bicycle file") if ending == "toml" else _json(path)
        _refuse_model_file(content, path)
        top = _add_places(content, str(path))
    tables = {name: top.pop(name) for name in ("values", "sd", "units", COVARIANCE) if name in top}
    for name, (_, value) in tables.items():
        if not isinstance(value, Mapping):
            raise InputError(f"{path}: {name} = {shown(value)} must be a table: write [{name}] and the keys below it")
    bodies = schema.read(BODIES, top.pop("bodies", ("", []))[1], where=str(path), section="bodies")
    words = [key for key in (*WORDS, *FLAGS) if key in top]
    parameterization = top.get("parameterization", ("", "benchmark"))
    if str(parameterization[1]).strip().lower() not in ("benchmark", "meijaard2007"):
        raise InputError(
            f"{parameterization[0]}: parameterization = {parameterization[1]!r} is another set of parameters than the "
            f"one used here ({', '.join(KEYS)}); write the bicycle out in these (benchmark, meijaard2007)"
        )
    try:
        numbers = GivenNumbers({key: text for key, (_, text) in tables.get("units", ("", {}))[1].items()})
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    numbers.bodies = bodies
    for key in words:
        numbers.add_word(key, top[key][1], where=top.pop(key)[0])
    for key, (where, value) in (tables["values"][1] if "values" in tables else top).items():
        if isinstance(value, Mapping | list):
            raise InputError(f"{where}: expected one 'key: value' a line, found a nested value {key}")
        numbers.add(key, value, where=where)
    if "values" in tables:
        top.pop("parameterization", None)
        for key, (where, value) in top.items():
            text = "{...}" if isinstance(value, Mapping) else shown(value)
            numbers.notes.append(f"{where}: {key} = {text} is not used")
    for key, (where, value) in tables.get("sd", ("", {}))[1].items():
        numbers.add_sd(key, value, where=where)
    if COVARIANCE in tables:
        plain = {key: value for key, (_, value) in tables[COVARIANCE][1].items()}
        numbers.add_covariance(plain, where=f"{path}: [{COVARIANCE}]")
    return numbers


def _add_places(content: Mapping[str, Any], where: str) -> dict[str, tuple[str, Any]]:
    """Give every key of ``content`` its place in the file: key -> (place, value), of tables likewise."""
    return {
        key: (where, _add_places(value, f"{where}: [{key}]") if isinstance(value, Mapping) else value)
        for key, value in content.items()
    }


def _json(path: Path | Traversable) -> Mapping[str, Any]:
    try:
        content = json.loads(path.read_bytes().decode("utf-8-sig", errors="replace"))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not a JSON file: {error}") from error
    if not isinstance(refuse_deep(content, str(path)), Mapping):
        raise InputError(f'{path}: expected an object such as {{"w": 1.02, ...}}')
    return content


def _refuse_model_file(content: Mapping[str, Any], path: Path | Traversable) -> None:
    if "bicycle" not in content or "values" in content:
        return
    is_table = isinstance(content["bicycle"], Mapping)
    bicycle_key = "its table [bicycle]" if is_table else f"bicycle = {content['bicycle']!r}"
    added = content.get("effects") or {}
    torque = " (a measurement file without unmodelled_torque)" if "unmodelled_torque" in added else ""
    effects = f" and its [effects.NAME]{torque}" if added else ""
    raise InputError(
        f"{path}: is a model file, not a bicycle file; write {bicycle_key}{effects} into the file that names it, in "
        "place of the name. In Python, velotyre.read_model reads model files"
    )


LEVELS = 5  # of tables in tables in a YAML file
LISTS = ("bodies", "parameters", "matrix", "factor")  # keys whose values are lists, in any format


def _yaml(path: Path | Traversable) -> dict[str, tuple[str, Any]]:
    """Key -> place and text of a YAML file, of tables likewise; numbers stay text, as they may be written 1.02(3)."""
    import yaml

    try:
        node = yaml.compose(path.read_bytes().decode("utf-8-sig", errors="replace"), Loader=yaml.SafeLoader)
    except (yaml.YAMLError, RecursionError) as error:
        raise InputError(f"{path}: not a YAML file: {' '.join(str(error).split())[:200]}") from error
    if not isinstance(node, yaml.MappingNode):
        raise InputError(f"{path}: expected one 'key: value' a line, for example 'w: 1.02'")

    def entries(node: Any, level: int = 1) -> dict[str, tuple[str, Any]]:
        if level > LEVELS:  # a part may stand in itself, or by its name (*a) in many places
            raise InputError(f"{path}: tables lie in tables, more than {LEVELS} deep; write them flat")
        found: dict[str, tuple[str, Any]] = {}
        for key_node, value in node.value:
            where, key = f"{path}, line {key_node.start_mark.line + 1}", key_node.value
            lists = isinstance(value, yaml.SequenceNode) and key not in LISTS
            if not isinstance(key_node, yaml.ScalarNode) or lists:
                raise InputError(f"{where}: expected one 'key: value' a line, found a nested value")
            if key in found:
                raise InputError(f"{where}: {key} is given twice; keep one")
            if isinstance(value, yaml.SequenceNode):
                try:
                    content = yaml.SafeLoader("").construct_object(value, deep=True)
                except (yaml.YAMLError, ValueError) as error:  # a list in itself, a number of thousands of digits
                    raise InputError(f"{where}: {key}: {error}") from error
                found[key] = (where, refuse_deep(content, where))
            else:
                found[key] = (where, entries(value, level + 1) if isinstance(value, yaml.MappingNode) else value.value)
        return found

    return entries(node)


def _unquote(text: str) -> str:
    try:
        return str(json.loads(text)) if text.startswith('"') else text
    except ValueError:
        return text


SD = "_sd"


def is_bicycle_table(text: str) -> bool:
    """True if ``text`` names a table of bicycles, or one of its rows."""
    return any(Path(name).suffix.lower() in ENDINGS for name in (text, text.rpartition(ROW)[0]))


def read_bicycles(path: Path, *, allow_unusual: bool = False) -> list[Bicycle]:
    """Read all bicycles of a table, in its order."""
    sheet = read_sheet(path, kind="bicycles")
    columns = [_column(name, sheet) for name in sheet.header]
    keys = [key for key, _ in columns]
    if twice := [key for key in keys if keys.count(key) > 1]:
        raise InputError(f"{path}: two columns are of {twice[0]}; keep one")
    missing = [key for key in ("name", *UNITS) if key not in keys and not (key == "c" and FORK_OFFSET in keys)]
    if missing:
        raise InputError(f"{path}: the column {', '.join(missing)} is missing; a row needs a name and every parameter")
    bicycles: dict[str, Bicycle] = {}
    for place, cells in sheet.rows:
        row = dict(zip(keys, zip(cells, (unit for _, unit in columns), sheet.header, strict=True), strict=True))
        bicycle = _row_bicycle(f"{path}, {place}", row, allow_unusual=allow_unusual)
        if bicycle.name in bicycles:
            raise InputError(
                f"{path}, {place}, column 'name': {bicycle.name!r} is there already; give each its own name"
            )
        bicycles[bicycle.name] = bicycle
    return list(bicycles.values())


def _column(name: str, sheet: Sheet) -> tuple[str, str]:
    """The key of a column, with ``_sd`` for a standard deviation, and its unit (empty: SI)."""
    words, parameter_keys = ("name", *WORDS, *FLAGS), (*KEYS, *LEFT_OUT)
    allowed = {*words, *parameter_keys, *(key + SD for key in parameter_keys)}
    base, unit = split_unit(name)
    for alias in [alias for alias in NAMES if base == alias or base.startswith(f"{alias}_")]:
        base = NAMES[alias] + base.removeprefix(alias)
    if base not in allowed and not unit:
        start, _, end = base.partition("_")
        with_sd = end == "sd" or end.startswith("sd_")
        key, unit_text = (start + SD, end[3:]) if with_sd else (start, end)
        base, unit = (key, unit_text) if key in allowed and is_unit(unit_text) else (base, unit)
    if base not in allowed:
        raise InputError(f"{sheet.path}: {unknown('column', name, [*words, *KEYS])}; KEY_sd is a standard deviation")
    if unit and base in words:
        raise InputError(f"{sheet.path}: the column {name!r} has no unit")
    if unit:
        factor_to_si(unit, si_unit(base.removesuffix(SD)), where=f"{sheet.path}, column {name!r}")
    return base, unit


def _row_bicycle(place: str, row: dict[str, tuple[Any, str, str]], *, allow_unusual: bool) -> Bicycle:
    words = {key: str(row.pop(key)[0]) for key in ("name", *WORDS, *FLAGS) if key in row}
    name = words.pop("name")
    flags = {key: words.pop(key) for key in FLAGS if words.get(key)}
    if not name or ROW in name:
        raise InputError(f"{place}, column 'name': {name!r} must be a name without {ROW!r}")
    numbers = GivenNumbers(words={key: text for key, text in words.items() if key in WORDS})
    for key, text in flags.items():
        numbers.add_word(key, text, where=place)
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
    return numbers.bicycle(name, "table (a column of its own)", place=f"{place} ({name})", allow_unusual=allow_unusual)


def available_bicycles() -> tuple[str, ...]:
    """Names of the packaged bicycles, sorted."""
    folder = data_root().joinpath("bicycles")
    return tuple(sorted(f.name.removesuffix(".toml") for f in folder.iterdir() if f.name.endswith(".toml")))


def load_bicycle(name_or_path: str | Path, *, allow_unusual: bool = False) -> Bicycle:
    """A packaged bicycle by name, one of a file, or one of a table of bicycles (``bicycles.csv#NAME``).

    A TOML file has ``description``, ``source``, a table ``[values]`` with Meijaard's keys (SI, lam in rad) and
    optionally ``[sd]`` and ``[units]``. A YAML or text file is flat, one ``key: value`` per line. Values may be text
    such as ``0.375 +/- 0.026``, ``0.375(26)`` or ``18.3 deg`` (:mod:`tyre.ground.number_with_sd`).
    Values far outside what bicycles have are refused unless ``allow_unusual``, here or in the file, is true.

    Parameters
    ----------
    name_or_path : str or Path
    allow_unusual : bool, optional

    Raises
    ------
    InputError
        No such bicycle or file, unreadable text, or a parameter set that is not a bicycle.
    """
    path = Path(name_or_path)
    text = str(name_or_path)
    if is_bicycle_table(text):
        return _one_of_table(text, allow_unusual=allow_unusual)
    if path.suffix.lower() in READERS:
        if not path.is_file():
            raise InputError(f"{path}: no such bicycle file; packaged bicycles: {', '.join(available_bicycles())}")
        try:
            return _one_of_file(path, allow_unusual=allow_unusual)
        except InputError:
            from bicycle.files.matrix_file import REFUSAL, holds_matrices

            if holds_matrices(path):
                raise InputError(f"{path} {REFUSAL}; give it by itself to velotyre modes or critical") from None
            raise
    if text not in available_bicycles():
        refuse_without_ending("bicycle", name_or_path)
        endings = ", ".join([*READERS, *ENDINGS])
        raise InputError(f"{unknown('bicycle', name_or_path, available_bicycles())}; or give a file ({endings})")
    return _one_of_file(data_root().joinpath("bicycles", f"{text}.toml"))


def _one_of_file(path: Path | Traversable, *, allow_unusual: bool = False) -> Bicycle:
    stem, _, ending = path.name.rpartition(".")
    numbers = READERS[f".{ending.lower()}"](path)
    if numbers.sd and not any(numbers.sd.values()):  # their way to say that it is not known
        numbers.notes.append(
            f"{path}: every standard deviation is 0, so its values are treated as exact; delete +/-0 where it is "
            f"not known"
        )
    return numbers.bicycle(stem, "bicycle file", place=str(path), allow_unusual=allow_unusual)


def _one_of_table(text: str, *, allow_unusual: bool) -> Bicycle:
    """Read the bicycle ``FILE#NAME`` of a table of bicycles, or the only one of ``FILE``."""
    path, name = split_row(text)
    bicycles = {bicycle.name: bicycle for bicycle in read_bicycles(path, allow_unusual=allow_unusual)}
    if not name and len(bicycles) > 1:
        more = ", ..." if len(bicycles) > 4 else ""
        raise InputError(
            f"{path}: the table has {len(bicycles)} bicycles ({', '.join(list(bicycles)[:4])}{more}); "
            f"name one of them: {path.name}{ROW}{next(iter(bicycles))}"
        )
    if name and name not in bicycles:
        raise InputError(f"{path}: {unknown('bicycle', name, bicycles)}")
    return bicycles[name] if name else next(iter(bicycles.values()))


def bicycle_place(text: str, folder: Path) -> str:
    """Argument of :func:`load_bicycle` for a bicycle named in a file: its own file may be relative to ``folder``."""
    path, row = split_row(text)
    if not (folder / path).is_file():
        return text
    return (folder / path).resolve().as_posix() + (f"{ROW}{row}" if row else "")


def _words(bicycle: Bicycle) -> dict[str, str]:
    return {key: text for key in WORDS if (text := getattr(bicycle, key)) and (key, text) != ("kind", "bicycle")}


def to_toml(bicycle: Bicycle, *, allow_unusual: bool = False, bodies: Sequence[Mapping[str, Any]] = ()) -> str:
    """Text of a TOML file of ``bicycle``, with ``bodies`` to join, that :func:`load_bicycle` reads back exactly."""
    import tomli_w

    content: dict[str, Any] = {WAY_OUT: True} if allow_unusual else {}
    content |= {"description": "", "source": ""} | _words(bicycle) | {"values": dict(bicycle.values)}
    content |= _uncertainty(bicycle) | ({"bodies": [dict(body) for body in bodies]} if bodies else {})
    return tomli_w.dumps(content)


def _uncertainty(bicycle: Bicycle) -> dict[str, Any]:
    """Tables ``sd``, of what was measured one by one, and ``covariance``."""
    sd = {key: value for key, value in bicycle.sd.items() if key not in bicycle.covariance.names}
    return ({"sd": sd} if sd else {}) | covariance_table(bicycle.covariance)


def to_yaml(bicycle: Bicycle, *, allow_unusual: bool = False) -> str:
    """Flat ``key: value`` YAML, the neighbouring projects' form: the numbers, then words, ``sd`` and ``covariance``."""
    import yaml

    content: dict[str, Any] = dict(bicycle.values) | _words(bicycle) | ({WAY_OUT: True} if allow_unusual else {})
    content |= _uncertainty(bicycle)
    return str(yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=2**31 - 1))


def to_text(bicycle: Bicycle, *, allow_unusual: bool = False) -> str:
    """``key = value+/-sd`` lines, the neighbouring projects' form, with the words in comments."""
    lines = []
    for key, text in _words(bicycle).items():
        plain = text.isprintable() and text == text.strip() and not text.startswith('"')
        lines += [f"# {key}: {text if plain else json.dumps(text)}\n"]
    lines += [f"{WAY_OUT} = true\n"] if allow_unusual else []
    lines += [f"# {note}\n" for note in lost_in_text(bicycle)]
    return "".join([*lines, *(f"{key} = {number_text(x, bicycle.sd.get(key))}\n" for key, x in bicycle.values.items())])


def lost_in_text(bicycle: Bicycle) -> tuple[str, ...]:
    """Notes on what ``key = value+/-sd`` lines cannot hold of a bicycle."""
    count = len(bicycle.covariance.names)
    note = (
        f"the covariance of {count} parameters is not in this text, which holds one sd a number: their correlations "
        "are lost; .toml and .yml keep them"
    )
    return (note,) if count else ()


READERS: Mapping[str, Callable[[Any], GivenNumbers]] = dict.fromkeys(
    (".toml", ".json", ".yml", ".yaml"), read_mapping
) | dict.fromkeys((".txt", ".m"), read_flat_text)
"""Reader of a bicycle by the ending of its file."""

WRITERS = {".toml": to_toml, ".yml": to_yaml, ".yaml": to_yaml, ".txt": to_text}
"""Writer of a bicycle by the ending of its file."""
