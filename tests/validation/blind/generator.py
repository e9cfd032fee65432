"""Synthetic modal data for the blind test: eigenvalues and shape ratios with noise. All synthetic.

Imports nothing of the fitter: measurement files go one way, truths another. The motion is that of
:mod:`tests.validation.blind`, which shares no equation with `bicycle`.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bicycle import load_bicycle
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
from tests.validation.blind.motion import Shape, shapes, weave_speed
from tyre.ground import InputError, write_text

HELD_OUT = "held_out"  # folder of what is kept back
MODES = ("weave", "wobble", "rider")
FEWEST, TRIES = 6, 20  # oscillations of a table, and draws of a bicycle that must show them


def modal_case(
    folder: Path, *, hidden: tuple[str, ...], rng: np.random.Generator, points: int = 12, noise: float = 1.0,
    ratios: bool = True, too_tight: float = 1.0, bicycle: str | None = None, kind: str | None = None,
    cause: Cause = AS_STATED, sizes: Mapping[str, Hidden] = HIDDEN,
    modes: tuple[str, ...] = MODES, held_out: int = 0, spread: float = 1.0,
) -> Truth:  # fmt: skip
    """Write MEASUREMENT.toml and its table; return what is hidden."""
    first = sizes[hidden[0]] if hidden else HIDDEN[str(rng.choice(["steer_damper", "twisting_torque"]))]
    nominal = load_bicycle(bicycle) if bicycle else pick(first.bicycles, rng)
    stated = load_bicycle(cause.stated) if cause.stated else nominal
    for _ in range(TRIES):
        real = perturbed(nominal, {key: spread * s for key, s in uncertainty(nominal).items()}, rng)
        effects = base_effects(kind or first.base, nominal.static_loads, rng)
        drawn, machine = hide(hidden, nominal, real, effects, rng, cause, sizes)
        low, high = first.speeds
        speeds = np.sort(rng.uniform(low, high, points).round(3))
        found = [shapes(machine, float(speed) + cause.speed_offset) for speed in speeds]
        seen = [(v, one[mode]) for mode in modes for v, one in zip(speeds, found, strict=True) if mode in one]
        if len(seen) >= FEWEST:
            break
    else:
        raise InputError(f"{nominal.name!r} with {', '.join([*hidden, *cause.told])} hardly oscillates")
    rows = [table_row(float(speed), shape, noise, rng, ratios=ratios) for speed, shape in seen]
    sd = uncertainty(stated)
    told = {key: s / too_tight for key, s in sd.items()}
    write_modal(folder, stated.name, effects, told, rows)
    weave = None
    if held_out:
        more = [(float(v), shapes(machine, float(v) + cause.speed_offset)) for v in rng.uniform(low, high, held_out)]
        seen = [(v, one[mode]) for mode in modes for v, one in more if mode in one]
        rows = [table_row(v, shape, noise, rng, ratios=ratios) for v, shape in seen]
        if rows:
            write_modal(folder / HELD_OUT, stated.name, effects, told, rows)
        weave = weave_speed(machine, cause.speed_offset)
    return Truth(drawn | dict(cause.told), noise=noise, weave=weave)


def table_row(speed: float, shape: Shape, noise: float, rng: np.random.Generator, *, ratios: bool) -> dict[str, Any]:
    """A row of a modal table with noise."""
    root = shape.root
    sd = noise * (0.03 + 0.01 * abs(root))
    seen = root + sd * complex(*rng.standard_normal(2))
    row: dict[str, Any] = {
        "speed_m_s": speed, "mode": shape.name, "real_1_s": seen.real, "imag_rad_s": abs(seen.imag),
        "real_sd_1_s": sd, "imag_sd_rad_s": sd,
    }  # fmt: skip
    if ratios:
        for name, value in (("steer_over_lean", shape.steer), ("yaw_over_lean", shape.yaw)):
            spread = noise * (0.02 + 0.01 * abs(value))
            value += spread * complex(*rng.standard_normal(2))
            row |= {f"{name}_re": value.real, f"{name}_im": value.imag, f"{name}_sd": spread}
    return row


def write_modal(
    folder: Path, bicycle: str, effects: Mapping[str, Any], sd: Mapping[str, float], rows: list[dict[str, Any]]
) -> None:
    """Write the measurement file and its table."""
    import tomli_w

    folder.mkdir(parents=True, exist_ok=True)
    content = {
        "kind": "modal", "description": "synthetic", "bicycle": bicycle, "effects": effects, "uncertainty": dict(sd),
        "modal": {"table": "modes.csv"},
    }  # fmt: skip
    write_text(folder / "MEASUREMENT.toml", tomli_w.dumps(content))
    write_table(folder / "modes.csv", rows)


def write_table(file: Path, rows: list[dict[str, Any]]) -> None:
    """Write ``rows`` of a modal table to a CSV ``file``."""
    lines = [",".join(rows[0])]
    lines += [",".join(v if isinstance(v, str) else f"{v:.9g}" for v in row.values()) for row in rows]
    write_text(file, "\n".join(lines) + "\n")
