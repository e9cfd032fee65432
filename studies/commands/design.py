"""``velotyre design``: the smallest change of a model that keeps named modes stable over a range of speed."""

import shlex
import sys
from pathlib import Path

import click

from studies.model_space.command_options import SPEED, SPEED_ABOVE_0, Number, assume_option, sd_option, seed_option
from studies.model_space.model_argument import ChosenModel, takes_model
from studies.reporting.command_context import example
from tyre.ground.errors import InputError

Demands = tuple[tuple[str, str], ...]  # mode, and 'stable', a least damping ratio or a largest amplitude


def check_demands(context: click.Context, parameter: click.Parameter, value: Demands) -> Demands:
    """Refuse a ``--keep`` whose second word is missing, so that it took the next option."""
    for mode, demand in value:
        if demand.startswith("--"):
            raise InputError(f"--keep {mode} {demand}: state the requirement, for example --keep {mode} stable")
    return value


@click.command(
    help="Find the smallest change that keeps modes stable. Modes of MODEL meet the requirement up to a speed; the "
    "changed model file is written.",
    epilog=example("velotyre design benchmark --keep weave stable --from 4 --up-to 6 --vary c,w --out better.toml"),
)
@takes_model
@click.option(
    "--keep",
    nargs=2,
    multiple=True,
    required=True,
    metavar="MODE WHAT",
    callback=check_demands,
    help="Mode (or all), then 'stable', a minimum damping ratio or a maximum steer amplitude (2deg); may be repeated.",
)
@click.option("--up-to", type=SPEED_ABOVE_0, required=True, help="Highest speed of the requirement, m/s.")
@click.option("--from", "low", type=SPEED, default=1.0, show_default=True, help="Lowest speed of the requirement, m/s.")
@click.option(
    "--vary", required=True, metavar="NAME,NAME", help="Parameters that may change, as --parameter of root-locus."
)
@click.option("--damping-ratio", type=Number(0, 1, below=True), help="Minimum damping ratio for 'stable'.")
@click.option(
    "--cost", "costs", multiple=True, metavar="NAME=VALUE", help="Cost of a change by one unit; may be repeated."
)
@click.option(
    "--limits", "limits", multiple=True, metavar="NAME=LOW:HIGH", help="Allowed range of a parameter; may be repeated."
)
@sd_option
@assume_option
@click.option(
    "--probability", type=Number(0, 1, above=True, below=True), help="Required probability of meeting the requirement."
)
@click.option(
    "--samples", type=Number(50, 1e12, whole=True), default=1000, show_default=True, help="Number of parameter samples."
)
@seed_option
@click.option(
    "--out", type=click.Path(path_type=Path, dir_okay=False), required=True, help="File for the changed model, .toml."
)
@click.option("--json", "json_file", metavar="FILE", help="Write the result as JSON; - is standard output.")
def command(
    chosen: ChosenModel,
    keep: Demands,
    up_to: float,
    low: float,
    vary: str,
    damping_ratio: float | None,
    costs: tuple[str, ...],
    limits: tuple[str, ...],
    sds: tuple[str, ...],
    probability: float | None,
    samples: int,
    seed: int,
    out: Path,
    json_file: str | None,
    *,
    assume: bool,
) -> None:
    from bicycle.model.model_file import build_model
    from bicycle.parameters.bicycle import canonical
    from bicycle.parameters.front_hinge import front_line
    from studies import design as designs
    from studies.model_space.axes import numbers_by_name, ranges_by_name
    from studies.reporting.output import check_targets, print_exchanges, print_table, print_warnings, write_json
    from tyre.ground.files import write_text

    check_targets(json=json_file)
    if up_to <= low:
        raise InputError(f"--up-to {up_to:g} must be above --from {low:g} m/s")
    if out.suffix.lower() != ".toml":
        raise InputError(f"--out {out}: a model file ends in .toml")
    chosen.model  # noqa: B018 (a mistake in the file is reported with its name)
    keys = [canonical(key) for key in vary.split(",") if key]
    if not keys:
        raise InputError("--vary: give at least one parameter, for example --vary c,w")
    content, added = designs.with_effects(chosen.content, keys)
    wishes = designs.Wishes(
        numbers_by_name(costs, "--cost", "c=100", "cost", own_unit=False),
        numbers_by_name(sds, "--sd", "c=0.005", "standard deviation"),
        ranges_by_name(limits),
        assume=assume,
        probability=probability,
        samples=samples,
        seed=seed,
    )
    design = designs.find_design(content, keys, designs.demands(keep, damping_ratio), (low, up_to), wishes)
    if design.after.kept:
        options = " ".join(f"--keep {mode} {demand}" for mode, demand in keep) + f" --from {low:g} --up-to {up_to:g}"
        write_text(out, designs.model_text(design, out.parent, shlex.join(options.split())))
    if json_file:
        write_json(designs.record(design), json_file)
    if json_file != "-":
        print_table(designs.rows(design), designs.HEADERS)
        notes = [f"added: [effects.{name}], initially neutral" for name in added]
        if front := front_line(build_model(design.content).parameters):
            notes.append(f"in the design {front}")
        click.echo("\n".join([*designs.lines(design), *notes]))
        if design.after.kept:
            click.echo(f"written: {out}")
        print_exchanges({"": design.problem.space.linear}, up_to)
    print_warnings([*design.problem.space.linear.warnings, *designs.remarks(design)])
    chosen.note_rigid_front()
    if not design.after.kept:
        sys.exit(1)
