"""Rows whose name of a mode the base model contradicts are told; eigenvalues of Meijaard et al. (2007), table 2."""

import pytest

from bicycle import Model, load_bicycle
from studies.missing_effect.motion.modal_table import ModalPoint
from studies.missing_effect.motion.mode_labels import misnamed

WEAVE = {5: -0.77534188219585 + 4.46486771378823j, 6: -1.52644486584142 + 5.87673060598709j,
         7: -2.13875644258362 + 7.19525913329805j}  # fmt: skip
CAPSIZE = {5: -0.32286642900409, 6: -0.00406690076970, 7: 0.10268170574766}


def points(mode, table, shift=0.0):
    return tuple(ModalPoint(float(v), mode, complex(z) + shift, (0.05, 0.05)) for v, z in table.items())


@pytest.mark.parametrize(
    ("mode", "table", "lies"),
    [
        ("capsize", WEAVE, "weave"),
        ("castering", WEAVE, "weave"),
        ("wobble", WEAVE, "weave"),
        ("weave", CAPSIZE, "capsize"),
    ],
)
def test_rows_on_another_mode_are_told(mode, table, lies):
    (note,) = misnamed(points(mode, table, 0.02), Model(load_bicycle("benchmark")))
    assert note.startswith(
        f"every row called {mode} lies on the {lies} of the base model (up to 0.02 1/s away; its {mode}"
    )
    assert ("not there" in note) == (mode == "wobble")
    assert note.endswith("if the name is wrong, correct it")


def test_rows_on_their_own_mode_are_not():
    model = Model(load_bicycle("benchmark"))
    assert misnamed((*points("weave", WEAVE, 0.3), *points("capsize", CAPSIZE, -0.1)), model) == ()
    mixed = {5: WEAVE[5], 6: CAPSIZE[6], 7: WEAVE[7]}  # one of three lies elsewhere: a fit may tell
    assert misnamed(points("capsize", mixed), model) == ()
    assert misnamed(points("capsize", WEAVE)[:1], model) == ()
