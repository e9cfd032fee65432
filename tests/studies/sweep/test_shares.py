"""Shares of the variance against closed forms: the Ishigami function, sums and products on a grid, and no effect."""

import numpy as np
import pytest

from studies.sweep import Normal, Varied, find_correlated, shares, stated_correlations


def drawn(*columns):
    return [Varied(f"x{k}", "", np.asarray(x)[None]) for k, x in enumerate(columns, 1)]


def on_grid(*levels):
    mesh = np.meshgrid(*levels, indexing="ij")
    return [Varied(f"g{k}", "", x.reshape(-1, 1)) for k, x in enumerate(mesh, 1)], mesh


def test_ishigami():
    """sin x1 + a sin^2 x2 + b x3^4 sin x1 on (-pi, pi)^3.

    Ishigami & Homma 1990 (Proc. ISUMA, 398) give V = a^2/8 + b pi^4/5 + b^2 pi^8/18 + 1/2, V1 = (1 + b pi^4/5)^2/2,
    V2 = a^2/8, V3 = 0.
    """
    a, b = 7.0, 0.1
    x = np.random.default_rng(1).uniform(-np.pi, np.pi, (3, 20_000))
    y = np.sin(x[0]) + a * np.sin(x[1]) ** 2 + b * x[2] ** 4 * np.sin(x[0])
    found = shares(y[None], drawn(*x), resamples=20)
    whole = a**2 / 8 + b * np.pi**4 / 5 + b**2 * np.pi**8 / 18 + 0.5
    exact = [(1 + b * np.pi**4 / 5) ** 2 / 2 / whole, a**2 / 8 / whole, 0.0]
    assert list(found["first_order"]) == pytest.approx(exact, abs=0.025)
    assert found["half_width_95"].between(0, 0.03, inclusive="neither").all()
    assert found["total"].isna().all()  # such a sample does not tell it


def test_a_parameter_without_effect_gets_no_share_on_average_and_the_interval_holds():
    """Chance in the means is taken off, also of few bicycles; 95 % of the intervals hold 0."""
    rng, first, held = np.random.default_rng(2), [], 0
    for _ in range(100):
        x, y = rng.normal(size=(2, 60))
        one = shares(y[None], drawn(x), resamples=40).loc[0]
        first.append(one["first_order"])
        held += abs(one["first_order"]) <= one["half_width_95"]
    assert abs(np.mean(first)) < 4 * np.std(first) / np.sqrt(100)
    assert held > 85


def test_sum_on_a_grid_is_shared_exactly():
    """y = 3 a + b with a in 0, 1, 2 and b in 0, 1: variances 9 * 2/3 and 1/4, totals the same."""
    varied, (a, b) = on_grid([0.0, 1.0, 2.0], [0.0, 1.0])
    found = shares((3 * a + b).reshape(-1, 1), varied)
    exact = [6 / 6.25, 0.25 / 6.25]
    assert list(found["first_order"]) == pytest.approx(exact)
    assert list(found["total"]) == pytest.approx(exact)
    assert list(found["half_width_95"]) == [0, 0]


def test_grid_and_sample_together_with_common_draws():
    """y = g + x, the same x in every cell: variances 1 (g = -1, 1) and 4."""
    varied, (g,) = on_grid([-1.0, 1.0])
    x = np.random.default_rng(3).normal(0, 2, 4000)
    x = (x - x.mean()) / x.std() * 2
    found = shares(g.reshape(-1, 1) + x[None], [*varied, *drawn(x)], resamples=20)
    assert list(found["first_order"]) == pytest.approx([0.2, 0.8], abs=0.01)
    assert found["total"][0] == pytest.approx(0.2)


def test_names_and_lost_values():
    varied = [Varied("tyre", "", np.array(["a", "b", "c", "d"])[:, None])]
    assert shares(np.array([[1.0], [1.0], [3.0], [3.0]]), varied)["first_order"].item() == pytest.approx(1)
    lost = shares(np.array([[1.0], [np.nan], [3.0], [3.0], [2.0]]), [Varied("g", "", np.arange(5.0)[:, None])])
    assert np.isnan(lost["total"].item())
    assert shares(np.full((8, 1), 2.0), [Varied("g", "", np.arange(8.0)[:, None])]).empty  # nothing varies
    assert shares(np.arange(3.0)[:, None], [Varied("g", "", np.arange(3.0)[:, None])]).empty
    few = np.random.default_rng(0).normal(size=(1, 39))
    assert shares(few, drawn(few[0])).empty


def test_correlations_are_found_and_chance_is_not():
    rng = np.random.default_rng(4)
    x, noise = rng.normal(size=(2, 2000))
    varied = drawn(x, noise, 0.6 * x + 0.8 * rng.normal(size=2000))
    ((first, second, r),) = find_correlated(varied, np.ones((1, 2000), bool))
    assert (first, second) == ("x1", "x3")
    assert r == pytest.approx(6 / np.pi * np.arcsin(0.3), abs=0.05)  # Spearman's of a normal pair (Pearson 1907)
    assert find_correlated(varied[:2], np.ones((1, 2000), bool)) == []
    group = Normal(("xB", "zB"), (0.3, -1.0), ((0.02, 0.0), (-0.015, 0.02)))
    ((first, second, r),) = stated_correlations([group, Normal(("mB",), (80.0,), ((2.0,),))])
    assert (first, second) == ("xB", "zB")
    assert r == pytest.approx(-0.6)
