"""The report of the main study: numbers and objects for the templates, which make the words."""

import math
import operator
from collections.abc import Sequence
from decimal import Decimal
from functools import partial
from pathlib import Path
from textwrap import fill
from typing import Any, NamedTuple

import numpy as np

from bicycle.model.default_sd import CORNERING_STIFFNESS
from bicycle.stability.critical import CriticalSpeed
from studies.main_study import figures
from studies.main_study.cases import TyreCase
from studies.main_study.compare import CRITICAL, DAMPING, Change, assumed_of_tyre
from studies.main_study.published import compare_findings
from studies.main_study.result import Result
from studies.main_study.screen import answer
from studies.main_study.settings import LIMITS, Settings, plain_name
from studies.main_study.study import Study, run_study, spread
from studies.main_study.tidy_tables import write_tables
from studies.reporting.command_context import made_by
from studies.reporting.markdown_text import render_file, write_page
from studies.uncertainty.propagation import Quantity, differs
from tyre import TyreProperties

PACKAGE = "studies.main_study"


def run_and_write(settings: Settings, folder: Path, *, workers: int = 1) -> tuple[Study, str, Path]:
    """Compute the study and write it into ``folder``; return it with its first screen and the HTML report."""
    folder.mkdir(parents=True, exist_ok=True)
    with spread(workers) as distribute:
        study = run_study(settings, distribute=distribute)
        write_tables(study, folder)
        distribute(operator.call, [(draw, study) for draw in figures.drawings(study, folder)], "figures")
    first, page = write_report(study, folder)
    return study, first, page


def write_report(study: Study, folder: Path) -> tuple[str, Path]:
    """Write report.html into ``folder``, beside the figures it shows; return the first screen and the file."""
    content = facts(study)
    text = render_file(PACKAGE, "report.md.j2", content, filters=FILTERS).rstrip() + made_by()
    file = write_page(folder, title=f"velotyre: {study.settings.bicycle.name}", text=text)
    return first_screen(study, content), file


def first_screen(study: Study, content: dict[str, Any] | None = None) -> str:
    """Write question and answer as Markdown in which nothing is escaped, for a terminal."""
    return render_file(PACKAGE, "answer.md.j2", content or facts(study), escaped=False, filters=FILTERS)


def on_a_terminal(text: str, width: int = 110) -> str:
    """Show the Markdown of a first screen without its marks, with its table in columns."""
    from tabulate import tabulate

    blocks = []
    for block in text.replace("**", "").strip().split("\n\n"):
        if block.startswith("|"):
            heads, _, *rows = map(_split_cells, block.splitlines())
            blocks.append(tabulate(rows, headers=heads, tablefmt="simple", disable_numparse=True))
        else:
            blocks.append(fill(block.removeprefix("# "), width))
    return "\n\n".join(blocks)


def _split_cells(line: str) -> list[str]:
    """Split a line of a Markdown table."""
    return [cell.strip() for cell in line.strip("|").split("|")]


def facts(study: Study) -> dict[str, Any]:
    """Gather what the templates show: the study, its answer, and lists that are sorted, counted or filtered here."""
    settings = study.settings
    exact: dict[str, list[str]] = {}
    for key, why in study.sources.exact.items():
        exact.setdefault(why, []).append(key)
    quantities = [(check.result, q) for check in study.checks for q in check.quantities]
    shares = study.sources.shares
    groups = list(dict.fromkeys(group for shares_of_speed in shares.values() for group in shares_of_speed))
    large_groups = [group for group in groups if max(by_group.get(group, 0.0) for by_group in shares.values()) >= 0.005]
    extrapolated: list[tuple[TyreCase, str, TyreProperties]] = []
    notes: list[tuple[str, str]] = []
    for case in study.cases:
        for wheel, p in zip(("rear", "front"), case.properties, strict=False):
            notes += [(case.name, note) for note in p.notes]
            if not p.inside:
                extrapolated.append((case, wheel, p))
    return {
        "study": study,
        "settings": settings,
        "limits": LIMITS,
        "a": answer(study),
        "find_check": partial(find_check, study),
        "is_doubtful": partial(is_doubtful, study),
        "assumed_of_tyre": assumed_of_tyre(settings, study.focus),
        "comparisons": compare_findings(study),
        "critical_parts": list(parts(study, CRITICAL, 3)),
        "damping_parts": list(parts(study, DAMPING, 5)),
        "other_crossings": list(_other_crossings(study)),
        "shares": shares,
        "assumed_sds": study.sources.assumed,
        "exact_reasons": exact,
        "quantities": quantities,
        "groups": large_groups,
        "different": [(r, q) for r, q in quantities if not is_linear(q)],
        "ranges": vars(settings.ranges),
        "assumed_stiffness_sd": CORNERING_STIFFNESS,
        "length_sds": [1e3 * math.sqrt(case.covariance[k, k]) for case in study.cases for k in (1, 3)],
        "extrapolated": extrapolated,
        "guessed": list(dict.fromkeys(case.name for case in study.cases if case.out_of_reach)),
        "notes": list(dict.fromkeys(notes)),
    }


