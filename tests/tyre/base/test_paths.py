"""Ends of paths by which files are told apart."""

from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from tyre.base.paths import own_ends

PARTS = st.lists(st.sampled_from("abc"), min_size=1, max_size=4).map(lambda parts: Path(*parts))


def test_folders_are_named_where_files_have_one_name():
    files = [Path("x/ride_1/run.csv"), Path("x/ride_2/run.csv"), Path("x/ride_1/other.csv"), Path("run.csv")]
    assert list(own_ends([*files, files[0]]).values()) == ["ride_1/run.csv", "ride_2/run.csv", "other.csv", "run.csv"]


@given(st.lists(PARTS, max_size=6))
def test_no_two_are_alike_and_each_is_the_end_of_its_path(files):
    ends = own_ends(files)
    assert set(ends) == set(files)
    assert len(set(ends.values())) == len(ends)
    assert all(file.as_posix().endswith(end) for file, end in ends.items())
