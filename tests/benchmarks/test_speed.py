"""Speed of the paths a sweep takes: run with ``pytest tests/benchmarks --benchmark-only``."""

import numpy as np
import pytest

from bicycle import Model, ModelFamily, critical_speeds, effect_class, load_bicycle, modes
from bicycle.stability import Rules, critical_speeds_of_many, name_stack, sensitivities
from studies.chart import Plane, stability_chart

COUNT = 4096
TYRE = {"cornering_stiffness": 6302.5, "relaxation_length": 0.1}
HINGE = {"stiffness": 3000.0, "damping": 15.0, "joint_x": 0.8, "joint_z": -0.85}
RIDER = {"mass": 30.0, "x": 0.3, "z": -1.0, "Ixx": 1.0, "Izz": 0.5, "joint_z": -0.9}


def tyre_model(order):
    """The benchmark bicycle on tyres (8 states), or with flexible front and rider, too (12)."""
    tables = {"relaxation_length": TYRE} | ({"front_compliance": HINGE, "rider_lean": RIDER} if order == 12 else {})
    return Model(load_bicycle("benchmark"), tuple(effect_class(name)(**table) for name, table in tables.items()))


@pytest.mark.parametrize("order", [8, 12])
def test_eigenvalues_along_speed(benchmark, order):
    linear = tyre_model(order).linear_model()
    assert benchmark(linear.eigenvalues, np.linspace(0.1, 30, COUNT)).shape == (COUNT, order)


@pytest.mark.parametrize("order", [8, 12])
def test_named_modes_of_one_bicycle(benchmark, order):
    linear = tyre_model(order).linear_model()
    assert "weave" in benchmark(modes, linear, np.linspace(0.5, 30, 60)).names


@pytest.mark.parametrize("order", [8, 12])
def test_named_modes_of_many_bicycles(benchmark, order):
    """60 speeds each of 100 bicycles that differ in trail and mass."""
    model, rng = tyre_model(order), np.random.default_rng(0)
    numbers = {"c": rng.uniform(0.06, 0.1, 100), "mB": rng.uniform(60, 100, 100)}
    polynomial, _ = ModelFamily(model, ("c", "mB")).polynomials(numbers, 100)
    unit = np.full(100, np.sqrt(9.81 * model.bicycle["w"]))
    speeds = np.broadcast_to(np.linspace(0.5, 30, 60), (100, 60))
    named = benchmark(name_stack, Rules.of(model.linear_model()), polynomial, unit, 9.81, speeds)
    assert named.values.shape == (100, 60, order)


@pytest.mark.parametrize("order", [8, 12])
def test_critical_speeds_of_many_bicycles(benchmark, order):
    numbers = {"c": np.linspace(0.06, 0.1, 100)}
    found, refused = benchmark(critical_speeds_of_many, ModelFamily(tyre_model(order), ("c",)), numbers, 100)
    assert all(found)
    assert not refused


@pytest.mark.parametrize("order", [8, 12])
def test_critical_speeds_with_names(benchmark, order):
    assert benchmark(critical_speeds, tyre_model(order))


@pytest.mark.parametrize("order", [8, 12])
def test_gradients_in_all_parameters(benchmark, order):
    found = benchmark(sensitivities, tyre_model(order), np.linspace(1, 30, COUNT))
    assert found.derivatives.shape == (COUNT, order, len(found.parameters))


def test_a_peer_over_speeds(benchmark):
    models = pytest.importorskip("bicycleparameters.models", reason="the peer is not installed")
    sets = pytest.importorskip("bicycleparameters.parameter_sets")
    values = dict(load_bicycle("benchmark").values) | {"v": 1.0, "IByy": 11.0, "IHyy": 0.06}
    peer, speeds = models.Meijaard2007Model(sets.Meijaard2007ParameterSet(values, True)), np.linspace(0, 10, 500)
    found = np.sort_complex(benchmark(peer.calc_eigen, v=speeds)[0])
    ours = np.sort_complex(Model(load_bicycle("benchmark")).linear_model().eigenvalues(speeds))
    np.testing.assert_allclose(found[-5:], ours[-5:], rtol=1e-8)


def test_stability_chart(benchmark):
    tyre = {"relaxation_length": {"cornering_stiffness": 6500.0, "relaxation_length": 0.11}}
    plane = Plane.of({"bicycle": "benchmark", "effects": tyre}, "speed=1:12", "c=0.02:0.12")
    found = benchmark(lambda: stability_chart(plane, step=1 / 200))
    assert min(len(curve) for curve in found.curves) >= 200
