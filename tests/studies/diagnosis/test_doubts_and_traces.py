"""Doubts about units and signs, and traces of histories."""

import csv
import dataclasses
import re
import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from studies.diagnosis import FACTORS, doubts, draw_traces, known_factor, read_measurement
from studies.inference import Judgement, fit
from tests.validation.blind.histories import history_case

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples" / "measurements"


def times(source, target, factors):
    """The measurement with columns of its table multiplied."""
    rows = list(csv.DictReader((source / "weave.csv").read_text().splitlines()))
    for row in rows:
        for column, factor in factors.items():
            row[column] = repr(float(row[column]) * factor)
    with (target / "weave.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    (target / "MEASUREMENT.toml").write_text((source / "MEASUREMENT.toml").read_text())
    return read_measurement(target / "MEASUREMENT.toml")


def test_no_doubt_where_physics_makes_the_gap(damped):
    assert float(damped.nominal @ damped.nominal) > 10 * len(damped.nominal)
    assert doubts(damped) == ()


@pytest.mark.parametrize(
    ("factors", "words"),
    [
        ({"imag_rad_s": 1 / (2 * np.pi)}, "weave (imaginary part, rad/s): the measured values are about 1/6.28 of "
         "those of the base model throughout; are they in Hz?"),
        ({"imag_rad_s": 2 * np.pi}, "about 6.28 times"),
        ({"steer_over_lean_re": -1, "steer_over_lean_im": -1}, "weave steer over lean (real part): the measured values "
         "have the sign opposite to the base model's throughout; is the sign that of the conventions"),
        ({"steer_over_lean_re": 57.3, "steer_over_lean_im": 57.3}, "about 57.3 times those of the base model "
         "throughout; are they in degrees?"),
    ],
)  # fmt: skip
def test_a_column_in_another_unit_or_of_the_other_sign_is_asked_about(modal, begun, tmp_path, factors, words):
    found = " | ".join(doubts(begun(times(modal, tmp_path, factors))))
    assert words in found
    assert "weave (real part" not in found


def test_an_absurd_gap_asks_for_units(damped):
    absurd = SimpleNamespace(**vars(damped))
    absurd.hypotheses = SimpleNamespace(null=SimpleNamespace(chi2=1.1e4 * len(damped.nominal)))
    absurd.verdict = SimpleNamespace(verdict="unknown")
    (found,) = doubts(absurd)
    assert found.startswith("chi^2 is 1.1e+04 a number even with the parameters adjusted: check the units")
    absurd.verdict = SimpleNamespace(verdict="class")
    assert doubts(absurd) == ()


def test_another_bicycle_is_asked_about(modal, begun, tmp_path):
    """The data of one bicycle with the file of another: its parameters have to go far."""
    shutil.copytree(modal, tmp_path, dirs_exist_ok=True)
    file = tmp_path / "MEASUREMENT.toml"
    own = read_measurement(file).model.bicycle.name
    file.write_text(file.read_text().replace(f'"{own}"', '"crescendo"'))
    (asked,) = doubts(begun(read_measurement(file), verdict="unknown"))
    told = re.match(
        r"the parameters went farther than their stated or assumed standard deviations allow \((\w+) "
        r"[+-]([\d.]+) sd, .*; sum of squares ([\d.]+) for \d+, and chance makes more than (\d+) once in a million "
        r"at most\): is the bicycle of the file the one that was measured",
        asked,
    )
    assert told
    assert float(told[3]) > float(told[4]) > float(told[2])


def test_factors_near_known_ones_are_known():
    assert known_factor(55.0, FACTORS) == pytest.approx(57.3, abs=0.01)
    assert known_factor(-1.1, FACTORS) == -1.0
    assert known_factor(990.0, FACTORS) == 1000.0
    assert known_factor(1.0, FACTORS) is None
    assert known_factor(2.0, FACTORS) is None


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


@pytest.mark.parametrize(
    ("channel", "factor", "words"),
    [
        ("roll_rate_rad_s", 180 / np.pi, "roll_rate_rad_s: the measured values are about 57.3 times"),
        (
            "yaw_rate_rad_s",
            1000.0,
            "yaw_rate_rad_s: the measured values are about 1e+03 times those of the base model "
            "throughout; are they in mrad or mrad/s?",
        ),
        ("steer_rad", -1.0, "steer_rad: the measured values have the sign opposite"),
    ],
)
def test_a_channel_that_does_not_fit_the_others_is_asked_about(histories, channel, factor, words):
    assert any(doubt.startswith(words) for doubt in doubts(_of(scaled(histories, channel, factor))))


def test_channels_that_fit_each_other_are_not(histories):
    assert doubts(_of(histories)) == ()


def test_a_channel_far_below_its_noise_is_asked_about(histories):
    faint = scaled(histories, "steer_rad", 1e-5)
    assert any(doubt.startswith("steer_rad: its root mean square is ") for doubt in doubts(_of(faint)))
    assert all("next to nothing" not in doubt for doubt in doubts(_of(scaled(histories, "steer_rad", 0.3))))


def test_no_angular_rate_is_in_kilometres_an_hour(histories):
    assert doubts(_of(scaled(histories, "yaw_rate_rad_s", 3.6))) == ()


def _of(measurement):
    forward = measurement.ready()
    p = len(forward.nuisances)
    null = SimpleNamespace(
        chi2=0.0, theta=np.array([u.centre for u in forward.nuisances]), unknowns=forward.nuisances,
        effect_columns=slice(p, p), covariance=np.eye(p), candidates=(), objective=0.0, residual=np.zeros(3),
    )  # fmt: skip
    return SimpleNamespace(
        kind=forward, nominal=np.zeros(3), hypotheses=SimpleNamespace(null=null), final=null,
        verdict=SimpleNamespace(verdict="none"),
    )  # fmt: skip


def test_traces_leave_what_the_noise_is(histories, tmp_path):
    """Nothing is hidden: measured minus computed is noise alone, far below the motion."""
    forward = histories.ready()
    null = fit(forward)
    rest = forward.unexplained((), null.theta)
    assert set(rest) == set(forward.noise)
    for name, left in rest.items():
        measured = np.concatenate([run.channels[name] for run in histories.runs])
        assert left.shape == measured.shape
        assert left.std() < 0.5 * measured.std()
        assert abs(np.corrcoef(left, measured)[0, 1]) < 0.5
    nominal, _ = forward.residual((), np.array([u.centre for u in forward.nuisances]))
    judgement = Judgement(
        kind=forward, verdict=None, hypotheses=SimpleNamespace(null=null), final=null, nominal=nominal, held_out={},
        similar=((), np.zeros((0, 0))),
    )  # fmt: skip
    assert draw_traces(judgement, tmp_path / "traces")
    svg = (tmp_path / "traces.svg").read_text(encoding="utf-8")
    for words in ("measured", "base model", "parameters only", "time, s", *forward.noise):
        assert f"<!-- {words} -->" in svg, words
    assert "with" not in {line for line in svg.splitlines() if line.strip().startswith("<!--")}
    assert "beyond the frame" not in svg
    wild = dataclasses.replace(null, theta=null.theta * 1.5)
    assert draw_traces(
        dataclasses.replace(judgement, final=wild, hypotheses=SimpleNamespace(null=wild)), tmp_path / "w"
    )
    svg = (tmp_path / "w.svg").read_text(encoding="utf-8")
    assert "<!-- beyond the frame: -->" in svg
    assert re.search(r"<!-- parameters only: -\S+ \.\. \S+ -->", svg)
