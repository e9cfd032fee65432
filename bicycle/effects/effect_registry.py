"""All effects: packaged, of installed packages, and of a user's files."""

import importlib
import math
import pkgutil
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, reduce
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any

from bicycle.effects.effect import Effect, Parameter
from bicycle.equations.declarations import BASE_MODES, Mode
from bicycle.equations.evaluation import line_of
from bicycle.parameters.bicycle import UNITS
from tyre.ground.errors import InputError, is_number, refuse_unknown, shown
from tyre.ground.units import is_si
from tyre.ground.workers import worker_pool

GROUP = "velotyre.effects"  # entry points of installed packages
LOADED = "velotyre_outside_effects"  # package, in this process only, of the files of users
GUIDE = "docs/effects.md shows one"


@dataclass(frozen=True)
class Origin:
    """Place of the class of an effect, which another process can follow."""

    module: str  # that defines the class
    name: str  # of the class, with what it stands in before a dot
    file: Path | None = None  # of a user's effect; None: the module is installed

    @classmethod
    def from_class(cls, effect: type) -> "Origin":
        """The origin of a class."""
        loaded = effect.__module__.startswith(f"{LOADED}.")
        file = Path(str(sys.modules[effect.__module__].__file__)) if loaded else None
        return cls(effect.__module__, effect.__qualname__, file)

    @property
    def digest(self) -> str:
        """SHA-256 of the file that defines the class."""
        return _digest((self.file or Path(str(sys.modules[self.module].__file__))).read_bytes())

    def load(self) -> Any:
        """The class, imported from its module."""
        return reduce(getattr, self.name.split("."), importlib.import_module(self.module))


_digest_of_module: dict[str, str] = {}
"""Name of the module of a user's file -> SHA-256 of the text that it was run from."""


def _classes_of_file(path: Path) -> tuple[type[Effect], ...]:
    """Effects that a Python file defines; a file that has not changed is run once only."""
    if path.suffix != ".py":
        raise InputError(f"{path}: give a Python file with effects, whose name ends in .py; {GUIDE}")
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); give a Python file with an Effect") from error
    name = f"{LOADED}.of_{_digest(str(path.resolve()).encode())[:12]}.{path.stem}"
    digest = _digest(content)
    module = sys.modules.get(name)
    if module is None or _digest_of_module.get(name) != digest:
        module = _run(path, name, content)
        _digest_of_module[name] = digest
    effects = tuple(_classes(module))
    if not effects:
        raise InputError(f"{path}: defines no effect; write a class that inherits from bicycle.Effect ({GUIDE})")
    return effects


def _run(path: Path, name: str, content: bytes) -> ModuleType:
    """Run the source itself: a cache of compiled files takes two states of one second and one length for the same."""
    for parent in (LOADED, name.rpartition(".")[0]):  # pickle imports what stands before the dots
        sys.modules.setdefault(parent, ModuleType(parent))
    module, former = ModuleType(name), sys.modules.get(name)
    module.__file__ = str(path.resolve())
    sys.modules[name] = module
    try:
        exec(compile(content, module.__file__, "exec"), vars(module))
    except (Exception, SystemExit) as error:  # a script that ends itself would end the command without a word
        sys.modules.pop(name)
        if former is not None:
            sys.modules[name] = former
        if isinstance(error, SyntaxError):
            raise InputError(
                f"{path}, line {error.lineno}: this is not Python ({error.msg}); correct the line"
            ) from error
        if isinstance(error, InputError):
            raise InputError(f"{path}: {error}") from error
        why = f"{type(error).__name__}: {error}"
        raise InputError(f"{path}{line_of(error, path)}: the file cannot be run: {why}; correct it") from error
    return module


def _classes(module: ModuleType) -> Iterator[type[Effect]]:
    for value in list(vars(module).values()):
        if issubclass(type(value), type) and issubclass(value, Effect) and value.__module__ == module.__name__:
            yield value


def _digest(content: bytes) -> str:
    import hashlib

    return hashlib.sha256(content).hexdigest()


def check_declaration(effect: type[Effect], effects: Mapping[str, type[Effect]], where: str) -> None:
    """Refuse an effect whose declaration is wrong or incomplete, or that takes the place of another."""
    name = effect.identifier
    if name in effects:
        present = Origin.from_class(effects[name])
        raise InputError(
            f"{where}: the effect {name!r} exists already ({present.file or present.module}); give the class another "
            "identifier, or its file another name"
        )
    wrong = next(_mistakes(effect, effects), None)
    if wrong:
        raise InputError(f"{where}: effect {name!r}: {wrong}; {GUIDE}")


