"""The checks before a name, against the probabilities that they state; whiteness against Ljung & Box (1978)."""

import numpy as np
import pytest
from scipy.stats import chi2

from studies.diagnosis import diagnose, read_measurement
from studies.inference import Candidate, Fit, Kind, Rows, UncertainParameter, left_over, whiteness, within_uncertainty

COUNT = 400


class OneSeries(Kind):
    nuisances, candidates = (), ()

    def __init__(self, count=COUNT, inputs=None):
        self.rows = Rows(("x",) * count, np.arange(float(count)), ("x",) * count, np.zeros(count, int), inputs)


def p_value(residual, inputs=None):
    count = len(residual)
    nothing = np.empty((count, 0))
    done = Fit((), (), np.empty(0), np.empty((0, 0)), residual, nothing, float(residual @ residual), 0.0)
    return whiteness(OneSeries(count, inputs), done)


def noise(seed, count=COUNT):
    return np.random.default_rng(seed).standard_normal(count)


def ljung_box(residual, lags=10):
    """Q = n (n + 2) sum rho_k^2 / (n - k), Ljung & Box (1978), Biometrika 65, 297-303, eq. 1.1, term by term."""
    n, r = len(residual), residual - residual.mean()
    total = 0.0
    for lag in range(1, lags + 1):
        rho = sum(r[t] * r[t - lag] for t in range(lag, n)) / sum(x * x for x in r)
        total += rho**2 / (n - lag)
    return n * (n + 2) * total


@pytest.mark.parametrize("seed", range(6))
def test_whiteness_is_the_probability_of_ljung_and_box(seed):
    """The moments of 200 simulated series stand in for those of chi^2: a few hundredths."""
    residual = noise(seed)
    assert p_value(residual) == pytest.approx(chi2.sf(ljung_box(residual), 10), abs=0.06)


@pytest.mark.parametrize("memory", [0.4, -0.4])
def test_a_residual_with_memory_is_not_white(memory):
    residual = noise(0)
    for t in range(1, COUNT):
        residual[t] += memory * residual[t - 1]
    assert p_value(residual) < 1e-6


@pytest.mark.parametrize("lag", [0, 3, 9])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_residual_that_follows_an_input_is_not_white(lag, sign):
    """Input and residual are white each: only the correlation of the two gives it away."""
    driving, rest = noise(2), noise(3)
    following = rest + sign * 0.5 * np.r_[np.zeros(lag), driving[: COUNT - lag]]
    assert p_value(following) > 0.01
    assert p_value(following, driving[:, None]) < 1e-6


def test_an_input_that_has_nothing_to_do_with_the_residual_leaves_it_white():
    assert p_value(noise(4), noise(5)[:, None]) > 0.05


def test_the_smaller_of_two_probabilities_is_doubled():
    """A constant input has no correlation with anything: its probability is one, and that of Ljung-Box doubles."""
    residual = noise(8)
    assert 0 < p_value(residual) < 0.5
    assert p_value(residual, np.ones((COUNT, 1))) == pytest.approx(2 * p_value(residual), rel=1e-9)


@pytest.mark.parametrize("level", [0.0, 0.1, -3.7e5])
def test_a_constant_residual_has_no_memory(level):
    """What rounding leaves of a constant less its mean must not count as memory."""
    assert p_value(np.full(12, level)) == 1.0


def test_a_series_of_fewer_than_eight_is_not_judged():
    assert p_value(np.array([1.0, -1, 1, -1, 1, -1, 1])) == 1.0
    assert p_value(np.tile([1.0, -1.0], 20)) < 1e-3


def test_a_real_root_at_many_speeds_is_diagnosed(tmp_path):
    """Capsize with imaginary part 0 in every row: that series has no scatter at all. Values of the benchmark bicycle,
    Meijaard et al. (2007), table 2, between its speeds by a smooth curve."""
    published = {5: -0.32286642900409, 6: -0.00406690076970, 7: 0.10268170574766, 8: 0.14327879765713,
                 9: 0.15790184030917, 10: 0.16105338653172}  # fmt: skip
    speeds = np.linspace(5.0, 10.0, 12)
    real = np.interp(speeds, list(published), list(published.values()))
    rows = "".join(f"{v:.4f},capsize,{x:.5f},0,0.05,0.05\n" for v, x in zip(speeds, real, strict=True))
    (tmp_path / "capsize.csv").write_text("speed_m_s,mode,real_1_s,imag_rad_s,real_sd_1_s,imag_sd_rad_s\n" + rows)
    (tmp_path / "m.toml").write_text('kind = "modal"\nbicycle = "benchmark"\n[modal]\ntable = "capsize.csv"\n')
    assert diagnose(read_measurement(tmp_path / "m.toml")).verdict.verdict == "none"


@pytest.mark.parametrize(
    ("at", "names"), [(0.0, ["share.size"]), (0.5, []), (0.9999, ["share.size"]), (1.0, ["share.size"])]
)
def test_a_size_that_ends_at_either_bound_is_told(at, names):
    size = UncertainParameter("size", "1", {"share": 1.0}, 0.5, 0.2, lowest=0.0, highest=1.0, size=True)
    share = Candidate("share", (size,))
    done = Fit((share,), (size,), np.array([float(at)]), np.eye(1), np.zeros(9), np.zeros((9, 1)), 0.0, 0.0)
    assert done.sizes_at_bound() == names
    assert done.admissible == (not names)


