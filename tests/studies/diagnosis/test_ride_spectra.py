"""Kind ``ride_spectra``: Whittle's likelihood by its formula, derivatives by differences, reading and refusals."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from studies.diagnosis import Disturbances, OpenLoops, RidersDrawn, SpectralMisfit, read_measurement, steady_riders
from studies.inference import fit
from tyre.ground import InputError

EXAMPLE = Path(__file__).parents[3] / "docs" / "examples" / "measurements" / "ride_spectra"
STEP = 0.02


def hermitian(rng, shape, size):
    factor = rng.normal(size=(*shape, size, 7)) + 1j * rng.normal(size=(*shape, size, 7))
    return factor @ factor.conj().swapaxes(-1, -2)


@pytest.fixture(scope="module")
def kind():
    return read_measurement(EXAMPLE / "MEASUREMENT.toml").prepare()


@pytest.fixture
def folder(tmp_path):
    return Path(shutil.copytree(EXAMPLE, tmp_path / "rides"))


def rewrite(folder, old, new):
    path = folder / "MEASUREMENT.toml"
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")
    return path


# ---- likelihood ----


def test_squares_of_the_residuals_are_whittles_likelihood():
    rng = np.random.default_rng(62401)
    measured, model = hermitian(rng, (2, 4), 3), hermitian(rng, (2, 4), 3)
    averages = rng.uniform(200, 400, (2, 4))  # so many that the correction for few is below 2 %
    misfit = SpectralMisfit(measured, averages)
    inverse = misfit.root_inverse
    residual, _ = misfit.residual(inverse @ model @ inverse.conj().swapaxes(-1, -2))
    logarithm = np.log(np.linalg.det(model).real / np.linalg.det(measured).real)
    trace = np.trace(np.linalg.inv(model) @ measured, axis1=-2, axis2=-1).real
    assert (residual**2).sum(-1) == pytest.approx(2 * averages * (logarithm + trace - 3), rel=0.02)


def test_a_right_model_has_squares_of_mean_one():
    """Complex Wishart matrices of 12 averages about the model."""
    rng = np.random.default_rng(62402)
    root = np.linalg.cholesky(hermitian(rng, (), 3))
    noise = (rng.normal(size=(1, 4000, 3, 12)) + 1j * rng.normal(size=(1, 4000, 3, 12))) / np.sqrt(2)
    samples = root @ noise
    misfit = SpectralMisfit(samples @ samples.conj().swapaxes(-1, -2) / 12, np.full((1, 4000), 12.0))
    inverse = misfit.root_inverse
    residual, _ = misfit.residual(inverse @ root @ root.conj().T @ inverse.conj().swapaxes(-1, -2))
    assert np.mean(residual**2) == pytest.approx(1.0, abs=0.03)


def test_derivatives_are_those_of_differences():
    rng = np.random.default_rng(62403)
    misfit = SpectralMisfit(hermitian(rng, (1, 5), 3), np.full((1, 5), 20.0))
    model, change = hermitian(rng, (1, 5), 3), hermitian(rng, (1, 5), 3)
    inverse = misfit.root_inverse
    model, change = (inverse @ part @ inverse.conj().swapaxes(-1, -2) for part in (model, change))
    slopes = misfit.residual(model)[1].slopes(change[:, :, None])[..., 0]
    after, before = (misfit.residual(model + sign * 1e-6 * change)[0] for sign in (1, -1))
    assert slopes == pytest.approx((after - before) / 2e-6, abs=1e-5)


def test_a_density_is_that_of_the_docstring():
    disturbances = Disturbances(("steer_torque", "lean_torque"), np.ones(2), "nobody")
    hertz = np.array([[[0.5, 1.0, 4.0]]])
    z = np.zeros((1, len(disturbances.names)))
    corner, power = 1.0, 1.0
    shape = ((1 + 1 / corner**2) / (1 + (hertz / corner) ** 2)) ** power
    density = disturbances.densities(z, hertz)
    assert density[..., 0] == pytest.approx(0.3**2 * (shape + 0.01 * 1.01 / (hertz**2 + 0.01)))
    z[0, 0] = 0.5  # half a prior sd of the logarithm of the size
    assert disturbances.densities(z, hertz)[..., 0] == pytest.approx(np.exp(2 * 0.5 * 2.0) * density[..., 0])


# ---- the kind ----


# ---- riders ----


def inverted_pendulum(rides=2):
    """Steering that falls over by itself, lean and steer at once: x' = (rate, 4 angle), the torque on the rate."""
    state = np.array([[0.0, 1.0], [4.0, 0.0]])
    motion = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 0.0], [0.0, 1.0]])
    return OpenLoops(np.tile(state, (rides, 1, 1)), np.tile([0.0, 1.0], (rides, 1)), np.tile(motion, (rides, 1, 1)))


