"""Recordings of a folder in a laboratory's own columns and formats, written for the fit as velotyre writes them."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from tyre.channel_map import TABLES, ChannelMap
from tyre.errors import InputError
from tyre.files import read_toml, slugs
from tyre.formats import FORMATS
from tyre.progress import progress_bar
from tyre.recording_files import read_events, recording_of, write_csv

OWN = (".csv", ".tdx")
"""Endings that need no channel map if they hold velotyre's or TYDEX's names."""


@dataclass
class Prepared:
    """A folder to fit, and the recordings that could not be read (name -> reason)."""

    folder: Path
    skipped: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


@contextmanager
def prepared(folder: Path, out: Path, channel_map: ChannelMap | None, *, skip_bad: bool) -> Iterator[Prepared]:
    """Give the ``folder`` itself if no recording needs a channel map, else one in ``out`` for as long as the block."""
    results = out.resolve()
    files = [path for path in sorted(folder.rglob("*")) if path.is_file() and results not in path.resolve().parents]
    mapped = _mapped(files, every=channel_map is not None)
    named = set(mapped.values())
    passed = [
        path.relative_to(folder) for path in files
        if path.suffix.casefold() in set(FORMATS) - {*OWN, ".txt", ".dat", ".asc"} and path not in named
    ]  # fmt: skip
    notes = [f"{path}: passed over, for it has no sidecar" for path in passed]
    if not mapped:
        yield Prepared(folder, notes=notes)
        return
    out.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix=".as_read", dir=out) as name:
        found = Prepared(Path(name), notes=notes)
        for sidecar, recording in progress_bar(mapped.items(), desc="reading", unit="file"):
            try:
                _write(sidecar, found.folder / sidecar.relative_to(folder).parent, channel_map)
            except InputError as error:
                if not skip_bad:
                    raise
                found.skipped[recording.name] = str(error)
        described = {path.resolve() for path in named}
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
    """Map sidecar to recording of those that need a channel map; of ``every`` one if the command line has one."""
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


def _write(sidecar: Path, place: Path, channel_map: ChannelMap | None) -> None:
    place.mkdir(parents=True, exist_ok=True)
    events = read_events(sidecar, channel_map)
    stems = slugs(events)
    for event, found in events.items():
        name = f"{sidecar.stem}.{stems[event]}" if event else sidecar.stem
        write_csv(found, place / f"{name}.csv")
