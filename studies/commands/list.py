"""``velotyre list models``: the packaged models."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from studies.reporting.command_context import example
from tyre.ground.errors import InputError

if TYPE_CHECKING:
    from bicycle.model.model import Model

OF_MODELS = ("velotyre list models", "velotyre list models sharp1971", "velotyre list models sharp1994 --to mine.toml")


@click.command(
    help="List the packaged models, or show one. MODEL is a published model or a model file; all its parameters "
    "are shown.",
    epilog=example(*OF_MODELS),
)
@click.argument("model", required=False)
@click.option("--json", "json_file", metavar="FILE", help="Write the models as JSON; - is standard output.")
@click.option("--to", "target", metavar="FILE", help="Write MODEL as a model file (.toml) to edit.")
def models(model: str | None, json_file: str | None, target: str | None) -> None:
    import tomli_w

    from bicycle.model.model_file import available_models, read_model
    from studies.model_space.axes import unit_of
    from studies.model_space.model_argument import choose
    from studies.reporting.output import print_table, write_json
    from tyre.ground.files import write_text

    if model is None:
        records = [_record(name, read_model(name)) for name in available_models()]
    else:
        records = [_record(model, choose(model).model)]
    if json_file:
        write_json(records[0] if model is not None else {"models": records}, json_file)
    if json_file == "-":
        return
    if target is not None:
        if model is None or not target.lower().endswith(".toml"):
            raise InputError(f"--to {target}: name a MODEL, and a file that ends in .toml")
        write_text(Path(target), tomli_w.dumps(dict(choose(model).content)))
        click.echo(f"{target}: written; it is a MODEL of every command")
        return
    if model is None:
        rows = [[r["name"], r["mass_kg"], r["description"], len(r["values"])] for r in records]
        print_table(rows, ["model", "kg", "description", "numbers"])
        click.echo("\nvelotyre list models NAME shows numbers and source; NAME is a MODEL of every command")
        return
    (r,) = records
    click.echo(f"{r['name']}: {r['description'] or 'no description'}\nsource: {r['source'] or 'not stated'}\n")
    print_table([[key, value, unit_of(key)] for key, value in r["values"].items()], ["parameter", "value", "unit"])


def _record(name: str, model: "Model") -> dict[str, Any]:
    """One model for JSON, SI."""
    return {
        "name": name,
        "description": model.bicycle.description,
        "source": model.bicycle.source,
        "kind": model.bicycle.kind,
        "mass_kg": sum(model.bicycle[key] for key in ("mR", "mB", "mH", "mF")),
        "effects": [effect.identifier for effect in model.effects],
        "values": model.parameters,
    }


command = click.Group(
    help="List the packaged models. Bicycles, tyres and effects have commands of these names.",
    epilog=example(OF_MODELS[0]),
)
command.add_command(models, "models")
