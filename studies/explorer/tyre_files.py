"""Keep the tyre files that the user loaded: what an address calls them, and the private folder in which they lie."""

import hashlib
import re
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path, PureWindowsPath
from tempfile import TemporaryDirectory
from threading import Lock
from typing import Any

from studies.explorer.state import State, parse_state
from tyre.ground.errors import InputError, shown
from tyre.ground.files import write_bytes
from tyre.maps.find_tyre import is_file_name, read_tyre
from tyre.measured.properties import TyreSource

_DIGITS = 10
_GIVEN = re.compile(rf"@[0-9a-f]{{{_DIGITS}}}$")  # an address holds NAME.csv@DIGEST: no path, and no other content


def refuse_name(name: str) -> None:
    """Refuse a name of a file that might not stay inside a folder."""
    hidden = not name.strip() or len(name) > 100 or name[0] in ".-~"
    if hidden or any(mark in name for mark in '/\\:*?"<>|') or not name.isprintable():
        raise InputError(
            f"file {shown(name[:200])} cannot be loaded under this name: letters, digits, blanks, '_', '-' and '.', "
            "no dot or dash first; rename it"
        )


MOST_TYRES = 50


class TyreFiles:
    """The tyre files of a server."""

    def __init__(self) -> None:
        self._folder: TemporaryDirectory[str] | None = None
        self._places: dict[str, str] = {}
        self._one_at_a_time = Lock()

    def names(self) -> list[str]:
        """List the names that an address may use."""
        return sorted(self._places)

    def know(self, path: str) -> None:
        """Let a file be used that the command line named by its ``path``."""
        self._places[path] = path

    def keep(self, name: str, files: Mapping[str, bytes]) -> str:
        """Keep a tyre that was loaded; return what an address calls it."""
        for file, content in files.items():
            refuse_name(file)
            if content.startswith(b"\x89HDF\r\n"):  # which may link to other files
                raise InputError(f"{file}: the page takes no HDF5 file; save it in MATLAB with -v7")
        parts: list[bytes] = []
        for file in sorted(files):
            parts += [hashlib.sha256(file.encode()).digest(), hashlib.sha256(files[file]).digest()]
        digest = hashlib.sha256(b"".join(parts)).hexdigest()[:_DIGITS]
        with self._one_at_a_time:  # several may drop the same file at once
            return self._keep(f"{name}@{digest}", files)

    def _keep(self, key: str, files: Mapping[str, bytes]) -> str:
        name, _, digest = key.rpartition("@")
        if key in self._places:
            self._places[key] = self._places.pop(key)  # the last of its name
            return key
        if sum(map(is_loaded, self._places)) >= MOST_TYRES:
            raise InputError(f"{name}: {MOST_TYRES} tyre files are loaded; start velotyre explore again for more")
        self._folder = self._folder or TemporaryDirectory(prefix="velotyre_tyres_")
        place = Path(self._folder.name) / digest
        place.mkdir()
        for file, content in files.items():
            write_bytes(place / file, content)
        try:
            with self.by_name():
                read_tyre(place / name)
        except BaseException:
            shutil.rmtree(place)
            raise
        self._places[key] = (place / name).as_posix()
        return key

    def find(self, path: str) -> str | None:
        """Find the address's name of the last loaded file that is called as the path ``given``."""
        name = PureWindowsPath(path).name  # of a path of any system
        keys = {shown_name(key): key for key in list(self._places) if is_loaded(key)}
        return keys.get(name, keys.get(name.removesuffix(".toml") + ".csv"))  # a table may be named by its sidecar

    def read(self, name: str, surface: str | None) -> TyreSource:
        """Read the tyre that an address calls ``name``, on a ``surface``; a packaged one by its own name."""
        with self.by_name():
            return read_tyre(self._places.get(name, name), surface=surface)

    def with_paths(self, content: Mapping[str, Any]) -> dict[str, Any]:
        """Replace the names of an address in the ``content`` of a model file by paths."""
        return with_tyres(content, lambda name: self._places.get(name, name))

    def with_file_names(self, content: Mapping[str, Any]) -> dict[str, Any]:
        """Replace the loaded tyres in the ``content`` of a model file by their file names, for another folder."""
        named = {place: shown_name(key) for key, place in list(self._places.items()) if is_loaded(key)}
        return with_tyres(content, lambda name: named.get(name, name))

    def content(self, names: list[str]) -> dict[str, bytes]:
        """Read every loaded file behind such ``names`` of addresses, by its name."""
        places = [Path(self._places[name]).parent for name in names if is_loaded(name) and name in self._places]
        contents: dict[str, bytes] = {}
        for place in places:
            contents |= {path.name: path.read_bytes() for path in sorted(place.iterdir())}
        return contents

    def in_words(self, text: str) -> str:
        """Take the private folder out of a ``text`` of the library."""
        if self._folder is None:
            return text
        folder = "|".join({re.escape(self._folder.name), re.escape(Path(self._folder.name).resolve().as_posix())})
        return re.sub(rf"(?:{folder})[\\/][0-9a-f]{{{_DIGITS}}}[\\/]", "", text)

    @contextmanager
    def by_name(self) -> Iterator[None]:
        """Let an error within the block name a file as its user does."""
        try:
            yield
        except InputError as error:
            message = self.in_words(str(error))
            if message == str(error):
                raise
            raise InputError(message) from None

    def close(self) -> None:
        """Delete what was loaded."""
        self._places.clear()
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None


