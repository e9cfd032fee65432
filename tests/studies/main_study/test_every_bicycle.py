"""The study ends for packaged bicycles and for text files of neighbours: two here, all in `velotyre validate`."""

import json
import re

import pytest
from small_study import chosen, small

from bicycle.files.bicycle_file import available_bicycles
from studies.main_study.answer import answer
from studies.main_study.report import write_report
from studies.main_study.study import run_study
from studies.validations.every_bicycle import every_bicycle
from tyre.base.paths import data_root

NAMES = (*available_bicycles(), "Balanceassistv1Benchmark", "SilverBenchmark", "YellowBenchmark")
DIFFERENT = ("SilverBenchmark", "rigid_rider_joined")
"""A text file, of a bicycle without a rider, and one whose rider is part of the frame; elsewhere there is one on it."""


@pytest.fixture(scope="module")
def bicycles(tmp_path_factory):
    return {one.name: one for one in every_bicycle(tmp_path_factory.mktemp("own"))}


def test_all_are_tried(bicycles):
    assert tuple(bicycles) == NAMES


@pytest.mark.parametrize("name", DIFFERENT)
def test_the_study_ends_with_an_answer_and_a_report(name, bicycles, tmp_path):
    settings = small(bicycles[name], fronts=2, samples=40)
    study = run_study(settings, cases=chosen(settings, {"Tyre1 flat": (3.5, 7.5)}))
    first = answer(study)
    assert len(first.sentences) >= 4
    assert study.left_out == ()
    report, _ = write_report(study, first, tmp_path, paper_figures=[])
    assert not re.search(r"\bnan\b", report.read_text(), re.IGNORECASE)


def test_the_published_run_has_them_all():
    rows = json.loads(data_root().joinpath("validation", "every_bicycle.json").read_text())["rows"]
    assert [row["bicycle"] for row in rows] == list(NAMES)
    assert all(row["report_written"] and not row["left_out"] for row in rows)
