"""Options of commands that take published figures of a front frame."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from studies.model_space.command_options import MASS, Number

if TYPE_CHECKING:
    from studies.front_frame.published import PublishedFigures

FIGURES = {
    "head_tube": "head_tube_N_m_per_deg",
    "fork": "fork_N_per_mm",
    "ground_mm": "ground_deflection_mm",
    "ground_kg": "weight_kg",
}
"""Parameter of a command -> the figure that it holds."""

OPTIONS = (
    click.option(
        "--head-tube",
        type=Number(0, 1e6, above=True, unit="N m/deg"),
        metavar="N_M_PER_DEG",
        help="Stiffness of the head tube, N m/deg, rear dropouts clamped, head tube supported (TOUR).",
    ),
    click.option(
        "--fork",
        type=Number(0, 1e9, above=True, unit="N/mm"),
        metavar="N_PER_MM",
        help="Lateral stiffness of the fork, N/mm, at the dropouts; without it the interval is wider.",
    ),
    click.option(
        "--ground-mm",
        type=Number(0, 1e6, above=True, unit="mm"),
        metavar="MM",
        help="Deflection of frame and fork where the wheel meets the ground, mm (RoadBIKE).",
    ),
    click.option(
        "--ground-kg", type=MASS, metavar="KG", help="Mass whose weight was hung there, kg; with --ground-mm."
    ),
)


def takes_published_figures(command: Any) -> Any:
    """Add the options of :data:`FIGURES` to a command."""
    for option in reversed(OPTIONS):
        command = option(command)
    return command


def stated_figures(values: Mapping[str, float | None]) -> "PublishedFigures | None":
    """Make figures of the ``values`` of these options (as published, by parameter); None where none is stated."""
    from studies.front_frame.published import PublishedFigures

    figures = {name: values[option] for option, name in FIGURES.items()}
    if all(value is None for value in figures.values()):
        return None
    return PublishedFigures(**figures)