def test_poles_of_a_loop_are_where_the_riders_torque_balances():
    """At each pole s the determinant of s - A + b answers(s) vanishes, with the answers that spectra take."""
    disturbances, loops = Disturbances(("steer_torque",), np.ones(1)), inverted_pendulum(1)
    rng = np.random.default_rng(62501)
    z = rng.normal(size=(1, len(disturbances.names)))
    for s in loops.poles(disturbances, z, np.arange(1))[0]:
        answers = disturbances.answers(z, np.array([[[s]]]))[0, 0, 0] @ loops.motion[0]
        closed = s * np.eye(2) - loops.state[0] + np.outer(loops.steered[0], answers)
        assert abs(np.linalg.det(closed)) < 1e-6 * abs(s) ** 2


def test_answers_change_with_their_numbers_as_differences_do():
    disturbances = Disturbances(("steer_torque",), np.ones(1))
    z = np.random.default_rng(62502).normal(size=(1, len(disturbances.names)))
    s = 2j * np.pi * np.array([[[0.3, 2.0, 6.0]]])
    slopes = disturbances.answer_slopes(z, s)
    for column, place in enumerate(range(disturbances.loop.start, disturbances.loop.stop)):
        step = np.zeros_like(z)
        step[0, place] = 1e-6
        difference = (disturbances.answers(z + step, s) - disturbances.answers(z - step, s)) / 2e-6
        np.testing.assert_allclose(slopes[..., column], difference, rtol=1e-5, atol=1e-6)


def test_riders_who_are_drawn_hold_the_bicycle_and_others_are_changed_a_little():
    disturbances, loops = Disturbances(("steer_torque",), np.ones(1)), inverted_pendulum()
    drawn = RidersDrawn(disturbances)
    for _ in range(2):  # as found, and as remembered
        starts = drawn.who_hold(loops)
        assert starts.shape == (8, 2, len(disturbances.names))
        for z in starts:
            assert (loops.poles(disturbances, z, np.arange(2)).real < 0).all()
    falling = starts[0].copy()
    damping = disturbances.names.index("torque of the arms by steer_rate")
    while (loops.poles(disturbances, falling, np.arange(2)).real.max(1)[0]) < 0:
        falling[0, damping] -= 0.02  # until the first rider's bicycle grows
    steady = steady_riders(disturbances, loops, falling)
    assert loops.hold(disturbances, falling, np.arange(2)).tolist() == [False, True]
    assert loops.hold(disturbances, steady, np.arange(2)).tolist() == [True, True]
    assert np.count_nonzero(steady[0] - falling[0]) == 1
    assert np.abs(steady - falling).max() <= 0.2
    np.testing.assert_array_equal(steady[1], falling[1])


def test_a_share_of_the_misfit_counts():
    rng = np.random.default_rng(62503)
    measured, model = hermitian(rng, (1, 3), 2), hermitian(rng, (1, 3), 2)
    whole, part = (SpectralMisfit(measured, np.full((1, 3), 20.0), share) for share in (1.0, 0.04))
    inverse = whole.root_inverse
    relative = inverse @ model @ inverse.conj().swapaxes(-1, -2)
    np.testing.assert_allclose(part.residual(relative)[0], 0.2 * whole.residual(relative)[0], rtol=1e-12)


