"""``velotyre tyres``: the packaged measured tyres, or one with every measured condition."""

from typing import TYPE_CHECKING, Any

import click

from studies.reporting.examples import example

if TYPE_CHECKING:
    from tyre import TyreMap

WIDTH = 40  # letters of a source in a table


@click.command(
    help="List the measured tyres, or show every measured condition of one (or of a tyre table).",
    epilog=example("velotyre tyres", "velotyre tyres Tyre1 --surface drum"),
)
@click.argument("tyre", required=False)
@click.option("--surface", metavar="SURFACE", help="flat (default) or drum.")
@click.option("--json", "json_file", metavar="FILE", help="Write the tyres as JSON; - is standard output.")
def command(tyre: str | None, surface: str | None, json_file: str | None) -> None:
    from textwrap import shorten

    from studies.reporting.output import print_table, write_json
    from tyre import TyreMap, available_tyres

    if tyre:
        found = [TyreMap.of(tyre, surface=surface)]
    else:
        found = [
            TyreMap.load(name, surface=on)
            for name, measured in available_tyres().items() for on in measured if surface in (None, on)
        ]  # fmt: skip
    records = [_record(one) for one in found]
    if json_file:
        write_json(records[0] if tyre else {"tyres": records}, json_file)
    if json_file == "-":
        return
    if tyre:
        measured = found[0].measured
        click.echo(f"{measured.label}: {measured.description or 'no description'}\nsource: {measured.source}\n")
        table = found[0].table
        print_table(table.to_numpy().tolist(), list(table.columns))
        for note in measured.notes:
            click.echo(f"note: {note}")
        return
    print_table(
        [
            [
                r["tyre"], r["surface"], _listed(r["loads_N"]), _listed(r["pressures_bar"]),
                _span(r["cornering_stiffness_N_per_deg"], 1), _span(r["relaxation_length_mm"], 0),
                shorten(r["source"], WIDTH, placeholder=" …"),
            ]
            for r in records
        ],
        ["tyre", "surface", "loads N", "pressures bar", "C_Fy N/deg", "relaxation mm", "source"],
    )  # fmt: skip
    click.echo("\nvelotyre tyres NAME shows every condition; a model takes a tyre by name: --tyre NAME --pressure BAR")


def _record(one: "TyreMap") -> dict[str, Any]:
    import numpy as np

    measured = one.measured
    return {
        "tyre": one.tyre, "surface": one.surface, "description": measured.description, "source": measured.source,
        "synthetic": measured.synthetic, "loads_N": one.loads.tolist(),
        "pressures_bar": (one.pressures / 1e5).round(9).tolist(), "conditions": int(measured.load.size),
        "cornering_stiffness_N_per_deg": np.radians(measured.cornering_stiffness).tolist(),
        "relaxation_length_mm": (measured.relaxation_length * 1e3).tolist(), "notes": list(measured.notes),
    }  # fmt: skip


def _listed(values: list[float]) -> str:
    return ", ".join(f"{value:g}" for value in values)


def _span(values: list[float], digits: int) -> str:
    return f"{min(values):.{digits}f}-{max(values):.{digits}f}"
