"""``velotyre tyres``: the packaged tyres, or one of them or of a file at its conditions."""

import click

from studies.reporting.examples import example

WIDTH = 40  # letters of a source in a table


@click.command(
    help="List the packaged tyres, or show one, or that of a file (tyre table, .tir, Pacejka-89), at its conditions.",
    epilog=example("velotyre tyres", "velotyre tyres Tyre1 --surface drum"),
)
@click.argument("tyre", required=False)
@click.option("--surface", metavar="SURFACE", help="flat (default) or drum.")
@click.option("--json", "json_file", metavar="FILE", help="Write the tyres as JSON; - is standard output.")
def command(tyre: str | None, surface: str | None, json_file: str | None) -> None:
    from textwrap import shorten

    from studies.reporting.output import print_table, write_json
    from studies.tyre_listing import listed_tyres, shown_conditions, tyre_record

    found = listed_tyres(tyre, surface)
    records = [tyre_record(one) for one in found]
    if json_file:
        write_json(records[0] if tyre else {"tyres": records}, json_file)
    if json_file == "-":
        return
    if tyre:
        one = found[0]
        click.echo(f"{one.label}: {one.description or 'no description'}\nsource: {one.source}\n")
        table = shown_conditions(one)
        print_table(table.to_numpy().tolist(), list(table.columns))
        for note in one.notes:
            click.echo(f"note: {note}")
        return
    print_table(
        [
            [
                shorten(r["tyre"], WIDTH, placeholder=" …"), r["surface"], _listed(r["loads_N"]),
                _listed(r["pressures_bar"]), _span(r["cornering_stiffness_N_per_deg"], 1),
                _span(r["relaxation_length_mm"], 0), shorten(r["source"], WIDTH, placeholder=" …"),
            ]
            for r in records
        ],
        ["tyre", "surface", "loads N", "pressures bar", "C_Fy N/deg", "relaxation mm", "source"],
    )  # fmt: skip
    click.echo("\nvelotyre tyres NAME shows every condition; a model takes a tyre by name: --tyre NAME --pressure BAR")
    if not all(r["relaxation_length_mm"] for r in records):
        click.echo(
            "one without relaxation length slips without lag: tyre = NAME under [effects.side_slip] of a model file"
        )


def _listed(values: list[float]) -> str:
    return ", ".join(f"{value:g}" for value in values)


def _span(values: list[float], digits: int) -> str:
    return "-" if not values else f"{min(values):.{digits}f}-{max(values):.{digits}f}"
