"""Runs in short pieces, which are easier to fit: an error of the model has no time to grow."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from bicycle.identification.run import Run

PIECE = 0.6  # s


def pieces(run: Run) -> list[Run]:
    """A ``run`` in pieces of about :data:`PIECE` seconds."""
    count = max(1, round(len(run.time) * run.step / PIECE))
    edges = np.linspace(0, len(run.time), count + 1).round().astype(int)
    return [
        replace(
            run, name=f"{run.name} {a}", time=run.time[a:b],
            channels={c: x[a:b] for c, x in run.channels.items()}, inputs={c: x[a:b] for c, x in run.inputs.items()},
        )
        for a, b in pairwise(edges)
    ]  # fmt: skip
