"""Hands on the handlebar from ring-downs with two springs: of an oscillator whose numbers are written here."""

import math

import numpy as np
import pytest

from bicycle import load_bicycle
from bicycle.model import Model
from bicycle.standing import RingDown, measure_hands, read_ring_downs
from tyre.ground import InputError

PISTA = load_bicycle("pista")
TRUTH = (0.11, 6.0, 1.2)  # kg m^2, N m/rad, N m s/rad


def steering_inertia():
    """About the steer axis by hand: tensors and point masses of handlebar with fork, and of the wheel."""
    p = PISTA.values
    axis = np.array([math.sin(p["lam"]), 0.0, math.cos(p["lam"])])
    foot = np.array([p["w"] + p["c"], 0.0, 0.0])
    total, weight = 0.0, 0.0
    for mass, centre, tensor in (
        (p["mH"], (p["xH"], 0.0, p["zH"]), [[p["IHxx"], 0, p["IHxz"]], [0, 0, 0], [p["IHxz"], 0, p["IHzz"]]]),
        (p["mF"], (p["w"], 0.0, -p["rF"]), np.diag([p["IFxx"], 0, p["IFxx"]])),
    ):
        arm = np.array(centre) - foot
        lever = np.cross(axis, arm)[1]
        total += axis @ np.array(tensor) @ axis + mass * lever**2
        weight -= mass * 9.81 * axis[0] * lever  # the second derivative of the way down is sin(lam) times the lever
    return total, weight


def ring_down(spring, grip="loose", noise=(0.0, 0.0)):
    inertia, weight = steering_inertia()
    total = inertia + TRUTH[0]
    omega = math.sqrt((spring + TRUTH[1] + weight) / total)
    hertz, ratio = omega / (2 * math.pi), TRUTH[2] / (2 * omega * total)
    return RingDown(
        grip, spring, hertz * (1 + 0.02 * noise[0]), 0.02 * hertz, ratio * (1 + 0.1 * noise[1]), 0.1 * ratio
    )


def test_exact_ring_downs_give_the_hands_back():
    (hands,) = measure_hands((ring_down(40.0), ring_down(300.0)), Model(PISTA))
    np.testing.assert_allclose(hands.values, TRUTH, rtol=1e-5)
    assert hands.sd[2] / TRUTH[2] < 0.12


def test_intervals_hold_the_truth():
    """Frequencies to 2 %, ratios to 10 %, three decays of each spring: the inertia to a few per cent of the whole."""
    rng = np.random.default_rng(61)
    held, sds = np.zeros(3), []
    for _ in range(60):
        noise = rng.standard_normal((6, 2))
        downs = [ring_down(spring, noise=z) for spring, z in zip([40.0, 300.0] * 3, noise, strict=True)]
        (hands,) = measure_hands(downs, Model(PISTA))
        held += np.abs(hands.values - TRUTH) <= 1.96 * hands.sd
        sds.append(hands.sd / TRUTH)
    assert (held >= 52).all(), held
    inertia, _, damping = np.median(sds, axis=0)
    assert inertia < 0.09
    assert damping < 0.09


def test_grips_are_two_and_one_spring_is_refused(tmp_path):
    rows = [f"{grip},{r.spring},{r.frequency_hz},{r.frequency_sd_hz},{r.damping_ratio},{r.damping_ratio_sd}"
            for grip in ("loose", "firm") for r in (ring_down(40.0), ring_down(300.0))]  # fmt: skip
    head = "grip,spring_N_m_per_rad,frequency_Hz,frequency_sd_Hz,damping_ratio,damping_ratio_sd"
    (tmp_path / "hands.csv").write_text("\n".join([head, *rows, ""]))
    found = measure_hands(read_ring_downs(tmp_path / "hands.csv"), Model(PISTA))
    assert [hands.grip for hands in found] == ["loose", "firm"]
    with pytest.raises(InputError, match="grip 'loose': inertia and stiffness need two springs"):
        measure_hands((ring_down(40.0), ring_down(40.0)), Model(PISTA))


def test_a_standard_uncertainty_that_no_measurement_has_is_refused(tmp_path):
    head = "grip,spring_N_m_per_rad,frequency_Hz,frequency_sd_Hz,damping_ratio,damping_ratio_sd"
    (tmp_path / "hands.csv").write_text(f"{head}\nloose,40,2.3,0.05,0.17,1e-9\n")
    with pytest.raises(InputError, match="line 2: damping_ratio_sd = 1e-09 must be a standard uncertainty, 1e-5"):
        read_ring_downs(tmp_path / "hands.csv")
