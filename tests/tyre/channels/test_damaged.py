"""Damaged recordings in every format: one clear error or the right numbers, never a traceback or a silent wrong one."""

import pytest

from studies.validations._recording_writers import WRITERS
from studies.validations.damaged_recordings import KINDS, one_case

SEED = 7


@pytest.mark.parametrize("form", WRITERS)
def test_twenty_damaged_files_of_every_format(form, tmp_path):
    verdicts = {}
    for case in range(20):
        kind, verdict, words = one_case(tmp_path, form, SEED, case)
        assert verdict in ("refused", "right", "altered"), (case, kind, words)
        assert verdict != "altered" or kind == "bytes flipped"
        assert "\n" not in words
        verdicts.setdefault(kind, set()).add(verdict)
    assert set(verdicts) == set(KINDS)
    assert verdicts["text in a channel"] == verdicts["empty channel"] == {"refused"}
    assert not list(tmp_path.iterdir())
