"""Synthetic time histories for the blind test: kicks, torque doublets, coloured noise, linear or Magic Formula tyres.

Like :mod:`studies.missing_effect.blind.generator`, this shares nothing with the fitter. All synthetic.
"""

from pathlib import Path
from typing import Any

import numpy as np

from bicycle import load_bicycle
from bicycle.responses.inputs import InputHistory
from bicycle.responses.linear import respond
from bicycle.responses.magic_formula import nonlinear_model
from studies.missing_effect.blind.generator import (
    HIDDEN,
    Truth,
    base_effects,
    hide,
    perturbed,
    uncertainty,
)
from tyre.base.arrays import Array

CHANNELS = {"roll_rate_rad_s": ("lean_rate", 0.02), "steer_rad": ("steer", 0.004), "yaw_rate_rad_s": ("yaw_rate", 0.01)}
"""Recorded channel: output of the model, noise sd."""

SAMPLE = 0.01  # s
LARGEST_ANGLE = 0.15  # rad of lean and steer
MOST_GROWTH = 2.0  # growth rate times duration


def coloured(size: int, sd: float, colour: float, rng: np.random.Generator) -> Array:
    """First-order autoregressive noise (size,), in the unit of its marginal standard deviation.

    Parameters
    ----------
    size : int
        Number of samples.
    sd : float
        Marginal standard deviation, in any unit.
    colour : float
        Correlation of neighbours, no unit.
    rng : numpy.random.Generator
    """
    noise = np.empty(size)
    noise[0] = rng.standard_normal()
    for k in range(1, size):
        noise[k] = colour * noise[k - 1] + np.sqrt(1 - colour**2) * rng.standard_normal()
    return sd * noise


def doublets(duration: float, size: float, rng: np.random.Generator) -> InputHistory:
    """Random steer torque: held for 0.1 to 0.5 s, either sign, then released.

    Parameters
    ----------
    duration : float
        s.
    size : float
        Of the torque, N m.
    rng : numpy.random.Generator
    """
    times, values, t = [0.0], [0.0], 0.2
    while t < 0.7 * duration:
        times.append(round(t, 2))
        values.append(float(rng.choice([-1, 0, 1])) * size)
        t += rng.uniform(0.1, 0.5)
    return InputHistory(np.array([*times, round(t, 2)]), np.array([*values, 0.0]))


def history_case(
    folder: Path, *, hidden: tuple[str, ...], rng: np.random.Generator, runs: int = 6, duration: float = 4.0,
    noise: float = 1.0, forced: bool = True, nonlinear: bool = False, too_tight: float = 1.0,
    bicycle: str | None = None,
    speeds: tuple[float, float] | None = None, transient: float = 0.0, state_noise: bool = True, cell: str = "",
) -> Truth:  # fmt: skip
    """Write MEASUREMENT.toml and one CSV a run; return what is hidden.

    Other arguments are those of :func:`studies.missing_effect.blind.generator.modal_case`: ``folder``, ``hidden``,
    ``rng``, ``noise`` and ``too_tight`` (factors), ``bicycle``, ``cell``.

    Parameters
    ----------
    runs : int
        Number of runs.
    duration : float
        Of each, s.
    forced : bool
        Whether the steer torque pushes.
    nonlinear : bool
        Whether the tyres follow the Magic Formula.
    speeds : pair of float, optional
        Slowest and fastest, m/s.
    transient : float
        s; adds a decaying disturbance at the start, as of a hand that has not quite let go.
    state_noise : bool
        Whether noise is stated in the file.
    """
    import tomli_w

    first = HIDDEN[hidden[0]] if hidden else HIDDEN["twisting_torque" if nonlinear else "steer_damper"]
    nominal = load_bicycle(bicycle or str(rng.choice(first.bicycles)))
    sd = uncertainty(nominal)
    real = perturbed(nominal, sd, rng)
    kind = "tyre" if nonlinear and first.base == "rolling" else first.base
    effects = base_effects(kind, nominal.static_loads, rng)
    drawn, model = hide(hidden, nominal, real, effects, rng)
    colour = float(rng.uniform(0.2, 0.7))
    entries, (low, high) = [], speeds or (max(first.speeds[0], 4.5), first.speeds[1])
    folder.mkdir(parents=True, exist_ok=True)
    time = np.arange(round(duration / SAMPLE) + 1) * SAMPLE
    for k, speed in enumerate(np.linspace(low, high, runs).round(2)):
        while model.linear_model().eigenvalues(speed).real.max() * duration > MOST_GROWTH and speed < 2 * high:
            speed = round(speed + 0.25, 2)  # a bicycle that falls gives no record
        settings: dict[str, Any] = {"time": time, "initial": {"lean": float(rng.normal(0, 0.01)), "lean_rate": 0.3}}
        torque = doublets(duration, 1.0, rng) if forced else None
        if torque:
            settings["inputs"] = {"steer_torque": torque}
        trial = respond(model.linear_model(), speed=float(speed), **settings)
        largest = LARGEST_ANGLE / 4 if nonlinear else LARGEST_ANGLE
        size = largest / max(float(np.abs(trial.outputs[name]).max()) for name in ("lean", "steer"))
        settings["initial"] = {name: size * value for name, value in settings["initial"].items()}
        if torque:  # the motion is linear in torque and start: scaled so that the bicycle stays well upright
            torque = InputHistory(torque.time, size * torque.value)
            settings["inputs"] = {"steer_torque": torque}
        if nonlinear:
            response = nonlinear_model(model, speed=float(speed)).simulate(**settings, tolerance=1e-6)
        else:
            response = respond(model.linear_model(), speed=float(speed), **settings)
        table = {"time_s": time}
        for name, (output, level) in CHANNELS.items():
            disturbance = 5 * level * np.exp(-time / transient) if transient else 0.0
            table[name] = response.outputs[output] + coloured(len(time), noise * level, colour, rng) + disturbance
        if torque:
            table["steer_torque_N_m"] = torque.at(time)
        lines = [",".join(table)] + [",".join(f"{x:.6g}" for x in row) for row in zip(*table.values(), strict=True)]
        (folder / f"run{k:02d}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
        entries.append({"file": f"run{k:02d}.csv", "speed_m_s": float(speed)})
    histories: dict[str, Any] = {"drop_first_s": 3 * transient, "runs": entries}
    if state_noise:
        histories["noise_sd"] = {name: noise * level for name, (_, level) in CHANNELS.items()}
    content = {
        "kind": "histories", "description": "synthetic", "bicycle": nominal.name, "effects": effects,
        "uncertainty": {key: s / too_tight for key, s in sd.items()}, "histories": histories,
    }  # fmt: skip
    (folder / "MEASUREMENT.toml").write_text(tomli_w.dumps(content), encoding="utf-8")
    return Truth(drawn, cell, noise=noise)
