"""Doubts about units and signs, and traces of histories."""

import dataclasses
import re
import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from studies.diagnosis import doubts, draw_traces, read_measurement
from studies.inference import Judgement, fit
from tests.validation.blind.histories import history_case

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples" / "measurements"


def test_no_doubt_where_physics_makes_the_gap(damped):
    assert float(damped.nominal @ damped.nominal) > 10 * len(damped.nominal)
    assert doubts(damped) == ()


def test_an_absurd_gap_asks_for_units(damped):
    absurd = SimpleNamespace(**vars(damped))
    absurd.hypotheses = SimpleNamespace(null=SimpleNamespace(chi2=1.1e4 * len(damped.nominal)))
    absurd.verdict = SimpleNamespace(verdict="unknown", equivalent=())
    (found,) = doubts(absurd)
    assert found.startswith(
        "the misfit per data point (chi^2) is 1.1e+04 with re-estimated parameters: first check units"
    )
    absurd.verdict = SimpleNamespace(verdict="class", equivalent=())
    assert doubts(absurd) == ()


def test_another_bicycle_is_asked_about(modal, begun, tmp_path):
    """The data of one bicycle with the file of another: its parameters have to go far."""
    shutil.copytree(modal, tmp_path, dirs_exist_ok=True)
    file = tmp_path / "MEASUREMENT.toml"
    own = read_measurement(file).model.bicycle.name
    file.write_text(file.read_text().replace(f'"{own}"', '"crescendo"'))
    (asked,) = doubts(begun(read_measurement(file), verdict="unknown"))
    told = re.match(
        r"parameter shifts exceed the stated or assumed standard uncertainties \((\w+) "
        r"[+-]([\d.]+) SD, \w+ [+-][\d.]+ SD, \w+ [+-][\d.]+ SD\): check that the file describes the bicycle as ridden",
        asked,
    )
    assert told
    assert float(told[2]) > 5


@pytest.fixture(scope="module")
def histories(tmp_path_factory):
    folder = tmp_path_factory.mktemp("histories")
    history_case(folder, hidden=(), rng=np.random.default_rng(3), bicycle="browser", runs=3, duration=2.5)
    return read_measurement(folder / "MEASUREMENT.toml")


def scaled(measurement, channel, factor):
    runs = tuple(
        dataclasses.replace(run, channels={**run.channels, channel: factor * run.channels[channel]})
        for run in measurement.runs
    )
    return dataclasses.replace(measurement, runs=runs)


def test_channels_that_fit_each_other_are_not(histories):
    assert doubts(_of(histories)) == ()


def test_a_channel_far_below_its_noise_is_asked_about(histories):
    faint = scaled(histories, "steer_rad", 1e-5)
    assert any(doubt.startswith("steer_rad: its root mean square is ") for doubt in doubts(_of(faint)))
    assert all("almost no information" not in doubt for doubt in doubts(_of(scaled(histories, "steer_rad", 0.3))))


def _of(measurement):
    forward = measurement.prepare()
    p = len(forward.nuisances)
    null = SimpleNamespace(
        chi2=0.0, theta=np.array([u.centre for u in forward.nuisances]), unknowns=forward.nuisances,
        effect_columns=slice(p, p), covariance=np.eye(p), candidates=(), objective=0.0, residual=np.zeros(3),
    )  # fmt: skip
    return SimpleNamespace(
        kind=forward, nominal=np.zeros(3), hypotheses=SimpleNamespace(null=null), final=null,
        verdict=SimpleNamespace(verdict="none", equivalent=()),
    )  # fmt: skip


def test_traces_leave_what_the_noise_is(histories, tmp_path):
    """Nothing is hidden: measured minus computed is noise alone, far below the motion."""
    forward = histories.prepare()
    null = fit(forward)
    rest = forward.residuals_by_channel((), null.theta)
    assert set(rest) == set(forward.noise)
    for name, left in rest.items():
        measured = np.concatenate([run.channels[name] for run in histories.runs])
        assert left.shape == measured.shape
        assert left.std() < 0.5 * measured.std()
        assert abs(np.corrcoef(left, measured)[0, 1]) < 0.5
    nominal, _ = forward.residual((), np.array([u.centre for u in forward.nuisances]))
    judgement = Judgement(
        kind=forward, verdict=None, hypotheses=SimpleNamespace(null=null), final=null, nominal=nominal, held_out={},
    )  # fmt: skip
    assert draw_traces(judgement, tmp_path / "traces")
    svg = (tmp_path / "traces.svg").read_text(encoding="utf-8")
    for words in ("measured", "base model", "parameters re-estimated", "time, s", *forward.noise):
        assert f"<!-- {words} -->" in svg, words
    assert "with" not in {line for line in svg.splitlines() if line.strip().startswith("<!--")}
    assert "outside the axis" not in svg
    wild = dataclasses.replace(null, theta=null.theta * 1.5)
    assert draw_traces(
        dataclasses.replace(judgement, final=wild, hypotheses=SimpleNamespace(null=wild)), tmp_path / "w"
    )
    svg = (tmp_path / "w.svg").read_text(encoding="utf-8")
    assert "<!-- outside the axis: -->" in svg
    assert re.search(r"<!-- parameters re-estimated: -\S+ \.\. \S+ -->", svg)
