"""Are sensors that flatten or that have two gains found, and sound ones left alone? SYNTHETIC slip sweeps.

Every sweep is drawn anew: load, pressure, stiffness, peak, amplitude, rate, noise, drift, friction, offsets. The
tyre is in turn a Magic Formula, a brush, a brush whose friction falls with the slip, and a hyperbolic tangent. A
fault is put into the recorded channel: soft flattening (tanh beyond an onset of 50 or 70 % of the range, 5, 10 or
20 % missing at its end; and from zero on, which no sweep can tell from a tyre), or two gains of the force cell.
Counted: how often it is named.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import brentq

from tyre.fits import fit_slip_sweep
from tyre.ground import Array, progress_bar
from tyre.recordings import Condition, RigRun
from tyre.rig import (
    LoadCellDrift,
    Noise,
    PlySteer,
    Protocol,
    RigFriction,
    RigTyre,
    TemperatureDrift,
    simulate_sweep,
    synthetic_tyre,
)

MISSING = (0.05, 0.1, 0.2)
ONSETS = (0.0, 0.5, 0.7)
GAINS = (0.02, 0.05, 0.1)
WORDS = {"lateral_force": "that of lateral_force", "slip_angle": "that of slip_angle", "gain": "a larger gain"}


@dataclass(frozen=True)
class Brush(RigTyre):
    """Parabolic pressure and one friction (Pacejka, *Tire and Vehicle Dynamics*, 3rd ed., section 3.2)."""

    fading: float = 0.0

    def steady_force(self, slip: Array) -> Array:
        """Lateral force, N (n,), at ``slip`` (n,), rad."""
        x = slip + self.offset_slip
        peak = self.peak_force * (1.0 + self.fading * (1.0 - np.abs(np.tanh(3.0 * x))))
        left = 1.0 - np.minimum(self.cornering_stiffness * np.abs(np.tan(x)) / (3.0 * peak), 1.0)
        return np.asarray(self.offset_force + np.sign(x) * peak * (1.0 - left**3))


@dataclass(frozen=True)
class Tangent(RigTyre):
    """F = D tanh(C tan(x) / D): a plain saturation."""

    def steady_force(self, slip: Array) -> Array:
        """Lateral force, N (n,), at ``slip`` (n,), rad."""
        steep = self.cornering_stiffness * np.tan(slip + self.offset_slip) / self.peak_force
        return np.asarray(self.offset_force + self.peak_force * np.tanh(steep))


TYRES: dict[str, Callable[..., RigTyre]] = {
    "magic formula": RigTyre, "brush": Brush, "fading brush": lambda **keys: Brush(fading=0.1, **keys), "tanh": Tangent,
}  # fmt: skip


def run(*, out: Path, seed: int, clean: int = 100, faulty: int = 40) -> dict[str, Any]:
    """Count false alarms and finds."""
    rng = np.random.default_rng(seed)
    alarms = {
        name: [told(sweep(rng, tyre)) for _ in progress_bar(range(clean), total=clean, desc=name)]
        for name, tyre in TYRES.items()
    }
    every = [names for some in alarms.values() for names in some]
    kinds = (TYRES["magic formula"], TYRES["brush"])

    def found(spoil: Callable[..., RigRun], *words: str, **fault: Any) -> dict[str, float]:
        names = [told(spoil(sweep(rng, kinds[number % 2]), **fault)) for number in range(faulty)]
        return {f"{word or 'any_fault'}_percent": _percent(names, word) for word in words}

    return {
        "sound_sweeps": len(every),
        "false_alarms_percent": {
            "flattening": _percent(every, "flattens"), "gain": _percent(every, "gain"),
            **{name: _percent(names, "") for name, names in alarms.items()},
        },
        "found": {
            f"{channel} flattens from {onset:.0%} of its range on": {
                f"{missing:.0%}": found(
                    flattened, channel, "flattens", channel=channel, onset=onset, missing=missing
                )
                for missing in MISSING
            }
            for channel in ("lateral_force", "slip_angle") for onset in ONSETS
        } | {"two gains of the force cell": {
            f"{gain:.0%}": found(two_gains, "gain", "", difference=gain) for gain in GAINS
        }},
    }  # fmt: skip


def sweep(rng: np.random.Generator, tyre: Callable[..., RigTyre]) -> RigRun:
    """A sound sweep of a drawn tyre on a rig of the usual faults."""
    load, pressure = float(round(rng.uniform(250, 600))), float(rng.uniform(3e5, 8e5))
    usual = synthetic_tyre(load=load, pressure=pressure)
    drawn = tyre(
        cornering_stiffness=usual.cornering_stiffness * rng.uniform(0.7, 1.3),
        lateral_stiffness=usual.lateral_stiffness * rng.uniform(0.7, 1.3),
        peak_force=load * rng.uniform(0.75, 1.2), shape=rng.uniform(1.2, 1.7), curvature=rng.uniform(-1.0, 0.6),
    )  # fmt: skip
    effects = [
        PlySteer(force=rng.uniform(-10.0, 25.0), slip=np.deg2rad(rng.uniform(-0.3, 0.3))),
        TemperatureDrift(rise=rng.uniform(0.0, 4.0), per_kelvin=rng.uniform(-0.003, -0.001)),
        RigFriction(force=rng.uniform(0.5, 3.0), presliding=rng.uniform(2e-5, 1e-4)),
        LoadCellDrift(rate=rng.normal(0.0, 3.0)),
        Noise(
            white=rng.uniform(1.5, 4.0), correlated=rng.uniform(0.5, 2.5),
            correlation_time=10 ** rng.uniform(-1.0, -0.3),
        ),
    ]  # fmt: skip
    protocol = Protocol(
        slip_rate=float(np.deg2rad(rng.uniform(0.8, 2.5))), cycles=int(rng.integers(2, 5)),
        slip_amplitude=float(np.deg2rad(rng.uniform(3.0, 8.0))),
    )  # fmt: skip
    condition = Condition(tyre="Synthetic", load=load, pressure=pressure, surface="flat", temperature=22.0)
    return simulate_sweep(tyre=drawn, condition=condition, protocol=protocol, effects=effects, rng=rng)


def flattened(run: RigRun, channel: str, onset: float, missing: float) -> RigRun:
    """A recording whose ``channel`` reads onset + w tanh((x - onset) / w) beyond an onset."""
    true = getattr(run, channel)
    end = float(np.quantile(np.abs(true), 0.995))
    way = (1.0 - onset) * end
    width = brentq(lambda w: way - w * np.tanh(way / w) - missing * end, 1e-3 * way, 1e3 * way)
    beyond = np.clip(np.abs(true) - onset * end, 0.0, None)
    return replace(
        run, **{channel: np.sign(true) * (np.minimum(np.abs(true), onset * end) + width * np.tanh(beyond / width))}
    )


def two_gains(run: RigRun, difference: float) -> RigRun:
    """A recording whose force cell reads more to the right than to the left."""
    return replace(run, lateral_force=run.lateral_force * (1.0 + np.sign(run.lateral_force) * difference / 2.0))


def told(run: RigRun) -> tuple[str, ...]:
    """What the fit of ``run`` says of its sensors."""
    return fit_slip_sweep(run).sensor_faults


def _percent(names: list[tuple[str, ...]], word: str) -> float:
    word = WORDS.get(word, word)
    return round(100.0 * float(np.mean([any(word in text for text in texts) for texts in names])), 2)
