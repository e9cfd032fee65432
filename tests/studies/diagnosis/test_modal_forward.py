"""Predicted eigenvalues, ratios and derivatives against the model and against differences of the whole prediction."""

import pickle

import numpy as np
import pytest
from published_bicycle import weave

from bicycle import Model, effect_class, load_bicycle
from bicycle.stability import modes
from studies.diagnosis import Modal, ModalPoint, diagnose, read_measurement

TYRE = {"cornering_stiffness": {"rear": 6000.0, "front": 4500.0}, "relaxation_length": 0.1}


def test_a_point_read_otherwise_has_its_parts_and_their_uncertainties_scaled():
    """As of a decay of the other sign and a frequency in Hz: 2 pi on the imaginary part and on its sd."""
    turned = ModalPoint(5.0, "weave", -0.5 + 1.0j, (0.1, 0.03)).scale(real=-2.0, imag=2 * np.pi, speed=1 / 3.6)
    assert turned.eigenvalue == pytest.approx(1.0 + 2j * np.pi)
    assert turned.sd == pytest.approx((0.2, 0.06 * np.pi))
    assert turned.speed == pytest.approx(5 / 3.6)


def forward_at(model, speeds, mode="weave"):
    found = modes(model.linear_model(), speeds)
    shape = found.shape(mode).phasors
    points = tuple(
        ModalPoint(
            v, mode, z, (0.05, 0.05), {"steer_over_lean": (s[1] / s[0], 0.02), "yaw_over_lean": (s[2] / s[0], 0.02)}
        )
        for v, z, s in zip(speeds, found.branch(mode)[:, 0], shape, strict=True)
    )
    return Modal(name="own", model=model, points=points).prepare()


@pytest.fixture(scope="module", params=["rolling", "tyre"])
def forward(request):
    effects = () if request.param == "rolling" else (effect_class("relaxation_length")(**TYRE),)
    return forward_at(Model(load_bicycle("benchmark"), effects), [4.5, 5.5, 7.0])


def test_the_modes_of_the_model_itself_leave_no_residual(forward):
    residual, _ = forward.residual((), forward.nominal)
    assert np.abs(residual).max() < 1e-8


def test_a_dense_series_of_speeds_is_more_than_one_and_repeats_are_not():
    model = Model(load_bicycle("benchmark"))
    assert forward_at(model, [5.0, 5.1, 5.2, 5.3, 5.4]).varied  # each within 5 % of the next
    assert not forward_at(model, [5.0, 5.1, 5.2]).varied


def test_a_speed_known_to_some_sd_adds_what_the_mode_changes_with_it(tmp_path):
    """The slope of the published weave by differences, in quadrature to the sd of the eigenvalue."""
    rows = ["4.0,weave,0.41,3.08,0.05,0.05,0.1", "5.0,weave,-0.78,4.46,0.05,0.05,"]
    head = "speed_m_s,mode,real_1_s,imag_rad_s,real_sd_1_s,imag_sd_rad_s,speed_sd_m_s"
    (tmp_path / "m.toml").write_text('kind = "modal"\nbicycle = "benchmark"\n[modal]\ntable = "t.csv"\n')
    (tmp_path / "t.csv").write_text("\n".join([head, *rows, ""]))
    slope = (weave(4.02)[0] - weave(3.98)[0]) / 0.04
    uncertain, exact = read_measurement(tmp_path / "m.toml").points
    assert uncertain.sd == pytest.approx(np.hypot(0.05, [0.1 * slope.real, 0.1 * slope.imag]), rel=1e-3)
    assert exact.sd == (0.05, 0.05)


def test_derivatives_agree_with_differences_of_the_prediction(forward):
    for candidate in forward.candidates:
        unknowns = (*forward.nuisances, *candidate.unknowns)
        theta = np.concatenate([[u.centre for u in forward.nuisances], candidate.starts[1]])
        _, jacobian = forward.residual((candidate,), theta)
        for k, u in enumerate(unknowns):
            h = np.zeros_like(theta)
            h[k] = 1e-3 * (min(u.scale, theta[k]) if u.lowest > 0 else u.scale)
            plus, minus = (forward.residual((candidate,), theta + s * h, slopes=False)[0] for s in (1, -1))
            numeric = (plus - minus) / (2 * h[k])
            scale = max(np.abs(numeric).max(), 1e-3 / u.scale)
            assert np.abs(jacobian[:, k] - numeric).max() < 3e-4 * scale, (candidate.identifier, u.name)


