"""The forward model of rig recordings: what sensors do to a curve, what is proposed next, and how the gap is drawn."""

import dataclasses

import numpy as np
import pytest
from small_library import among

from studies.diagnosis import Curve, Reference, RigRecordings
from tyre.recordings import Condition
from tyre.rig import DrumCurvature, LoadCellDrift, Noise, Protocol, RigTyre, simulate_sweep

SPEED, RATE = 3.0, 2.0  # m/s, deg/s
TYRE = RigTyre(7600.0, 75e3, peak_force=430.0, shape=1.4, curvature=0.1, relaxation=False)
CURVE = Curve(400.0, 5.5e5, (7600.0, 76.0), (75e3, 750.0), (0.1, 0.01), 430.0, 1.4, 0.1)
FLAT = Condition(tyre="Synthetic", load=400.0, pressure=5.5e5, surface="flat", rim="laboratory", temperature=22.0)
DRUM = dataclasses.replace(FLAT, surface="drum", drum_radius=1.3)


def measurement(*effects, condition=FLAT):
    """One sweep (synthetic) of a tyre that is known, with something hidden in it."""
    how, rng = Protocol(speed=SPEED, slip_rate=np.deg2rad(RATE)), np.random.default_rng(1)
    effects = (*effects, Noise(), LoadCellDrift(rate=1.0))
    run = simulate_sweep(tyre=TYRE, condition=condition, protocol=how, effects=effects, rng=rng)
    reference = Reference((CURVE,), "the truth of the simulator")
    return RigRecordings(name="synthetic", reference=reference, sweeps=(("a", run),))


@pytest.fixture(scope="module")
def forward():
    return measurement().prepare()


@pytest.mark.parametrize(
    "beside", [{}, {"half_gap": 5e-4}, {"slip": 2e-3}, {"relaxation_length": 0.1}, {"half_gap": 1e-3, "slip": -1e-3}]
)
def test_a_slip_sensor_that_reads_a_tenth_too_much_stretches_the_curve_with_all_that_is_in_it(forward, beside):
    """Play and offsets are of the wheel: at 1.1 times the slip the sensor sees the force of the wheel's own slip."""
    own = {
        key: np.array([beside[u.name]])
        for c in forward.candidates if c.identifier in ("steering_play", "ply_steer", "sweep_lag")
        for u in c.unknowns if u.name in beside
        for key in u.sets
    }  # fmt: skip
    assert len(own) == len(beside)
    (true,) = forward.blocks
    seen = dataclasses.replace(true, slip=1.1 * true.slip, slip_history=1.1 * true.slip_history)
    (terms,), (stretched,) = (
        forward.sweep_terms(true, own),
        forward.sweep_terms(seen, own | {"slip gain": np.array([0.1])}),
    )
    expected = true.lateral_force(terms, slopes=False)[0]
    np.testing.assert_allclose(seen.lateral_force(stretched, slopes=False)[0], expected, atol=1e-9 * np.ptp(expected))


def test_a_faster_sweep_that_is_proposed_is_as_fast_as_its_words(forward):
    proposed = {p.what: p.predict.args[0] for p in forward.propose_measurements()}
    rolling = proposed["both branches at a rolling speed of 6 m/s"]
    turning = proposed["both branches at 4 deg/s"]
    assert rolling.speed == pytest.approx(2 * SPEED)
    assert turning.speed == pytest.approx(SPEED)
    assert turning.rate == pytest.approx(2 * rolling.rate, rel=1e-12)
    for sweep in (rolling, turning):
        inside = sweep.branch == 0
        pace = np.ptp(sweep.slip[inside]) / np.ptp(sweep.time[inside])
        assert pace == pytest.approx(sweep.rate, rel=0.05)
    # the same lag in metres is half as long in seconds
    length = {key: np.array([0.1]) for c in forward.candidates for u in c.unknowns for key in u.sets
              if u.name == "relaxation_length"}  # fmt: skip
    lag = 5  # place of the lag among the terms of a sweep
    slow, fast = (forward.sweep_terms(s, length)[0, lag] for s in (turning, rolling))
    assert fast == pytest.approx(slow / 2)


@pytest.mark.parametrize(("changed", "settled"), [("rate", "deg/s"), ("speed", "m/s")])
def test_what_the_sweeps_differ_in_already_is_not_proposed(forward, changed, settled):
    (one,) = forward.blocks
    for factor, asked in ((1.1, {"deg/s", "m/s"}), (1.5, {"deg/s", "m/s"} - {settled})):
        other = dataclasses.replace(one, **{changed: factor * getattr(one, changed)})
        words = [p.what.split()[-1] for p in dataclasses.replace(forward, blocks=(one, other)).propose_measurements()]
        assert asked == {"deg/s", "m/s"} & {*words}


def test_the_gap_is_drawn_with_what_the_parameters_and_the_effect_say_of_it(tmp_path, monkeypatch):
    found = measurement(DrumCurvature(exponent=0.6), condition=DRUM)
    judgement = among(found, ("drum_curvature", "ply_steer"))
    drawn = []
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda self, to, **_: (drawn.append(self), to.touch()))
    draw, _ = judgement.kind.figures()["before_after"]
    assert draw(judgement, tmp_path / "gap")
    (axis,) = drawn[0].axes
    assert [t.get_text() for t in drawn[0].legends[0].get_texts()] == [
        "measured, rising", "measured, falling", "+ drum_curvature alone", "+ drum_curvature, parameters re-estimated",
    ]  # fmt: skip
    lines = {line.get_label(): line.get_xydata() for line in axis.get_lines()}
    slip, measured = lines["measured, rising"].T
    said = np.interp(slip, *lines["+ drum_curvature, parameters re-estimated"].T)
    assert np.abs(measured).max() > 20  # N, of a curve that is flatter by (1 + 0.34/1.3)^-0.6
    assert np.sqrt(np.mean((said - measured) ** 2)) < 3
