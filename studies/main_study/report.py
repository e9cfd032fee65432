"""The report of the main study: numbers and objects for the templates, which form the sentences."""

import math
import operator
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from decimal import Decimal
from pathlib import Path
from textwrap import fill
from typing import Any, NamedTuple

import numpy as np

from bicycle.model.default_sd import CORNERING_STIFFNESS
from bicycle.parameters.front_hinge import height_above_hub
from bicycle.stability.critical import CriticalSpeed
from studies.main_study import figures
from studies.main_study.cases import TyreCase, WheelTyre
from studies.main_study.compare import CRITICAL, DAMPING, Change
from studies.main_study.grades import GRADE_RULES
from studies.main_study.published import Shown, compare_findings
from studies.main_study.result import Result, UncertainCriticalSpeed
from studies.main_study.screen import answer
from studies.main_study.settings import ASSUMED, HANDS, LIMITS, Settings, Setup, plain_name
from studies.main_study.study import Study, run_study, spread
from studies.main_study.tidy_tables import write_tables
from studies.reporting.command_context import made_by
from studies.reporting.markdown_text import render_file, write_page
from studies.uncertainty.propagation import Quantity, differs
from tyre.ground.files import make_folder
from tyre.ground.units import PASCAL_PER_BAR

PACKAGE = "studies.main_study"
SAMPLED = {
    "stiffness": ("front-frame stiffness", "N m/rad"),
    "damping_ratio": ("front-frame damping ratio", "of critical"),
    "hinge": ("shift of the front-frame joint height", "m"),
    "friction": ("steering friction", "N m s/rad"),
    "camber_share": ("camber stiffness", "× load"),
    "trail": ("pneumatic trail", "m"),
    "twisting": ("twisting torque", "N m/rad"),
    "saddle_stiffness": ("yaw stiffness of the rider on the saddle", "N m/rad"),
    "saddle_damping_ratio": ("damping ratio of the rider on the saddle", "of critical"),
    "arm_inertia": ("arm inertia", "× that of the case"),
    "arm_stiffness": ("arm stiffness", "× that of the case"),
    "arm_damping": ("arm damping", "× that of the case"),
}
"""Name and unit of each of the :class:`~studies.main_study.settings.Ranges`."""


def run_and_write(settings: Settings, folder: Path, *, workers: int = 1) -> tuple[Study, str, Path]:
    """Compute the study and write it into ``folder``; return it with its first screen and the HTML report."""
    make_folder(folder)
    with spread(workers) as distribute:
        study = run_study(settings, distribute=distribute)
        write_tables(study, folder)
        distribute(operator.call, [(draw, study) for draw in figures.drawings(study, folder)], "figures")
    first, page = write_report(study, folder)
    return study, first, page


def write_report(study: Study, folder: Path) -> tuple[str, Path]:
    """Write report.html into ``folder``, next to its figures; return the first screen and the file."""
    content = facts(study)
    text = render_file(PACKAGE, "report.md.j2", content, filters=FILTERS).rstrip() + made_by()
    file = write_page(folder, title=f"velotyre: {study.settings.bicycle.name}", text=text)
    return first_screen(study, content), file


def first_screen(study: Study, content: dict[str, Any] | None = None) -> str:
    """Write question and answer as Markdown in which nothing is escaped, for a terminal."""
    return render_file(PACKAGE, "answer.md.j2", content or facts(study), escaped=False, filters=FILTERS)


def rule_of_grades() -> str:
    """Write the rule by which the answer is graded as Markdown."""
    content = {"limits": LIMITS, "rules": GRADE_RULES}
    return render_file(PACKAGE, "rule.md.j2", content, escaped=False, filters=FILTERS)


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
    comparisons = compare_findings(study)
    rows = [CheckRow(check.result, q) for check in study.checks for q in check.quantities]
    notes: list[tuple[str, str]] = []
    extrapolated: list[tuple[TyreCase, WheelTyre]] = []
    for case in study.cases:
        for at in case.wheels:
            if at.properties:
                notes += [(case.name, note) for note in at.properties.notes]
                if not at.properties.inside:
                    extrapolated.append((case, at))
    return {
        "study": study,
        "settings": settings,
        "limits": LIMITS,
        "rules": GRADE_RULES,
        "dry_friction": ASSUMED["dry_friction"].usual,  # N m
        "hands": HANDS,
        # m, of the joint, along the steer axis
        "above_hub": settings.front and height_above_hub(settings.bicycle.values, -settings.front.joint_height),
        "a": answer(study),
        "comparisons": comparisons,
        "verdicts": Counter(comparison.verdict for comparison in comparisons if comparison.ours),
        "bands": [_make_bands(study, result) for result in study.results_of(settings.reference)],
        "critical_parts": list(parts(study, CRITICAL, 3)),
        "damping_parts": list(parts(study, DAMPING, 4)),
        "other_crossings": list(_other_crossings(study)),
        "checked": rows,
        "not_linear": [row for row in rows if not is_linear(row.quantity)],
        "ranges": vars(settings.ranges),
        "sampled": _list_sampled(study),
        "assumed_stiffness_sd": CORNERING_STIFFNESS,
        "length_sds": [at.relaxation_length_sd for case in study.cases for at in case.wheels],  # m
        "extrapolated": extrapolated,
        "guessed": list(dict.fromkeys(case.name for case in study.cases if case.out_of_reach)),
        "notes": list(dict.fromkeys(notes)),
    }


