"""Which of many candidate parameters is missing from a model: knows numpy and scipy, and nothing of bicycles.

A forward model says what floats (``nuisances``), what may be missing (``candidates``), where its data stand (``rows``)
and how far they are from what it computes (``residual``); :func:`judge` says what is missing, or that nothing is.
"""

from studies.inference.fit import Fit, fit
from studies.inference.folds import folds
from studies.inference.forward import Forward, ForwardModel, ProposedMeasurement, Rows, Series
from studies.inference.judge import Judgement, judge
from studies.inference.parameter import Candidate, UncertainParameter, central_differences, stencil
from studies.inference.verdict import Verdict

__all__ = [
    "Candidate", "Fit", "Forward", "ForwardModel", "Judgement", "ProposedMeasurement", "Rows", "Series",
    "UncertainParameter", "Verdict", "central_differences", "fit", "folds", "judge", "stencil",
]  # fmt: skip
