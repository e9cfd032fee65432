"""What a steer motor gives of its command, against the benchmark's published matrices with a lag written by hand.

Matrices: Meijaard, Papadopoulos, Ruina & Schwab (2007), the benchmark bicycle. Equations by hand, q = (lean, steer):
M q'' + v C1 q' + (g K0 + v^2 K2) q = (0, T), lag T' = share k(v) lean' - T, with k(v) = gain (v_fade - v).
"""

import numpy as np
import pytest
from built import built, linear
from eigenvalue_sets import assert_same_eigenvalues

from tests.shared.published_bicycle import C1, K0, K2, G, M
from tyre.ground import InputError

GAIN, FADE, LEAN_GAIN = 8.0, 4.7, 3.0
SPEEDS = (1.0, 3.0, 4.4, 6.5)


def by_hand(speed: float, share: float, lag: float | None) -> np.ndarray:
    """Eigenvalues (1/s); without a lag the share arrives at once."""
    rate = GAIN * (FADE - speed) if speed < FADE else 0.0
    angle = 0.0 if speed < FADE else LEAN_GAIN * (speed - FADE)
    inverse = np.linalg.inv(M)
    stiffness, damping = G * K0 + speed**2 * K2, speed * C1
    rows, told = np.zeros((5, 5)), np.array([share * angle, 0, share * rate, 0])
    rows[:2, 2:4] = np.eye(2)
    rows[2:4] = np.hstack([-inverse @ stiffness, -inverse @ damping, inverse[:, 1:]])
    if lag is None:
        rows[2:4, :4] += np.outer(rows[2:4, 4], told)
        return np.linalg.eigvals(rows[:4, :4])
    rows[4] = np.append(told, -1) / lag
    return np.linalg.eigvals(rows)


def assisted(**motor: float):
    assist = {"gain": GAIN, "fade_speed": FADE, "lean_gain": LEAN_GAIN}
    return linear(steer_assist=assist, **({"steer_motor": motor} if motor else {}))


@pytest.mark.parametrize("speed", SPEEDS)
def test_a_lag_is_a_state_of_its_own_and_without_a_motor_all_arrives_at_once(speed):
    assert_same_eigenvalues(assisted().eigenvalues(speed), by_hand(speed, 1.0, None), rtol=1e-9)
    for share, lag in ((1.0, 0.03), (0.6, 0.1), (0.6, 0.004)):
        found = assisted(share=share, lag=lag).eigenvalues(speed)
        assert_same_eigenvalues(found, by_hand(speed, share, lag), rtol=1e-9)


@pytest.mark.parametrize("speed", SPEEDS)
def test_a_short_lag_goes_to_the_share_at_once_in_proportion_to_the_lag(speed):
    errors = []
    for lag in (1e-3, 5e-4, 2.5e-4):
        found = assisted(share=0.6, lag=lag).eigenvalues(speed)
        slow = found[np.abs(found) < 0.5 / lag]
        assert len(slow) == 4
        errors.append(np.abs(np.sort_complex(slow) - np.sort_complex(by_hand(speed, 0.6, None))).max())
    np.testing.assert_allclose([errors[0] / errors[1], errors[1] / errors[2]], 2, rtol=0.05)


def test_a_lag_takes_damping_from_a_weave_that_the_assist_holds():
    """The torque that follows the lean rate late has a part that feeds the motion: phase -atan(omega lag)."""
    weave = [max(assisted(share=1.0, lag=lag).eigenvalues(3.0), key=lambda z: z.imag) for lag in (0.001, 0.01, 0.03)]
    assert weave[0].real < 0 < weave[2].real
    assert np.all(np.diff([z.real for z in weave]) > 0)


def test_a_motor_without_a_command_is_refused():
    with pytest.raises(InputError, match="'steer_motor' needs a motor command, .* use steer_assist"):
        built(steer_motor={})
