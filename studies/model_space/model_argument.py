"""Argument MODEL of every command: a packaged bicycle or model, or its file, and tyres to put on it."""

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from studies.reporting.command_context import verbose
from tyre.ground.errors import InputError, unknown
from tyre.ground.files import refuse_without_ending
from tyre.ground.number_with_unit import typed_numbers

if TYPE_CHECKING:
    from bicycle.model.model import Model
    from bicycle.model.state_space import LinearModel

WHIPPLE = "wheels without slip (Whipple model); add measured tyres with --tyre NAME --pressure BAR (velotyre tyres)"
RIGID = "note: the front frame is rigid; wobble needs front-frame compliance to be judged ([effects.front_compliance])"
MATRICES = "matrices"  # key of a content that is a file of canonical matrices
LAWS = ("relaxation_length", "side_slip")  # contact laws that take a measured tyre; the first is what --tyre adds


@dataclass(frozen=True)
class ChosenModel:
    """The model asked for, as the ``content`` of a model file whose file names are absolute."""

    content: Mapping[str, Any]
    where: str = ""  # name or file as it was asked for, for messages
    remark: str = ""  # one line on what was assumed, for standard error; empty: nothing

    @cached_property
    def model(self) -> "Model":
        """The model; an error in the file is reported with its name."""
        from bicycle.model.model_file import build_model

        self.refuse_matrices()
        try:
            return build_model(self.content)
        except InputError as error:
            raise InputError(f"{self.where}: {error}" if self.where else str(error)) from error

    def note_rigid_front(self) -> None:
        """Print one line to standard error if the front frame is rigid: stable wobble is then no answer."""
        if not self.of_matrices and "front_compliance" not in self.content.get("effects", {}):
            click.echo(RIGID, err=True)

    @property
    def of_matrices(self) -> bool:
        """Whether the file gives canonical matrices in place of a bicycle."""
        return MATRICES in self.content

    @cached_property
    def linear(self) -> "LinearModel":
        """The model with numbers, of a bicycle with its effects or of matrices."""
        from bicycle.model.matrix_model import read_matrices

        return read_matrices(self.content[MATRICES]) if self.of_matrices else self.model.linear_model()

    def refuse_matrices(self) -> None:
        """Refuse a file of matrices where a bicycle is needed."""
        if self.of_matrices:
            raise InputError(
                f"{self.where} holds matrices M, C1, K0, K2, which only velotyre modes and critical accept; other "
                "commands need the parameters of the bicycle (velotyre new bicycle.toml)"
            )

    @property
    def title(self) -> str:
        """The bicycle and its effects, or the file of matrices."""
        if self.of_matrices:
            return f"{Path(self.content[MATRICES]).stem}: no slip, of its matrices"
        effects = ", ".join(effect.identifier.replace("_", " ") for effect in self.model.effects)
        return f"{self.model.bicycle.name}: {effects}"

    @cached_property
    def each(self) -> "dict[str, ChosenModel]":
        """One model for each bicycle of a table by its name; without a table this one without a name."""
        from bicycle.files.bicycle_files import is_bicycle_table, read_bicycles
        from bicycle.model.model_file import allows_unusual
        from tyre.formats.sheet import ROW, split_row

        table = self.content.get("bicycle")
        if not isinstance(table, str) or not is_bicycle_table(table) or split_row(table)[1]:
            return {"": self}
        prefix = f"{self.where}, " if self.where else ""
        names = [bicycle.name for bicycle in read_bicycles(Path(table), allow_unusual=allows_unusual(self.content))]
        contents = {name: {**self.content, "bicycle": f"{table}{ROW}{name}"} for name in names}
        return {name: ChosenModel(content, f"{prefix}bicycle {name}") for name, content in contents.items()}


