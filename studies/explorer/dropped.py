"""Files that are dropped together: tyres are kept, and at most one bicycle or model takes the place of the present."""

import re
import tomllib
from collections.abc import Sequence
from pathlib import PurePath

from bicycle.parameters import UNITS
from studies.explorer.loaded import ENDINGS, LARGEST, with_file
from studies.explorer.recording.names import file_name
from studies.explorer.state import State
from studies.explorer.tyre_files import TYRES, plain_name, shown_name
from tyre.base.errors import InputError
from tyre.find_tyre import FILE_ENDINGS
from tyre.magic_formula.pacejka89_content import ROLE_OF, is_float

MOST_FILES = 20
LEAST_NUMBERS = 10  # of a list without names
ALWAYS = tuple(ending for ending in FILE_ENDINGS if ending not in ENDINGS)
"""Endings that only a tyre has."""

_OF_BICYCLES = ("bicycle", "values", "effects")
CHOOSE = "it can be chosen under Tyres now, for each wheel"


def with_files(state: State, files: Sequence[tuple[str, bytes]]) -> tuple[State, tuple[str, ...]]:
    """A state with what was dropped.

    Parameters
    ----------
    state : State
    files : sequence of (str, bytes)
        Names, with or without folder, and contents.

    Returns
    -------
    state : State
        The same where only tyres were dropped.
    remarks : tuple of str

    Raises
    ------
    InputError
        Two bicycles or models, two files of one name, or what the readers refuse; with the name of the file.
    """
    if len(files) > MOST_FILES:
        raise InputError(f"{len(files)} files were dropped; at most {MOST_FILES} at once")
    named: dict[str, bytes] = {}
    for given, data in files:
        name = plain_name(given)
        if name in named:
            raise InputError(f"{name[:80]}: two files of this name were dropped; rename one")
        named[name] = data
    beside = {name: one for name in named if (one := _table_of(name, named))}
    tyres = [name for name, data in named.items() if name not in beside and _is_tyre(name, data)]
    others = [name for name in named if name not in beside and name not in tyres]
    if len(others) > 1:
        raise InputError(f"{others[0][:80]} and {others[1][:80]}: drop one bicycle or model at a time, with its tyres")
    remarks = []
    for name in tyres:
        for one in (name, *(side for side, table in beside.items() if table == name)):
            if len(named[one]) > LARGEST:
                raise InputError(f"{one[:80]}: {len(named[one])} bytes are more than the {LARGEST} of a tyre file")
        parts = {one: named[one] for one in named if one == name or beside.get(one) == name}
        key = TYRES.keep(file_name(name), {file_name(one): content for one, content in parts.items()})
        remarks += [] if others else [f"{shown_name(key)}: {CHOOSE}"]
    if not others:
        return state, tuple(remarks)
    made, said = with_file(state, others[0], named[others[0]])
    return made, (*remarks, *said)


def _table_of(name: str, named: dict[str, bytes]) -> str:
    """The table of a tyre whose sidecar a file is; empty where it is none."""
    path = PurePath(name)
    tables = [one for one in named if PurePath(one).suffix.lower() == ".csv" and PurePath(one).stem == path.stem]
    return tables[0] if path.suffix.lower() == ".toml" and tables else ""


def _is_tyre(name: str, data: bytes) -> bool:
    ending = PurePath(name).suffix.lower()
    if ending in ALWAYS:
        return True
    if ending == ".toml":
        try:
            content = tomllib.loads(data.decode("utf-8-sig"))
        except (ValueError, RecursionError):
            return False  # said by the reader of models
        if "tyre" in content and not any(key in content for key in (*_OF_BICYCLES, "kind")):
            table = PurePath(name).with_suffix(".csv").name
            raise InputError(f"{name[:80]}: describes the tyre table {table[:80]}; drop both together")
        return "kind" in content
    return ending in FILE_ENDINGS and _is_list(data)


def _is_list(data: bytes) -> bool:
    """Whether a text holds coefficients of a tyre, not a bicycle."""
    lines = [re.split("[#%]", line)[0] for line in data.decode("utf-8-sig", errors="replace").splitlines()]
    keys = {found[1] for line in lines if (found := re.match(r"[\s\-{\"']*([A-Za-z_]\w*)", line))}
    if keys & set(UNITS):
        return False
    numbers = sum(is_float(word) for line in lines for word in re.split(r"[\s,;]+", line))
    return any(key.lower() in ROLE_OF for key in keys) or (not keys and numbers >= LEAST_NUMBERS)
