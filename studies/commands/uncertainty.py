"""``velotyre uncertainty``: bands on frequency, damping and critical speeds, and which measurement causes them."""

from typing import TYPE_CHECKING, Any

import click

from studies.model_argument import ChosenModel, takes_model
from studies.reporting.examples import example

if TYPE_CHECKING:
    from studies.uncertainty.propagation import Uncertainty
    from studies.uncertainty.quantity import Quantity

SMALL = 0.005  # a group whose share is below this everywhere has no column
LEADING = 3  # numbers that are named of many known together
HEADERS = ["quantity", "unit", "value", "sd linear", "sd Monte Carlo", "2.5 %", "97.5 %", "lost", "main cause"]


@click.command(
    help="Carry the measured uncertainty of MODEL to frequency, damping ratio and critical speeds.",
    epilog=example("velotyre uncertainty pista --speeds 5"),
)
@takes_model
@click.option("--speeds", help="m/s: start:stop:step with both ends, or a list 2,5,8; default: critical speeds only.")
@click.option("--sd", "sds", multiple=True, metavar="NAME=VALUE", help="Standard deviation of a parameter, SI; repeat.")
@click.option(
    "--relative-cornering-stiffness-sd",
    type=click.FloatRange(0),
    help="sd(C_Fy)/C_Fy of a tyre whose table states none; default: 0.03, with --stated-only 0.",
)
@click.option("--stated-only", is_flag=True, help="Count as exact what no source states; else defaults are assumed.")
@click.option("--max-speed", default=60.0, show_default=True, help="Search critical speeds up to this speed, m/s.")
@click.option("--samples", type=click.IntRange(2), default=2000, show_default=True, help="Monte Carlo bicycles.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of the random numbers.")
@click.option("--narrow", metavar="NAME", help="Which measurement would narrow this critical speed most (needs SALib).")
@click.option("--json", "json_file", metavar="FILE", help="Write the result as JSON; - is standard output.")
def command(
    chosen: ChosenModel, speeds: str | None, sds: tuple[str, ...], relative_cornering_stiffness_sd: float | None,
    *, stated_only: bool, max_speed: float, samples: int, seed: int, narrow: str | None, json_file: str | None,
) -> None:  # fmt: skip
    import numpy as np

    from studies.model_axes.pairs import numbers_by_name
    from studies.reporting.output import check_targets, parse_speeds, print_table, print_warnings, write_json
    from studies.sampling.refused import left_out
    from studies.uncertainty.comparison import remarks, stands_alone
    from studies.uncertainty.contributions import assumed, assumed_words, counted_as_exact, exact_words
    from studies.uncertainty.propagation import Uncertainty
    from studies.uncertainty.variance_shares import total_effects

    check_targets(json=json_file)
    uncertainty = Uncertainty(
        chosen.content, sd=numbers_by_name(sds, "--sd", "c=0.005", "standard deviation"), defaults=not stated_only,
        relative_cornering_stiffness_sd=relative_cornering_stiffness_sd,
    )  # fmt: skip
    asked = parse_speeds(speeds).tolist() if speeds else []
    found = uncertainty.quantities(np.array(asked), max_speed=max_speed, samples=samples, seed=seed)
    unlisted = uncertainty.unlisted(found, max_speed=max_speed, samples=samples, seed=seed)
    refused = uncertainty.left_out(samples=samples, seed=seed)
    kept = samples - sum(refused.values())
    said = [left_out(refused, samples)] if refused else []
    said += [*stands_alone(uncertainty), *remarks(found, unlisted, kept, max_speed)]
    if json_file != "-":
        print_table([_row(q) for q in found], HEADERS)
        for remark in said:
            click.echo(f"note: {remark}")
        _print_groups(uncertainty, found)
        _print_together(uncertainty, found)
        for words in (exact_words(uncertainty), assumed_words(uncertainty)):
            if words:
                click.echo(f"\n{words}")
    effects = total_effects(uncertainty, narrow, max_speed=max_speed, seed=seed) if narrow else {}
    if effects and json_file != "-":
        click.echo(f"\nwhat would narrow '{narrow}' most (share of its variance that goes when it is measured exactly)")
        ranked = sorted(effects.items(), key=lambda item: -item[1][0])
        print_table(
            [[name, *values] for name, values in ranked], ["measurement", "first order", "total", "total ± 95 %"]
        )
    if json_file:
        indices = {k: dict(zip(("first", "total", "total_95"), v, strict=True)) for k, v in effects.items()}
        content = {
            "samples": samples, "seed": seed, "max_speed_m_s": max_speed,
            "quantities": [_record(uncertainty, q) for q in found],
            "standard_deviations": {
                key: {"sd": d.sd, "origin": d.origin, "why": d.why} for key, d in uncertainty.deviations.items()
            },
            "counted_as_exact": counted_as_exact(uncertainty), "assumed": assumed(uncertainty),
            "draws_left_out": {"count": sum(refused.values()), "reasons": refused},
            "samples_with_further_critical_speeds": unlisted, "notes": list(said),
            "narrow": {"critical_speed": narrow, "indices": indices},
        }  # fmt: skip
        write_json(content, json_file)
    print_warnings(uncertainty.warnings)


