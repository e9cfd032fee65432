"""Tyre files that the user loaded: what an address calls them, and the private folder in which they lie.

An address holds ``NAME.csv@DIGEST``: no path, and no other content under the same name. Only such names, and the files
that the model of the command line names, lead to a file at all.
"""

import hashlib
import re
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path, PureWindowsPath
from tempfile import TemporaryDirectory
from typing import Any

from studies.explorer.recording.names import file_name
from studies.explorer.recording.outside import refuse_outside
from studies.explorer.state import State, parse_state
from tyre.base.errors import InputError
from tyre.base.files import write_bytes
from tyre.find_tyre import is_file_name, read_tyre
from tyre.tyre_source import TyreSource

MOST_TYRES = 50
MARK = "@"
"""Between the name of a file and the digest of its content."""

_DIGITS = 10
_GIVEN = re.compile(rf"{MARK}[0-9a-f]{{{_DIGITS}}}$")


class TyreFiles:
    """The tyre files of a server."""

    def __init__(self) -> None:
        self._held: TemporaryDirectory[str] | None = None
        self._places: dict[str, str] = {}

    def names(self) -> list[str]:
        """What an address may call them."""
        return sorted(self._places)

    def know(self, path: str) -> None:
        """Let a file be used that the command line named by its ``path``."""
        self._places[path] = path

    def keep(self, name: str, files: Mapping[str, bytes]) -> str:
        """Keep a tyre that was loaded.

        Parameters
        ----------
        name : str
            Of its file, without folder.
        files : mapping of str to bytes
            That file, and what lies beside it.

        Returns
        -------
        str
            What an address calls it.

        Raises
        ------
        InputError
            It is no tyre; too many tyres are loaded.
        """
        digest = hashlib.sha256(b"".join(
            hashlib.sha256(part).digest() for one in sorted(files) for part in (one.encode(), files[one])
        )).hexdigest()[:_DIGITS]  # fmt: skip
        key = f"{name}{MARK}{digest}"
        if key in self._places:
            self._places[key] = self._places.pop(key)  # the last of its name
            return key
        if sum(map(is_loaded, self._places)) >= MOST_TYRES:
            raise InputError(f"{name}: {MOST_TYRES} tyre files are loaded; start velotyre explore again for more")
        place = self._folder() / digest
        for one, content in files.items():
            place.mkdir(exist_ok=True)
            write_bytes(place / file_name(one), content)
        try:
            with self.by_name():
                for one in files:
                    refuse_outside(place / one, place.resolve())
                read_tyre(place / name)
        except InputError:
            shutil.rmtree(place)
            raise
        self._places[key] = (place / name).as_posix()
        return key

    def find(self, given: str) -> str | None:
        """What an address calls the last loaded file that is named as the path ``given``; None where none is."""
        name = plain_name(given)
        stem = name.removesuffix(".toml") + ".csv"  # a table may be named by its sidecar
        for wanted in (name, stem):
            for key in reversed(self._places):
                if is_loaded(key) and shown_name(key) == wanted:
                    return key
        return None

    def read(self, name: str, surface: str | None) -> TyreSource:
        """The tyre that an address calls ``name``, on a ``surface``; a packaged one by its own name."""
        with self.by_name():
            return read_tyre(self._places.get(name, name), surface=surface)

    def located(self, content: Mapping[str, Any]) -> dict[str, Any]:
        """The ``content`` of a model file with paths in place of the names of an address."""
        return with_tyres(content, lambda name: self._places.get(name, name))

    def portable(self, content: Mapping[str, Any]) -> dict[str, Any]:
        """The ``content`` of a model file for another folder: what was loaded is called by its file name alone."""
        named = {place: shown_name(key) for key, place in self._places.items() if is_loaded(key)}
        return with_tyres(content, lambda name: named.get(name, name))

    def content(self, names: list[str]) -> dict[str, bytes]:
        """Every file behind such ``names`` of addresses that was loaded, by its name."""
        places = [Path(self._places[name]).parent for name in names if is_loaded(name) and name in self._places]
        return {path.name: path.read_bytes() for place in places for path in sorted(place.iterdir())}

    def in_words(self, text: str) -> str:
        """A ``text`` of the library without the private folder."""
        if self._held is None:
            return text
        folder = "|".join({re.escape(self._held.name), re.escape(Path(self._held.name).resolve().as_posix())})
        return re.sub(rf"(?:{folder})[\\/][0-9a-f]{{{_DIGITS}}}[\\/]", "", text)

    @contextmanager
    def by_name(self) -> Iterator[None]:
        """Within the block an error names a file as its user does."""
        try:
            yield
        except InputError as error:
            said = self.in_words(str(error))
            if said == str(error):
                raise
            raise InputError(said) from None

    def close(self) -> None:
        """Delete what was loaded."""
        self._places.clear()
        if self._held is not None:
            self._held.cleanup()
            self._held = None

    def _folder(self) -> Path:
        if self._held is None:
            self._held = TemporaryDirectory(prefix="velotyre_tyres_")
        return Path(self._held.name)


