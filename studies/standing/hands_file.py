"""``velotyre front-frame FILE`` of kind hands: arms of a rider from ring-downs of the steering.

kind = "hands"
bicycle = "mine.toml"
[hands]
table = "hands.csv"     # grip, spring_N_m_per_rad, frequency_Hz, frequency_sd_Hz, damping_ratio, damping_ratio_sd
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bicycle.model.model import Model
from bicycle.model.model_file import build_model
from bicycle.standing import HANDS, HANDS_TABLE, Hands, measure_hands, read_ring_downs, select_grip
from studies.reporting.markdown_text import render_file
from studies.standing.front_report import FILTERS
from tyre.ground.schema import anything, maybe, needed, read, table, text

NAMES = ("inertia", "stiffness", "damping")
FILE = table(
    {
        needed("kind"): text(allowed=(HANDS,)),
        maybe("description", ""): text(),
        needed("bicycle"): anything,
        needed(HANDS, f"the table [{HANDS}] is missing"): HANDS_TABLE,
    }
)


@dataclass(frozen=True)
class ShownHands:
    """Hands of one grip in words."""

    grip: str
    inertia: str
    stiffness: str
    damping: str
    goodness: float | None  # None if there is nothing to be checked
    table: str  # TOML


def hands_of_file(content: Mapping[str, Any], folder: Path) -> tuple[Hands, ...]:
    """Find the hands of each grip from the ``content`` of a file whose paths are relative to ``folder``."""
    checked = read(FILE, content)
    model: Model = build_model({"bicycle": checked["bicycle"]}, folder=folder)
    ring_downs = read_ring_downs(folder / checked[HANDS]["table"])
    if "grip" in checked[HANDS]:
        ring_downs = select_grip(ring_downs, checked[HANDS]["grip"])
    return measure_hands(ring_downs, model)


def hands_text(hands: tuple[Hands, ...]) -> str:
    """What a terminal shows, with the tables of a model file."""
    content = {"grips": [_shown(one) for one in hands]}
    return render_file("studies.standing", "hands.txt.j2", content, escaped=False, filters=FILTERS).strip()


def hands_record(hands: tuple[Hands, ...]) -> dict[str, Any]:
    """The result as JSON, SI."""
    return {
        "grips": {
            one.grip: {
                "rider_arms": dict(zip(NAMES, one.values.tolist(), strict=True)),
                "sd": dict(zip(NAMES, one.sd.tolist(), strict=True)),
                "covariance": one.covariance.tolist(),
            }
            for one in hands
        }
    }


def _shown(hands: Hands) -> ShownHands:
    import tomli_w

    numbers = {name: round(float(value), 6) for name, value in zip(NAMES, hands.values, strict=True)}
    matrix = ((hands.covariance + hands.covariance.T) / 2).tolist()
    tables = {
        "effects": {"rider_arms": numbers},
        "covariance": {"parameters": [f"rider_arms.{name}" for name in NAMES], "matrix": matrix},
    }
    inertia, stiffness, damping = (
        f"{FILTERS['shown'](float(value), float(sd))} ± {FILTERS['two'](float(sd))}"
        for value, sd in zip(hands.values, hands.sd, strict=True)
    )
    goodness = None if math.isnan(hands.goodness) else hands.goodness
    return ShownHands(hands.grip, inertia, stiffness, damping, goodness, tomli_w.dumps(tables))
