"""Many lines of one kind on a screen."""

import pytest

from studies.reporting import print_few


@pytest.mark.parametrize(("count", "shown", "last"), [(6, 6, "left out: part 6"), (130, 6, "left out: 125 more")])
def test_the_first_lines_are_shown_and_the_others_counted(capsys, count, shown, last):
    print_few("left out", [f"part {k}" for k in range(1, count + 1)])
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == shown
    assert lines[0] == "left out: part 1"
    assert lines[-1] == last
