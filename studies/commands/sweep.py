"""``velotyre sweep``: many bicycles, tyres and speeds at once, on this machine or a cluster."""

import click

from studies.reporting.examples import example
from studies.reporting.output import verbose


@click.command(
    help="Compute the sweep that SWEEP.toml describes; run again to continue an interrupted one.",
    epilog=example("velotyre sweep sweep.toml --out result.zarr"),
)
@verbose
@click.argument("sweep_file", metavar="SWEEP.toml")
@click.option("--out", required=True, metavar="RESULT", help="Result: a .zarr folder, or a .nc file (netCDF).")
@click.option("--workers", type=click.IntRange(1), help="Workers of this machine; default: one a core.")
@click.option("--processes", type=click.IntRange(1), help="The same, processes whatever is computed.")
@click.option("--scheduler", metavar="ADDRESS", help="Address of a dask.distributed scheduler, e.g. tcp://host:8786.")
@click.option("--plot", is_flag=True, help="Draw the result into RESULT_figures, as 'velotyre draw' does.")
@click.option("--json", "json_file", metavar="FILE", help="Write what was computed as JSON; - is standard output.")
def command(
    sweep_file: str, out: str, workers: int | None, processes: int | None, scheduler: str | None,
    json_file: str | None, *, plot: bool,
) -> None:  # fmt: skip
    import logging
    from importlib import import_module
    from importlib.util import find_spec
    from os import cpu_count

    from studies.reporting.output import print_warnings, write_json
    from studies.sweeps.engines import in_processes, on_cluster
    from studies.sweeps.part_size import here
    from studies.sweeps.result import impossible_draws
    from studies.sweeps.run import run_sweep
    from studies.sweeps.sweep_file import read_sweep
    from studies.sweeps.tyre_table import said_of_stiffness
    from tyre.base.errors import InputError
    from tyre.base.optional import not_installed

    for module in (
        "zarr",
        "xarray",
        *(["distributed"] if scheduler else []),
        *(["netCDF4"] if out.endswith(".nc") else []),
    ):
        if not find_spec(module):
            raise InputError(not_installed(module, extra="sweeps"))
    chosen = [engine for engine in (workers, processes, scheduler) if engine]
    if len(chosen) > 1:
        raise InputError("give one of --workers, --processes and --scheduler")
    sweep = read_sweep(sweep_file)
    engine = in_processes(processes) if processes else here(sweep, workers or cpu_count() or 1)
    if scheduler:
        engine = on_cluster(scheduler)
        import_module("distributed")  # which sets its own levels
        for logger in ("distributed", "distributed.client"):  # what is lost is said in one line, without tracebacks
            logging.getLogger(logger).setLevel(logging.CRITICAL)
    result = run_sweep(sweep, out, engine=engine, progress=True)
    record = {
        "result": result.as_posix(), "fingerprint": sweep.fingerprint, "bicycles": sweep.items,
        "points": sweep.items * sweep.points_per_item, "outputs": list(sweep.outputs),
        "impossible_draws": impossible_draws(result),
    }  # fmt: skip
    if json_file:
        write_json(record, json_file)
    if json_file != "-":
        click.echo(f"{record['bicycles']} bicycles, {record['points']} points: {record['result']}")
    if plot:
        from studies.reporting.manifest import results
        from studies.sweep_pictures.draw import draw_result, figures_folder
        from studies.sweep_pictures.said import say_what_is_drawn

        try:
            with results(folder := figures_folder(result)):
                drawn = draw_result(result, folder)
            say_what_is_drawn(drawn, quiet=json_file == "-")
        except InputError as error:  # the sweep itself is finished
            click.echo(f"remark: {error}", err=True)
    print_warnings(said_of_stiffness(sweep.nominal.linear_model().warnings, sweep.relative_cornering_stiffness_sd))
