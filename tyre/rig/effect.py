"""An effect of the rig on its recordings, and the terms that it adds to a fit."""

import importlib
import math
import pkgutil
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar

import numpy as np

from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, is_number, shown
from tyre.recordings.recording import Condition


@dataclass(frozen=True)
class RigTyre:
    """The truth of one tyre at one load and pressure (SI units).

    Steady lateral force Sv + D times the Magic Formula of B x, with x = slip + Sh and B = cornering_stiffness / (C D);
    aligning moment -t (F - Sv) with t = pneumatic_trail / (1 + (x / trail_slip)^2). The slip of a rolling tyre lags.
    """

    cornering_stiffness: float  # N/rad
    lateral_stiffness: float  # N/m
    peak_force: float  # D, N
    shape: float = 1.4  # C and E
    curvature: float = 0.0  # C and E
    pneumatic_trail: float = 0.018  # at zero slip, m
    trail_slip: float = 0.08  # slip at which the trail has halved, rad
    offset_force: float = 0.0  # Sv, N
    offset_slip: float = 0.0  # Sh, rad
    rim_stiffness: float = np.inf  # N/m; inf for a rigid rim
    relaxation: bool = True  # the slip of the rolling tyre lags
    softening: float = 0.0  # share by which a pull is softer at its end

    @property
    def relaxation_length(self) -> float:
        """C / K_y of tyre (and rim in series), m."""
        return self.cornering_stiffness * (1.0 / self.lateral_stiffness + 1.0 / self.rim_stiffness)

    def steady_force(self, slip: Array) -> Array:
        """Lateral force of the steadily rolling tyre, N (n,), at ``slip`` (n,), rad."""
        u = self.cornering_stiffness / (self.shape * self.peak_force) * (slip + self.offset_slip)
        bent = (1.0 - self.curvature) * u + self.curvature * np.arctan(u)
        return np.asarray(self.offset_force + self.peak_force * np.sin(self.shape * np.arctan(bent)))


Contribution = Array | float


@dataclass(frozen=True)
class RigParameter:
    """A number of a rig effect."""

    name: str  # of the field of the effect, or of the term
    unit: str  # SI; ``1`` of a pure number
    typical: tuple[float, float]  # range that occurs; a size begins or ends at, or goes through, zero
    bounds: tuple[float, float] = (-math.inf, math.inf)  # possible values
    size: bool = True  # the effect is absent at zero; otherwise the number is positive and its logarithm is fitted
    least: float = 0.0  # smallest size that is worth a name in a diagnosis; 0: any


@dataclass(frozen=True)
class Recorded:
    """Contents of recordings and of their reference, which decide the terms that can be distinguished."""

    sweeps: bool = True  # there are slip sweeps
    pulls: bool = True  # there are lateral stiffness tests
    both_branches: bool = True  # slip both rises and falls
    both_signs: bool = True  # a sweep has slip angles of either sign
    speeds: bool = True  # every sweep has its rolling speed
    other_track: bool = True  # the track is curved otherwise than that of the reference
    other_loads: bool = True  # there is a load that the reference does not have
    # (value, sd), SI, by the name of a parameter whose size needs no fit
    known: Mapping[str, tuple[float, float]] = field(default_factory=dict)


class _Terms:
    def add(self, **contributions: Contribution) -> None:
        """Add to ``contributions`` by name."""
        for name, value in contributions.items():
            before = getattr(self, name)
            setattr(self, name, value if before is None else before + value)


@dataclass
class SweepTerms(_Terms):
    """Contributions to a slip sweep, in addition to its condition."""

    load: float  # N
    load_ratio: float  # load over that of the reference
    track_curvature: float  # ln(1 + R / R_drum) less that of the reference
    log_stiffness: Contribution = 0.0  # ln of the factor on cornering stiffness and relaxation length
    load_gain: Contribution = 0.0  # true over indicated load, less one
    force_gain: Contribution = 0.0  # indicated over true force, less one
    slip_gain: Contribution = 0.0  # indicated over true slip, less one
    gain_by_sign: Contribution = 0.0  # gain of the indicated force to the right less that to the left
    slip_offset: Contribution = 0.0  # rad of true slip, of the whole curve
    half_gap: Contribution = 0.0  # rad of true slip by which the wheel stays behind the sensor
    lateral_force: Contribution = 0.0  # N, of the tyre: it changes its sign with the tyre turned round
    asymmetry: Contribution = 0.0  # N/rad^2
    delay: Contribution = 0.0  # s
    warming: Contribution = 0.0  # relative change of the force from the begin of the recording to its end
    relaxation_length: Contribution | None = None  # m, at the first sweep; None: the force does not lag
    compliance: Contribution = 0.0  # m/N, in series with the tyre


@dataclass
class PullTerms(_Terms):
    """Contributions to a lateral stiffness test of the ``displacement`` (n,), m."""

    displacement: Array  # (n,), as indicated, m
    force_gain: Contribution = 0.0  # indicated over true, less one
    displacement_gain: Contribution = 0.0  # indicated over true, less one
    compliance: Contribution = 0.0  # m/N, in series with the tyre
    bend: Contribution = 0.0  # share by which the pull is softer at its largest displacement
    force: Contribution = 0.0  # (K, n), N


