"""The sidecar of a rig recording, made on the page: a draft of the look, and what only the user knows."""

import re
import tempfile
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import tomli_w

from studies.explorer.recording.desk import Desk
from studies.look.drafts import CHECK, FILL
from tyre.base import schema
from tyre.base.checks import flag, number, text
from tyre.base.errors import InputError, refuse_unknown
from tyre.base.files import write_text
from tyre.recordings.axes import CONVENTIONS
from tyre.recordings.sidecar import read_sidecar

SURFACES = ("flat", "drum")
_MARKED = re.compile(rf"^(\w+) = (.*?) *# (?:{FILL}|{CHECK}): (.*)$", re.MULTILINE)
_RADIUS = {"key": "drum_radius_m", "kind": "number", "value": "", "words": "of a drum only, in m"}
_CHECKS = {
    "tyre": text(blank=False), "surface": text(f"must be {' or '.join(SURFACES)}", allowed=SURFACES),
    "axes": text(f"must be one of {', '.join(CONVENTIONS)}", allowed=CONVENTIONS), "rigid_rim": flag,
    **{key: number(above=0.0) for key in ("load_N", "pressure_bar", "drum_radius_m", "speed_km_h")},
}  # fmt: skip
GIVEN = schema.table(
    {schema.needed("draft", "look at the recording first"): text("must be a draft of the look")}
    | {schema.maybe(key): check for key, check in _CHECKS.items()}
)
"""What the page sends."""


def drafted(folder: Path) -> list[dict[str, Any]]:
    """Each draft of a sidecar in a folder, with what is to be filled in or checked.

    Parameters
    ----------
    folder : Path

    Returns
    -------
    list of dict
        ``file`` and ``fields``: ``key`` with its unit, ``kind`` (``text``, ``number``, ``choice`` or ``flag``),
        ``value``, ``words`` and of a choice its ``options``.
    """
    found = []
    for path in sorted(folder.glob("*.toml")):
        written = path.read_text(encoding="utf-8")
        if "axes" in tomllib.loads(written):  # neither a channel map nor a measurement file
            found.append({"file": path.relative_to(folder.parent).as_posix(), "fields": list(_fields(written))})
    return found


def described(desk: Desk, given: Mapping[str, Any]) -> tuple[str, str]:
    """Name and content of the sidecar, to be kept beside the recording.

    Parameters
    ----------
    desk : Desk
        Whose look drafted it.
    given : mapping
        See :data:`GIVEN`; the units stand in the keys.

    Raises
    ------
    InputError
        No such draft, a value that is not allowed, or one that is missing.
    """
    asked = schema.read(GIVEN, given, where="sidecar")
    name = asked.pop("draft")
    path = desk.file(name)
    if path is None or not name.startswith("look/") or path.suffix != ".toml":
        raise InputError(f"{name[:80]}: there is no such draft; look at the recording again")
    content = tomllib.loads(path.read_text(encoding="utf-8"))
    recording = (path.parent / str(content.get("recording", ""))).resolve()
    loaded = {desk.folder / str(one["name"]) for one in desk.files()}
    if "axes" not in content or recording not in loaded:
        raise InputError(f"{name}: its recording is no longer loaded; load it and look again")
    fields = [str(field["key"]) for field in _fields(path.read_text(encoding="utf-8"))]
    refuse_unknown("key", asked, fields, where="sidecar")
    if asked.get("surface") != "drum" and "drum_radius_m" in asked:
        raise InputError("sidecar: drum_radius_m is of a drum; leave it out, or choose the surface drum")
    for key in fields:
        content.pop(key, None)
    tables = {key: content.pop(key) for key in list(content) if isinstance(content[key], dict | list)}
    content["recording"] = recording.name
    whole = content | {key: asked[key] for key in fields if key in asked} | tables
    written = "# made on the page of velotyre explore\n" + tomli_w.dumps(whole)
    with tempfile.TemporaryDirectory() as aside:
        tried = Path(aside) / path.name
        write_text(tried, written)
        try:
            read_sidecar(tried)
        except InputError as error:
            raise InputError(str(error).replace(str(tried), path.name)) from None
    place = recording.relative_to(desk.folder).parent / path.name
    return place.as_posix(), written


def _fields(written: str) -> Iterator[dict[str, Any]]:
    for key, value, words in _MARKED.findall(written.partition("\n[")[0]):  # the channels have a table of their own
        known = tomllib.loads(f"value = {value}")["value"]
        options = {"surface": SURFACES, "axes": CONVENTIONS}.get(key)
        kind = "choice" if options else "flag" if isinstance(known, bool) else "text" if key == "tyre" else "number"
        yield {"key": key, "kind": kind, "value": known, "words": words, "options": list(options or ())}
        if key == "surface":
            yield _RADIUS
