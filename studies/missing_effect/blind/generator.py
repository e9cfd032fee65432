"""Synthetic cases for the blind test: random bicycles, hidden effects of random size, noise. All synthetic.

Imports nothing of the fitter: measurement files go one way, truths another. Bicycles are measured ones with every
parameter perturbed by its stated uncertainty; the files give the unperturbed ones, as a laboratory would.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bicycle import Bicycle, Model, effect_class, load_bicycle
from bicycle.modal.named_modes import modes
from tyre.base.arrays import Array
from tyre.base.errors import InputError

UNRIDDEN = ("kooijman2008", "browser", "pista", "crescendo", "fisher", "benchmark")
RIDDEN = ("rigid_rider",)
TRIES = 100
RELATIVE = {"m": 0.005, "I": 0.03}
ABSOLUTE = {
    "w": 0.002,
    "c": 0.002,
    "lam": 0.006,
    "rR": 0.001,
    "rF": 0.001,
    "xB": 0.006,
    "zB": 0.006,
    "xH": 0.006,
    "zH": 0.006,
}


@dataclass(frozen=True)
class Hidden:
    """An effect to hide: the base it needs, the bicycles it makes sense on, and how its parameters are drawn."""

    base: str  # "rolling" (no slip), "static" (side slip) or "tyre" (relaxation and camber thrust)
    bicycles: tuple[str, ...]
    draw: Mapping[str, tuple[float, float]]  # log-uniform
    speeds: tuple[float, float] = (3.0, 8.0)
    by_load: tuple[str, ...] = ()
    place: Mapping[str, tuple[float, float]] = field(default_factory=dict)  # uniform


HIDDEN: Mapping[str, Hidden] = {
    "steer_damper": Hidden("rolling", UNRIDDEN, {"damping": (0.3, 2.0)}),
    "steer_spring": Hidden("rolling", UNRIDDEN, {"stiffness": (1.0, 8.0)}),
    "pneumatic_trail": Hidden("rolling", UNRIDDEN, {"trail": (0.01, 0.03)}),
    "crown_radius": Hidden("rolling", UNRIDDEN, {"crown_radius": (0.015, 0.03)}),
    "twisting_torque": Hidden("tyre", UNRIDDEN, {"twisting_stiffness": (0.7, 3.0)}, (4.0, 12.0)),
    "camber_thrust": Hidden("slipping", UNRIDDEN, {"camber_stiffness": (0.5, 1.0)}, (4.0, 12.0), ("camber_stiffness",)),
    "front_compliance": Hidden(
        "tyre", ("benchmark",), {"stiffness": (1500.0, 5000.0), "damping": (5.0, 20.0)}, (5.0, 15.0),
        place={"joint_x": (0.75, 0.95), "joint_z": (-0.9, -0.7)},
    ),
    "relaxation_length": Hidden("static", ("benchmark",), {"relaxation_length": (0.08, 0.2)}, (8.0, 20.0)),
    "rider_lean": Hidden(
        "rolling", RIDDEN,
        {"mass": (30, 50), "Ixx": (1.0, 2.5), "Izz": (0.6, 1.5), "stiffness": (600, 2500), "damping": (20, 120)},
        place={"x": (0.28, 0.38), "z": (-1.4, -1.25), "joint_z": (-1.0, -0.8)},
    ),
}  # fmt: skip
"""What is hidden one at a time, with sizes that occur on bicycles (physics of each effect's own page)."""


@dataclass(frozen=True)
class Truth:
    """What was hidden: identifier -> {parameter: value}, and how the case was made."""

    effects: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    cell: str = ""
    seed: int = 0
    noise: float = 1.0


def perturbed(bicycle: Bicycle, sd: Mapping[str, float], rng: np.random.Generator) -> Bicycle:
    """A bicycle drawn (by ``rng``) around another with ``sd`` by key, SI; drawn again until it is physical."""
    for _ in range(TRIES):
        try:
            return bicycle.replace(**{key: bicycle[key] + s * rng.standard_normal() for key, s in sd.items()})
        except InputError:
            continue
    raise InputError(f"no physical bicycle near {bicycle.name!r}")


def uncertainty(bicycle: Bicycle) -> dict[str, float]:
    """1-sigma of a carefully measured bicycle."""
    sd = dict(ABSOLUTE)
    for key in bicycle.values:
        if key[0] in RELATIVE and key not in ("IByy", "IHyy"):
            sd[key] = RELATIVE[key[0]] * abs(bicycle[key])
    for part in ("B", "H"):
        sd[f"I{part}xz"] = RELATIVE["I"] * math.sqrt(bicycle[f"I{part}xx"] * bicycle[f"I{part}zz"])
    return sd


def base_effects(kind: str, loads: tuple[float, float], rng: np.random.Generator) -> dict[str, dict[str, Any]]:
    """Effects that the file declares, as a model file has them.

    Parameters
    ----------
    kind : str
        Of contact law.
    loads : pair of float
        Static load of rear and front wheel, N.
    rng : numpy.random.Generator
    """

    def by_load(factor: float) -> dict[str, float]:
        return {"rear": round(factor * loads[0], 2), "front": round(factor * loads[1], 2)}

    stiffness: dict[str, Any] = {"cornering_stiffness": by_load(rng.uniform(10, 16))}
    tyre: dict[str, dict[str, Any]] = {
        "relaxation_length": {**stiffness, "relaxation_length": round(rng.uniform(0.08, 0.15), 3)}
    }
    camber = {"camber_thrust": {"camber_stiffness": by_load(rng.uniform(0.6, 1.0))}}
    static: dict[str, dict[str, Any]] = {"side_slip": stiffness}
    bases: dict[str, dict[str, dict[str, Any]]] = {
        "rolling": {}, "static": static | camber, "slipping": tyre, "tyre": tyre | camber
    }  # fmt: skip
    return bases[kind]


def draw_effect(name: str, bicycle: Bicycle, rng: np.random.Generator) -> dict[str, Any]:
    """Random parameters of the hidden effect ``name``, from ``rng``."""
    hidden = HIDDEN[name]
    values: dict[str, Any] = {
        key: float(np.exp(rng.uniform(math.log(low), math.log(high)))) for key, (low, high) in hidden.draw.items()
    }
    for key in hidden.by_load:
        values[key] = dict(zip(("rear", "front"), (values[key] * load for load in bicycle.static_loads), strict=True))
    return values | {key: float(rng.uniform(*span)) for key, span in hidden.place.items()}


def true_model(
    bicycle: Bicycle, effects: Mapping[str, Mapping[str, Any]], hidden: Mapping[str, Mapping[str, Any]]
) -> Model:
    """The bicycle as it is: tables of ``effects`` that the file declares and of ``hidden`` ones."""
    model = Model(bicycle, tuple(effect_class(name)(**table) for name, table in effects.items()))
    for name, table in hidden.items():
        given = dict(table)
        if name == "relaxation_length" and "side_slip" in effects:
            given["cornering_stiffness"] = effects["side_slip"]["cornering_stiffness"]
        model = model.with_effect(effect_class(name)(**given))
    return model


def hide(
    names: tuple[str, ...], nominal: Bicycle, real: Bicycle, effects: Mapping[str, Mapping[str, Any]],
    rng: np.random.Generator,
) -> tuple[dict[str, dict[str, Any]], Model]:  # fmt: skip
    """Draw the effects to hide, again until the bicycle can hold them; their values and the model as it is.

    Parameters
    ----------
    names : tuple of str
        Effects to hide.
    nominal, real : Bicycle
        As the file states it, and as it is.
    effects : mapping
        Tables of effects that the file declares.
    rng : numpy.random.Generator
    """
    for _ in range(TRIES):
        drawn = {name: draw_effect(name, nominal, rng) for name in names}
        try:
            return drawn, true_model(real, effects, drawn)
        except InputError:
            continue
    raise InputError(f"{nominal.name!r} cannot hold {', '.join(names)}")


def modal_case(
    folder: Path, *, hidden: tuple[str, ...], rng: np.random.Generator, points: int = 12, noise: float = 1.0,
    ratios: bool = True, too_tight: float = 1.0, bicycle: str | None = None, kind: str | None = None, cell: str = "",
    extra_speeds: tuple[float, ...] = (),
) -> Truth:  # fmt: skip
    """Write MEASUREMENT.toml and its table; return what is hidden.

    Parameters
    ----------
    folder : Path
    hidden : tuple of str
        Names of effects.
    rng : numpy.random.Generator
    points : int
        Number of speeds.
    noise : float
        Factor of standard deviations of 0.03 1/s + 1 % of |eigenvalue| and 0.02 + 1 % of a ratio.
    ratios : bool
        Whether shape ratios are measured.
    too_tight : float
        Factor by which the stated uncertainty of the bicycle is too small.
    bicycle, kind : str, optional
        Packaged bicycle, and kind of contact law; by default drawn.
    cell : str
        Of the blind test, kept in the truth.
    extra_speeds : tuple of float
        Measured besides random ones, m/s.
    """
    first = HIDDEN[hidden[0]] if hidden else HIDDEN[str(rng.choice(["steer_damper", "twisting_torque"]))]
    nominal = load_bicycle(bicycle or str(rng.choice(first.bicycles)))
    sd = uncertainty(nominal)
    real = perturbed(nominal, sd, rng)
    effects = base_effects(kind or first.base, nominal.static_loads, rng)
    drawn, whole = hide(hidden, nominal, real, effects, rng)
    model = whole.linear_model()
    low, high = first.speeds
    speeds = np.sort(np.concatenate([rng.uniform(low, high, points).round(3), extra_speeds]))
    found, rows = modes(model, speeds), []
    for mode in ("weave", "wobble", "rider"):
        if mode not in found.names:
            continue
        shape = found.shape(mode).phasors
        for k, root in enumerate(found.branch(mode)[:, 0]):
            if not root.imag > 0.5 or -root.real > 0.7 * abs(root) or abs(root) > 100:
                continue  # nothing that a free decay would show
            rows.append(table_row(speeds[k], mode, root, shape[k], noise, rng, ratios=ratios))
    write_modal(folder, nominal.name, effects, {key: s / too_tight for key, s in sd.items()}, rows)
    return Truth(drawn, cell, noise=noise)


def table_row(
    speed: float, mode: str, root: complex, shape: Array, noise: float, rng: np.random.Generator, *, ratios: bool
) -> dict[str, Any]:
    """A row of a modal table with noise.

    Parameters
    ----------
    speed : float
        m/s.
    mode : str
    root : complex
        True eigenvalue, 1/s.
    shape : ndarray, shape (3,)
        Phasors of lean, steer and yaw.
    noise : float
        Factor of the usual standard deviations.
    ratios : bool
        Whether shape ratios are measured.
    rng : numpy.random.Generator
    """
    sd = noise * (0.03 + 0.01 * abs(root))
    seen = root + sd * complex(*rng.standard_normal(2))
    row: dict[str, Any] = {
        "speed_m_s": speed, "mode": mode, "real_1_s": seen.real, "imag_rad_s": abs(seen.imag),
        "real_sd_1_s": sd, "imag_sd_rad_s": sd,
    }  # fmt: skip
    if ratios:
        for name, phasor in (("steer_over_lean", shape[1]), ("yaw_over_lean", shape[2])):
            value = phasor / shape[0]
            spread = noise * (0.02 + 0.01 * abs(value))
            value += spread * complex(*rng.standard_normal(2))
            row |= {f"{name}_re": value.real, f"{name}_im": value.imag, f"{name}_sd": spread}
    return row


def write_modal(
    folder: Path, bicycle: str, effects: Mapping[str, Any], sd: Mapping[str, float], rows: list[dict[str, Any]]
) -> None:
    """Write the measurement file and its table.

    Parameters
    ----------
    folder : Path
    bicycle : str
    effects : mapping
        Tables as in a model file.
    sd : mapping of str to float
        Stated standard deviations by key, SI.
    rows : list of dict
        Of the table.
    """
    import tomli_w

    folder.mkdir(parents=True, exist_ok=True)
    content = {
        "kind": "modal", "description": "synthetic", "bicycle": bicycle, "effects": effects, "uncertainty": dict(sd),
        "modal": {"table": "modes.csv"},
    }  # fmt: skip
    (folder / "MEASUREMENT.toml").write_text(tomli_w.dumps(content), encoding="utf-8")
    lines = [",".join(rows[0])]
    lines += [",".join(v if isinstance(v, str) else f"{v:.9g}" for v in row.values()) for row in rows]
    (folder / "modes.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
