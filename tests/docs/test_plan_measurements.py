"""The page on plans with prices runs as it stands, and tells of every key."""

import json
import re
import shlex
from pathlib import Path

import pytest

from studies.cli import main
from studies.inference.identifiability import ALIKE_COSINE, HOPELESS_ODDS
from studies.missing_effect.plan import costs, search
from studies.missing_effect.plan.separation import DRAWS

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "plan_measurements.md").read_text(encoding="utf-8")
FILES = (DOCS / "measurement_files.md").read_text(encoding="utf-8")


def test_the_page_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (text,) = re.findall(r"^:caption: costs.toml\n(.*?)^```", PAGE, flags=re.M | re.S)
    Path("costs.toml").write_text(text, encoding="utf-8")
    (line,) = re.findall(r"^```bash\n(.*?)\n```", PAGE, flags=re.M | re.S)
    main(shlex.split(line)[1:])
    shown = capsys.readouterr().out
    assert "pneumatic_trail or steer_damper" in shown
    found = json.loads(Path("plan/plan.json").read_text(encoding="utf-8"))
    prices = {4: (50, 10), 5: (50, 10), 6: (50, 10), 7: (50, 10), 8: (200, 20), 10: (200, 20)}
    paid = 300 * len(found["channels"])
    for step in found["steps"]:
        setup, each = prices.get(step["speed_m_s"], (900, 0))
        assert step["price"] == setup + each * step["count"]
        paid += step["price"]
    assert found["cost"] == paid
    assert found["complete"]
    (question,) = found["questions"]
    assert question["then"]["probability"] >= 0.9 > question["now"]["probability"]
    assert "## What to do" in Path("plan/plan.md").read_text(encoding="utf-8")
    assert Path("plan/plan.png").stat().st_size > 10_000


def test_every_key_stands_on_the_page():
    keys = [*costs.FILE.keys, *costs.RUN.keys, *costs.BENCH.keys, *costs.GOAL.keys, *costs.RATIOS, *costs.ROOTS]
    spans = " ".join(re.findall(r"`([^`\n]+)`", PAGE))
    assert [key for key in keys if not re.search(rf"(?<!\w){key}(?!\w)", spans)] == []
    for number in (DRAWS, search.MOST_NODES, costs.MOST_RUNS, int(HOPELESS_ODDS), ALIKE_COSINE):
        assert f"{number}" in PAGE


def test_a_bench_test_is_entered_as_the_plan_says(tmp_path, monkeypatch, capsys):
    """A hidden steer spring of 3 N m/rad that modes cannot tell from pneumatic trail, measured afterwards."""
    monkeypatch.chdir(tmp_path)
    weave = re.search(r"^:caption: bench/weave.csv\n(.*?)^```", FILES, flags=re.M | re.S)[1]
    Path("weave.csv").write_text(weave, encoding="utf-8")
    known = 'kind = "modal"\nbicycle = "benchmark"\n[modal]\ntable = "weave.csv"\n'
    stated = "[uncertainty]\nlam = 0.005\nIBxx = 0.2\n"
    Path("before.toml").write_text(known + stated, encoding="utf-8")
    Path("costs.toml").write_text("[bench.steer_spring]\nprice = 100\nsd = 0.3\n", encoding="utf-8")
    main(["plan", "before.toml", "--costs", "costs.toml", "--out", "plan"])
    shown = capsys.readouterr().out
    assert shown.startswith("class: ")
    ((step,), page) = (
        json.loads(Path("plan/plan.json").read_text("utf-8"))["steps"],
        Path("plan/plan.md").read_text("utf-8"),
    )
    assert f"afterwards: {step['afterwards']}\n" in shown
    assert f"- {step['afterwards']}\n" in page
    told = re.search(
        r"\[effects.(\w+)\] (\w+) = VALUE with \[uncertainty\] ([\w.]+) = SD \(both in N m/rad\)", step["afterwards"]
    )
    entered = f"{known}{stated}{told[3]} = 0.3\n[effects.{told[1]}]\n{told[2]} = 3.1\n"
    assert verdict_of(entered) == "none"
    as_candidate = f"{known}{stated}[candidates.steer_spring]\nstiffness = 3.1\n"
    assert verdict_of(as_candidate) == "class"
    shown = capsys.readouterr().out
    assert re.search(r"steer_spring +- +stiffness 3.1(00)? N m/rad, as stated: not fitted", shown)
    assert "without a number" not in shown
    with pytest.raises(SystemExit):
        verdict_of(as_candidate.replace("0.2\n", "0.2\nsteer_spring.stiffness = 0.3\n"))
    assert "has no steer_spring; if it is there, write [effects.steer_spring] stiffness" in capsys.readouterr().err


def verdict_of(content):
    Path("after.toml").write_text(content, encoding="utf-8")
    main(["diagnose", "after.toml", "--json", "after.json"])
    return json.loads(Path("after.json").read_text("utf-8"))["verdict"]
