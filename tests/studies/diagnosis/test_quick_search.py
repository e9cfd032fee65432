"""The quick search: single effects by least squares and Schwarz's criterion."""

import json
import math
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from studies.cli import main
from studies.diagnosis import diagnose, read_measurement
from studies.inference import Candidate, Kind, Rows, UncertainParameter, judge_quickly
from tests.validation.blind.histories import history_case

X = np.linspace(-1.0, 1.0, 40)
SHAPES = {"slope": X, "bend": X**2 - 0.4, "twin": X + 0.02 * X**3}


@dataclass(frozen=True)
class Lines(Kind):
    """data = level + sizes times shapes, noise 0.1; SYNTHETIC."""

    readings: np.ndarray
    candidates: tuple
    nuisances: tuple = (UncertainParameter("level", "1", {"level": 1.0}, 0.0, 1.0),)
    rows: Rows = field(default_factory=lambda: Rows(("x",) * 40, X, ("x",) * 40, np.arange(40) % 4))

    def residual(self, candidates, theta, *, slopes=True):
        columns = np.stack([np.ones(40), *(SHAPES[c.identifier] for c in candidates)], 1)
        return (self.readings - columns @ theta) / 0.1, -columns / 0.1


def lines(truth, *names, seed=1):
    size = UncertainParameter("size", "1", {"size": 1.0}, 0.0, 10.0, size=True)
    noise = 0.1 * np.random.default_rng(seed).standard_normal(40)
    tried = tuple(Candidate(name, (size,)) for name in names)
    return Lines(0.3 + sum(x * SHAPES[name] for name, x in truth.items()) + noise, tried)


def criterion(problem, *names):
    """chi^2 of ordinary least squares, its ridge of the prior and k ln n; no code of the engine."""
    a = np.stack([np.ones(40), *(SHAPES[name] for name in names)], 1)
    rows = np.vstack([a / 0.1, np.diag([1.0, 0.1][: a.shape[1]])])
    y = np.append(problem.readings / 0.1, [0.0] * a.shape[1])
    best = np.linalg.lstsq(rows, y, rcond=None)[0]
    return float(((y - rows @ best) ** 2).sum()) + len(names) * math.log(40)


def test_hypotheses_are_weighed_by_the_criterion():
    problem = lines({"slope": 0.05}, "slope", "bend")
    known = judge_quickly(problem).hypotheses
    for f in known.fits:
        expected = criterion(problem, f.name) - criterion(problem)
        assert -2 * math.log(known.odds(f, known.null)) == pytest.approx(expected, abs=1e-2)
        (begin,) = f.begins  # the most promising of two sizes, each beside the best level and beside that of the prior
        tried = [np.append(level, size) for level in (known.null.theta, 0.0) for size in f.candidates[0].starts[:2]]
        values = [(problem.residual(f.candidates, at)[0] ** 2).sum() + at @ (at / [1.0, 100.0]) for at in tried]
        assert begin.tolist() == tried[int(np.argmin(values))].tolist()


def test_noise_is_estimated_beside_the_best_hypothesis(monkeypatch):
    seen = []
    monkeypatch.setattr(Lines, "estimate_noise", lambda kind, best: seen.append(best.name) or kind)
    judge_quickly(lines({"slope": 0.5}, "bend", "slope"))
    assert seen == ["slope"]


@pytest.mark.parametrize(
    ("truth", "tried", "word", "names"),
    [
        ({"slope": 0.5}, ("slope", "bend"), "named", {"slope"}),
        ({"slope": 0.5}, ("slope", "bend", "twin"), "class", {"slope", "twin"}),
        ({}, ("slope", "bend"), "none", set()),
        ({"slope": 0.5, "bend": 0.8}, ("slope", "bend"), "unknown", set()),  # no single effect fits
        ({}, (), "none", set()),
    ],
)
def test_words_of_the_quick_search(truth, tried, word, names):
    found = judge_quickly(lines(truth, *tried)).verdict
    assert (found.verdict, set(found.equivalent)) == (word, names)


def test_a_damper_is_named_in_histories_without_a_stated_noise(tmp_path):
    rng = np.random.default_rng(3)
    truth = history_case(tmp_path, hidden=("steer_damper",), rng=rng, bicycle="browser", runs=4, duration=2.0)
    file = tmp_path / "MEASUREMENT.toml"
    lines = file.read_text().splitlines()
    start = lines.index("[histories.noise_sd]")
    file.write_text("\n".join([*lines[:start], *lines[start + 4 :]]))
    found = diagnose(read_measurement(file), quick=True).verdict
    assert found.verdict in ("named", "class")
    value, sd = found.effects[0].parameters["damping"]
    assert abs(value - truth.effects["steer_damper"]["damping"]) < 4 * sd


def test_the_screen_says_that_the_search_was_quick(tmp_path, capsys):
    main(["diagnose", "kooijman2008", "--quick", "--json", str(tmp_path / "v.json")])
    assert json.loads((tmp_path / "v.json").read_text())["search"] == "quick"
    shown = capsys.readouterr().out
    assert shown.startswith("quick search, single effects by least squares and BIC")
    assert "evidence: On the fitted data (quick search: nothing held out)" in shown
    assert "next: Run the full search, without --quick." in shown
    assert len(shown.splitlines()) <= 12


def test_the_quick_search_writes_no_report(tmp_path, capsys):
    with pytest.raises(SystemExit):
        main(["diagnose", "kooijman2008", "--quick", "--out", str(tmp_path / "d")])
    assert "--quick writes no report" in capsys.readouterr().err
    assert not (tmp_path / "d").exists()


def test_a_size_has_the_digits_of_its_sd_and_counted_places_have_no_unit(capsys):
    """Thousands of N m/rad, known to tens; readings are counted."""
    folder = Path(__file__).parents[3] / "docs" / "examples" / "measurements" / "standing"
    main(["diagnose", str(folder / "MEASUREMENT.toml"), "--quick"])
    shown = capsys.readouterr().out
    assert re.search(r"front_compliance: stiffness \d{4} ± \d\d N m/rad, damping \d\.\d{3} ± 0\.0\d\d N m s/rad", shown)
    assert re.search(r", reading \d+ to \d+\.$", shown, re.M)
