"""Synthetic joint measurements for the blind test: one bicycle, two or three parts, a mistake planted in one of them.

Like :mod:`tests.validation.blind.generator`, this shares nothing with the fitter. All synthetic. Each part is
also written as a measurement file of its own, with the same tables, so that what it says alone can be compared.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from tests.validation.blind.closing import Machine
from tests.validation.blind.generator import FEWEST, MODES, TRIES, table_row, write_table
from tests.validation.blind.hidden import HIDDEN, Cause, Truth, base_effects, hide, perturbed, pick, uncertainty
from tests.validation.blind.histories import CHANNELS, SAMPLE, kicks, measure, write_runs
from tests.validation.blind.motion import Sensor, shapes
from tyre.ground import InputError, write_text

POINTS, RUNS, DURATION = 10, 4, 3.0
NOISE = 1.0
SCALE = (0.08, 0.2)  # of a sensor that reads too much or too little
OFFSET = (0.15, 0.4)  # m/s of a wrong speed
PLANTED = ("", "scale", "speed")


@dataclass(frozen=True)
class JointTruth:
    """What a joint case hides."""

    truth: Truth
    planted: str = ""
    mistake: Mapping[str, float] = field(default_factory=dict)
    parts: tuple[str, ...] = ()


def joint_case(
    folder: Path, *, hidden: tuple[str, ...], rng: np.random.Generator, planted: str = "", third: bool = False
) -> JointTruth:
    """Write MEASUREMENT.toml, a file for each part alone and all tables; return what is hidden."""
    first = HIDDEN[hidden[0]] if hidden else HIDDEN[str(rng.choice(["steer_damper", "twisting_torque"]))]
    nominal = pick(first.bicycles, rng)
    sd = uncertainty(nominal)
    offset, scale = draw_mistake(planted, rng)
    low, high = first.speeds
    for _ in range(TRIES):
        real = perturbed(nominal, sd, rng)
        effects = base_effects(first.base, nominal.static_loads, rng)
        drawn, machine = hide(hidden, nominal, real, effects, rng)
        rows = _modes(machine, np.sort(rng.uniform(low, high, POINTS).round(3)), offset, rng)
        if len(rows) >= FEWEST:
            break
    else:
        raise InputError(f"{nominal.name!r} with {', '.join(hidden)} hardly oscillates")
    head = {"description": "synthetic", "bicycle": nominal.name, "effects": effects, "uncertainty": sd}
    folder.mkdir(parents=True, exist_ok=True)
    write_table(folder / "modes.csv", rows)
    parts: dict[str, dict[str, Any]] = {"modes": {"kind": "modal", "modal": {"table": "modes.csv"}}}
    span = (max(low, 4.5), high)
    sensors = {"steer_rad": Sensor(gain=1 + scale)} if scale else {}
    parts["kicks"] = _rides(folder, "kick", machine, span, rng, forced=True, cause=Cause(sensors=sensors))
    if third:
        parts["pushes"] = _rides(folder, "push", machine, span, rng, forced=False, cause=Cause())
    _write(folder, head, parts)
    mistake = {"speed_offset": offset} if offset else {"steer_scale": scale} if scale else {}
    wrong = {"speed": "modes", "scale": "kicks"}.get(planted, "")
    return JointTruth(Truth(drawn, noise=NOISE), wrong, mistake, tuple(parts))


def draw_mistake(planted: str, rng: np.random.Generator) -> tuple[float, float]:
    """Offset of the speed, 0.15 to 0.4 m/s, or what the steer sensor reads too much, 8 to 20 %; both of either sign."""
    offset = float(rng.choice([-1, 1]) * rng.uniform(*OFFSET)) if planted == "speed" else 0.0
    scale = float(rng.choice([-1, 1]) * rng.uniform(*SCALE)) if planted == "scale" else 0.0
    return offset, scale


def _modes(machine: Machine, speeds: Any, offset: float, rng: np.random.Generator) -> list[dict[str, Any]]:
    found = [shapes(machine, float(speed) + offset) for speed in speeds]
    seen = [(v, one[mode]) for mode in MODES for v, one in zip(speeds, found, strict=True) if mode in one]
    return [table_row(float(speed), shape, NOISE, rng, ratios=True) for speed, shape in seen]


def _rides(
    folder: Path, name: str, machine: Machine, span: tuple[float, float], rng: np.random.Generator, *, forced: bool,
    cause: Cause,
) -> dict[str, Any]:  # fmt: skip
    """Kicks as a part: its kind and table, the runs written."""
    time = np.arange(round(DURATION / SAMPLE) + 1, dtype=float) * SAMPLE
    made = kicks(machine, np.linspace(*span, RUNS).round(2), time, rng, fastest=2 * span[1], forced=forced, cause=cause)
    levels = {channel: NOISE * level for channel, (_, level) in CHANNELS.items()}
    if not forced:
        levels.pop("yaw_rate_rad_s")
    colour = float(rng.uniform(0.2, 0.7))
    for run in made:
        measure(run, levels, colour, cause.sensors, rng)
    return {"kind": "histories", "histories": {"noise_sd": levels, "runs": write_runs(folder, made, name)}}


def _write(folder: Path, head: Mapping[str, Any], parts: Mapping[str, Mapping[str, Any]]) -> None:
    import tomli_w

    whole = {"kind": "joint", **head, "part": [{"name": name, **content} for name, content in parts.items()]}
    write_text(folder / "MEASUREMENT.toml", tomli_w.dumps(whole))
    for name, content in parts.items():
        write_text(folder / f"{name}.toml", tomli_w.dumps({**head, **content}))
