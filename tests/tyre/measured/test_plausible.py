"""What is unusual of a tyre is said with the unit it may be in; unusual tyres that exist are not refused."""

import math

import numpy as np
import pytest

from tyre import InputError
from tyre.maps import TyreMap, read_tyre
from tyre.measured import BANDS, doubts, table_doubts

USUAL = {"cornering_stiffness_per_load": 15.0, "lateral_stiffness": 6e4, "relaxation_length": 0.12,
         "pneumatic_trail": 0.018, "largest_force_per_load": 0.9}  # fmt: skip


def test_published_tyres_are_usual():
    """Dell'Orto et al., tables 2 to 9, and the Schwalbe tyre: inside, and inside what the bands state as published."""
    for name in ("Tyre1", "Tyre2", "Tyre3"):
        for surface in ("flat", "drum") if name == "Tyre1" else ("flat",):
            table = TyreMap.load(name, surface=surface).measured
            length = table.cornering_stiffness / table.lateral_stiffness
            for band, values in (
                ("cornering_stiffness_per_load", table.cornering_stiffness / table.load),
                ("lateral_stiffness", table.lateral_stiffness),
                ("relaxation_length", length),
            ):
                low, high = BANDS[band].published
                assert low <= values.min() <= values.max() <= high
            assert not [note for note in table.notes if "usual" in note]
    schwalbe = read_tyre("Schwalbe 50km Energizer Plus 28 x 1.75")
    assert not [note for note in schwalbe.notes if "usual" in note]


# made up of the size of real ones: 4 inch at 0.5 bar, 20 inch at 6 bar under a load, 24 inch at 8 bar
@pytest.mark.parametrize("values", [
    {"cornering_stiffness_per_load": 6.0, "lateral_stiffness": 12e3, "relaxation_length": 0.4, "pneumatic_trail": 0.06},
    {"cornering_stiffness_per_load": 11.0, "lateral_stiffness": 2e5, "relaxation_length": 0.08},
    {"cornering_stiffness_per_load": 25.0, "lateral_stiffness": 9e4, "relaxation_length": 0.03},
])  # fmt: skip
def test_fat_cargo_and_hand_cycle_tyres_are_not_doubted(values):
    assert doubts(values) == ()


@pytest.mark.parametrize(("name", "factor", "words"), [
    ("cornering_stiffness_per_load", math.pi / 180, "1/deg?"),
    ("cornering_stiffness_per_load", 180 / math.pi, "converted from degrees twice?"),
    ("cornering_stiffness_per_load", 9.80665, "load in kg?"),
    ("cornering_stiffness_per_load", 1 / 9.80665, "lateral force in kg?"),
    ("cornering_stiffness_per_load", 4.4482216, "load in lbf?"),
    ("cornering_stiffness_per_load", 1 / 4.4482216, "lateral force in lbf?"),
    ("cornering_stiffness_per_load", 1e3, "load in kN?"),
    ("cornering_stiffness_per_load", 1e-3, "lateral force in kN?"),
    ("lateral_stiffness", 1e-3, "N/mm?"),
    ("lateral_stiffness", 1 / 9.80665, "force in kg?"),
    ("relaxation_length", 1e3, "millimetres?"), ("pneumatic_trail", 1e3, "millimetres?"),
    ("largest_force_per_load", 9.80665, "load in kg?"),
])  # fmt: skip
def test_a_slip_of_units_is_named(name, factor, words):
    (found,) = doubts({**USUAL, name: USUAL[name] * factor})
    assert f"({words}" in found.text
    assert BANDS[name].words in found.text


def test_many_conditions_give_one_note_and_the_impossible_is_refused_with_its_place():
    load = np.array([300.0, 400.0, 500.0])
    (note,) = table_doubts(load, {"cornering_stiffness": 3.0 * load}, where="t")
    assert note.startswith("cornering stiffness over load at 300 N = 3 1/rad is outside the usual 4 .. 40 1/rad")
    assert note.endswith("(and 2 more conditions)")
    with pytest.raises(InputError, match=r"t.csv, line 3: lateral stiffness at 400 N = 60 N/m is far .*\(N/mm\?\); no"):
        table_doubts(
            load,
            {"lateral_stiffness": np.array([6e4, 60.0, 6e4])},
            where="t.csv",
            places=("line 2", "line 3", "line 4"),
        )


def test_a_table_in_other_units_is_told_or_refused(tmp_path):
    TyreMap.load("Tyre3").to_file(tmp_path / "own.csv")
    text = (tmp_path / "own.csv").read_text()
    head, *rows = text.splitlines()
    names = head.split(",")

    def changed(name, factor):
        at = names.index(name)
        cells = [row.split(",") for row in rows]
        scaled = [",".join([*c[:at], repr(float(c[at]) * factor), *c[at + 1 :]]) for c in cells]
        (tmp_path / "own.csv").write_text("\n".join([head, *scaled, ""]))
        return read_tyre(tmp_path / "own.csv").notes

    assert not [note for note in changed("load_N", 1.0) if "usual" in note]
    assert any("(load in kg?)" in note for note in changed("load_N", 1 / 9.80665))
    assert any("(1/deg?)" in note for note in changed("cornering_stiffness_N_per_deg", math.pi / 180))
    with pytest.raises(InputError, match=r"own.csv, line 2: lateral stiffness at 340 N = .* is far outside"):
        changed("lateral_stiffness_N_per_mm", 1e3)
