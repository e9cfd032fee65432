"""Rest periods of a real riderless bicycle whose controller steers: does the closed loop weave as after kicks?

Between its kicks the steer-by-wire bicycle of ``data/measured/steer_by_wire.toml`` is moved by nothing that anybody
recorded. Its controller makes the steer torque of the roll rate. Spectra of these periods at eight speeds give weave of
bicycle and controller; kicks at about 2, 3, 4 and 5 m/s gave it directly. Both have uncertainties: that of the fit,
and the scatter of single kicks about the median of their speed. The recordings are not part of the project: they are
found through VELOTYRE_EXTRA_DATA.
"""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from studies.diagnosis import read_measurement
from studies.inference import fit
from studies.rides import LoopMode, loop_modes

MEASURED = Path(__file__).parents[2] / "data" / "measured"
SPEEDS = ("1.48", "2.03", "2.49", "3.05", "3.58", "4.15", "4.71", "5.16")  # m/s, in the names of the files
HIGHEST_HZ = 3.5  # above it the bicycle moves less than its sensors' noise, which is not white
WEAVE = (1.5, 15.0)  # rad/s
SCALE = ("steer_scale",)  # the authors doubt the scale of the fork's encoder
TARGETS = {"within_two_sd": 6}  # of the speeds


def run(*, out: Path, seed: int = 0, speeds: Sequence[str] = SPEEDS) -> dict[str, Any]:
    """Compare weave from rest periods with weave from kicks; the recordings are real, so ``seed`` has no effect."""
    folder = Path(os.environ["VELOTYRE_EXTRA_DATA"]) / "steer_by_wire_rest"
    file = out / "rest.toml"
    file.write_text(measurement(folder, speeds), encoding="utf-8")
    kind = read_measurement(file).prepare()
    found: dict[str, Any] = {}
    for names in ((), SCALE):
        final = fit(kind, tuple(c for c in kind.candidates if c.identifier in names))
        modes = [min(m, key=damping_in_weave) for m in loop_modes(kind, final)]
        rows = [compare(mode) for mode in modes]
        found["+".join(names) or "base"] = {
            "chi2_per_number": round(final.chi2 / len(final.residual), 2),
            "log_evidence": round(final.log_evidence, 1),
            "sizes": {
                c.identifier: [round(float(u.value(x)), 3) for u, x in final.values(c)] for c in final.candidates
            },
            "weave": rows,
            "within_two_sd": sum(bool(row["within_two_sd"]) for row in rows),
            "compared": sum(row["kick_real"] is not None for row in rows),
        }
    return {"synthetic": False, "targets": TARGETS, **found}


def measurement(folder: Path, speeds: Sequence[str]) -> str:
    """A measurement file of the rest periods, with the bicycle of the kicks and without its controller."""
    kicks = (MEASURED / "steer_by_wire.toml").read_text(encoding="utf-8")
    bicycle = kicks[kicks.index("[bicycle]") : kicks.index("[effects.steer_assist]")]
    rides = "\n".join(f'    {{ file = "rest_{speed}.csv" }},' for speed in speeds)
    settings = f'folder = "{folder}"\nsteering = "controller"\nlowest_Hz = 0.3\nhighest_Hz = {HIGHEST_HZ}'
    return f'kind = "ride_spectra"\n{bicycle}\n[ride_spectra]\n{settings}\nrides = [\n{rides}\n]\n'


def damping_in_weave(mode: LoopMode) -> float:
    """Decay (1/s) of a mode whose frequency is that of weave; infinite for others."""
    return -mode.real if WEAVE[0] < mode.imaginary < WEAVE[1] else np.inf


def compare(mode: LoopMode) -> dict[str, Any]:
    """A row: weave of the rest periods, of the kicks at that speed, and whether they agree within two sd."""
    kicks = pd.read_csv(MEASURED / "steer_by_wire_weave.csv")
    groups = kicks.groupby("group")
    speeds = groups["speed_m_s"].median().to_numpy()
    row: dict[str, Any] = {"speed": round(mode.speed, 2), "kick_real": None, "within_two_sd": None}
    row |= {key: round(float(getattr(mode, key)), 2) for key in ("real", "real_sd", "imaginary", "imaginary_sd")}
    if not speeds[0] - 0.1 < mode.speed < speeds[-1] + 0.1:
        return row  # nobody kicked it there
    agrees = True
    for column, name in (("real_1_s", "real"), ("imag_rad_s", "imaginary")):
        kicked = float(np.interp(mode.speed, speeds, groups[column].median().to_numpy()))
        scatter = float(np.sqrt(groups[column].var().mean()))
        row |= {f"kick_{name}": round(kicked, 2), f"kick_{name}_sd": round(scatter, 2)}
        together = np.hypot(getattr(mode, f"{name}_sd"), scatter)
        agrees &= bool(abs(getattr(mode, name) - kicked) < 2 * together)
    return row | {"within_two_sd": agrees}
