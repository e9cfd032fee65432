"""Bench forces or torques that were written in kgf: a tenth of what they would be in N, throughout."""

from collections.abc import Mapping

import numpy as np

from studies.inference.fit import Fit
from studies.inference.joint import JointForward
from studies.inference.odd_part import WithoutOne
from studies.inference.part import OF
from studies.missing_effect.bench.forward import BenchForward
from studies.missing_effect.diagnose import Diagnosis
from studies.missing_effect.reporting.words import ADJUSTED, BASE, explains
from studies.missing_effect.unfitted import coordinates_of, here
from tyre.base.arrays import Array

STANDARD_GRAVITY = 9.80665  # N in a kgf
NEAR = 0.15  # relative: of how torques change, measured over computed, to that of kgf
KNOWN = 0.1  # relative: 1 sd of it by the readings' noise at most
SHAPED = 0.3  # of what the measured torques change by: what they are off the computed ones times that
FEWEST = 3  # readings more than series


def in_kgf(diagnosis: Diagnosis, without: Mapping[str, WithoutOne]) -> tuple[str, ...]:
    """Bench tests of a ``diagnosis`` whose torques change by 1/9.81 of what is computed, in words.

    Of joint data a model of the others is asked, where one was judged, or that of all data, without what is an error of
    the test itself; of one test alone the base model.

    Parameters
    ----------
    diagnosis : Diagnosis
    without : mapping of str to WithoutOne
        What is judged without a part, by its name.
    """
    forward = diagnosis.forward
    if isinstance(forward, BenchForward):
        measured, sd = forward.measured
        return _told("", forward, measured - sd * diagnosis.nominal, f"the {BASE}")
    if not isinstance(forward, JointForward):
        return ()
    found: list[str] = []
    for part in forward.parts:
        if isinstance(part.forward, BenchForward):
            others = without[part.name].final if part.name in without else None
            model, who = (diagnosis.final, "all parts together") if others is None else (others, "the other parts")
            said = explains(model) if model.candidates else ADJUSTED
            computed = _computed(JointForward((part,)), part.forward, model)
            found += _told(f"{part.name}: ", part.forward, computed, f"the model of {who} ({said})")
    return tuple(found)


def _computed(whole: JointForward, own: BenchForward, model: Fit) -> Array:
    """Torques (n,), N m, that a ``model`` predicts for a part, without errors of that part."""
    candidates, at = coordinates_of(model)
    kept = tuple(c for c in candidates if not c.identifier.startswith(f"{whole.parts[0].name}{OF}"))
    stated = {u.name: np.array([u.centre]) for u in whole.nuisances}
    kept, theta = here(whole, kept, {**stated, **at})
    kept, places = whole.of_part(0, kept)
    measured, sd = own.measured
    residual, _ = own.residual(kept, theta[places], slopes=False)
    return np.asarray(measured - sd * residual)


def _told(begin: str, forward: BenchForward, computed: Array, model: str) -> tuple[str, ...]:
    """Of the changes within each series: a zero of the balance and dry friction are constants there."""
    measured, sd = forward.measured
    series = np.array(forward.rows.series)
    seen, there = measured / sd, computed / sd
    for name in dict.fromkeys(forward.rows.series):
        rows = series == name
        constant = 1 / sd[rows] / np.linalg.norm(1 / sd[rows])
        seen[rows] -= constant * (constant @ seen[rows])
        there[rows] -= constant * (constant @ there[rows])
    size = float(np.linalg.norm(there))
    if len(series) - len(set(series)) < FEWEST or not (np.isfinite(size) and size > 0):
        return ()
    kgf = 1 / STANDARD_GRAVITY
    ratio = float(seen @ there) / size**2
    rest = float(np.linalg.norm(seen - ratio * there))
    near = abs(ratio / kgf - 1) < NEAR and 1 / size < KNOWN * kgf
    if not near or not rest < SHAPED * float(np.linalg.norm(seen)):
        return ()
    held = any(reading.arm > 0 for reading in forward.readings)
    asked = (
        "are the forces in kgf (N is expected), or the lever arms ten times as long as stated?"
        if held
        else "are the torques in kgf m? N m is expected"
    )
    return (f"{begin}the torques at the bar change by 1/{1 / ratio:.3g} of what {model} says; {asked}",)
