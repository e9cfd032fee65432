"""Replay of runs whose steer angle is prescribed: held by a position controller, a robot or whoever steers.

The steer angle is then a coordinate whose motion is known. With the states ordered as the rest z, the steer angle s and
its rate, the equations M x' = F x + B u contain one unknown torque T at the steer axis. One equation in which T stands
is spent on eliminating it from the others, and dz/dt follows from s, s' and s'' as inputs. The equation that was spent
gives the torque that is needed, T = (M x' - F x - B u) / b: an output, compared if the torque was recorded. A damper, a
spring or friction between rear frame and handlebar shows in that torque and nowhere else.

The recorded angle is smoothed (:mod:`.steer_spline`), and its uncertainty is integrated out of the residual like an
initial state."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bicycle.identification.recording import CHANNELS, INPUTS, STEER, STEER_TORQUE
from bicycle.model.descriptor import DescriptorStack
from bicycle.motion.responses import from_rest
from studies.diagnosis.family import Family
from studies.diagnosis.mistakes import DELAY, FRICTION, GAIN, direction
from studies.diagnosis.replay import Driven, Replay, Sampled
from studies.diagnosis.steer_spline import ORDERS, SteerSpline
from studies.inference.last_answer import LastAnswer
from tyre.ground.arrays import Array


@dataclass(frozen=True)
class PrescribedSteer(Replay):
    """Runs whose steer angle is an input; ``steer_noise`` is the sd of that record in rad, if it is known."""

    steer_noise: float | None = None

    @property
    def held(self) -> bool:
        """False: an angle does not jump."""
        return False

    @cached_property
    def _splines(self) -> tuple[SteerSpline, ...]:
        """Smoothed steer angle of each run, with its uncertainty."""
        return tuple(SteerSpline.of_run(run, self.steer_noise) for run in self.runs)

    @cached_property
    def _steer_rate_signs(self) -> Array:
        """Sign of the steer rate (R, T), its jumps as smooth as the acceleration is in which they show."""
        runs = zip(self.runs, self._splines, strict=True)
        return self.pad_runs([spline.smoothing @ direction(run)] for run, spline in runs)[:, 0]

    @property
    def _other_inputs(self) -> list[str]:
        """Names of the recorded inputs other than the steer angle."""
        return [name for name in self.runs[0].inputs if name != STEER]

    def _equations(self, family: Family, values: Mapping[str, Array], system: DescriptorStack) -> Driven:
        """Equations dz/dt of a ``system`` by its rest z and inputs: steer angle, rate, acceleration, the other torques.

        States and channels as of all n states, with those of the steering at rest. Friction is the last input.
        """
        names = family.symbolic
        outputs, mass, dynamics = system.output, system.mass, system.dynamics
        n = mass.shape[-1]

        # Which states are the steer angle and its rate, and their units in rad and rad/s.
        scales, places = [], []
        for name in ("steer", "steer_rate"):
            row = outputs[0, 0, names.outputs.index(name)]
            (place,) = np.flatnonzero(row)  # a coordinate and its rate are states
            places.append(int(place))
            scales.append(float(row[place]))
        angle, rate = places
        keep = [k for k in range(n) if k not in places]

        # The equation that is spent on the unknown torque T: the one in which it is largest.
        torque = system.input[..., names.inputs.index("steer_torque")]
        spent = int(np.abs(torque[0, 0]).argmax())
        rows = [k for k in range(n) if k not in (spent, angle)]  # that of the angle says angle' = rate
        share = torque[..., rows] / torque[..., spent, None]
        other_inputs = system.input[..., [names.inputs.index(INPUTS[name]) for name in self._other_inputs]]

        def without_torque(matrix: Array) -> Array:
            """Rows of ``matrix`` (K, R, n, columns) without that of the angle, T eliminated by the equation spent."""
            return matrix[..., rows, :] - share[..., None] * matrix[..., [spent], :]

        # The others, with angle, rate and acceleration on the right: solved for dz/dt.
        m, f = without_torque(mass), without_torque(dynamics)
        columns = np.stack(
            [
                f[..., angle] / scales[0],
                f[..., rate] / scales[1] - m[..., angle] / scales[0],
                -m[..., rate] / scales[1],
            ],
            -1,
        )
        driving = np.concatenate([columns, without_torque(other_inputs)], -1)
        solved = np.linalg.solve(m[..., keep], np.concatenate([f[..., keep], driving], -1))
        state, inputs = solved[..., : len(keep)], solved[..., len(keep) :]

        # The equation spent gives the torque T that is needed, by z and by the inputs.
        b = torque[..., spent, None]
        into_rest = mass[..., spent, :][..., keep]
        needed_z = (np.einsum("...i,...ij->...j", into_rest, state) - dynamics[..., spent, :][..., keep]) / b
        direct = np.zeros((*b.shape[:-1], ORDERS + len(self._other_inputs)))
        direct[..., 0] = -dynamics[..., spent, angle] / scales[0]
        direct[..., 1] = mass[..., spent, angle] / scales[0] - dynamics[..., spent, rate] / scales[1]
        direct[..., 2] = mass[..., spent, rate] / scales[1]
        direct[..., ORDERS:] = -other_inputs[..., spent, :]
        needed_u = (np.einsum("...i,...ij->...j", into_rest, inputs) + direct) / b

        # Channels by z and directly by the inputs.
        state_rows, input_rows = [], []
        for name in self.channels:
            if name == STEER_TORQUE:
                state_rows.append(needed_z)
                input_rows.append(needed_u)
                continue
            row = outputs[..., names.outputs.index(CHANNELS[name]), :]
            state_rows.append(row[..., keep])
            input_row = np.zeros_like(needed_u)
            input_row[..., 0] = row[..., angle] / scales[0]
            input_row[..., 1] = row[..., rate] / scales[1]
            input_rows.append(input_row)
        output, direct_u = np.stack(state_rows, -2), np.stack(input_rows, -2)

        if FRICTION in values:  # overcome by the torque, the motion being what it is
            column = np.zeros((*direct_u.shape[:-1], 1))
            if STEER_TORQUE in self.channels:
                column[..., self.channels.index(STEER_TORQUE), 0] = -1.0
            direct_u = np.concatenate([direct_u, column], -1)
            inputs = np.concatenate([inputs, np.zeros((*inputs.shape[:-1], 1))], -1)
        return _all_states(Driven(state, inputs, output, direct_u), keep, n)

    def _signals(self, values: Mapping[str, Array], starts: Array | None) -> Array:
        """Inputs (K, R, m, T): steer angle, rate, acceleration (rad, s), the other torques (N m), friction; K or 1."""
        torques = super()._signals(values, None)  # by the order of the inputs, friction last
        sensors = _sensor(values)
        if len(set(sensors)) == 1:
            sensors = sensors[:1]
        most = self._uncertain_columns
        angle = np.zeros((len(sensors), len(self.runs), ORDERS, self.length))
        for i, (late, gain) in enumerate(sensors):
            for r, (angles, uncertain) in enumerate(self._angles(late)):
                if starts is not None:
                    angles = angles + uncertain @ starts[r, -most:][: uncertain.shape[-1]]
                angle[i, r, :, : len(angles)] = angles.T / gain
        other_torques = np.delete(torques, list(self.runs[0].inputs).index(STEER), 2)
        k = max(len(angle), len(other_torques))
        return np.concatenate([np.broadcast_to(part, (k, *part.shape[1:])) for part in (angle, other_torques)], 2)

    def _angles(self, late: float) -> list[tuple[Array, Array]]:
        """Angle, rate and acceleration of each run, ``late`` s after each sample: values (T, 3), spread (T, 3, K)."""
        return self._last_angles.get(late, lambda: [spline.at(late) for spline in self._splines])

    @cached_property
    def _last_angles(self) -> LastAnswer[list[tuple[Array, Array]]]:
        """The angles of the last delay, which changes only where the delay of the sensor is fitted."""
        return LastAnswer()

    @cached_property
    def _uncertain_columns(self) -> int:
        """Combinations of coefficients of the spline that has most."""
        return max(spline.spread.shape[1] for spline in self._splines)

    def _input_responses(self, system: Sampled, values: Mapping[str, Array]) -> Array:
        """Responses (1, R, C, T, columns) of the first bicycle's channels to the uncertain weights of the splines."""
        first = system.first_bicycle
        ((late, gain),) = _sensor(values)
        most = self._uncertain_columns
        angle = np.zeros((len(self.runs), self.length, most, ORDERS))
        for r, (_, uncertain) in enumerate(self._angles(late)):
            angle[r, : len(uncertain), : uncertain.shape[-1]] = uncertain.swapaxes(-1, -2) / gain
        signals = np.concatenate([angle[:, :-1], angle[:, 1:]], -1)
        into_states = np.concatenate([first.before[..., :ORDERS], first.after[..., :ORDERS]], -1).swapaxes(-1, -2)
        across = np.einsum("cd,rqn->rcqdn", np.eye(most), into_states)
        across = across.reshape(len(self.runs), -1, most, first.step.shape[-1])
        y = from_rest(first.step, signals.reshape(*signals.shape[:2], -1), across, first.output)
        assert first.direct is not None
        return (y + np.einsum("rco,rtko->rctk", first.direct[..., :ORDERS], angle))[None]


def _sensor(values: Mapping[str, Array]) -> list[tuple[float, float]]:
    """Delay (s) and factor of the sensor of the steer angle, of K bicycles."""
    nothing = np.zeros((len(next(iter(values.values()))), 1))
    late, gain = (values.get(key.format(STEER), nothing)[:, 0].tolist() for key in (DELAY, GAIN))
    return [(delay, 1.0 + scale) for delay, scale in zip(late, gain, strict=True)]


def _all_states(driven: Driven, keep: list[int], n: int) -> Driven:
    """Equations with all ``n`` states: those of the steering, which are known, stand still and are not seen."""
    lead = driven.state.shape[:-2]
    state, output = np.zeros((*lead, n, n)), np.zeros((*driven.output.shape[:-1], n))
    inputs = np.zeros((*lead, n, driven.inputs.shape[-1]))
    state[..., np.ix_(keep, keep)[0], np.ix_(keep, keep)[1]] = driven.state
    inputs[..., keep, :] = driven.inputs
    output[..., keep] = driven.output
    return Driven(state, inputs, output, driven.direct)
