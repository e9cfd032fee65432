"""``velotyre tyres``: the packaged tyres, or one of them or of a file at its conditions."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from studies.reporting.command_context import example

if TYPE_CHECKING:
    import pandas as pd

    from tyre import TyreSource

N_PER_DEG = 0.017453292519943295  # from N/rad
COLUMNS = {
    "cornering_stiffness": ("N_per_deg", N_PER_DEG), "lateral_stiffness": ("N_per_mm", 1e-3),
    "relaxation_length": ("mm", 1e3), "camber_stiffness": ("N_per_deg", N_PER_DEG), "pneumatic_trail": ("mm", 1e3),
    "twisting_stiffness": ("N_m_per_rad", 1.0), "overturning_stiffness": ("N_m_per_rad", 1.0),
}  # fmt: skip
"""Field of `TyreProperties` -> unit in which it is shown, and its factor."""
ALWAYS = ("cornering_stiffness", "relaxation_length")  # columns of the JSON also of a tyre without them

CAMBERS = (0.0, 15.0)  # deg, drawn
SLIPS = (-10.0, 10.0)


@click.command(
    help="List the packaged tyres, or show one. TYRE is a packaged name or a file (tyre table, .tir, Pacejka-89), "
    "shown at its conditions.",
    epilog=example(
        "velotyre tyres",
        "velotyre tyres Tyre1 --surface drum",
        "velotyre tyres 'Schwalbe 50km Energizer Plus 28 x 1.75' --plot curves.png",
    ),
)
@click.argument("tyre", required=False)
@click.option("--surface", metavar="SURFACE", help="Test surface: flat (default) or drum.")
@click.option("--plot", metavar="FILE", help="Draw lateral force and aligning moment over slip: .png, .svg or .pdf.")
@click.option("--json", "json_file", metavar="FILE", help="Write the tyres as JSON; - is standard output.")
def command(tyre: str | None, surface: str | None, plot: str | None, json_file: str | None) -> None:
    from studies.reporting.output import print_table, write_json
    from studies.reporting.plotting import check_picture
    from tyre.ground.errors import InputError

    if plot is not None:
        check_picture(plot)
        if tyre is None:
            raise InputError("--plot draws one tyre; name it, or give its file")
    tyres = _find_tyres(tyre, surface)
    if plot is not None:
        _draw(tyres[0], plot)
    records = [_record(source) for source in tyres]
    if json_file:
        write_json(records[0] if tyre else {"tyres": records}, json_file)
    if json_file == "-":
        return
    if tyre:
        (source,) = tyres
        click.echo(f"{source.label}: {source.description or 'no description'}\nsource: {source.source}\n")
        table = _tabulate(source)
        print_table(table.to_numpy().tolist(), list(table.columns))
        for note in source.notes:
            click.echo(f"note: {note}")
        return
    rows = [_row(record) for record in records]
    print_table(rows, ["tyre", "surface", "loads N", "pressures bar", "C_α N/deg", "σ mm", "source"])
    click.echo("\nvelotyre tyres NAME shows every condition; a model takes a tyre by name: --tyre NAME --pressure BAR")
    if not all(record["relaxation_length_mm"] for record in records):
        click.echo(
            "one without relaxation length slips without lag: tyre = NAME under [effects.side_slip] of a model file"
        )


def _row(record: Mapping[str, Any]) -> list[str]:
    """Row of the list of tyres from a tyre's record for JSON."""
    from textwrap import shorten

    return [
        shorten(record["tyre"], 40, placeholder=" …"),
        record["surface"],
        ", ".join(f"{load:g}" for load in record["loads_N"]),
        ", ".join(f"{pressure:g}" for pressure in record["pressures_bar"]),
        _range(record["cornering_stiffness_N_per_deg"], 1),
        _range(record["relaxation_length_mm"], 0),
        shorten(record["source"], 40, placeholder=" …"),
    ]


def _range(values: list[float], digits: int) -> str:
    return "-" if not values else f"{min(values):.{digits}f}-{max(values):.{digits}f}"


def _find_tyres(tyre: str | None, surface: str | None) -> "list[TyreSource]":
    """Find the tyre that is named (name or file), or all packaged ones: measured tables first, then formulas."""
    from tyre import TyreMap, available_tyres, read_tyre
    from tyre.maps.find_tyre import packaged_formulas

    if tyre:
        return [read_tyre(tyre, surface=surface)]
    tyres: list[TyreSource] = []
    for name, surfaces in available_tyres().items():
        tyres += [TyreMap.load(name, surface=measured) for measured in surfaces if surface in (None, measured)]
    tyres += [formula for formula in packaged_formulas().values() if surface in (None, formula.surface)]
    return tyres


