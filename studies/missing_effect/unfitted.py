"""Runs that were held out of every fit, as the models of a diagnosis predict them: does what was named predict?

Noise, parameters and effects are those of the judgement. Of the run itself only the state at its first sample is taken
(and an offset of each channel where that is part of the model): it is integrated out, as in a fit.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from studies.inference.arrays import Array
from studies.inference.fit import Fit
from studies.inference.forward import Forward
from studies.inference.joint import JointForward
from studies.inference.parameter import Candidate
from studies.missing_effect.diagnose import Diagnosis
from studies.missing_effect.motion.friction import third_difference_noise
from studies.missing_effect.motion.history_forward import HistoryForward
from studies.missing_effect.motion.measurements import BicycleMeasurement

LARGE = 2.0  # times the noise from sample to sample: what is taken for noise beyond it holds something slower
LEAST_SAMPLES = 20  # of a run that shows its noise from sample to sample


@dataclass(frozen=True)
class Predicted:
    """What the models say of the held-out runs of one part.

    Attributes
    ----------
    part : str
        Empty where the measurement has no parts.
    runs : tuple of str
    numbers : int
        How many are compared.
    chi2 : mapping of str to float
        By model: ``nominal``, ``nuisance_only``, ``final``, and ``with_torque`` where a residual torque was fitted.
    rms : mapping of str to mapping
        By channel and model, in the channel's unit: root mean square of measured minus computed.
    noise : mapping of str to tuple of float
        By channel whose noise is not stated but estimated, in its unit: the sd that was taken, and what these runs
        show of it from sample to sample.
    """

    part: str
    runs: tuple[str, ...]
    numbers: int
    chi2: Mapping[str, float]
    rms: Mapping[str, Mapping[str, float]]
    noise: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def loud(self) -> list[str]:
        """Channels whose estimated noise holds much that is no noise from sample to sample, as what is left does."""
        return [
            name for name, (taken, rough) in self.noise.items() if min(taken, self.rms[name]["final"]) > LARGE * rough
        ]

    @property
    def gap(self) -> dict[str, float | None]:
        """sqrt(max(0, chi^2/n - 1)) over that of the base model; None where that has no gap, or falls over."""
        size = {model: math.sqrt(max(0.0, value / self.numbers - 1)) for model, value in self.chi2.items()}
        whole = size["nominal"]
        return {model: one / whole if 0 < whole < math.inf else None for model, one in size.items()}

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "part": self.part, "runs": list(self.runs), "n": self.numbers,
            "chi2": {model: value if math.isfinite(value) else None for model, value in self.chi2.items()},
            "gap": self.gap, "rms": {channel: dict(models) for channel, models in self.rms.items()},
            "estimated_noise": {
                channel: {"taken": taken, "sample_to_sample": rough} for channel, (taken, rough) in self.noise.items()
            },
        }  # fmt: skip


Found = tuple[tuple[Candidate, ...], Mapping[str, Array]]
"""What was added, and coordinates: of nuisances by name, of candidates by identifier."""


def predicted(diagnosis: Diagnosis, torque: Fit | None = None) -> tuple[Predicted, ...]:
    """How the models of a ``diagnosis`` predict what was held out, part by part; empty where nothing was.

    Parameters
    ----------
    diagnosis : Diagnosis
    torque : Fit, optional
        The named model with a residual torque, where one was fitted.
    """
    measurement = diagnosis.measurement
    if not isinstance(measurement, BicycleMeasurement):
        return ()
    unseen = measurement.unfitted(diagnosis.forward)
    if unseen is None:
        return ()
    null, final = coordinates_of(diagnosis.hypotheses.null), coordinates_of(diagnosis.final)
    return predict(unseen, null, final, None if torque is None else coordinates_of(torque))


def predict(unseen: Forward, null: Found, final: Found, torque: Found | None = None) -> tuple[Predicted, ...]:
    """How two or three fits predict data that they have not seen, part by part.

    Parameters
    ----------
    unseen : Forward
        The model of these data.
    null, final, torque : tuple
        As :func:`coordinates_of` gives them.
    """
    fits = {"nuisance_only": null, "final": final} | ({} if torque is None else {"with_torque": torque})
    return tuple(_predicted(*one, fits) for one in _parts(unseen))


def coordinates_of(hypothesis: Fit) -> Found:
    """The candidates of a fitted ``hypothesis``, and its coordinates by name."""
    names = [u.name for u in hypothesis.unknowns[: hypothesis.effect_columns.start]]
    floating = {name: hypothesis.theta[k : k + 1] for k, name in enumerate(names)}
    return hypothesis.candidates, floating | {
        c.identifier: hypothesis.theta[hypothesis.columns(c)] for c in hypothesis.candidates
    }


def _parts(unseen: Forward) -> Iterator[tuple[str, HistoryForward, Forward]]:
    """Name of each part, its own model, and the same as a whole, which knows what the unknowns are called."""
    if isinstance(unseen, JointForward):
        for part in unseen.parts:
            assert isinstance(part.forward, HistoryForward)
            yield part.name, part.forward, JointForward((part,))
    elif isinstance(unseen, HistoryForward):
        yield "", unseen, unseen


def _predicted(part: str, own: HistoryForward, whole: Forward, fits: Mapping[str, Found]) -> Predicted:
    stated = {u.name: np.array([u.centre]) for u in whole.nuisances}
    models: dict[str, Found] = {"nominal": ((), stated), **fits}
    chi2: dict[str, float] = {}
    rms: dict[str, dict[str, float]] = {name: {} for name in own.noise}
    left: list[Array] = []
    for model, (candidates, coordinates) in models.items():
        kept, theta = here(whole, candidates, coordinates)
        if isinstance(whole, JointForward):
            kept, places = whole.of_part(0, kept)
            theta = theta[places]
        residual, _ = own.residual(kept, theta, slopes=False)
        squared = float(residual @ residual)
        chi2[model] = squared if math.isfinite(squared) else math.inf
        left = own.unexplained(kept, theta)
        rest = np.concatenate(left)
        for c, name in enumerate(own.noise):
            rms[name][model] = float(np.sqrt(np.mean(rest[:, c] ** 2)))
    noise = {name: (own.noise[name].sd, rough) for name, rough in _from_sample_to_sample(own, left).items()}
    return Predicted(part, tuple(run.name for run in own.runs), len(own.rows.where), chi2, rms, noise)


def _from_sample_to_sample(own: HistoryForward, left: list[Array]) -> dict[str, float]:
    """Noise of the channels whose sd is estimated, in their units, from third differences.

    Of what was measured and of what is left of it, which is less where the motion is fast for its samples; where a
    model is far off it is more. Motion and misfit only add, so the smaller one is nearer.
    """
    found = {}
    for c, (name, noise) in enumerate(own.noise.items()):
        pairs = [(r.channels[name], x[:, c]) for r, x in zip(own.runs, left, strict=True) if len(x) >= LEAST_SAMPLES]
        if pairs and not noise.given:
            shown = [[third_difference_noise(signal) ** 2 for signal in pair] for pair in pairs]
            found[name] = float(np.sqrt(np.mean(shown, axis=0).min()))
    return found


def here(
    forward: Forward, candidates: tuple[Candidate, ...], at: Mapping[str, Array]
) -> tuple[tuple[Candidate, ...], Array]:
    """What of the ``candidates`` concerns a forward model, and its coordinates.

    Parameters
    ----------
    forward : Forward
    candidates : tuple of Candidate
    at : mapping of str to ndarray
        As :func:`coordinates_of` gives it.
    """
    kept = tuple(c for c in candidates if not isinstance(forward, JointForward) or forward.concerns(c))
    parts = [*(at[u.name] for u in forward.nuisances), *(at[c.identifier] for c in kept), np.zeros(0)]
    return kept, np.concatenate(parts)
