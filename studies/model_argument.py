"""What every command takes for a model: a packaged bicycle, its file or a model file, and tyres to put on it."""

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from studies.reporting.output import verbose
from tyre.base.errors import InputError, unknown
from tyre.base.units import PASCAL_PER_BAR

if TYPE_CHECKING:
    from bicycle.model import Model

BICYCLE_FILES = (".txt", ".yml", ".yaml")
LAWS = ("relaxation_length", "side_slip")  # contact laws that take a measured tyre; the first is what --tyre adds


@dataclass(frozen=True)
class ChosenModel:
    """What was asked for, as the content of a model file whose file names are absolute.

    Attributes
    ----------
    content : mapping
        As :func:`bicycle.files.model_file.build_model` takes it.
    where : str
        What messages begin with: the file, or nothing.
    remark : str
        One line on what was taken where the user did not say it all; empty for a model file.
    """

    content: Mapping[str, Any]
    where: str = ""
    remark: str = ""

    @cached_property
    def model(self) -> "Model":
        """The model; a mistake in the file is reported with its name."""
        from bicycle.files.model_file import build_model

        try:
            return build_model(self.content)
        except InputError as error:
            raise InputError(f"{self.where}: {error}" if self.where else str(error)) from error

    @cached_property
    def each(self) -> "dict[str, ChosenModel]":
        """One model for each bicycle by its name, where the bicycle is a table of them; else this one without a name.

        Raises
        ------
        InputError
            A row or column of the table that makes no bicycle.
        """
        from bicycle.files.bicycle_table import ROW, is_bicycle_table, read_bicycles, split_row
        from bicycle.files.model_file import allows_unusual

        given = self.content.get("bicycle")
        if not isinstance(given, str) or not is_bicycle_table(given) or split_row(given)[1]:
            return {"": self}
        found = read_bicycles(Path(given), allow_unusual=allows_unusual(self.content))
        where = f"{self.where}, " if self.where else ""
        return {
            one.name: ChosenModel({**self.content, "bicycle": f"{given}{ROW}{one.name}"}, f"{where}bicycle {one.name}")
            for one in found
        }


