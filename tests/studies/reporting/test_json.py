"""No result is written that is no number."""

import json
import math

import pytest

from studies.reporting.output import json_text, write_json
from tyre.base.errors import InputError


@pytest.mark.parametrize(
    ("content", "name"),
    [
        ({"a": math.nan}, "a came out as nan"),
        ({"a": {"b": [1.0, (2.0, math.inf)]}}, "a.b[1][1] came out as inf"),
        ({"a": [{"b": -math.inf}]}, "a[0].b came out as -inf"),
    ],
)
def test_what_is_no_number_is_refused_by_its_name(content, name, tmp_path):
    with pytest.raises(InputError) as found:
        write_json(content, str(tmp_path / "a.json"))
    assert str(found.value).startswith(f"nothing is written: {name}, which is no result")
    assert list(tmp_path.iterdir()) == []


def test_numbers_text_and_nothing_are_written():
    content = {"a": [1.5, 2, None, "nan", True], "b": {}}
    assert json.loads(json_text(content)) == content