def find_check(study: Study, result: Result, edge: CriticalSpeed) -> Quantity | None:
    """Find the quantity with the random bicycles of an ``edge`` of wobble; None where none were drawn."""
    case = (result.setup, result.case.name, result.case.condition)  # a result of another process is another object
    for check in study.checks:
        if (check.result.setup, check.result.case.name, check.result.case.condition) == case:
            for q in check.quantities:
                if q.crossing and math.isclose(q.value, edge.speed, rel_tol=1e-9):
                    return q
    return None


def is_doubtful(study: Study, edge: CriticalSpeed) -> bool:
    """True if the linear standard deviation of such an ``edge`` is not valid in one of the cases that were checked."""
    quantities = [q for check in study.checks for q in check.quantities if not is_linear(q)]
    doubtful = [(q.crossing.mode, q.crossing.destabilising) for q in quantities if q.crossing]
    return (edge.mode, edge.destabilising) in doubtful


def is_linear(q: Quantity) -> bool:
    """True if the linear standard deviation is valid: the draws have the same, and none has lost the quantity."""
    return not differs(q) and not q.lost


class Printed(NamedTuple):
    """A change in rounded numbers that add up: total = after - before = length + stiffness + interaction.

    All in the unit of the quantity that changes: m/s of a critical speed, 1 of a damping ratio.
    """

    before: Decimal  # at the higher pressure
    after: Decimal  # at the lower pressure
    total: Decimal  # after - before
    length: Decimal  # by the relaxation length alone
    stiffness: Decimal  # by the cornering stiffness alone
    interaction: Decimal  # what both together add to the two parts


def round_change(change: Change, digits: int) -> Printed:
    """Round the ends and the two parts to ``digits`` places; the total and the interaction follow from these."""
    numbers = (change.before, change.after, change.length_part, change.stiffness_part)
    before, after, length, stiffness = (round(Decimal(number), digits) for number in numbers)
    total = after - before
    return Printed(before, after, total, length, stiffness, total - length - stiffness)


def parts(study: Study, quantity: str, digits: int) -> Any:
    """Yield decomposition, change and its rounded numbers in the reference world, for one ``quantity``."""
    for d in study.decompositions:
        for change in d.changes:
            if d.setup == study.settings.reference and change.quantity == quantity:
                yield d, change, round_change(change, digits)


def never_stable(result: Result, limit: float) -> bool:
    """Return True if some root grows at every speed from walking (1 m/s) to ``limit``, though no one mode may do so."""
    return bool((result.modes.model.eigenvalues(np.arange(1.0, limit + 0.1, 0.1)).real > 0).any(axis=1).all())


def excess(quantity: Quantity) -> float:
    """Relative excess of the standard deviation of the draws over the linear one."""
    return quantity.sampled_sd / quantity.linear_sd - 1


def _other_crossings(study: Study) -> Any:
    """Yield world, mode, new state, speeds, cases and all cases of the modes beside wobble that change stability."""
    limit = study.settings.fastest
    for setup in study.settings.setups:
        results = study.results_of(setup)
        speeds_of: dict[tuple[str, str], list[tuple[int, float]]] = {}  # mode and direction -> case and speed, m/s
        for number, r in enumerate(results):
            for c in r.crossings:
                if c not in r.wobble_edges and c.speed <= limit:
                    speeds_of.setdefault((c.mode, c.direction), []).append((number, c.speed))
        for (mode, direction), places in speeds_of.items():
            state = "unstable" if direction == "destabilising" else "stable"
            speeds = [speed for _, speed in places]
            yield setup, mode.replace("_", " "), state, speeds, len({number for number, _ in places}), len(results)
        never = sum(never_stable(r, limit) for r in results)
        if never:
            yield setup, "all together", "stable", [], never, len(results)


def like(value: float, sd: float) -> str:
    """Print a ``value`` with as many places as its ``sd`` deserves: one digit of it, two if that is a 1."""
    if not (math.isfinite(sd) and sd > 0):
        return f"{value:.4g}"
    leading, power = map(int, f"{sd:.0e}".split("e"))
    return f"{value:.{max(0, 1 - power if leading == 1 else -power)}f}"


def with_sign(value: Any, digits: str = "") -> str:
    """Print a ``value`` with its sign, and without one if it prints as zero; ``digits`` is a format such as ``.2f``."""
    text = f"{value:+{digits}}"
    return text if float(text) else text[1:]


def span_of(values: Sequence[float], digits: str, *, sign: bool = False, scale: float = 1.0) -> str:
    """Print ``low to high`` of ``values``, or one number if they print alike; ``digits`` is a format (``.2f``)."""
    ends = [with_sign(v, digits) if sign else f"{scale * v:{digits}}" for v in (min(values), max(values))]
    return " to ".join(dict.fromkeys(ends))


def two_digits(sd: float) -> str:
    """Print a standard deviation with two digits, never as a power of ten."""
    return np.format_float_positional(sd, precision=2, fractional=False, trim="-")


FILTERS = {
    "plain": plain_name,
    "like": like,
    "signed": with_sign,
    "span_of": span_of,
    "excess": excess,
    "linear": is_linear,
    "digits": two_digits,
}
