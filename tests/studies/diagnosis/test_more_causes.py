"""Mistakes of sensors and files, dry friction and luggage: each is put into synthetic data, and fitted back.

Motion comes from published matrices or from own simulations (``published_bicycle``); a channel is spoilt by editing it.
"""

from dataclasses import replace

import numpy as np
import pytest
from point_mass import enlarged
from published_bicycle import ride, weave
from scipy.signal import lfilter
from small_library import among

from bicycle import Model, load_bicycle
from bicycle.identification import Run
from bicycle.stability import modes
from studies.diagnosis import Histories, Modal, ModalPoint, find_candidates
from studies.inference import UncertainParameter, fit
from tyre.ground import InputError

SPEEDS = (4.6, 5.2, 5.8, 6.4)
NOISE = {"roll_rate_rad_s": 0.004, "steer_rad": 0.002}
EXACT = dict.fromkeys(("w", "c", "lam", "rR", "rF", "mB", "xB", "zB", "IBxx", "IBzz", "IBxz", "IHzz", "xH", "zH"), 0.0)


def torque(t):
    return 2.0 * np.sin(2 * np.pi * 0.9 * t) + 1.0 * np.sin(2 * np.pi * 2.3 * t + 1)


def runs(
    *, spoil=lambda channels, time: channels, shown=lambda speed: speed, friction=0.0, every=10, seed=1, driven=1.0
):
    """Rides at four speeds, spoilt at 1 kHz by ``spoil``, sampled at 100 Hz, with white noise.

    ``driven`` is a factor of the torque.
    """
    rng, found = np.random.default_rng(seed), []
    for speed in SPEEDS:
        time, x = ride(speed, 2.5, lambda t: driven * torque(t), friction=friction)
        channels = spoil({"roll_rate_rad_s": x[:, 2].copy(), "steer_rad": x[:, 1].copy()}, time)
        seen = {name: y[::every] + NOISE[name] * rng.standard_normal(len(y[::every])) for name, y in channels.items()}
        given = {"steer_torque_N_m": torque(time[::every])}
        found.append(Run(f"{speed}", shown(speed), time[::every], seen, given))
    return tuple(found)


def histories(recorded, bicycle=None, **rest):
    model = Model(bicycle or load_bicycle("benchmark"))
    return Histories(name="own", model=model, runs=recorded, noise_sd=NOISE, **rest)


def fitted(measurement, identifier, **how):
    """Value and sd of the first unknown of a candidate, chi^2 a number with it, and the objective without it."""
    forward = measurement.prepare(**how)
    candidate = next(c for c in forward.candidates if c.identifier == identifier)
    found = fit(forward, (candidate,))
    where = found.columns(candidate)
    sd = np.sqrt(np.diag(found.covariance)[where])
    null = fit(forward)
    return found.theta[where], sd, found.chi2 / len(found.residual), null.objective - found.objective


def lag(tau, *, start):
    """A first-order low-pass at 1 kHz (bilinear), in step with the signal at first or at rest."""

    def spoil(channels, time):
        k = 2 * tau / (time[1] - time[0])
        b, a = np.array([1, 1]) / (1 + k), [1, (1 - k) / (1 + k)]
        u = channels["roll_rate_rad_s"]
        zi = [(b[1] - a[1] * b[0]) * u[0] / (b[0] + b[1]) * (1 + a[1])] if start == "in step" else [0.0]
        channels["roll_rate_rad_s"] = lfilter(b, a, u, zi=zi)[0]
        return channels

    return spoil


@pytest.mark.parametrize("start", ["in step", "at rest"])
def test_a_low_pass_is_found_with_its_time_constant(start):
    (tau,), (sd,), chi2, gain = fitted(histories(runs(spoil=lag(0.03, start=start))), "roll_rate_lowpass")
    assert tau == pytest.approx(0.03, abs=4 * sd)
    assert sd < 1e-3
    assert chi2 == pytest.approx(1.0, abs=0.1)
    assert gain > 100


def test_a_drift_is_found_where_a_bias_is_not_enough():
    def walk(channels, time):
        channels["steer_rad"] += 0.01 + 0.02 * (time / time[-1] - 0.5)
        return channels

    measurement = histories(runs(spoil=walk))
    forward = measurement.prepare()
    ends = {c.identifier: fit(forward, (c,)) for c in forward.candidates if c.identifier in ("bias", "drift")}
    assert ends["drift"].chi2 / len(ends["drift"].residual) == pytest.approx(1.0, abs=0.1)
    assert ends["drift"].log_evidence > ends["bias"].log_evidence + 20
    both = tuple(c for c in forward.candidates if c.identifier in ends)
    assert not forward.compatible(both)
    assert forward.compatible(both[:1])


def test_an_offset_of_the_speed_is_told_from_a_scale():
    measurement = histories(runs(shown=lambda speed: speed - 0.2), uncertainty=EXACT)
    (offset,), (sd,), chi2, gain = fitted(measurement, "speed_offset")
    assert offset == pytest.approx(0.2, abs=4 * sd)
    assert chi2 == pytest.approx(1.0, abs=0.1)
    assert gain > 50
    one = Histories(name="one", model=measurement.model, runs=measurement.runs[:1], noise_sd=NOISE).prepare()
    assert "one speed: an offset equals a scale" in one.refused["speed_offset"]
    assert "speed_offset" not in {c.identifier for c in one.candidates}


