"""Signs that the literature agrees on, with a single-lag tyre on bicycles with a rider.

Sources: Bulsink, Doria, van de Belt & Koopman (2015), Advances in Mechanical Engineering 7(12), abstract: a real tyre
stabilises capsize, mainly by its twisting torque; arm stiffness destabilises capsize and arm damping destabilises
weave. Doria & Tognazzo (2014), IMechE C 228, abstract: uncontrolled arm stiffness destroys self-stability, arm damping
reduces its region. That a fork's bending matters more than its torsion is said of wobble models in general; here it
follows from the stiffness that both have and the small inertia that torsion moves.
"""

import numpy as np
import pytest

from bicycle import load_bicycle
from bicycle.stability import critical_speeds
from tests.published.papers import arms, slowest_real, tyred, weave

RIDDEN = ("pista_charlie_drops", "rigid_rider", "pista_rider", "benchmark")
SPEEDS = (5.0, 7.0, 9.0, 12.0, 15.0, 20.0)


def self_stable(model) -> tuple[float, float]:
    """From the speed at which the last slow pair becomes stable to that at which a real root becomes unstable, m/s."""
    speeds = np.linspace(2.0, 12.0, 2001)
    values = model.eigenvalues(speeds)
    stable = (values.real < 0).all(axis=1)
    found = speeds[stable]
    return (float(found[0]), float(found[-1])) if len(found) else (np.inf, -np.inf)


@pytest.mark.parametrize("name", RIDDEN)
@pytest.mark.parametrize("speed", SPEEDS)
def test_twisting_torque_stabilises_capsize(name, speed):
    roots = [slowest_real(tyred(name), speed)]
    roots += [slowest_real(tyred(name, twisting_torque={"twisting_stiffness": k}), speed) for k in (0.5, 1.0, 2.0, 3.0)]
    assert (np.diff(roots) < 0).all()


@pytest.mark.parametrize("name", RIDDEN)
@pytest.mark.parametrize("speed", SPEEDS)
def test_arm_stiffness_destabilises_capsize(name, speed):
    roots = [slowest_real(tyred(name), speed)]
    roots += [slowest_real(tyred(name, **arms(stiffness=k)), speed) for k in (1.0, 2.0, 5.0, 10.0, 30.0)]
    assert (np.diff(roots) > 0).all()


@pytest.mark.parametrize("name", RIDDEN)
def test_arm_stiffness_destroys_self_stability(name):
    low, high = self_stable(tyred(name))
    assert high > low + 1.0
    assert self_stable(tyred(name, **arms(stiffness=10.0))) == (np.inf, -np.inf)


@pytest.mark.parametrize("name", RIDDEN)
def test_arm_damping_destabilises_weave_and_reduces_the_region_of_self_stability(name):
    models = [tyred(name, **arms(damping=c)) for c in (0.0, 0.5, 1.0, 2.0, 3.0)]
    for speed in (7.0, 9.0, 12.0, 15.0, 20.0):
        assert (np.diff([weave(model, speed).real for model in models]) > 0).all(), speed
    regions = [self_stable(model) for model in models]
    assert (np.diff([low for low, _ in regions]) > 0).all()
    assert len({high for _, high in regions}) == 1  # where capsize crosses zero nothing moves


@pytest.mark.parametrize("name", ["browser", "pista"])
def test_without_a_rider_some_arm_damping_stabilises_weave(name):
    """The abstracts are about bicycles with riders: a light one is better off with a little damping."""
    assert weave(tyred(name, **arms(damping=0.5)), 7.0).real < weave(tyred(name), 7.0).real


@pytest.mark.parametrize("name", ["pista_charlie_drops", "rigid_rider", "benchmark"])
@pytest.mark.parametrize("stiffness", [2500.0, 5000.0])
def test_bending_of_the_fork_matters_more_than_its_torsion(name, stiffness):
    """Hinge across and along the steer axis; what stands between hinge and wheel in torsion is the handlebar.

    A hinge on the steer axis is in series with the steering, so the handlebar's 0.05 kg m^2 is on the steering here.
    """
    v = load_bicycle(name).values
    bar = arms(inertia=0.05)
    at = {"stiffness": stiffness, "damping": 20.0, "joint_z": -0.65,
          "joint_x": v["w"] + v["c"] - 0.65 * np.tan(v["lam"])}  # fmt: skip
    rigid = tyred(name, **bar)
    bending = tyred(name, **bar, front_compliance=at | {"axis_tilt": v["lam"]})
    torsion = tyred(name, **bar, front_compliance=at | {"axis_tilt": v["lam"] - np.pi / 2})
    for speed in (5.0, 10.0, 15.0, 20.0):
        values = rigid.eigenvalues(speed)
        fast = values[(values.imag > 8 * np.pi) & (values.imag < 26 * np.pi)]
        wobble = fast[np.abs(fast.imag).argmin()]
        shifts = [np.abs(model.eigenvalues(speed) - wobble).min() for model in (bending, torsion)]
        assert shifts[0] > 10 * shifts[1], speed
        growth = [max(values[values.imag > 8 * np.pi].real) for values in (
            model.eigenvalues(speed) for model in (bending, torsion))]  # fmt: skip
        assert growth[0] > growth[1] + 2.0, speed  # bending takes the damping away, torsion does not


def test_capsize_speed_does_not_depend_on_the_damping_of_the_arms():
    models = [tyred("benchmark", **arms(damping=c)) for c in (0.0, 1.0, 3.0)]
    found = [next(c.speed for c in critical_speeds(one, max_speed=20.0) if c.kind == "real") for one in models]
    assert found == pytest.approx([found[0]] * 3, abs=1e-9)
