"""A fitted tyre on the bicycle of the model page."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from bicycle.effect import WHEELS
from studies.explorer.controls import law_names
from studies.explorer.own_loads import LOAD
from studies.explorer.recording.desk import Desk
from studies.explorer.state import State, parse_state
from studies.explorer.tyre_files import TYRES
from studies.model_argument import LAWS
from tyre.base.errors import InputError
from tyre.base.units import PASCAL_PER_BAR

MAPS = "tyre_fit/maps/"


def mounted(desk: Desk, name: Any, address: Any) -> str:
    """The address of a model with a fitted tyre on both wheels, at the middle of the measured pressures.

    Parameters
    ----------
    desk : Desk
    name : str
        Of the table that the fit wrote.
    address : str
        Of the model that the page showed last; one that cannot be read is passed over.

    Raises
    ------
    InputError
        There is no such table.
    """
    path = desk.file(name) if isinstance(name, str) and name.startswith(MAPS) and name.endswith(".csv") else None
    if path is None:
        raise InputError("there is no such tyre; fit it again")
    key = TYRES.keep(path.name, {one.name: one.read_bytes() for one in _parts(path)})
    low, high = TYRES.read(key, None).pressure_range
    bar = float(f"{(low + high) / 2 / PASCAL_PER_BAR:.3g}")
    try:
        state = parse_state(address)
    except InputError:
        state = State()
    gone = (LOAD, *(f"effects.{law}" for law in law_names()))
    kept = {one: value for one, value in state.model if not any(one == g or one.startswith(f"{g}.") for g in gone)}
    law = f"effects.{LAWS[0]}"
    kept |= {f"{law}.tyre.{wheel}": key for wheel in WHEELS} | {f"{law}.pressure_bar.{wheel}": bar for wheel in WHEELS}
    return replace(state, model=tuple(sorted(kept.items()))).address


def _parts(path: Path) -> list[Path]:
    return [one for one in (path, path.with_suffix(".toml")) if one.is_file()]
