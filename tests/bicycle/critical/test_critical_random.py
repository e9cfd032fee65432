"""Forty random models of the validation ``critical_speeds``: every change of the count of unstable roots is listed."""

from studies.validations.critical_speeds import run


def test_no_crossing_is_missed_and_none_is_invented(tmp_path):
    result = run(out=tmp_path, seed=42, models=40)
    assert result["crossings"] > 40
    assert result["unexplained"] == []
    assert result["off_axis"] == []
