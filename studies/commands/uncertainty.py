"""``velotyre uncertainty``: bands on frequency, damping and critical speeds, and which measurement causes them."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

from studies.model_space.command_options import Number, max_speed_option, sd_option, seed_option, speeds_option
from studies.model_space.model_argument import ChosenModel, takes_model
from studies.reporting.command_context import example

if TYPE_CHECKING:
    from studies.uncertainty.propagation import Quantity, Uncertainty
    from studies.uncertainty.uncertain_model import UncertainModel

SMALL = 0.005  # a group whose share is below this everywhere has no column
LEADING = 3  # numbers named of those that were measured together
HEADERS = ["quantity", "unit", "value", "sd linear", "sd Monte Carlo", "2.5 %", "97.5 %", "absent", "main cause"]


@click.command(
    help="Propagate parameter uncertainty to the results. Frequency, damping ratio and critical speeds of MODEL "
    "with their uncertainties.",
    epilog=example("velotyre uncertainty pista --speeds 5"),
)
@takes_model
@speeds_option("; default: critical speeds only.")
@click.option(
    "--output", "outputs", multiple=True, metavar="NAME", help="Further output, named as in sweeps; may be repeated."
)
@sd_option
@click.option(
    "--relative-cornering-stiffness-sd",
    type=Number(0, 10),
    help="Relative standard uncertainty of C_α if the tyre states none; default: 0.03, with --stated-only 0.",
)
@click.option(
    "--stated-only", is_flag=True, help="Treat parameters without a stated uncertainty as exact; default: assume one."
)
@max_speed_option(60.0)
@click.option("--samples", type=Number(2, 1e12, whole=True), default=2000, show_default=True, help="Number of samples.")
@seed_option
@click.option(
    "--narrow", metavar="NAME", help="Rank measurements by how much they narrow this critical speed (needs SALib)."
)
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
    from studies.uncertainty import (
        Uncertainty,
        assumed_sd,
        counted_as_exact,
        dropped_correlations,
        remarks,
        total_effects,
    )
    from tyre.ground.errors import InputError

    # Read the options.
    output.check_targets(json=json_file)
    further_outputs = [scalar_output(name) for name in outputs]
    uncertainty = Uncertainty(
        chosen.content,
        sd=numbers_by_name(sds, "--sd", "c=0.005", "standard deviation"),
        defaults=not stated_only,
        relative_cornering_stiffness_sd=relative_cornering_stiffness_sd,
    )
    grid = np.array(output.parse_speeds(speeds) if speeds else [], float)

    # Compute.
    quantities = uncertainty.quantities(grid, max_speed=max_speed, samples=samples, seed=seed, outputs=further_outputs)
    unlisted = uncertainty.count_unlisted(quantities, max_speed=max_speed, samples=samples, seed=seed)
    impossible = uncertainty.left_out(samples=samples, seed=seed)
    possible = samples - sum(impossible.values())
    notes: list[str] = [left_out(impossible, samples)] if impossible else []
    notes += [*dropped_correlations(uncertainty), *remarks(quantities, unlisted, possible, max_speed)]
    effects = dict[str, tuple[float, float, float]]()
    failure = None
    try:
        effects = total_effects(uncertainty, narrow, max_speed=max_speed, seed=seed) if narrow else {}
    except InputError as error:
        failure = error  # raised once the table is printed

    # Show.
    if json_file and not failure:  # before anything is printed, which a pipe may cut off
        indices = {k: dict(zip(("first", "total", "total_95"), v, strict=True)) for k, v in effects.items()}
        content = {
            "samples": samples,
            "seed": seed,
            "max_speed_m_s": max_speed,
            "quantities": [_record(uncertainty, q) for q in quantities],
            "standard_deviations": {
                key: {"sd": d.sd, "origin": d.origin, "why": d.why} for key, d in uncertainty.deviations.items()
            },
            "counted_as_exact": counted_as_exact(uncertainty),
            "assumed": assumed_sd(uncertainty),
            "draws_left_out": {"count": sum(impossible.values()), "reasons": impossible},
            "samples_with_further_critical_speeds": unlisted,
            "notes": notes,
            "narrow": {"critical_speed": narrow, "indices": indices},
        }
        output.write_json(content, json_file)
    if json_file != "-":
        _print(uncertainty, quantities, notes)
        crossing_speeds = [crossing.speed for crossing in uncertainty.crossings(max_speed).values()]
        fastest = max((*grid.tolist(), *crossing_speeds), default=0.0)
        output.print_exchanges({"": uncertainty.nominal.linear_model()}, fastest)
        if effects:
            _print_effects(effects, narrow)
    if failure:
        raise failure
    output.print_warnings(uncertainty.warnings)


def _print(uncertainty: "Uncertainty", quantities: "Sequence[Quantity]", notes: list[str]) -> None:
    """Print the quantities, notes, shares of the linear variance, and what is treated as exact or assumed."""
    from bicycle.parameters.front_hinge import front_line
    from studies.reporting.output import print_table
    from studies.uncertainty import describe_assumptions

    rows = []
    for q in quantities:
        cause = max(q.shares, key=lambda name: q.shares[name])
        numbers = [_none_if_nan(number) for number in (q.value, q.linear_sd, q.sampled_sd, *q.band())]
        rows.append([q.name, q.unit, *numbers, q.lost, f"{cause} {_percent(q.shares[cause])}"])
    print_table(rows, HEADERS)
    for note in notes:
        click.echo(f"note: {note}")
    _print_shares(uncertainty, quantities)
    for measurement, names in uncertainty.measurements.items():
        _print_joint_measurement(uncertainty, measurement, names, quantities)
    for paragraph in describe_assumptions(uncertainty):
        click.echo(f"\n{paragraph}")
    if front := front_line(uncertainty.nominal.parameters):
        click.echo(front)


def _print_shares(uncertainty: "UncertainModel", quantities: "Sequence[Quantity]") -> None:
    """Print each quantity's shares of the linear variance by group of parameters, and the share that is assumed."""
    from bicycle.model.default_sd import ASSUMED
    from studies.reporting.output import print_table
    from studies.uncertainty import by_group

    shares_of_quantities = [by_group(q.shares) for q in quantities]
    groups: list[str] = []
    for shares in shares_of_quantities:
        groups += [group for group in shares if group not in groups]
    groups = [group for group in groups if any(shares[group] >= SMALL for shares in shares_of_quantities)]
    if not groups:
        return
    click.echo("\nshares of the linear variance by group of parameters, and the share that is assumed")
    rows = []
    for q, shares in zip(quantities, shares_of_quantities, strict=True):
        assumed_share = by_group(q.shares, uncertainty.origin).get(ASSUMED, 0.0)
        rows.append([q.name, *(_percent(shares[group]) for group in groups), _percent(assumed_share)])
    print_table(rows, ["quantity", *groups, ASSUMED])


