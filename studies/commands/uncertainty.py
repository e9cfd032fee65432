"""``velotyre uncertainty``: bands on frequency, damping and critical speeds, and which measurement causes them."""

from typing import TYPE_CHECKING, Any

import click

from studies.model_space.command_options import Number, max_speed_option, sd_option, seed_option, speeds_option
from studies.model_space.model_argument import ChosenModel, takes_model
from studies.reporting.command_context import example

if TYPE_CHECKING:
    from studies.uncertainty.propagation import Quantity, Uncertainty

SMALL = 0.005  # a group whose share is below this everywhere has no column
LEADING = 3  # numbers that are named of many known together
HEADERS = ["quantity", "unit", "value", "sd linear", "sd Monte Carlo", "2.5 %", "97.5 %", "lost", "main cause"]


@click.command(
    help="Carry the measured uncertainty of MODEL to frequency, damping ratio and critical speeds.",
    epilog=example("velotyre uncertainty pista --speeds 5"),
)
@takes_model
@speeds_option("; default: critical speeds only.")
@click.option("--output", "outputs", multiple=True, metavar="NAME", help="A further output, as of sweeps; repeat.")
@sd_option
@click.option(
    "--relative-cornering-stiffness-sd",
    type=Number(0, 10),
    help="sd(C_Fy)/C_Fy of a tyre whose table states none; default: 0.03, with --stated-only 0.",
)
@click.option("--stated-only", is_flag=True, help="Count as exact what no source states; else defaults are assumed.")
@max_speed_option(60.0)
@click.option("--samples", type=Number(2, 1e12, whole=True), default=2000, show_default=True, help="Random bicycles.")
@seed_option
@click.option("--narrow", metavar="NAME", help="Which measurement would narrow this critical speed most (needs SALib).")
@click.option("--json", "json_file", metavar="FILE", help="Write the result as JSON; - is standard output.")
def command(
    chosen: ChosenModel,
    speeds: str | None,
    outputs: tuple[str, ...],
    sds: tuple[str, ...],
    relative_cornering_stiffness_sd: float | None,
    *,
    stated_only: bool,
    max_speed: float,
    samples: int,
    seed: int,
    narrow: str | None,
    json_file: str | None,
) -> None:
    import numpy as np

    from studies.model_space.axes import numbers_by_name
    from studies.model_space.outputs import scalar_output
    from studies.model_space.sampling import left_out
    from studies.reporting import output
    from studies.uncertainty import Uncertainty, assumed, counted_as_exact, remarks, stands_alone, total_effects
    from tyre.ground.errors import InputError

    output.check_targets(json=json_file)
    further = [scalar_output(name) for name in outputs]
    uncertainty = Uncertainty(
        chosen.content,
        sd=numbers_by_name(sds, "--sd", "c=0.005", "standard deviation"),
        defaults=not stated_only,
        relative_cornering_stiffness_sd=relative_cornering_stiffness_sd,
    )
    asked = np.array(output.parse_speeds(speeds) if speeds else [], float)
    found = uncertainty.quantities(asked, max_speed=max_speed, samples=samples, seed=seed, outputs=further)
    unlisted = uncertainty.unlisted(found, max_speed=max_speed, samples=samples, seed=seed)
    refused = uncertainty.left_out(samples=samples, seed=seed)
    kept = samples - sum(refused.values())
    notes: list[str] = [left_out(refused, samples)] if refused else []
    notes += [*stands_alone(uncertainty), *remarks(found, unlisted, kept, max_speed)]
    effects, failure = dict[str, tuple[float, float, float]](), None
    try:
        effects = total_effects(uncertainty, narrow, max_speed=max_speed, seed=seed) if narrow else {}
    except InputError as error:
        failure = error  # said when the table is there
    if json_file and not failure:  # before anything is printed, which a pipe may cut off
        indices = {k: dict(zip(("first", "total", "total_95"), v, strict=True)) for k, v in effects.items()}
        content = {
            "samples": samples,
            "seed": seed,
            "max_speed_m_s": max_speed,
            "quantities": [_record(uncertainty, q) for q in found],
            "standard_deviations": {
                key: {"sd": d.sd, "origin": d.origin, "why": d.why} for key, d in uncertainty.deviations.items()
            },
            "counted_as_exact": counted_as_exact(uncertainty),
            "assumed": assumed(uncertainty),
            "draws_left_out": {"count": sum(refused.values()), "reasons": refused},
            "samples_with_further_critical_speeds": unlisted,
            "notes": notes,
            "narrow": {"critical_speed": narrow, "indices": indices},
        }
        output.write_json(content, json_file)
    if json_file != "-":
        _print(uncertainty, found, notes)
        fastest = max((*asked.tolist(), *(c.speed for c in uncertainty.crossings(max_speed).values())), default=0.0)
        output.print_exchanges({"": uncertainty.nominal.linear_model()}, fastest)
        if effects:
            what = f"what would narrow '{narrow}' most"
            click.echo(f"\n{what} (share of its variance that goes if it is measured exactly)")
            ranked = sorted(effects.items(), key=lambda item: -item[1][0])
            heads = ["measurement", "first order", "total", "total ± 95 %"]
            output.print_table([[name, *row] for name, row in ranked], heads)
    if failure:
        raise failure
    output.print_warnings(uncertainty.warnings)


