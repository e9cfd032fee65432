"""How a rig effect enters a fit to recordings: its parameters, and what they add to a slip sweep or to a pull.

A batch of K parameter values is computed at once: contributions are arrays (K,).
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from tyre.base.arrays import Array

Contribution = Array | float


@dataclass(frozen=True)
class RigParameter:
    """A number of a rig effect.

    Attributes
    ----------
    name, unit : str
        The unit in SI; ``1`` of a pure number.
    typical : tuple of float
        Range that occurs; a size begins or ends at, or goes through, zero.
    bounds : tuple of float
        What is possible.
    size : bool
        The effect is absent at zero; otherwise the number is positive and its logarithm is fitted.
    least : float
        Smallest size that is worth a name in a diagnosis; 0: any.
    """

    name: str
    unit: str
    typical: tuple[float, float]
    bounds: tuple[float, float] = (-math.inf, math.inf)
    size: bool = True
    least: float = 0.0


@dataclass(frozen=True)
class Recorded:
    """What recordings have and a reference knows: it decides which terms can be told.

    Attributes
    ----------
    sweeps, pulls : bool
        Whether there are slip sweeps, pull tests.
    both_branches : bool
        Slip both rises and falls.
    both_signs : bool
        A sweep has slip angles of either sign.
    speeds : bool
        Every sweep has its rolling speed.
    other_track : bool
        The track is curved otherwise than that of the reference.
    other_loads : bool
        There is a load that the reference does not have.
    known : mapping
        (value, sd), SI, by the name of a parameter whose size needs no fit.
    """

    sweeps: bool = True
    pulls: bool = True
    both_branches: bool = True
    both_signs: bool = True
    speeds: bool = True
    other_track: bool = True
    other_loads: bool = True
    known: Mapping[str, tuple[float, float]] = field(default_factory=dict)


@dataclass
class SweepTerms:
    """What is added to a slip sweep, beside the condition it was recorded in.

    Attributes
    ----------
    load : float
        N.
    load_ratio : float
        Load over that of the reference.
    track_curvature : float
        ln(1 + R / R_drum) less that of the reference.
    log_stiffness : array or float
        ln of the factor on cornering stiffness and relaxation length.
    load_gain, force_gain, slip_gain : array or float
        True over indicated load, indicated over true force and slip, less one.
    gain_by_sign : array or float
        Gain of the indicated force to the right less that to the left.
    slip_offset, half_gap : array or float
        rad of true slip: of the whole curve, and by which the wheel stays behind the sensor.
    side_force : array or float
        N, of the tyre: it changes its sign with the tyre turned round.
    asymmetry : array or float
        N/rad^2.
    delay : array or float
        s.
    warming : array or float
        Relative change of the force from the begin of the recording to its end.
    relaxation_length : array or float, optional
        m, at the first sweep of the recordings; None: the force does not lag.
    compliance : array or float
        m/N, in series with the tyre.
    """

    load: float
    load_ratio: float
    track_curvature: float
    log_stiffness: Contribution = 0.0
    load_gain: Contribution = 0.0
    force_gain: Contribution = 0.0
    slip_gain: Contribution = 0.0
    gain_by_sign: Contribution = 0.0
    slip_offset: Contribution = 0.0
    half_gap: Contribution = 0.0
    side_force: Contribution = 0.0
    asymmetry: Contribution = 0.0
    delay: Contribution = 0.0
    warming: Contribution = 0.0
    relaxation_length: Contribution | None = None
    compliance: Contribution = 0.0

    def add(self, **contributions: Contribution) -> None:
        """Add to ``contributions`` by name."""
        _add(self, contributions)


@dataclass
class PullTerms:
    """What is added to a static pull of the ``displacement`` (n,), m.

    Attributes
    ----------
    displacement : ndarray, shape (n,)
        As indicated, m.
    force_gain, displacement_gain : array or float
        Indicated over true, less one.
    compliance : array or float
        m/N, in series with the tyre.
    bend : array or float
        Share by which the pull is softer at its largest displacement.
    force : array or float, shape (K, n)
        N.
    """

    displacement: Array
    force_gain: Contribution = 0.0
    displacement_gain: Contribution = 0.0
    compliance: Contribution = 0.0
    bend: Contribution = 0.0
    force: Contribution = 0.0

    def add(self, **contributions: Contribution) -> None:
        """Add to ``contributions`` by name."""
        _add(self, contributions)


def _add(terms: SweepTerms | PullTerms, contributions: Mapping[str, Contribution]) -> None:
    for name, value in contributions.items():
        before = getattr(terms, name)
        setattr(terms, name, value if before is None else before + value)


def _always(recorded: Recorded) -> str:
    return ""


@dataclass(frozen=True)
class Term:
    """A rig effect as a fit sees it.

    Attributes
    ----------
    identifier : str
    signature : str
        What it does to the recordings, in words.
    parameters : tuple of RigParameter
    sweep, pull : callable, optional
        Add the effect to the terms of a sweep or of a pull: called with them and the parameters (K,) by name.
    needs : callable
        Why the effect cannot be told from what is :class:`Recorded`; empty where it can.
    """

    identifier: str
    signature: str
    parameters: tuple[RigParameter, ...]
    sweep: Callable[..., None] | None = None
    pull: Callable[..., None] | None = None
    needs: Callable[[Recorded], str] = _always

    def key(self, parameter: RigParameter) -> str:
        """Name of one ``parameter`` of its own among those of all effects."""
        return f"{self.identifier}.{parameter.name}"

    def add_to(self, terms: SweepTerms | PullTerms, values: Mapping[str, Array]) -> None:
        """Add the effect to the ``terms`` of a sweep or a pull, where ``values`` (K,) by :meth:`key` have it."""
        add = self.sweep if isinstance(terms, SweepTerms) else self.pull
        keys = {p.name: self.key(p) for p in self.parameters}
        if add is not None and all(key in values for key in keys.values()):
            add(terms, **{name: values[key] for name, key in keys.items()})


def needs_sweep(recorded: Recorded) -> str:
    """Why an effect of slip sweeps cannot be told from what is ``recorded``."""
    return "" if recorded.sweeps else "no slip sweep"


def needs_pull(recorded: Recorded) -> str:
    """Why an effect of pull tests cannot be told from what is ``recorded``."""
    return "" if recorded.pulls else "no pull test"
