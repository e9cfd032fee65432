"""Bicycles and models that the user loads: a file dropped on the page, or MODEL of the command line."""

import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from bicycle.files.bicycle_file import WRITERS, load_bicycle
from bicycle.files.flat_bicycle import read_flat_text, read_flat_yaml
from bicycle.files.model_file import MODEL
from bicycle.parameters import Bicycle
from studies.explorer.flat_keys import flattened
from studies.explorer.models import as_table, refuse_other_files, tyres_of
from studies.explorer.state import State, parse_state
from studies.explorer.tyre_files import TYRES, with_tyres
from studies.model_argument import choose
from tyre.base import schema
from tyre.base.errors import InputError
from tyre.base.files import slug
from tyre.base.plausible import WAY_OUT
from tyre.base.toml_file import read_toml
from tyre.find_tyre import FILE_ENDINGS, is_file_name

LARGEST = 1_000_000  # bytes of a dropped file
ENDINGS = tuple(WRITERS)
"""Of bicycles and models."""


def with_file(state: State, name: str, data: bytes) -> tuple[State, tuple[str, ...]]:
    """A state with the bicycle or model of a file in place of its own.

    A bicycle keeps the effects that are there; a model file brings its own, with packaged or loaded tyres.

    Parameters
    ----------
    state : State
    name : str
        Of the file; its ending says what it is.
    data : bytes
        What it holds.

    Returns
    -------
    state : State
    remarks : tuple of str
        What the reader of bicycles has to say.

    Raises
    ------
    InputError
        Too large, an ending or content that is not known, a model that names other files; with the name of the file.
    """
    ending = Path(name).suffix.lower()
    shown = f"{slug(Path(name.replace(chr(92), '/')).stem)[:60] or 'file'}{ending}"
    if ending not in ENDINGS:
        more = ", ".join(one for one in FILE_ENDINGS if one not in ENDINGS)
        raise InputError(f"{shown[:80]}: drop a bicycle or a model file ({', '.join(ENDINGS)}) or a tyre (also {more})")
    if len(data) > LARGEST:
        raise InputError(f"{shown}: {len(data)} bytes are more than the {LARGEST} that a bicycle or model may have")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / shown
        path.write_bytes(data)
        try:
            return _read(state, path)
        except InputError as error:
            said = str(error).replace(f"{path}", shown).replace(path.as_posix(), shown)
            raise InputError(said if shown in said else f"{shown}: {said}") from None


def start_state(model: str | None) -> State:
    """The state that MODEL of the command line means; without one the benchmark on rigid wheels.

    Parameters
    ----------
    model : str or None
        As every command takes it. Files of tyres that it names may be used on the page.

    Raises
    ------
    InputError
        As :func:`studies.model_argument.choose`.
    """
    if model is None:
        return State()
    content = dict(choose(model).content)
    name = ""
    for _, table in tyres_of(content):
        tyres = table["tyre"]
        for one in tyres.values() if isinstance(tyres, Mapping) else [tyres]:
            if isinstance(one, str) and is_file_name(one):
                TYRES.know(one)
    bicycle = content.get("bicycle")
    if isinstance(bicycle, str) and Path(bicycle.partition("#")[0]).is_file():
        found = load_bicycle(bicycle, allow_unusual=bool(content.get(WAY_OUT)))
        content["bicycle"], name = as_table(found), found.name
    return parse_state(State(model=flattened(content), name=name[:80]).address)


def _read(state: State, path: Path) -> tuple[State, tuple[str, ...]]:
    content: Mapping[str, Any] = read_toml(path, "model or bicycle file") if path.suffix.lower() == ".toml" else {}
    if "bicycle" in content or (content and "values" not in content):
        given = dict(content)
        if "bicycle" not in given:
            raise InputError("the key 'bicycle' of a model file, or [values] of a bicycle file, is missing")
        schema.read(MODEL, content)
        given = with_tyres(given, lambda name: TYRES.find(name) or name if is_file_name(name) else name)
        refuse_other_files(given)
        return _kept(state, flattened(given), "" if isinstance(given["bicycle"], str) else path.stem), ()
    bicycle = load_bicycle(path)
    others = {key: value for key, value in state.content.items() if key in ("effects", WAY_OUT)}
    if _says_unusual(path, content):
        others[WAY_OUT] = True
    made = _kept(state, flattened({"bicycle": as_table(bicycle)} | others), bicycle.name)
    return made, _remarks(bicycle)


def _kept(state: State, model: Any, name: str) -> State:
    return parse_state(replace(state, model=model, name=name[:80], rider="").address)


def _says_unusual(path: Path, content: Mapping[str, Any]) -> bool:
    if path.suffix.lower() == ".toml":
        return content.get(WAY_OUT) is True
    return bool((read_flat_text if path.suffix.lower() == ".txt" else read_flat_yaml)(path).allow_unusual)


def _remarks(bicycle: Bicycle) -> tuple[str, ...]:
    return tuple(" ".join(note.split()) for note in bicycle.warnings)
