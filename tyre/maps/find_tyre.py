"""A tyre by its name or file, whatever describes it: a measured table, a .tir file or Pacejka-89 coefficients."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from tyre.formats.sheet import split_row
from tyre.ground.errors import InputError
from tyre.ground.files import data_root, read_toml
from tyre.maps.map_files import available_tyres, no_tyre
from tyre.maps.tyre_map import TyreMap
from tyre.measured.properties import TyreSource

if TYPE_CHECKING:
    from tyre.laws.pacejka89 import Pacejka89Tyre

CHOICE = "?camber_moment="
"""Separates a .tir file from its moment of camber: ``my.tir?camber_moment=book``."""

FILE_ENDINGS = (".csv", ".tir", ".toml", ".json", ".yaml", ".yml", ".mat")


def is_file_name(tyre: str) -> bool:
    """True if a tyre is given by a file, not by name."""
    return str(split_row(tyre)[0]).lower().partition(CHOICE)[0].endswith(FILE_ENDINGS)


def read_tyre(tyre: str | Path, *, surface: str | None = None, camber_moment: str | None = None) -> TyreSource:
    """Return a packaged tyre, or that of a file.

    Parameters
    ----------
    tyre : str or Path
        Name of a packaged tyre (a measured table or Pacejka-89 coefficients), or a file: a table (``.csv`` with its
        ``.toml``, or a plain one with units in its header; ``two_tyres.csv#A`` is one of several tyres), a tyre
        property file (``.tir``), a ``.toml`` of ``kind = "pacejka89"``, or the same mapping as ``.json``, ``.yaml`` or
        ``.mat``.
    surface : str, optional
        ``flat`` or ``drum``: of a packaged tyre measured on both (flat if none is given); of any other its own.
    camber_moment : str, optional
        Moment of a leaning tyre of a .tir file of MF-Tyre 6.1 or 6.2: ``software`` (default) or ``book``.

    Returns
    -------
    TyreSource
        A `TyreMap`, `TirTyre` or `Pacejka89Tyre`, which answer alike: ``at(load=, pressure=)``.

    Raises
    ------
    InputError
        No such tyre or file, or a surface on which it was not measured.
    """
    name, _, choice = str(tyre).partition(CHOICE)
    choice, tables, formulas = camber_moment or choice, available_tyres(), packaged_formulas()
    if choice and not name.lower().endswith(".tir"):
        raise InputError(f"{name}: camber_moment = {choice!r} is of a .tir file (MF-Tyre 6.1, 6.2); leave it out")
    if name in tables:
        return TyreMap.load(name, surface=surface or "flat")
    if not is_file_name(name) and name not in formulas:
        raise no_tyre(name, [*tables, *formulas], f"; or give a file ({', '.join(FILE_ENDINGS)})")
    source = _from_file(Path(name), choice) if is_file_name(name) else formulas[name]
    if surface and surface != source.surface:
        raise InputError(
            f"{name} was not measured on surface '{surface}', only on: {source.surface}; leave surface out"
        )
    return source


@cache
def packaged_formulas() -> Mapping[str, "Pacejka89Tyre"]:
    """Return the packaged tyres that are given by coefficients, by name."""
    from tyre.laws.pacejka89 import read_pacejka89

    folder = data_root() / "tyres"
    files = sorted((item for item in folder.iterdir() if item.name.endswith(".toml")), key=lambda item: item.name)
    tyres = [
        read_pacejka89(file) for file in files if not (folder / f"{file.name.removesuffix('.toml')}.csv").is_file()
    ]
    return MappingProxyType({tyre.tyre: tyre for tyre in tyres})


def _from_file(path: Path, camber_moment: str = "") -> TyreSource:
    ending = split_row(str(path))[0].suffix.lower()
    if ending == ".tir":
        from tyre.laws.tir import read_tir

        return replace(read_tir(path), camber_moment=camber_moment) if camber_moment else read_tir(path)
    from tyre.laws.pacejka89 import KIND, SIDE, read_pacejka89

    if ending not in (".csv", ".toml"):
        return read_pacejka89(path)
    if ending == ".toml" and path.is_file():
        content = read_toml(path, "tyre")
        named = {"a0", SIDE, "set"} & {str(key).lower() for key in content}
        kind = content.get("kind", KIND if named else "map")
        if kind not in ("map", KIND):
            raise InputError(f"{path}: kind = {kind!r}; a tyre is a table without a kind, or kind = {KIND!r}")
        if kind == KIND:
            return read_pacejka89(path)
    return TyreMap.from_file(path)
