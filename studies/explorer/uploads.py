"""Read bicycles, models and tyres that are dropped on the page, and MODEL of the command line."""

import re
import tempfile
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path, PurePath, PureWindowsPath
from typing import Any

from bicycle.files.bicycle_files import WRITERS, load_bicycle
from bicycle.files.bicycle_numbers import model_table
from bicycle.model.model_file import MODEL
from bicycle.parameters.bicycle import UNITS
from bicycle.stability.critical import critical_speeds
from studies.explorer.models import model_of, refuse_other_files
from studies.explorer.state import State, make_dotted_keys, parse_state
from studies.explorer.tyre_files import TYRES, shown_name, tyre_names, with_tyres
from studies.model_space.lasting_motions import WOBBLE
from studies.model_space.model_argument import choose
from tyre.ground import schema
from tyre.ground.errors import InputError
from tyre.ground.files import read_toml, slug
from tyre.laws.pacejka89 import KEYS, MOMENT, SIDE
from tyre.maps.find_tyre import FILE_ENDINGS, is_file_name
from tyre.measured.plausible import WAY_OUT

LARGEST, LARGEST_BODY = 1_000_000, 3_000_000  # bytes of a dropped file, and of a request with such a file and a state
START = (  # address of what the page opens on: what the tool is about
    "bicycle=pista_charlie_drops&effects.relaxation_length.tyre=Tyre1&effects.relaxation_length.pressure_bar=5.5"
    "&effects.pneumatic_trail.trail=0.017&effects.twisting_torque.twisting_stiffness=5"
    "&effects.front_compliance.stiffness=5000&effects.front_compliance.damping=20"
    "&effects.front_compliance.joint_x=0.867&effects.front_compliance.joint_z=-0.65&fast=30&at=10"
)

ENDINGS = tuple(WRITERS)  # of bicycles and models
ALWAYS = tuple(ending for ending in FILE_ENDINGS if ending not in ENDINGS)  # endings that only a tyre has


def with_file(state: State, name: str, data: bytes) -> tuple[State, tuple[str, ...]]:
    """Put the bicycle or model of a file into a state; return it with remarks on the file."""
    ending = Path(name).suffix.lower()
    file = f"{slug(Path(name.replace(chr(92), '/')).stem)[:60] or 'file'}{ending}"
    if ending not in ENDINGS:
        kinds = f"a bicycle or a model file ({', '.join(ENDINGS)}) or a tyre (also {', '.join(ALWAYS)})"
        raise InputError(f"{file[:80]}: drop {kinds}")
    if len(data) > LARGEST:
        raise InputError(f"{file}: {len(data)} bytes exceed the limit of {LARGEST} bytes for a bicycle or model file")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / file
        path.write_bytes(data)
        try:
            return _read(state, path)
        except InputError as error:
            message = str(error).replace(f"{path}", file).replace(path.as_posix(), file)
            raise InputError(message if file in message else f"{file}: {message}") from None


def start_state(model: str | None) -> State:
    """Make the state of MODEL of the command line; by default a rider, measured tyres and a flexible front frame."""
    if model is None:
        return parse_state(START)
    content = dict(choose(model).content)
    name = ""
    for tyre in filter(is_file_name, tyre_names(content)):
        TYRES.know(tyre)
    bicycle = content.get("bicycle")
    if isinstance(bicycle, str) and Path(bicycle.partition("#")[0]).is_file():
        parameters = load_bicycle(bicycle, allow_unusual=bool(content.get(WAY_OUT)))
        content["bicycle"], name = model_table(parameters), parameters.name
    return widen_range(parse_state(State(model=make_dotted_keys(content), name=name[:80]).address))


FAR = 30.0  # m/s, up to which a loaded model is searched for critical speeds beyond the range shown


def widen_range(state: State) -> State:
    """Extend the speeds of a loaded model to 30 m/s if wobble becomes unstable or a critical speed is not shown."""
    try:
        critical = critical_speeds(model_of(state).linear_model(), max_speed=FAR)
    except InputError:  # which the page shows with the model
        return state
    beyond = any(
        state.fast < speed.speed or (speed.destabilising and WOBBLE in speed.mode.split("+")) for speed in critical
    )
    return replace(state, fast=FAR) if beyond and state.fast < FAR else state


