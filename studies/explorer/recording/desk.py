"""The private folder of a page: what the user loads, and what the commands write beside it; gone at the end.

Files keep their names, for a measurement file names its tables. A text that would lead out of the folder is refused
when the file is loaded, so that no command can read what the user did not load.
"""

import io
import os
import secrets
import stat
import zipfile
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO, Any

from studies.explorer.recording.names import OWN, file_name, is_litter
from studies.explorer.recording.outside import refuse_outside
from tyre.base.errors import InputError
from tyre.base.files import left_by_a_killed_run, replacing

LARGEST_FILE, LARGEST_ALL = 32_000_000, 100_000_000  # bytes
MOST_FILES, MOST_DESKS = 200, 4

CHANNELS = "channels_of_the_page.toml"
"""The channel map that the user fills in on the page."""

_BLOCK = 1 << 20


class Desk:
    """One private folder.

    Attributes
    ----------
    token : str
        By which its page asks for it; nobody guesses it.
    folder : Path
        Of what is loaded; the commands run in it.
    results : dict of str to dict
        Of each command that ended well: what the page shows of it.
    made : set of str
        Names of loaded files that were made on the page.
    """

    def __init__(self) -> None:
        self.token = secrets.token_urlsafe(24)
        self._held = TemporaryDirectory(prefix="velotyre_page_")
        self.folder = Path(self._held.name).resolve()
        self.results: dict[str, dict[str, Any]] = {}
        self.made: set[str] = set()

    def files(self) -> list[dict[str, Any]]:
        """Name and size (bytes) of each file that is loaded, and whether it was made on the page."""
        return [
            {"name": name, "bytes": size} | ({"made": True} if name in self.made else {})
            for name, size in loaded_in(self.folder)
        ]

    def written(self, kind: str) -> list[dict[str, Any]]:
        """Name and size (bytes) of each file that a command wrote, its folder being ``kind``."""
        place = self.folder / kind
        return [{"name": name, "bytes": size} for name, size in _listed(place)] if place.is_dir() else []

    def file(self, name: str) -> Path | None:
        """The file called ``name``, loaded or written; None where there is none."""
        known = {one for one, _ in _listed(self.folder)}
        return self.folder / name if name in known else None

    def load(self, name: str, content: IO[bytes], size: int) -> None:
        """Keep a file; a zip is opened and its files are kept.

        Parameters
        ----------
        name : str
            As the user's file is called.
        content : file of bytes
        size : int
            How many bytes it has.

        Raises
        ------
        InputError
            A name that is none for a file, too many or too large files, a zip that cannot be read, a TOML file that
            names a file outside.
        """
        name = file_name(name)
        self.made.discard(name)
        if name.lower().endswith(".zip"):
            self._unpack(name, content)
            return
        self._room(name, size, [name])
        self._keep(name, content, size)

    def make(self, name: str, text: str) -> None:
        """Keep a file called ``name`` that the page made of what its user filled in: a ``text``, as :meth:`load`."""
        data = text.encode()
        self.load(name, io.BytesIO(data), len(data))
        self.made.add(name)

    def remove(self, name: str) -> None:
        """Take the loaded file called ``name`` away."""
        if name in {one["name"] for one in self.files()}:
            (self.folder / name).unlink()

    def close(self) -> None:
        """Delete everything."""
        self._held.cleanup()

    def _room(self, name: str, size: int, names: list[str]) -> None:
        there = {one["name"]: int(one["bytes"]) for one in self.files() if one["name"] not in names}
        if size > LARGEST_FILE:
            raise InputError(
                f"{name}: {size} bytes are more than the {LARGEST_FILE} that a file may have here; {_ELSE}"
            )
        if sum(there.values()) + size > LARGEST_ALL:
            raise InputError(f"{name}: all files together are more than {LARGEST_ALL} bytes; remove some, or {_ELSE}")
        if len(there) + len(names) > MOST_FILES:
            raise InputError(f"{name}: more than {MOST_FILES} files; remove some, or {_ELSE}")

    def _keep(self, name: str, content: IO[bytes], size: int) -> None:
        target = self.folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if target.is_dir():
            raise InputError(f"{name} is a folder here; call the file otherwise")
        with replacing(target) as part:
            with part.open("wb") as file:
                left = size
                while left > 0 and (block := content.read(min(_BLOCK, left))):
                    file.write(block)
                    left -= len(block)
            if left:
                raise InputError(f"{name}: the browser did not send it whole; load it again")
        try:
            refuse_outside(target, self.folder)
        except InputError:
            target.unlink()
            raise

    def _unpack(self, name: str, content: IO[bytes]) -> None:
        with TemporaryDirectory() as aside:
            packed = Path(aside) / "packed.zip"
            with replacing(packed) as part:
                part.write_bytes(content.read(LARGEST_FILE + 1))
            try:
                with zipfile.ZipFile(packed) as opened:
                    inside = [one for one in opened.infolist() if not one.is_dir() and not is_litter(one.filename)]
                    names = [file_name(one.filename) for one in inside]
                    for entry in inside:
                        self._room(f"{name}, {entry.filename}"[:200], entry.file_size, [])
                    self._room(name, 0, names)
                    if sum(one.file_size for one in inside) > LARGEST_ALL:
                        raise InputError(f"{name}: its files together are more than {LARGEST_ALL} bytes; {_ELSE}")
                    for entry, one in zip(inside, names, strict=True):
                        with opened.open(entry) as source:
                            self._keep(one, source, entry.file_size)
            except (zipfile.BadZipFile, NotImplementedError, RuntimeError, OSError, EOFError) as error:
                raise InputError(f"{name}: this zip cannot be opened ({error}); load its files one by one") from error


_OWN = tuple(f"{name}/" for name in OWN)
_ELSE = "use the commands in a terminal, which have no such limit"


class Desks:
    """The folders of the pages that are open, the oldest first; one too many takes the place of the oldest."""

    def __init__(self) -> None:
        self._open: dict[str, Desk] = {}

    def open(self, *, spare: str = "") -> Desk:
        """A new one; that of the token ``spare`` does not make room for it."""
        while len(self._open) >= MOST_DESKS:
            self._open.pop(next(token for token in self._open if token != spare)).close()
        desk = Desk()
        self._open[desk.token] = desk
        return desk

    def find(self, token: str) -> Desk | None:
        """That of a ``token``; None where it is not open."""
        found = self._open.pop(token, None)
        if found is not None:
            self._open[token] = found  # the last that was used
        return found

    def close(self) -> None:
        """Delete all."""
        while self._open:
            self._open.popitem()[1].close()


def loaded_in(folder: Path) -> list[tuple[str, int]]:
    """Name and size (bytes) of each file that is loaded into the ``folder`` of a desk."""
    return [(name, size) for name, size in _listed(folder) if not name.startswith(_OWN)]


def _listed(folder: Path) -> list[tuple[str, int]]:
    """Name and size of each file that is complete; a command may be writing in the ``folder`` meanwhile."""
    found = []
    for place, _, names in os.walk(folder):
        for path in [Path(place, name) for name in names if not left_by_a_killed_run(name)]:
            with suppress(FileNotFoundError):
                about = path.lstat()
                if stat.S_ISREG(about.st_mode):
                    found.append((path.relative_to(folder).as_posix(), about.st_size))
    return sorted(found)
