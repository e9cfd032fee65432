"""Much data: searched in a part, the leaders refined on all; SYNTHETIC, of a generator that knows nothing of it."""

import dataclasses

import numpy as np
import pytest
from small_library import among

from studies.diagnosis import Histories, read_measurement
from tests.validation.blind import histories
from tests.validation.blind import motion as moving
from tests.validation.blind.histories import history_case

TRIED = ("steer_damper", "steer_spring", "roll_rate_scale", "steer_delay")


class Thinned(Histories):
    """Taken for much data from 720 numbers on."""

    dear = True

    def thin(self, most):
        return super().thin(360)


def case(folder, hidden, seed, **settings):
    history_case(folder, hidden=hidden, rng=np.random.default_rng(seed), **settings)
    return read_measurement(folder / "MEASUREMENT.toml")


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    return case(tmp_path_factory.mktemp("damper"), ("steer_damper",), 3, bicycle="browser", runs=8, duration=1.2)


def test_nobody_sways_or_pedals_where_nobody_rides(measured):
    ready = measured.prepare()
    assert {"side_gusts"} == {c.identifier for c in ready.candidates if c.absorbs}
    assert ready.refused["rider_sway"] == ready.refused["pedalling"] == "no rider: mB = 9.86 kg is less than 30 kg"


@pytest.mark.parametrize("stated", [True, False])
def test_a_search_in_a_part_ends_where_one_in_all_ends(measured, stated):
    whole = measured if stated else dataclasses.replace(measured, noise_sd={})
    fields = {f.name: getattr(whole, f.name) for f in dataclasses.fields(whole)}
    part, found = Thinned(**fields), []
    few = part.prepare().thin(0)
    assert len(few.rows.places) < 0.25 * len(part.prepare().rows.places)
    for kind in (whole, part):
        found.append(among(kind, TRIED).verdict)
    full, thin = found
    assert (thin.verdict, thin.equivalent, thin.chi2["n"]) == (full.verdict, full.equivalent, full.chi2["n"])
    (value, sd), (near, near_sd) = (one.effects[0].parameters["damping"] for one in found)
    assert near == pytest.approx(value, abs=0.1 * sd)
    assert near_sd == pytest.approx(sd, rel=0.02 if stated else 0.1)  # the colour of the noise is estimated
    sd = np.sqrt(2 * full.chi2["n"])  # of chi^2
    assert thin.chi2["final"] == pytest.approx(full.chi2["final"], abs=(0.01 if stated else 1.0) * sd)


def test_nothing_hidden_stays_nothing(tmp_path):
    whole = case(tmp_path, (), 5, bicycle="browser", runs=10, duration=1.0)
    part = Thinned(**{f.name: getattr(whole, f.name) for f in dataclasses.fields(whole)})
    assert among(part, TRIED).verdict.verdict == "none"


def test_a_part_has_all_speeds_and_the_loudest_samples(measured):
    ready = measured.prepare()
    assert ready.thin(len(ready.rows.places) // 2 + 1) is ready
    few = ready.thin(600)
    assert 400 <= len(few.rows.places) <= 600
    speeds = [run.speed for run in measured.runs]
    assert {min(speeds), max(speeds)} <= {run.speed for run in few.runs}
    for run in few.runs:
        (own,) = (one for one in measured.runs if run.name.startswith(one.name))
        size, first = len(run.time), int(np.flatnonzero(own.time == run.time[0])[0])
        power = sum((own.channels[c] / sd) ** 2 for c, sd in measured.noise_sd.items())
        begins = range(0, len(own.time) - size + 1, max(1, size // 2))
        assert sum(power[first : first + size]) == pytest.approx(max(sum(power[a : a + size]) for a in begins))
        for c, x in run.channels.items():
            np.testing.assert_array_equal(x, own.channels[c][first : first + size])


@pytest.mark.parametrize("stated", [True, False])
def test_dense_samples_stand_as_means_of_blocks_that_are_as_sure(tmp_path, monkeypatch, stated):
    """Kicks at 500 Hz: five samples a block, whose noise is as much less as its colour lets a mean have."""
    monkeypatch.setattr(histories, "SAMPLE", 0.002)
    monkeypatch.setattr(moving, "SUBSTEPS", 2)
    settings = {"hidden": ("steer_damper",), "bicycle": "browser", "runs": 4, "duration": 3.0}
    truth = history_case(tmp_path, rng=np.random.default_rng(3), **settings).effects["steer_damper"]["damping"]
    dense = read_measurement(tmp_path / "MEASUREMENT.toml")
    dense = dense if stated else dataclasses.replace(dense, noise_sd={})
    ready = dense.prepare()
    assert [run.step for run in ready.runs] == pytest.approx([0.01] * 4)
    assert any(note.startswith("means of 5 samples (0.01 s)") for note in ready.notes)
    for run, own in zip(ready.runs, dense.runs, strict=True):
        x = own.channels["steer_rad"][: 5 * len(run.time)]
        np.testing.assert_allclose(run.channels["steer_rad"], [np.mean(x[k : k + 5]) for k in range(0, len(x), 5)])
    verdict = among(dense, TRIED).verdict
    assert (verdict.verdict, verdict.equivalent) == ("named", ("steer_damper",))
    assert 0.95 < verdict.chi2["final"] / verdict.chi2["n"] < 1.05
    value, sd = verdict.effects[0].parameters["damping"]
    assert value == pytest.approx(truth, abs=3 * sd)
