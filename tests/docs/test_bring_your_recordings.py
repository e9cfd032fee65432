"""The page on recordings runs as it stands, from a look to a fit and to a verdict, and tells of every format."""

import json
import re
import shlex
import sys
from pathlib import Path

import pytest
from small_library import all_but

import studies.velotyre
from studies.cli import main
from studies.diagnosis import read_measurement
from studies.look import USES
from tyre.formats import FORMATS

PAGE = (Path(__file__).parents[2] / "docs" / "bring_your_recordings.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"^```(\{code-block\} )?(\w+)\n(:caption: (?P<file>[^\n,]+)[^\n]*\n)?(?P<text>.*?)^```", re.M | re.S)


TRIED = ("aerodynamic_drag", "pneumatic_trail", "side_slip", "steer_damper", "steer_spring")


def typed(line):
    """Arguments of a command of the page; a diagnosis tries few hypotheses, as the blind test tries them all."""
    words = shlex.split(line)[1:]
    if words[0] == "diagnose":
        words += [f"--without={name}" for name in all_but(read_measurement(words[1]), TRIED)]
    return words


def test_the_page_runs_and_says_what_it_says(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, "velotyre", studies.velotyre)  # its name once installed
    shown = ""
    for block in BLOCK.finditer(PAGE):
        kind, text = block[2], block["text"]
        if kind == "python":
            exec(compile(text, "page", "exec"), {"__name__": "page"})
        elif kind == "bash":
            for line in text.splitlines():
                main(typed(line))
                shown = capsys.readouterr().out
        elif kind == "text":
            assert text.strip() in shown
        elif Path(block["file"]).is_file():  # lines to fill in
            path = Path(block["file"])
            lines = path.read_text(encoding="utf-8").splitlines()
            for given in text.splitlines():
                (place,) = [n for n, line in enumerate(lines) if line.startswith(given.partition("=")[0])]
                assert "# FILL IN" in lines[place]
                lines[place] = given
            path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        else:
            Path(block["file"]).write_text(text, encoding="utf-8")
    # 6400 N/rad is what the page wrote into the forces, the damper what it hid in the bicycle
    (condition,) = json.loads(Path("fit.json").read_text(encoding="utf-8"))["conditions"]
    assert condition["cornering_stiffness_N_per_rad"]["value"] == pytest.approx(6400, rel=0.02)
    assert "named. Missing: steer_damper" in shown


def test_every_ending_and_use_stands_on_the_page():
    assert [ending for ending in FORMATS if f"`{ending}`" not in PAGE] == []
    assert [use for use in USES if f"| {use} |" not in PAGE] == []
