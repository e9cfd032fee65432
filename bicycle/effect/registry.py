"""Effects: which there are, packaged, of installed packages and of a user's files; what one is, its base class says."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import MappingProxyType

from bicycle.effect.base import Effect
from bicycle.effect.declaration import check_declaration
from bicycle.effect.files import Origin, classes_of_file, installed_classes, packaged_classes
from tyre.base.errors import InputError, unknown


def registry() -> Mapping[str, type[Effect]]:
    """Every effect there is by identifier, sorted: packaged, of installed packages, and registered.

    Raises
    ------
    InputError
        An installed package whose effects cannot be had.
    """
    return _known(tuple(_outside.values()))


@cache
def packaged_effects() -> Mapping[str, type[Effect]]:
    """The effects of ``bicycle.effects`` by identifier, sorted."""
    found: Iterable[type[Effect]] = packaged_classes(Effect)
    return MappingProxyType(dict(sorted((effect.identifier, effect) for effect in found)))


@cache
def _known(outside: tuple[type[Effect], ...]) -> Mapping[str, type[Effect]]:
    return MappingProxyType(dict(sorted([*_installed().items(), *((effect.identifier, effect) for effect in outside)])))


@cache
def _installed() -> Mapping[str, type[Effect]]:
    """Packaged effects and those of installed packages, which are looked up when first asked for."""
    found = dict(packaged_effects())
    for effect, where in installed_classes(Effect):
        check_declaration(effect, found, where)
        found[effect.identifier] = effect
    return found


def effect_class(identifier: str) -> type[Effect]:
    """Look an effect up by identifier; InputError lists the known ones.

    Parameters
    ----------
    identifier : str
    """
    if identifier in packaged_effects():
        return packaged_effects()[identifier]
    known = registry()
    if identifier not in known:
        raise InputError(
            f"{unknown('effect', identifier, known)}; one of your own needs --effects FILE or load_effects"
        )
    return known[identifier]


_outside: dict[str, type[Effect]] = {}  # registered in this process, by identifier


def register(effect: type[Effect], *, where: str = "") -> type[Effect]:
    """Make an effect from outside the package known everywhere; of use as a decorator.

    Parameters
    ----------
    effect : subclass of Effect
    where : str
        What an error calls its place, by default its module.

    Returns
    -------
    type
        The effect itself.

    Raises
    ------
    InputError
        Its identifier is taken by another effect, or the declaration is wrong or incomplete.
    """
    known = registry()
    if known.get(getattr(effect, "identifier", "")) is not effect:
        check_declaration(effect, known, where or f"{effect.__module__}.{effect.__qualname__}")
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
    file, classes = Path(path), classes_of_file(Path(path), Effect)
    for identifier in [name for name, effect in _outside.items() if Origin.of(effect).file == file.resolve()]:
        if _outside[identifier] not in classes:
            del _outside[identifier]
    for effect in classes:
        register(effect, where=str(file))
    return classes


@contextmanager
def outside_effects(paths: Iterable[str | Path]) -> Iterator[None]:
    """Effects of files (:func:`load_effects`) that are known until the end of the block.

    Parameters
    ----------
    paths : iterable of str or Path
        Python files.
    """
    before = dict(_outside)
    try:
        for path in paths:
            load_effects(path)
        yield
    finally:
        _outside.clear()
        _outside.update(before)


def outside_origins() -> tuple[Origin, ...]:
    """Where the registered effects come from: what another process needs to :func:`take_over`."""
    return tuple(Origin.of(effect) for effect in _outside.values())


def take_over(origins: Iterable[Origin]) -> None:
    """Register in this process what another one knows.

    Parameters
    ----------
    origins : iterable of Origin
        Of :func:`outside_origins` there.

    Raises
    ------
    InputError
        A file that this process cannot read, as :func:`load_effects`.
    """
    for origin in origins:
        if origin.file is not None:
            load_effects(origin.file)
        else:
            register(origin.found())
