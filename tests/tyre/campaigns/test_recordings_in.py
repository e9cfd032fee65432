"""Which files of a folder are recordings."""

import pytest

from tyre.base.errors import InputError
from tyre.campaigns.campaign import recordings_in


def test_tables_of_the_rig_and_whatever_has_a_sidecar(tmp_path):
    for name in (
        "a.csv",
        "b.parquet",
        "b.toml",
        "c.parquet",
        "notes.xlsx",
        "sub/d.TDX",
        "out/e.csv",
        "f.doc",
        "f.toml",
    ):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    found = recordings_in(tmp_path, exclude=tmp_path / "out")
    assert [str(path.relative_to(tmp_path)) for path in found] == ["a.csv", "b.parquet", "sub/d.TDX"]


def test_a_folder_without_any_says_what_was_expected(tmp_path):
    (tmp_path / "c.parquet").touch()
    with pytest.raises(
        InputError, match=r"holds no recordings; expected .csv files or other formats with .toml sidecars"
    ):
        recordings_in(tmp_path)
