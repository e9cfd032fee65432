"""From what the page asks for to the arguments of a command: the same that a user would type."""

from collections.abc import Mapping, Sequence
from typing import Any

from bicycle.modal.known_modes import known_modes
from studies.explorer.recording.desk import CHANNELS, Desk
from studies.explorer.recording.names import GATHERED
from studies.explorer.recording.tyre_options import tyre_options
from studies.missing_effect.packaged import available_measurements
from tyre.base import schema
from tyre.base.checks import any_table, flag, list_of, number, remarked
from tyre.base.errors import InputError, unknown

TABLE = "modal.csv"
"""Of the fits, in their folder."""

_CAN = (".mf4", ".mdf")
_FASTEST = 60.0  # m/s


def _name(value: Any) -> str:
    if not isinstance(value, str) or not value or len(value) > 400 or value.startswith("-"):
        raise remarked("must be the name of a file")
    return value


def _words(value: Any) -> str:
    if not isinstance(value, str) or len(value) > 200 or not value.isprintable():
        raise remarked("must be one line of at most 200 letters")
    return value


_SPEED = "give the speed of each recording that is fitted, in m/s"
_second = number(least=0.0)
_RUN = schema.table(
    {
        schema.needed("file", "a run without a file"): _name,
        schema.needed("speed", _SPEED): number(
            above=0.0, most=_FASTEST, says=f"must be a speed above 0 and up to {_FASTEST:g} m/s"
        ),
    }
)
LOOK = schema.table({schema.needed("file", "choose a recording"): _name, schema.maybe("map", ""): _words})
FIT = schema.table(
    {
        schema.needed("runs", _SPEED): list_of(any_table, _SPEED, least=1),
        schema.maybe("map", ""): _words,
        schema.maybe("modes", "weave"): _words,
        schema.maybe("from"): _second,
        schema.maybe("to"): _second,
    }
)
TYRE_FIT = schema.table(
    {schema.maybe("folder", ""): _words, schema.maybe("map", ""): _words}
    | {schema.maybe(one.name): number(least=0.0) for one in tyre_options()}
)
DIAGNOSE = schema.table(
    {
        schema.needed("measurement", "choose a measurement"): _name,
        schema.maybe("without"): list_of(_words, "must be a list of effects"),
        schema.maybe("variants", True): flag,
    }
)
ENTRY = schema.table(
    {
        schema.needed("channel", "choose a channel"): _words,
        schema.maybe("column"): _words,
        schema.maybe("unit", ""): _words,
        schema.maybe("sign", 1): number(least=-1, most=1),
        schema.maybe("rate_hz"): number(above=0.0),
    }
)


def command_of(desk: Desk, kind: str, asked: Mapping[str, Any]) -> list[str]:
    """Arguments of the command line.

    Parameters
    ----------
    desk : Desk
        Where its files are.
    kind : str
        ``look``, ``fit``, ``tyre_fit`` or ``diagnosis``.
    asked : mapping
        What the page sends: see :data:`LOOK`, :data:`FIT`, :data:`TYRE_FIT`, :data:`DIAGNOSE`.

    Raises
    ------
    InputError
        A file that is not loaded, a key or value that is not allowed.
    """
    made = {"look": _look, "fit": _fit, "tyre_fit": _tyre_fit, "diagnosis": _diagnose}
    if kind not in made:
        raise InputError(unknown("computation", kind, list(made)))
    return made[kind](desk, asked)


def channel_map(rows: Sequence[Mapping[str, Any]]) -> str:
    """The channel map that the user filled in, as TOML.

    Parameters
    ----------
    rows : sequence of mapping
        Each with ``channel``, ``column``, ``unit`` and ``sign``; of ``time`` perhaps ``rate_hz`` (1/s).

    Raises
    ------
    InputError
        A channel twice, or a value that is not allowed.
    """
    import tomli_w

    channels: dict[str, dict[str, Any]] = {}
    for row in rows:
        given = schema.read(ENTRY, row, where="channels")
        name = given["channel"]
        if name in channels:
            raise InputError(f"channels: {name} is taken from two columns; keep one")
        line: dict[str, Any] = {key: given[key] for key in ("column", "unit", "rate_hz") if given.get(key)}
        if given["sign"] < 0 and name != "time":
            line["sign"] = -1
        channels[name] = line
    return "# made on the page of velotyre explore\n" + tomli_w.dumps({"channels": channels})


def _look(desk: Desk, asked: Mapping[str, Any]) -> list[str]:
    given = schema.read(LOOK, asked, where="look")
    file = _loaded(desk, given["file"])
    names = [str(one["name"]) for one in desk.files()]
    can = [f"--dbc={name}" for name in names if name.lower().endswith(".dbc") and file.lower().endswith(_CAN)]
    return ["look", file, *_map(desk, given), *can, "--out=look", "--json=look/look.json"]


def _fit(desk: Desk, asked: Mapping[str, Any]) -> list[str]:
    given = schema.read(FIT, asked, where="fit")
    every = [schema.read(_RUN, run, where="fit", section=f"run {k}") for k, run in enumerate(given["runs"], 1)]
    runs = [f"{_loaded(desk, run['file'])}@{run['speed']!r}" for run in every]
    modes = [name.strip() for name in given["modes"].split(",")]
    for name in modes:
        if name not in known_modes():
            raise InputError(unknown("mode", name, known_modes()))
    window = [f"--{key}={given[key]!r}" for key in ("from", "to") if given.get(key) is not None]
    return [
        "modal",
        *runs,
        f"--modes={','.join(modes)}",
        *window,
        *_map(desk, given),
        f"--out=fit/{TABLE}",
        "--figures=fit",
    ]


def _tyre_fit(desk: Desk, asked: Mapping[str, Any]) -> list[str]:
    given = schema.read(TYRE_FIT, asked, where="fit of a tyre")
    names, folder = [str(one["name"]) for one in desk.files()], given["folder"]
    if not names:
        raise InputError("load the recordings of a tyre first")
    known = sorted({name.rpartition("/")[0] for name in names} - {""})
    if folder and folder not in known:
        raise InputError(unknown("folder", folder, known))
    numbers = [
        f"{one.flag}={given[one.name]:g}" for one in tyre_options() if given.get(one.name, one.usual) != one.usual
    ]
    return [
        "tyre",
        "fit",
        f"{GATHERED}/{folder}".rstrip("/"),
        "--out=tyre_fit",
        *_map(desk, given),
        *numbers,
    ]


def _diagnose(desk: Desk, asked: Mapping[str, Any]) -> list[str]:
    given = schema.read(DIAGNOSE, asked, where="diagnose")
    name = given["measurement"]
    if name not in available_measurements():
        _loaded(desk, name)
    without = [f"--without={effect}" for effect in given.get("without", [])]
    return ["diagnose", name, "--out=diagnosis", *without, *([] if given["variants"] else ["--no-stability"])]


def _loaded(desk: Desk, name: str) -> str:
    known = [str(one["name"]) for one in desk.files()]
    if name not in known:
        raise InputError(unknown("file", name, known) if known else f"{name}: load it first")
    return name


def _map(desk: Desk, given: Mapping[str, Any]) -> list[str]:
    name = given["map"]
    if not name:
        return []
    if desk.file(name) is None:
        raise InputError(
            f"{CHANNELS}: fill in the table of channels first" if name == CHANNELS else f"{name}: no such channel map"
        )
    return [f"--channels={name}"]
