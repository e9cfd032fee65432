"""``velotyre front-frame --plan``: the sheet, whose files are read as they are written there."""

import textwrap

from studies.cli import main
from studies.diagnosis import read_measurement


def test_the_files_of_the_sheet_are_read(capsys, tmp_path):
    main(["front-frame", "--plan", "--bicycle", "pista"])
    sheet = capsys.readouterr().out
    assert max(map(len, sheet.splitlines())) <= 110
    for word in ("saddle and bottom bracket", "strap 1 kg to the stem", "write these readings negative"):
        assert word in sheet
    blocks = [textwrap.dedent(block) for block in sheet.split("\n\n") if block.startswith("  ")]
    table, content = next(b for b in blocks if b.startswith("force_N")), next(b for b in blocks if "kind" in b)
    readings = iter(("5.30", "-4.90", "0.01", "2.80"))
    rows = [row.replace(",,", f",{next(readings)},") for row in table.strip().splitlines()[1:]]
    (tmp_path / "readings.csv").write_text("\n".join([table.splitlines()[0], *rows]) + "\n")
    without_taps = "\n".join(line for line in content.splitlines() if "tap1" not in line)
    (tmp_path / "standing.toml").write_text(without_taps)
    found = read_measurement(tmp_path / "standing.toml")
    assert len(found.readings.deflections) == 4
    assert found.readings.reads_frame
