"""A recording of the protocol of tyre consortia, made here: loads, pressures and cambers in one run, in three formats.

Lateral force F = D sin(1.35 atan(B a)) + Cg g with B D 1.35 = C(load, pressure), lagging over 0.15 m of way; moment
Mz = -t a-part / (1 + (a / 6 deg)^2) - t Cg g + T g (adapted SAE). Sensors are noisy, and between two sweeps the rig
rests while load, pressure or camber are set.
"""

from itertools import product
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

LOADS, PRESSURES, CAMBERS = (320.0, 410.0, 505.0), (4.0, 6.0), (-2.0, 0.0, 4.0)  # N, bar, deg
TRAIL, RATE, SPEED, LENGTH = 0.019, 50.0, 5.0, 0.15  # m, Hz, m/s, m
TWIST = 0.9  # N m/rad at 400 N, proportional to the load


def stiffness(load: float, pressure: float) -> float:
    """C, N/rad."""
    return 14.0 * load * (1.0 - load / 1800.0) * (pressure / 5.0) ** 0.3


def camber_stiffness(load: float) -> float:
    """Cg, N/rad."""
    return 1.1 * load


def consortium_run(seed: int = 1) -> dict[str, np.ndarray]:
    """Channels in the units and the SAE axes of the files: t s, SA, IA deg, FY, FZ N, MZ N m, P kPa, V km/h."""
    rng = np.random.default_rng(seed)
    rows = []
    for pressure, camber, load in product(PRESSURES, CAMBERS, LOADS):
        ramp = np.interp(np.arange(400), [0, 100, 300, 400], [0, 4, -4, 0.0])
        alpha = np.concatenate([np.zeros(60), np.deg2rad(ramp), np.zeros(60)])
        rows.append(np.column_stack([alpha, *(np.full(alpha.size, x) for x in (pressure, camber, load))]))
    alpha, pressure, camber, load = np.concatenate(rows).T
    # the settings are reached over a second
    pressure, camber, load = (lfilter([0.1], [1, -0.9], x - x[0]) + x[0] for x in (pressure, camber, load))
    decay = np.exp(-SPEED / RATE / LENGTH)
    lagged = lfilter([1 - decay], [1, -decay], alpha)
    slope, peak = stiffness(load, pressure), 1.05 * load
    by_slip = peak * np.sin(1.35 * np.arctan(slope / (1.35 * peak) * lagged))
    by_camber = camber_stiffness(load) * np.deg2rad(camber)
    moment = -TRAIL * by_slip / (1 + (np.rad2deg(lagged) / 6.0) ** 2)
    moment += -TRAIL * by_camber + TWIST * load / 400.0 * np.deg2rad(camber)

    def noise(size: float) -> np.ndarray:
        return size * rng.standard_normal(alpha.size)

    return {
        "ET": np.arange(alpha.size) / RATE, "V": 3.6 * SPEED + noise(0.03), "SA": -np.rad2deg(alpha) + noise(0.004),
        "IA": camber + noise(0.01), "P": 100 * pressure + noise(0.5), "FY": by_slip + by_camber + noise(1.5),
        "FZ": -load + noise(2.0), "MZ": moment + noise(0.03), "AMBTMP": 24 + noise(0.02),
    }  # fmt: skip


UNITS = {
    "ET": "sec",
    "V": "kph",
    "SA": "deg",
    "IA": "deg",
    "P": "kPa",
    "FY": "N",
    "FZ": "N",
    "MZ": "N-m",
    "AMBTMP": "degC",
}


def write_dat(run: dict[str, np.ndarray], path: Path) -> Path:
    """Write the text form: a title, names, units, columns separated by tabs."""
    head = "Tyre_Name=Example;Test type=Cornering\n" + "\t".join(run) + "\n" + "\t".join(UNITS.values()) + "\n"
    np.savetxt(path, np.column_stack(list(run.values())), fmt="%.5f", delimiter="\t", header=head[:-1], comments="")
    return path


def write_mat(run: dict[str, np.ndarray], path: Path) -> Path:
    """Write the MATLAB form: a column a variable, and names and units in the structure ``channel``."""
    import scipy.io

    names, units = (np.array(list(x), dtype=object) for x in (UNITS, UNITS.values()))
    content = {name: x[:, None] for name, x in run.items()}
    scipy.io.savemat(path, content | {"channel": {"name": names, "units": units}, "tireid": "Example"})
    return path


TYDEX = {
    "ET": ("RUNTIME", "s", 1), "SA": ("SLIPANGL", "deg", -1), "IA": ("INCLANGL", "deg", 1),
    "P": ("INFLPRES", "kPa", 1), "FY": ("FYW", "N", -1), "FZ": ("FZW", "N", -1), "MZ": ("MZW", "Nm", -1),
    "V": ("TRAJVELW", "km/h", 1),
}  # fmt: skip


def write_tdx(run: dict[str, np.ndarray], path: Path) -> Path:
    """Write TYDEX, in its ISO axes."""
    lines = ["**HEADER", f"{'RELEASE':<40}{'':<10}1.3", "**CONSTANTS", f"{'IDENTITY':<40}{'':<10}Example",
             f"{'TRCKSURF':<40}{'':<10}flat", "**MEASURCHANNELS"]  # fmt: skip
    lines += [f"{name:<10}{'':<30}{unit:<10}1         0         0" for name, unit, _ in TYDEX.values()]
    table = np.column_stack([sign * run[key] for key, (_, _, sign) in TYDEX.items()])
    lines += ["**MEASURDATA", *(" ".join(f"{x:.5f}" for x in row) for row in table.tolist()), "**END", ""]
    path.write_text("\n".join(lines))
    return path
