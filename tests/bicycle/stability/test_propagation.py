"""Linear propagation along speeds, over both wheels, and what it refuses; derivatives by differences of models."""

import numpy as np
import pytest

from bicycle import Model, effect_class, load_bicycle
from bicycle.parameters import checked_covariance
from bicycle.stability import critical_speed_gradients, critical_speeds, mode_sd, standard_deviation
from tyre.ground import InputError

NAMES = ("relaxation_length.relaxation_length.rear", "relaxation_length.relaxation_length.front", "c")
SPREAD = np.array([[1e-5, 6e-6, 0.0], [6e-6, 2e-5, 0.0], [0.0, 0.0, 4e-6]])


def model(rear: float = 0.1, front: float = 0.09, trail: float = 0.08) -> Model:
    tyre = effect_class("relaxation_length")(
        cornering_stiffness=6000.0, relaxation_length={"rear": rear, "front": front}
    )
    return Model(load_bicycle("benchmark").replace(c=trail), (tyre,))


def roots(values: Model, speed: float) -> np.ndarray:
    """Weave and wobble at a speed, the slower first."""
    found = values.linear_model().eigenvalues(speed)
    return np.array(sorted(found[found.imag > 0], key=lambda root: root.imag)[:2])


def differences(quantity, step: float = 1e-6) -> np.ndarray:
    """Derivatives (..., 3) with respect to NAMES."""
    at = np.array([0.1, 0.09, 0.08])
    ends = [(quantity(model(*(at + h))), quantity(model(*(at - h)))) for h in step * np.eye(3)]
    return np.stack([(np.asarray(more) - less) / (2 * step) for more, less in ends], -1)


def sd(gradient: np.ndarray) -> np.ndarray:
    return np.sqrt(np.array([[g @ SPREAD @ g for g in row] for row in gradient]))


def test_modes_along_speeds_with_gaps_and_real_roots():
    speeds, here = [5.0, 9.0], model()
    eigenvalues = np.array([roots(here, v) for v in speeds])
    values = here.linear_model().eigenvalues(9.0)
    real = values[values.imag == 0][-1]
    asked = np.hstack([eigenvalues, [[np.nan], [real]]])
    frequency, damping = mode_sd(here, speeds, asked, NAMES, SPREAD)
    hertz = differences(lambda m: np.array([roots(m, v).imag for v in speeds]) / (2 * np.pi))
    ratio = differences(lambda m: np.array([-roots(m, v).real / np.abs(roots(m, v)) for v in speeds]))
    np.testing.assert_allclose(frequency[:, :2], sd(hertz), rtol=1e-5)
    np.testing.assert_allclose(damping[:, :2], sd(ratio), rtol=1e-5)
    assert np.isnan(frequency[:, 2]).all()
    assert np.isnan(damping[:, 2]).all()
    alone = mode_sd(here, 9.0, eigenvalues[1, 0], NAMES, SPREAD)
    assert alone == (pytest.approx(frequency[1, 0]), pytest.approx(damping[1, 0]))
    none = mode_sd(here, 9.0, [], NAMES, SPREAD)
    assert none[0].shape == none[1].shape == (0,)


def test_a_name_without_wheel_is_both_wheels():
    """The same length on both wheels, not known better than 3 mm: rear and front are wholly correlated."""
    here = model(0.1, 0.1)
    critical = critical_speeds(here.linear_model())
    whole = critical_speed_gradients(here, critical, ["relaxation_length.relaxation_length"])
    both = standard_deviation(whole, [[9e-6]])
    apart = standard_deviation(critical_speed_gradients(here, critical, NAMES[:2]), [[9e-6, 9e-6], [9e-6, 9e-6]])
    ends = [[c.speed for c in critical_speeds(model(0.1 + h, 0.1 + h).linear_model())] for h in (1e-5, -1e-5)]
    np.testing.assert_allclose(both, np.abs(np.subtract(*ends)) / 2e-5 * 3e-3, rtol=1e-4, atol=1e-7)
    np.testing.assert_allclose(apart, both, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("names", "covariance", "words"), [
    (["c", "c"], np.eye(2), "c is given twice; keep one"),
    (["c", "w"], np.eye(3), "covariance of c, w must be 2 x 2 finite numbers"),
    (["c"], [[np.nan]], "covariance of c must be 1 x 1 finite numbers"),
    (["c", "w"], [[1.0, 2.0], [2.0, 1.0]], "symmetric without negative eigenvalues"),
    (["c", "w"], [[1.0, 0.5], [0.1, 1.0]], "symmetric without negative eigenvalues"),
    (["c", "w"], [[0.0, 1e-3], [1e-3, 1.0]], "symmetric without negative eigenvalues"),
    (["c", "mB"], [[1e-12, 2e-3], [2e-3, 1e6]], "symmetric without negative eigenvalues"),
    ([], np.empty((0, 0)), "no parameter is uncertain"),
])  # fmt: skip
def test_what_is_no_covariance_is_refused(names, covariance, words):
    with pytest.raises(InputError, match=words):
        checked_covariance(names, covariance)


def test_speeds_and_eigenvalues_must_match():
    with pytest.raises(InputError, match=r"2 speeds, but eigenvalues of shape \(3,\); give a row for each speed"):
        mode_sd(model(), [5.0, 9.0], [1j, 2j, 3j], ["c"], [[1e-6]])


def test_small_parameters_beside_large_ones_are_a_covariance():
    """Units differ by many powers of ten; only correlations say what a covariance is."""
    checked_covariance(["c", "mB"], np.diag([1e-12, 1e6]))
    checked_covariance(["c", "mB"], [[1e-12, -1e-3], [-1e-3, 1e6]])