def _print(uncertainty: "Uncertainty", found: "list[Quantity]", notes: list[str]) -> None:
    """Print the quantities, notes, shares of the linear variance, and what is counted as exact or assumed."""
    from bicycle.model.default_sd import ASSUMED
    from studies.reporting.output import print_table
    from studies.sweep.specification import together
    from studies.uncertainty import by_group, known_exactly, stated

    table = []
    for q in found:
        cause = max(q.shares, key=lambda name: q.shares[name])
        shown = map(_plain, (q.value, q.linear_sd, q.sampled_sd, *q.band()))
        table.append([q.name, q.unit, *shown, q.lost, f"{cause} {q.shares[cause]:.0%}"])
    print_table(table, HEADERS)
    for note in notes:
        click.echo(f"note: {note}")
    rows = [by_group(q.shares) for q in found]
    groups = [g for g in dict.fromkeys(g for row in rows for g in row) if any(row[g] >= SMALL for row in rows)]
    if groups:
        click.echo("\nshare of the linear variance, by what is uncertain, and of it what is assumed")
        assumed = [by_group(q.shares, uncertainty.origin).get(ASSUMED, 0.0) for q in found]
        parts = [[*(row[g] for g in groups), last] for row, last in zip(rows, assumed, strict=True)]
        shares = [[q.name, *(f"{x:.0%}" for x in row)] for q, row in zip(found, parts, strict=True)]
        print_table(shares, ["quantity", *groups, ASSUMED])
    for name, numbers in uncertainty.measurements.items():
        hanging = [q for q in found if q.shares[name] >= SMALL]
        if together(numbers) == ", ".join(numbers) or not hanging:
            continue
        click.echo(
            f"\nof {len(numbers)} numbers known together, what one known exactly would take of the linear variance "
            "(they tell of each other, so these shares overlap)"
        )
        single = [list(known_exactly(uncertainty, name, q.gradient).items())[:LEADING] for q in hanging]
        table = [[q.name, *(f"{key} {part:.0%}" for key, part in row)] for q, row in zip(hanging, single, strict=True)]
        print_table(table, ["quantity", "most", *[""] * (LEADING - 1)])
    for words in stated(uncertainty):
        click.echo(f"\n{words}")


def _record(uncertainty: "Uncertainty", q: "Quantity") -> dict[str, Any]:
    from studies.uncertainty import by_group, differs, known_exactly

    alone = {
        name: known_exactly(uncertainty, name, q.gradient)
        for name, of in uncertainty.measurements.items()
        if len(of) > 1
    }
    return {
        "quantity": q.name,
        "unit": q.unit,
        "value": _plain(q.value),
        "linear_sd": _plain(q.linear_sd),
        "monte_carlo_sd": _plain(q.sampled_sd),
        "band_95": [_plain(end) for end in q.band()],
        "samples": len(q.samples),
        "lost": q.lost,
        "linear_holds": not (q.lost or differs(q)),
        "linear_variance_shares": dict(q.shares),
        "variance_shares_by_group": by_group(q.shares),
        "variance_shares_by_origin": by_group(q.shares, uncertainty.origin),
        "known_exactly": {name: shares for name, shares in alone.items() if shares},
    }


def _plain(value: float) -> float | None:
    return None if value != value else value