def takes_model(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a click ``command`` the argument MODEL and the options of its tyre; it gets a :class:`ChosenModel` first."""
    return _takes_model(command, matrices=False)


def takes_model_or_matrices(command: Callable[..., Any]) -> Callable[..., Any]:
    """As :func:`takes_model`, for a command that a file of matrices does for."""
    return _takes_model(command, matrices=True)


def _takes_model(command: Callable[..., Any], *, matrices: bool) -> Callable[..., Any]:

    @functools.wraps(command)
    def with_model(
        model: str, tyre: str | None, pressure: str | None, surface: str | None, *, extrapolate: bool, **rest: Any
    ) -> Any:
        how = {"tyre": tyre, "pressure": pressure, "surface": surface}
        chosen = choose(model, **how, extrapolate=extrapolate, matrices=matrices)
        if chosen.remark:
            click.echo(chosen.remark, err=True)
        return command(chosen, **rest)

    tyre_help = "Tyre on both wheels: a packaged name, a table (.csv), a .tir or Pacejka-89 file."
    for decorate in (
        verbose,
        click.option(
            "--extrapolate", is_flag=True, help="Allow tyre data more than one range width outside the measured range."
        ),
        click.option("--surface", metavar="SURFACE", help="Test surface of --tyre: flat (default) or drum."),
        click.option("--pressure", metavar="BAR", help="Inflation pressure of --tyre, bar: one number, or REAR,FRONT."),
        click.option("--tyre", metavar="TYRE", help=tyre_help),
        click.argument("model", metavar="MODEL", shell_complete=_complete),
    ):
        with_model = decorate(with_model)
    return with_model


def choose(
    text: str,
    *,
    tyre: str | None = None,
    pressure: str | None = None,
    surface: str | None = None,
    extrapolate: bool = False,
    matrices: bool = False,
) -> ChosenModel:
    """Choose the model that MODEL and its options mean; a file of ``matrices`` is refused unless they will do."""
    from bicycle.files.matrix_file import REFUSAL

    chosen = _read_model(text)
    if chosen.of_matrices:
        if not matrices:
            chosen.refuse_matrices()
        for option, value in (("--tyre", tyre), ("--pressure", pressure), ("--surface", surface)):
            if value is not None:
                raise InputError(f"{option} {value}: {text} {REFUSAL}; give the parameters of the bicycle")
        return chosen
    if not isinstance(chosen.content.get("effects", {}), Mapping):
        return chosen  # whoever builds it says what is wrong
    effects = dict(chosen.content.get("effects", {}))
    if tyre is None:
        for name, value in (("pressure", pressure), ("surface", surface)):
            if value is not None:
                raise InputError(
                    f"--{name} {value} applies to a measured tyre; give --tyre too, for example --tyre Tyre1"
                )
        if not extrapolate:
            return chosen
        laws = [name for name in LAWS if isinstance(effects.get(name), Mapping) and "tyre" in effects[name]]
        if not laws:
            raise InputError("--extrapolate applies to a measured tyre, and the model has none; omit it or give --tyre")
        effects |= {name: dict(effects[name]) | {"extrapolate": True} for name in laws}
        return replace(chosen, content=dict(chosen.content) | {"effects": effects})
    present = [name for name in (*LAWS, "no_slip") if name in effects]
    if present:
        law = f"its own contact law, [effects.{present[0]}]"
        raise InputError(f"{text} has {law}; change the tyre there, or leave --tyre out")
    table = {"tyre": _tyre_file(tyre), "pressure_bar": _pressure(tyre, surface, pressure)}
    table |= {"surface": surface} if surface else {}
    table |= {"extrapolate": True} if extrapolate else {}
    return ChosenModel(dict(chosen.content) | {"effects": effects | {LAWS[0]: table}}, chosen.where)


def _read_model(text: str) -> ChosenModel:
    """Read MODEL without its options; the files it names become absolute."""
    from bicycle.files.bicycle_files import bicycle_place
    from bicycle.files.matrix_file import holds_matrices
    from bicycle.model.model_file import model_content
    from bicycle.model.rider_in_model import locate_rider
    from bicycle.model.wheel_tyres import located

    if holds_matrices(text):
        return ChosenModel({MATRICES: Path(text).resolve().as_posix()}, text)
    bicycle = find_bicycle(text)
    if bicycle is not None:
        return ChosenModel({"bicycle": bicycle}, "", f"{text}: {WHIPPLE}")
    content, folder = model_content(text), Path(text).parent
    if isinstance(content.get("bicycle"), str):
        content["bicycle"] = bicycle_place(content["bicycle"], folder)
    if isinstance(content.get("effects"), Mapping):
        content["effects"] = {
            name: locate_rider(located(table, folder), folder) if isinstance(table, Mapping) else table
            for name, table in content["effects"].items()
        }
    return ChosenModel(content, text, f"{text}: {WHIPPLE}" if _lacks_tyres(content.get("effects")) else "")


def _lacks_tyres(effects: Any) -> bool:
    """True if the table ``effects`` of a model file has a flexible front frame, but no contact law: no wobble then."""
    from bicycle.effects.effect_registry import registry

    if not isinstance(effects, Mapping) or "front_compliance" not in effects:
        return False
    known = registry()
    return not any(name in known and known[name].slot == "contact law" for name in effects)


def find_bicycle(text: str) -> str | None:
    """Name or file for :func:`bicycle.load_bicycle` if ``text``, an argument MODEL, is a bicycle; else None."""
    from bicycle.files.bicycle_files import READERS, available_bicycles, bicycle_place, is_bicycle_table
    from bicycle.model.model_file import available_models, model_content

    path = Path(text)
    if text in available_bicycles() and not path.is_file():
        return text
    if is_bicycle_table(text):
        return bicycle_place(text, Path())
    if path.suffix.lower() in (".txt", ".yml", ".yaml", ".json", ".m"):
        return path.resolve().as_posix()
    if not path.is_file() and path.suffix.lower() != ".toml" and text not in available_models():
        refuse_without_ending("bicycle or model", text)
        mistake = unknown("bicycle or model", text, [*available_bicycles(), *available_models()])
        raise InputError(f"{mistake}; or give a file: velotyre new model.toml writes an example")
    try:
        content = model_content(text)
    except InputError as error:
        forms = f"; the file ending states the format: .toml for a model, {', '.join(READERS)} for a bicycle"
        raise InputError(f"{error}{forms if path.is_file() else ''}") from error
    flat = {"values", "mB", "xB", "w"} & set(content)  # parameters below [values], or at the top
    return path.resolve().as_posix() if flat and "bicycle" not in content else None


def _tyre_file(tyre: str) -> str:
    from tyre.maps.find_tyre import is_file_name

    return Path(tyre).resolve().as_posix() if is_file_name(tyre) else tyre


def _pressure(tyre: str, surface: str | None, text: str | None) -> float | dict[str, float]:
    from tyre import read_tyre
    from tyre.ground.units import PASCAL_PER_BAR

    if text is None:
        source = read_tyre(_tyre_file(tyre), surface=surface)
        if source.default_pressure is not None:  # the only one, or none: it changes nothing
            return source.default_pressure / PASCAL_PER_BAR
        measured = ", ".join(f"{p / PASCAL_PER_BAR:g}" for p in source.pressures)
        at_pressures = f"; it was measured at {measured} bar" if measured else ""
        raise InputError(f"--tyre {tyre} needs --pressure, in bar{at_pressures}")
    bars = typed_numbers(text.split(","), "bar")
    if len(bars) not in (1, 2):
        raise InputError(
            f"--pressure {text!r}: give one number, in bar or with its unit: 5.5 or 80psi; or REAR,FRONT: 7.5,5.5"
        )
    return bars[0] if len(bars) == 1 else {"rear": bars[0], "front": bars[1]}


def _complete(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[Any]:
    """Complete MODEL in a shell: packaged bicycles and models first, then files."""
    from click.shell_completion import CompletionItem

    from bicycle.files.bicycle_files import available_bicycles
    from bicycle.model.model_file import available_models

    available = (*available_bicycles(), *available_models())
    names = [CompletionItem(name) for name in available if name.startswith(incomplete)]
    return names or [CompletionItem(incomplete, type="file")]