def takes_model(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a click ``command`` the argument MODEL and the options of its tyre; it gets a :class:`ChosenModel` first."""

    @functools.wraps(command)
    def with_model(
        model: str, tyre: str | None, pressure: str | None, surface: str | None, *, extrapolate: bool, **rest: Any
    ) -> Any:
        chosen = choose(model, tyre=tyre, pressure=pressure, surface=surface, extrapolate=extrapolate)
        if chosen.remark:
            click.echo(chosen.remark, err=True)
        return command(chosen, **rest)

    for decorate in (
        verbose,
        click.option("--extrapolate", is_flag=True, help="Take tyre values far outside the range where they hold."),
        click.option("--surface", metavar="SURFACE", help="Of --tyre: flat (default) or drum."),
        click.option("--pressure", metavar="BAR", help="Of --tyre, bar: one number, or REAR,FRONT."),
        click.option(
            "--tyre",
            metavar="TYRE",
            help="Put a tyre on both wheels: a packaged one, a table (.csv), a .tir or Pacejka-89 file.",
        ),
        click.argument("model", metavar="MODEL", shell_complete=_complete),
    ):
        with_model = decorate(with_model)
    return with_model


def choose(
    text: str, *, tyre: str | None = None, pressure: str | None = None, surface: str | None = None,
    extrapolate: bool = False,
) -> ChosenModel:  # fmt: skip
    """The model that MODEL and its options mean.

    Parameters
    ----------
    text : str
        A packaged bicycle, a bicycle file (.toml with [values], .txt, .yml, .yaml), a bicycle of a table
        (``bicycles.csv#NAME``; .xlsx, .parquet), a whole table where a command takes one, or a model file.
    tyre, pressure, surface : str, optional
        A measured tyre, its inflation pressure in bar (one number or ``REAR,FRONT``), flat or drum.
    extrapolate : bool
        Whether the tyre may be taken far outside the measured loads and pressures.

    Raises
    ------
    InputError
        No such model, bicycle or tyre, with what is there; or options that do not go together.
    """
    chosen = _bare(text)
    if tyre is None:
        for name, value in (("pressure", pressure), ("surface", surface)):
            if value is not None:
                raise InputError(f"--{name} {value} is of a measured tyre; give --tyre too, for example --tyre Tyre1")
        return _extrapolating(chosen) if extrapolate else chosen
    effects = dict(chosen.content.get("effects", {}))
    present = [name for name in (*LAWS, "no_slip") if name in effects]
    if present:
        raise InputError(
            f"{text} has its own contact law, [effects.{present[0]}]; change the tyre there, or leave --tyre out"
        )
    table = {"tyre": _tyre_file(tyre), "pressure_bar": _pressure(tyre, surface, pressure)}
    table |= {"surface": surface} if surface else {}
    table |= {"extrapolate": True} if extrapolate else {}
    effects[LAWS[0]] = table
    return ChosenModel(dict(chosen.content) | {"effects": effects}, chosen.where)


def _bare(text: str) -> ChosenModel:
    from tyre.base.toml_file import read_toml

    bicycle = bicycle_alone(text)
    if bicycle is not None:
        return _whipple(bicycle, text)
    return ChosenModel(_absolute(read_toml(Path(text), "model file"), Path(text).parent), text)


def bicycle_alone(text: str) -> str | None:
    """What :func:`bicycle.load_bicycle` takes where ``text``, an argument MODEL, is a bicycle; None for a model file.

    Raises
    ------
    InputError
        Neither a packaged bicycle nor a file.
    """
    from bicycle.files.bicycle_file import available_bicycles, bicycle_place
    from bicycle.files.bicycle_table import is_bicycle_table
    from tyre.base.toml_file import read_toml

    path = Path(text)
    if text in available_bicycles() and not path.is_file():
        return text
    if is_bicycle_table(text):
        return bicycle_place(text, Path())
    if path.suffix.lower() in BICYCLE_FILES:
        return path.resolve().as_posix()
    if not path.is_file() and path.suffix.lower() != ".toml":
        there = unknown("bicycle", text, available_bicycles())
        raise InputError(f"{there}; or give a file: velotyre new model.toml writes an example")
    content = read_toml(path, "model file")
    return path.resolve().as_posix() if "values" in content and "bicycle" not in content else None


def _whipple(bicycle: str, text: str) -> ChosenModel:
    remark = (
        f"{text}: wheels that roll without slip (Whipple model); --tyre NAME --pressure BAR puts it on tyres that were "
        "measured at its wheel loads (velotyre tyres)"
    )
    return ChosenModel({"bicycle": bicycle}, "", remark)


def _absolute(content: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """The content of a model file with the files it names made absolute."""
    from bicycle.files.bicycle_file import bicycle_place
    from bicycle.files.wheel_tyres import located

    found, bicycle, effects = dict(content), content.get("bicycle"), content.get("effects")
    if isinstance(bicycle, str):
        found["bicycle"] = bicycle_place(bicycle, folder)
    if isinstance(effects, Mapping):
        found["effects"] = {
            name: located(table, folder) if isinstance(table, Mapping) else table for name, table in effects.items()
        }
    return found


def _extrapolating(chosen: ChosenModel) -> ChosenModel:
    effects = dict(chosen.content.get("effects", {}))
    laws = [name for name in LAWS if isinstance(effects.get(name), Mapping) and "tyre" in effects[name]]
    if not laws:
        raise InputError("--extrapolate is of a measured tyre, and the model has none; leave it out or give --tyre")
    effects |= {name: dict(effects[name]) | {"extrapolate": True} for name in laws}
    return ChosenModel(dict(chosen.content) | {"effects": effects}, chosen.where, chosen.remark)


def _tyre_file(tyre: str) -> str:
    from tyre.find_tyre import is_file_name

    return Path(tyre).resolve().as_posix() if is_file_name(tyre) else tyre


def _pressure(tyre: str, surface: str | None, text: str | None) -> Any:
    from tyre import read_tyre

    if text is None:
        found = read_tyre(_tyre_file(tyre), surface=surface)
        measured = ", ".join(f"{p / PASCAL_PER_BAR:g}" for p in found.pressures)
        said = f"; it was measured at {measured} bar" if measured else ""
        raise InputError(f"--tyre {tyre} needs --pressure, in bar{said}")
    try:
        bars = [float(part) for part in text.split(",")]
    except ValueError:
        bars = []
    if len(bars) not in (1, 2):
        raise InputError(f"--pressure {text!r}: give one number in bar, such as 5.5, or REAR,FRONT, such as 7.5,5.5")
    return bars[0] if len(bars) == 1 else {"rear": bars[0], "front": bars[1]}


def _complete(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[Any]:
    """Shell completion: packaged bicycles first, then files."""
    from click.shell_completion import CompletionItem

    from bicycle.files.bicycle_file import available_bicycles

    names = [CompletionItem(name) for name in available_bicycles() if name.startswith(incomplete)]
    return names or [CompletionItem(incomplete, type="file")]
