"""``velotyre uncertainty``: bands on frequency, damping and critical speeds, and which measurement causes them."""

import click


@click.command(help="Carry the measured uncertainty of MODEL.toml to frequency, damping ratio and critical speeds.")
@click.argument("model_file", metavar="MODEL.toml")
@click.option("--speeds", help="m/s: start:stop:step with both ends, or a list 2,5,8; default: critical speeds only.")
@click.option("--sd", "sds", multiple=True, metavar="NAME=VALUE", help="Standard deviation of a parameter, SI; repeat.")
@click.option("--relative-cornering-stiffness-sd", default=0.0, help="Assumed sd(C_Fy)/C_Fy of the tyre, e.g. 0.03.")
@click.option("--max-speed", default=60.0, show_default=True, help="Search critical speeds up to this speed, m/s.")
@click.option("--samples", type=click.IntRange(2), default=2000, show_default=True, help="Monte Carlo bicycles.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of the random numbers.")
@click.option("--narrow", metavar="NAME", help="Which measurement would narrow this critical speed most (needs SALib).")
@click.option("--json", "json_file", metavar="FILE", help="Write the result as JSON; - is standard output.")
def command(
    model_file: str, speeds: str | None, sds: tuple[str, ...], relative_cornering_stiffness_sd: float,
    max_speed: float, samples: int, seed: int, narrow: str | None, json_file: str | None,
) -> None:  # fmt: skip
    import numpy as np

    from studies.output import parse_speeds, print_table, print_warnings, write_json
    from studies.uncertainty.propagation import Uncertainty
    from studies.uncertainty.variance_shares import total_effects
    from tyre.errors import InputError

    given = {}
    for text in sds:
        name, _, value = text.partition("=")
        try:
            given[name] = float(value)
        except ValueError as error:
            raise InputError(f"--sd {text}: give NAME=VALUE, for example --sd c=0.005 (SI units)") from error
    uncertainty = Uncertainty(
        model_file, sd=given, relative_cornering_stiffness_sd=relative_cornering_stiffness_sd
    )  # fmt: skip
    asked = parse_speeds(speeds).tolist() if speeds else []
    found = uncertainty.quantities(np.array(asked), max_speed=max_speed, samples=samples, seed=seed)
    rows, records = [], []
    for q in found:
        low, high = q.band()
        cause = max(q.shares, key=lambda name: q.shares[name])
        rows.append(
            [q.name, q.unit, q.value, q.linear_sd, q.sampled_sd, low, high, q.lost, f"{cause} {q.shares[cause]:.0%}"]
        )
        record = {"quantity": q.name, "unit": q.unit, "value": q.value, "linear_sd": q.linear_sd}
        record |= {"monte_carlo_sd": q.sampled_sd, "band_95": [low, high], "samples": samples, "lost": q.lost}
        records.append({k: _plain(v) for k, v in record.items()} | {"linear_variance_shares": dict(q.shares)})
    effects = total_effects(uncertainty, narrow, max_speed=max_speed, seed=seed) if narrow else {}
    if json_file:
        indices = {k: dict(zip(("first", "total", "total_95"), v, strict=True)) for k, v in effects.items()}
        write_json({"quantities": records, "narrow": {"critical_speed": narrow, "indices": indices}}, json_file)
    if json_file != "-":
        headers = ["quantity", "unit", "value", "sd linear", "sd Monte Carlo", "2.5 %", "97.5 %", "lost", "main cause"]
        print_table(rows, headers)
        if effects:
            click.echo(
                f"\nwhat would narrow '{narrow}' most (share of the variance that goes when it is measured exactly)"
            )
            ranked = sorted(effects.items(), key=lambda item: -item[1][0])
            print_table([[name, *values] for name, values in ranked], ["measurement", "first order", "total", "± 95 %"])
        print_warnings(uncertainty.warnings)


def _plain(value: object) -> object:
    if isinstance(value, list):
        return [_plain(one) for one in value]
    return None if isinstance(value, float) and value != value else value
