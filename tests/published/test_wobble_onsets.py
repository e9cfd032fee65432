"""The numbers of independent origin, computed again by a derivation of its own: Newton and Euler in full motion.

Nothing of the package is used here. The wobble onsets that other tests hold the package against come from Lagrange's
equations with exact rotations, the eigenvalues of tyre_eigenvalues.json from two other derivations.
"""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq
from wobble_onsets import COMPLIANCE, FLEXIBLE, FLEXIBLE_STIFFNESS, RIGID, RIGID_STIFFNESS

from tests.validation.blind.closing import build

WOBBLE, SOFT_WOBBLE, WEAVE = (45.0, 120.0), (28.0, 60.0), (10.0, 28.0)  # rad/s
CASES = json.loads((Path(__file__).parent / "tyre_eigenvalues.json").read_text())["cases"]
(BENCHMARK,) = (case["bicycle"] for case in CASES if case["name"] == "benchmark, slip and relaxation")


def crossing(stiffness, length, low, high, band, effects=None):
    """Speed (m/s) between two others at which the pair of a band (rad/s) begins or ends to grow."""
    tyres = {"cornering_stiffness": stiffness, "relaxation_length": length}
    machine = build(BENCHMARK, {"relaxation_length": tyres, **(effects or {})})

    def growth(speed):
        values = np.linalg.eigvals(machine.space(speed).matrix)
        return values.real[(values.imag > band[0]) & (values.imag < band[1])].max()

    return brentq(growth, low, high, xtol=1e-9)


@pytest.mark.parametrize(("length", "onset"), RIGID)
def test_wobble_onsets_of_the_rigid_front(length, onset):
    assert crossing(RIGID_STIFFNESS, length, onset - 4, onset + 4, WOBBLE) == pytest.approx(onset, abs=1e-5)


@pytest.mark.parametrize(("length", "begin", "end", "weave"), FLEXIBLE)
def test_wobble_bands_of_the_flexible_front(length, begin, end, weave):
    soft, middle = {"front_compliance": COMPLIANCE}, (begin + end) / 2
    for at, *interval in (
        (begin, begin - 1, middle, SOFT_WOBBLE), (end, middle, end + 1, SOFT_WOBBLE),
        (weave, weave - 2, weave + 2, WEAVE),
    ):  # fmt: skip
        assert crossing(FLEXIBLE_STIFFNESS, length, *interval, soft) == pytest.approx(at, abs=1e-5)
