"""What a residual torque looks like, against the published matrices of the benchmark and eigenvalues by hand."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from studies.inference.fit import fit
from studies.missing_effect import read_measurement
from studies.missing_effect.residual import words
from studies.missing_effect.residual.fitting import Residual, fit_residual
from studies.missing_effect.residual.kept import Kept
from studies.missing_effect.residual.seen import seen
from studies.missing_effect.residual.shapes import shape_of, steer_counts
from studies.missing_effect.residual.terms import STATES, TORQUES, SpeedScale, candidate
from tests.shared.published_bicycle import C1, K0, K2, G, M
from tyre.base.errors import InputError

SPEEDS = (4.35, 5.2, 6.1, 7.0, 8.0)
SD = 0.03  # 1/s and rad/s


def weave(v, gains):
    """Eigenvalue and mode (lean, steer) of the weave with torques ``gains`` (2 torques steer lean, 4 states)."""
    k, c = np.array([gains[1], gains[0]])[:, :2], np.array([gains[1], gains[0]])[:, 2:]
    inverse = np.linalg.inv(M)
    dynamics = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ (G * K0 + v**2 * K2 - k), -inverse @ (v * C1 - c)]])
    values, vectors = np.linalg.eig(dynamics)
    found = int(values.imag.argmax())
    return values[found], vectors[:2, found]


def left_open(measurement):
    forward = measurement.forward()
    return SimpleNamespace(
        measurement=measurement, forward=forward, final=fit(forward),
        verdict=SimpleNamespace(verdict="unknown", checks=()),
    )  # fmt: skip


def table(folder, gains):
    """A measurement of the weave's eigenvalues with ``gains(v)`` (2, 4), without noise."""
    rows = [weave(v, gains(v))[0] for v in SPEEDS]
    lines = [f"{v},weave,{z.real:.12g},{z.imag:.12g},{SD},{SD}" for v, z in zip(SPEEDS, rows, strict=True)]
    header = "speed_m_s,mode,real_1_s,imag_rad_s,real_sd_1_s,imag_sd_rad_s"
    (folder / "modes.csv").write_text("\n".join([header, *lines]) + "\n")
    file = folder / "MEASUREMENT.toml"
    file.write_text('kind = "modal"\nbicycle = "benchmark"\n\n[modal]\ntable = "modes.csv"\n')
    return file


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """A steer torque of -1 N m s/rad from the steer rate and a lean torque of -20 N m/rad from lean, as they are."""
    gains = np.zeros((2, 4))
    gains[0, 3], gains[1, 0] = -1.0, -20.0
    forward = read_measurement(table(tmp_path_factory.mktemp("both"), lambda v: gains)).forward()
    degrees, scale = {("steer", "steer_rate"): 1, ("lean", "lean"): 1}, SpeedScale.of(SPEEDS)
    beside, found = fit(forward), fit(forward, (candidate(degrees, scale),))
    nominal = np.array([u.centre for u in forward.nuisances])
    found = dataclasses.replace(found, theta=np.concatenate([nominal, [-1.0, -20.0]]))
    rest = {field.name: None for field in dataclasses.fields(Residual)}
    covariance = np.eye(len(nominal) + 24)
    residual = Residual(**rest | {"fit": found, "beside": beside, "degrees": degrees, "scale": scale,
                                  "covariance": covariance})  # fmt: skip
    return forward, residual, seen(forward, found.candidates, found.theta), gains


def test_a_newton_metre_counts_by_what_it_changes(both):
    """Eigenvalues by finite differences of each gain, over noise; the torque of a gain on the modes seen."""
    forward, residual, motion, gains = both
    steps = {}
    for t, torque in enumerate(TORQUES):
        ratio = 0.0
        for s, _ in enumerate(STATES):
            step = np.zeros((2, 4))
            step[t, s] = 1e-5
            moved, size = 0.0, 0.0
            for v in SPEEDS:
                root, mode = weave(v, gains)
                moved += abs((weave(v, gains + step)[0] - weave(v, gains - step)[0]) / 2e-5 / SD) ** 2
                mode = mode / np.linalg.norm(mode)
                size += abs(np.concatenate([mode, root * mode])[s]) ** 2
            ratio += moved / size
        steps[torque] = ratio
    wanted = np.sqrt(steps["steer"] / steps["lean"])
    assert wanted > 10  # a steer torque moves the bicycle far more
    assert steer_counts(forward, residual, motion) == pytest.approx(wanted, rel=1e-4)


