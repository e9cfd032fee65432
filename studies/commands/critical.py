"""``velotyre critical``: the speeds at which a mode gains or loses stability."""

import click


@click.command(help="Exact critical speeds of MODEL.toml: where a mode becomes stable or unstable.")
@click.argument("model_file", metavar="MODEL.toml")
@click.option("--max-speed", default=60.0, show_default=True, help="Search up to this speed, m/s.")
@click.option("--json", "json_file", metavar="FILE", help="Write the result as JSON; - is standard output.")
def command(model_file: str, max_speed: float, json_file: str | None) -> None:
    from bicycle.model_file import read_model
    from studies.analysis import analyse, record
    from studies.output import print_critical, print_warnings, write_json

    model = read_model(model_file).linear_model()
    _, critical = analyse(model, [], max_speed=max_speed)
    if json_file is not None:
        write_json(record(model, None, critical), json_file)
    if json_file != "-":
        print_critical(critical)
        print_warnings(model.warnings)
