"""Measured uncertainty carried to frequency, damping ratio and critical speeds, linearly and by Monte Carlo."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from bicycle.critical.critical_speed import CriticalSpeed, CrossingIdentity, identified
from bicycle.critical.critical_speeds import critical_speeds
from bicycle.critical.followed import follow_crossing
from bicycle.default_sd import EXACT, GIVEN
from bicycle.eigenvalues.oscillation import damping_ratio, frequency_hz, oscillating
from bicycle.eigenvalues.solvers import eigenvalues
from bicycle.modal.matching import assign
from bicycle.modal.named_modes import modes
from bicycle.parameter_covariance import ParameterCovariance
from bicycle.sensitivity.eigenvalue_derivatives import critical_speed_sensitivities, sensitivities
from bicycle.sensitivity.propagation import damping_ratio_gradient, frequency_gradient
from studies.uncertainty.quantity import Quantity
from studies.uncertainty.uncertain_model import UncertainModel
from tyre.base.arrays import Array

CONTINUATION = 32  # steps
LOOK = 0.5  # m/s between the speeds at which unstable roots are counted
LOST = complex(np.nan, np.nan)
LOOKED_AT = 64  # bicycles at a time


class Uncertainty(UncertainModel):
    """An uncertain model and the quantities that follow from it."""

    @property
    def given_anew(self) -> tuple[list[str], ParameterCovariance]:
        """Parameters whose stated covariance does not hold, as their sd is given; and that covariance."""
        stated = self._stated.covariance
        origin = {key: deviation.origin for key, deviation in self._own.items()}
        return [name for name in stated.names if self._stated.sd[name] and origin.get(name) in (GIVEN, EXACT)], stated

    def quantities(
        self,
        speeds: Array,
        *,
        max_speed: float = 60.0,
        samples: int = 2000,
        seed: int = 0,
        only: Collection[str] | None = None,
        matched: bool = False,
    ) -> list[Quantity]:
        """Frequency and damping ratio of the named oscillations at speeds (m/s), and the critical speeds.

        ``only`` names the modes that are wanted, None is all of them; ``matched`` as in :meth:`matched_draw`, where
        there are enough samples. The samples are of the bicycles that are possible: :meth:`left_out` counts the others.

        Parameters
        ----------
        speeds : ndarray, shape (m,)
            m/s.
        max_speed : float, optional
            m/s.
        samples : int, optional
            Number of bicycles drawn.
        seed : int, optional
            Of the draws, any whole number.
        """
        z = (self.matched_draw if matched and self.can_match(samples) else self.draw)(samples, seed)
        z, _ = self.possible(z)
        v = np.atleast_1d(np.asarray(speeds, float))
        return [*self._of_modes(v, z, only), *self._critical(z, max_speed, only)]

    def left_out(self, *, samples: int = 2000, seed: int = 0) -> dict[str, int]:
        """How many of the drawn bicycles (number ``samples``, from ``seed``) are impossible and left out, by reason."""
        return self.possible(self.draw(samples, seed))[1]

    def unlisted(
        self, found: Sequence[Quantity], *, max_speed: float = 60.0, samples: int = 2000, seed: int = 0
    ) -> int:
        """Samples, at least, with critical speeds that the nominal model does not have.

        ``found`` are the :meth:`quantities` of all modes, of the same samples and seed. Unstable roots are counted
        every LOOK m/s and compared with what the listed critical speeds make of them; two crossings between are not
        seen.

        Parameters
        ----------
        max_speed : float, optional
            m/s.
        samples : int, optional
            Number of bicycles drawn.
        seed : int, optional
            Of the draws, any whole number.
        """
        listed = {q.crossing: q.samples for q in found}
        crossings = {which: crossing for which, crossing in self.crossings(max_speed).items() if which in listed}
        z, _ = self.possible(self.draw(samples, seed))
        speeds = np.linspace(min(LOOK, max_speed), max_speed, max(2, round(max_speed / LOOK)))
        number = 0
        for rows, polynomial, _ in self.batches(z, LOOKED_AT):
            unstable = (eigenvalues(polynomial(speeds[None])).real > 0).sum(-1)  # (m, speeds)
            change = np.zeros_like(unstable)
            for which, crossing in crossings.items():
                at = listed[which][rows, None]
                change += crossing.unstable_roots * ((speeds[0] < at) & (at <= speeds))
            number += int((unstable - unstable[:, :1] != change).any(1).sum())
        return number

    def crossings(self, max_speed: float = 60.0) -> dict[CrossingIdentity, CriticalSpeed]:
        """Critical speeds of the nominal model up to ``max_speed`` (m/s), each by what tells it from the others."""
        return identified(critical_speeds(self.nominal.linear_model(), max_speed=max_speed))

    def crossing_speeds(
        self, crossing: CriticalSpeed, slopes: Mapping[str, float], z: Array, max_speed: float
    ) -> Array:
        """A critical speed (m/s) of other bicycles; NaN where it has vanished.

        Parameters
        ----------
        crossing : CriticalSpeed
            Of the nominal model.
        slopes : mapping of str to float
            Its derivatives in the free parameters, m/s per unit of each.
        z : ndarray, shape (m, names)
            Standard normal numbers.
        max_speed : float
            m/s.
        """
        start = np.maximum(crossing.speed + self.change(slopes, z), 0.2 * crossing.speed)
        omega = crossing.angular_frequency
        result, _ = self._newton(crossing, z, start, np.full(len(z), omega))
        lost = np.flatnonzero(np.isnan(result))
        if lost.size:  # too far for one leap: from the nominal bicycle in small steps
            speeds, last = np.full((2, len(lost)), crossing.speed)
            frequency = np.full(len(lost), omega)
            for share in np.linspace(0, 1, CONTINUATION + 1)[1:]:
                kept = ~np.isnan(speeds)
                ahead = np.maximum(2 * speeds - last, 0.5 * speeds)[kept]
                last = speeds.copy()
                speeds[kept], frequency[kept] = self._newton(
                    crossing, z[lost[kept]], ahead, frequency[kept], share=float(share)
                )
            result[lost] = speeds
        return np.where(result <= max_speed, result, np.nan)

    def _newton(
        self, crossing: CriticalSpeed, z: Array, start: Array, frequency: Array, *, share: float = 1.0
    ) -> tuple[Array, Array]:
        result, omega = np.full((2, len(z)), np.nan)
        for rows, polynomial, refused in self.batches(z, share=share):
            v, w, there = follow_crossing(
                polynomial, start[rows], frequency[rows], destabilising=crossing.destabilising
            )
            result[rows], omega[rows] = np.where(there & ~refused, v, np.nan), w
        return result, omega

    def _of_modes(self, speeds: Array, z: Array, only: Collection[str] | None) -> list[Quantity]:
        if not speeds.size:
            return []
        named = modes(self.nominal.linear_model(), speeds)
        slopes = sensitivities(self.nominal, speeds)
        gradients = self.gradient({key: slopes.of(key) for key in slopes.parameters})  # (m, n, names)
        sampled = self._followed(speeds, slopes.eigenvalues, {key: slopes.of(key) for key in slopes.parameters}, z)
        result = []
        for k, speed in enumerate(speeds):
            for name in named.names:
                value = complex(named.branch(name)[k, 0])
                if not value.imag > 0 or (only is not None and name not in only):
                    continue
                at = int(np.abs(slopes.eigenvalues[k] - value).argmin())
                root, slope, drawn = slopes.eigenvalues[k, at], gradients[k, at], sampled[k, :, at]
                drawn = oscillating(drawn)
                pairs = (
                    ("frequency", "Hz", frequency_hz(root), frequency_gradient(slope), frequency_hz(drawn)),
                    ("damping ratio", "1", damping_ratio(root), damping_ratio_gradient(complex(root), slope),
                     damping_ratio(drawn)),
                )  # fmt: skip
                for what, unit, nominal, gradient, samples in pairs:
                    label = f"{name} {what} at {speed:g} m/s"
                    result.append(Quantity(label, unit, float(nominal), gradient, self.shares(gradient), samples))
        return result

    def _followed(self, speeds: Array, roots: Any, slopes: Mapping[str, Any], z: Array) -> Any:
        """Eigenvalues (speeds, samples, n) in the order of the nominal ``roots``; NaN where two are confused."""
        result = np.full((len(speeds), len(z), roots.shape[1]), LOST)
        for rows, polynomial, _ in self.batches(z):
            values, change = eigenvalues(polynomial(speeds[None])), self.change(slopes, z[rows])
            for k in range(len(speeds)):
                expected = roots[k] + change[:, k]
                cost = np.abs(expected[:, :, None] - values[:, k, None, :])
                order = assign(cost)
                error = np.take_along_axis(cost, order[:, :, None], 2)[..., 0]
                rival = np.where(order[:, :, None] == np.arange(roots.shape[1]), np.inf, cost).min(2)
                chosen = np.take_along_axis(values[:, k], order, 1)
                result[k, rows] = np.where(error < rival, chosen, LOST)
        return result

    def _critical(self, z: Array, max_speed: float, only: Collection[str] | None) -> list[Quantity]:
        crossings = {
            which: crossing
            for which, crossing in self.crossings(max_speed).items()
            if only is None or crossing.mode in only
        }
        slopes = critical_speed_sensitivities(self.nominal, list(crossings.values()))
        result = []
        for k, (which, crossing) in enumerate(crossings.items()):
            gradient = self.gradient({key: value[k] for key, value in slopes.items()})
            samples = self.crossing_speeds(crossing, {key: float(v[k]) for key, v in slopes.items()}, z, max_speed)
            shares = self.shares(gradient)
            result.append(Quantity(str(which), "m/s", crossing.speed, gradient, shares, samples, which))
        return result
