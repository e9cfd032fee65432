"""Runs a study against known truth: ``python -m tests.validation NAME --seed 1``; without a name lists them.

A study is a module with a function ``run``: its arguments are the options, what it returns is the result.
"""

import importlib
import inspect
import json
import pkgutil
import sys
from pathlib import Path
from typing import Any

import click

import tests.validation
from tyre.ground import InputError, unknown, write_text

sys.path.insert(0, str(Path(__file__).parents[1] / "shared"))  # as pytest has it

TOOLS = ("beam_front", "cases", "decay_generator", "kane_bicycle", "random_models", "other_rides", "recording_writers",
         "ride_bicycle", "ride_bounds", "ride_generator", "rider_populations", "rider_rivals", "seated_bench",
         "standing_bench", "standing_sway")  # fmt: skip
NEVER_NONE = ("models", "campaigns", "draws", "workers", "jobs")


def studies() -> list[str]:
    """Names of the studies, as the command line spells them."""
    found = pkgutil.iter_modules(tests.validation.__path__)
    names = [one.name for one in found if not one.ispkg and not one.name.startswith(("_", "test_", "conftest"))]
    return sorted(name.replace("_", "-") for name in names if name not in TOOLS)


class Studies(click.Group):
    """A group with one command a study, whose options are the arguments of its ``run``."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return studies()

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command:
        name = cmd_name.replace("_", "-")
        if name not in studies():
            raise click.UsageError(unknown("study", cmd_name, studies()))
        module = importlib.import_module(f"tests.validation.{name.replace('-', '_')}")
        given = inspect.signature(module.run).parameters.values()
        place = click.Option(["--out"], type=click.Path(path_type=Path), default=Path("out/validation"))
        options: list[click.Parameter] = [place, *(_option(one) for one in given if one.name != "out")]

        def callback(out: Path, **settings: Any) -> None:
            out.mkdir(parents=True, exist_ok=True)
            path = out / f"{name.replace('-', '_')}.json"
            words = " ".join(f"--{key.replace('_', '-')} {value}" for key, value in settings.items() if value != "")
            try:
                result = {"made_by": f"python -m tests.validation {name} {words}".strip(), "synthetic": True} | settings
                result |= module.run(out=out, **settings)
            except InputError as error:
                raise click.ClickException(str(error)) from error
            write_text(path, json.dumps(result, indent=1, allow_nan=False) + "\n")
            click.echo(f"{name}: result in {path}")

        return click.Command(name, params=options, callback=callback, help=inspect.cleandoc(module.__doc__ or name))


def _option(parameter: inspect.Parameter) -> click.Option:
    flag, default = "--" + parameter.name.replace("_", "-"), parameter.default
    if default is inspect.Parameter.empty:
        return click.Option([flag], type=click.IntRange(min=0), required=True)
    least = int(parameter.name in NEVER_NONE)
    kind: Any = click.IntRange(min=least) if isinstance(default, int) else type(default)
    return click.Option([flag], type=kind, default=default, show_default=True)


@click.command(cls=Studies, name="python -m tests.validation")
def main() -> None:
    """Check velotyre against known truth: studies that take minutes, with a seed and a result as JSON."""


if __name__ == "__main__":
    main(prog_name="python -m tests.validation")