@pytest.mark.parametrize("factor", [1 / 1.4, 1.2])
def test_which_of_two_sensors_is_wrong_cannot_be_told_from_a_free_motion(factor):
    """Only their ratio is seen: one reads so many times too much, or the other too little."""

    def spoil(channels, time):
        channels["steer_rad"] *= factor
        return channels

    free = tuple(replace(run, inputs={}) for run in runs(spoil=spoil, driven=0.0))
    measurement = histories(free, uncertainty=EXACT)
    tried = ("steer_scale", "roll_rate_scale", "steer_damper", "steer_spring", "bias")
    verdict = among(measurement, tried).verdict
    assert set(verdict.equivalent) == {"steer_scale", "roll_rate_scale"}
    assert verdict.verdict == ("class" if factor == 1.2 else "tentative")  # beyond 1.35 a size that seldom occurs
    (effect,) = verdict.effects
    value, sd = effect.parameters["scale"]
    true = factor if effect.identifier == "steer_scale" else 1 / factor
    assert value == pytest.approx(true - 1, abs=4 * sd)


def test_a_factor_and_its_reciprocal_are_errors_of_one_size():
    (steer,) = (c for c in histories(runs()).prepare().candidates if c.identifier == "steer_scale")
    size = steer.unknowns[0]
    over, under = np.log(1.4), np.log(1 / 1.4)
    assert over - size.centre == pytest.approx(size.centre - under)
    np.testing.assert_allclose(size.value(np.array([over, under])), [0.4, 1 / 1.4 - 1])
    assert size.slope(over) == pytest.approx(1.4)
    (alone,) = (c for c in modal().prepare().candidates if c.identifier == "steer_sensor_scale")
    assert "reads wrong relative to the lean sensor by a constant factor" in alone.signature
    with pytest.raises(ValueError, match="steer: power = 1 must be 0"):
        UncertainParameter("steer", "1", {}, 0.0, 0.1, relative=True)


def test_dry_friction_of_the_steering_is_found():
    (size,), (sd,), chi2, gain = fitted(histories(runs(friction=0.25)), "steer_friction")
    assert size == pytest.approx(0.25, abs=max(4 * sd, 0.02))  # the sign is smoothed where the steering turns round
    assert chi2 < 1.3
    assert gain > 100
    (none,), (sd,), *_ = fitted(histories(runs()), "steer_friction")
    assert none < 3 * sd


def test_friction_needs_the_steering_and_time():
    without = tuple(
        Run(r.name, r.speed, r.time, {"roll_rate_rad_s": r.channels["roll_rate_rad_s"]}, r.inputs) for r in runs()
    )
    words = histories(without).prepare().refused["steer_friction"]
    assert "which was not recorded (steer_rad or steer_rate_rad_s)" in words
    assert "dry friction is not linear in the motion" in modal().prepare().refused["steer_friction"]


@pytest.mark.parametrize(("identifier", "key", "off"), [("wrong_tilt", "lam", 0.08), ("wrong_trail", "c", 0.03)])
@pytest.mark.parametrize("stated", ["fixed", "narrow"])
def test_a_wrong_geometry_is_found_however_the_file_states_it(identifier, key, off, stated):
    """Rides of the published bicycle; its file has another tilt or trail, fixed or with a small sd."""
    bicycle = load_bicycle("benchmark")
    wrong = bicycle.replace(**{key: bicycle[key] - off})
    sd = {key: 0.0 if stated == "fixed" else 0.02 * off}
    (size,), (spread,), chi2, gain = fitted(histories(runs(), wrong, uncertainty={**EXACT, **sd}), identifier)
    assert size == pytest.approx(off, abs=4 * spread)
    assert chi2 == pytest.approx(1.0, abs=0.1)
    assert gain > 100


@pytest.mark.parametrize(("key", "identifier", "documented"), [("lam", "wrong_tilt", 0.05), ("c", "wrong_trail", 0.02)])
def test_a_geometry_is_called_wrong_where_its_sd_is_less_than_the_documented_mistake(key, identifier, documented):
    """0.05 rad, 20 mm: to either side of these."""
    for share, tried in ((0.98, True), (1.02, False)):
        forward = modal(uncertainty={key: share * documented}).prepare()
        assert (identifier not in forward.refused) == tried
        assert any(c.identifier == identifier for c in forward.candidates) == tried


def test_the_model_that_follows_has_the_geometry_that_was_found_and_what_is_tied_to_it():
    model = Model(load_bicycle("benchmark"), _fork())
    measurement = Modal(name="own", model=model, points=modal().points, uncertainty={"lam": 0.0})
    forward = measurement.prepare()
    tilt = next(c for c in forward.candidates if c.identifier == "wrong_tilt")
    found = measurement.corrected_model(
        fit(forward, (tilt,), starts=[np.append([u.centre for u in forward.nuisances], 0.1)], turns=(0, 0))
    )
    assert found.bicycle["lam"] == pytest.approx(load_bicycle("benchmark")["lam"] + 0.1)
    assert found.parameters["front_compliance.axis_tilt"] == pytest.approx(found.bicycle["lam"])
    assert found.bicycle["c"] == load_bicycle("benchmark")["c"]


