"""The motion that the data showed, as harmonic samples: what a torque on it would have done.

Modes of modal data, the frequencies of time histories (windowed as by Hann), of responses and of an identification are
brought to one form: at a speed v the lean and steer angles are complex amplitudes of exp(s t), so rates are s times as
large.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from studies.inference.forward import Forward
from studies.inference.joint import JointForward
from studies.inference.parameter import Candidate
from studies.missing_effect.forced.forward import FrequencyForward, Wanted, responses
from studies.missing_effect.motion.canonical_forward import FREQUENCIES, STEER_RATE, CanonicalForward
from studies.missing_effect.motion.history_forward import HistoryForward
from studies.missing_effect.motion.modal_forward import ModalForward, predict
from tyre.base.arrays import Array, Complex

SIZE = 0.1  # rad, root mean square of lean and steer together: motions are compared at this size
FASTEST_HZ = 8.0  # of histories
QUIETEST = 0.02  # of the largest amplitude of a run


@dataclass(frozen=True, eq=False)
class Seen:
    """Motions at speeds.

    Attributes
    ----------
    speed : ndarray, shape (k,)
        m/s.
    root : ndarray of complex, shape (k,)
        s, 1/s.
    angle : ndarray of complex, shape (k, 2)
        Lean and steer, rad, of :data:`SIZE` together.
    """

    speed: Array
    root: Complex
    angle: Complex

    @cached_property
    def state(self) -> Complex:
        """Lean, steer and their rates (k, 4), rad and rad/s."""
        return np.concatenate([self.angle, self.root[:, None] * self.angle], axis=1)

    @property
    def rms(self) -> Array:
        """Root mean square of each state (4,) over the samples, rad and rad/s, of the motion of :data:`SIZE`."""
        return np.asarray(np.sqrt((np.abs(self.state) ** 2).mean(0)))


def seen(forward: Forward, candidates: tuple[Candidate, ...], theta: Array) -> Seen:
    """What the data showed, as the model computes it.

    Parameters
    ----------
    forward : Forward
        Of bicycle motion.
    candidates : tuple of Candidate
    theta : ndarray, shape (p,)
        Coordinates.
    """
    if isinstance(forward, JointForward):
        parts = []
        for number, part in enumerate(forward.parts):
            kept, places = forward.of_part(number, candidates)
            parts.append(seen(part.forward, kept, theta[places]))
        return Seen(*(np.concatenate(each) for each in zip(*(vars_of(p) for p in parts), strict=True)))
    if isinstance(forward, ModalForward):
        return _scaled(*_modes(forward, candidates, theta))
    if isinstance(forward, HistoryForward):
        return _scaled(*_histories(forward, candidates, theta))
    if isinstance(forward, FrequencyForward):
        return _scaled(*_forced(forward, candidates, theta))
    assert isinstance(forward, CanonicalForward)
    return _scaled(*_identified(forward, candidates, theta))


def vars_of(one: Seen) -> tuple[Array, Complex, Complex]:
    """Speed, root and angle of ``one``."""
    return one.speed, one.root, one.angle


def _scaled(speed: Array, root: Complex, angle: Complex) -> Seen:
    size = float(np.sqrt((np.abs(angle) ** 2).sum(1).mean()))
    return Seen(speed, root, angle * (SIZE / size))


def _modes(forward: ModalForward, candidates: tuple[Candidate, ...], theta: Array) -> tuple[Array, Complex, Complex]:
    speeds, roots, angles = [], [], []
    for settings, _, wanted in forward.wanted:
        family = replace(forward.family(candidates), settings=settings)
        number, _ = predict(family, wanted, theta, slopes=False)
        shape = np.stack([np.ones(len(number)), number[:, 1]], 1)
        shape /= np.linalg.norm(shape, axis=1, keepdims=True)
        usable = np.isfinite(shape).all(1)
        speeds.append(wanted.speed[usable])
        roots.append(number[usable, 0])
        angles.append(shape[usable])
    return np.concatenate(speeds), np.concatenate(roots), np.concatenate(angles)


def _histories(
    forward: HistoryForward, candidates: tuple[Candidate, ...], theta: Array
) -> tuple[Array, Complex, Complex]:
    moved = forward.simulated(candidates, theta, ("lean_rad", "steer_rad"), theta[None])[0]
    speeds, roots, angles = [], [], []
    for run, motion in zip(forward.runs, moved, strict=True):
        motion = motion[:, : len(run.time)].T
        if not np.isfinite(motion).all():
            continue
        spectrum = np.fft.rfft(motion * np.hanning(len(motion))[:, None], axis=0)
        hertz = np.fft.rfftfreq(len(motion), run.step)
        size = np.linalg.norm(spectrum, axis=1)
        kept = (hertz > 0) & (hertz <= FASTEST_HZ) & (size > QUIETEST * size.max())
        speeds.append(np.full(int(kept.sum()), run.speed))
        roots.append(2j * np.pi * hertz[kept])
        angles.append(spectrum[kept])
    return np.concatenate(speeds), np.concatenate(roots), np.concatenate(angles)


def _forced(
    forward: FrequencyForward, candidates: tuple[Candidate, ...], theta: Array
) -> tuple[Array, Complex, Complex]:
    """Each response once, of one size: gain and phase do not say how far the bicycle moved."""
    given = forward.wanted
    places = sorted(set(zip(given.speed.tolist(), given.frequency.tolist(), given.inputs, strict=True)))
    speed, frequency = np.array([place[:2] for place in places]).T
    source = tuple(place[2] for place in places)
    family = forward.family(candidates)
    angle = np.stack([
        responses(family, Wanted(frequency, speed, source, (name,) * len(places)), theta, slopes=False)[0]
        for name in ("lean", "steer")
    ], axis=1)  # fmt: skip
    return speed, 2j * np.pi * frequency, angle / np.linalg.norm(angle, axis=1, keepdims=True)


def _identified(
    forward: CanonicalForward, candidates: tuple[Candidate, ...], theta: Array
) -> tuple[Array, Complex, Complex]:
    """The rider steers at each frequency with the same rate, and the bicycle leans as it must."""
    speeds = np.array(forward.table.speeds, float)
    omega = 2 * np.pi * np.geomspace(*forward.table.band, FREQUENCIES)
    family = forward.family(candidates)
    names, system = family.symbolic, family(theta[None], speeds)
    response = system.frequency_response(
        omega, inputs=[names.inputs.index("steer_torque")],
        outputs=[names.outputs.index(name) for name in ("lean", "steer")],
    )[0, ..., 0]  # fmt: skip
    steer = STEER_RATE / omega
    angle = np.stack([response[..., 0] / response[..., 1] * steer, np.broadcast_to(steer, response.shape[:2])], -1)
    root = np.broadcast_to(1j * omega, response.shape[:2])
    return np.repeat(speeds, len(omega)), root.ravel(), angle.reshape(-1, 2)