def shifted(rng, jacobian, *, off=1.0):
    """A fit of linear data whose parameters lie ``off`` prior sd from their means, by the normal equations."""
    count = jacobian.shape[1]
    units = np.array([0.5, 20.0, 1e-3, 3.0])[:count]  # prior sd
    data = jacobian @ (off * rng.standard_normal(count)) + rng.standard_normal(len(jacobian))
    covariance = np.linalg.inv(np.eye(count) + jacobian.T @ jacobian)
    went = covariance @ jacobian.T @ data
    unknowns = tuple(UncertainParameter(f"u{k}", "1", {f"u{k}": 1.0}, 7.0, float(u)) for k, u in enumerate(units))
    theta, spread = 7.0 + units * went, covariance * np.outer(units, units)
    return Fit((), unknowns, theta, spread, data - jacobian @ went, -jacobian / units, 0.0, 0.0)


def test_how_far_parameters_went_has_the_probability_that_is_said():
    """Drawn from their priors: p is even, with parameters that the data tell and that they do not."""
    jacobian = np.array([3.0, 1.0, 0.3, 0.0]) * np.random.default_rng(1).standard_normal((12, 4))
    rng = np.random.default_rng(2)
    p = np.array([within_uncertainty(shifted(rng, jacobian)) for _ in range(2000)])
    for below in (0.01, 0.05, 0.5):
        assert abs(np.mean(p < below) - below) < 3 * np.sqrt(below / 2000) + 0.3 * below
    far = np.array([within_uncertainty(shifted(rng, jacobian, off=5.0)) for _ in range(200)])
    assert np.mean(far < 0.01) > 0.7


@pytest.mark.parametrize("count", [1, 2, 4])
def test_parameters_that_the_data_tell_by_half_go_as_far_as_chi_squared_says(count):
    """Data as sure as the prior: each goes N(0, 1/2) in prior sd, so twice the sum of squares is chi^2."""
    done = shifted(np.random.default_rng(count), np.eye(count))
    went = (done.theta - 7.0) / np.array([u.scale for u in done.unknowns])
    assert within_uncertainty(done) == pytest.approx(chi2.sf(2 * went @ went, count), rel=1e-9)


def test_parameters_of_which_the_data_tell_nothing_are_within():
    rng = np.random.default_rng(3)
    assert within_uncertainty(shifted(rng, np.zeros((5, 3)))) == 1.0
    assert within_uncertainty(shifted(rng, np.zeros((5, 0)))) == 1.0


class WithTerms(Kind):
    """Linear data: one nuisance, an effect, and terms without a cause; slopes (rows, 2 + terms)."""

    nuisances = (UncertainParameter("u", "1", {"u": 1.0}, 0.0, 0.5),)
    candidates = (Candidate("effect", (UncertainParameter("size", "1", {"e": 1.0}, 0.0, 2.0, size=True),)),)

    def __init__(self, slopes, data):
        self.slopes, self.readings = slopes, data
        self.rows = Rows(("x",) * len(data), np.arange(float(len(data))), ("x",) * len(data), np.zeros(len(data), int))

    def directions(self):
        names = [f"term {k}" for k in range(self.slopes.shape[1] - 2)]
        return tuple(Candidate(n, (UncertainParameter("gain", "1", {n: 1.0}, 0.0, 1.0, size=True),)) for n in names)

    def residual(self, candidates, theta, *, slopes=True):
        columns = [0, *([1] if candidates else []), *(2 + int(c.identifier[-1]) for c in candidates[1:])]
        return self.readings - self.slopes[:, columns] @ theta, -self.slopes[:, columns]

    def fitted(self):
        """By the normal equations of data and prior."""
        j, weight = self.slopes[:, :2], np.diag([1 / 0.5**2, 1 / 2.0**2])
        covariance = np.linalg.inv(j.T @ j + weight)
        theta = covariance @ j.T @ self.readings
        unknowns = (*self.nuisances, *self.candidates[0].unknowns)
        return Fit(self.candidates, unknowns, theta, covariance, self.readings - j @ theta, -j, 0.0, 0.0)


def drawn(rng, slopes, gains=0.0):
    truth = np.r_[0.5 * rng.standard_normal(), 2.0 * rng.standard_normal(), np.broadcast_to(gains, slopes.shape[1] - 2)]
    forward = WithTerms(slopes, slopes @ truth + rng.standard_normal(len(slopes)))
    return left_over(forward, forward.fitted())


def test_what_is_left_for_terms_has_the_probability_that_is_said():
    """Where the hypothesis is true p is so seldom below, also with terms like each other and like the effect."""
    rng = np.random.default_rng(4)
    slopes = rng.standard_normal((30, 5)) * np.array([3.0, 1.0, 2.0, 0.1, 5.0])
    slopes[:, 3] += slopes[:, 2]
    slopes[:, 4] += 2 * slopes[:, 1]
    p = np.array([drawn(rng, slopes)[0] for _ in range(2000)])
    for below in (0.01, 0.05, 0.5):
        assert 0.3 * below < np.mean(p < below) < below + 3 * np.sqrt(below / 2000)  # two questions at once: a bound


def test_what_is_left_is_found_and_the_term_named():
    rng = np.random.default_rng(5)
    slopes = rng.standard_normal((30, 5))
    found = [drawn(rng, slopes, [0.0, 1.2, 0.0]) for _ in range(100)]
    assert np.mean([p < 0.01 for p, _ in found]) > 0.9
    assert np.mean([name == "term 1" for _, name in found]) > 0.9


def test_a_term_that_the_hypothesis_takes_says_nothing():
    rng = np.random.default_rng(6)
    slopes = rng.standard_normal((30, 2)) * 20
    assert drawn(rng, slopes[:, [0, 1, 1]]) is None
    assert drawn(rng, np.c_[slopes, np.zeros(30)]) is None
    assert drawn(rng, slopes) is None
