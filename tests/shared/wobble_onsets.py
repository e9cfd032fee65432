"""Where wobble of the benchmark bicycle sets in, from tests/published/wobble_onsets.json, as tests take it."""

import json
import math
from pathlib import Path

DATA = json.loads((Path(__file__).parents[1] / "published" / "wobble_onsets.json").read_text(encoding="utf-8"))


def _stiffness(of: str) -> dict[str, float]:
    per_degree = DATA[of]["cornering_stiffness_rear_front_N_deg"]
    return dict(zip(("rear", "front"), (math.degrees(1) * value for value in per_degree), strict=True))


RIGID_STIFFNESS, FLEXIBLE_STIFFNESS = _stiffness("rigid_front"), _stiffness("flexible_front")
"""N/rad."""

RIGID = tuple(
    zip(DATA["rigid_front"]["relaxation_length_m"], DATA["rigid_front"]["wobble_unstable_above_m_s"], strict=True)
)
"""Relaxation length (m) and onset of wobble (m/s)."""

FLEXIBLE = tuple(
    zip(
        DATA["flexible_front"]["relaxation_length_m"],
        *(
            DATA["flexible_front"][f"{edge}_above_m_s"]
            for edge in ("wobble_unstable", "wobble_stable", "weave_unstable")
        ),
        strict=True,
    )
)
"""Relaxation length (m), onset and end of wobble, onset of weave (m/s)."""

HINGE = {key: DATA["flexible_front"]["hinge"][f"{key}_m"] for key in ("x", "z")} | {
    "stiffness": DATA["flexible_front"]["hinge"]["stiffness_N_m_rad"],
    "damping": DATA["flexible_front"]["hinge"]["damping_N_m_s_rad"],
}
"""Place (m), stiffness (N m/rad) and damping (N m s/rad)."""

COMPLIANCE = {
    "joint_x": HINGE["x"], "joint_z": HINGE["z"], "stiffness": HINGE["stiffness"], "damping": HINGE["damping"],
}  # fmt: skip
"""The same as parameters of the effect ``front_compliance``."""
