"""The page on stability charts: its examples run, and every column and option stands on it."""

import re
import shlex

import pandas as pd
import pytest
from page_files import page, write_files

from studies.cli import build, main

PAGE = page("stability_charts")


@pytest.fixture(scope="module")
def tables(tmp_path_factory):
    folder = write_files(PAGE, tmp_path_factory.mktemp("page"))
    (block,) = re.findall(r"^```bash\n(.*?)\n```", PAGE, flags=re.M | re.S)
    found = {}
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(folder)
        for line in block.splitlines():
            words = shlex.split(line)
            main(words[1:])
            out = words[words.index("--out") + 1]
            assert (folder / out / "stability_chart.png").stat().st_size > 10_000
            found[out] = pd.read_csv(folder / out / "stability_chart.csv")
    return found


def test_the_examples_run_and_their_points_lie_on_the_axis(tables):
    assert set(tables["chart"]["mode"]) == {"weave", "wobble", "capsize"}
    for table in tables.values():
        assert (table.residual_real_1_s.abs() < 1e-9 * table.largest_root_1_s).all()


def test_every_column_and_option_stands_on_the_page(tables):
    columns = tables["chart"].columns[2:].tolist()
    plain = [re.sub(r"^(sd|towards_instability)_(?!normal).*", r"\1_NAME", name) for name in columns]
    assert [name for name in plain if f"`{name}`" not in PAGE] == []
    assert tables["chart"].columns[:2].tolist() == ["speed_m_s", "front_compliance_stiffness_N_m_rad"]
    command = build().get_command(None, "chart")
    options = {option for p in command.params for option in p.opts if option.startswith("--")}
    options -= {"--tyre", "--pressure", "--surface", "--extrapolate", "--verbose", "--effects"}  # of every command
    assert [option for option in sorted(options) if option not in PAGE] == []