FRONT = """
[effects.front_compliance]
stiffness = 5348.0
damping = 34.0
joint_x = 0.753
joint_z = -0.867
"""


def ridden(folder):
    """State the tyres and the front frame of the bicycle that the rides are of."""
    rewrite(folder, "rear = 7945.0, front = 4278.0", "rear = 7106.0, front = 4310.0")
    rewrite(folder, "relaxation_length = 0.104", "relaxation_length = { rear = 0.093, front = 0.080 }")
    rewrite(folder, "\n[ride_spectra]\n", f"{FRONT}\n[ride_spectra]\n")


def test_the_slope_of_the_misfit_is_that_of_differences(folder):
    """Of the bicycle that the rides are of, where the most probable disturbances follow smoothly."""
    ridden(folder)
    kind = read_measurement(folder / "MEASUREMENT.toml").prepare()
    theta = kind.nominal
    residual, slopes = kind.residual((), theta)
    force = 2 * residual @ slopes

    def misfit(at):
        return kind.settle((), at).fitted.objective.sum()

    for column in (0, 8, len(theta) - 1):
        step = np.zeros(len(theta))
        step[column] = 0.1 * kind.nuisances[column].scale
        difference = misfit(theta + step) - misfit(theta - step)  # its search ends 0.01 above the least
        assert 2 * force @ step == pytest.approx(difference, rel=0.06, abs=0.02)


def test_segments_channels_and_rider_are_stated(kind):
    assert kind.channels == ("roll_rate_rad_s", "steer_rate_rad_s", "yaw_rate_rad_s")
    assert kind.speeds.tolist() == [6.0, 9.0]
    assert "a rider who steers, steer torque, lean torque" in " ".join(kind.notes)
    assert len(kind.rows.places) == 2 * len(kind.rides.spectra[0].hertz) * 9


def with_torque(folder, torque_of):
    """Write a recorded steer torque, made of the table (n, 4), into both rides."""
    for name in ("ride_6.csv", "ride_9.csv"):
        data = np.loadtxt(folder / name, delimiter=",", skiprows=1)
        head = (folder / name).read_text(encoding="utf-8").partition("\n")[0] + ",steer_torque_N_m"
        table = np.column_stack([data, torque_of(data)])
        np.savetxt(folder / name, table, delimiter=",", header=head, comments="", fmt="%.5f")


def test_a_torque_that_answers_the_motion_is_a_controllers(folder):
    with_torque(folder, lambda data: -7.0 * data[:, 1])
    kind = read_measurement(folder / "MEASUREMENT.toml")
    assert kind.rides.disturbances.steering == "controller"
    assert kind.rides.disturbances.controller_gains[:, 1] == pytest.approx(7.0, abs=1e-3)  # T = -gain roll rate
    assert "steer_torque_N_m" not in kind.channels


def test_any_other_torque_is_a_channel(folder):
    rng = np.random.default_rng(62404)
    with_torque(folder, lambda data: rng.normal(0, 0.3, len(data)).cumsum() * 0.02)
    kind = read_measurement(folder / "MEASUREMENT.toml").prepare()
    assert kind.channels[-1] == "steer_torque_N_m"
    residual, slopes = kind.residual((), kind.nominal)
    assert np.isfinite(residual).all()
    assert slopes.shape == (len(residual), len(kind.nominal))


