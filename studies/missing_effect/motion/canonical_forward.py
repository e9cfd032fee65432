"""The same engine on identified canonical coefficients: what the identification would give for a model with effects.

The identification (:mod:`.canonical_identification`) is applied to the model's own harmonic
motion. An effect that keeps the form of the equations gives its coefficients exactly (a spring k: K0 of delta,delta
+ k/g); slip, lags, hinges and dampers give effective ones, the best of the equation error.

The motion: at every speed and frequency (equal weights, frequencies spaced in the logarithm) once the rider steers and
nobody pushes, once a lateral force pushes and the steering is held, the two uncorrelated. Steering prescribed, not its
torque, keeps the bicycle's own resonances out of the weights.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from bicycle.effect import Effect, registry
from bicycle.eigenvalues.oscillation import angular_frequency
from bicycle.identification.canonical import Canonical, Motion, identify
from bicycle.model import Model
from studies.inference.folds import MOST_FOLDS
from studies.inference.forward import ProposedMeasurement, Rows, Series
from studies.inference.parameter import Candidate
from studies.missing_effect.motion.bicycle_forward import BicycleForward
from studies.missing_effect.motion.candidates import SINGULAR, least_coordinate
from studies.missing_effect.motion.canonical_table import COEFFICIENTS, CanonicalTable, unit
from studies.missing_effect.motion.sensor_errors import DELAY, GAIN, delay_error, gain_error, speed_errors
from tyre.base.arrays import Array, Complex

FREQUENCIES = 16
STEER_RATE, FORCE = 0.3, 20.0  # rad/s and N at each frequency; only their ratio counts
SENSORS = ("lean", "steer", "steer_torque", "lateral_force")


def sensor_candidates(speeds: Sequence[float]) -> tuple[Candidate, ...]:
    """What may be wrong with the recordings: the speed, gain and delay of each signal (a delay of all does nothing).

    Parameters
    ----------
    speeds : sequence of float
        At which the identification is imitated, m/s.
    """
    found = [*speed_errors(speeds)]
    for name in SENSORS:
        found += [gain_error(name, name), delay_error(name, name)]
    return tuple(found)


@dataclass(frozen=True, kw_only=True)
class CanonicalForward(BicycleForward):
    """The forward model of identified coefficients (see :class:`studies.inference.forward.Forward`).

    Prediction of a subset: Whipple's coefficients of its rider, as the table has them, plus the change that the model
    shows from its own Whipple coefficients; the change of H of delta,F goes with the place of the force, thus with H.
    """

    thorough = True
    table: CanonicalTable
    barred: tuple[str, ...] = ()

    @classmethod
    def of_table(cls, table: CanonicalTable, without: tuple[str, ...], **rest: Any) -> "CanonicalForward":
        """The forward model of a table, without what is part of what was measured.

        Parameters
        ----------
        table : CanonicalTable
        without : tuple of str
            Effects that are not tried.
        rest
            Fields of :class:`BicycleForward`.
        """
        inside = {name: why for name, effect in registry().items() if (why := measured_with(effect))}
        rest["candidates"] = tuple(with_compliance(c) for c in rest["candidates"] if c.identifier not in inside)
        rest["refused"] = {**rest["refused"], **inside}
        return cls(table=table, barred=(*inside, *without), **rest)

    @cached_property
    def whipple(self) -> Canonical:
        """The bicycle's own Whipple coefficients: what the identification holds fixed."""
        return Canonical.of_whipple(self.base)

    @cached_property
    def rows(self) -> Rows:
        """Labels of the residuals, coefficient by coefficient; each subset is held out."""
        subsets = self.table.subsets
        where = tuple(f"{name}, {subset}" for name in COEFFICIENTS for subset in subsets)
        series = tuple(name for name in COEFFICIENTS for _ in subsets)
        shown = {name: Series(name, unit(name)) for name in COEFFICIENTS}
        number = np.tile(np.arange(len(subsets), dtype=float), len(COEFFICIENTS))
        return Rows(where, number, series, number.astype(np.intp) % MOST_FOLDS, condition=subsets, shown=shown)

    def coefficients(self, candidates: tuple[Candidate, ...], theta: Array) -> Array:
        """What the identification would give (K, 9) with ``candidates`` at the coordinates ``theta`` (K, p).

        Those behind the first are a stencil about it.
        """
        return identify(self._motion(candidates, theta), self.whipple)

    def _motion(self, candidates: tuple[Candidate, ...], theta: Array) -> Motion:
        family, speeds = self.family(candidates), np.array(self.table.speeds)
        names, omega = family.symbolic, angular_frequency(np.geomspace(*self.table.band, FREQUENCIES))
        response = family(theta, speeds).responses_about_the_first(  # (K, speeds, frequencies, lean and steer, inputs)
            omega, inputs=[names.inputs.index(name) for name in ("steer_torque", "lateral_force")],
            outputs=[names.outputs.index(name) for name in ("lean", "steer")],
        )  # fmt: skip
        steer, force = np.zeros((2, *omega.shape, 2))
        steer[:, 0], force[:, 1] = STEER_RATE / omega, FORCE
        torque = (steer - response[..., 1, 1, None] * force) / response[..., 1, 0, None]
        lean = response[..., 0, 0, None] * torque + response[..., 0, 1, None] * force
        values = family.values(theta)
        s = 1j * omega[:, None]

        def recorded(name: str, signal: Complex | Array) -> Complex:
            gain, delay = (values.get(key.format(name), np.zeros((1, 1)))[..., None, None] for key in (GAIN, DELAY))
            return np.asarray(np.broadcast_to((1 + gain) * np.exp(-s * delay) * signal, lean.shape))

        return Motion(
            recorded("lean", lean), recorded("steer", steer), recorded("steer_torque", torque),
            recorded("lateral_force", force), np.asarray(s), speeds[:, None, None],
        )  # fmt: skip

    @cached_property
    def _base(self) -> tuple[Array, Array]:
        """Whipple's coefficients of each subset, and how a change carries over to it; (subsets, 9)."""
        own = self.whipple.free
        carried = np.ones((len(self.table.subsets), len(own)))
        if self.table.whipple is None:
            return np.broadcast_to(own, carried.shape), carried
        carried[:, -1] = self.table.whipple[:, -1] / own[-1]
        return self.table.whipple, carried

    def residual(self, candidates: tuple[Candidate, ...], theta: Array, *, slopes: bool = True) -> tuple[Array, Array]:
        """(identified - computed) / sd (n,) and its derivative (n, p). Arguments as :meth:`.Forward.residual`."""
        batch, steps = self.family(candidates).stencil(theta) if slopes else (theta[None], theta[:0])
        base, carried = self._base
        change = self.coefficients(candidates, batch) - self.whipple.free
        computed = base + carried * change[:, None]  # (K, subsets, 9)
        p = len(steps)
        slope = (computed[1 : p + 1] - computed[p + 1 :]) / (2 * steps[:, None, None])
        residual = (self.table.value - computed[0]) / self.table.sd
        return residual.T.ravel(), -(slope / self.table.sd).T.reshape(residual.size, p)

    def enabled_by(self, candidates: tuple[Candidate, ...]) -> tuple[Candidate, ...]:
        """Candidates that these ``candidates`` make possible, without those that are barred."""
        return tuple(c for c in super().enabled_by(candidates) if c.identifier not in self.barred)

    @property
    def measured(self) -> tuple[Array, Array]:
        """Identified values and their sd, (n,)."""
        return self.table.value.T.ravel(), self.table.sd.T.ravel()

    def proposed(self) -> tuple[ProposedMeasurement, ...]:
        """Forced responses at the highest speed and above."""
        return self.forced(max(self.table.speeds))


