"""The forward model of bench tests: torques at the bar of a bicycle at rest."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from studies.inference.folds import folds
from studies.inference.forward import ProposedMeasurement, Rows, Series
from studies.inference.parameter import Candidate, central_differences
from studies.missing_effect.bench.candidates import UNSEEN, at_rest, unseen
from studies.missing_effect.bench.steering import Setup, torques
from studies.missing_effect.bench.table import CONDITIONS, Reading
from studies.missing_effect.motion.bicycle_forward import BicycleForward
from studies.missing_effect.motion.family import Family
from studies.missing_effect.motion.phenomenological_terms import feedback_terms
from tyre.base.arrays import Array

ANGLES = (-0.2, -0.1, 0.0, 0.1, 0.2)  # rad, of proposed tests
RATES = (-2.0, -1.0, 1.0, 2.0)  # rad/s
SAME = 1e-9  # of an sd: an effect that changes less is not seen


@dataclass(frozen=True, eq=False)
class FurtherTest(ProposedMeasurement):
    """A bench test that was not made."""

    setup: Setup


@dataclass(frozen=True, kw_only=True)
class BenchForward(BicycleForward):
    """The forward model of bench tests (see :class:`studies.inference.forward.Forward`): ``readings`` as taken."""

    thorough = True
    readings: tuple[Reading, ...]

    @classmethod
    def of_readings(cls, readings: tuple[Reading, ...], **rest: Any) -> "BenchForward":
        """The forward model of ``readings``, without effects that they cannot show.

        Parameters
        ----------
        readings : tuple of Reading
        rest
            Fields of :class:`BicycleForward`.
        """
        every = rest.pop("candidates")
        acting = tuple(c for c in every if c.effect is None or not unseen(c.effect))
        forward = cls(readings=readings, candidates=acting, **rest)
        seen = tuple(c for c in acting if c.effect is None or forward.shows(c))
        hidden = {c.identifier: UNSEEN for c in acting if c not in seen}
        return cls(readings=readings, candidates=seen, **{**rest, "refused": {**rest["refused"], **hidden}})

    def shows(self, candidate: Candidate) -> bool:
        """Whether a ``candidate`` changes what would have been read."""
        nominal = [u.centre for u in self.nuisances]
        with_it, without = (
            torques(self.family((candidate,)), self.setup, np.array([[*nominal, *coordinates]]))
            for coordinates in (candidate.starts[1], candidate.neutral)
        )
        return bool((np.abs(with_it - without) > SAME * self.measured[1]).any())

    @cached_property
    def standing(self) -> tuple[Any, tuple[tuple[str, float], ...]]:
        """The base model at rest, and the parameters that have no part in it."""
        model = at_rest(self.base)
        rest = tuple((key, value) for key, value in self.base.parameters.items() if key not in model.parameters)
        return model, rest

    @cached_property
    def setup(self) -> Setup:
        """The states of the readings."""
        return Setup(self.readings)

    def family(self, candidates: tuple[Candidate, ...]) -> Family:
        """The base model at rest, with ``candidates``."""
        model, rest = self.standing
        return Family(model, self.nuisances, candidates, settings=rest)

    @property
    def varied(self) -> bool:
        """Whether the readings are at two angles or rates."""
        return bool(np.ptp(self.setup.steer) > 0 or np.ptp(self.setup.rate) > 0)

    @cached_property
    def measured(self) -> tuple[Array, Array]:
        """Torques that were read and their sd, (n,), N m."""
        return np.array([r.torque for r in self.readings]), np.array([r.sd for r in self.readings])

    @cached_property
    def rows(self) -> Rows:
        """Labels of the residuals: a series is a test in one condition and direction, along angle or rate."""
        where, series, place, group = [], [], [], []
        shown: dict[str, Series] = {}
        for r in self.readings:
            channel = f"{r.test}, {r.condition.replace('_', ' ')}"
            turned = {1.0: ", up", -1.0: ", down", 0.0: ""}[r.direction]
            rated = r.test == "damper"
            name = f"{channel}{turned}"
            shown[name] = Series(name, "torque, N m", "steer rate, rad/s" if rated else "steer angle, rad")
            at = f"{r.rate:g} rad/s" if rated else f"{r.steer:.3g} rad"
            where.append(f"{name}, {at}")
            series.append(name)
            place.append(r.rate if rated else r.steer)
            group.append(r.group or channel)
        fold = folds(group, place, [f"{k:06d}" for k in range(len(place))])
        return Rows(tuple(where), np.array(place), tuple(series), fold, shown=shown, axis="steer angle, rad")

    def residual(self, candidates: tuple[Candidate, ...], theta: Array, *, slopes: bool = True) -> tuple[Array, Array]:
        """(measured - computed) / sd (n,) and its derivative (n, p). Arguments as :meth:`.Forward.residual`."""
        computed, slope = self._torques(self.setup, candidates, theta, slopes=slopes)
        measured, sd = self.measured
        return (measured - computed) / sd, -slope / sd[:, None]

    def _torques(
        self, setup: Setup, candidates: tuple[Candidate, ...], theta: Array, *, slopes: bool = True
    ) -> tuple[Array, Array]:
        family = self.family(candidates)
        batch, steps = family.stencil(theta) if slopes else (theta[None], theta[:0])
        every = torques(family, setup, batch)
        return every[0], central_differences(every, steps)

    def enabled_by(self, candidates: tuple[Candidate, ...]) -> tuple[Candidate, ...]:
        """None, whatever the ``candidates``: a tyre force makes nothing possible at rest."""
        return ()

    def phenomenological(self) -> tuple[Candidate, ...]:
        """Those of :meth:`directions`."""
        return self.directions()

    def directions(self) -> tuple[Candidate, ...]:
        """Steer torque proportional to the steer angle and rate."""
        return tuple(c for c in feedback_terms() if c.identifier.startswith("steer torque from steer"))

    def proposed(self) -> tuple[ProposedMeasurement, ...]:
        """Tests that were not made: a slow sweep and steady rates with the wheel lifted, a sweep on a free plate."""
        made = {(r.test, r.condition) for r in self.readings}
        sd, found = float(np.median(self.measured[1])), []
        for test, condition in (("sweep", "lifted"), ("damper", "lifted"), ("sweep", "free_plate")):
            if (test, condition) in made:
                continue
            states = [(x, 0.0, d) for x in ANGLES for d in (1.0, -1.0)]
            what = f"a slow sweep of the steer angle up and down, {ANGLES[-1]:g} rad to each side"
            if test == "damper":
                states = [(0.0, rate, np.sign(rate)) for rate in RATES]
                what = f"the torque at steady steer rates up to {RATES[-1]:g} rad/s"
            setup = Setup([Reading(test, condition, x, rate, float(d), 0.0, sd) for x, rate, d in states])
            found.append(FurtherTest(f"{what}, {CONDITIONS[condition]}", np.full(len(states), sd), setup))
        return tuple(found)

    def predict(
        self, proposal: ProposedMeasurement, candidates: tuple[Candidate, ...], theta: Array
    ) -> tuple[Array, Array]:
        """Whitened prediction of a further test at ``theta`` (p,).

        Arguments as :meth:`studies.inference.forward.Forward.predict`.
        """
        assert isinstance(proposal, FurtherTest)
        computed, slope = self._torques(proposal.setup, candidates, theta)
        return computed / proposal.sd, slope / proposal.sd[:, None]
