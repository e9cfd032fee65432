"""The report of the main study, Markdown and HTML: numbers and objects for the templates, which make the words."""

import math
import re
from collections.abc import Callable, Sequence
from decimal import Decimal
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bicycle.default_sd import CORNERING_STIFFNESS
from studies.main_study import figures, paper_figures
from studies.main_study.cases import Cases
from studies.main_study.compare import CRITICAL, DAMPING, Change
from studies.main_study.published import compared
from studies.main_study.result import COMPARED, WOBBLE, Result, varied_apart
from studies.main_study.screen import answer
from studies.main_study.settings import CONTACT_LENGTH, LIMITS, Settings
from studies.main_study.study import Study, run_study, spread
from studies.main_study.tidy_tables import write_tables
from studies.reporting.command_context import made_by
from studies.reporting.markdown_text import page as html_page
from studies.reporting.markdown_text import render_file
from studies.uncertainty.propagation import Quantity
from tyre.files import write_text

PACKAGE = "studies.main_study"


def run_and_write(
    settings: Settings, folder: Path, *, workers: int = 1, cases: Cases | None = None
) -> tuple[Study, str, Path]:
    """Compute the study and write it into ``folder``; return it with its first screen and the HTML report."""
    folder.mkdir(parents=True, exist_ok=True)
    with spread(workers) as each:
        study = run_study(settings, each=each, cases=cases)
        write_tables(study, folder)
        each(_draw, [(draw, study) for draw in figures.drawings(settings, folder)], "figures")
        stems = [(stem,) for stem in paper_figures.paper_stems(folder)]
        papers = each(paper_figures.draw_paper_figure, stems, "figures of the paper")
    first, _, page = write_report(study, folder, redrawn=[stem.name for stem in papers])
    return study, first, page


def _draw(draw: Callable[[Study], Path], study: Study) -> Path:
    return draw(study)


def write_report(study: Study, folder: Path, *, redrawn: Sequence[str] = ()) -> tuple[str, Path, Path]:
    """Write report.md and report.html into ``folder``, beside the figures they show; return the first screen too."""
    template = resources.files(PACKAGE).joinpath("templates", "report.md.j2").read_text(encoding="utf-8")
    titles = [title for title in re.findall(r"^## (.+)$", template, re.MULTILINE) if title != "Contents"]
    content = facts(study)
    shown = content | {"paper_figures": redrawn, "sections": [(title, anchor(title)) for title in titles]}
    text = render_file(PACKAGE, "report.md.j2", shown, filters=FILTERS).rstrip() + made_by()
    layout = resources.files(PACKAGE).joinpath("templates", "report.html.j2").read_text(encoding="utf-8")
    made = html_page(
        layout, title=f"velotyre: {study.settings.bicycle.name}", text=text, extensions=("tables", "toc"),
        extension_configs={"toc": {"slugify": lambda title, _: anchor(title)}},
    )  # fmt: skip
    files = (folder / "report.md", folder / "report.html")
    for file, whole in zip(files, (text, made), strict=True):
        write_text(file, whole)
    return first_screen(study, content), *files


def first_screen(study: Study, content: dict[str, Any] | None = None) -> str:
    """Write question and answer as Markdown in which nothing is escaped, for a terminal."""
    return render_file(PACKAGE, "answer.md.j2", content or facts(study), escaped=False, filters=FILTERS)


def anchor(title: str) -> str:
    """Make the end of a link to the section ``title`` as Markdown viewers do."""
    return re.sub(r"[^a-z0-9]+", "-", re.sub(r"['?.]", "", title.lower())).strip("-")


def facts(study: Study) -> dict[str, Any]:
    """Gather what the templates show."""
    settings, reference = study.settings, study.settings.reference
    shares, exact = study.sources.shares, study.sources.exact
    first = next((which for mode in COMPARED for which in shares if which.mode.split("+")[0] == mode), None)
    ranked = sorted(shares[first].items(), key=lambda one: -one[1]) if first else []
    reasons: dict[str, list[str]] = {}
    for key, why in exact.items():
        reasons.setdefault(why, []).append(key)
    quantities = [(one.result, q) for one in study.checks for q in one.quantities]
    comparisons = compared(study)
    return {
        "study": study, "settings": settings, "limits": LIMITS, "a": answer(study),
        "results": study.of(reference, study.names[0]),
        "causes": (first, [(group, share) for group, share in ranked if share >= 0.005]) if first else None,
        "exact_alone": [key for key in exact if not varied_apart(key)],
        "other_wobble": sorted({c.mode for r in study.results for c in _edges(r, study) if c.mode != WOBBLE}),
        "single_lag": CONTACT_LENGTH not in settings.further, "shortest": _shortest_wave(study),
        "hands_on": _wobbling_hands_on(study), "comparisons": comparisons,
        "outside": {one.finding.quantity if one.finding.hands != "on" else "hands on"
                    for one in comparisons if one.verdict == "outside"},
        "critical_parts": list(parts(study, CRITICAL, 3)), "damping_parts": list(parts(study, DAMPING, 5)),
        "other_crossings": list(_other_crossings(study)), "shares": shares,
        "groups": [group for group in dict.fromkeys(g for one in shares.values() for g in one)
                   if max(one.get(group, 0.0) for one in shares.values()) >= 0.005],
        "assumed_sds": study.sources.assumed,
        "exact_reasons": reasons, "quantities": quantities,
        "near": [100 * excess(q) for _, q in quantities if not differs(q)],
        "different": [(r, q) for r, q in quantities if differs(q)],
        "ranges": vars(settings.ranges), "assumed_stiffness_sd": CORNERING_STIFFNESS,
        "length_sds": [1e3 * math.sqrt(case.covariance[k, k]) for case in study.cases for k in (1, 3)],
        "extrapolated": [(case, wheel, p) for case in study.cases
                         for wheel, p in zip(("rear", "front"), case.properties, strict=False) if not p.inside],
        "guessed": list(dict.fromkeys(case.name for case in study.cases if case.out_of_reach)),
        "own": list(dict.fromkeys(case.name for case in study.cases if not case.packaged)),
        "packaged": list(dict.fromkeys(case.name for case in study.cases if case.packaged)),
        "notes": list(dict.fromkeys((case.name, note) for case in study.cases for p in case.properties
                                    for note in p.notes)),
    }  # fmt: skip