def _mistakes(effect: type[Effect], effects: Mapping[str, type[Effect]]) -> Iterator[str]:
    if not _is_name(effect.identifier):
        yield 'its identifier has other than small letters, digits and underscores; write identifier = "a_name"'
    if effect.apply.__qualname__ == "Effect.apply":
        yield "it has no method apply(self, model), which adds it to the equations"
    texts = {
        "a docstring": effect.description,
        "source (where its equation is from)": effect.source,
        "signature (what one sees)": effect.signature,
    }
    for item, text in texts.items():
        if not isinstance(text, str) or not text.strip():
            yield f"it lacks {item}; a phrase will do"
    provided = {capability for kind in (*effects.values(), effect) for capability in kind.provides}
    for need in sorted(set(effect.requires) - provided):
        yield f"it requires {need!r}, which no effect provides; there are {', '.join(sorted(provided))}"
    if effect.requires and not effect.why:
        yield "it requires something and does not state why = ..."
    for parameter in effect.parameters:
        yield from _wrong_parameter(parameter)
    for mode in effect.modes:
        yield from _wrong_mode(mode, {mode.name: mode for kind in effects.values() for mode in kind.modes})


def _is_name(text: str) -> bool:
    return re.fullmatch("[a-z][a-z0-9_]*", text) is not None


def _wrong_parameter(p: Parameter) -> Iterator[str]:
    if not all(isinstance(text, str) and text.strip() for text in (p.unit, p.description)):
        yield f"{p.name} has no unit or no meaning; write Parameter('N m/rad', 'of the hinge', ...)"
    elif not is_si(p.unit):  # files, sliders and priors take its numbers for SI
        yield (
            f"{p.name}: unit = {shown(p.unit)} is not one of kg, m, s, rad, N, Pa and what they make without a prefix; "
            "write for example N m s/rad, kg m^2 or 1/s, and 1 where there is none"
        )
    low, high = p.bounds
    soft, stiff = p.typical
    if not low <= soft < stiff <= high:
        yield f"{p.name}: typical {soft:g} .. {stiff:g} is not within the bounds {low:g} .. {high:g}"
    if isinstance(p.default, str) and p.default not in UNITS:
        yield f"{p.name}: default = {p.default!r} must be a number or a parameter of the bicycle"
    for field, value in (("default", p.default), ("neutral", p.neutral)):
        if value is not None and not isinstance(value, str) and not (is_number(value) and low <= value <= high):
            yield f"{p.name}: {field} = {shown(value)} is outside the bounds {low:g} .. {high:g}"
    # the least size must leave something of the typical range to be named
    if not is_number(p.least) or not 0 <= p.least < math.inf:
        yield f"{p.name}: least = {shown(p.least)} must be a size in {p.unit}, 0 or more"
    elif p.neutral == math.inf:
        if 0 < p.least <= soft:
            yield (
                f"{p.name}: least = {p.least:g} {p.unit} is the stiffness above which it does not matter, so it must "
                f"be above the softest typical one, {soft:g}"
            )
    elif p.neutral is not None and p.least >= max(abs(soft - p.neutral), abs(stiff - p.neutral)):
        yield f"{p.name}: least = {p.least:g} {p.unit} is as large as anything typical; nothing would be named"


def _wrong_mode(mode: Any, declared_modes: Mapping[str, Mode]) -> Iterator[str]:
    if not isinstance(mode, Mode):
        yield f"modes holds {shown(mode)}; write modes = (Mode('a_name'),)"
        return
    base = [declared.name for declared in BASE_MODES]
    if mode.name in base or mode.name.startswith("other") or not _is_name(mode.name):
        yield (
            f"a mode is called {mode.name!r}: the names {', '.join(base)} and other_1 ... are taken, and a name has "
            "small letters, digits and underscores only"
        )
    if declared_modes.get(mode.name, mode) != mode:
        yield f"the mode {mode.name!r} is declared differently by another effect; give it another name"
    looks = {
        declared.look: declared.name
        for declared in (*BASE_MODES, *declared_modes.values())
        if declared.name != mode.name
    }
    if mode.look is not None and mode.look in looks:
        yield f"look = {mode.look} is that of {looks[mode.look]}; leave it out and the mode gets one of its own"


def registry() -> Mapping[str, type[Effect]]:
    """Every effect there is by identifier, sorted: packaged, of installed packages, and registered.

    Raises
    ------
    InputError
        An installed package whose effects cannot be had.
    """
    return _effects_with(tuple(_outside.values()))


NO_EFFECTS = ("effect", "effect_docs", "effect_registry", "sprung_joint")
"""Files of ``bicycle.effects`` that hold what all effects share."""