def _list_sampled(study: Study) -> list[tuple[str, tuple[float, float], str]]:
    """List name, range and unit of each assumed or stated value that the samples vary."""
    settings = study.settings
    fixed = {"trail", "twisting", "camber_share"} - set(study.assumed_of_tyre)
    units = {name: unit for name, (_, unit) in SAMPLED.items()}
    if "camber_thrust" in settings.further:
        fixed.discard("camber_share")
        units["camber_share"] = "× that of the model file"
    if settings.front is None:
        fixed |= {"stiffness", "damping_ratio", "hinge"}
    return [(SAMPLED[name][0], ends, units[name]) for name, ends in settings.ranges.drawn.items() if name not in fixed]


class CheckRow(NamedTuple):
    """A quantity of one result, whose linear standard uncertainty is checked by Monte Carlo samples."""

    result: Result  # whose quantity it is
    quantity: Quantity  # with its linear sd and its samples

    @property
    def resolution(self) -> float:
        """A quarter of the linear sd, in the unit of the quantity: its value is printed as finely as this deserves."""
        return self.quantity.linear_sd / 4

    @property
    def excess(self) -> float:
        """Relative excess of the standard deviation of the samples over the linear standard uncertainty."""
        return self.quantity.sampled_sd / self.quantity.linear_sd - 1

    @property
    def bias(self) -> float:
        """Mean of the samples less the value, in linear standard uncertainties."""
        return (self.quantity.sampled_mean - self.quantity.value) / self.quantity.linear_sd


class Edge(NamedTuple):
    """Onset or end of unstable wobble, and what is valid of its uncertainty."""

    crossing: UncertainCriticalSpeed  # speed and linear sd, m/s
    interval: tuple[float, float] | None  # m/s, of 95 % of the samples, where the linear sd is not valid
    has_sd: bool  # the linear sd is valid, as far as it was checked


class Bands(NamedTuple):
    """Unstable wobble of one tyre condition in the reference case."""

    result: Result  # of the case
    # start and end of each band; None: outside the speeds studied
    edges: list[tuple[Edge | None, Edge | None]]
    frequencies: list[float]  # Hz, at every edge


def _make_bands(study: Study, result: Result) -> Bands:
    """List the bands of unstable wobble of one case that start up to the highest speed studied."""
    edges = []
    frequencies = []
    for band in result.bands(study.settings.fastest):
        edges.append((_make_edge(study, result, band.start), _make_edge(study, result, band.end)))
        frequencies += [crossing.frequency_hz for crossing in (band.start, band.end) if crossing]
    return Bands(result, edges, frequencies)


def _make_edge(study: Study, result: Result, crossing: UncertainCriticalSpeed | None) -> Edge | None:
    """Judge whether the linear sd of an edge is valid; where the samples contradict it, take their interval."""
    if crossing is None:
        return None
    q = find_check(study, result, crossing)
    if q:
        return Edge(crossing, None if is_linear(q) else q.band(), is_linear(q))
    return Edge(crossing, None, not is_doubtful(study, crossing))


def find_check(study: Study, result: Result, edge: CriticalSpeed) -> Quantity | None:
    """Find the quantity with the samples of an ``edge`` of wobble; None if it was not sampled."""
    case = (result.setup, result.case.name, result.case.condition)  # a result of another process is another object
    for check in study.checks:
        if (check.result.setup, check.result.case.name, check.result.case.condition) == case:
            for q in check.quantities:
                if q.crossing and math.isclose(q.value, edge.speed, rel_tol=1e-9):
                    return q
    return None