TYRES = TyreFiles()


def is_loaded(name: str) -> bool:
    """Whether a ``name`` of an address is one of a file that was loaded on a page, here or elsewhere."""
    return _GIVEN.search(name) is not None


def shown_name(name: str) -> str:
    """The file that a ``name`` of an address is, without the digest."""
    return _GIVEN.sub("", name)


def plain_name(given: str) -> str:
    """The last part of a path ``given``, of any system."""
    return PureWindowsPath(given).name


def tyre_names(content: Mapping[str, Any]) -> list[str]:
    """Every tyre that the ``content`` of a model file names, each once."""
    found: dict[str, None] = {}
    with_tyres(content, lambda name: found.setdefault(name) or name)
    return list(found)


def refuse_unloaded(name: str, *, where: str) -> None:
    """Refuse a tyre by what is lacking, where it is a file.

    Parameters
    ----------
    name : str
        In an address or a model file.
    where : str
        What the message begins with.

    Raises
    ------
    InputError
        The file was loaded elsewhere, or was not dropped.
    """
    if is_loaded(name):
        raise InputError(
            f"{where}: the tyre file {shown_name(name)!r} is not loaded here, or has another content; an address does "
            "not hold tyre files: drop the same file on the page"
        )
    if is_file_name(name):
        raise InputError(f"{where}: names the tyre file {name[:200]!r}, which was not dropped; drop both together")


def files_of(state: State) -> dict[str, bytes]:
    """Name and content of every tyre file of a state and of what is pinned that was loaded on the page.

    Parameters
    ----------
    state : State
    """
    names = [name for one in (state, *map(parse_state, state.pins)) for name in tyre_names(one.content)]
    return TYRES.content(list(dict.fromkeys(names)))


def kept_here(state: State) -> list[str]:
    """What must be said of the address of a state: files that it does not hold.

    Parameters
    ----------
    state : State
    """
    files = ", ".join(files_of(state))
    said = f"the address does not hold {files}: elsewhere, drop that on the page first; a saved page has it inside"
    return [said] if files else []


def with_tyres(content: Mapping[str, Any], change: Any) -> dict[str, Any]:
    """The ``content`` of a model file with every name of a tyre as ``change`` makes it of the present one."""
    effects = content.get("effects")
    if not isinstance(effects, Mapping):
        return dict(content)

    def of(tyre: Any) -> Any:
        if isinstance(tyre, Mapping):
            return {wheel: of(one) for wheel, one in tyre.items()}
        return change(tyre) if isinstance(tyre, str) else tyre

    made = {
        name: dict(table) | {"tyre": of(table["tyre"])} if isinstance(table, Mapping) and "tyre" in table else table
        for name, table in effects.items()
    }
    return dict(content) | {"effects": made}
