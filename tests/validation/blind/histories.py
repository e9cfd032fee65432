"""Synthetic time histories for the blind test: kicks, torque doublets, coloured noise, linear or saturating tyres.

Like :mod:`tests.validation.blind.generator`, this shares nothing with the fitter. All synthetic.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bicycle import load_bicycle
from tests.validation.blind.closing import Machine, Space
from tests.validation.blind.generator import HELD_OUT
from tests.validation.blind.hidden import (
    AS_STATED,
    HIDDEN,
    Cause,
    Hidden,
    Truth,
    base_effects,
    hide,
    perturbed,
    pick,
    uncertainty,
)
from tests.validation.blind.motion import Nonlinear, Sensor, simulate, simulate_nonlinear, weave_speed
from tyre.ground import Array, write_text

CHANNELS = {"roll_rate_rad_s": ("lean_rate", 0.02), "steer_rad": ("steer", 0.004), "yaw_rate_rad_s": ("yaw_rate", 0.01)}
"""Recorded channel: output of the model, noise sd."""

SAMPLE = 0.01  # s
LARGEST_ANGLE = 0.15  # rad of lean and steer
MOST_GROWTH = 2.0  # growth rate times duration
GRIP = 0.9  # of the load


@dataclass
class Run:
    """True motion of a run and the torque that was recorded with it."""

    speed: float
    time: Array
    channels: dict[str, Array]
    torque: Array | None
    seen: dict[str, Array] = field(default_factory=dict)


@dataclass(frozen=True)
class Recording:
    """How a set of runs is made; the first edition's by default."""

    loud: float = 0.0
    growth: float = MOST_GROWTH
    cut: bool = False
    largest: float = LARGEST_ANGLE
    shorter: float = 0.0


QUIET = Recording()
CUT = Recording(cut=True)
LOUD = Recording(loud=0.02, growth=6.0, largest=0.7, shorter=1.2)
"""Noise of 2 % of the motion, some runs grow until they are cut: chi^2 up to 10^6."""


def coloured(size: int, sd: float, colour: float, rng: np.random.Generator) -> Array:
    """First-order autoregressive noise (size,), in the unit of its marginal standard deviation."""
    noise = np.empty(size)
    noise[0] = rng.standard_normal()
    for k in range(1, size):
        noise[k] = colour * noise[k - 1] + np.sqrt(1 - colour**2) * rng.standard_normal()
    return sd * noise


def doublets(time: Array, rng: np.random.Generator) -> Array:
    """Random steer torque of size 1 at ``time`` (samples,), by ``rng``: held 0.1 to 0.5 s, of either sign or 0."""
    torque, t, end = np.zeros(len(time)), 0.2, time[-1]
    while t < 0.7 * end:
        value, start = float(rng.choice([-1, 0, 1])), round(t / SAMPLE)
        t += rng.uniform(0.1, 0.5)
        torque[start : round(t / SAMPLE)] = value
    return torque


def history_case(
    folder: Path, *, hidden: tuple[str, ...], rng: np.random.Generator, runs: int = 6, duration: float = 4.0,
    noise: float = 1.0, forced: bool = True, nonlinear: bool = False, too_tight: float = 1.0,
    bicycle: str | None = None, speeds: tuple[float, float] | None = None, transient: float = 0.0,
    cause: Cause = AS_STATED, sizes: Mapping[str, Hidden] = HIDDEN, recording: Recording = QUIET,
    kind: str | None = None, held_out: int = 0, spread: float = 1.0,
) -> Truth:  # fmt: skip
    """Write MEASUREMENT.toml and one CSV a run; return what is hidden."""
    first = sizes[hidden[0]] if hidden else HIDDEN["twisting_torque" if nonlinear else "steer_damper"]
    nominal = load_bicycle(bicycle) if bicycle else pick(first.bicycles, rng)
    stated = load_bicycle(cause.stated) if cause.stated else nominal
    real = perturbed(nominal, {key: spread * s for key, s in uncertainty(nominal).items()}, rng)
    base = kind or ("tyre" if nonlinear and first.base == "rolling" else first.base)
    effects = base_effects(base, nominal.static_loads, rng)
    drawn, machine = hide(hidden, nominal, real, effects, rng, cause, sizes)
    colour = float(rng.uniform(0.2, 0.7))
    low, high = speeds or (max(first.speeds[0], 4.5), first.speeds[1])
    time = np.arange(round(duration / SAMPLE) + 1, dtype=float) * SAMPLE
    wanted = np.concatenate([np.linspace(low, high, runs).round(2), rng.uniform(low, high, held_out).round(2)])
    made = kicks(
        machine, wanted, time, rng, fastest=2 * high, cause=cause, forced=forced, nonlinear=nonlinear,
        recording=recording,
    )  # fmt: skip
    levels = _levels(made[:runs], noise, recording)
    for run in made:
        measure(run, levels, colour, cause.sensors, rng, transient)
    histories = {"drop_first_s": 3 * transient, "noise_sd": levels}
    content = {
        "kind": "histories", "description": "synthetic", "bicycle": stated.name, "effects": effects,
        "uncertainty": {key: s / too_tight for key, s in uncertainty(stated).items()}, "histories": histories,
    }  # fmt: skip
    write_histories(folder, content, made[:runs])
    weave = None
    if held_out:
        write_histories(folder / HELD_OUT, content, made[runs:])
        weave = weave_speed(machine, cause.speed_offset)
    return Truth(drawn | dict(cause.told), noise=noise, weave=weave)