def _row(q: "Quantity") -> list[Any]:
    low, high = q.band()
    cause = max(q.shares, key=lambda name: q.shares[name])
    numbers = map(_plain, (q.value, q.linear_sd, q.sampled_sd, low, high))
    return [q.name, q.unit, *numbers, q.lost, f"{cause} {q.shares[cause]:.0%}"]


def _print_groups(uncertainty: "Uncertainty", found: "list[Quantity]") -> None:
    """Shares of the linear variance by group, and of what is assumed."""
    from bicycle.default_sd import ASSUMED
    from studies.reporting.output import print_table
    from studies.uncertainty.contributions import by_group, by_origin

    rows = [by_group(q.shares) for q in found]
    groups = [g for g in dict.fromkeys(g for row in rows for g in row) if any(row[g] >= SMALL for row in rows)]
    if not groups:
        return
    click.echo("\nshare of the linear variance, by what is uncertain, and of it what is assumed")
    table = [
        [q.name, *(f"{row[g]:.0%}" for g in groups), f"{by_origin(uncertainty, q.shares).get(ASSUMED, 0.0):.0%}"]
        for q, row in zip(found, rows, strict=True)
    ]
    print_table(table, ["quantity", *groups, ASSUMED])


def _print_together(uncertainty: "Uncertainty", found: "list[Quantity]") -> None:
    """Of what is too much to be named in a column: which single number a result hangs on most."""
    from studies.reporting.output import print_table
    from studies.sweeps.spec import MOST_NAMES
    from studies.uncertainty.contributions import known_exactly

    for name, numbers in uncertainty.measurements.items():
        hanging = [q for q in found if q.shares[name] >= SMALL]
        if len(numbers) <= MOST_NAMES or not hanging:
            continue
        click.echo(
            f"\nof {len(numbers)} numbers known together, what one known exactly would take of the linear variance "
            "(they tell of each other, so these shares overlap)"
        )
        single = [list(known_exactly(uncertainty, name, q.gradient).items())[:LEADING] for q in hanging]
        table = [[q.name, *(f"{key} {part:.0%}" for key, part in row)] for q, row in zip(hanging, single, strict=True)]
        print_table(table, ["quantity", "most", *[""] * (LEADING - 1)])


def _record(uncertainty: "Uncertainty", q: "Quantity") -> dict[str, Any]:
    from studies.uncertainty.comparison import differs
    from studies.uncertainty.contributions import by_group, by_origin, known_exactly

    record = {"quantity": q.name, "unit": q.unit, "value": q.value, "linear_sd": q.linear_sd}
    record |= {"monte_carlo_sd": q.sampled_sd, "band_95": list(q.band()), "samples": len(q.samples), "lost": q.lost}
    plain = {k: _plain(v) for k, v in record.items()}
    alone = {name: known_exactly(uncertainty, name, q.gradient) for name, of in uncertainty.measurements.items()
             if len(of) > 1}  # fmt: skip
    return plain | {"linear_holds": not (q.lost or differs(q)), "linear_variance_shares": dict(q.shares)} | {
        "variance_shares_by_group": by_group(q.shares), "variance_shares_by_origin": by_origin(uncertainty, q.shares),
        "known_exactly": {name: shares for name, shares in alone.items() if shares},
    }  # fmt: skip


def _plain(value: object) -> object:
    if isinstance(value, list):
        return [_plain(one) for one in value]
    return None if isinstance(value, float) and value != value else value
