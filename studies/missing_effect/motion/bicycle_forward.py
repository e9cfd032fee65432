"""What the forward models of the bicycle share: the base model, its nuisances and its candidates."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bicycle.effect.files import Origin
from bicycle.eigenvalues.decomposition import eigensystem
from bicycle.eigenvalues.oscillation import angular_frequency
from bicycle.model import Model, check_compatible
from studies.inference.forward import ForwardModel, ProposedMeasurement
from studies.inference.parameter import Candidate, UncertainParameter, central_differences
from studies.missing_effect.motion.candidates import LEFT_OUT, find_candidates, physical
from studies.missing_effect.motion.family import Family
from studies.missing_effect.motion.phenomenological_terms import feedback_terms, reversed_signs
from tyre.base.arrays import Array
from tyre.base.errors import InputError

SPEED_AXIS = "speed, m/s"
FORCED = "swept steer torque"
FORCED_SPEEDS = (1.0, 1.25)  # of the fastest measured speed: what reached that seldom goes much faster
FORCED_HZ = np.geomspace(0.5, 4.0, 6)
FORCED_OUTPUTS = ("lean_rate", "steer", "yaw_rate")
FORCED_SD = 0.05  # of the magnitude of a frequency response, and of a tenth of its peak
MOST_GROWTH = 0.5  # 1/s; what grows faster is not held up while the torque sweeps


@dataclass(frozen=True, eq=False)
class ForcedResponse(ProposedMeasurement):
    """Frequency responses to steer torque at a ``speed`` (m/s)."""

    speed: float


@dataclass(frozen=True, kw_only=True)
class BicycleForward(ForwardModel):
    """What the forward models of the bicycle share.

    Attributes
    ----------
    base : Model
    nuisances : tuple of UncertainParameter
        What floats in every fit.
    candidates : tuple of Candidate
    refused : mapping
        Effects that are not tried, and why.
    notes : tuple of str
        For the report.
    """

    base: Model
    nuisances: tuple[UncertainParameter, ...]
    candidates: tuple[Candidate, ...]
    refused: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse an effect from outside that is called as another candidate, such as an error of the measurement.

        Raises
        ------
        InputError
            Naming it.
        """
        count = Counter(c.identifier for c in self.candidates)
        for c in self.candidates:
            if c.effect is not None and count[c.identifier] > 1:
                raise InputError(
                    f"the effect {c.identifier!r} of {Origin.of(c.effect).file or c.effect.__module__} has "
                    "the name of something that may be wrong with a measurement or its files; give it another"
                )

    def family(self, candidates: tuple[Candidate, ...]) -> Family:
        """The base model with ``candidates``."""
        return Family(self.base, self.nuisances, candidates)

    def compatible(self, candidates: tuple[Candidate, ...]) -> bool:
        """Whether these ``candidates`` make a model together; a drift is a bias already."""
        if {"bias", "drift"} <= {c.identifier for c in candidates}:
            return False
        gone = {c.replaces for c in candidates}
        kinds = [e for e in self.base.effects if e.identifier not in gone]
        kinds += [c.effect.__new__(c.effect) for c in candidates if c.effect is not None]
        try:
            check_compatible(tuple(kinds))
        except InputError:
            return False
        return True

    def enabled_by(self, candidates: tuple[Candidate, ...]) -> tuple[Candidate, ...]:
        """Candidates that these ``candidates`` make possible."""
        if all(c.effect is None or not c.effect.provides for c in candidates):
            return ()
        model = self.base
        for c in candidates:
            if c.effect is not None:
                model = model.with_effect(physical(c, list(c.starts[1])))
        wanted = {name for name, why in self.refused.items() if why != LEFT_OUT}
        return tuple(c for c in find_candidates(model, {})[0] if c.identifier in wanted and c.replaces is None)

    def phenomenological(self) -> tuple[Candidate, ...]:
        """Steer torque proportional to lean, steer and their rates, and effects with the unphysical sign."""
        return (*self.directions(), *reversed_signs(self.candidates))

    def directions(self) -> tuple[Candidate, ...]:
        """Steer and lean torque proportional to lean, steer and their rates."""
        return feedback_terms()

    def forced(self, fastest: float) -> tuple[ForcedResponse, ...]:
        """Frequency responses to steer torque at the ``fastest`` measured speed (m/s) and above, where it stays up."""
        nominal, proposals = np.array([u.centre for u in self.nuisances]), []
        for speed in (factor * fastest for factor in FORCED_SPEEDS):
            system = self.family(())(nominal[None], np.array([speed]))
            if eigensystem(system.dynamics[0], mass=system.mass[0]).values.real.max() > MOST_GROWTH:
                continue
            size = np.abs(self._response((), nominal[None], speed)[0])
            sd = FORCED_SD * (size + 0.1 * size.max(0)).ravel()
            low, high = FORCED_HZ[[0, -1]]
            what = f"{FORCED}, {low:g}-{high:g} Hz, at {speed:.3g} m/s (lean rate, steer, yaw rate)"
            proposals.append(ForcedResponse(what, np.repeat(sd, 2), speed))
        return tuple(proposals)

    def predict(
        self, proposal: ProposedMeasurement, candidates: tuple[Candidate, ...], theta: Array
    ) -> tuple[Array, Array]:
        """Whitened real and imaginary parts (m,) of the responses of :meth:`forced` at ``theta`` (p,), slopes (m, p).

        Arguments as :meth:`studies.inference.forward.Forward.predict`.
        """
        assert isinstance(proposal, ForcedResponse)
        batch, steps = self.family(candidates).stencil(theta)
        every = self._response(candidates, batch, proposal.speed).reshape(len(batch), -1)
        parts = np.stack([every.real, every.imag], -1).reshape(len(batch), -1) / proposal.sd
        return parts[0], central_differences(parts, steps)

    def _response(self, candidates: tuple[Candidate, ...], theta: Array, speed: float) -> NDArray[np.complex128]:
        """C (i w E - F)^-1 B at a stencil of coordinates (K, p): (K, frequencies, outputs), per N m of steer torque."""
        family = self.family(candidates)
        names, system = family.symbolic, family(theta, np.array([speed]))
        gains = system.responses_about_the_first(
            angular_frequency(FORCED_HZ), inputs=[names.inputs.index("steer_torque")],
            outputs=[names.outputs.index(name) for name in FORCED_OUTPUTS],
        )  # fmt: skip
        return np.asarray(gains[:, 0, ..., 0])
