"""What a channel that was not recorded would tell, against what it tells once it is recorded, and against brute force.

The runs are the blind test's, which share nothing with the fitter; white noise of a known size is added here.
"""

from dataclasses import replace

import numpy as np
import pytest

from bicycle import Model, load_bicycle
from bicycle.identification.run import Run
from bicycle.responses.inputs import pulse
from bicycle.responses.linear import respond
from studies.inference.fit import fit
from studies.inference.identifiability import separating
from studies.missing_effect import read_measurement
from studies.missing_effect.blind.histories import history_case
from studies.missing_effect.motion.initial_states import start_sd
from studies.missing_effect.motion.measurements import HistoryMeasurement
from studies.missing_effect.motion.replay import Replay

YAW = "yaw_rate_rad_s"
SD = {"roll_rate_rad_s": 0.02, "steer_rad": 0.005, YAW: 0.02}


def recorded(folder, hidden, seed, louder, **settings):
    """A measurement with a yaw rate, and the same without; all but the yaw rate is so many times ``louder``."""
    history_case(folder, hidden=(hidden,), rng=np.random.default_rng(seed), noise=1e-3, runs=3, duration=2.5,
                 **settings)  # fmt: skip
    exact, noise = read_measurement(folder / "MEASUREMENT.toml"), np.random.default_rng([seed, 77])
    sd = {name: value * (1 if name == YAW else louder) for name, value in SD.items()}
    runs = tuple(
        replace(run, channels={n: run.channels[n] + s * noise.standard_normal(len(run.time)) for n, s in sd.items()})
        for run in exact.runs
    )
    fewer = tuple(replace(r, channels={n: x for n, x in r.channels.items() if n != YAW}) for r in runs)
    return (
        replace(exact, runs=runs, noise_sd=sd).forward(),
        replace(exact, runs=fewer, noise_sd={n: s for n, s in sd.items() if n != YAW}).forward(),
    )


def told(full, before, *names):
    """The gain that is proposed, squared, and how far the channel then moves 2 ln(odds) of the first name."""
    by_name = {c.identifier: c for c in before.candidates}
    sets = [tuple(by_name[name] for name in one.split("+")) for one in names]
    one, other = [fit(before, some) for some in sets]
    (gain,) = (s.gain for s in separating(before, [one, other]) if s.what == f"{YAW} in the same runs")
    first, second = [fit(full, f.candidates, starts=[f.theta]) for f in (one, other)]
    odds = [2 * (a.log_evidence - b.log_evidence) for a, b in ((one, other), (first, second))]
    return gain**2, odds[1] - odds[0]


@pytest.mark.parametrize(
    ("truth", "rival", "seeds", "louder"),
    [
        ("steer_damper", "steer_damper+bias", (5, 30), 1.0),  # 8 to 30 sd where the starts are held
        ("steer_damper", "steer_spring", (32, 33), 10.0),  # and here 17 and 19
    ],
)
def test_no_more_is_promised_than_the_channel_brings(truth, rival, seeds, louder, tmp_path):
    for seed in seeds:
        (tmp_path / f"{seed}").mkdir()
        both = recorded(tmp_path / f"{seed}", truth, seed, louder, bicycle="browser")
        promised, brought = told(*both, truth, rival)
        assert 0 < promised < brought


def test_what_is_promised_comes_on_average(tmp_path):
    """The change of 2 ln(odds) scatters by twice the gain."""
    pairs = []
    for seed in (30, 31, 32, 33):
        (tmp_path / f"{seed}").mkdir()
        both = recorded(tmp_path / f"{seed}", "crown_radius", seed, 1.0, forced=False)
        pairs.append(told(*both, "crown_radius", "pneumatic_trail"))
    promised, brought = np.mean(pairs, axis=0)
    assert promised > 4
    assert brought == pytest.approx(promised, abs=2 * 2 * np.sqrt(promised / len(pairs)))


@pytest.fixture(scope="module")
def runs():
    """Two of unlike length, from starts that are not zero."""
    model, found = Model(load_bicycle("benchmark")), []
    for speed, count in ((5.0, 120), (6.0, 80)):
        time = np.arange(count) * 0.01
        push = {"steer_torque": pulse(2.0, start=0.1, duration=0.2)}
        out = respond(model.linear_model(), speed=speed, time=time, initial={"lean_rate": 0.2}, inputs=push).outputs
        torque = push["steer_torque"].at(time)
        channels = {"roll_rate_rad_s": out["lean_rate"], "steer_rad": out["steer"]}
        found.append(Run(f"{speed}", speed, time, channels, {"steer_torque_N_m": torque}))
    return HistoryMeasurement(name="m", model=model, runs=tuple(found), noise_sd={n: SD[n] for n in channels})


@pytest.mark.parametrize(("error", "shapes"), [("", 0), ("bias", 1), ("drift", 2)])
def test_what_is_open_of_a_channel_is_that_of_all_unknowns_at_once(error, shapes, runs):
    """Starts and biases as unknowns beside the others: least squares with their priors, by differences."""
    forward = runs.forward()
    candidates = tuple(c for c in forward.candidates if c.identifier == error)
    found = fit(forward, candidates)
    (yaw,) = (p for p in forward.proposed() if p.what.startswith(YAW))
    _, slope = forward.predict(yaw, candidates, found.theta)
    follow, columns = forward.loose(yaw, candidates, found.theta)
    moved = slope + follow
    short = moved @ found.covariance @ moved.T + columns @ columns.T

    family, names = forward.family(candidates), (*forward.noise, YAW)
    replay, starts = Replay(forward.runs, names), forward.starts(candidates, found.theta)
    sd, prior = start_sd(family), np.array([u.scale for u in found.unknowns])
    noise = np.array([SD[name] for name in names])[:, None]

    def seen(theta, begun):
        return replay(family, theta[None], begun)[0] / noise

    every = []
    for k, scale in enumerate(prior):
        step = np.zeros(len(prior))
        step[k] = 1e-4 * scale
        every.append((seen(found.theta + step, starts) - seen(found.theta - step, starts)) / 2e-4)
    for r in range(len(forward.runs)):
        for k, scale in enumerate(sd):
            step = np.zeros_like(starts)
            step[r, k] = scale
            every.append((seen(found.theta, starts + step) - seen(found.theta, starts - step)) / 2)
        for c, size in enumerate((0.02, 0.02, 0.02)):  # rad/s, rad, rad/s: the prior sd of a bias of each channel
            for shape in range(shapes):
                column = np.zeros_like(every[0])
                n = len(forward.runs[r].time)
                column[r, c, :n] = size * (np.linspace(-1, 1, n) if shape else 1.0) / noise[c, 0]
                every.append(column)
    old = np.column_stack([
        np.concatenate([e[r, :2, : len(run.time)].ravel() for r, run in enumerate(forward.runs)]) for e in every
    ])  # fmt: skip
    new = np.column_stack([
        np.concatenate([e[r, 2, : len(run.time)] for r, run in enumerate(forward.runs)]) for e in every
    ])  # fmt: skip
    whole = new @ np.linalg.solve(np.eye(len(every)) + old.T @ old, new.T)
    assert np.abs(short - whole).max() < 1e-3 * np.abs(whole).max()
