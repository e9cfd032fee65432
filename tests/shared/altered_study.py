"""Studies with other results in them, to see what is said of these."""

from dataclasses import replace

import numpy as np

from studies.main_study import LeastDamped, Samples, Span, UncertainCriticalSpeed, first_screen

LOW, MIDDLE, HIGH = "3.5 bar", "5.5 bar", "7.5 bar"
STAY = np.full(20, 5.0)  # m/s


def least(ratio):
    return None if ratio is None else LeastDamped(complex(-50 * ratio, 50 * np.sqrt(1 - ratio**2)), 10.0)


def edges(low, high):
    found = []
    for speed, direction in ((low, "destabilising"), (high, "stabilising")):
        if speed:
            found.append(UncertainCriticalSpeed(speed, "oscillatory", "wobble", 7.0, direction, sd=0.1, tyre_sd=0.1))
    return tuple(found)


def altered(study, changes, onsets=None, **settings):
    """The study with other bands and least damping in the reference world, and other random bicycles.

    ``changes``: condition -> (onset, end, least damping ratio), None for no edge; ``onsets``: condition -> onset of
    each random bicycle, which all end at 20 m/s.
    """
    reference, name = study.settings.reference, study.names[0]
    results, outer = [], []
    for r in study.results:
        if r.setup == reference and r.case.name == name and r.case.condition in changes:
            low, high, ratio = changes[r.case.condition]
            wobble = Span(low, high or np.inf, 30.0, 3 + 50j, 12.0) if low else None
            r = replace(r, crossings=edges(low, high), least=least(ratio), wobble=wobble)
        results.append(r)
    speeds = np.arange(1.0, 31.0)  # m/s
    for p in study.samples:
        onset = np.full(settings.get("fronts", p.count), np.nan)
        if p.setup == reference and p.case.name == name:
            onset = np.array((onsets or {}).get(p.case.condition, STAY), float)
        end = np.where(np.isnan(onset), np.nan, 20.0)
        growth = np.zeros((len(onset), len(speeds)))
        outer.append(Samples(p.case, p.setup, onset, end, np.ones(len(onset), bool), growth, speeds))
    return replace(study, results=tuple(results), samples=tuple(outer), settings=replace(study.settings, **settings))


def told(study):
    """The first screen without its marks, on one line."""
    return " ".join(first_screen(study).replace("**", "").split())