def _fork():
    from bicycle import effect_class

    return effect_class("front_compliance")(joint_x=0.8, joint_z=-0.85)


def modal(change=lambda root, ratio: (root, ratio), speeds=(4.6, 5.2, 5.8, 6.6, 7.4, 8.2), **rest):
    """Weave of the published bicycle, its ratio of steer to lean changed."""
    points = []
    for speed in speeds:
        root, ratio = change(*weave(speed))
        points.append(ModalPoint(speed, "weave", root, (0.01, 0.01), {"steer_over_lean": (ratio, 0.005)}))
    return Modal(name="own", model=Model(load_bicycle("benchmark")), points=tuple(points), **rest)


@pytest.mark.parametrize(("identifier", "change", "size"), [
    ("steer_sensor_lowpass", lambda s, r: (s, r / (1 + 0.03 * s)), 0.03),
    ("steer_sensor_delay", lambda s, r: (s, r * np.exp(-0.03 * s)), 0.03),
    ("lean_sensor_lowpass", lambda s, r: (s, r * (1 + 0.03 * s)), 0.03),
    ("lean_sensor_delay", lambda s, r: (s, r * np.exp(0.03 * s)), 0.03),
])  # fmt: skip
def test_the_sensors_of_a_ratio(identifier, change, size):
    (found,), (sd,), chi2, gain = fitted(modal(change), identifier)
    assert found == pytest.approx(size, abs=4 * sd)
    assert chi2 < 0.1  # without noise
    assert gain > 50


@pytest.mark.parametrize(("identifier", "part"), [("luggage", "B"), ("handlebar_bag", "H")])
def test_a_mass_that_the_file_does_not_have(identifier, part):
    """3 kg put into a frame by the parallel axis theorem, the file without; the place is told."""
    x, z = {"luggage": (-0.05, -0.85), "handlebar_bag": (0.9, -0.95)}[identifier]
    bicycle = load_bicycle("benchmark")
    points = weave_of(enlarged(bicycle, part, 3.0, x, z))
    measurement = Modal(
        name="own", model=Model(bicycle), points=points, uncertainty=EXACT, known={identifier: {"x": x, "z": z}}
    )
    (mass,), (sd,), chi2, gain = fitted(measurement, identifier)
    assert mass == pytest.approx(3.0, abs=4 * sd)
    assert sd < 0.5
    assert chi2 < 0.1
    assert gain > 20


def weave_of(bicycle):
    speeds = (4.6, 5.2, 5.8, 6.6, 7.4, 8.2)
    found = modes(Model(bicycle).linear_model(), speeds)
    ratio = [s[1] / s[0] for s in found.shape("weave").phasors]
    return tuple(
        ModalPoint(v, "weave", complex(root), (0.01, 0.01), {"steer_over_lean": (complex(r), 0.005)})
        for v, root, r in zip(speeds, found.branch("weave")[:, 0], ratio, strict=True)
    )


def test_signals_lag_and_never_lead():
    for forward in (histories(runs()).prepare(), modal().prepare()):
        late = [c for c in forward.candidates if c.identifier.endswith(("_delay", "_lowpass"))]
        assert len(late) >= 4
        for c in late:
            (u,) = c.unknowns
            assert (u.lowest, u.one_sided, u.least) == (0.0, True, 5e-4), c.identifier
            assert c.mistake, c.identifier
        assert not [t for t in forward.empirical_terms() if "delay" in t.identifier or "lowpass" in t.identifier]


def test_least_sizes_reach_the_coordinates():
    least = {
        f"{c.identifier}.{u.name}": u.least
        for c in find_candidates(Model(load_bicycle("benchmark")), {})[0] for u in c.unknowns
    }  # fmt: skip
    assert least["steer_spring.stiffness"] == 0.1
    assert least["pneumatic_trail.trail"] == 1e-3
    assert least["front_compliance.stiffness"] == pytest.approx(1 / 2e4)  # a compliance
    assert least["front_compliance.damping"] == 0  # no size
    assert least["luggage.mass"] == 0.2


def test_a_motor_is_tried_on_request():
    measurement = modal()
    assert measurement.prepare().refused["steer_assist"] == "a motor: tried on request, --with steer_assist"
    asked = measurement.prepare(also=("steer_assist",))
    known = Modal(name="own", model=measurement.model, points=measurement.points, known={"steer_assist": {}})
    for forward in (asked, known.prepare()):
        assert "steer_assist" in {c.identifier for c in forward.candidates}
        assert "steer_assist" not in forward.refused
    with pytest.raises(InputError, match="--with: unknown effect 'steer_asist'; did you mean 'steer_assist'"):
        measurement.prepare(also=("steer_asist",))
    with pytest.raises(InputError, match="--without and --with both name 'steer_assist'; give one of them"):
        measurement.prepare(without=("steer_assist",), also=("steer_assist",))
