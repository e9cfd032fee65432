"""Files: written completely or not at all, packaged data, folders of users, TOML."""

import os
import re
import shutil
import tomllib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from importlib import import_module, resources
from importlib.resources.abc import Traversable
from itertools import accumulate, chain, count, islice, takewhile
from pathlib import Path
from typing import Any

from tyre.ground.errors import InputError

DEEPEST, LARGEST = 50, 1_000_000  # tables in tables; bytes of a file that people write, and numbers of a level in it
_WORDS = ("source", "description", "note", "notes", "name", "comment")  # keys that name no file
_OPEN_FILES = ("/dev", "/dev/fd", "/proc/self/fd")  # folders whose links stand for open files of the process


@contextmanager
def replacing(target: str | Path) -> Iterator[Path]:
    """Give a file to write next to ``target`` (with its ending); at the end of the block it replaces the target.

    A link is replaced too, not the file behind it, whose name was not given. Only a link that stands for an open file
    of the process (``/dev/stdout``) is written through, as a device is.
    """
    target_text, target = str(target), Path(target)
    if target.is_dir():
        raise IsADirectoryError(21, "is a folder; give a file", target_text)
    if not target.parent.is_dir():
        raise FileNotFoundError(2, f"there is no folder {target.parent.as_posix()}; make it first", target_text)
    open_file = target.is_symlink() and target.absolute().parent.as_posix() in _OPEN_FILES
    device = target.exists() and (open_file or not target.is_file())
    part = target if device else target.with_name(f".{target.stem}.part{os.getpid()}{target.suffix}")
    try:
        yield part
        if not device:
            with part.open("rb+") as file:
                os.fsync(file.fileno())
            if target.exists() and not target.is_symlink():
                shutil.copymode(target, part)
            os.replace(part, target)
    except OSError as error:
        unnamed = error.filename is None  # as on a full disk
        if error.errno is not None and (unnamed or str(error.filename) == str(part)):
            error.filename = target_text
        raise
    finally:
        if not device:
            with suppress(OSError):  # a read-only disk refuses it even where there is none: the first error is the one
                part.unlink()


def make_folder(folder: Path) -> None:
    """Make a ``folder`` for results if it is missing; a file or a link that leads nowhere on the way is refused."""
    for part in (*reversed(folder.parents), folder):
        if os.path.lexists(part) and not part.is_dir():
            what = "is a file" if part.exists() else "is a link that leads nowhere"
            raise InputError(f"{part} {what}; give a folder for the results")
    folder.mkdir(parents=True, exist_ok=True)