@cache
def packaged_effects() -> Mapping[str, type[Effect]]:
    """The effects of ``bicycle.effects`` by identifier, sorted."""
    package = importlib.import_module("bicycle.effects")
    files = [module.name for module in pkgutil.iter_modules(package.__path__)]
    names = [f"{package.__name__}.{file}" for file in files if file not in NO_EFFECTS]
    effects = [effect for name in names for effect in _classes(importlib.import_module(name))]
    return MappingProxyType({effect.identifier: effect for effect in sorted(effects, key=lambda kind: kind.identifier)})


@cache
def _effects_with(outside: tuple[type[Effect], ...]) -> Mapping[str, type[Effect]]:
    return MappingProxyType(
        dict(sorted([*_installed_effects().items(), *((effect.identifier, effect) for effect in outside)]))
    )


@cache
def _installed_effects() -> Mapping[str, type[Effect]]:
    """Packaged effects and those that installed packages offer as entry points, looked up when first asked for."""
    from importlib.metadata import entry_points

    by_identifier = dict(packaged_effects())
    for entry in entry_points(group=GROUP):
        package = entry.dist.name if entry.dist else entry.value
        where = f"the installed package {package} (entry point {entry.name} = {entry.value} of {GROUP})"
        try:
            loaded = entry.load()
        except Exception as error:
            why = f"{type(error).__name__}: {error}"
            raise InputError(f"{where} cannot be imported: {why}; correct or uninstall it") from error
        effects = list(_classes(loaded)) if isinstance(loaded, ModuleType) else [loaded]
        if not effects or not all(isinstance(kind, type) and issubclass(kind, Effect) for kind in effects):
            raise InputError(f"{where} is neither an Effect nor a module with effects; correct or uninstall it")
        for effect in effects:
            check_declaration(effect, by_identifier, where)
            by_identifier[effect.identifier] = effect
    return by_identifier


def effect_class(identifier: str) -> type[Effect]:
    """Look an effect up by its ``identifier``; InputError lists the known ones."""
    if identifier in packaged_effects():
        return packaged_effects()[identifier]
    effects = registry()
    refuse_unknown("effect", [identifier], effects, more="one of your own needs --effects FILE or load_effects")
    return effects[identifier]


_outside: dict[str, type[Effect]] = {}  # registered in this process, by identifier


def register(effect: type[Effect], *, where: str = "") -> type[Effect]:
    """Make an effect from outside the package known everywhere; of use as a decorator."""
    effects = registry()
    if effects.get(getattr(effect, "identifier", "")) is not effect:
        check_declaration(effect, effects, where or f"{effect.__module__}.{effect.__qualname__}")
        _outside[effect.identifier] = effect
    return effect


def load_effects(path: str | Path) -> tuple[type[Effect], ...]:
    """Register every effect that a Python file defines; read again, a changed file takes the place of the former one.

    Parameters
    ----------
    path : str or Path
        The file; effects in it are called as the file unless they state an ``identifier``.

    Returns
    -------
    tuple of type
        The effects.

    Raises
    ------
    InputError
        No such file, no Python, no effect in it, an identifier that is taken, or a wrong declaration.
    """
    file, classes = Path(path), _classes_of_file(Path(path))
    for identifier, effect in list(_outside.items()):
        if Origin.from_class(effect).file == file.resolve() and effect not in classes:
            del _outside[identifier]
    for effect in classes:
        register(effect, where=str(file))
    return classes


@contextmanager
def outside_effects(paths: Iterable[str | Path]) -> Iterator[None]:
    """Effects of files (:func:`load_effects`) that are known until the end of the block."""
    before = dict(_outside)
    try:
        for path in paths:
            load_effects(path)
        yield
    finally:
        _outside.clear()
        _outside.update(before)


def outside_origins() -> tuple[Origin, ...]:
    """Origins of the registered effects, which another process needs to :func:`take_over`."""
    return tuple(Origin.from_class(effect) for effect in _outside.values())


def take_over(origins: Iterable[Origin]) -> None:
    """Register in this process what another one knows."""
    for origin in origins:
        if origin.file is not None:
            load_effects(origin.file)
        else:
            register(origin.load())


@contextmanager
def model_workers(jobs: int) -> Iterator[ProcessPoolExecutor]:
    """Open a :func:`tyre.ground.workers.worker_pool` for work on models."""
    origins = outside_origins()
    for origin in origins:
        session = origin.module == "__main__" and not hasattr(sys.modules["__main__"], "__file__")
        if session or "<locals>" in origin.name:
            raise InputError(
                f"the effect {origin.name} of {origin.module} cannot be imported by a worker process; put it into a "
                "file and load that with load_effects, or work in one process"
            )
    with worker_pool(jobs, prepare=take_over if origins else None, arguments=(origins,) if origins else ()) as pool:
        yield pool
