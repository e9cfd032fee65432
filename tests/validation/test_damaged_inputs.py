"""Damaged files are read or refused, never a traceback."""

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.validation.damaged_inputs import damaged, examples, outcome

FILES = examples()


@pytest.mark.parametrize("name", FILES)
def test_a_whole_file_is_read(name):
    command, text = FILES[name]
    assert outcome(name, command, text) == "read"


@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("name", FILES)
@settings(max_examples=8, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(rng=st.randoms(use_true_random=False))
def test_a_damaged_file_is_read_or_refused(name, rng):
    command, text = FILES[name]
    assert outcome(name, command, damaged(text, rng)) in ("read", "refused")
