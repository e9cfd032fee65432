"""Free decays of one test, each told what the others say of what drives them. SYNTHETIC."""

import itertools
import math
import re
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bicycle.identification.decay_window import EVEN, SHARES
from bicycle.identification.driven_together import ALIKE, SPREAD, chances_by_others, together
from bicycle.identification.free_decay import identify_modes
from studies.cli import main
from studies.free_decays.words import together_words
from studies.validations._decay_generator import Cell, make
from tyre.base.errors import InputError

FAINT = Cell(driven=0.03, noise=0.05)
STILL = Cell(noise=0.05)


def by_enumeration(alone):
    """The same from Bayes' rule over all states of the ground and of the runs, in which its own samples are left out.

    State 0 is that nothing drives, with half of the prior; the others are the shares.
    """
    count = len(SHARES) + 1
    prior = np.array([0.5, *[0.5 / len(SHARES)] * len(SHARES)])

    def given(state, ground):
        near = [math.exp(-((k - ground) ** 2) / (2 * SPREAD**2)) for k in range(1, count)]
        alike = float(state == 0) if ground == 0 else (state > 0) * near[state - 1] / sum(near)
        return ALIKE * alike + (1 - ALIKE) * prior[state]

    likelihoods = [np.array([1 - sum(p), *p]) / prior for p in alone]
    sums = np.zeros((len(alone), count))
    for ground, *states in itertools.product(range(count), repeat=len(alone) + 1):
        whole = prior[ground] * np.prod([given(state, ground) for state in states])
        for k, state in enumerate(states):
            sums[k, state] += whole * np.prod([x[states[j]] for j, x in enumerate(likelihoods) if j != k])
    return sums[:, 1:] / sums.sum(1, keepdims=True)


@settings(deadline=None, max_examples=10)
@given(st.lists(st.lists(st.floats(0.001, 1.0), min_size=9, max_size=9), min_size=1, max_size=2))
def test_what_the_others_say_is_bayes_rule(weights):
    alone = np.array([np.array(w[1:]) / sum(w) for w in weights])
    assert chances_by_others(alone) == pytest.approx(by_enumeration(alone), rel=1e-6)


def test_a_run_alone_has_even_odds_and_one_that_tells_nothing_changes_nothing():
    sure = np.eye(len(SHARES))[2]
    assert chances_by_others([0.9 * sure]).sum() == pytest.approx(0.5)
    assert chances_by_others([0.9 * sure]) == pytest.approx(EVEN[None], rel=0.15)  # none lies beyond the ends
    two = np.array([0.9 * sure, 0.2 * sure])
    assert chances_by_others([*two, EVEN])[:2] == pytest.approx(chances_by_others(two))
    told = chances_by_others([sure, sure, sure, EVEN])[3]
    assert told.sum() == pytest.approx(ALIKE + (1 - ALIKE) / 2, abs=1e-3)
    assert np.argmax(told) == 2
    assert told[[1, 3]] == pytest.approx(told[2] * math.exp(-0.5 / (2 * SPREAD**2)), rel=0.4)
    assert chances_by_others([0 * sure, 0 * sure, EVEN])[2].sum() == pytest.approx((1 - ALIKE) / 2, abs=1e-3)


@pytest.mark.parametrize("wrong", [[-0.1], [1.1], [float("nan")], [0.1] * 7])
def test_only_probabilities_are_taken(wrong):
    row = wrong if len(wrong) > 1 else [*wrong, *[0.0] * (len(SHARES) - 1)]
    with pytest.raises(InputError, match="each run one for each of 8 shares is needed, 0 to 1 in sum"):
        chances_by_others([row, row])


@pytest.mark.parametrize(("cell", "driven"), [(FAINT, True), (STILL, False)])
def test_runs_of_one_test_settle_together_what_one_leaves_open(cell, driven):
    runs = [make(cell, np.random.default_rng([11, k])).run for k in range(5)]

    def fit(place, chance):
        return identify_modes(runs[place], 1, driven=chance, thorough=False)

    alone = [fit(k, None) for k in range(5)]
    before = [modes[0].estimate.driven for modes in alone]
    found, again = together(alone, fit)
    after = [modes[0].estimate.driven for modes in found]
    assert again > 0
    assert max(abs(p - driven) for p in before) > 0.03
    assert max(abs(p - driven) for p in after) < max(abs(p - driven) for p in before) / 2
    assert again == sum(new is not old for new, old in zip(found, alone, strict=True))
    open_ = int(np.argmax([abs(p - driven) for p in before]))
    now, then = (max(modes[open_][0].sd) for modes in (found, alone))
    assert (now > then) == driven


def test_one_run_or_runs_that_are_refused_stay_as_they_are():
    found = identify_modes(make(STILL, np.random.default_rng(2)).run, 1, driven=False, thorough=False)
    assert together([found, found], lambda *_: pytest.fail("fitted again")) == ([found, found], 0)
    alone = identify_modes(make(STILL, np.random.default_rng(2)).run, 1, thorough=False)
    assert together([alone, found], lambda *_: pytest.fail("fitted again")) == ([alone, found], 0)


@pytest.mark.parametrize(
    ("chances", "said"),
    [
        ([0.1, 0.002, None], "it does in none of 2 runs (probability 0.1 or less); say"),
        ([0.1, 0.9], "it does in 1 of 2 runs (probability 0.9 or more; 0.1 or less of the others); say"),
        ([0.96, 0.9], "it does in all of 2 runs (probability 0.9 or more); say"),
    ],
)
def test_how_many_runs_are_driven_is_said(chances, said):
    runs = [[SimpleNamespace(estimate=SimpleNamespace(driven=chance))] for chance in chances]
    assert said in together_words([*runs, [SimpleNamespace(estimate=None)]])


def test_the_terminal_says_that_runs_are_weighed_together(tmp_path, capsys):
    names = []
    for k in range(4):
        run = make(FAINT, np.random.default_rng([11, k])).run
        rows = [",".join(f"{x:.6g}" for x in row) for row in zip(run.time, *run.channels.values(), strict=True)]
        (tmp_path / f"{k}.csv").write_text("\n".join([",".join(["time_s", *run.channels]), *rows]) + "\n")
        names.append(f"{tmp_path / f'{k}.csv'}@{4 + 0.5 * k}")
    main(["modal", *names])
    (said,) = [line for line in capsys.readouterr().err.splitlines() if "by all runs together" in line]
    (least,) = re.findall(r"it does in all of 4 runs \(probability (.*?) or more\); say", said)
    assert 0.5 < float(least) <= 1
    for few in (names[:1], [*names, "--driven", "yes"]):
        main(["modal", *few])
        assert "together" not in capsys.readouterr().err
