"""The page on designs: its example runs, and every option and number stands on it."""

import re
import shlex

from page_files import page, write_files

from bicycle.critical.critical_speeds import critical_speeds
from bicycle.files.model_file import read_model
from studies.cli import main
from studies.commands import design as command
from studies.design import certainty, design, problem

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


def test_every_option_and_number_stands_on_the_page():
    options = {option for p in command.command.params for option in p.opts if p.name not in ("chosen", "model")}
    options -= {"--tyre", "--pressure", "--surface", "--extrapolate", "--verbose", "--effects"}  # of every command
    options -= {"--out"}
    assert [option for option in sorted(options) if option not in PAGE] == []
    assert design.STARTS == 4
    assert "four searches" in PAGE
    for words in (
        f"{design.SAMPLES} drawn bicycles", f"{certainty.ALONG} speeds", f"up to {certainty.LOOKED_AT} draws",
        f"{problem.CLEARLY:g}".replace("1e-05", "1e-5") + " 1/s",
    ):  # fmt: skip
        assert words in PAGE
    defaults = {p.name: p.default for p in command.command.params}
    assert (defaults["low"], defaults["samples"]) == (1.0, design.SAMPLES)
