"""Rows whose name of a mode the base model contradicts are told; eigenvalues of Meijaard et al. (2007), table 2."""

import pytest

from studies.diagnosis import read_measurement

WEAVE = {5: -0.77534188219585 + 4.46486771378823j, 6: -1.52644486584142 + 5.87673060598709j,
         7: -2.13875644258362 + 7.19525913329805j}  # fmt: skip
CAPSIZE = {5: -0.32286642900409, 6: -0.00406690076970, 7: 0.10268170574766}


def told(folder, mode, table, shift=0.0):
    """Notes on a table of these eigenvalues that are all called by one ``mode``."""
    lines = ["speed_m_s,mode,real_1_s,imag_rad_s,real_sd_1_s,imag_sd_rad_s"]
    lines += [f"{v},{mode},{complex(z).real + shift},{complex(z).imag},0.05,0.05" for v, z in table.items()]
    (folder / "t.csv").write_text("\n".join([*lines, ""]))
    (folder / "m.toml").write_text('kind = "modal"\nbicycle = "benchmark"\n[modal]\ntable = "t.csv"\n')
    return [note for note in read_measurement(folder / "m.toml").notes if "every row called" in note]


@pytest.mark.parametrize(
    ("mode", "table", "lies"), [("capsize", WEAVE, "weave"), ("wobble", WEAVE, "weave"), ("weave", CAPSIZE, "capsize")]
)
def test_rows_on_another_mode_are_told(tmp_path, mode, table, lies):
    (note,) = told(tmp_path, mode, table, 0.02)
    assert note.startswith(f"every row called {mode} lies on the {lies} of the base model (up to 0.02 1/s away; its")
    assert ("not there" in note) == (mode == "wobble")


def test_rows_on_their_own_mode_are_not(tmp_path):
    assert told(tmp_path, "weave", WEAVE, 0.3) == []
    assert told(tmp_path, "capsize", CAPSIZE, -0.1) == []
    assert told(tmp_path, "capsize", {5: WEAVE[5], 6: CAPSIZE[6], 7: WEAVE[7]}) == []  # one lies elsewhere
