"""``velotyre tyre simulate``: a synthetic rig campaign with known truth."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from studies.model_space.command_options import COUNT, PATH, SEED
from studies.reporting.command_context import example
from tyre.ground.errors import InputError
from tyre.ground.number_with_unit import typed_numbers

if TYPE_CHECKING:
    from tyre.rig.simulator import CampaignPlan


@click.command(epilog=example("velotyre tyre simulate campaign --seed 1"))
@click.argument("folder", type=PATH)
@click.option("--seed", type=SEED, required=True, help="Seed of the random numbers.")
@click.option("--name", default="Synthetic tyre", show_default=True, help="Name of the tyre.")
@click.option("--loads", default="340,400,490", show_default=True, help="Vertical loads, N.")
@click.option("--pressures", default="3.5,5.5,7.5", show_default=True, help="Inflation pressures, bar.")
@click.option("--surfaces", default="flat", show_default=True, help="Test surfaces: flat, drum or flat,drum.")
@click.option("--rates", default="1,2", show_default=True, help="Slip rates, deg/s.")
@click.option("--sweeps", type=COUNT, default=1, show_default=True, help="Slip sweeps per condition and rate.")
@click.option(
    "--pulls", type=COUNT, default=2, show_default=True, help="Lateral stiffness tests per flat-track condition."
)
@click.option("--steps", type=COUNT, default=0, show_default=True, help="Slip steps per condition.")
@click.option(
    "--axes", default="adapted SAE", show_default=True, help="Axis system of the files: ISO, SAE or adapted SAE."
)
@click.option("--format", "file_format", default="csv", show_default=True, help="File format: csv, tdx or mixed.")
@click.option(
    "--effect",
    "effects",
    multiple=True,
    help="Set a rig effect, NAME:key=value,... (SI); NAME alone adds it; may be repeated.",
)
@click.option("--without", "removed", multiple=True, help="Remove the rig effect NAME; may be repeated.")
def command(folder: Path, seed: int, effects: tuple[str, ...], removed: tuple[str, ...], **options: Any) -> None:
    """Write a SYNTHETIC rig campaign into FOLDER.

    The true values are in truth.json.

    The protocol is the paper's: 9.3 km/h, triangular slip sweeps to +-4 deg at 200 Hz, lateral stiffness tests
    with dial gauges of 0.01 mm.
    """
    import numpy as np

    from studies.reporting.manifest import results
    from tyre.rig.simulator import default_effects, set_effect, write_campaign_files

    plan = _plan(options)
    rng = np.random.default_rng(seed)
    chosen = default_effects(rng)
    for effect in removed:
        chosen = set_effect(chosen, effect, None)
    for text in effects:
        effect, _, assignments = text.partition(":")
        values = {}
        for assignment in filter(None, assignments.split(",")):
            key, _, value = assignment.partition("=")
            values[key] = _numbers(value, f"effect {effect}: {key}")[0]
        chosen = set_effect(chosen, effect, values)
    with results(folder):
        files = write_campaign_files(folder, plan=plan, effects=chosen, rng=rng, seed=seed)
    click.echo(f"{len(files)} synthetic recordings and truth.json in {folder}")


UNITS = {"rates": "deg/s", "loads": "N", "pressures": "bar"}


def _numbers(text: str, quantity: str, unit: str = "") -> tuple[float, ...]:
    """Read numbers separated by commas, each perhaps with a unit, in ``unit``."""
    numbers = typed_numbers(text.split(","), unit)
    if not numbers:
        raise InputError(f"{quantity} = {text!r} must be numbers separated by commas, such as 340,400,490")
    return tuple(numbers)


def _plan(options: Mapping[str, Any]) -> "CampaignPlan":
    """Make the campaign that the options describe, in SI units."""
    import numpy as np

    from tyre.ground.units import PASCAL_PER_BAR
    from tyre.recordings.recording import signs
    from tyre.rig.simulator import CampaignPlan

    signs(options["axes"], where="--axes")
    counts = {kind: options[kind] for kind in ("sweeps", "pulls", "steps")}
    if min(counts.values()) < 0 or sum(counts.values()) == 0:
        counts_text = ", ".join(f"{kind} {count}" for kind, count in counts.items())
        raise InputError(f"{counts_text}: none may be negative and one must be positive")
    numbers = {quantity: _numbers(options[quantity], quantity, unit) for quantity, unit in UNITS.items()}
    for quantity in ("loads", "pressures", "rates"):
        if not all(0.0 < number < np.inf for number in numbers[quantity]):
            values_text = ", ".join(f"{number:g}" for number in numbers[quantity])
            raise InputError(f"{quantity} must be positive and finite, got {values_text}")
    surfaces = tuple(options["surfaces"].split(","))
    for quantity, values in (numbers | {"surfaces": surfaces}).items():
        if len(set(values)) < len(values):
            raise InputError(
                f"{quantity} = {options[quantity]} names one twice, whose files would take each other's place"
            )
    return CampaignPlan(
        tyre=options["name"],
        loads=numbers["loads"],
        pressures=tuple(PASCAL_PER_BAR * p for p in numbers["pressures"]),
        surfaces=surfaces,
        rates=tuple(float(np.deg2rad(r)) for r in numbers["rates"]),
        axes=options["axes"],
        file_format=options["file_format"],
        **counts,
    )