def _read(state: State, path: Path) -> tuple[State, tuple[str, ...]]:
    """Put the model of a file, or its bicycle under the effects of the state, into a state; also return remarks."""
    content: Mapping[str, Any] = read_toml(path, "model or bicycle file") if path.suffix.lower() == ".toml" else {}
    if "bicycle" in content or (content and "values" not in content):
        if "bicycle" not in content:
            raise InputError("the key 'bicycle' of a model file, or [values] of a bicycle file, is missing")
        schema.read(MODEL, content)
        located = with_tyres(content, lambda name: TYRES.find(name) or name if is_file_name(name) else name)
        refuse_other_files(located)
        return _take_model(
            state, make_dotted_keys(located), "" if isinstance(located["bicycle"], str) else path.stem
        ), ()
    bicycle = load_bicycle(path)
    further = {key: value for key, value in state.content.items() if key in ("effects", WAY_OUT)}
    if bicycle.unusual:
        further[WAY_OUT] = True
    changed = _take_model(state, make_dotted_keys({"bicycle": model_table(bicycle)} | further), bicycle.name)
    return changed, tuple(" ".join(note.split()) for note in bicycle.warnings)


def _take_model(state: State, model: Any, name: str) -> State:
    """Put a model, as dotted keys, into a state, without a rider."""
    return widen_range(parse_state(replace(state, model=model, name=name[:80], rider="").address))


def with_files(state: State, files: Sequence[tuple[str, bytes]], *, most: int = 20) -> tuple[State, tuple[str, ...]]:
    """Put at most ``most`` dropped files into a state: tyres to choose from, a model; also return remarks."""
    if len(files) > most:
        raise InputError(f"{len(files)} files were dropped; at most {most} at once")
    named: dict[str, bytes] = {}
    for path, data in files:
        name = PureWindowsPath(path).name  # of a path of any system
        if name in named:
            raise InputError(f"{name[:80]}: two files of this name were dropped; rename one")
        named[name] = data
    sidecars = {name: file for name in named if (file := _table_of(name, named))}
    tyres = [name for name, data in named.items() if name not in sidecars and _is_tyre(name, data)]
    models = [name for name in named if name not in sidecars and name not in tyres]
    if len(models) > 1:
        raise InputError(f"{models[0][:80]} and {models[1][:80]}: drop one bicycle or model at a time, with its tyres")
    remarks = list[str]()
    for name in tyres:
        for file in (name, *(side for side, table in sidecars.items() if table == name)):
            if len(named[file]) > LARGEST:
                raise InputError(
                    f"{file[:80]}: {len(named[file])} bytes exceed the limit of {LARGEST} bytes for a tyre file"
                )
        key = TYRES.keep(name, {file: named[file] for file in named if file == name or sidecars.get(file) == name})
        if not models:
            remarks.append(f"{shown_name(key)}: it can be chosen under Tyres now, for each wheel")
    changed, notes = with_file(state, models[0], named[models[0]]) if models else (state, ())
    return changed, (*remarks, *notes)


def _table_of(name: str, named: dict[str, bytes]) -> str:
    """Find the table of a tyre whose sidecar a file is; empty where it is none."""
    path = PurePath(name)
    tables = [file for file in named if PurePath(file).suffix.lower() == ".csv" and PurePath(file).stem == path.stem]
    return tables[0] if path.suffix.lower() == ".toml" and tables else ""


def _is_tyre(name: str, data: bytes) -> bool:
    """True if a file is a tyre; refuse the sidecar of a table that was not dropped with it."""
    ending = PurePath(name).suffix.lower()
    if ending in ALWAYS:
        return True
    if ending == ".toml":
        try:
            content = tomllib.loads(data.decode("utf-8-sig"))
        except (ValueError, RecursionError):
            return False  # said by the reader of models
        if "tyre" in content and not any(key in content for key in ("bicycle", "values", "effects", "kind")):
            table = PurePath(name).with_suffix(".csv").name
            raise InputError(f"{name[:80]}: describes the tyre table {table[:80]}; drop both together")
        return "kind" in content
    return ending in FILE_ENDINGS and _is_list(data)


def _is_list(data: bytes) -> bool:
    """True if a text holds coefficients of a tyre, not a bicycle."""
    lines = [re.split("[#%]", line)[0] for line in data.decode("utf-8-sig", errors="replace").splitlines()]
    keys = {match[1] for line in lines if (match := re.match(r"[\s\-{\"']*([A-Za-z_]\w*)", line))}
    return not keys & set(UNITS) and bool({key.lower() for key in keys} & {*KEYS, SIDE, MOMENT, "a0", "optparametermf"})