def test_a_speed_with_two_modes_uses_each_root_once():
    model = Model(load_bicycle("benchmark"), (effect_class("relaxation_length")(**TYRE),))
    found = modes(model.linear_model(), [8.0])
    weave, rear_tyre = (complex(found.branch(name)[0, 0]) for name in ("weave", "rear_tyre"))
    near = 0.6 * weave + 0.4 * rear_tyre  # the nearest root of this one is weave
    points = (ModalPoint(8.0, "weave", weave, (0.1, 0.1)), ModalPoint(8.0, "rear_tyre", near, (0.1, 0.1)))
    forward = Modal(name="own", model=model, points=points)
    residual, _ = forward.residual((), np.empty(0))
    np.testing.assert_allclose(residual[:2], 0, atol=1e-6)
    assert residual[3] == pytest.approx((near - rear_tyre).imag / 0.1)


def test_the_proposed_forced_response_is_that_of_the_model(forward):
    """Against python-control's frequency response of the same model; derivatives against differences."""
    nominal = forward.nominal
    extra = forward.propose_forced_response(7.0)[0]
    assert "swept steer torque, 0.5-4 Hz, at 7 m/s" in extra.what
    predicted, slope = extra.predict_white((), nominal)
    plant = forward.model.linear_model().to_control(
        7.0, inputs=["steer_torque"], outputs=["lean_rate", "steer", "yaw_rate"]
    )
    expected = np.stack([plant(1j * w)[:, 0] for w in 2 * np.pi * np.geomspace(0.5, 4.0, 6)]).ravel()
    seen = (predicted * extra.sd).reshape(-1, 2)
    assert np.allclose(seen[:, 0] + 1j * seen[:, 1], expected, rtol=1e-8)
    k = [u.name for u in forward.nuisances].index("zB")
    h = 1e-4 * np.eye(len(nominal))[k]
    numeric = (extra.predict_white((), nominal + h)[0] - extra.predict_white((), nominal - h)[0]) / 2e-4
    assert np.allclose(slope[:, k], numeric, rtol=1e-3, atol=1e-3 * np.abs(numeric).max())


def test_no_speed_is_proposed_that_is_far_beyond_those_measured(forward):
    assert [one.what.split(" at ")[1].split()[0] for one in forward.propose_forced_response(6.0)] == ["6", "7.8"]


def test_a_bicycle_that_falls_is_not_proposed_for_a_sweep(forward):
    assert forward.propose_forced_response(1.0) == ()  # 1 and 1.3 m/s, far below the weave speed


def test_it_can_be_sent_to_another_process_after_use(forward):
    theta = forward.nominal
    residual, _ = forward.residual((), theta)
    again, _ = pickle.loads(pickle.dumps(forward)).residual((), theta)
    np.testing.assert_array_equal(again, residual)


@pytest.mark.parametrize("key", ["rR", "rF", "w"])
def test_a_fit_that_drives_a_length_to_zero_stops_before_it(forward, key):
    """The equations divide by the wheel radii and the wheelbase: at zero they have no eigenvalues, and no traceback."""
    names = [u.name for u in forward.nuisances]
    assert forward.nuisances[names.index(key)].lowest > 0
    theta = np.where(np.array(names) == key, 0.0, forward.nominal)
    parts, slopes = forward.value_and_jacobian((), theta)
    assert np.isnan(parts).all()
    assert slopes.shape == (parts.size, theta.size)
    assert np.isnan(slopes).all()


def test_modes_far_from_those_of_the_bicycle_are_judged_without_a_traceback():
    """With deviations ten times the usual a fit takes every length as far as it may go."""
    points = tuple(ModalPoint(v, "weave", -30.0 + 60.0j * (v > 5), (0.01, 0.01)) for v in (4.5, 5.0, 5.5, 6.0, 7.0))
    wide = {"rR": 0.1, "rF": 0.1, "w": 0.3, "IFyy": 0.1, "g": 0.9}
    found = diagnose(
        Modal(name="odd", model=Model(load_bicycle("benchmark")), points=points, uncertainty=wide), quick=True
    )
    assert np.isfinite(found.final.objective)


def test_no_measurement_is_proposed_far_outside_the_measured_speeds(forward):
    """A rider who measured up to 9 m/s cannot go to 18 m/s."""
    proposed = [p.what for p in forward.propose_measurements()]
    speeds = [float(what.rpartition(" at ")[2].split(" m/s")[0]) for what in proposed if " m/s" in what]
    assert min(speeds) == pytest.approx(0.7 * forward.speeds.min(), rel=0.01)
    assert max(speeds) == pytest.approx(1.3 * forward.speeds.max(), rel=0.01)
