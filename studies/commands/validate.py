"""``velotyre validate NAME``: one sub-command per module of ``studies.validations``."""

import inspect
import json
import pkgutil
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import click

from studies.reporting.examples import example
from studies.reporting.manifest import results
from tyre.base.errors import InputError, unknown
from tyre.base.files import write_text

NEVER_NONE = ("models", "campaigns", "mutants", "draws", "workers", "jobs")
"""Counts of which 0 leaves nothing to do; of others, such as histories beside cases, none may be asked for."""


class ValidationGroup(click.Group):
    """A click group whose commands are the modules of ``studies.validations``, imported when asked for."""

    def __init__(self, package: str, **settings: Any) -> None:
        super().__init__(**settings)
        self.package = package

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of the validations, sorted (``ctx``: click's context)."""
        found = pkgutil.iter_modules(import_module(self.package).__path__)
        return sorted(module.name.replace("_", "-") for module in found if not module.name.startswith("_"))

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Build the command ``cmd_name`` from the signature of its ``run``; ``_`` and ``-`` are alike.

        ``ctx`` is click's context.
        """
        name = cmd_name.replace("_", "-")
        if name not in self.list_commands(ctx):
            return None
        return _command(name, import_module(f"{self.package}.{name.replace('-', '_')}"))

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The validation that the first of ``args`` names; an unknown one is refused with the nearest known.

        ``ctx`` is click's context.
        """
        known = self.list_commands(ctx)
        if args and not args[0].startswith("-") and args[0].replace("_", "-") not in known:
            raise InputError(unknown("validation", args[0], known))
        return super().resolve_command(ctx, args)


def _command(name: str, module: ModuleType) -> click.Command:
    options: list[click.Parameter] = [
        click.Option(
            ["--out"],
            type=click.Path(path_type=Path),
            default=Path("out/validation"),
            show_default=True,
            help="Folder for the result.",
        ),
        click.Option(
            ["--json", "json_file"],
            type=click.Path(path_type=Path, allow_dash=True),
            help="Write the result here too (- = stdout).",
        ),
    ]
    for parameter in inspect.signature(module.run).parameters.values():
        if parameter.name == "out":
            continue
        flag = "--" + parameter.name.replace("_", "-")
        if parameter.default is inspect.Parameter.empty:
            options.append(click.Option([flag], type=click.IntRange(min=0), required=True))
        elif isinstance(parameter.default, bool):
            options.append(click.Option([f"{flag}/--no{flag[1:]}"], default=parameter.default, show_default=True))
        else:
            options.append(
                click.Option(
                    [flag],
                    type=_allowed(parameter.name, parameter.default),
                    default=parameter.default,
                    show_default=True,
                )
            )

    def callback(out: Path, json_file: Path | None, **settings: Any) -> None:
        path = out / f"{name.replace('-', '_')}.json"
        with results(out):
            result = module.run(out=out, **settings)
            text = json.dumps(result, indent=1, allow_nan=False) + "\n"
            write_text(path, text)
        to_stdout = json_file is not None and str(json_file) == "-"
        if json_file is not None:
            if to_stdout:
                click.echo(text, nl=False)
            else:
                write_text(json_file, text)
        click.echo(f"{name}: result in {path}", err=to_stdout)

    shown = "".join(f" --{option.name} 1" for option in options if option.required)
    return click.Command(
        name, params=options, callback=callback, help=inspect.cleandoc(module.__doc__ or name),
        epilog=example(f"velotyre validate {name}{shown}"),
    )  # fmt: skip


def _allowed(name: str, default: Any) -> Any:
    """What an option of this ``name`` and ``default`` may be: a count, a positive number, words."""
    if isinstance(default, int):
        return click.IntRange(min=int(name in NEVER_NONE))
    return click.FloatRange(min=0.0, min_open=True) if isinstance(default, float) else type(default)


command = ValidationGroup(
    "studies.validations",
    name="validate",
    help="Check velotyre against known truth: studies that take over half a minute, with a seed and a JSON result.",
    epilog=example("velotyre validate critical-speeds --seed 1"),
)