def _read_conditions(tyre: "TyreSource") -> tuple[Any, Any, Mapping[str, Any]]:
    """Give loads (n,) N, pressures (n,) Pa and SI values (n,) by field: as measured, or at each load and pressure."""
    import numpy as np

    from tyre import TyreMap

    if isinstance(tyre, TyreMap):  # as they were measured, to the last digit
        measured = tyre.measured
        fields = ("cornering_stiffness", "lateral_stiffness", "relaxation_length")
        values = {name: getattr(measured, name) for name in fields}
        optional = {"camber_stiffness": measured.camber_stiffness, "pneumatic_trail": measured.pneumatic_trail}
        values |= {name: column.value for name, column in optional.items() if column is not None}
        return measured.load, measured.pressure, values
    pressures = tyre.pressures if tyre.pressures.size else [np.nan]  # none is stated, and none matters
    load, pressure = (grid.ravel() for grid in np.meshgrid(tyre.loads, pressures, indexing="ij"))
    return load, pressure, tyre.linear(load=load, pressure=pressure)


def _record(tyre: "TyreSource") -> dict[str, Any]:
    """One tyre for JSON, its conditions in the units of ``COLUMNS``."""
    from tyre.ground.units import PASCAL_PER_BAR

    load, _, values = _read_conditions(tyre)
    columns: dict[str, list[float | None]] = {}
    for field, (unit, factor) in COLUMNS.items():
        if field in values:
            columns[f"{field}_{unit}"] = [None if x != x else x * factor for x in values[field].tolist()]
        elif field in ALWAYS:
            columns[f"{field}_{unit}"] = []
    return {
        "tyre": tyre.tyre,
        "surface": tyre.surface,
        "description": tyre.description,
        "source": tyre.source,
        "synthetic": tyre.synthetic,
        "loads_N": tyre.loads.tolist(),
        "pressures_bar": (tyre.pressures / PASCAL_PER_BAR).round(9).tolist(),
        "conditions": int(load.size),
        **columns,
        "notes": list(tyre.notes),
    }


def _tabulate(tyre: "TyreSource") -> "pd.DataFrame":
    """Tabulate measured conditions, or a formula at loads and pressures in its range, in the units of ``COLUMNS``."""
    import numpy as np
    import pandas as pd

    from tyre import TyreMap
    from tyre.ground.units import PASCAL_PER_BAR

    if isinstance(tyre, TyreMap):
        return tyre.table
    load, pressure, values = _read_conditions(tyre)
    columns = {
        f"{field}_{unit}": values[field] * factor for field, (unit, factor) in COLUMNS.items() if field in values
    }
    bars = {} if np.isnan(pressure).all() else {"pressure_bar": pressure / PASCAL_PER_BAR}
    return pd.DataFrame({"load_N": load} | bars | columns)


def _draw(tyre: "TyreSource", target: str) -> None:
    """Draw the curves of a formula over slip, at its loads and the middle one of its pressures."""
    import numpy as np

    from studies.reporting.plotting import GREY, look, picture
    from tyre.ground.errors import InputError
    from tyre.ground.units import PASCAL_PER_BAR
    from tyre.laws.formula_tyre import FormulaTyre

    if not isinstance(tyre, FormulaTyre):
        raise InputError(f"{tyre.label} is a table of stiffnesses and has no curves; --plot draws .tir and Pacejka-89")
    slip, pressures = np.radians(np.linspace(*SLIPS, 201)), tyre.pressures
    pressure = float(pressures[len(pressures) // 2]) if pressures.size else np.nan
    curves = {"lateral force, N": tyre.lateral_force, "aligning moment, N m": tyre.aligning_moment}
    try:
        tyre.aligning_moment(slip_angle=slip, load=tyre.loads[0], pressure=pressure)
    except InputError:
        del curves["aligning moment, N m"]
    dotted = ""  # where camber changes a curve
    with picture(target, width=4.6 * len(curves), height=3.6) as figure:
        for axes, (name, curve) in zip(np.ravel(figure.subplots(1, len(curves))), curves.items(), strict=True):
            for number, load in enumerate(tyre.loads):
                upright, leant = (
                    curve(slip_angle=slip, load=load, pressure=pressure, camber=np.radians(camber))
                    for camber in CAMBERS
                )
                axes.plot(np.degrees(slip), upright, color=look(number).colour, label=f"{load:g} N")
                if not np.allclose(upright, leant):
                    axes.plot(np.degrees(slip), leant, ":", color=look(number).colour)
                    dotted = f"; dotted: camber {CAMBERS[1]:g} deg"
            axes.set(xlabel="slip angle, deg", title=name)
            axes.axhline(0.0, color=GREY, linewidth=0.6)
        bars = "" if np.isnan(pressure) else f" at {pressure / PASCAL_PER_BAR:g} bar"
        figure.suptitle(f"{tyre.tyre} on {tyre.surface}{bars}{dotted}", fontsize=10)
        figure.axes[0].legend()
