"""Kind hands of ``velotyre front-frame FILE``: SYNTHETIC ring-downs of the steering under two grips."""

import json
import re
import tomllib

import pytest

from bicycle.model import build_model
from studies.cli import main

ROWS = """grip,spring_N_m_per_rad,frequency_Hz,frequency_sd_Hz,damping_ratio,damping_ratio_sd
loose,40,2.55,0.05,0.17,0.017
loose,300,5.95,0.12,0.075,0.0075
firm,40,2.6,0.05,0.37,0.037
firm,300,5.3,0.11,0.19,0.019
"""


@pytest.fixture
def file(tmp_path):
    (tmp_path / "hands.csv").write_text(ROWS)
    target = tmp_path / "hands.toml"
    target.write_text('kind = "hands"\nbicycle = "pista_charlie_drops"\n[hands]\ntable = "hands.csv"\n')
    return target


def test_each_grip_has_a_table_that_a_model_file_takes(file, capsys):
    main(["front-frame", str(file)])
    shown = capsys.readouterr().out
    tables = re.split(r"^Hands, grip \w+:.*$", shown, flags=re.M)[1:]
    assert len(tables) == 2
    for block in tables:
        toml = block[block.index("[effects.rider_arms]") :].partition("Each grip")[0]
        model = build_model({"bicycle": "pista_charlie_drops", **tomllib.loads(toml)})
        assert model.sd["rider_arms.damping"] > 0


def test_the_record_and_what_is_refused(file, tmp_path, capsys):
    main(["front-frame", str(file), "--json", str(tmp_path / "hands.json")])
    grips = json.loads((tmp_path / "hands.json").read_text())["grips"]
    assert grips["firm"]["rider_arms"]["damping"] > grips["loose"]["rider_arms"]["damping"]
    for arguments, words in (
        ([str(file), "--out", str(tmp_path / "x.toml")], "each grip is a case of its own; copy the table"),
        ([str(tmp_path / "bad.toml")], "the table [hands] is missing"),
    ):
        (tmp_path / "bad.toml").write_text('kind = "hands"\nbicycle = "pista"\n')
        with pytest.raises(SystemExit):
            main(["front-frame", *arguments])
        assert words in capsys.readouterr().err