TYRES = TyreFiles()


def is_loaded(name: str) -> bool:
    """True if a ``name`` of an address belongs to a file that was loaded on a page, here or elsewhere."""
    return _GIVEN.search(name) is not None


def shown_name(name: str) -> str:
    """Name the file of a ``name`` of an address, without the digest."""
    return _GIVEN.sub("", name)


def tyre_names(content: Mapping[str, Any]) -> list[str]:
    """List the tyres that the ``content`` of a model file names, each once."""
    names: dict[str, None] = {}
    with_tyres(content, lambda name: names.setdefault(name) or name)
    return list(names)


def refuse_unloaded(name: str, *, where: str) -> None:
    """Refuse the name of a tyre file that is missing."""
    if is_loaded(name):
        raise InputError(
            f"{where}: the tyre file {shown_name(name)!r} is not loaded here, or has another content; an address does "
            "not hold tyre files: drop the same file on the page"
        )
    if is_file_name(name):
        raise InputError(f"{where}: names the tyre file {name[:200]!r}, which was not dropped; drop both together")


def files_of(state: State) -> dict[str, bytes]:
    """Read every tyre file of a state and of what it pins that was loaded on the page: content by name."""
    names: list[str] = []
    for drawn in (state, *map(parse_state, state.pins)):
        names += tyre_names(drawn.content)
    return TYRES.content(list(dict.fromkeys(names)))


def kept_here(state: State) -> list[str]:
    """Note the files that the address of a state does not hold."""
    files = ", ".join(files_of(state))
    if not files:
        return []
    return [f"the address does not hold {files}: elsewhere, drop that on the page first; a saved page has it inside"]


def with_tyres(content: Mapping[str, Any], change: Any) -> dict[str, Any]:
    """Replace every name of a tyre in the ``content`` of a model file by ``change(name)``."""
    effects = content.get("effects")
    if not isinstance(effects, Mapping):
        return dict(content)

    def of(tyre: Any) -> Any:
        if isinstance(tyre, Mapping):
            return {wheel: of(name) for wheel, name in tyre.items()}
        return change(tyre) if isinstance(tyre, str) else tyre

    changed = {
        name: dict(table) | {"tyre": of(table["tyre"])} if isinstance(table, Mapping) and "tyre" in table else table
        for name, table in effects.items()
    }
    return dict(content) | {"effects": changed}
