"""Small sweeps that several tests run."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

MODEL = {
    "bicycle": "benchmark",
    "effects": {"relaxation_length": {"cornering_stiffness": 6000.0, "relaxation_length": 0.1}},
}
MEASURED = {"bicycle": "benchmark", "effects": {"relaxation_length": {"tyre": "Tyre1", "pressure_bar": 4.0}}}
RANDOM = {
    "model": MODEL, "samples": 700, "seed": 5, "outputs": ["eigenvalues", "max_growth_rate", "parameters"],
    "points_per_part": 2048, "grid": {"c": [0.06, 0.08], "speed_m_s": [3.0, 8.0, 15.0]},
    "sampled": {"mB": {"sd": 2.0}, "relaxation_length.relaxation_length": {"low": 0.05, "high": 0.15}},
}  # fmt: skip
"""1400 bicycles at three speeds."""

GRID = {"speed_m_s": [1.0, 2.0]}


def write_file(folder: Path, content: Mapping[str, Any]) -> Path:
    """The sweep as a file in ``folder``."""
    import tomli_w

    file = folder / "sweep.toml"
    file.write_text(tomli_w.dumps(content), encoding="utf-8")
    return file
