"""What is said of a hypothesis that is more probable than the one that is named, with one effect more."""

from types import SimpleNamespace

import pytest

from studies.inference.account import _rule


@pytest.mark.parametrize(
    ("odds", "words"),
    [(7.0, "not clearly more probable (7 : 1)"), (3e35, "3e+35 times as probable, but the data left out gain nothing")],
)
def test_clear_odds_are_not_called_unclear(odds, words):
    larger = SimpleNamespace(
        converged=True, candidates=("a", "b"), identifiers=frozenset("ab"), at_bound=list, negligible=list,
        implausible=list,
    )  # fmt: skip
    final = SimpleNamespace(candidates=("a",), identifiers=frozenset("a"))
    acceptance = SimpleNamespace(leader=None, final=final, checks=())
    known = SimpleNamespace(odds=lambda one, other: odds)
    assert words in _rule(None, known, acceptance, larger)
