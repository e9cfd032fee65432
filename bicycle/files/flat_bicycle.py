"""Bicycles as flat text: ``key = value+/-sd`` (.txt) and ``key: value`` (YAML), as neighbouring projects write them."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bicycle.files.given_numbers import GivenNumbers
from bicycle.parameters import UNITS, UNUSED
from tyre.base.errors import InputError, unknown
from tyre.base.key_value import key_value_lines
from tyre.base.plausible import WAY_OUT

WORDS = ("description", "source")
SAME_PARAMETERS = ("benchmark", "meijaard2007")
"""Names under which the neighbours' nested files have the parameters used here."""
THEIRS = ("parameterization", "parameters", "rider", "name")
"""Further keys of their nested files."""


@dataclass
class FlatBicycle:
    """What a flat file holds.

    Attributes
    ----------
    numbers : GivenNumbers
    words : dict of str to str
        ``description``, ``source``.
    allow_unusual : bool
        The file lets values pass that are far from those of other bicycles.
    notes : list of str
        Keys that are not used.
    """

    numbers: GivenNumbers
    words: dict[str, str] = field(default_factory=dict)
    allow_unusual: bool = False
    notes: list[str] = field(default_factory=list)


def read_flat_text(path: Path) -> FlatBicycle:
    """Read ``key = value+/-sd`` lines; ``# description: ...`` and ``# source: ...`` are read too, other comments not.

    Parameters
    ----------
    path : Path
        ``.txt``.

    Raises
    ------
    InputError
        A line that is none of these, an unknown or repeated key, a value that is no number.
    """
    found = FlatBicycle(GivenNumbers())
    for where, key, text in key_value_lines(path):
        if key == WAY_OUT:
            found.allow_unusual = _flag(text, where)
        else:
            found.numbers.add(key, text, where=where)
    for line in path.read_bytes().decode("utf-8-sig", errors="replace").split("\n"):
        mark, _, said = line.strip().partition(":")
        word = mark.removeprefix("#").strip()
        if mark.startswith("#") and word in WORDS and word not in found.words:
            found.words[word] = _unquoted(said.strip())
    return found


def read_flat_yaml(path: Path) -> FlatBicycle:
    """Read flat YAML, or the neighbours' nested form with the parameters below ``values``.

    Beside them may stand ``description``, ``source``, ``allow_unusual`` and the mappings ``sd`` and ``units``.

    Parameters
    ----------
    path : Path
        ``.yml`` or ``.yaml``.

    Raises
    ------
    InputError
        No YAML, an unknown or repeated key, a value that is no number, another set of parameters.
    """
    import yaml

    try:
        node = yaml.compose(path.read_bytes().decode("utf-8-sig", errors="replace"), Loader=yaml.SafeLoader)
    except yaml.YAMLError as error:
        raise InputError(f"{path}: not a YAML file: {' '.join(str(error).split())}") from error
    if not isinstance(node, yaml.MappingNode):
        raise InputError(f"{path}: expected one 'key: value' a line, for example 'w: 1.02'")
    top = _entries(node, str(path), {"values", "sd", "units"})
    inner = {name: top.pop(name)[1] for name in ("values", "sd", "units") if name in top}
    for name, value in inner.items():
        if not isinstance(value, yaml.MappingNode):
            raise InputError(f"{path}: {name} must hold one 'key: value' a line")
    tables = {name: _entries(value, str(path), set()) for name, value in inner.items()}
    try:
        numbers = GivenNumbers({key: text for key, (_, text) in tables.get("units", {}).items()})
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    found = FlatBicycle(numbers)
    for key, (where, text) in top.items():
        if key in WORDS:
            found.words[key] = text
        elif key == WAY_OUT:
            found.allow_unusual = _flag(text, where)
        elif key in THEIRS and "values" in tables:
            found.notes += _theirs(key, text, where)
        elif "values" in tables:
            raise InputError(f"{where}: {unknown('key', key, [*WORDS, WAY_OUT, *inner, 'sd', 'units', *THEIRS])}")
        else:
            numbers.add(key, text, where=where)
    for key, (where, text) in tables.get("values", {}).items():
        numbers.add(key, text, where=where)
    for key, (where, text) in tables.get("sd", {}).items():
        numbers.add_sd(key, text, where=where)
    return found


def yaml_text(values: Mapping[str, float], sd: Mapping[str, float], words: Mapping[str, Any]) -> str:
    """Flat YAML of a parameter set: the numbers first, as the neighbours read them, then the rest.

    Parameters
    ----------
    values, sd : mapping
        SI, lam in rad.
    words : mapping
        Further keys with their values.
    """
    import yaml

    content = dict(values) | {key: value for key, value in words.items() if value}
    content |= {"sd": dict(sd)} if sd else {}
    return str(yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=2**31 - 1))


def plain_text(values: Mapping[str, float], sd: Mapping[str, float], words: Mapping[str, Any]) -> str:
    """``key = value+/-sd`` lines of a parameter set; words that are read back stand in comments.

    Parameters
    ----------
    values, sd : mapping
        SI, lam in rad.
    words : mapping
        Further keys with their values.
    """
    from tyre.base.measured_number import written

    head = [f"# {key}: {_quoted(words[key])}\n" for key in WORDS if words.get(key)]
    head += [f"{WAY_OUT} = true\n"] if words.get(WAY_OUT) else []
    return "".join([*head, *(f"{key} = {written(value, sd.get(key))}\n" for key, value in values.items())])


def _entries(node: Any, path: str, nested: set[str]) -> dict[str, tuple[str, Any]]:
    """Key -> place and text of the value; the value's node for the keys in ``nested``."""
    import yaml

    found: dict[str, tuple[str, Any]] = {}
    for key_node, value_node in node.value:
        where = f"{path}, line {key_node.start_mark.line + 1}"
        scalar = isinstance(key_node, yaml.ScalarNode)
        if scalar and key_node.value in found:
            raise InputError(f"{where}: {key_node.value} is given twice; keep one")
        if scalar and key_node.value in nested:
            found[key_node.value] = (where, value_node)
        elif not scalar or not isinstance(value_node, yaml.ScalarNode):
            raise InputError(f"{where}: expected one 'key: value' a line, found a nested value")
        else:
            found[key_node.value] = (where, value_node.value)
    return found


def _theirs(key: str, text: str, where: str) -> list[str]:
    if key == "parameterization" and text.strip().lower() not in SAME_PARAMETERS:
        raise InputError(
            f"{where}: parameterization = {text.strip()!r} is another set of parameters than the one used here "
            f"({', '.join([*UNITS, *UNUSED])}); write the bicycle out in these ({', '.join(SAME_PARAMETERS)})"
        )
    return [] if key == "parameterization" else [f"{where}: {key} = {text.strip()!r} is not used"]


def _flag(text: str, where: str) -> bool:
    if text.strip() not in ("true", "false"):
        raise InputError(f"{where}: {WAY_OUT} = {text.strip()!r} must be true or false")
    return text.strip() == "true"


def _quoted(text: str) -> str:
    """A line that :func:`_unquoted` makes the same text of."""
    plain = text.isprintable() and text == text.strip() and not text.startswith('"')
    return text if plain else json.dumps(text)


def _unquoted(text: str) -> str:
    if text.startswith('"'):
        try:
            return str(json.loads(text))
        except ValueError:
            pass
    return text
