"""Speed of the paths a sweep takes: run with ``pytest tests/benchmarks --benchmark-only``.

The table of docs/benchmarks.md, with ratios to peers, comes from ``velotyre validate speed``.
"""

import importlib.util

import numpy as np
import pytest

from bicycle import Model, load_bicycle
from bicycle.critical.critical_speeds import critical_speeds
from bicycle.eigenvalues.solvers import compiled, eigenvalues, lapack
from bicycle.model_family import ModelFamily
from bicycle.sensitivity.eigenvalue_derivatives import sensitivities
from studies.validations import _speed_of_charts as of_charts
from studies.validations import _speed_of_eigenvalues as of_eigenvalues
from studies.validations import _speed_of_studies as of_studies
from studies.validations import _speed_timing as timing

SOLVERS = [
    pytest.param(lapack, id="numpy"),
    pytest.param(
        compiled, id="fast", marks=pytest.mark.skipif(not importlib.util.find_spec("numba"), reason="needs numba")
    ),
]
COUNT = 4096


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("order", [8, 12])
def test_eigenvalues_of_a_stack(benchmark, solver, order):
    stack = timing.tyre_model(order).linear_model().state_matrix(np.linspace(0.1, 30, COUNT))
    found = benchmark(eigenvalues, stack, solver=solver)
    np.testing.assert_allclose(found.sum(1).real, np.trace(stack, axis1=1, axis2=2), rtol=1e-9)


@pytest.mark.parametrize("solver", SOLVERS)
def test_eigenvalues_along_speed(benchmark, solver):
    linear = Model(load_bicycle("benchmark")).linear_model()
    assert benchmark(linear.eigenvalues, np.linspace(0, 10, COUNT), solver=solver).shape == (COUNT, 4)


@pytest.mark.parametrize("solver", SOLVERS)
def test_distinct_bicycles_with_assembly(benchmark, solver):
    model = timing.tyre_model(8)
    family, masses = ModelFamily(model, ("mB",)), np.linspace(70, 100, COUNT)

    def together():
        polynomial, _ = family.polynomials({"mB": masses}, COUNT, solver=solver)
        return eigenvalues(polynomial(np.array([[8.0]])), solver=solver)

    assert benchmark(together).shape == (COUNT, 1, 8)


@pytest.mark.parametrize("order", [8, 12])
def test_critical_speeds_with_names(benchmark, order):
    linear = timing.tyre_model(order).linear_model()
    assert len(benchmark(critical_speeds, linear)) == len(of_studies.grid_crossings(linear))


@pytest.mark.parametrize("order", [8, 12])
def test_gradients_in_all_parameters(benchmark, order):
    found = benchmark(sensitivities, timing.tyre_model(order), np.linspace(1, 30, COUNT))
    assert found.derivatives.shape == (COUNT, order, len(found.parameters))


def test_peer_over_speeds(benchmark):
    pytest.importorskip("bicycleparameters", reason="the peer is not installed")
    peer = of_eigenvalues.peer_model()
    assert benchmark(peer.calc_eigen, v=np.linspace(0, 10, 500))[0].shape == (500, 4)


def test_stability_chart(benchmark):
    found = benchmark(of_charts.chart)
    assert min(len(curve) for curve in found.curves) >= 200
    assert not found.check.wrong.any()


def test_design_of_three_numbers(benchmark):
    found = benchmark(of_charts.design)
    assert found.after.kept
    assert of_charts.cheaper(found)[0] == 0
