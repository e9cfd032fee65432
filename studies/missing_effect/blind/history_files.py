"""Files of synthetic time histories: one CSV a run, and the measurement file that lists them."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tyre.base.arrays import Array
from tyre.base.files import write_text


@dataclass
class Run:
    """True motion of a run and the torque that was recorded with it."""

    speed: float
    time: Array
    channels: dict[str, Array]
    torque: Array | None
    seen: dict[str, Array] = field(default_factory=dict)


def write_histories(folder: Path, content: dict[str, Any], made: list[Run]) -> None:
    """Write the measurement file and one CSV a run.

    Parameters
    ----------
    folder : Path
    content : dict
        Of the file; its runs are added.
    made : list of Run
    """
    import tomli_w

    content["histories"]["runs"] = write_runs(folder, made)
    write_text(folder / "MEASUREMENT.toml", tomli_w.dumps(content))


def write_runs(folder: Path, made: list[Run], name: str = "run") -> list[dict[str, Any]]:
    """Write one CSV a run of those ``made`` into a ``folder``, its ``name`` and a number; their entries in a file."""
    folder.mkdir(parents=True, exist_ok=True)
    entries = []
    for k, run in enumerate(made):
        table = {"time_s": run.time, **run.seen}
        if run.torque is not None:
            table["steer_torque_N_m"] = run.torque
        lines = [",".join(table)] + [",".join(f"{x:.6g}" for x in row) for row in zip(*table.values(), strict=True)]
        write_text(folder / f"{name}{k:02d}.csv", "\n".join(lines) + "\n")
        entries.append({"file": f"{name}{k:02d}.csv", "speed_m_s": run.speed})
    return entries
