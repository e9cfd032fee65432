"""Models and bicycles shared by the tests of the dynamics."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Any

import numpy as np
import pytest

from bicycle import Bicycle, LinearModel, available_bicycles, load_bicycle
from bicycle.equations import Matrices, SpeedPolynomial
from bicycle.model import SpeedRange
from bicycle.motion import LimitCycles, find_limit_cycles
from tests.shared.built import linear
from tests.shared.shooting import build
from tyre.ground import InputError


@pytest.fixture(scope="session")
def faq() -> LimitCycles:
    """Follow the periodic motions of the bicycle of docs/amplitude.md."""
    return find_limit_cycles(build())


@pytest.fixture(scope="session")
def rubbing() -> LimitCycles:
    """Follow those with 0.3 N m of dry friction in its steering."""
    return find_limit_cycles(build(), dry_friction=0.3)


@pytest.fixture
def tyred() -> Callable[..., LinearModel]:
    """Build the model of a bicycle (name or object) with effects given as keyword tables."""
    return linear


@pytest.fixture
def synthetic() -> Callable[..., LinearModel]:
    """Build a model whose state matrix is sum v^k A_k, for matrices with known eigenvalues; g = w = 1 by default."""

    def build(*pieces: dict[int, Any], borders: tuple[float, ...] = (), unit: float = 3.0) -> LinearModel:
        n = len(next(iter(pieces[0].values())))
        nothing = [SpeedPolynomial({}, shape=shape) for shape in ((n, 0), (0, n), (0, 0))]
        matrices = [Matrices(np.eye(n), SpeedPolynomial(piece, shape=(n, n)), *nothing, np.ones(2)) for piece in pieces]
        ranges = tuple(map(SpeedRange, (0.0, *borders), (*borders, np.inf), matrices))
        states = tuple(f"state_{k}" for k in range(n))
        return LinearModel(states, (), (), ranges, np.ones(n), {"g": unit, "w": unit}, (1.0, 1.0))

    return build


@pytest.fixture
def random_bicycles() -> Callable[[int, int], Iterator[Bicycle]]:
    """Bicycles around the packaged ones: every parameter off by up to 15 %, kept where they are physical."""

    def draw(count: int, seed: int) -> Iterator[Bicycle]:
        rng = np.random.default_rng(seed)
        bases = [load_bicycle(name) for name in available_bicycles()]
        made = 0
        while made < count:
            base = bases[made % len(bases)]
            changed = {k: v * (1 + rng.uniform(-0.15, 0.15)) for k, v in base.values.items() if k != "g"}
            with suppress(InputError):
                bicycle = base.replace(**changed)
                made += 1
                yield bicycle

    return draw
