"""Sensitivities of random models against differences of eigenvalues computed with 50 digits.

The symbolic matrices of a model are evaluated in mpmath at p +- h, an eigenvalue is followed by inverse iteration in
the form of Newton's method on F x = z E x with a normalisation, and the central difference is the reference. All
bicycles and effects are random (synthetic).
"""

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bicycle.equations import Evaluator
from bicycle.model import Model
from bicycle.stability import sensitivities
from tests.validation.random_models import random_model
from tyre.ground import write_csv

TARGET = 1e-8
PAIRS = 5
DIGITS = 50
STEP = "1e-15"  # relative; the difference is then exact to some 30 digits
ORDERS = range(8, 15)
FAINT = 1e-6  # pairs whose share dz/dp p is below this part of |z| are not drawn: they test cancellation only


class Comparison(NamedTuple):
    """One eigenvalue-parameter pair: derivative by eigenvectors and by differences (1/s per SI unit)."""

    effects: str
    speed_m_s: float
    eigenvalue: complex
    parameter: str
    found: complex
    reference: complex

    @property
    def error(self) -> float:
        """Relative difference."""
        return abs(self.found - self.reference) / abs(self.reference)


def run(*, out: Path, seed: int, models: int = 50) -> dict[str, Any]:
    """Compare random models."""
    import pandas as pd

    from tyre.ground import progress_bar

    generator = np.random.default_rng(seed)
    found = [
        {"model": number, **pair._asdict(), "relative_error": pair.error}
        for number in progress_bar(range(models), desc="models")
        for pair in compare(draw_model(generator), generator)
    ]
    write_csv(out / "sensitivity_mpmath.csv", pd.DataFrame(found))
    return {
        "pairs": len(found),
        "largest_relative_error": max(row["relative_error"] for row in found),
        "target": TARGET,
    }


def draw_model(generator: np.random.Generator) -> Model:
    """Draw with ``generator`` a model of 8 to 14 states: relaxing tyres on a bicycle with rider, random effects."""
    while True:
        model = random_model(generator, contact_laws=("relaxation_length",), share=0.4, bicycles=("benchmark",))
        if model.linear_model().order in ORDERS:
            return model


def compare(model: Model, generator: np.random.Generator, pairs: int = PAIRS) -> Iterator[Comparison]:
    """Compare a number ``pairs`` of random eigenvalue-parameter pairs of a model at one random speed."""
    speed = float(generator.uniform(2.0, 20.0))
    found = sensitivities(model, [speed])
    values = found.eigenvalues[0]
    shares = np.abs(found.derivatives[0] * [model.parameters[key] for key in found.parameters])
    allowed = np.argwhere((shares > FAINT * np.abs(values)[:, None]) & (values.imag >= 0)[:, None])
    for eigenvalue, parameter in generator.permutation(allowed)[:pairs]:
        key = found.parameters[parameter]
        yield Comparison(
            " ".join(effect.identifier for effect in model.effects), speed, complex(values[eigenvalue]), key,
            complex(found.derivatives[0, eigenvalue, parameter]),
            reference(model, speed, complex(values[eigenvalue]), key),
        )  # fmt: skip


def reference(model: Model, speed: float, eigenvalue: complex, key: str) -> complex:
    """Central difference of one eigenvalue, with 50 digits; what is tied to a bicycle parameter moves with it."""
    import mpmath

    with mpmath.workdps(DIGITS):
        value = mpmath.mpf(model.parameters[key])
        step = abs(value) * mpmath.mpf(STEP)
        ends = []
        for sign in (1, -1):
            values = {name: mpmath.mpf(number) for name, number in model.parameters.items()}
            values |= dict.fromkeys([key, *_followers(model, key)], value + sign * step)
            ends.append(_eigenvalue(*_matrices(model.evaluator, values, speed), eigenvalue))
        return complex((ends[0] - ends[1]) / (2 * step))


def _followers(model: Model, key: str) -> list[str]:
    """Effect parameters that were not given and equal the bicycle parameter ``key``."""
    return [
        f"{e.identifier}.{p.name}"
        for e in model.effects
        for p in e.parameters
        if p.default == key and not hasattr(e, p.name)
    ]


def _matrices(evaluate: Evaluator, values: dict[str, Any], speed: float) -> tuple[Any, Any]:
    import mpmath

    symbolic, v = evaluate.symbolic, mpmath.mpf(speed)
    known = [values[name] for name in symbolic.parameters]
    switches, mass, dynamics = _functions(evaluate)
    known += [mpmath.mpf(int(v <= at)) for at in switches(*known)]
    total = mpmath.zeros(symbolic.mass.rows)
    for power, matrix in zip(symbolic.dynamics.coefficients, dynamics, strict=True):
        total += v**power * matrix(*known)
    return mass(*known), total


@cache
def _functions(evaluate: Evaluator) -> tuple[Any, Any, list[Any]]:
    import sympy as sp

    symbolic = evaluate.symbolic
    names = [sp.Symbol(name, real=True) for name in symbolic.parameters]
    everything = [*names, *symbolic.switches]

    def function(arguments: list[Any], expression: Any) -> Any:
        return sp.lambdify(arguments, expression, modules="mpmath", cse=True)

    return (
        function(names, list(symbolic.switches.values())),
        function(everything, symbolic.mass),
        [function(everything, matrix) for matrix in symbolic.dynamics.coefficients.values()],
    )


def _eigenvalue(mass: Any, dynamics: Any, start: complex) -> Any:
    """Follow F x = z E x, c . x = 1 from a double-precision start by Newton's method."""
    import mpmath

    n, z = mass.rows, mpmath.mpc(start)
    x = mpmath.matrix([1] * n)
    for _ in range(2):  # inverse iteration for a first vector
        x = mpmath.lu_solve(dynamics - z * (1 + mpmath.mpf("1e-10")) * mass, mass * x)
        x /= mpmath.norm(x)
    normal = x.H
    for _ in range(8):
        bordered = mpmath.matrix(n + 1)
        bordered[:n, :n], bordered[:n, n] = dynamics - z * mass, -(mass * x)
        bordered[n, :n] = normal
        residual = mpmath.matrix([*(dynamics * x - z * mass * x), (normal * x)[0] - 1])
        change = mpmath.lu_solve(bordered, -residual)
        x += change[:n]
        z += change[n]
        if abs(change[n]) < abs(z) * mpmath.mpf(10) ** (5 - DIGITS):
            return z
    raise ValueError(f"no eigenvalue found near {start}")
