"""Rows whose name of a mode the base model contradicts are told; eigenvalues of Meijaard et al. (2007), table 2."""

import re
from types import SimpleNamespace

import numpy as np
import pytest

from studies.diagnosis import read_measurement
from studies.inference import fit

WEAVE = {5: -0.77534188219585 + 4.46486771378823j, 6: -1.52644486584142 + 5.87673060598709j,
         7: -2.13875644258362 + 7.19525913329805j}  # fmt: skip
CAPSIZE = {5: -0.32286642900409, 6: -0.00406690076970, 7: 0.10268170574766}


def told(folder, mode, table, shift=0.0):
    """Notes on a table of these eigenvalues that are all called by one ``mode``."""
    lines = ["speed_m_s,mode,real_1_s,imag_rad_s,real_sd_1_s,imag_sd_rad_s"]
    lines += [f"{v},{mode},{complex(z).real + shift},{complex(z).imag},0.05,0.05" for v, z in table.items()]
    (folder / "t.csv").write_text("\n".join([*lines, ""]))
    (folder / "m.toml").write_text('kind = "modal"\nbicycle = "benchmark"\n[modal]\ntable = "t.csv"\n')
    return [note for note in read_measurement(folder / "m.toml").prepare().notes if "every row called" in note]


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


def paired(folder, mode, table):
    """What is told of the pairing of a table of these eigenvalues with the base model and its adjusted parameters."""
    told(folder, mode, table)
    kind = read_measurement(folder / "m.toml").prepare()
    nominal, _ = kind.residual((), np.array([u.centre for u in kind.nuisances]))
    return kind.find_mispairings(SimpleNamespace(nominal=nominal, final=fit(kind)))


def test_a_row_that_is_compared_with_a_root_of_another_name_is_told_with_chi2_by_name(tmp_path):
    """Capsize of Meijaard et al. under the name of weave: by hand, chi^2 of the roots of the table, sd 0.05."""
    table = {5: WEAVE[5], 6: WEAVE[6], 7: CAPSIZE[7]}
    (text,) = paired(tmp_path, "weave", table)
    off = CAPSIZE[7] - WEAVE[7]
    by_name = (off.real**2 + off.imag**2) / 0.05**2
    assert text.startswith("1 of 3 rows called weave (at 7 m/s) are compared with another root of the base model")
    said = re.search(r"\(capsize\); with the roots called weave its chi\^2 is ([\d.e+]+), not ([\d.e+-]+);", text)
    assert float(said[1]) == pytest.approx(by_name, rel=1e-3)
    assert float(said[2]) < 1e-6
    assert text.endswith("of the final model 1 are")


def test_a_mode_that_the_base_model_lacks_has_no_chi2_by_name(tmp_path):
    (text,) = paired(tmp_path, "wobble", WEAVE)
    assert "3 of 3 rows called wobble (at 5 to 7 m/s) are compared" in text
    assert "(weave); it has no wobble there; of the final model 3 are" in text


def test_rows_that_are_compared_with_roots_of_their_name_are_not_told(tmp_path):
    assert paired(tmp_path, "weave", WEAVE) == ()
    assert paired(tmp_path, "capsize", CAPSIZE) == ()


def test_how_roots_are_paired_is_said_in_the_report(tmp_path):
    told(tmp_path, "weave", WEAVE)
    (text,) = (note for note in read_measurement(tmp_path / "m.toml").prepare().notes if "nearest root" in note)
    assert "the distance of a real root from an oscillatory one is tripled" in text
