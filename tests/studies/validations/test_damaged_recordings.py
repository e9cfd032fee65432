"""The study of damaged recordings: the committed result, and a small run of it."""

import json
from pathlib import Path

from studies.validations._recording_writers import WRITERS
from studies.validations.damaged_recordings import CHECKED, KINDS, run

COMMITTED = Path(__file__).parents[3] / "data" / "validation" / "damaged_recordings.json"


def test_the_committed_result():
    result = json.loads(COMMITTED.read_text())
    assert set(result["by_format"]) == set(WRITERS)
    for form, counts in result["by_format"].items():
        assert sum(counts.values()) == result["cases_per_format"] == 200
        assert set(counts) <= {"refused", "right", "altered"}
        assert form not in CHECKED or "altered" not in counts
    assert result["failures"] == []
    assert result["made_by"] == f"velotyre validate damaged-recordings --seed {result['seed']} --cases 200"


def test_a_small_run(tmp_path):
    result = run(out=tmp_path, seed=3, cases=6)
    assert result["failures"] == []
    assert set(result["by_damage"]) == set(KINDS)
    assert result["by_damage"]["empty channel"] == {"refused": len(WRITERS)}
    rows = (tmp_path / "damaged_recordings.csv").read_text().splitlines()
    assert len(rows) == 1 + 6 * len(WRITERS)
