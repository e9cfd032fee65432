"""The tutorial runs as it stands: its first block is the user's file, the others are executed in order."""

import re
from pathlib import Path

from pages import section

from bicycle.effects import outside_effects
from studies.cli import main

PAGE = section("effects", "Add an effect")


def test_the_tutorial_runs_and_says_what_it_says(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    file, *blocks = re.findall(r"^```python\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)
    assert len(blocks) == 4
    name = file.splitlines()[0].removeprefix("# ")
    (tmp_path / name).write_text(file, encoding="utf-8")
    namespace = {"__name__": "tutorial"}
    with outside_effects(()):
        for block in blocks:
            exec(compile(block, "effects.md", "exec"), namespace)
    shown = capsys.readouterr().out
    assert re.search(r"the box sways at \d\.\d\d Hz at 3 m/s", shown)
    assert "effect 'swaying_box': unknown parameter 'mas'; did you mean 'mass'? known: damping, " in shown


def test_its_commands_know_the_file(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("swaying_box.py").write_text(re.findall(r"^```python\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)[0])
    Path("model.toml").write_text('bicycle = "benchmark"\n[effects.swaying_box]\nmass = 6.0\n')
    (block,) = re.findall(r"^```bash\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)
    for line in block.splitlines()[:2]:  # the third needs a measurement: tests/house/outside_effects
        main(line.split()[1:])
    shown = capsys.readouterr().out
    assert "# swaying_box" in shown
    assert "box 1/s" in shown
