"""Near matches of mistyped names, and notes folded by subject."""

import pickle

import pytest

from tests.shared.refusals import refuses
from tyre.ground import InputError, Note, extrapolated, fold_notes, hint, nearest_name, read_number, refuse_unknown


def test_near_matches():
    assert nearest_name("Lod", ("load", "speed")) == "load"
    assert nearest_name("xyz", ("load",)) == ""
    assert hint("spead", ("load", "speed")) == "; did you mean 'speed'?"
    assert hint("xyz", ("load",)) == ""
    refuse_unknown("key", ["a"], ["a", "b"])
    with pytest.raises(InputError, match=r"^f.toml: unknown key 'c'; known: a, b; units are SI$"):
        refuse_unknown("key", ["a", "c"], ["a", "b"], where="f.toml", more="units are SI")
    refuses(r"^unknown key '\[1\]'", refuse_unknown, "key", [[1]], ["a"])


@pytest.mark.parametrize("text", ["nan", "-inf", "1e309", "", " ", "٣", "1_0", "0x10", "1,5", "9" * 5000, "x"])
def test_what_is_no_finite_number_as_people_write_it(text):
    with pytest.raises(ValueError):  # noqa: PT011 (whoever asks says what is allowed)
        read_number(text)


def test_numbers_as_people_write_them():
    assert [read_number(text) for text in (" 1.5 ", "-2e3", "+.5")] == [1.5, -2000.0, 0.5]
    assert [str(read_number(text)) for text in ("-0", "1e-320", "-1e-101")] == ["0.0"] * 3
    assert read_number("1e-100") == 1e-100


def test_notes_on_one_subject_are_one_line():
    notes = [
        Note("T (rear): a", "T", "rear 400 N, measured"), "plain", Note("T (rear): b", "T", "rear 400 N, measured"),
        Note("U: c", "U", "front"), "plain",
    ]  # fmt: skip
    assert fold_notes(notes) == ["T (rear 400 N, measured): 2 notes, --verbose shows them", "plain", "U: c", "plain"]
    assert fold_notes([]) == []


def test_a_note_is_a_sentence_that_keeps_its_subject():
    note = Note("Tyre1: none is assumed", "Tyre1", "rear", inside=False)
    changed = note.replace("none", "2 %")
    assert changed == "Tyre1: 2 % is assumed"
    assert (changed.subject, changed.headline, changed.inside) == ("Tyre1", "rear", False)
    again = pickle.loads(pickle.dumps(note))
    assert (again, again.subject, again.inside) == (note, "Tyre1", False)
    assert extrapolated(["plain", note])
    assert not extrapolated(["extrapolated", Note("extrapolated", "T", "extrapolated")])  # said, not parsed
