"""``velotyre list``: the bicycles, models, tyres and effects that there are."""

from copy import copy
from pathlib import Path
from typing import Any

import click

from studies.commands import bicycles, effects, tyres
from studies.reporting.command_context import example
from tyre.ground.errors import InputError

EXAMPLES = {
    bicycles: ("velotyre list bicycles", "velotyre list bicycles pista"),
    effects: ("velotyre list effects", "velotyre list effects relaxation_length"),
    tyres: ("velotyre list tyres", "velotyre list tyres Tyre1 --surface drum"),
}
OF_MODELS = ("velotyre list models", "velotyre list models sharp1971", "velotyre list models sharp1994 --to mine.toml")


@click.command(
    help="List the packaged models, which others published, or show every number of one (or of a model file).",
    epilog=example(*OF_MODELS),
)
@click.argument("model", required=False)
@click.option("--json", "json_file", metavar="FILE", help="Write the models as JSON; - is standard output.")
@click.option("--to", "target", metavar="FILE", help="Write MODEL as a model file (.toml), to be changed.")
def models(model: str | None, json_file: str | None, target: str | None) -> None:
    import tomli_w

    from bicycle.model.model_file import available_models, read_model
    from studies.model_space.axes import unit_of
    from studies.model_space.model_argument import choose
    from studies.reporting.output import print_table, write_json
    from tyre.ground.files import write_text

    found = {name: read_model(name) for name in available_models()} if model is None else {model: choose(model).model}
    records: list[dict[str, Any]] = [
        {
            "name": name,
            "description": one.bicycle.description,
            "source": one.bicycle.source,
            "kind": one.bicycle.kind,
            "mass_kg": sum(one.bicycle[key] for key in ("mR", "mB", "mH", "mF")),
            "effects": [effect.identifier for effect in one.effects],
            "values": one.parameters,
        }
        for name, one in found.items()
    ]
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
    (one,) = records
    click.echo(f"{one['name']}: {one['description'] or 'no description'}\nsource: {one['source'] or 'not stated'}\n")
    print_table([[key, value, unit_of(key)] for key, value in one["values"].items()], ["parameter", "value", "unit"])


command = click.Group(
    help="List what there is: bicycles, models, tyres or effects; with a name, one of them in full.",
    epilog=example(*(lines[0] for lines in EXAMPLES.values()), OF_MODELS[0]),
)
for module, lines in EXAMPLES.items():
    own = copy(module.command)  # the command of that name, by this one
    own.epilog = example(*lines)
    command.add_command(own, module.__name__.rpartition(".")[2])
command.add_command(models, "models")
