"""Recordings of a folder in a laboratory's own columns and formats, written for the fit as velotyre writes them."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from tyre.base.errors import InputError
from tyre.base.files import slugs
from tyre.base.progress import progress_bar
from tyre.base.toml_file import read_toml
from tyre.channels.channel_map import TABLES, ChannelMap
from tyre.channels.read import FORMATS
from tyre.recordings.mapped import recording_of
from tyre.recordings.read import read_events, write_csv

OWN = (".csv", ".tdx")
"""Endings that need no channel map where they hold velotyre's or TYDEX's names."""


@dataclass
class Prepared:
    """A folder to fit, and the recordings that could not be read (name -> reason)."""

    folder: Path
    skipped: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


@contextmanager
def prepared(folder: Path, out: Path, channel_map: ChannelMap | None, *, skip_bad: bool) -> Iterator[Prepared]:
    """The ``folder`` itself where no recording needs a channel map, else one in ``out`` for as long as the block.

    In it every event of a recording with a channel map is one CSV with its sidecar, beside copies of all others.

    Parameters
    ----------
    folder : Path
        Recordings.
    out : Path
        Folder of the results, not to be searched.
    channel_map : ChannelMap, optional
        Of the command line, for recordings whose sidecar has none.
    skip_bad : bool
        Keep the reason for a recording that cannot be read, and go on.

    Raises
    ------
    InputError
        A recording that cannot be read.
    """
    files = [
        path for path in sorted(folder.rglob("*")) if path.is_file() and out.resolve() not in path.resolve().parents
    ]
    mapped = _mapped(files, every=channel_map is not None)
    passed = [
        path for path in files
        if path.suffix.casefold() in FORMATS and path.suffix.casefold() not in (*OWN, ".txt", ".dat", ".asc")
        and path not in mapped.values()
    ]  # fmt: skip
    notes = [f"{path.relative_to(folder)}: passed over, for it has no sidecar" for path in passed]
    if not mapped:
        yield Prepared(folder, notes=notes)
        return
    out.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix=".as_read", dir=out) as name:
        found = Prepared(Path(name), notes=notes)
        for sidecar, recording in progress_bar(mapped.items(), desc="reading", unit="file"):
            try:
                _write(sidecar, recording, folder, found.folder, channel_map)
            except InputError as error:
                if not skip_bad:
                    raise
                found.skipped[recording.name] = str(error)
        described = {path.resolve() for path in mapped.values()}
        for path in files:
            if path.suffix.casefold() in OWN and path.resolve() not in described:
                for part in (path, path.with_suffix(".toml")):
                    if part.is_file() and part not in mapped:
                        target = found.folder / part.relative_to(folder)
                        target.parent.mkdir(parents=True, exist_ok=True)
                        shutil.copyfile(part, target)
        if found.skipped and not any(path.suffix.casefold() in OWN for path in found.folder.rglob("*")):
            reasons = "; ".join(f"{recording}: {why}" for recording, why in found.skipped.items())
            raise InputError(f"{folder}: no recording can be used: {reasons}")
        try:
            yield found
        except InputError as error:  # names the user's file, not the copy
            raise InputError(str(error).replace(name, str(folder))) from error


def _mapped(files: list[Path], *, every: bool) -> dict[Path, Path]:
    """Sidecar -> recording, of those that need a channel map; of ``every`` one if the command line has one."""
    found: dict[Path, Path] = {}
    for path in files:
        if path.suffix.casefold() != ".toml":
            continue
        try:
            content = read_toml(path, "sidecar")
            if "tyre" not in content or "axes" not in content:
                continue  # not a sidecar
            needs_map = every or "recording" in content or any(key in content for key in TABLES)
            recording = recording_of(path)
        except InputError:  # told when the recording is read
            named = content.get("recording")
            needs_map = isinstance(named, str) and named != ""
            recording = path.parent / str(named) if needs_map else path.with_suffix(".csv")
        if needs_map or recording.suffix.casefold() not in OWN:
            found[path] = recording
    return found


def _write(sidecar: Path, recording: Path, folder: Path, target: Path, channel_map: ChannelMap | None) -> None:
    place = target / sidecar.relative_to(folder).parent
    place.mkdir(parents=True, exist_ok=True)
    events = read_events(sidecar, channel_map)
    stems = slugs(events)
    for event, found in events.items():
        name = f"{sidecar.stem}.{stems[event]}" if event else sidecar.stem
        write_csv(found, place / f"{name}.csv")