def test_shares_weigh_steer_and_lean_torque_by_what_they_change(both):
    """Of a damper of 1 N m s/rad and a spring of 20 N m/rad the damper moves the weave, the spring has the N m."""
    forward, residual, motion, gains = both
    shape = shape_of(forward, residual, motion)
    power = {"steer": 0.0, "lean": 0.0}
    for v in SPEEDS:
        root, mode = weave(v, gains)
        mode = mode / np.linalg.norm(mode)
        power["steer"] += abs(root * mode[1]) ** 2
        power["lean"] += abs(20.0 * mode[0]) ** 2
    assert power["lean"] > 2 * power["steer"]  # in N m
    weighed = {"steer": shape.counts**2 * power["steer"], "lean": power["lean"]}
    assert shape.shares["steer", "steer_rate"] == pytest.approx(weighed["steer"] / sum(weighed.values()), rel=1e-3)
    assert shape.shares["lean", "lean"] == pytest.approx(weighed["lean"] / sum(weighed.values()), rel=1e-3)
    assert shape.shares["steer", "steer_rate"] > 0.9
    assert shape.library[0].identifier == "steer_damper"
    assert shape.library[0].share > 0.9
    told = words._shares(Kept(residual=residual, motion=motion, shape=shape))
    counts = (
        f"(a newton metre of steer torque counts as {shape.counts:.2g} of lean torque: so much more does it change "
    )
    assert told.startswith(f"Of its power on the motion seen {counts}the predicted numbers), 9")
    assert "is a steer torque against the steer rate" in told
    alone = dataclasses.replace(shape, shares={("steer", "steer_rate"): 1.0})
    assert "counts" not in words._shares(Kept(residual=residual, motion=motion, shape=alone))


GROWING = """\
speed_m_s,mode,real_1_s,imag_rad_s,real_sd_1_s,imag_sd_rad_s,steer_over_lean_re,steer_over_lean_im,steer_over_lean_sd,yaw_over_lean_re,yaw_over_lean_im,yaw_over_lean_sd
3.05,weave,2.20479,0.100526,0.548695,0.000721359,-0.229403,0.0632701,0.47964,-0.136915,0.0930939,0.564956
3.65,weave,1.87266,0.102592,0.106363,0.00129465,0.399032,-0.064148,0.0938429,0.785332,-0.0178781,0.0804338
4.25,weave,1.11712,0.100025,0.264405,1e-05,0.146433,0.133246,0.440088,0.769345,0.0451237,0.401794
4.95,weave,0.726637,0.100135,0.147785,1.87392e-05,0.0783066,0.156331,0.411583,1.2025,0.203839,0.380812
5.65,weave,0.719182,0.100751,0.0434253,0.000370889,0.240158,0.0223403,0.139565,1.97266,-0.0804881,0.180954
6.45,weave,-1.58717,11.4117,0.0403769,0.0413125,1.09715,-1.19978,0.0501783,-0.617487,-0.603287,0.0252686
7.35,weave,-1.58447,12.9362,0.0359814,0.0354066,1.0432,-1.10706,0.0432404,-0.628995,-0.56505,0.0221427
"""


def test_a_torque_that_ends_at_zero_is_refused(tmp_path):
    """Modes that are told far too exactly: chi^2 is a million a number, and the torque has no minimum but at zero."""
    (tmp_path / "modes.csv").write_text(GROWING)
    file = tmp_path / "MEASUREMENT.toml"
    file.write_text('kind = "modal"\nbicycle = "pista"\n\n[modal]\ntable = "modes.csv"\n')
    with pytest.raises(InputError, match="fitted to all data, the torque that the data left out would ask for is zero"):
        fit_residual(left_open(read_measurement(file)))


def test_a_torque_without_power_has_no_shape(both):
    forward, residual, motion, _ = both
    none = residual.fit.theta.copy()
    none[-2:] = 0.0
    nothing = dataclasses.replace(residual, fit=dataclasses.replace(residual.fit, theta=none))
    shape = shape_of(forward, nothing, motion)
    assert (shape.shares, shape.library) == ({}, ())
    told = words._shares(Kept(residual=nothing, motion=motion, shape=shape))
    assert told == "It has no power on the motion seen, so there is nothing to compare."
