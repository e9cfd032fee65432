"""Where wobble of the benchmark bicycle sets in, from tests/published/wobble_onsets.json, as tests take it."""

import json
import math
from pathlib import Path

DATA = json.loads((Path(__file__).parents[1] / "published" / "wobble_onsets.json").read_text(encoding="utf-8"))


def _stiffness(front: str) -> dict[str, float]:
    per_degree = DATA[front]["cornering_stiffness_rear_front_N_deg"]
    return dict(zip(("rear", "front"), (math.degrees(1) * value for value in per_degree), strict=True))


def _rows(front: str, *onsets: str) -> tuple[tuple[float, ...], ...]:
    names = ("relaxation_length_m", *(f"{onset}_above_m_s" for onset in onsets))
    return tuple(zip(*(DATA[front][name] for name in names), strict=True))


RIGID_STIFFNESS, FLEXIBLE_STIFFNESS = _stiffness("rigid_front"), _stiffness("flexible_front")
"""N/rad."""

RIGID = _rows("rigid_front", "wobble_unstable")
"""Relaxation length (m) and onset of wobble (m/s)."""

FLEXIBLE = _rows("flexible_front", "wobble_unstable", "wobble_stable", "weave_unstable")
"""Relaxation length (m), onset and end of wobble, onset of weave (m/s)."""

_HINGE = DATA["flexible_front"]["hinge"]
COMPLIANCE = {
    "joint_x": _HINGE["x_m"], "joint_z": _HINGE["z_m"], "stiffness": _HINGE["stiffness_N_m_rad"],
    "damping": _HINGE["damping_N_m_s_rad"],
}  # fmt: skip
"""Parameters of the effect ``front_compliance``: m, N m/rad, N m s/rad."""