@contextmanager
def hold_folder(folder: Path, wait: Callable[[], None]) -> Iterator[None]:
    """Hold a file or ``folder`` during the block, if the system can; if another holds it, call ``wait``, then wait."""
    try:
        import fcntl
    except ImportError:  # Windows
        yield
        return
    number = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(number, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            wait()
            fcntl.flock(number, fcntl.LOCK_EX)
        except OSError:  # a file system without locks
            pass
        yield
    finally:
        os.close(number)


def left_by_a_killed_run(name: str) -> bool:
    """True if a file called ``name`` is one that :func:`replacing` gave and never put in its place."""
    return re.fullmatch(r"\..+\.part\d+(\.\w+)?", name) is not None


def clear_of_killed_runs(folder: Path) -> None:
    """Remove what killed runs left in a ``folder`` (see :func:`left_by_a_killed_run`)."""
    for file in folder.iterdir():
        if left_by_a_killed_run(file.name):
            file.unlink(missing_ok=True)


def write_text(target: str | Path, text: str) -> None:
    """Write ``text`` to ``target`` in UTF-8, completely or not at all."""
    with replacing(target) as part:
        part.write_text(text, encoding="utf-8", newline="\n")


def write_bytes(target: str | Path, content: bytes) -> None:
    """Write ``content`` to ``target``, completely or not at all."""
    with replacing(target) as part:
        part.write_bytes(content)


def files_below(folder: Path, most: int = 20_000) -> list[Path]:
    """List the files below a ``folder``, sorted; a whole disk is refused."""
    paths = list(islice(folder.rglob("*"), most + 1))
    if len(paths) > most:
        raise InputError(f"{folder}: holds more than {most} files and folders; give a folder of what is meant alone")
    return [path for path in sorted(paths) if path.is_file()]


def slug(name: str) -> str:
    """Make a name fit for a file: letters, digits, ``-`` and ``_``."""
    return "".join(letter if letter.isalnum() or letter in "-_" else "_" for letter in name)


def slugs(names: Iterable[str]) -> dict[str, str]:
    """Make names fit for files, no two alike even without capitals: the next one ends in ``_2``."""
    slug_by_name: dict[str, str] = {}
    used_slugs: set[str] = set()
    for name in names:
        if name in slug_by_name:
            continue
        stem = slug(name)
        candidates = chain([stem], (f"{stem}_{number}" for number in count(2)))
        slug_by_name[name] = next(candidate for candidate in candidates if candidate.casefold() not in used_slugs)
        used_slugs.add(slug_by_name[name].casefold())
    return slug_by_name


def data_root() -> Traversable:
    """Return the folder with ``tyres/``, ``bicycles/`` and ``measured/``."""
    try:
        import_module("tyre.data")
    except ModuleNotFoundError:
        return Path(__file__).resolve().parents[2] / "data"
    return resources.files("tyre.data")


def refuse_without_ending(kind: str, name: object) -> None:
    """Refuse a ``name`` of a ``kind`` of file that lacks the ending of the file that was meant."""
    if Path(f"{name}.toml").is_file():
        raise InputError(f"unknown {kind} {str(name)!r}; did you mean the file {name}.toml?")


def refuse_special(path: Path | Traversable) -> None:
    """Refuse what is neither a file nor a folder: a pipe waits for ever, and a device never ends."""
    if isinstance(path, Path) and path.exists() and not (path.is_file() or path.is_dir()):
        raise InputError(f"{path}: is a pipe or a device; write what comes out of it to a file and give that")


def read_text(path: Path | Traversable, *, fallback: str = "") -> str:
    """Read a text in UTF-8, with or without a byte-order mark, else in the encoding ``fallback`` if one is given."""
    refuse_special(path)
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        if fallback:
            return raw.decode(fallback, errors="replace")
        raise InputError(f"{path}: not text in UTF-8 ({error.reason}); save it in UTF-8") from error


def own_ends(files: Iterable[Path]) -> dict[Path, str]:
    """Shorten each path to its end that no other has: ``a/run.csv``, ``b/run.csv``, but ``two.csv``."""
    distinct = list(dict.fromkeys(files))
    ends = {}
    for file in distinct:
        other_parts = [distinct_file.parts for distinct_file in distinct if distinct_file != file]
        length = 1
        while length < len(file.parts) and any(parts[-length:] == file.parts[-length:] for parts in other_parts):
            length += 1
        ends[file] = Path(*file.parts[-length:]).as_posix()
    return ends


def named_folder(name: str, beside: Path) -> Path:
    """Find the folder that a file names, relative to it, or below an environment variable (``$NAME/...``)."""
    first, *below_first = Path(name).parts or ("",)
    folder = beside / name
    if first.startswith("$"):
        variable = first.removeprefix("$")
        root_text = os.environ.get(variable, "")
        if not root_text:
            raise InputError(
                f"folder = {name!r}: the environment variable {variable} is not set; set it to the folder that holds "
                f"{'/'.join(below_first) or 'the recordings'}, or write the folder itself"
            )
        folder = Path(root_text, *below_first)
        root = Path(os.path.realpath(root_text))
        if _home_or_root(root) or not Path(os.path.realpath(folder)).is_relative_to(root):
            raise InputError(f"folder = {name!r}: the variable must name a folder, not a home or a disk, that holds it")
    if not folder.is_dir():
        raise InputError(f"folder = {name!r}: there is no folder {folder}; give the one that holds the recordings")
    return folder


def texts_in(content: Any) -> Iterator[str]:
    """Give every text of a TOML file that may name another file: all but its words on itself."""
    if isinstance(content, str):
        yield content
        if "#" in content:  # a row of a table: bicycles.csv#NAME
            yield content.rpartition("#")[0]
    elif isinstance(content, dict):
        yield from texts_in([value for key, value in content.items() if key not in _WORDS])
    elif isinstance(content, list):
        for value in content:
            yield from texts_in(value)


def _home_or_root(folder: Path) -> bool:
    return folder.parent == folder or str(folder) == os.path.realpath(os.path.expanduser("~"))


def refuse_outside(content: Any, path: Path) -> None:
    """Refuse the file at ``path`` if its ``content`` names files, links followed, that it has no business with.

    It may name what lies in its own folder or in the one above (neither the root nor the home of a user), in the
    working folder, among the packaged data, and in folders that the environment names as ``VELOTYRE_...``.
    """
    own_folder = Path(os.path.realpath(path.parent))
    named = [value for key, value in os.environ.items() if key.startswith("VELOTYRE_") and os.path.isabs(value)]
    wide = [Path(os.path.realpath(folder)) for folder in (str(own_folder.parent), os.getcwd(), *named)]
    allowed = [own_folder, *(folder for folder in wide if not _home_or_root(folder)), Path(str(data_root()))]
    for text in texts_in(content):
        if not 1 < len(text) < 1024 or "\0" in text:
            continue
        parts = Path(text).parts
        head = Path(*takewhile(lambda part: not set(part) & set("*?["), parts))  # of a pattern
        depths = accumulate(-1 if part == ".." else 1 for part in parts)
        if not (os.path.lexists(own_folder / head) or min(depths) < -1):
            continue
        places = (
            os.path.realpath(own_folder / head),
            os.path.normpath(own_folder / text if len(head.parts) < len(parts) else own_folder),
        )
        if not all(any(Path(place).is_relative_to(folder) for folder in allowed) for place in places):
            raise InputError(
                f"{path}: names {text!r}, which lies outside its folder and the one above; copy it there, run in a "
                "folder that holds both, or name its folder in an environment variable VELOTYRE_FOLDER"
            )


def refuse_deep(content: Any, where: str) -> Any:
    """Refuse tables and lists that hold each other deeper, or in larger number, than anyone writes; else give them."""
    level = [content]
    for _ in range(DEEPEST + 1):
        members = [
            entry.values() if isinstance(entry, dict) else entry for entry in level if isinstance(entry, dict | list)
        ]
        if not members:
            return content
        level = list(islice(chain.from_iterable(members), LARGEST))
        if len(level) == LARGEST:  # of lists that YAML names again and again
            break
    raise InputError(f"{where}: lists or tables are more than {DEEPEST} deep, or hold {LARGEST} things; write it flat")


def read_toml(path: Path | Traversable, kind: str, *, where: str = "", absent: str = "") -> dict[str, Any]:
    """Read a TOML file in UTF-8 that names no file outside (:func:`refuse_outside`).

    Messages call it a ``kind`` and begin with ``where``; ``absent``: of no file.
    """
    where = where or str(path)
    refuse_special(path)
    try:
        written = path.read_bytes()
        content = tomllib.loads(written.decode("utf-8-sig")) if len(written) <= LARGEST else {}
    except FileNotFoundError as error:
        raise InputError(f"{where}: {absent or f'no such {kind}'}") from error
    except OSError as error:
        raise InputError(f"{where}: cannot be read as a {kind} ({error.strerror})") from error
    except (ValueError, RecursionError) as error:  # a number of thousands of digits is a ValueError, too
        raise InputError(f"{where}: not a TOML file: {error}") from error
    if len(written) > LARGEST:
        raise InputError(f"{where}: {len(written)} bytes are no {kind}, which holds at most {LARGEST}")
    refuse_deep(content, where)
    if isinstance(path, Path):
        refuse_outside(content, path)
    return content
