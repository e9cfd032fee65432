"""The page of the benchmark shows the table that was counted."""

import json
from pathlib import Path

from pages import section

from tests.validation.benchmark import table

COUNT = Path(__file__).parents[2] / "data" / "validation" / "benchmark.json"


def test_the_table_is_that_of_the_count():
    found = json.loads(COUNT.read_text())
    assert table(found["scores"]) in section("reliability", "A benchmark of answers")
    assert f"--cases {found['cases'] // 3}" in found["made_by"]