def _print_joint_measurement(
    uncertainty: "UncertainModel", measurement: str, names: tuple[str, ...], quantities: "Sequence[Quantity]"
) -> None:
    """Print which of the numbers that were measured together would narrow a quantity most if it were exact."""
    from studies.reporting.output import print_table
    from studies.sweep.specification import name_group
    from studies.uncertainty import known_exactly

    affected = [q for q in quantities if q.shares[measurement] >= SMALL]
    if name_group(names) == ", ".join(names) or not affected:  # few enough that the tables above name each
        return
    click.echo(
        f"\nvariance reduction if one parameter were exact, of {len(names)} correlated parameters (linear; the "
        "reductions overlap)"
    )
    rows = []
    for q in affected:
        leading = list(known_exactly(uncertainty, measurement, q.gradient).items())[:LEADING]
        rows.append([q.name, *(f"{key} {_percent(share)}" for key, share in leading)])
    print_table(rows, ["quantity", "most", *[""] * (LEADING - 1)])


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def _print_effects(effects: Mapping[str, tuple[float, float, float]], crossing: str | None) -> None:
    """Print the first-order and total index of each measurement for a critical speed, largest first."""
    from studies.reporting.output import print_table

    click.echo(f"\nmeasurements that reduce the variance of '{crossing}' (shares removed if one is exact)")
    ranked = sorted(effects.items(), key=lambda item: -item[1][0])
    print_table([[name, *indices] for name, indices in ranked], ["measurement", "first order", "total", "total ± 95 %"])


def _record(uncertainty: "UncertainModel", q: "Quantity") -> dict[str, Any]:
    """One quantity for JSON: value, uncertainties in its unit, and shares of its variance."""
    from studies.uncertainty import by_group, differs, known_exactly

    reductions = {
        measurement: known_exactly(uncertainty, measurement, q.gradient)
        for measurement, names in uncertainty.measurements.items()
        if len(names) > 1
    }
    return {
        "quantity": q.name,
        "unit": q.unit,
        "value": _none_if_nan(q.value),
        "linear_sd": _none_if_nan(q.linear_sd),
        "monte_carlo_sd": _none_if_nan(q.sampled_sd),
        "band_95": [_none_if_nan(end) for end in q.band()],
        "samples": len(q.samples),
        "lost": q.lost,
        "linear_holds": not (q.lost or differs(q)),
        "linear_variance_shares": dict(q.shares),
        "variance_shares_by_group": by_group(q.shares),
        "variance_shares_by_origin": by_group(q.shares, uncertainty.origin),
        "known_exactly": {name: shares for name, shares in reductions.items() if shares},
    }


def _none_if_nan(value: float) -> float | None:
    return None if value != value else value
