"""Runs that are held out of everything and predicted: the packaged synthetic kicks, made by other equations."""

import json
import re
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from read_report import read_report
from small_library import all_but, among
from synthetic_kicks import FRICTION, KICKS, SPEEDS, kick_table

from studies.cli import main
from studies.diagnosis import ChannelNoise, Predicted, find, page, predict, read_measurement, record, terminal
from tests.validation.blind import motion as moving

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
    others = all_but(read_measurement("synthetic_kicks"), ("steer_friction", "steer_spring"))
    main(["diagnose", "synthetic_kicks", "--out", str(out), "--no-stability", *(f"--without={n}" for n in others)])
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
    page = read_report(told)
    assert "**Evidence:** On held-out runs" in page
    assert re.search(
        r"`model.toml` with nothing added, parameters re-estimated \(largest shift: trail -[\d.]+ SD\)", page
    )
    assert "Not added, as a model file cannot contain it: steer_friction." in page
    section = page.split("Held-out runs</summary>")[1].split("</details>")[0]
    assert "| rms residual of roll_rate_rad_s |" in section
    assert "| discrepancy of 4 runs |" in section
    assert "never fitted, only predicted: kick_4.6_b.csv, kick_5.2_b.csv" in page


def test_without_held_out_runs_nothing_is_said_of_them():
    """As the weave of Kooijman's bicycle, with one candidate."""
    diagnosis = among(read_measurement("kooijman2008"), ("steer_damper",))
    found = find(diagnosis)
    assert found.predicted == ()
    assert record(diagnosis, found)["predicted"] == []


def test_where_nothing_is_named_the_words_tell_single_effects_from_several():
    """What opposes the steer rate stands for dry friction beside a drift; alone it predicts nothing."""
    diagnosis = among(read_measurement("synthetic_kicks"), ("steer_damper", "steer_spring", "drift"))
    findings = find(diagnosis)
    (kicks,) = findings.predicted
    assert (diagnosis.verdict.verdict, diagnosis.verdict.nearest.name) == ("unknown", "drift+steer_spring")
    assert kicks.single == "steer_damper"
    alike = findings.story.look_alikes
    assert alike.unseen
    assert alike.nearest == "drift+steer_spring"
    assert alike.adjusted == pytest.approx(findings.story.held_out.remaining_share("adjusted"))
    assert alike.adjusted == pytest.approx(kicks.gap["nuisance_only"])
    assert (alike.best_single, alike.tried) == (("steer_damper", pytest.approx(kicks.gap["single_effect"])), 2)
    assert alike.best_single[1] > 0.99 * alike.adjusted  # without the drift the damper predicts nothing
    shown = next(line for line in terminal(diagnosis, findings).splitlines() if line.startswith("evidence: "))
    assert f"On these runs {100 * alike.adjusted:.0f} % remains with re-estimated parameters alone, " in shown
    assert (
        f"{100 * alike.left:.0f} % with the closest alternative, drift + steer_spring. No single effect improves"
        in shown
    )


def test_an_unmodelled_torque_predicts_them_too():
    """With a library that does not know the friction, what is kept of it predicts better than what is named."""
    diagnosis = among(read_measurement("synthetic_kicks"), ("steer_spring",))
    findings = find(diagnosis)
    (kicks,) = findings.predicted
    assert findings.torque is not None
    assert kicks.chi2["with_torque"] < kicks.chi2["final"]
    assert record(diagnosis, findings)["predicted"][0]["gap"]["with_torque"] == kicks.gap["with_torque"]
    shown = page(diagnosis, findings, {"unmodelled_torque": ""})
    assert "| with an unmodelled torque, parameters re-estimated |" in shown


def test_a_base_model_that_falls_over_or_has_no_gap_gives_no_share():
    fallen = Predicted("", ("run",), 10, {"nominal": np.inf, "final": 12.0}, {})
    assert fallen.gap == {"nominal": None, "final": None}
    fits = Predicted("", ("run",), 10, {"nominal": 9.0, "final": 8.0}, {})
    assert fits.gap == {"nominal": None, "final": None}


@pytest.mark.parametrize("stated", [False, True])
def test_what_an_estimated_noise_holds_beyond_the_sensors_is_told_from_it(stated):
    """The base model leaves twice and three times what was added (0.01 rad/s, 0.002 rad), with noise of ten times."""
    measurement = read_measurement("synthetic_kicks")
    unseen = measurement.prepare().held_out_data()
    unseen = replace(unseen, noise={n: ChannelNoise(10 * a.sd, stated=stated) for n, a in unseen.noise.items()})
    base = (), {u.name: np.array([u.centre]) for u in unseen.nuisances}
    (one,) = predict(unseen, {"nuisance_only": base, "final": base})
    assert one.loud == ([] if stated else ["roll_rate_rad_s", "steer_rad"])
    if not stated:
        shown = [rough for _, rough in one.noise.values()]
        np.testing.assert_allclose(shown, [0.01, 0.002], rtol=0.15)  # 484 samples of each
        assert one.noise["steer_rad"][0] == 10 * 0.002
