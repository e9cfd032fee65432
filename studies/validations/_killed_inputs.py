"""Long commands, and the inputs that they are killed over."""

from pathlib import Path

COMMANDS: dict[str, tuple[str, ...]] = {
    "simulate": ("simulate", "benchmark", "--speed", "5", "--initial", "lean=0.02", "--out", "{out}"),
    "root-locus": (
        "root-locus", "benchmark", "--parameter", "c", "--range", "0.06:0.1", "--speed", "5", "--out", "{out}",
    ),
    "chart": ("chart", "benchmark", "--x", "speed=3:7", "--y", "c=0.06:0.1", "--out", "{out}"),
    "sensitivity": ("sensitivity", "benchmark", "--mode", "weave", "--speed", "5", "--out", "{out}"),
    "sweep": ("sweep", "{data}/sweep.toml", "--workers", "1", "--out", "{out}.zarr"),
    "sweep to netCDF": ("sweep", "{data}/sweep.toml", "--processes", "2", "--out", "{out}.nc"),
    "tyre fit": ("tyre", "fit", "{data}/campaign", "--jobs", "1", "--out", "{out}"),
    "tyre fit in processes": ("tyre", "fit", "{data}/campaign", "--jobs", "2", "--out", "{out}"),
    "diagnose": ("diagnose", "{data}/measured/MEASUREMENT.toml", "--no-stability", "--out", "{out}"),
    "look": ("look", "{data}/ride.csv", "--out", "{out}"),
    "blind-test": (
        "blind-test", "--cases", "1", "--seed", "3", "--cell", "modal-one", "--workers", "1", "--out", "{out}.jsonl",
    ),
    "run": ("run", "--bicycle", "benchmark", "--pressures", "5.5", "--workers", "1", "--out", "{out}"),
}  # fmt: skip
"""Arguments by name; ``{out}`` is where results go, ``{data}`` the folder of :func:`prepare`."""

SWEEP = """
outputs = ["largest_growth_rate", "damping_ratios", "critical_speeds"]
samples = 60
seed = 5
points_per_part = 120
[model]
bicycle = "benchmark"
[model.effects.relaxation_length]
cornering_stiffness = 6000.0
relaxation_length = 0.1
[grid]
speed_m_s = {from = 2, to = 12, count = 6}
[sampled]
mB = {sd = 2.0}
"""


def prepare(folder: Path) -> None:
    """Write what the commands read into ``folder``: a sweep file, two conditions of a rig, a measurement, a ride."""
    import numpy as np

    from studies.cli import main
    from studies.validations._input_examples import documented

    (folder / "sweep.toml").write_text(SWEEP, encoding="utf-8")
    main(["tyre", "simulate", str(folder / "every"), "--seed", "1"])
    (folder / "campaign").mkdir()
    for file in sorted((folder / "every").glob("flat_*_340N_*")):
        if "_sweep_2deg_s" in file.name or "_pull_" in file.name:
            file.rename(folder / "campaign" / file.name)
    (folder / "measured").mkdir()
    for name, content in documented()["measurement_files/modal"].items():
        (folder / "measured" / name).write_bytes(content)
    time = np.arange(0, 6, 0.01)
    roll = 20 * np.exp(-0.8 * time) * np.cos(6 * time) + np.random.default_rng(1).normal(0, 0.2, time.size)
    rows = "\n".join(f"{t:.2f},{x:.3f}" for t, x in zip(time, roll, strict=True))
    (folder / "ride.csv").write_text(f"Time [s],IMU frame gyro x [deg/s]\n{rows}\n", encoding="utf-8")