@pytest.mark.parametrize(("key", "motors"), [("", 0), ("motor_in_torque = false\n", 1)])
def test_a_motor_is_in_the_recorded_torque_unless_the_file_states_otherwise(folder, key, motors):
    rng = np.random.default_rng(62405)
    with_torque(folder, lambda data: rng.normal(0, 0.3, len(data)).cumsum() * 0.02)
    rewrite(
        folder, "\n[ride_spectra]\n", f"\n[effects.steer_assist]\ngain = 2.0\nfade_speed = 6.5\n\n[ride_spectra]\n{key}"
    )
    kind = read_measurement(folder / "MEASUREMENT.toml")
    assert sum(effect.powered for effect in kind.model.effects) == motors


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("rides = [", "rider = [", "unknown key 'rider'; did you mean 'rides'"),
        ('{ file = "ride_6.csv", speed_m_s = 6.0 }', '{ file = "ride_6.csv" }', "no speed was recorded"),
        ("[ride_spectra]\n", '[ride_spectra]\nsteering = "me"\n', "write 'rider', 'controller' or 'nobody'"),
        ("[ride_spectra]\n", '[ride_spectra]\nsteering = "controller"\n', "needs the recorded steer_torque_N_m"),
        ("[ride_spectra]\n", "[ride_spectra]\nlowest_Hz = 14.9\n", "4 are needed: ride longer"),
    ],
)
def test_what_cannot_be_read_is_refused(folder, old, new, message):
    with pytest.raises(InputError, match=message):
        read_measurement(rewrite(folder, old, new))


def test_one_channel_is_refused(folder):
    for name in ("ride_6.csv", "ride_9.csv"):
        data = np.loadtxt(folder / name, delimiter=",", skiprows=1)
        np.savetxt(folder / name, data[:, :2], delimiter=",", header="time_s,roll_rate_rad_s", comments="")
    with pytest.raises(InputError, match="record two of roll rate, yaw rate and steering"):
        read_measurement(folder / "MEASUREMENT.toml")


PART = '[[part]]\nname = "{name}"\nkind = "ride_spectra"\n[part.ride_spectra]\nrides = [{ride}]\n'


def test_two_parts_of_joint_data_are_worth_two_rides(folder):
    """Disturbances belong to a ride: of the bicycle that was ridden, the misfits of two parts add to that of both."""
    ridden(folder)
    text = (folder / "MEASUREMENT.toml").read_text(encoding="utf-8")
    head, _, rides = text.partition("[ride_spectra]")
    slow, fast = [line.strip().rstrip(",") for line in rides.splitlines() if "file" in line]
    parts = PART.format(name="slow", ride=slow) + PART.format(name="fast", ride=fast)
    (folder / "joint.toml").write_text(head.replace('"ride_spectra"', '"joint"') + parts, encoding="utf-8")
    joint = read_measurement(folder / "joint.toml").prepare()
    alone = read_measurement(folder / "MEASUREMENT.toml").prepare()
    together, slopes = joint.residual((), alone.nominal)
    residual, _ = alone.residual((), alone.nominal)
    assert slopes.shape == (len(residual), len(alone.nominal))
    assert together @ together == pytest.approx(residual @ residual, rel=0.01)


def test_the_riders_of_a_fit_hold_the_bicycle_and_its_tyres_are_the_true_ones(folder):
    """Rides of 100 s by other equations, 7106 and 4310 N/rad; spectra hardly tell a growth of wobble from a decay."""
    rewrite(folder, "\n[ride_spectra]\n", f"{FRONT}\n[ride_spectra]\n")
    kind = read_measurement(folder / "MEASUREMENT.toml").prepare()
    end = fit(kind, patient=True)
    settled = kind.settle((), end.theta, anew=True)
    assert max(poles.real.max() for poles in kind.closed_loop_poles((), end.theta, settled.fitted.z)) < 0
    for wheel, true in (("rear", 7106.0), ("front", 4310.0)):
        column = [u.name for u in kind.nuisances].index(f"relaxation_length.cornering_stiffness.{wheel}")
        unknown = kind.nuisances[column]
        sd = np.sqrt(end.covariance[column, column]) * unknown.slope(end.theta[column])
        assert abs(unknown.value(end.theta[column]) - true) < 2.6 * sd < 0.1 * true
