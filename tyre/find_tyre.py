"""A tyre by its name or file, whatever describes it: a measured table, a .tir file or Pacejka-89 coefficients."""

import difflib
import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from tyre.base.errors import InputError
from tyre.base.paths import data_root
from tyre.maps.find_table import available_tyres
from tyre.maps.tyre_map import TyreMap
from tyre.tyre_source import TyreSource

if TYPE_CHECKING:
    from tyre.magic_formula.pacejka89_tyre import Pacejka89Tyre

LISTS = (".txt", ".json", ".yaml", ".yml", ".mat")
FILE_ENDINGS = (".csv", ".toml", ".tir", *LISTS)


def is_file_name(tyre: str) -> bool:
    """Whether a tyre is given by a file, not by name.

    Parameters
    ----------
    tyre : str
    """
    return tyre.lower().endswith(FILE_ENDINGS)


def read_tyre(tyre: str | Path, *, surface: str | None = None) -> TyreSource:
    """Return a packaged tyre, or that of a file.

    Parameters
    ----------
    tyre : str or Path
        Name of a packaged tyre (a measured table or Pacejka-89 coefficients), or a file: a table (``.csv`` with its
        ``.toml``, or a plain one with units in its header), a tyre property file (``.tir``), a ``.toml`` of
        ``kind = "pacejka89"``, or a list of its coefficients (``.txt``, ``.csv``, ``.json``, ``.yaml``, ``.mat``).
    surface : str, optional
        ``flat`` or ``drum``: of a packaged tyre measured on both (flat if none is given); of any other its own.

    Returns
    -------
    TyreSource
        A `TyreMap`, `TirTyre` or `Pacejka89Tyre`, which answer alike: ``at(load=, pressure=)``.

    Raises
    ------
    InputError
        No such tyre or file, or a surface on which it was not measured.
    """
    name = str(tyre)
    if not is_file_name(name):
        try:
            return TyreMap.load(name, surface=surface or "flat")
        except InputError:
            if name in available_tyres():
                raise
    found = _from_file(name) if is_file_name(name) else _formula(name)
    if surface and surface != found.surface:
        raise InputError(f"{name} was not measured on surface '{surface}', only on: {found.surface}; leave surface out")
    return found


def _formula(name: str) -> "Pacejka89Tyre":
    known = packaged_formulas()
    if name in known:
        return known[name]
    names = sorted([*available_tyres(), *known])
    near = difflib.get_close_matches(name, names, n=1)
    hint = f" (did you mean '{near[0]}'?)" if near else ""
    raise InputError(
        f"no tyre '{name}'{hint}; available are {', '.join(names) or 'none'}; or give a file "
        f"({', '.join(FILE_ENDINGS)})."
    )


@cache
def packaged_formulas() -> Mapping[str, "Pacejka89Tyre"]:
    """Return the packaged tyres that are given by coefficients, by name."""
    from tyre.magic_formula.pacejka89_file import read_pacejka89

    folder = data_root() / "tyres"
    files = sorted((item for item in folder.iterdir() if item.name.endswith(".toml")), key=lambda item: item.name)
    tyres = [
        read_pacejka89(file) for file in files if not (folder / f"{file.name.removesuffix('.toml')}.csv").is_file()
    ]
    return MappingProxyType({tyre.tyre: tyre for tyre in tyres})


def _from_file(name: str) -> TyreSource:
    path = Path(name)
    if path.suffix.lower() == ".tir":
        from tyre.magic_formula.tir import read_tir

        return read_tir(path)
    if path.suffix.lower() in (*LISTS, ".csv"):
        from tyre.magic_formula.pacejka89_content import is_coefficient_list
        from tyre.magic_formula.pacejka89_lists import read_coefficient_lists

        if path.suffix.lower() != ".csv" or is_coefficient_list(path):
            return read_coefficient_lists(path)
    if path.suffix.lower() == ".toml" and path.is_file():
        try:
            kind = tomllib.loads(path.read_bytes().decode("utf-8-sig")).get("kind")
        except (ValueError, RecursionError) as error:
            raise InputError(f"{name}: is not valid TOML: {error}") from error
        if kind is not None:
            from tyre.magic_formula.pacejka89_file import KIND, read_pacejka89

            if kind != KIND:
                raise InputError(f"{name}: kind = {kind!r}; a tyre is a table without a kind, or kind = {KIND!r}")
            return read_pacejka89(path)
    return TyreMap.from_file(path)
