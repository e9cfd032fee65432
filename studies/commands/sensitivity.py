"""``velotyre sensitivity``: which parameters move a mode most, each per one standard deviation."""

import click

from studies.model_space.command_options import Number, max_speed_option, sd_option, speed_option
from studies.model_space.model_argument import ChosenModel, takes_model
from studies.reporting.command_context import example


@click.command(
    help="Rank parameters by their effect on one mode. The change of a mode of MODEL by one standard uncertainty "
    "of each parameter.",
    epilog=example("velotyre sensitivity benchmark --mode weave --speed 5"),
)
@takes_model
@click.option("--mode", required=True, help="Name of the mode, as velotyre modes shows it.")
@speed_option()
@sd_option
@max_speed_option(40.0)
@click.option(
    "--top", default=15, show_default=True, type=Number(1, 1000, whole=True), help="Number of parameters shown."
)
@click.option("--out", metavar="DIR", help="Folder for sensitivity.csv and the tornado figure.")
@click.option("--json", "json_file", metavar="FILE", help="Write the result as JSON; - is standard output.")
def command(
    chosen: ChosenModel,
    mode: str,
    speed: float,
    sds: tuple[str, ...],
    max_speed: float,
    top: int,
    out: str | None,
    json_file: str | None,
) -> None:
    from pathlib import Path

    from bicycle.model.eigen import damping_ratio, frequency_hz
    from bicycle.parameters.front_hinge import front_line
    from studies.model_space.axes import numbers_by_name
    from studies.model_space.ranking import draw_tornado, rank, record
    from studies.reporting.manifest import results
    from studies.reporting.output import print_exchanges, print_table, print_warnings, write_csv, write_json

    model = chosen.model
    ranking = rank(model, mode=mode, speed=speed, given_sd=numbers_by_name(sds, "--sd", "c=0.002"), max_speed=max_speed)
    if json_file:
        write_json(record(ranking), json_file)
    if out:
        import pandas as pd

        folder = Path(out)
        columns = [f"change_of_{speed:.4f}_m_s" for speed in ranking.critical_speeds]
        rows = record(ranking)["parameters"]
        for row in rows:
            row |= zip(columns, row.pop("critical_speed_changes_m_s"), strict=True)
        with results(folder):
            write_csv(pd.DataFrame(rows), folder / "sensitivity.csv")
            draw_tornado(ranking, folder / "tornado", top=top)
    if json_file != "-":
        z = ranking.eigenvalue
        root = f"{z.real:.4g} + {z.imag:.4g}i 1/s" if z.imag else f"{z.real:.4g} 1/s"
        if z.imag:
            root = f"{float(frequency_hz(z)):.4g} Hz, damping ratio {float(damping_ratio(z)):.4g} ({root})"
        click.echo(f"{mode.replace('_', ' ')} at {speed:g} m/s: {root}; changes for +1 standard uncertainty each")
        for real_root in ranking.further_roots:
            click.echo(f"it has another real root here, {real_root:.4g} 1/s, which this does not rank")
        if ranking.meeting:
            click.echo("two real roots meet here: the eigenvalue is their mean")
        rows = [
            [c.parameter, c.value, c.unit, c.sd, c.origin, c.growth, c.frequency if z.imag else "", *c.critical]
            for c in ranking.changes[:top]
        ]
        critical_headers = [f"{v:.3f} m/s moves by" for v in ranking.critical_speeds]
        print_table(
            rows, ["parameter", "value", "unit", "sd", "sd from", "growth 1/s", "frequency Hz", *critical_headers]
        )
        if front := front_line(model.parameters):
            click.echo(front)
        how = "with their correlations" if ranking.correlated else "independent"
        click.echo(f"all {len(ranking.changes)} parameters together: {ranking.total:.4g} 1/s ({how})")
        if ranking.correlated:
            click.echo(
                "a row changes one parameter and holds the others; because of correlations, the rows do not add up to "
                "the total"
            )
        linear = model.linear_model()
        print_exchanges({"": linear}, max([speed, *ranking.critical_speeds]))
        print_warnings(linear.warnings)
    chosen.note_rigid_front()
