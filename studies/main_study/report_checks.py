"""What the report says of linear propagation beside Monte Carlo."""

from bicycle.critical.critical_speed import CrossingIdentity
from bicycle.sensitivity.eigenvalue_derivatives import critical_speed_sensitivities
from studies.main_study.checks import FAR, differs, excess
from studies.main_study.report_numbers import shown_like, signed, signed_range, table
from studies.main_study.solve import COMPARED_MODES
from studies.main_study.spread import uncertainty, varied_apart
from studies.main_study.study import Study
from studies.uncertainty import contributions
from studies.uncertainty.contributions import assumed_words
from studies.uncertainty.propagation import Uncertainty

SMALL = 0.005  # a group with less everywhere has no column
DIGITS = 4  # a value is shown finer than its standard deviation by this, as its interval is no longer symmetric


def check_words(study: Study) -> str:
    """How random bicycles were drawn, and where their standard deviations differ from the linear ones."""
    settings = study.settings
    every = [(one.result, q) for one in study.checks for q in one.quantities]
    failed = [one for one in study.checks if one.failure]
    text = (
        "Every ± is linear: derivatives times the covariance of tyre and bicycle. Here they are compared with "
        f"{settings.samples} random bicycles (seed {settings.seed}; where they are enough, mean and covariance of the "
        "draws are matched, so that chance is small), at the pressure at which a wobble speed is most uncertain: of "
        f"the tyre in question and of the others with {settings.reference.label}, and of each other world. A draw is "
        "lost where the quantity does not exist; a critical speed that only some draws have is not counted."
    )
    for one in failed:
        case = one.result.case
        text += (
            f" {case.name}, {case.condition}, {one.result.setup.label}: this check could not be made ({one.failure})."
        )
    if not every:
        return text
    far = [(result, q) for result, q in every if differs(q)]
    near = [excess(q) for _, q in every if not differs(q)]
    if near:
        text += (
            f" In {len(near)} of {len(every)} rows the two standard deviations agree within {100 * FAR:g} % (that of "
            f"the draws is larger by {signed_range([100 * e for e in near], '.1f')} %)."
        )
    if far:
        said = "; ".join(
            f"{result.case.name}, {result.case.condition}, {result.setup.label}: {q.name} by "
            f"{signed(100 * excess(q), '.1f')} %" + (f", lost in {q.lost} draws" if q.lost else "")
            for result, q in far
        )
        text += f" They differ for {said}: there the result bends within its uncertainty, and the draws tell more."
    return text


def check_table(study: Study) -> str:
    """Linear standard deviations beside those of random bicycles."""
    rows = []
    for one in study.checks:
        case = one.result.case
        for q in one.quantities:
            low, high = (shown_like(edge, q.linear_sd / DIGITS) for edge in q.band())
            rows.append([
                case.name, case.condition, one.result.setup.label, q.name, q.unit,
                shown_like(q.value, q.linear_sd / DIGITS), f"{q.linear_sd:#.3g}", f"{q.sampled_sd:#.3g}",
                f"{signed(100 * excess(q), '.1f')} %",
                signed((q.sampled_mean - q.value) / q.linear_sd, ".2f"), f"{low} to {high}", f"{q.lost}",
            ])  # fmt: skip
    head = ["tyre", "pressure", "world", "what", "unit", "value", "sd linear", "sd Monte Carlo", "larger by",
            "mean minus value, sd", "95 % of the draws", "lost"]  # fmt: skip
    return (
        table(rows, head) if rows else "Nothing to compare: wobble does not oscillate, or the check could not be made."
    )


def exact_words(study: Study) -> str:
    """What the standard deviations hold: stated, assumed, and what counts as exact."""
    uncertain = _focus_uncertainty(study)
    words = [assumed_words(uncertain), contributions.exact_words(uncertain)]
    return " ".join(f"{one[0].upper()}{one[1:]}." for one in words if one) + (
        " All numbers of the bicycle are taken as independent of each other. What is assumed beside the tyre (front, "
        "arms, camber thrust, friction) counts as exact here, because the plausible fronts vary it."
    )


def share_table(study: Study) -> str:
    """How much each group of uncertain numbers contributes to the critical speeds of the case in focus."""
    found = group_shares(study)
    groups = [group for group in dict.fromkeys(g for one in found.values() for g in one)
              if max(one.get(group, 0.0) for one in found.values()) >= SMALL]  # fmt: skip
    rows = [[str(which), *(f"{100 * one.get(group, 0.0):.0f} %" for group in groups)] for which, one in found.items()]
    return table(rows, ["share of the variance of", *groups]) if rows else ""


def group_shares(study: Study) -> dict[CrossingIdentity, dict[str, float]]:
    """Critical speed -> group of uncertain numbers -> its share of the linear variance, for the case in focus."""
    uncertain = _focus_uncertainty(study)
    crossings = uncertain.crossings(study.settings.fastest)
    slopes = critical_speed_sensitivities(uncertain.nominal, list(crossings.values())) if crossings else {}
    return {
        which: contributions.by_group(
            uncertain.shares(uncertain.gradient({key: one[k] for key, one in slopes.items()}))
        )
        for k, which in enumerate(crossings)
    }


def uncertainty_lines(study: Study) -> list[str]:
    """What causes the uncertainty of the first critical speed of wobble, or of weave, and what counts as exact."""
    found = group_shares(study)
    first = next((which for mode in COMPARED_MODES for which in found if which.mode.split("+")[0] == mode), None)
    lines = []
    if first:
        ranked = sorted(found[first].items(), key=lambda one: -one[1])
        shares = ", ".join(f"{group} {100 * share:.0f} %" for group, share in ranked if share >= SMALL)
        lines.append(f"uncertainty of '{first}' ({study.focus.name}, {study.focus.condition}): {shares}")
    exact = contributions.counted_as_exact(_focus_uncertainty(study))
    alone = [key for key in exact if not varied_apart(key)]
    said = f"counted as exact: {', '.join(alone) or 'nothing'}"
    return [*lines, f"{said}, beside front, arms, camber thrust and friction, which the plausible fronts vary"]


def _focus_uncertainty(study: Study) -> Uncertainty:
    return uncertainty(study.settings, study.focus, study.settings.reference)
