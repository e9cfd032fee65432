"""What the README shows runs as it stands."""

import re
import sys
import tomllib
from pathlib import Path

import numpy as np

import studies.velotyre
from tyre import TyreMap

README = Path(__file__).parents[2] / "README.md"


def test_the_python_example_of_six_lines_runs(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "velotyre", studies.velotyre)  # its name once installed
    (block,) = re.findall(r"^```python\n(.*?)^```", README.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    assert len([line for line in block.splitlines() if line.strip()]) == 6
    namespace = {"__name__": "readme"}
    exec(compile(block, "README.md", "exec"), namespace)
    shown = capsys.readouterr().out
    # the measured condition is in the paper's tables 2 and 6: 111.7 N/deg and 106.0 mm at 400 N, 5.5 bar
    tyre = namespace["tyre"]
    assert np.isclose(np.radians(tyre.cornering_stiffness), 111.7, atol=0.05)
    assert np.isclose(tyre.relaxation_length, 0.106, atol=5e-4)
    assert TyreMap.load("Tyre1").origin(load=tyre.load, pressure=tyre.pressure) == "measured"
    # two tables, the second with two more states: the lagged lateral forces
    without, lagged = (table for table in shown.split("   speed_m_s")[1:])
    for table in (without, lagged):
        assert all(name in table for name in ("real_1_s", "imaginary_rad_s", "weave", "wobble", "capsize"))
    assert "..." not in shown


def test_it_cites_the_version_and_licence_of_the_package():
    project = tomllib.loads((README.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    text = README.read_text(encoding="utf-8")
    assert f"Version {project['version']} (2026). Licence {project['license']}." in text


def test_every_command_of_the_readme_exists():
    from studies.cli import build

    group = build()
    names = set(re.findall(r"`velotyre ([a-z-]+)", README.read_text(encoding="utf-8")))
    assert len(names) > 10
    assert names <= set(group.list_commands(None))
