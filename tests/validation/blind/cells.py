"""The cells of the blind test: name and seed -> files and truth. Each cell is a function of a folder and a generator.

Sizes are those of :mod:`.hidden` and :mod:`.causes`; noise takes 0.5, 1 or 2 times the middle level (power curve).
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tests.validation.blind import causes
from tests.validation.blind.generator import modal_case
from tests.validation.blind.hidden import HIDDEN, UNRIDDEN, UNUSUAL, Cause, Hidden, Truth
from tests.validation.blind.histories import CUT, LOUD, history_case
from tests.validation.blind.opposed import NOISE as QUIET
from tests.validation.blind.opposed import opposed_pair

Made = tuple[Truth, tuple[str, ...]]
PAIRS = (("steer_damper", "steer_spring"), ("steer_damper", "pneumatic_trail"), ("steer_spring", "pneumatic_trail"))
NOISE = (0.5, 1.0, 2.0)
SHORT: Mapping[str, Any] = {"runs": 4, "duration": 3.0}
TIGHT = 1.5
LOUD_SPEEDS = (3.2, 8.5)
OWN_MODE = ("rear_twist", "bar_mass")  # they ring by themselves, which no mode of a model is called
BENDING = 0.3  # share of histories with tyres that saturate
OWN_TYRE = ("relaxation_length", "camber_thrust")  # their base leaves no tyre to bend


def _one(rng: np.random.Generator, sizes: Mapping[str, Hidden] = HIDDEN) -> tuple[str, ...]:
    return (str(rng.choice(list(sizes))),)


def _noise(rng: np.random.Generator) -> float:
    return float(rng.choice(NOISE))


def _bends(rng: np.random.Generator, hidden: tuple[str, ...]) -> bool:
    return bool(rng.random() < BENDING) and not set(hidden) & set(OWN_TYRE)


def modal_none(folder: Path, rng: np.random.Generator, *, too_tight: float = 1.0, held_out: int = 0) -> Made:
    """Nothing hidden, in ``folder``, by ``rng``; sd ``too_tight`` by a factor, a number of speeds ``held_out``."""
    return modal_case(folder, hidden=(), rng=rng, noise=_noise(rng), too_tight=too_tight, held_out=held_out), ()


def history_none(folder: Path, rng: np.random.Generator, *, too_tight: float = 1.0) -> Made:
    """The same in histories; ``folder``, ``rng`` and factor ``too_tight`` as of :func:`modal_none`."""
    settings = {"noise": _noise(rng), "nonlinear": _bends(rng, ()), "too_tight": too_tight, **SHORT}
    return history_case(folder, hidden=(), rng=rng, **settings), ()


def modal_none_tight(folder: Path, rng: np.random.Generator) -> Made:
    """Nothing hidden, priors 1.5 times too tight, in ``folder``, by ``rng``."""
    return modal_none(folder, rng, too_tight=TIGHT)


def history_none_tight(folder: Path, rng: np.random.Generator) -> Made:
    """Nothing hidden, priors 1.5 times too tight, in ``folder``, by ``rng``."""
    return history_none(folder, rng, too_tight=TIGHT)


def modal_one(folder: Path, rng: np.random.Generator, *, held_out: int = 0) -> Made:
    """One effect of a usual size, in ``folder``, by ``rng``; the number of speeds ``held_out``."""
    return modal_case(folder, hidden=_one(rng), rng=rng, noise=_noise(rng), held_out=held_out), ()


def history_one(folder: Path, rng: np.random.Generator, *, held_out: int = 0) -> Made:
    """One effect of a usual size, in ``folder``, by ``rng``; the number of speeds ``held_out``."""
    hidden = _one(rng)
    settings = {"noise": _noise(rng), "nonlinear": _bends(rng, hidden), "held_out": held_out, **SHORT}
    return history_case(folder, hidden=hidden, rng=rng, **settings), ()


def modal_pair(folder: Path, rng: np.random.Generator) -> Made:
    """Two effects, in ``folder``, by ``rng``."""
    pair = PAIRS[int(rng.integers(len(PAIRS)))]
    return modal_case(folder, hidden=pair, rng=rng, noise=_noise(rng), points=16), ()


def modal_outside(folder: Path, rng: np.random.Generator, *, held_out: int = 0) -> Made:
    """Half: an effect that is left out of the library; half: one that no library has. In ``folder``, by ``rng``."""
    noise = _noise(rng)
    if rng.random() < 0.5:
        hidden = _one(rng)
        return modal_case(folder, hidden=hidden, rng=rng, noise=noise, held_out=held_out), hidden
    cause = causes.draw(causes.OUTSIDE, rng)
    modes = ("weave",) if set(cause.told) & set(OWN_MODE) else ("weave", "wobble")
    return modal_case(folder, hidden=(), rng=rng, noise=noise, cause=cause, modes=modes, held_out=held_out), ()


def history_outside(folder: Path, rng: np.random.Generator, *, held_out: int = 0) -> Made:
    """Half: an effect that is left out of the library; half: one that no library has. In ``folder``, by ``rng``."""
    settings = {"noise": _noise(rng), "held_out": held_out, **SHORT}
    if rng.random() < 0.5:
        hidden = _one(rng)
        return history_case(folder, hidden=hidden, rng=rng, **settings, nonlinear=_bends(rng, hidden)), hidden
    cause = causes.draw(causes.OUTSIDE_HISTORIES, rng)
    return history_case(folder, hidden=(), rng=rng, **settings, cause=cause, nonlinear=_bends(rng, ())), ()


def loud_one(folder: Path, rng: np.random.Generator) -> Made:
    """8 free runs of 2.5 s, noise 2 % of the motion, some growing; one effect, in ``folder``, by ``rng``."""
    hidden = _one(rng)
    speeds = HIDDEN[hidden[0]].speeds if HIDDEN[hidden[0]].speeds[0] > 4.5 else LOUD_SPEEDS
    settings: dict[str, Any] = {"runs": 8, "duration": 2.5, "forced": False, "recording": LOUD, "speeds": speeds}
    return history_case(folder, hidden=hidden, rng=rng, **settings), ()


def _wrong_bicycle(rng: np.random.Generator) -> tuple[str, Cause]:
    measured, stated = (str(name) for name in rng.choice(UNRIDDEN[:-1], 2, replace=False))
    return measured, Cause({"wrong_bicycle": {}}, stated=stated)


def modal_wrong_bicycle(folder: Path, rng: np.random.Generator) -> Made:
    """The file states another unridden bicycle, in ``folder``, by ``rng``."""
    measured, cause = _wrong_bicycle(rng)
    return modal_case(folder, hidden=(), rng=rng, noise=_noise(rng), bicycle=measured, cause=cause), ()


def history_wrong_bicycle(folder: Path, rng: np.random.Generator) -> Made:
    """The file states another unridden bicycle, in ``folder``, by ``rng``."""
    measured, cause = _wrong_bicycle(rng)
    return history_case(folder, hidden=(), rng=rng, noise=_noise(rng), bicycle=measured, cause=cause, **SHORT), ()


def history_wrong_sensor(folder: Path, rng: np.random.Generator) -> Made:
    """Gain, delay or bias of one channel, in ``folder``, by ``rng``."""
    cause = causes.draw(causes.SENSORS, rng)
    settings = {"noise": _noise(rng), "nonlinear": _bends(rng, ()), **SHORT}
    return history_case(folder, hidden=(), rng=rng, cause=cause, **settings), ()


def modal_causes(folder: Path, rng: np.random.Generator) -> Made:
    """Luggage, an offset of the speed, another tilt or trail than stated, in ``folder``, by ``rng``."""
    cause = causes.draw(causes.LIBRARY, rng)
    return modal_case(folder, hidden=(), rng=rng, noise=_noise(rng), cause=cause), ()


def history_causes(folder: Path, rng: np.random.Generator) -> Made:
    """The same, friction at the steer, a low-pass or a drift of a channel, in ``folder``, by ``rng``."""
    cause = causes.draw(causes.LIBRARY_HISTORIES, rng)
    return history_case(folder, hidden=(), rng=rng, noise=_noise(rng), cause=cause, **SHORT), ()


def one_speed(folder: Path, rng: np.random.Generator) -> Made:
    """Three kicks within 1 % of one speed, something hidden (half of it no library has), in ``folder``, by ``rng``."""
    settings: dict[str, Any] = {"noise": _noise(rng), "runs": 3, "duration": 3.0, "forced": False}
    hidden, cause = _one(rng), Cause()
    if rng.random() < 0.5:
        hidden, cause = (), causes.draw(causes.OUTSIDE_HISTORIES, rng)
    low, high = HIDDEN[hidden[0]].speeds if hidden else (3.0, 8.0)
    speed = rng.uniform(max(low, 4.5), high)
    speeds = (0.9965 * speed, 1.0035 * speed)
    return history_case(folder, hidden=hidden, rng=rng, cause=cause, speeds=speeds, **settings), ()


def modal_unusual(folder: Path, rng: np.random.Generator) -> Made:
    """One effect, 1.5 to 4 times outside what occurs, in ``folder``, by ``rng``."""
    hidden, noise = _one(rng, UNUSUAL), float(rng.choice(NOISE[:2]))
    return modal_case(folder, hidden=hidden, rng=rng, noise=noise, sizes=UNUSUAL), ()


def history_unusual(folder: Path, rng: np.random.Generator) -> Made:
    """One effect, 1.5 to 4 times outside what occurs, in ``folder``, by ``rng``; runs that grow are cut."""
    hidden, noise = _one(rng, UNUSUAL), float(rng.choice(NOISE[:2]))
    return history_case(folder, hidden=hidden, rng=rng, noise=noise, sizes=UNUSUAL, recording=CUT, **SHORT), ()


def modal_opposed(folder: Path, rng: np.random.Generator) -> Made:
    """Two effects that hide each other (:mod:`.opposed`), in ``folder``, by ``rng``."""
    bicycle, sizes = opposed_pair(rng)
    settings: dict[str, Any] = {"bicycle": bicycle, "sizes": sizes, "noise": QUIET, "points": 16}
    return modal_case(folder, hidden=tuple(sizes), rng=rng, **settings), ()


def history_opposed(folder: Path, rng: np.random.Generator) -> Made:
    """Two effects that hide each other (:mod:`.opposed`), in ``folder``, by ``rng``."""
    bicycle, sizes = opposed_pair(rng)
    settings: dict[str, Any] = {"bicycle": bicycle, "sizes": sizes, "noise": QUIET, "runs": 6, "duration": 3.0}
    return history_case(folder, hidden=tuple(sizes), rng=rng, **settings), ()


def eigenvalues_none(folder: Path, rng: np.random.Generator) -> Made:
    """Eigenvalues without shapes, passive, nothing hidden, in ``folder``, by ``rng``."""
    return modal_case(folder, hidden=(), rng=rng, noise=_noise(rng), ratios=False), ()


def eigenvalues_one(folder: Path, rng: np.random.Generator) -> Made:
    """Eigenvalues without shapes, one effect, in ``folder``, by ``rng``."""
    return modal_case(folder, hidden=_one(rng), rng=rng, noise=_noise(rng), ratios=False), ()


def eigenvalues_offset(folder: Path, rng: np.random.Generator) -> Made:
    """Eigenvalues without shapes, passive, the speed off by 0.1 to 0.4 m/s, in ``folder``, by ``rng``."""
    cause = causes.speed_offset(rng)
    return modal_case(folder, hidden=(), rng=rng, noise=_noise(rng), ratios=False, cause=cause), ()


MAKERS: Mapping[str, Callable[..., Made]] = {
    "modal-none": modal_none,
    "modal-none-tight": modal_none_tight,
    "history-none": history_none,
    "history-none-tight": history_none_tight,
    "modal-one": modal_one,
    "history-one": history_one,
    "modal-pair": modal_pair,
    "modal-outside": modal_outside,
    "history-outside": history_outside,
    "loud-one": loud_one,
    "modal-wrong-bicycle": modal_wrong_bicycle,
    "history-wrong-bicycle": history_wrong_bicycle,
    "history-wrong-sensor": history_wrong_sensor,
    "modal-causes": modal_causes,
    "history-causes": history_causes,
    "one-speed": one_speed,
    "modal-unusual": modal_unusual,
    "history-unusual": history_unusual,
    "modal-opposed": modal_opposed,
    "history-opposed": history_opposed,
    "eigenvalues-none": eigenvalues_none,
    "eigenvalues-one": eigenvalues_one,
    "eigenvalues-offset": eigenvalues_offset,
}
CELLS = tuple(MAKERS)
"""In the order of their numbers, which seed them: append, never insert."""


def make(cell: str, seed: int, folder: Path, **further: Any) -> Made:
    """Write a case of ``cell`` and ``seed`` into ``folder``; its truth and the effects taken out of the library."""
    truth, left_out = MAKERS[cell](folder, np.random.default_rng([seed, CELLS.index(cell)]), **further)
    return replace(truth, cell=cell, seed=seed), left_out
