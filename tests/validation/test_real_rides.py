"""Weave of a real bicycle between its kicks, where VELOTYRE_EXTRA_DATA leads to the recordings; skipped elsewhere."""

import os
from pathlib import Path

import pytest

from tests.validation import real_rides

FOLDER = Path(os.environ.get("VELOTYRE_EXTRA_DATA", "nowhere")) / "steer_by_wire_rest"


@pytest.mark.skipif(not FOLDER.is_dir(), reason="needs the recordings of VELOTYRE_EXTRA_DATA")
def test_rest_periods_weave_as_kicks_do(tmp_path):
    result = real_rides.run(out=tmp_path, speeds=("3.05", "5.16"))
    assert result["base"]["compared"] == 2
    assert result["steer_scale"]["within_two_sd"] == 2
    assert result["steer_scale"]["log_evidence"] > result["base"]["log_evidence"] + 20