def with_compliance(candidate: Candidate) -> Candidate:
    """A ``candidate`` tyre in place of rolling without slip, by its compliance 1/C.

    The slip is gone at zero, where a search begins.

    Prior as for every effect that is gone at infinity: half the compliance of the softest typical tyre is one sigma.
    """
    if candidate.replaces is None or candidate.effect is None:
        return candidate
    softest = {p.name: p.typical[0] for p in candidate.effect.parameters}
    stiffest = {p.name: least_coordinate(p, reciprocal=True) for p in candidate.effect.parameters}
    found = []
    for u in candidate.unknowns:
        if u.name == "cornering_stiffness":
            scale = 0.5 / softest[u.name]
            u = replace(
                u, centre=0.0, scale=scale, lowest=SINGULAR * scale, highest=math.inf, power=-1, size=True,
                least=stiffest[u.name],
            )  # fmt: skip
        found.append(u)
    return replace(candidate, unknowns=tuple(found))


def measured_with(effect: type[Effect]) -> str:
    """Why an ``effect`` is part of what was measured, in words; empty where it is not."""
    through = effect.acts_through
    return f"it acts through the {through.replace('_', ' ')}, which was measured" if through in SENSORS else ""


def assumed(model: Model, table: CanonicalTable) -> tuple[str, ...]:
    """What is assumed of the motion of a ``table`` and of the bicycle of its base ``model``, in words."""
    speeds = ", ".join(f"{v:g}" for v in table.speeds)
    found = [
        f"the identification is imitated at {speeds} m/s, {table.band[0]:g}-{table.band[1]:g} Hz, with uncorrelated "
        f"steering ({STEER_RATE:g} rad/s) and lateral force ({FORCE:g} N) at each frequency and signals free of noise"
    ]
    if table.whipple is not None:
        away = np.abs(table.whipple / Canonical.of_whipple(model).free - 1)[:, :-1].max(1)
        far = ", ".join(f"{name} {share:.1%}" for name, share in zip(table.subsets, away, strict=True))
        found.append(
            "the base of each subset is its rider's Whipple coefficients as the table implies them; the bicycle only "
            f"gives the change. It differs from them, at most (without H_delta_F): {far}"
        )
    return tuple(found)
