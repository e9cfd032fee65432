"""The cells of the blind test: name and seed -> files and truth.

Sizes are those of :mod:`.hidden` and :mod:`.causes`; noise takes 0.5, 1 or 2 times the middle level (power curve).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tests.validation.blind import causes
from tests.validation.blind.generator import modal_case
from tests.validation.blind.hidden import HIDDEN, UNRIDDEN, UNUSUAL, Cause, Truth
from tests.validation.blind.histories import CUT, LOUD, history_case
from tests.validation.blind.opposed import NOISE as QUIET
from tests.validation.blind.opposed import opposed_pair

Settings = dict[str, Any]
Random = np.random.Generator
PAIRS = (("steer_damper", "steer_spring"), ("steer_damper", "pneumatic_trail"), ("steer_spring", "pneumatic_trail"))
NOISE = (0.5, 1.0, 2.0)
SHORT: Settings = {"runs": 4, "duration": 3.0}
TIGHT: Settings = {"too_tight": 1.5}
LOUD_SPEEDS = (3.2, 8.5)
OWN_MODE = ("rear_twist", "bar_mass")  # they ring by themselves, which no mode of a model is called
BENDING = 0.3  # share of histories with tyres that saturate
OWN_TYRE = ("relaxation_length", "camber_thrust")  # their base leaves no tyre to bend


def _noise(rng: Random) -> float:
    return float(rng.choice(NOISE))


def _hidden(rng: Random, sizes: Mapping[str, Any] = HIDDEN) -> tuple[str, ...]:
    return (str(rng.choice(list(sizes))),)


def nothing(rng: Random) -> Settings:
    """Hide nothing."""
    return {"noise": _noise(rng)}


def one(rng: Random) -> Settings:
    """Hide one effect of a usual size."""
    return {"hidden": _hidden(rng), "noise": _noise(rng)}


def pair(rng: Random) -> Settings:
    """Hide two effects."""
    return {"hidden": PAIRS[int(rng.integers(len(PAIRS)))], "noise": _noise(rng)}


def outside(rng: Random, makers: causes.Makers) -> Settings:
    """Hide an effect that is left out of the library (half), or something that no library has."""
    settings: Settings = {"noise": _noise(rng)}
    if rng.random() < 0.5:
        hidden = _hidden(rng)
        return settings | {"hidden": hidden, "left_out": hidden}
    return settings | {"cause": causes.draw(makers, rng)}


def modal_outside(rng: Random) -> Settings:
    """Hide something outside the library in modal data, which then show no modes of a tyre or a rider."""
    settings = outside(rng, causes.OUTSIDE)
    if "cause" in settings:
        rings = set(settings["cause"].told) & set(OWN_MODE)
        settings["modes"] = ("weave",) if rings else ("weave", "wobble")
    return settings


def loud(rng: Random) -> Settings:
    """Hide one effect in 8 free runs of 2.5 s, noise 2 % of the motion, of which some grow."""
    hidden = _hidden(rng)
    usual = HIDDEN[hidden[0]].speeds
    return {"hidden": hidden, "speeds": usual if usual[0] > 4.5 else LOUD_SPEEDS, "recording": LOUD}


def wrong_bicycle(rng: Random) -> Settings:
    """State another unridden bicycle in the file."""
    measured, stated = (str(name) for name in rng.choice(UNRIDDEN[:-1], 2, replace=False))
    return {"bicycle": measured, "cause": Cause({"wrong_bicycle": {}}, stated=stated), "noise": _noise(rng)}


def caused(rng: Random, makers: causes.Makers) -> Settings:
    """Make one of the mistakes or changes that users have."""
    return {"cause": causes.draw(makers, rng), "noise": _noise(rng)}


def offset(rng: Random) -> Settings:
    """Let the speed be off."""
    return {"cause": causes.LIBRARY["speed_offset"](rng), "noise": _noise(rng)}


def one_speed(rng: Random) -> Settings:
    """Hide something (half of it no library has) in three kicks within 1 % of one speed."""
    settings: Settings = {"noise": _noise(rng)}
    hidden = _hidden(rng)
    low, high = HIDDEN[hidden[0]].speeds
    if rng.random() < 0.5:
        settings["cause"], (low, high) = causes.draw(causes.OUTSIDE_HISTORIES, rng), (3.0, 8.0)
    else:
        settings["hidden"] = hidden
    speed = rng.uniform(max(low, 4.5), high)
    return settings | {"speeds": (0.9965 * speed, 1.0035 * speed)}


def unusual(rng: Random) -> Settings:
    """Hide one effect 1.5 to 4 times outside what occurs."""
    return {"hidden": _hidden(rng, UNUSUAL), "noise": float(rng.choice(NOISE[:2])), "sizes": UNUSUAL}


def opposed(rng: Random) -> Settings:
    """Hide two effects that hide each other (:mod:`.opposed`)."""
    bicycle, sizes = opposed_pair(rng)
    return {"bicycle": bicycle, "sizes": sizes, "hidden": tuple(sizes), "noise": QUIET}


FAINT: Settings = {"points": 8, "modes": ("weave",), "kind": "slipping"}
FAINT_HIDDEN = ("steer_damper", "steer_spring", "pneumatic_trail", "crown_radius", "twisting_torque", "camber_thrust")
FAINT_BICYCLES = ("pista_rider", "benchmark", "rigid_rider", "browser", "crescendo")


def _faint_base(rng: Random) -> Settings:
    """Draw the bicycle of a short table of weave on tyres: half of them carry a rider, whose weave says less."""
    return {"bicycle": str(rng.choice(FAINT_BICYCLES))}


def faint_nothing(rng: Random) -> Settings:
    """Hide nothing in a short table of weave on tyres."""
    return _faint_base(rng)


def faint_one(rng: Random) -> Settings:
    """Hide one effect of a usual size in a short table of weave on tyres."""
    return _faint_base(rng) | {"hidden": (str(rng.choice(FAINT_HIDDEN)),)}


def faint_outside(rng: Random) -> Settings:
    """Hide something that no library has in a short table of weave on tyres.

    No effect is left out of the library here: in so few rows a trail looks like the spring that was left out.
    """
    return _faint_base(rng) | {"cause": causes.draw(causes.OUTSIDE, rng)}


@dataclass(frozen=True)
class Cell:
    """What measures, what is drawn for a case, and what is the same in all of them."""

    measure: Callable[..., Truth]
    draw: Callable[[Random], Settings]
    fixed: Settings = field(default_factory=dict)
    may_bend: bool = False


modal, bare = partial(Cell, modal_case), {"ratios": False}
history, bending = partial(Cell, history_case), partial(Cell, history_case, may_bend=True)
MAKERS: Mapping[str, Cell] = {
    "modal-none": modal(nothing),
    "modal-none-tight": modal(nothing, TIGHT),
    "history-none": bending(nothing, SHORT),
    "history-none-tight": bending(nothing, SHORT | TIGHT),
    "modal-one": modal(one),
    "history-one": bending(one, SHORT),
    "modal-pair": modal(pair, {"points": 16}),
    "modal-outside": modal(modal_outside),
    "history-outside": bending(partial(outside, makers=causes.OUTSIDE_HISTORIES), SHORT),
    "loud-one": history(loud, {"runs": 8, "duration": 2.5, "forced": False}),
    "modal-wrong-bicycle": modal(wrong_bicycle),
    "history-wrong-bicycle": history(wrong_bicycle, SHORT),
    "history-wrong-sensor": bending(partial(caused, makers=causes.SENSORS), SHORT),
    "modal-causes": modal(partial(caused, makers=causes.LIBRARY)),
    "history-causes": history(partial(caused, makers=causes.LIBRARY_HISTORIES), SHORT),
    "one-speed": history(one_speed, {"runs": 3, "duration": 3.0, "forced": False}),
    "modal-unusual": modal(unusual),
    "history-unusual": history(unusual, SHORT | {"recording": CUT}),  # runs that grow are cut
    "modal-opposed": modal(opposed, {"points": 16}),
    "history-opposed": history(opposed, {"runs": 6, "duration": 3.0}),
    "eigenvalues-none": modal(nothing, bare),
    "eigenvalues-one": modal(one, bare),
    "eigenvalues-offset": modal(offset, bare),
    "faint-none": modal(faint_nothing, FAINT),
    "faint-one": modal(faint_one, FAINT),
    "faint-outside": modal(faint_outside, FAINT),
}
CELLS = tuple(MAKERS)
"""In the order of their numbers, which seed them: append, never insert."""


def make(cell: str, seed: int, folder: Path, **further: Any) -> tuple[Truth, tuple[str, ...]]:
    """Write a case of ``cell`` and ``seed`` into ``folder``; its truth and the effects taken out of the library."""
    rng, kind = np.random.default_rng([seed, CELLS.index(cell)]), MAKERS[cell]
    settings = {"hidden": (), **kind.draw(rng), **kind.fixed, **further}
    left_out = settings.pop("left_out", ())
    if kind.may_bend:
        bends = bool(rng.random() < BENDING)
        settings["nonlinear"] = bends and not set(settings["hidden"]) & set(OWN_TYRE)
    truth = kind.measure(folder, rng=rng, **settings)
    return replace(truth, cell=cell, seed=seed), left_out
