"""The wait for what is compiled is told, where it is waited for."""

import pytest

from studies.sweeps.compiling import COMPILING, compilation_told
from tyre.base.progress import progress_told

numba = pytest.importorskip("numba")


def test_functions_that_are_compiled_are_counted():
    inner = numba.njit(lambda x: x + 1)
    outer = numba.njit(lambda x: 2 * inner(x))
    told = []
    with progress_told(told.append):
        with compilation_told(show=True):
            assert outer(1) == 4
        assert (told[-1]["n"], told[-1]["prefix"].startswith(COMPILING)) == (2, True)
        told.clear()
        with compilation_told(show=True):  # at hand
            assert outer(2) == 6
        with compilation_told(show=False):
            assert outer(2.0) == 6.0
    assert told == []
