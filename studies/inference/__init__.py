"""Which of many candidate parameters is missing from a model: knows numpy and scipy, and nothing of bicycles.

A forward model states what floats (``nuisances``), what may be missing (``candidates``), where its data are (``rows``)
and how far they are from what it computes (``residual``); :func:`judge` decides what is missing, or that nothing is.
"""

from studies.inference.acceptance import ACCEPTANCE_RULES, AcceptanceCheck
from studies.inference.evidence import (
    MOST_FOLDS,
    HeldOut,
    folds,
    held_out,
    left_over,
    log_normal,
    whiteness,
    within_uncertainty,
)
from studies.inference.fit import ROUGH, Fit, Moved, compare_nuisances, default_starts, fit, minimise, prior
from studies.inference.joint import OF, Joint, Part
from studies.inference.judge import (
    Acceptance,
    Judgement,
    accept,
    averaged_variance,
    describe_effect,
    equivalents,
    fit_effect_alone,
    judge,
    rank_measurements,
    rule_against,
    similarity,
    verdict_of,
)
from studies.inference.kind import Kind, Proposal, Rows, Series
from studies.inference.limits import UpperLimit, size_limit, tail_limit, upper_limits
from studies.inference.linear import Linear
from studies.inference.parameter import (
    Array,
    Candidate,
    UncertainParameter,
    central_differences,
    hypothesis_name,
    stencil,
)
from studies.inference.parts import (
    Compared,
    PartAgainstRest,
    WithoutOne,
    disagreement,
    fits,
    parts_against_rest,
    without_each,
)
from studies.inference.preflight import Misread, preflight
from studies.inference.quick import judge_quickly
from studies.inference.rules import RULES, Rules
from studies.inference.search import Hypotheses, drop_unsupported, exchange_effect, expand, fit_singles, reason_against
from studies.inference.stability import Outcome, Stability, Variant, leading, outcome, stability, variants
from studies.inference.starts import null_from
from studies.inference.verdict import (
    Judged,
    Mimic,
    Named,
    Reason,
    Separation,
    Verdict,
)

__all__ = [
    "ACCEPTANCE_RULES",
    "MOST_FOLDS",
    "OF",
    "ROUGH",
    "RULES",
    "Acceptance",
    "AcceptanceCheck",
    "Array",
    "Candidate",
    "Compared",
    "Fit",
    "HeldOut",
    "Hypotheses",
    "Joint",
    "Judged",
    "Judgement",
    "Kind",
    "Linear",
    "Mimic",
    "Misread",
    "Moved",
    "Named",
    "Outcome",
    "Part",
    "PartAgainstRest",
    "Proposal",
    "Reason",
    "Rows",
    "Rules",
    "Separation",
    "Series",
    "Stability",
    "UncertainParameter",
    "UpperLimit",
    "Variant",
    "Verdict",
    "WithoutOne",
    "accept",
    "averaged_variance",
    "central_differences",
    "compare_nuisances",
    "default_starts",
    "describe_effect",
    "disagreement",
    "drop_unsupported",
    "equivalents",
    "exchange_effect",
    "expand",
    "fit",
    "fit_effect_alone",
    "fit_singles",
    "fits",
    "folds",
    "held_out",
    "hypothesis_name",
    "judge",
    "judge_quickly",
    "leading",
    "left_over",
    "log_normal",
    "minimise",
    "null_from",
    "outcome",
    "parts_against_rest",
    "preflight",
    "prior",
    "rank_measurements",
    "reason_against",
    "rule_against",
    "similarity",
    "size_limit",
    "stability",
    "stencil",
    "tail_limit",
    "upper_limits",
    "variants",
    "verdict_of",
    "whiteness",
    "within_uncertainty",
    "without_each",
]  # fmt: skip
