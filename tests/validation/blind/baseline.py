"""The baseline of the blind test: plain least squares over single effects, and Schwarz's criterion (BIC).

Every effect of a short table is fitted alone, with nothing but its own sizes free. What the stated uncertainty of the
bicycle does to the data, to first order, is part of their covariance. The lowest BIC gives the name, those within two
of it a class; nothing is missing if the stated bicycle is within two of it. Noise of histories is first taken as white;
what the best fit leaves over then gives its colour, and the leaders are fitted again.
"""

import csv
import tomllib
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import expm
from scipy.optimize import least_squares

from bicycle import load_bicycle
from tests.validation.blind.closing import Machine, build
from tests.validation.blind.machine import Extras
from tyre.ground import Array

Misfit = Callable[[Machine, float, float], Array]
Fitted = tuple[float, dict[str, dict[str, float]], Array]
CLASS = 2.0  # of BIC, within which effects are not told apart
LEADERS = 4  # that are fitted again once the colour of the noise is known
OUTPUTS = {"roll_rate_rad_s": "lean_rate", "steer_rad": "steer", "yaw_rate_rad_s": "yaw_rate"}


@dataclass
class Change:
    """What a machine is otherwise than stated."""

    effects: dict[str, Any]
    extras: dict[str, float] = field(default_factory=dict)
    shifts: dict[str, float] = field(default_factory=dict)
    speed: float = 0.0


def effect(name: str, **fixed: Any) -> Callable[..., None]:
    """Give the model an effect of the library with some sizes."""

    def put(change: Change, **sizes: float) -> None:
        change.effects[name] = fixed | sizes

    return put


def lag(change: Change, relaxation_length: float) -> None:
    """Let the tyres of a static law lag."""
    stiffness = change.effects["side_slip"]["cornering_stiffness"]
    effect("relaxation_length", cornering_stiffness=stiffness)(change, relaxation_length=relaxation_length)


HINGE, RIDER = {"joint_x": 0.85, "joint_z": -0.8}, {"x": 0.33, "z": -1.3, "joint_z": -0.9, "Ixx": 1.6, "Izz": 1.0}
TABLE: Mapping[str, tuple[Callable[..., None], dict[str, float]]] = {
    "steer_damper": (effect("steer_damper"), {"damping": 0.5}),
    "steer_spring": (effect("steer_spring"), {"stiffness": 2.0}),
    "pneumatic_trail": (effect("pneumatic_trail"), {"trail": 0.01}),
    "crown_radius": (effect("crown_radius"), {"crown_radius": 0.02}),
    "twisting_torque": (effect("twisting_torque"), {"twisting_stiffness": 1.0}),
    "camber_thrust": (effect("camber_thrust"), {"camber_stiffness": 300.0}),
    "front_compliance": (effect("front_compliance", **HINGE), {"stiffness": 3000.0, "damping": 10.0}),
    "relaxation_length": (lag, {"relaxation_length": 0.1}),
    "rider_lean": (effect("rider_lean", **RIDER), {"mass": 40.0, "stiffness": 1200.0, "damping": 60.0}),
    "luggage": (lambda change, mass: change.extras.update(rack=mass), {"mass": 4.0}),
    "handlebar_bag": (lambda change, mass: change.extras.update(bar=mass), {"mass": 4.0}),
    "speed_offset": (lambda change, offset: setattr(change, "speed", offset), {"offset": 0.1}),
    "wrong_tilt": (lambda change, shift: change.shifts.update(lam=shift), {"shift": 0.01}),
    "wrong_trail": (lambda change, shift: change.shifts.update(c=shift), {"shift": 0.005}),
}
"""Effect -> what it does, and sizes from which its fit starts."""


Over = Callable[[str, Array], Array]
"""Residual (n,) with an effect ("none"), whose sizes (k,) are in units of those in the table."""


def baseline(folder: Path, without: tuple[str, ...] = ()) -> dict[str, Any]:
    """Answer for the measurement in a ``folder``, in the keys of a verdict; effects ``without`` which it has to do."""
    misfit, content, names = read(folder, without)
    found = ranked(residuals(misfit, content, 0.0), names)
    if content["kind"] != "modal":
        phi = colour(next(iter(found.values()))[2])
        found = ranked(residuals(misfit, content, phi), list(found)[:LEADERS])
    best, *_ = found
    verdict: dict[str, Any] = {"verdict": "none", "class": [], "effects": []}
    if found["none"][0] >= found[best][0] + CLASS:
        names = [name for name in found if found[name][0] < found[best][0] + CLASS]
        verdict = {"verdict": "named" if len(names) == 1 else "class", "class": names}
        verdict["effects"] = [{"identifier": best, "parameters": found[best][1]}]
    return verdict | {"held_out_gap": {"nominal": None, "final": None}}


def read(folder: Path, without: tuple[str, ...]) -> tuple[Misfit, dict[str, Any], list[str]]:
    """Misfit and content of the measurement in a ``folder``, and the effects that may be missing."""
    content = tomllib.loads((folder / "MEASUREMENT.toml").read_text(encoding="utf-8"))
    own = content["effects"]
    lagging = set() if "side_slip" in own else {"relaxation_length"}
    names = [name for name in TABLE if name not in {*without, *own, *lagging}]
    return (modal if content["kind"] == "modal" else histories)(folder, content), content, names