class Printed(NamedTuple):
    """A change in rounded numbers that add up: total = after - before = length + stiffness + interaction."""

    before: Decimal
    after: Decimal
    total: Decimal
    length: Decimal
    stiffness: Decimal
    interaction: Decimal


def printed(change: Change, digits: int) -> Printed:
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
                yield d, change, printed(change, digits)


def never_stable(result: Result, limit: float) -> bool:
    """Return True if some root grows at every speed from walking (1 m/s) to ``limit``, though no one mode may do so."""
    values = result.modes.model.eigenvalues(np.arange(1.0, limit + 0.1, 0.1))
    return bool((values.real > 0).any(axis=1).all())


def excess(quantity: Quantity) -> float:
    """Relative excess of the standard deviation of the draws over the linear one."""
    return quantity.sampled_sd / quantity.linear_sd - 1


def differs(quantity: Quantity) -> bool:
    """Return True if the two standard deviations are far apart, or some draws have lost the quantity."""
    return bool(quantity.lost) or not abs(excess(quantity)) <= LIMITS.far


def _edges(result: Result, study: Study) -> list[Any]:
    """Ends of the bands of unstable wobble that begin at speeds looked at."""
    bands = result.bands(study.settings.fastest)
    return [edge for band in bands for edge in (band.start, band.end) if edge]


def _shortest_wave(study: Study) -> tuple[float, float, Any, Any] | None:
    """Shortest wave at an edge of a band: in relaxation lengths and in m, with the edge and its case."""
    found = []
    for r in study.of(study.settings.reference):
        for edge in _edges(r, study):
            wave = edge.speed / edge.frequency_hz
            found.append((wave / float(r.case.contact[3]), wave, edge, r.case))
    return min(found, key=lambda one: one[0], default=None)


def _wobbling_hands_on(study: Study) -> Any:
    """Random bicycles with hands on of which some wobble although the bicycle of the study does not."""
    result = study.result(study.settings.setups[1], study.focus)
    outer = study.outer(result)
    if result is None or outer is None or result.span(study.settings.fastest) or not outer.likely("onset"):
        return None
    return outer


def _other_crossings(study: Study) -> Any:
    """Yield world, mode, new state, speeds, cases and all cases of the modes beside wobble that change stability."""
    limit = study.settings.fastest
    for setup in study.settings.setups:
        results = study.of(setup)
        found: dict[tuple[str, str], list[tuple[int, float]]] = {}
        for number, r in enumerate(results):
            for c in r.crossings:
                if c not in r.wobble_edges and c.speed <= limit:
                    found.setdefault((c.mode, c.direction), []).append((number, c.speed))
        for (mode, direction), places in found.items():
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
    power = math.floor(math.log10(sd))
    leading = round(sd / 10.0**power)
    if leading == 10:
        power, leading = power + 1, 1
    return f"{value:.{max(0, 1 - power if leading == 1 else -power)}f}"


def signed(value: Any, digits: str = "") -> str:
    """Print a ``value`` with its sign, and without one if it prints as zero; ``digits`` is a format such as ``.2f``."""
    text = f"{value:+{digits}}"
    return text if float(text) else text[1:]


def span_of(values: Sequence[float], digits: str, *, sign: bool = False, scale: float = 1.0) -> str:
    """Print ``low to high`` of ``values``, or one number if they print alike; ``digits`` is a format (``.2f``)."""
    ends = [signed(v, digits) if sign else f"{scale * v:{digits}}" for v in (min(values), max(values))]
    return " to ".join(dict.fromkeys(ends))


def two_digits(sd: float) -> str:
    """Print a standard deviation with two digits, never as a power of ten."""
    return np.format_float_positional(sd, precision=2, fractional=False, trim="-")


FILTERS = {"like": like, "signed": signed, "span_of": span_of, "excess": excess, "digits": two_digits}
