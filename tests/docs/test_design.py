"""The page on designs: its example runs, and every option and default stands on it."""

import re
import shlex

from page_files import page, write_files

from bicycle import critical_speeds, read_model
from studies.cli import build, main

PAGE = page("design")


def test_the_example_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(write_files(PAGE, tmp_path))
    (block,) = re.findall(r"^```bash\n(.*?)\n```", PAGE, flags=re.M | re.S)
    for line in block.splitlines():
        main(shlex.split(line)[1:])
    shown = capsys.readouterr().out
    assert "kept from 3 to 25 m/s: wobble stable" in shown
    assert "drawn bicycles keep it" in shown
    assert not [c for c in critical_speeds(read_model("better.toml"), 25.0) if c.mode == "wobble"]
    assert [c for c in critical_speeds(read_model("soft.toml"), 25.0) if c.mode == "wobble"]


def test_every_option_and_default_stands_on_the_page():
    known = build().get_command(None, "design").params
    options = {option for p in known for option in p.opts if option.startswith("--")}
    options -= {"--tyre", "--pressure", "--surface", "--extrapolate", "--verbose", "--effects"}  # of every command
    assert [option for option in sorted(options - {"--out"}) if option not in PAGE] == []
    defaults = {p.name: p.default for p in known}
    assert f"{defaults['samples']} drawn bicycles" in PAGE
    assert f"`--from` ({defaults['low']:g} m/s)" in PAGE
