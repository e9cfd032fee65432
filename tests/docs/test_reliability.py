"""The page on what one may rely on: its numbers are those of the summaries in data/validation."""

import json
from pathlib import Path

import pytest
from pages import page

RESULTS = Path(__file__).parents[2] / "data" / "validation"
PAGE = page("reliability")
BLIND = {}
for name in ("blind_test", "blind_test_six_cells", "blind_test_tables"):  # the newest count of a cell stands
    BLIND |= json.loads((RESULTS / f"{name}.json").read_text())["cells"]
RIG = json.loads((RESULTS / "rig_coverage.json").read_text())
DECAYS = json.loads((RESULTS / "free_decays.json").read_text())
CORRECTED = json.loads((RESULTS / "corrected_models.json").read_text())["cells"]


def percent(cells, what):
    shares = [100 * BLIND[cell][what][0] / BLIND[cell][what][1] for cell in cells]
    return f"{min(shares):.0f} to {max(shares):.0f} %"


def held(rows):
    shares = [row["coverage_percent"][part] for row in rows for part in ("real", "imaginary")]
    return f"{min(shares):.0f} to {max(shares):.0f} %"


DRIVEN = [cell for cell in DECAYS["cells"] if "driven" in cell]
ONE = ("modal-one", "history-one", "eigenvalues-one")
OUTSIDE = [BLIND[cell]["something_named"] for cell in ("modal-outside", "history-outside")]
NONE = ("modal-none", "modal-none-tight", "history-none", "history-none-tight", "eigenvalues-none")


@pytest.mark.parametrize(("start", "words"), [
    ("a name (", percent(ONE, "detected")), ("a name (", percent(ONE, "right_when_named")),
    ("a name (", " of ".join(str(sum(both)) for both in zip(*OUTSIDE, strict=True))),
    ("a name from eight", "right in {} of {}".format(*BLIND["faint-one"]["right"])),
    ("a name from eight", "no name in {0[1]} of {0[1]}".format(BLIND["faint-none"]["any_name"])),
    ("a name from eight", "{} of {} effects outside".format(*BLIND["faint-outside"]["something_named"])),
    ("`none` of", f"{sum(BLIND[c]['something_named'][0] for c in NONE)} of "
                  f"{sum(BLIND[c]['something_named'][1] for c in NONE)}"),
    ("C, K and C/K", f"{min(RIG['coverage'][q]['share_percent'] for q in RIG['coverage'])} to "
                     f"{max(RIG['coverage'][q]['share_percent'] for q in RIG['coverage'])} %"),
    ("the mode of a free decay", held(cell for name, cell in DECAYS["cells"].items() if name not in DRIVEN)),
    ("the mode of a free decay", held(DECAYS["cells"][name] for name in DRIVEN)),
    ("the mode of a free decay", held([DECAYS["repeats"]["driven by the ground, four at each of three speeds"]])),
    ("critical speeds of a corrected", " of ".join(
        str(sum(cell["inside_95"][key] for cell in CORRECTED.values())) for key in ("hits", "of"))),
])  # fmt: skip
def test_numbers_are_those_that_were_counted(start, words):
    (row,) = [line for line in PAGE.splitlines() if line.startswith(f"| {start}")]
    assert words in row


def test_every_summary_is_small_and_says_how_it_was_made():
    for file in RESULTS.glob("*.json"):
        content = json.loads(file.read_text())
        assert file.stat().st_size < 20_000
        assert "seed" in content or "--seed" in content["made_by"], file
