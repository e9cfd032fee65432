"""``velotyre effects``: the physical effects a model can have, generated from their declarations."""

from typing import Any

import click

from studies.reporting.command_context import example


@click.command(help="List the effects, or show the page of one.", epilog=example("velotyre effects relaxation_length"))
@click.argument("identifier", required=False)
@click.option("--json", "json_file", metavar="FILE", help="Write the declarations as JSON; - is standard output.")
def command(identifier: str | None, json_file: str | None) -> None:
    from bicycle.effects.effect_docs import describe, record, records
    from bicycle.effects.effect_registry import effect_class, registry
    from studies.reporting.output import print_table, write_json

    chosen = effect_class(identifier) if identifier else None
    if json_file:
        write_json(record(chosen) if chosen else {"effects": records()}, json_file)
    if json_file == "-":
        return
    if chosen:
        click.echo(describe(chosen), nl=False)
        return
    rows = []
    for effect in registry().values():
        first, *more = effect.parameters or (None,)
        needs = ", ".join(effect.requires) or None
        rows.append([effect.identifier, *_cells(first), needs, effect.source])
        rows += [["", *_cells(parameter), "", ""] for parameter in more]
    print_table(rows, ["effect", "parameter", "unit", "typical", "needs", "source"])


def _cells(parameter: Any) -> list[str | None]:
    """Name, unit and typical range of a parameter; three empty cells for an effect without any."""
    if parameter is None:
        return [None, None, None]
    low, high = parameter.typical
    return [parameter.name + (" r/f" if parameter.per_wheel else ""), parameter.unit, f"{low:g} .. {high:g}"]
