"""``velotyre modes``: eigenvalues and named modes of a model file along speed."""

import click


@click.command(help="Eigenvalues, named modes and critical speeds of MODEL.toml.")
@click.argument("model_file", metavar="MODEL.toml")
@click.option("--speeds", required=True, help="m/s: start:stop:step with both ends, or a list 2,5,8.")
@click.option("--max-speed", default=60.0, show_default=True, help="Search critical speeds up to this speed, m/s.")
@click.option("--json", "json_file", metavar="FILE", help="Write the result as JSON; - is standard output.")
def command(model_file: str, speeds: str, max_speed: float, json_file: str | None) -> None:
    from bicycle.model_file import read_model
    from studies.analysis import analyse, record
    from studies.output import parse_speeds, print_critical, print_table, print_warnings, write_json

    model = read_model(model_file).linear_model()
    found, critical = analyse(model, parse_speeds(speeds), max_speed=max_speed)
    assert found is not None  # parse_speeds gives at least one speed
    if json_file is not None:
        write_json(record(model, found, critical), json_file)
    if json_file != "-":
        rows = []
        for speed, *values in zip(found.speeds, *found.to_dict().values(), strict=True):
            rows.append([speed, *(" ".join(_number(*z) for z in value or []) or None for value in values)])
        print_table(rows, ["speed m/s", *(f"{name} 1/s" for name in found.to_dict())])
        click.echo()
        print_critical(critical)
        for event in found.events:
            click.echo(str(event))
        print_warnings(model.warnings)


def _number(real: float, imaginary: float) -> str:
    return f"{real:.4g}" if imaginary == 0 else f"{real:.4g}±{abs(imaginary):.4g}i"
