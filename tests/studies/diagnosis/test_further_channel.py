"""What a channel that was not recorded would tell, against what it tells once it is recorded, and against brute force.

The runs are the blind test's, which share nothing with the fitter; white noise of a known size is added here.
"""

from dataclasses import replace

import numpy as np
import pytest

from studies.diagnosis import read_measurement
from studies.inference import fit, rank_measurements
from tests.validation.blind.histories import history_case

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
        replace(exact, runs=runs, noise_sd=sd).prepare(),
        replace(exact, runs=fewer, noise_sd={n: s for n, s in sd.items() if n != YAW}).prepare(),
    )


def told(full, before, *names):
    """The gain that is proposed, squared, and how far the channel then moves 2 ln(odds) of the first name."""
    by_name = {c.identifier: c for c in before.candidates}
    sets = [tuple(by_name[name] for name in one.split("+")) for one in names]
    one, other = [fit(before, some) for some in sets]
    (gain,) = (s.gain for s in rank_measurements(before, [one, other]) if s.what == f"{YAW} in the same runs")
    first, second = [fit(full, f.candidates, starts=[f.theta]) for f in (one, other)]
    odds = [2 * (a.log_evidence - b.log_evidence) for a, b in ((one, other), (first, second))]
    return gain**2, odds[1] - odds[0]


@pytest.mark.parametrize(("truth", "rival", "seeds", "louder"), [
    ("steer_damper", "steer_damper+bias", (5, 30), 1.0),  # 8 to 30 sd where the starts are held
    ("steer_damper", "steer_spring", (32, 33), 10.0),  # and here 17 and 19
])  # fmt: skip
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
