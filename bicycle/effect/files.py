"""Where effects are found: the package's own files, installed packages, and Python files of a user."""

import importlib
import pkgutil
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import reduce
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

from bicycle.derivation.mistakes import line_of, said
from tyre.base.errors import InputError

T = TypeVar("T")
PACKAGED = "bicycle.effects"
GROUP = "velotyre.effects"  # entry points of installed packages
LOADED = "velotyre_outside_effects"  # package, in this process only, of the files of users
GUIDE = "docs/add_an_effect.md shows one"


@dataclass(frozen=True)
class Origin:
    """Where the class of an effect stands, in words that another process understands.

    ``file`` is the user's file, None where ``module`` can be imported; ``name`` is that of the class.
    """

    module: str
    name: str
    file: Path | None = None

    @classmethod
    def of(cls, effect: type) -> "Origin":
        """The origin of a class.

        Parameters
        ----------
        effect : type
        """
        loaded = effect.__module__.startswith(f"{LOADED}.")
        file = Path(str(sys.modules[effect.__module__].__file__)) if loaded else None
        return cls(effect.__module__, effect.__qualname__, file)

    @property
    def digest(self) -> str:
        """SHA-256 of the file that the class stands in."""
        file = self.file or Path(str(sys.modules[self.module].__file__))
        return _digest(file.read_bytes())

    def check_importable(self) -> None:
        """Refuse a class that only this session knows.

        Raises
        ------
        InputError
            It stands in a session or a function, where no other process can find it.
        """
        session = self.module == "__main__" and not hasattr(sys.modules["__main__"], "__file__")
        if session or "<locals>" in self.name:
            raise InputError(
                f"the effect {self.name} of {self.module} cannot be imported by a worker process; put it into a file "
                "and load that with load_effects, or work in one process"
            )

    def found(self) -> Any:
        """The class, imported from its module."""
        return reduce(getattr, self.name.split("."), importlib.import_module(self.module))


def packaged_classes(base: type[T]) -> Iterator[type[T]]:
    """Subclasses of ``base`` in the modules of ``bicycle.effects``.

    Parameters
    ----------
    base : type
        The class Effect.
    """
    package = importlib.import_module(PACKAGED)
    for module in pkgutil.iter_modules(package.__path__):
        yield from _classes(importlib.import_module(f"{PACKAGED}.{module.name}"), base)


def installed_classes(base: type[T]) -> Iterator[tuple[type[T], str]]:
    """Subclasses of ``base`` that installed packages offer as entry points, and what an error calls their place.

    Parameters
    ----------
    base : type
        The class Effect.

    Raises
    ------
    InputError
        An entry point that cannot be imported or names neither an effect nor a module with effects.
    """
    from importlib.metadata import entry_points

    for entry in entry_points(group=GROUP):
        package = entry.dist.name if entry.dist else entry.value
        where = f"the installed package {package} (entry point {entry.name} = {entry.value} of {GROUP})"
        try:
            thing = entry.load()
        except Exception as error:
            raise InputError(f"{where} cannot be imported: {said(error)}; mend or uninstall it") from error
        found = list(_classes(thing, base)) if isinstance(thing, ModuleType) else [thing]
        if not found or not all(isinstance(kind, type) and issubclass(kind, base) for kind in found):
            raise InputError(f"{where} is neither an Effect nor a module with effects; mend or uninstall it")
        yield from ((kind, where) for kind in found)


def classes_of_file(path: Path, base: type[T]) -> tuple[type[T], ...]:
    """Subclasses of ``base`` that a Python file defines; a file that has not changed is run once only.

    Parameters
    ----------
    path : Path
    base : type
        The class Effect.

    Raises
    ------
    InputError
        No such file, no Python, an error when it is run, or no effect in it.
    """
    if path.suffix != ".py":
        raise InputError(f"{path}: effects stand in a Python file, its name ends in .py; {GUIDE}")
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); give a Python file with an Effect") from error
    name = f"{LOADED}.of_{_digest(str(path.resolve()).encode())[:12]}.{path.stem}"
    digest = _digest(content)
    module = sys.modules.get(name)
    if module is None or vars(module).get("__digest__") != digest:
        module = _run(path, name)
        vars(module)["__digest__"] = digest
    found = tuple(_classes(module, base))
    if not found:
        raise InputError(f"{path}: defines no effect; write a class that inherits from bicycle.Effect ({GUIDE})")
    return found


class _Uncached(SourceFileLoader):
    """Reads the source itself: a cache of compiled files takes two states of one second and one length for the same."""

    def get_code(self, fullname: str) -> Any:
        return self.source_to_code(self.get_data(self.path), self.path)


def _run(path: Path, name: str) -> ModuleType:
    at = str(path.resolve())
    spec = spec_from_file_location(name, at, loader=_Uncached(name, at))
    assert spec is not None
    assert spec.loader is not None
    for parent in (LOADED, name.rpartition(".")[0]):  # pickle imports what stands before the dots
        sys.modules.setdefault(parent, ModuleType(parent))
    module, former = module_from_spec(spec), sys.modules.get(name)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:  # a script that ends itself would end the command without a word
        sys.modules.pop(name)
        if former is not None:
            sys.modules[name] = former
        if isinstance(error, SyntaxError):
            raise InputError(f"{path}, line {error.lineno}: this is not Python ({error.msg}); mend the line") from error
        if isinstance(error, InputError):
            raise InputError(f"{path}: {error}") from error
        raise InputError(f"{path}{line_of(error, path)}: the file cannot be run: {said(error)}; mend it") from error
    return module


def _classes(module: ModuleType, base: type[T]) -> Iterator[type[T]]:
    for thing in list(vars(module).values()):
        if isinstance(thing, type) and issubclass(thing, base) and thing.__module__ == module.__name__:
            yield thing


def _digest(content: bytes) -> str:
    import hashlib

    return hashlib.sha256(content).hexdigest()