def residuals(misfit: Misfit, content: Mapping[str, Any], phi: float) -> Over:
    """Residuals with an effect, the uncertainty of the stated bicycle in their covariance."""
    stated, own = dict(load_bicycle(content["bicycle"]).values), content["effects"]

    def left(values: Mapping[str, float], change: Change) -> Array:
        moved = {key: value + change.shifts.get(key, 0.0) for key, value in values.items()}
        return misfit(build(moved, change.effects, Extras(**change.extras)), change.speed, phi)

    nothing = left(stated, Change(own))
    sd = {key: sd for key, sd in content["uncertainty"].items() if sd}
    slopes = [2 * (left(stated | {key: stated[key] + sd[key] / 2}, Change(own)) - nothing) for key in sd]
    u, s, _ = np.linalg.svd(np.array(slopes).T, full_matrices=False)
    shrink = 1 - 1 / np.sqrt(1 + s**2)

    def over(name: str, x: Array) -> Array:
        change = Change(dict(own))
        if name != "none":
            put, start = TABLE[name]
            put(change, **{key: by * size for (key, size), by in zip(start.items(), x, strict=True)})
        found = left(stated, change)
        return found - u @ (shrink * (u.T @ found))

    return over


def ranked(over: Over, names: Sequence[str]) -> dict[str, Fitted]:
    """BIC, sizes with their sd and residuals of the stated bicycle ("none") and with each effect, the best first."""

    def fitted(name: str) -> Fitted:
        if name == "none":
            rest = over(name, np.zeros(0))
            return float(rest @ rest), {}, rest
        start = TABLE[name][1]
        fit = least_squares(lambda x: over(name, x), np.ones(len(start)), max_nfev=15)
        spread = np.sqrt(np.diag(np.linalg.pinv(fit.jac.T @ fit.jac)))
        each = zip(start.items(), fit.x, spread, strict=True)
        sizes = {key: {"value": x * size, "sd": sd * size} for (key, size), x, sd in each}
        return 2 * fit.cost + len(start) * np.log(len(fit.fun)), sizes, fit.fun

    found = {}
    for name in dict.fromkeys(("none", *names)):
        with suppress(ArithmeticError, ValueError, np.linalg.LinAlgError), np.errstate(all="ignore"):  # no such bicycle
            found[name] = fitted(name)
    return dict(sorted(found.items(), key=lambda item: item[1][0]))


def colour(residual: Array) -> float:
    """Correlation of a residual from sample to sample."""
    return float(np.clip(residual[1:] @ residual[:-1] / (residual @ residual), 0.0, 0.95))


def modal(folder: Path, content: Mapping[str, Any]) -> Misfit:
    """Misfit of eigenvalues and ratios, each of the root nearest to the measured one, over their sd."""
    with (folder / content["modal"]["table"]).open(encoding="utf-8") as file:
        rows = [{key: float(x) for key, x in row.items() if key != "mode"} for row in csv.DictReader(file)]

    def misfit(machine: Machine, offset: float, phi: float) -> Array:
        found = []
        for row in rows:
            space, seen = machine.space(row["speed_m_s"] + offset), complex(row["real_1_s"], row["imag_rad_s"])
            roots, vectors = np.linalg.eig(space.matrix)
            k = int(np.argmin(np.abs(roots - seen)))
            lean, steer, yaw_rate = (space.outputs[name] @ vectors[:, k] for name in ("lean", "steer", "yaw_rate"))
            found.append((seen - roots[k]) / row["real_sd_1_s"])
            if "steer_over_lean_re" in row:
                for name, value in (("steer_over_lean", steer / lean), ("yaw_over_lean", yaw_rate / roots[k] / lean)):
                    found.append((complex(row[f"{name}_re"], row[f"{name}_im"]) - value) / row[f"{name}_sd"])
        return np.array(found).view(float)

    return misfit


def histories(folder: Path, content: Mapping[str, Any]) -> Misfit:
    """Misfit of channels over their noise; the start of each run is the one that fits best."""
    levels, runs = content["histories"]["noise_sd"], []
    for run in content["histories"]["runs"]:
        with (folder / run["file"]).open(encoding="utf-8") as file:
            table = dict(zip(next(csv.reader(file)), np.loadtxt(file, delimiter=",").T, strict=True))
        runs.append((run["speed_m_s"], table, table.get("steer_torque_N_m", np.zeros(len(table["time_s"])))))

    def misfit(machine: Machine, offset: float, phi: float) -> Array:
        found = []
        for speed, table, torque in runs:
            space = machine.space(speed + offset)
            n, whole = len(space.matrix), np.zeros((len(space.matrix) + 1,) * 2)
            whole[:n, :n], whole[:n, n] = space.matrix, space.inputs[:, 0]
            once = expm(whole * (table["time_s"][1] - table["time_s"][0]))
            states = [np.eye(n, n + 1)]  # answers to a start in each state, and to the torque
            for pull in torque[:-1]:
                states.append(once[:n, :n] @ states[-1])
                states[-1][:, n] += once[:n, n] * pull
            answers = np.array(states).transpose(0, 2, 1)
            blocks = []
            for channel, level in levels.items():
                block = np.column_stack([answers @ space.outputs[OUTPUTS[channel]], table[channel]]) / level
                blocks.append((block[1:] - phi * block[:-1]) / np.sqrt(1 - phi**2))
            outputs = np.concatenate(blocks)
            over, basis = outputs[:, n + 1] - outputs[:, n], np.linalg.qr(outputs[:, :n])[0]
            found.append(over - basis @ (basis.T @ over))
        return np.concatenate(found)

    return misfit
