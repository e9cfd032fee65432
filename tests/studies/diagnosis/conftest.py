"""The documentation's modal example and a diagnosis as far as doubts, traces and corrected models need it."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from studies.diagnosis import read_measurement
from studies.inference import Hypotheses, fit

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples" / "measurements"


def begun_of(measurement, identifier="", *, verdict="none"):
    """Nothing but parameters, or one effect, fitted."""
    forward = measurement.prepare()
    null = fit(forward)
    candidates = tuple(c for c in forward.candidates if c.identifier == identifier)
    final = fit(forward, candidates) if candidates else null
    nominal, _ = forward.residual((), np.array([u.centre for u in forward.nuisances]))
    return SimpleNamespace(
        kind=forward, final=final, nominal=nominal,
        hypotheses=Hypotheses(null, (final,) if candidates else (), forward),
        verdict=SimpleNamespace(verdict=verdict, equivalent=()),
    )  # fmt: skip


@pytest.fixture(scope="session")
def begun():
    """Begin a diagnosis."""
    return begun_of


@pytest.fixture(scope="session")
def modal():
    """The weave of the documentation's examples: synthetic, made outside velotyre, with a damper hidden."""
    return EXAMPLES / "modal"


@pytest.fixture(scope="session")
def damped(modal):
    """The example with its damper fitted."""
    return begun_of(read_measurement(modal / "MEASUREMENT.toml"), "steer_damper", verdict="class")