@dataclass(frozen=True)
class Needs:
    """Reasons why recordings cannot show an effect: the first whose field of :class:`Recorded` is false, else ''."""

    reasons: tuple[tuple[str, str], ...] = ()  # field of :class:`Recorded`, and why its lack hides the effect

    def __call__(self, recorded: Recorded) -> str:
        return next((why for name, why in self.reasons if not getattr(recorded, name)), "")

    def also(self, name: str, why: str) -> "Needs":
        """Return the same needs and one more."""
        return Needs((*self.reasons, (name, why)))


needs_sweep = Needs((("sweeps", "no slip sweep"),))
needs_pull = Needs((("pulls", "no lateral stiffness test"),))


@dataclass(frozen=True)
class Term:
    """A rig effect as a fit sees it.

    ``sweep`` and ``pull`` add it to the terms of a recording: functions of the terms and of the parameters (K,) by
    name, or the name of the contribution that the only parameter is.
    """

    identifier: str  # such as ``slip_scale``
    signature: str  # its trace in the recordings, in words
    parameters: tuple[RigParameter, ...]
    sweep: Callable[..., None] | str | None = None
    pull: Callable[..., None] | str | None = None
    needs: Callable[[Recorded], str] = Needs()  # of what is recorded: why it cannot show the effect, or ''

    def key(self, parameter: RigParameter) -> str:
        """Name of one ``parameter`` of its own among those of all effects."""
        return f"{self.identifier}.{parameter.name}"

    def add_to(self, terms: SweepTerms | PullTerms, values: Mapping[str, Array]) -> None:
        """Add the effect to the ``terms`` of either test, if ``values`` (K,) by :meth:`key` have it."""
        add = self.sweep if isinstance(terms, SweepTerms) else self.pull
        own_values = {p.name: values[key] for p in self.parameters if (key := self.key(p)) in values}
        if add is None or len(own_values) < len(self.parameters):
            return
        if isinstance(add, str):
            terms.add(**dict.fromkeys([add], *own_values.values()))
        else:
            add(terms, **own_values)


Channels = dict[str, Array]
OUTSIDE: dict[str, type["RigEffect"]] = {}  # effects of other packages by identifier; see `register`


def declared(parameter: RigParameter, default: float) -> Any:
    """A field of an effect: the ``parameter`` with the ``default`` (in its unit) of a fair laboratory."""
    return field(default=default, metadata={"parameter": parameter})


@dataclass(frozen=True)
class RigEffect:
    """Base of all rig effects: does nothing."""

    terms: ClassVar[tuple[Term, ...]] = ()

    def __post_init__(self) -> None:
        for p, name in ((f.metadata["parameter"], f.name) for f in fields(self) if "parameter" in f.metadata):
            value, (low, high) = getattr(self, name), p.bounds
            if not is_number(value) or not low <= value <= high:
                allowed = f"a number from {low:g} to {high:g} ({p.unit})"
                raise InputError(f"effect {self.identifier()}: {name} = {shown(value)} must be {allowed}")

    @classmethod
    def identifier(cls) -> str:
        """``load_cell_drift`` of ``LoadCellDrift``."""
        return re.sub(r"(?<!^)(?=[A-Z])", "_", cls.__name__).lower()

    @classmethod
    def simulated(cls) -> bool:
        """True if the simulator knows it."""
        hooks = ("on_tyre", "on_rolling", "on_pull")
        return any(getattr(cls, hook) is not getattr(RigEffect, hook) for hook in hooks)

    def on_tyre(self, tyre: RigTyre, condition: Condition, rng: np.random.Generator) -> RigTyre:
        """Return the ``tyre`` as it behaves on the rig in this recording at a ``condition``; ``rng`` for scatter."""
        return tyre

    def on_rolling(self, channels: Channels, rng: np.random.Generator) -> None:
        """Change the ``channels`` (n,) of a slip sweep or step in place (SI, adapted SAE); ``rng`` for noise."""

    def on_pull(self, channels: Channels, rng: np.random.Generator) -> None:
        """Change the ``channels`` (n,) of a lateral stiffness test in place (SI, adapted SAE); ``rng`` for noise."""


def register(effect: type[RigEffect]) -> type[RigEffect]:
    """Make an ``effect`` of another package known; a decorator."""
    other_effects = [other for other in rig_effects().values() if other is not effect]
    taken_names = {other.identifier() for other in other_effects} | {
        term.identifier for other in other_effects for term in other.terms
    }
    for name in (effect.identifier(), *(term.identifier for term in effect.terms)):
        if name in taken_names:
            raise InputError(f"a rig effect or term {name!r} exists already; give {effect.__name__} another name")
    OUTSIDE[effect.identifier()] = effect
    return effect


def rig_effects() -> dict[str, type[RigEffect]]:
    """Every rig effect by its identifier, sorted."""
    package = importlib.import_module("tyre.rig.effects")
    effects = dict(OUTSIDE)
    for info in pkgutil.iter_modules(package.__path__):
        module = importlib.import_module(f"{package.__name__}.{info.name}")
        classes = (
            member for member in vars(module).values() if isinstance(member, type) and issubclass(member, RigEffect)
        )
        effects |= {effect.identifier(): effect for effect in classes if effect.__module__ == module.__name__}
    return dict(sorted(effects.items()))


def simulated_effects() -> dict[str, type[RigEffect]]:
    """Return the effects that the simulator knows."""
    return {name: effect for name, effect in rig_effects().items() if effect.simulated()}


def rig_terms() -> tuple[Term, ...]:
    """Return the terms of all effects, which a diagnosis of recordings tries."""
    return tuple(term for effect in rig_effects().values() for term in effect.terms)