def is_doubtful(study: Study, edge: CriticalSpeed) -> bool:
    """True if the linear standard uncertainty of such an ``edge`` is not valid in one of the checked cases."""
    quantities = [q for check in study.checks for q in check.quantities if not is_linear(q)]
    doubtful = [(q.crossing.mode, q.crossing.destabilising) for q in quantities if q.crossing]
    return (edge.mode, edge.destabilising) in doubtful


def is_linear(q: Quantity) -> bool:
    """True if the linear standard uncertainty is valid: the samples agree with it, and none has lost the quantity."""
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
    interaction: Decimal  # remainder of the total


def round_change(change: Change, digits: int) -> Printed:
    """Round the ends and the two parts to ``digits`` places; the total and the interaction follow from these."""
    numbers = (change.before, change.after, change.length_part, change.stiffness_part)
    before, after, length, stiffness = (round(Decimal(number), digits) for number in numbers)
    total = after - before
    return Printed(before, after, total, length, stiffness, total - length - stiffness)


def parts(study: Study, quantity: str, digits: int) -> Any:
    """Yield decomposition, change and its rounded numbers in the reference case, for one ``quantity``."""
    for d in study.decompositions:
        for change in d.changes:
            if d.setup == study.settings.reference and change.quantity == quantity:
                yield d, change, round_change(change, digits)


def never_stable(result: Result, limit: float) -> bool:
    """Return True if some root grows at every speed from walking (1 m/s) to ``limit``, though no one mode may do so."""
    return bool((result.modes.model.eigenvalues(np.arange(1.0, limit + 0.1, 0.1)).real > 0).any(axis=1).all())


class OtherCrossing(NamedTuple):
    """A mode other than wobble, or all modes, that become stable or unstable in one case."""

    setup: Setup  # case
    mode: str  # its name in words
    state: str  # stable or unstable above the speeds
    speeds: list[float]  # m/s, of every crossing on every tyre condition; empty: there is none
    number: int  # tyre conditions with such a crossing
    total: int  # tyre conditions in that case


def _other_crossings(study: Study) -> Iterator[OtherCrossing]:
    """Find the modes other than wobble that change their stability, and the cases that are never stable."""
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
            cases = {number for number, _ in places}
            yield OtherCrossing(setup, mode.replace("_", " "), state, speeds, len(cases), len(results))
        never = sum(never_stable(r, limit) for r in results)
        if never:
            yield OtherCrossing(setup, "all modes", "stable", [], never, len(results))


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
    """Print a standard uncertainty with two digits, never as a power of ten."""
    return np.format_float_positional(sd, precision=2, fractional=False, trim="-")


def like_or_below(value: float, sd: float) -> str:
    """Print a ``value`` with as many places as ``sd`` deserves, or "below" ``sd`` if it would print as zero."""
    text = like(value, sd)
    return text if float(text) else f"below {like(sd, sd)}"


def published_range(ends: Sequence[float], shown: Shown, limit: float | None = None) -> str:
    """Print the ``ends`` of a range with the unit of their quantity; an infinite one lies beyond the ``limit``."""
    low, high = (f"{shown.scale * end:{shown.digits}}" for end in ends)
    if math.isfinite(ends[1]):
        numbers = low if low == high else f"{low} to {high}"
    else:
        numbers = f">{low}" if limit is None else f"{low} to >{limit:g}"
    return f"{numbers} {shown.unit}".strip()


def signed_percent(share: float, digits: str) -> str:
    """Print a ``share`` with its sign in percent."""
    return f"{with_sign(100 * share, digits)} %"


def _in_unit(scale: float) -> Callable[..., str]:
    """Make a filter that prints an SI number times ``scale``, in a format such as ``.2f``."""

    def show(value: float, digits: str = ".0f") -> str:
        return f"{scale * value:{digits}}"

    return show


def keep_on_one_line(text: str) -> str:
    """Let no line of a page break within a ``text``, such as a number and its unit."""
    return text.replace(" ", "\N{NO-BREAK SPACE}")


FILTERS = {
    "nobreak": keep_on_one_line,
    "plain": plain_name,
    "like": like,
    "like_or_below": like_or_below,
    "signed": with_sign,
    "span_of": span_of,
    "published_range": published_range,
    "digits": two_digits,
    "signed_percent": signed_percent,
    "percent": _in_unit(100.0),
    "kmh": _in_unit(3.6),
    "mm": _in_unit(1e3),
    "degrees": lambda angle: f"{math.degrees(angle):.2g}",
    "bar": _in_unit(1 / PASCAL_PER_BAR),
    "per_degree": _in_unit(math.radians(1.0)),
    "per_mm": _in_unit(1e-3),
}
