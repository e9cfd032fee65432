"""Files from the field, by the commands that a user types; right values were found without velotyre."""

import pytest

from tests.validation.field_cases import CASES, examined


@pytest.mark.filterwarnings("default")
@pytest.mark.usefixtures("no_pictures")
@pytest.mark.parametrize("name", CASES)
def test_a_file_from_the_field_gives_what_is_right(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    right, given = examined(name)
    if right is None:
        pytest.skip(given)
    assert right, given
