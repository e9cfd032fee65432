"""Valid recordings and results, as programs write them, to be damaged."""

import tempfile
import warnings
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np

from studies.validations._input_examples import Example, documented, gaps, one
from studies.validations._recording_writers import WRITERS, name_in_file

SEED = 20


_SAMPLES = 60


@cache
def results() -> tuple[Example, ...]:
    """The result of a small sweep, a zarr folder and a netCDF file."""
    from studies.sweeps.run import run_sweep
    from studies.sweeps.sweep_file import build_sweep

    sweep = {"model": {"bicycle": "benchmark"}, "outputs": ["largest_growth_rate", "critical_speeds"],
             "grid": {"c": [0.06, 0.08], "speed_m_s": [3.0, 8.0]}}  # fmt: skip
    found = []
    with tempfile.TemporaryDirectory() as folder:
        for name in ("result.zarr", "result.nc"):
            out = run_sweep(build_sweep(sweep), Path(folder) / name)
            files = [out] if out.is_file() else sorted(file for file in out.rglob("*") if file.is_file())
            content = {file.relative_to(folder).as_posix(): file.read_bytes() for file in files}
            found.append(Example(name, content, name, tuple(content)))
    return tuple(found)


def rig_recordings() -> list[Example]:
    """Recordings of a rig with sidecars: a documented pull, a short slip sweep, one with a channel map."""
    pull = {name: text for name, text in documented()["measurement_files/rig"].items() if name.startswith("pull")}
    time = np.arange(0, 24, 0.05)
    slip = 6 * np.sin(2 * np.pi * time / 12)
    force = -450 * np.tanh(slip / 4) + np.random.default_rng(SEED).normal(0, 1, time.size)
    rows = "\n".join(f"{t:.2f},{a:.4f},{f:.2f},{400.0}" for t, a, f in zip(time, slip, force, strict=True))
    words = (
        'kind = "slip_sweep"\ntyre = "T"\nload_N = 400.0\npressure_bar = 5.0\nsurface = "flat"\naxes = "adapted SAE"\n'
    )
    sweep = {"sweep.csv": f"time_s,slip_angle_deg,side_force_N,vertical_load_N\n{rows}\n".encode(),
             "sweep.toml": words.encode()}  # fmt: skip
    channels = (
        '[channels]\ntime = {column = "t", unit = "s"}\nslip_angle = {column = "alpha", unit = "deg"}\n'
        'side_force = {column = "Fy", unit = "N", sign = 1}\nvertical_load = {column = "Fz", unit = "N"}\n'
        "[reading]\n"
    )
    mapped = {"map.csv": f"t,alpha,Fy,Fz\n{rows}\n".encode(), "map.toml": (words + channels).encode()}
    gappy = pull | {"pull.csv": gaps(pull["pull.csv"])}
    lacking = (
        sweep["sweep.csv"]
        .replace(b"\n0.50,", b"\n,")
        .replace(b",400.0\n3.", b",\n3.")
        .replace(b"\n5.00,", b"\n5.00,NaN,,400.0\n5.01,")
    )
    return [
        Example("rig pull", pull, "pull.csv", tuple(pull)),
        Example("rig pull with missing samples", gappy, "pull.csv", ("pull.toml",)),
        Example("rig sweep with missing samples", sweep | {"sweep.csv": lacking}, "sweep.csv", ("sweep.toml",)),
        Example("rig sweep", sweep, "sweep.csv", ("sweep.toml", "sweep.toml", "sweep.csv")),
        Example("rig with a map", mapped, "map.csv", ("map.toml", "map.toml", "map.csv")),
    ]  # fmt: skip


@cache
def written_recordings() -> tuple[Example, ...]:
    """A recording in every format, in disorder too; some formats hold the time of writing."""
    rng = np.random.default_rng(SEED)
    truth = {"t": np.arange(_SAMPLES) / 100, "slip": rng.normal(0, 2, _SAMPLES), "force": rng.normal(0, 300, _SAMPLES)}
    units = {"t": "s", "slip": "deg", "force": "N"}
    found = []
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the writers
        for form, (suffix, write) in WRITERS.items():
            for number, changed in enumerate(_disordered(truth)):
                path = Path(folder) / f"{form}{number}{suffix}"
                try:
                    write(path, {name: (x, units[name]) for name, x in changed.items()})
                except (ValueError, TypeError, IndexError, OverflowError):  # a writer that asks for rising times
                    continue
                found.append(one(f"{form} {number}", path.read_bytes(), f"case_{form}{suffix}"))
    return tuple(found)


def _disordered(truth: dict[str, np.ndarray]) -> Iterator[dict[str, np.ndarray]]:
    yield truth
    for name in truth:
        for value in (np.nan, np.inf, 1e308, -1e300, 5e-324):
            changed = {key: x.copy() for key, x in truth.items()}
            changed[name][20 : 20 + (30 if value != value else 1)] = value
            yield changed
    yield {name: np.zeros_like(x) for name, x in truth.items()}
    yield {name: x[::-1].copy() for name, x in truth.items()}
    yield {name: x[:1].copy() for name, x in truth.items()}
    yield {name: x for name, x in truth.items() if name != "force"}


def mapped_names(name: str) -> dict[str, str]:
    """What time, slip and force are called in the file of an example ``name``."""
    form = name.split()[0]
    return {key: name_in_file(form, key) for key in ("t", "slip", "force")}
