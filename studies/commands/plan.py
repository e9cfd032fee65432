"""``velotyre plan``: the cheapest further measurements that settle what a diagnosis leaves open."""

from pathlib import Path

import click

from studies.reporting.examples import example
from studies.reporting.output import verbose


@click.command(
    help="The cheapest further measurements that settle what a diagnosis of MEASUREMENT leaves open, at your prices.",
    epilog=example("velotyre new costs.toml --kind costs", "velotyre plan kooijman2008 --costs costs.toml --out plan"),
)
@click.argument("measurement_file", metavar="MEASUREMENT")
@verbose
@click.option(
    "--costs",
    "costs_file",
    metavar="COSTS.toml",
    type=click.Path(path_type=Path),
    required=True,
    help="What can be measured, and its price (velotyre new COSTS.toml --kind costs).",
)
@click.option("--out", "folder", metavar="DIR", type=click.Path(path_type=Path, file_okay=False),
              help="Write plan.md, plan.json and the figure of price against separation there.")  # fmt: skip
@click.option("--without", metavar="EFFECT", multiple=True, help="Do not try this effect; may be repeated.")
@click.option("--with", "with_", metavar="EFFECT", multiple=True, help="Try this motor too (steer_assist).")
@click.option("--json", "json_file", metavar="FILE", help="Write the plan as JSON; - is standard output.")
def command(
    measurement_file: str, costs_file: Path, folder: Path | None, without: tuple[str, ...], with_: tuple[str, ...],
    json_file: str | None,
) -> None:  # fmt: skip
    from studies.missing_effect import diagnose, read_measurement
    from studies.missing_effect.plan import words
    from studies.missing_effect.plan.costs import read_costs
    from studies.missing_effect.plan.offers import channels_of, check
    from studies.missing_effect.plan.plan import plan
    from studies.missing_effect.plan.report import write_plan
    from studies.missing_effect.reporting.sentences import sentence
    from studies.reporting.manifest import results
    from studies.reporting.output import check_targets, print_table, print_warnings, write_json
    from tyre.base.errors import InputError

    check_targets(json=json_file)
    measurement = read_measurement(measurement_file)
    forward = measurement.forward(without=without, also=with_)
    costs = read_costs(costs_file, channels_of(forward))
    try:
        check(forward, measurement.name, costs)  # before what takes time
        found = diagnose(measurement, without=without, with_=with_, progress=True)
        made = plan(found, costs)
    except InputError as error:
        raise InputError(f"{costs_file}: {error}" if str(error).startswith("[") else str(error)) from error
    verdict = f"{found.verdict.verdict}: {sentence(found.verdict)}"
    if folder:
        with results(folder):
            write_plan(made, folder, measurement.name, verdict)
    if json_file:
        write_json(made.to_dict(), json_file)
    if json_file == "-":
        return
    click.echo(verdict)
    click.echo(words.headline(made))
    if made.steps:
        print_table(words.step_rows(made), words.STEPS)
    for line in words.afterwards(made):
        click.echo(f"afterwards: {line}")
    if made.questions:
        print_table(words.question_rows(made), words.QUESTIONS)
    for line in words.hopeless(made):
        click.echo(f"not settled: {line}")
    if words.proof(made):
        click.echo(words.proof(made))
    if folder:
        click.echo(f"{folder}: plan.md, plan.json{', plan.png, plan.svg' if len(made.curve) > 1 else ''}")
    print_warnings(made.notes)
