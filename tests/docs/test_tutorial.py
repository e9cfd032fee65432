"""The tutorial runs as it stands: its code blocks are executed in order, in one namespace."""

import re
from pathlib import Path

PAGE = Path(__file__).parents[2] / "docs" / "add_an_effect.md"


def test_the_tutorial_runs_and_says_what_it_says(capsys):
    blocks = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    assert len(blocks) == 4
    namespace = {"__name__": "tutorial"}
    for block in blocks:
        exec(compile(block, str(PAGE), "exec"), namespace)
    shown = capsys.readouterr().out
    assert "weave is stabilised at " in shown
    assert "effect 'speed_damper': unknown parameter 'slpe'; did you mean 'slope'? known: slope" in shown
