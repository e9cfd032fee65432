"""The numbers of independent origin, computed again by a third derivation: Lagrange's equations with exact rotations.

Nothing of the package is used here. The wobble onsets that other tests hold the package against come from it, and the
eigenvalues of tyre_eigenvalues.json, of two other derivations, agree with it.
"""

import json
from pathlib import Path

import numpy as np
import pytest
from eigenvalue_sets import assert_same_eigenvalues
from lagrange import LagrangeBicycle
from wobble_onsets import FLEXIBLE, FLEXIBLE_STIFFNESS, HINGE, RIGID, RIGID_STIFFNESS

HERE = Path(__file__).parent
WOBBLE, SOFT_WOBBLE, WEAVE = (45.0, 120.0), (28.0, 60.0), (10.0, 28.0)  # rad/s
CASES = {case["name"]: case for case in json.loads((HERE / "tyre_eigenvalues.json").read_text())["cases"]}
COVERED = ("relaxation_length", "front_compliance")


def benchmark(stiffness, length, hinge=None):
    parameters = CASES["benchmark, slip and relaxation"]["bicycle"]
    return LagrangeBicycle(parameters, stiffness=tuple(stiffness.values()), length=(length, length), hinge=hinge)


@pytest.mark.parametrize(("length", "onset"), RIGID)
def test_wobble_onsets_of_the_rigid_front(length, onset):
    found = benchmark(RIGID_STIFFNESS, length).crossing(onset - 4, onset + 4, WOBBLE)
    assert found == pytest.approx(onset, abs=1e-5)


@pytest.mark.parametrize(("length", "begin", "end", "weave"), FLEXIBLE)
def test_wobble_bands_of_the_flexible_front(length, begin, end, weave):
    bicycle, middle = benchmark(FLEXIBLE_STIFFNESS, length, HINGE), (begin + end) / 2
    assert bicycle.growth(middle, *SOFT_WOBBLE) > 0
    assert bicycle.crossing(begin - 1, middle, SOFT_WOBBLE) == pytest.approx(begin, abs=1e-5)
    assert bicycle.crossing(middle, end + 1, SOFT_WOBBLE) == pytest.approx(end, abs=1e-5)
    assert bicycle.crossing(weave - 2, weave + 2, WEAVE) == pytest.approx(weave, abs=1e-5)


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if set(case["effects"]) <= set(COVERED)])
def test_eigenvalues_of_the_two_other_derivations(name):
    case = CASES[name]
    law, front = (case["effects"].get(effect) for effect in COVERED)
    hinge = None
    if front:
        assert front["axis_tilt"] == pytest.approx(case["bicycle"]["lam"], abs=1e-12)
        hinge = {
            "x": front["joint_x"], "z": front["joint_z"], "stiffness": front["stiffness"], "damping": front["damping"],
        }  # fmt: skip
    stiffness, length = ((law[key]["rear"], law[key]["front"]) for key in ("cornering_stiffness", "relaxation_length"))
    bicycle = LagrangeBicycle(case["bicycle"], stiffness=stiffness, length=length, hinge=hinge)
    assert bicycle.loads == pytest.approx([case["static_loads_N"][wheel] for wheel in ("rear", "front")], rel=1e-12)
    for speed, pairs in case["eigenvalues_by_speed_m_s"].items():
        values = np.linalg.eigvals(bicycle.state_matrix(float(speed)))
        values = values[np.argsort(np.abs(values))[2:]]  # without lateral place and heading, of which nothing depends
        assert_same_eigenvalues(values, np.array(pairs) @ [1, 1j], rtol=1e-8, atol=1e-7)