def kicks(
    machine: Machine, speeds: Array, time: Array, rng: np.random.Generator, *, fastest: float,
    cause: Cause = AS_STATED, forced: bool = True, nonlinear: bool = False, recording: Recording = QUIET,
) -> list[Run]:  # fmt: skip
    """Move a machine after kicks, each made faster (or cut) until the bicycle stays up while it is recorded."""
    loads = machine.coefficients.loads
    bends = Nonlinear((GRIP * loads[0], GRIP * loads[1]) if nonlinear else (0.0, 0.0), cause.friction)
    made = []
    for speed in speeds:
        whole = time
        while machine.growth(speed + cause.speed_offset) * whole[-1] > recording.growth and speed < fastest:
            if recording.cut:
                whole = time[: len(whole) - 1]
            else:
                speed = round(speed + 0.25, 2)  # a bicycle that falls gives no record
        torque = doublets(whole, rng) if forced else None
        made.append(_run(machine, float(speed), cause, bends, (whole, torque), recording, rng))
    return made


def _run(
    machine: Machine, speed: float, cause: Cause, bends: Nonlinear, motion: tuple[Array, Array | None],
    recording: Recording, rng: np.random.Generator,
) -> Run:  # fmt: skip
    """A kick, scaled so that the bicycle stays upright: the linear motion is proportional to torque and start."""
    time, torque = motion
    space = machine.space(speed + cause.speed_offset)
    push = np.zeros(len(time)) if torque is None else torque
    start = rng.normal(0, 0.01) * _state(space, "lean") + 0.3 * _state(space, "lean_rate")
    states = simulate(space, start, push, SAMPLE)
    end, angles = len(time), np.max([np.abs(states @ space.outputs[name]) for name in ("lean", "steer")], axis=0)
    if recording.shorter and angles.max() > 3 * angles[time <= recording.shorter].max():
        end = round(recording.shorter / SAMPLE) + 1
    largest = recording.largest / 4 if bends.grip[0] else recording.largest
    size = largest / angles[:end].max()
    if recording.shorter:
        size = min(size, 1.5)  # a kick of 0.45 rad/s of lean rate at most
    states, push = size * states, size * push
    if bends:
        states = simulate_nonlinear(space, machine.law, speed + cause.speed_offset, bends, (size * start, push, SAMPLE))
    channels = {name: (states @ space.outputs[output])[:end] for name, (output, _) in CHANNELS.items()}
    return Run(speed, time[:end], channels, None if torque is None else push[:end])


def _state(space: Space, name: str) -> Array:
    """Unit state of an output, the others at rest: the smallest state whose output it is."""
    rows = np.array([space.outputs[key] for key in ("lean", "steer", "lean_rate", "steer_rate", "yaw_rate")])
    wanted = np.array([float(key == name) for key in ("lean", "steer", "lean_rate", "steer_rate", "yaw_rate")])
    return np.asarray(np.linalg.lstsq(rows, wanted, rcond=None)[0])


def _levels(made: list[Run], noise: float, recording: Recording) -> dict[str, float]:
    """Noise sd of every channel."""
    if not recording.loud:
        return {name: noise * level for name, (_, level) in CHANNELS.items()}
    middle = {name: float(np.median([run.channels[name].std() for run in made])) for name in CHANNELS}
    return {name: float(f"{noise * recording.loud * size:.3g}") for name, size in middle.items()}


def measure(
    run: Run, levels: Mapping[str, float], colour: float, sensors: Mapping[str, Sensor], rng: np.random.Generator,
    transient: float = 0.0,
) -> None:  # fmt: skip
    """Record a run: what its sensors make of the true motion, with coloured noise."""
    for name, level in levels.items():
        true, sensor = run.channels[name], sensors.get(name)
        if sensor:
            true = sensor.read(run.time, true, run.channels[sensor.other] if sensor.other else None)
        disturbance = 5 * level * np.exp(-run.time / transient) if transient else 0.0
        run.seen[name] = true + coloured(len(run.time), level, colour, rng) + disturbance


def write_histories(folder: Path, content: dict[str, Any], made: list[Run]) -> None:
    """Write the measurement file and one CSV a run."""
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
