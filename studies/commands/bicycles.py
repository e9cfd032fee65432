"""``velotyre bicycles``: the packaged bicycles, or one with every parameter."""

from typing import TYPE_CHECKING, Any

import click

from studies.reporting.command_context import example, verbose

if TYPE_CHECKING:
    from bicycle.parameters.bicycle import Bicycle


@click.command(
    help="List the packaged bicycles, or show one. BICYCLE is a packaged name or a file; all its parameters are shown.",
    epilog=example("velotyre bicycles", "velotyre bicycles pista"),
)
@verbose
@click.argument("bicycle", required=False)
@click.option("--json", "json_file", metavar="FILE", help="Write the bicycles as JSON; - is standard output.")
def command(bicycle: str | None, json_file: str | None) -> None:
    from textwrap import shorten

    from bicycle.files.bicycle_files import available_bicycles, load_bicycle
    from bicycle.parameters.bicycle import UNITS
    from studies.reporting.output import print_table, print_warnings, write_json

    loaded = [load_bicycle(name) for name in (available_bicycles() if bicycle is None else [bicycle])]
    records = [_record(parameter_set) for parameter_set in loaded]
    if json_file:
        write_json(records[0] if bicycle is not None else {"bicycles": records}, json_file)
    if json_file == "-":
        return
    if bicycle is not None:
        (parameter_set,) = loaded
        description = parameter_set.description or "no description"
        click.echo(f"{parameter_set.name}: {description}\nsource: {parameter_set.source or 'not stated'}\n")
        rows = [
            [key, value, UNITS.get(key, "kg m^2"), parameter_set.sd.get(key)]
            for key, value in parameter_set.values.items()
        ]
        print_table(rows, ["parameter", "value", "unit", "sd"])
        if parameter_set.covariance.names:
            click.echo(
                f"\ntheir correlations are known too: [covariance] of {', '.join(parameter_set.covariance.names)}"
            )
        print_warnings(parameter_set.warnings)
        return
    rows = []
    for record in records:
        description = shorten(record["description"], 58, placeholder=" …")
        source = shorten(record["source"], 29, placeholder=" …")
        rows.append(
            [record["name"], record["mass_kg"], record["rear_load_N"], record["front_load_N"], description, source]
        )
    print_table(rows, ["bicycle", "kg", "rear N", "front N", "description", "source"])
    click.echo("\nvelotyre bicycles NAME shows parameters and source in full; loads are those of the wheels at rest")


def _record(bicycle: "Bicycle") -> dict[str, Any]:
    """One bicycle for JSON, SI: mass, wheel loads at rest, every parameter with its sd."""
    from bicycle.files.bicycle_numbers import covariance_table

    rear, front = bicycle.static_loads
    return {
        "name": bicycle.name,
        "description": bicycle.description,
        "source": bicycle.source,
        "mass_kg": sum(bicycle[key] for key in ("mR", "mB", "mH", "mF")),
        "rear_load_N": rear,
        "front_load_N": front,
        "values": dict(bicycle.values),
        "sd": dict(bicycle.sd),
        **covariance_table(bicycle.covariance),
    }
