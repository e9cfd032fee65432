"""The process of computations: it takes one order after another, and none after a fault."""

from multiprocessing import Pipe
from pathlib import Path

import pytest

pytest.importorskip("dash", reason="the page needs dash (extra explore)")

from studies.explorer.recording import work
from tyre.base.errors import InputError


def test_the_next_order_is_taken_until_a_fault(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    monkeypatch.setattr(work.os, "nice", lambda _: None)
    ends, places = iter([{"seen": 1}, InputError("no such file"), RuntimeError(), {"seen": 2}]), []

    def answer(*_):
        places.append(Path.cwd())
        assert list((tmp_path / "look").iterdir()) == []
        (tmp_path / "look" / "left").touch()
        if isinstance(end := next(ends), Exception):
            raise end
        return end

    monkeypatch.setattr(work, "_answer", answer)
    mine, theirs = Pipe()
    for _ in range(4):
        mine.send((str(tmp_path), "look", []))
    mine.send(None)  # no order: were it taken, this would end in an error
    work.work(theirs)
    for said in (("done", {"seen": 1}), ("free", None), ("failed", "no such file"), ("free", None)):
        assert mine.recv() == said
    assert mine.recv() == ("failed", work.FAILED)
    with pytest.raises((EOFError, ConnectionResetError)):  # the fourth order is not taken
        mine.recv()
    assert places == [tmp_path] * 3
    assert not Path.cwd().is_relative_to(tmp_path)
