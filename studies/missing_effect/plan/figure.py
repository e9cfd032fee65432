"""Cost against separation: how probably each price settles what is open."""

from pathlib import Path

from studies.missing_effect.plan.plan import Plan
from studies.reporting.plotting import GREY, drawing, look


def draw(plan: Plan, target: Path) -> bool:
    """Draw the curve of a ``plan`` into ``target`` (without ending); False where there is none."""
    if len(plan.curve) < 2:
        return False
    cost = [point[0] for point in plan.curve]
    share = [100 * point[1] for point in plan.curve]
    with drawing(target, width=7, height=4) as figure:
        axis = figure.subplots()
        axis.step(cost, share, where="post", color=look(0).colour, marker=".", label="best plan for its price")
        if any(not q.limit and q.at_most.met for q in plan.questions):
            axis.axhline(100 * plan.costs.probability, color=GREY, linestyle="--", label="goal")
        last = [p for c, p in plan.curve if c <= plan.cost + 1e-9][-1]
        axis.plot([plan.cost], [100 * last], "o", color=look(1).colour, markersize=9, label="the plan")
        unit = f", {plan.costs.currency}" if plan.costs.currency else ""
        axis.set(
            xlabel=f"price{unit}", ylabel="hardest question settled, %", ylim=(0, 103), xlim=(0, None),
            title="What a price buys",
        )  # fmt: skip
        axis.legend(loc="lower right")
    return True
