"""``velotyre draw``: figures of the result of a sweep."""

from pathlib import Path

import click

from studies.reporting.examples import example


@click.command(
    help="Draw what RESULT of 'velotyre sweep' holds: critical speeds by name, bands along the speed, outputs over the "
    "varied parameters, and which parameter matters; PNG and SVG, and the numbers as CSV.",
    epilog=example("velotyre draw result.zarr --out figures"),
)
@click.argument("result", metavar="RESULT")
@click.option("--out", metavar="DIR", help="Folder for the figures; default: RESULT_figures beside it.")
@click.option("--at", type=float, metavar="M_S", help="Speed at which stable and unstable are told apart, m/s.")
@click.option("--json", "json_file", metavar="FILE", help="Write what was drawn as JSON; - is standard output.")
def command(result: str, out: str | None, at: float | None, json_file: str | None) -> None:
    from importlib.util import find_spec

    from studies.reporting.manifest import results
    from studies.reporting.output import check_targets, write_json
    from studies.sweep_pictures.draw import draw_result, figures_folder
    from studies.sweep_pictures.said import say_what_is_drawn
    from tyre.base.errors import InputError
    from tyre.base.optional import not_installed

    check_targets(json=json_file)
    for module in ("zarr", "xarray", *(["netCDF4"] if result.endswith(".nc") else [])):
        if not find_spec(module):
            raise InputError(not_installed(module, extra="sweeps"))
    folder = Path(out) if out else figures_folder(result)
    with results(folder):
        drawn = draw_result(result, folder, at=at)
    if json_file:
        content = {"folder": drawn.folder.as_posix(), "figures": drawn.figures, "remarks": drawn.remarks}
        write_json(content, json_file)
    say_what_is_drawn(drawn, quiet=json_file == "-")
