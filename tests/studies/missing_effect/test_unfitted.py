"""Runs that are held out of everything and predicted: the packaged synthetic kicks, made by other equations."""

import json
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from synthetic_kicks import FRICTION, KICKS, SPEEDS, kick_table

from studies.cli import main
from studies.missing_effect import diagnose, read_measurement
from studies.missing_effect.blind.second import moving
from studies.missing_effect.motion.history_noise import ChannelNoise
from studies.missing_effect.report import page
from studies.missing_effect.reporting.findings import find
from studies.missing_effect.reporting.sentences import predicted_lines, predicted_note
from studies.missing_effect.unfitted import Predicted, predict

FOLDER = Path(str(files("tyre.data"))) / "measured" / "synthetic_kicks"


@pytest.mark.parametrize("speed", SPEEDS)
@pytest.mark.parametrize("kick", KICKS)
def test_the_packaged_runs_are_what_they_are_said_to_be(speed, kick, monkeypatch):
    """With a fifth of the steps that made them: they do not hang on the step either."""
    monkeypatch.setattr(moving, "SUBSTEPS", 2)
    packaged = np.loadtxt(FOLDER / f"kick_{speed}_{kick}.csv", delimiter=",", skiprows=1)
    np.testing.assert_allclose(packaged, kick_table(speed, kick), atol=1e-4)


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """The command with two candidates only."""
    out = tmp_path_factory.mktemp("out")
    tried = {"steer_friction", "steer_spring"}
    every = {c.identifier for c in read_measurement("synthetic_kicks").forward().candidates}
    left_out = [word for name in sorted(every - tried) for word in ("--without", name)]
    main(["diagnose", "synthetic_kicks", "--out", str(out), "--no-stability", *left_out])
    return out


def test_what_is_named_predicts_runs_that_were_never_fitted(told):
    """The hidden friction is 0.15 N m; with it what the held-out runs leave is the noise that was added."""
    record = json.loads((told / "verdict.json").read_text(encoding="utf-8"))
    assert record["verdict"] == "named"
    torque = record["effects"][0]["parameters"]["torque"]
    assert torque["value"] == pytest.approx(FRICTION, abs=3 * torque["sd"])
    (kicks,) = record["predicted"]
    assert kicks["part"] == ""
    assert kicks["runs"] == [f"kick_{speed}_b.csv" for speed in SPEEDS]
    assert kicks["n"] == 4 * 121 * 2
    assert kicks["gap"]["nominal"] == 1
    assert kicks["gap"]["final"] < 0.15 < kicks["gap"]["nuisance_only"]
    assert kicks["rms"]["roll_rate_rad_s"]["final"] == pytest.approx(0.01, rel=0.1)
    assert kicks["rms"]["steer_rad"]["final"] == pytest.approx(0.002, rel=0.2)


def test_the_page_says_so(told):
    page = (told / "report.md").read_text(encoding="utf-8")
    section = page.split("## Runs that were never fitted")[1].split("##")[0]
    assert "| rms of what roll_rate_rad_s leaves |" in section
    assert "4 runs had no part in any fit." in section
    assert "never fitted, only predicted: kick_4.6_b.csv, kick_5.2_b.csv" in page


def test_without_held_out_runs_nothing_is_said_of_them():
    """As the weave of Kooijman's bicycle, with one candidate."""
    measurement = read_measurement("kooijman2008")
    every = {c.identifier for c in measurement.forward().candidates} - {"steer_damper"}
    found = find(diagnose(measurement, without=tuple(every)))
    assert found.predicted == ()
    assert found.to_dict()["predicted"] == []


def test_a_residual_torque_predicts_them_too():
    """With a library that does not know the friction, what is kept of it predicts better than what is named."""
    measurement = read_measurement("synthetic_kicks")
    every = {c.identifier for c in measurement.forward().candidates} - {"steer_spring"}
    diagnosis = diagnose(measurement, without=tuple(every))
    findings = find(diagnosis)
    (kicks,) = findings.predicted
    assert findings.kept.residual is not None
    assert kicks.chi2["with_torque"] < kicks.chi2["final"]
    assert findings.to_dict()["predicted"][0]["gap"]["with_torque"] == kicks.gap["with_torque"]
    assert f"{kicks.gap['with_torque']:.2f} (with the residual torque)" in predicted_lines(findings)[0]
    shown = page(diagnosis, findings, {"residual_torque": ""})
    assert "| and the residual torque |" in shown
    assert "without the residual torque" in shown.split("## Parameters that moved")[1].split("##")[0]


def test_a_base_model_that_falls_over_or_has_no_gap_gives_no_share():
    fallen = Predicted("", ("run",), 10, {"nominal": np.inf, "final": 12.0}, {})
    assert fallen.gap == {"nominal": None, "final": None}
    assert fallen.to_dict()["chi2"]["nominal"] is None
    fits = Predicted("", ("run",), 10, {"nominal": 9.0, "final": 8.0}, {})
    assert fits.gap == {"nominal": None, "final": None}


@pytest.mark.parametrize("given", [False, True])
def test_what_an_estimated_noise_holds_beyond_the_sensors_is_told_from_it(given):
    """The base model leaves twice and three times what was added (0.01 rad/s, 0.002 rad), with noise of ten times."""
    measurement = read_measurement("synthetic_kicks")
    unseen = measurement.unfitted(measurement.forward())
    unseen = replace(unseen, noise={n: ChannelNoise(10 * a.sd, given=given) for n, a in unseen.noise.items()})
    base = (), {u.name: np.array([u.centre]) for u in unseen.nuisances}
    (one,) = predict(unseen, base, base)
    assert one.loud == ([] if given else ["roll_rate_rad_s", "steer_rad"])
    if not given:
        shown = [rough for _, rough in one.noise.values()]
        np.testing.assert_allclose(shown, [0.01, 0.002], rtol=0.15)  # 484 samples of each
        assert one.to_dict()["estimated_noise"]["steer_rad"]["taken"] == 10 * 0.002


def test_a_small_gap_beside_a_noise_that_is_estimated_is_not_said_without_what_is_left():
    noise = {"roll_rate_rad_s": (0.07, 0.007), "steer_rad": (0.0018, 0.0015)}
    rms = {"roll_rate_rad_s": {"nominal": 0.4, "final": 0.114}, "steer_rad": {"nominal": 0.1, "final": 0.002}}
    chi2 = {"nominal": 50.0, "final": 5.0}

    def told(known):
        findings = SimpleNamespace(predicted=[Predicted("kicks", ("run",), 10, chi2, rms, known)])
        return predicted_lines(findings)[0], predicted_note(findings)

    gap = "1 run of kicks never fitted: gap 1.00 (base model), 0.00 (final model)"
    line, note = told({})
    assert line == gap
    assert "sample" not in note.partition("the gap is")[2]
    line, note = told(noise)
    assert line.startswith(f"{gap}; the noise of roll_rate_rad_s is not stated (noise_sd) but estimated")
    for words in (line, note):
        assert (
            "roll_rate_rad_s leaves 0.114 rad/s (final model), where its noise from sample to sample is 0.007 rad/s"
        ) in words
        assert "steer_rad leaves" not in words
