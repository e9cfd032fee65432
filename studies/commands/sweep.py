"""``velotyre sweep``: many bicycles, tyres and speeds at once, on this machine or a cluster, and figures of them."""

from pathlib import Path

import click

from studies.model_space.command_options import SPEED, WORKERS
from studies.reporting.command_context import example, verbose


@click.command(
    help="Compute or draw the sweep that SWEEP.toml describes. The same command continues an interrupted sweep. --plot "
    "draws critical speeds by name, bands over speed, outputs over the varied parameters, and variance shares, as PNG "
    "and SVG, with the numbers as CSV. SWEEP may also be a finished result to draw.",
    epilog=example("velotyre sweep sweep.toml --out result.zarr --plot"),
)
@verbose
@click.argument("sweep_file", metavar="SWEEP.toml")
@click.option("--out", metavar="RESULT", help="Result: a .zarr folder, or a .nc file (netCDF).")
@click.option("--workers", type=WORKERS, help="Workers on this machine; default: one per core.")
@click.option("--processes", type=WORKERS, help="Workers on this machine, always as processes.")
@click.option("--scheduler", metavar="ADDRESS", help="Address of a dask.distributed scheduler, e.g. tcp://host:8786.")
@click.option("--plot", is_flag=True, help="Write the figures to RESULT_figures.")
@click.option("--figures", metavar="DIR", help="Folder for the figures.")
@click.option("--at", type=SPEED, metavar="M_S", help="Speed at which samples are classed as stable or unstable, m/s.")
@click.option("--json", "json_file", metavar="FILE", help="Write the result as JSON; - is standard output.")
def command(
    sweep_file: str,
    out: str | None,
    workers: int | None,
    processes: int | None,
    scheduler: str | None,
    figures: str | None,
    at: float | None,
    json_file: str | None,
    *,
    plot: bool,
) -> None:
    from studies.reporting.output import check_targets, print_warnings, write_json
    from studies.sweep import impossible_draws, read_sweep, run_sweep, stiffness_warnings
    from tyre.ground.errors import InputError

    # Read the options.
    check_targets(json=json_file)
    finished = Path(sweep_file).suffix in (".zarr", ".nc")
    target = sweep_file if finished else out
    if target is None:
        raise InputError("--out is missing: give a .zarr folder or .nc file for the result")
    if finished and (out or not (plot or figures)):
        raise InputError(f"{sweep_file} is a result; give --plot, and no --out, to draw it")
    wants_figures = plot or figures is not None
    if at is not None and not wants_figures:
        raise InputError(f"--at {at:g} is for figures; give --plot, too")
    _check_modules(target, scheduler)

    # Draw a result that is there.
    to_screen = json_file != "-"
    if finished:
        record = _draw(target, figures, at, quiet=not to_screen)
        if json_file:
            write_json(record, json_file)
        return

    # Compute, and draw what was computed.
    if len([engine for engine in (workers, processes, scheduler) if engine]) > 1:
        raise InputError("give one of --workers, --processes and --scheduler")
    sweep = read_sweep(sweep_file)
    result = run_sweep(sweep, target, engine=_engine(sweep, workers, processes, scheduler), progress=True).as_posix()
    record = {
        "result": result,
        "fingerprint": sweep.fingerprint,
        "bicycles": sweep.items,
        "points": sweep.items * sweep.points_per_item,
        "outputs": list(sweep.outputs),
        "impossible_draws": impossible_draws(Path(result)),
    }
    if to_screen:
        click.echo(f"{record['bicycles']} bicycles, {record['points']} points: {result}")
    if wants_figures:
        try:
            record |= _draw(result, figures, at, quiet=not to_screen)
        except InputError as error:
            if figures or at is not None:
                raise
            click.echo(f"remark: {error}", err=True)  # the sweep itself is finished
    if json_file:
        write_json(record, json_file)
    print_warnings(stiffness_warnings(sweep.nominal.linear_model().warnings, sweep.relative_cornering_stiffness_sd))


def _check_modules(target: str, scheduler: str | None) -> None:
    """Refuse a result whose file format or scheduler needs a module that is not installed."""
    from importlib.util import find_spec

    from tyre.ground.errors import InputError
    from tyre.ground.progress import missing_package_text

    modules = ["zarr", "xarray", "dask"]
    if scheduler:
        modules.append("distributed")
    if target.endswith(".nc"):
        modules.append("netCDF4")
    for module in modules:
        if not find_spec(module):
            raise InputError(missing_package_text(module, extra="sweeps"))


def _engine(sweep: object, workers: int | None, processes: int | None, scheduler: str | None) -> object:
    """Choose what computes the bicycles: a cluster, processes, or workers of this machine (one per core by default)."""
    import logging
    from importlib import import_module
    from os import cpu_count

    from studies.sweep import in_processes, on_cluster, on_this_machine

    if not scheduler:
        return in_processes(processes) if processes else on_this_machine(sweep, workers or cpu_count() or 1)
    import_module("distributed")  # which sets its own levels
    for logger in ("distributed", "distributed.client"):  # a lost worker is one line, without traceback
        logging.getLogger(logger).setLevel(logging.CRITICAL)
    return on_cluster(scheduler)


def _draw(result: str, figures: str | None, at: float | None, *, quiet: bool) -> dict[str, object]:
    """Draw a result into a folder, print a line for each figure (unless ``quiet``) and remarks; return them for JSON.

    ``at`` is the speed in m/s at which the figures part stable from unstable.
    """
    from studies.reporting.manifest import results
    from studies.sweep import draw_result, figures_folder

    folder = Path(figures) if figures else figures_folder(result)
    with results(folder):
        drawn = draw_result(result, folder, at=at)
    if not quiet:
        for name, caption in drawn.figures.items():
            click.echo(f"{(drawn.folder / name).as_posix()}.png, .svg, .csv: {' '.join(caption.split())}")
    for remark in drawn.remarks:
        click.echo(f"remark: {remark}", err=True)
    return {"folder": drawn.folder.as_posix(), "figures": drawn.figures, "remarks": drawn.remarks}
