"""The page on plans with prices runs as it stands, and tells of every key."""

import json
import re
import shlex
from pathlib import Path

from studies.cli import main
from studies.inference.identifiability import ALIKE_COSINE, HOPELESS_ODDS
from studies.missing_effect.plan import costs, search
from studies.missing_effect.plan.separation import DRAWS

PAGE = (Path(__file__).parents[2] / "docs" / "plan_measurements.md").read_text(encoding="utf-8")


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
