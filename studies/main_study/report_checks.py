"""What the report says of linear propagation beside Monte Carlo."""

from studies.main_study.checks import FAR, differs, excess
from studies.main_study.report_numbers import shown_like, signed, signed_range, table
from studies.main_study.study import Study

DIGITS = 4  # a value is shown finer than its standard deviation by this, as its interval is no longer symmetric


def check_words(study: Study) -> str:
    """How random bicycles were drawn, and where their standard deviations differ from the linear ones."""
    settings = study.settings
    every = [(one.result, q) for one in study.checks for q in one.quantities]
    first, last = settings.setups[0], settings.setups[-1]
    text = (
        f"Here they are compared with {settings.samples} random bicycles (seed {settings.seed}; mean and covariance of "
        f"the draws are matched, so that chance is about 1 %), at the pressure at which a wobble speed is most "
        f"uncertain: each tyre in the setup '{last.label}', and the most uncertain case of '{first.label}'. A draw is "
        "lost where the quantity does not exist; a critical speed that only some draws have is not counted."
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
            f"{result.case.name}, {result.case.pressure_bar:g} bar, {result.setup.front_name} front: {q.name} by "
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
                case.name, f"{case.pressure_bar:g}", one.result.setup.front_name, q.name, q.unit,
                shown_like(q.value, q.linear_sd / DIGITS), f"{q.linear_sd:#.3g}", f"{q.sampled_sd:#.3g}",
                f"{signed(100 * excess(q), '.1f')} %",
                signed((q.sampled_mean - q.value) / q.linear_sd, ".2f"), f"{low} to {high}", f"{q.lost}",
            ])  # fmt: skip
    head = ["tyre", "bar", "front", "what", "unit", "value", "sd linear", "sd Monte Carlo", "larger by",
            "mean minus value, sd", "95 % of the draws", "lost"]  # fmt: skip
    return table(rows, head) if rows else "Nothing to compare: wobble does not oscillate."
