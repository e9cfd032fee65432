"""Files of ``key : value`` lines: what is read, and what is refused."""

import pytest

from tyre.base.errors import InputError
from tyre.base.key_value import read_key_values


def test_both_separators_comments_and_standard_deviations(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("# of a person\na : 1.5 # cm\nb = 2+/-0.1\nc=3±0.2\n\nfirst try\n", encoding="utf-8")
    values, sd = read_key_values(path, ("a", "b", "c"), kind="measurement", others=True)
    assert (values, sd) == ({"a": 1.5, "b": 2.0, "c": 3.0}, {"b": 0.1, "c": 0.2})


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a : 1\nfirst try\n", "a.txt, line 2: 'first try' is no 'key : value'"),
        ("aa : 1\n", "a.txt, line 1: unknown measurement 'aa'; did you mean 'a'? known: a, b"),
        ("a : 1\na : 2\n", "a.txt, line 2: a is given twice; keep one"),
        (
            "a : x\n",
            "a.txt, line 1: a = 'x' is not a finite number; write for example "
            "0.375, 0.375+/-0.026, 0.375(26) or 0.375 +/- 7 %",
        ),
        (
            "a : 1+/-inf\n",
            "a.txt, line 1: a = '1+/-inf' is not a finite number; write for example "
            "0.375, 0.375+/-0.026, 0.375(26) or 0.375 +/- 7 %",
        ),
        ("a : 2 mm\n", "a.txt, line 1: a = '2 mm': give the number without a unit"),
    ],
)
def test_what_is_refused(tmp_path, text, words):
    (tmp_path / "a.txt").write_text(text)
    with pytest.raises(InputError) as refusal:
        read_key_values(tmp_path / "a.txt", ("a", "b"), kind="measurement")
    assert str(refusal.value).endswith(words)
