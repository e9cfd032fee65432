"""What the page shows of a diagnosis: the verdict first, then gap, before and after, posterior, parameters moved."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from studies.explorer.recording.diagnosis_tables import moved_figure, posterior_figure, report_tables
from studies.explorer.recording.panels import MEASURED, Curve, Panel, entry
from studies.inference.joint import JointForward
from studies.inference.judge import Judgement
from studies.look.figure import thinned
from studies.missing_effect.diagnose import Diagnosis
from studies.missing_effect.gap_figures import residuals, rms_by_channel, shown_series
from studies.missing_effect.motion.history_forward import HistoryForward
from studies.missing_effect.motion.trace_figure import missed_most
from studies.missing_effect.part_figures import of_part
from studies.missing_effect.report import record
from studies.missing_effect.reporting import sentences
from studies.missing_effect.reporting.findings import Findings

IMAGES = {"similarity": "How alike the effects are in these data: |cosine|, parameters marginalised",
          "held_out": "χ²/n on data left out of the fit; 1 is noise alone"}  # fmt: skip
"""Figures of the report that the page shows as they are."""


def diagnosis_shown(found: tuple[Diagnosis, Findings]) -> dict[str, Any]:
    """What the page shows of a diagnosis.

    Parameters
    ----------
    found : tuple of Diagnosis and Findings
    """
    diagnosis, findings = found
    verdict = diagnosis.verdict
    figures: list[dict[str, Any]] = []
    images: dict[str, str] = dict(IMAGES)
    for number, name, part in _parts(diagnosis):
        of, end = (f" of {name}", f"-{number}") if name else ("", "")
        figures.append(_gap(part, of, end))
        after = _before_after(part)
        if after is None:
            images = {f"before_after{end.replace('-', '_')}": f"Before and after{of}"} | images
        else:
            panels, note = after
            words = f"Before and after{of}"
            figures.append(entry(f"before-after{end}", words, words, panels, note=note))
    figures += [posterior_figure(diagnosis), *([moved_figure(diagnosis, findings.moved)] if findings.moved else [])]
    return {
        "verdict": verdict.verdict,
        "odd_part": sentences.odd_note(diagnosis, findings),
        "sentence": sentences.sentence(verdict),
        "means": sentences.SAYS[verdict.verdict],
        "closing": [sentences.closing(diagnosis), sentences.fitting(diagnosis)],
        "further": [f"{one.what}: {one.gain:.1f} sd" for one in findings.further[:5]],
        "further_note": sentences.next_note(findings),
        "figures": figures,
        "images": [
            {"file": f"{name}.svg", "words": words}
            for name, words in images.items()
            if Path("diagnosis", f"{name}.svg").is_file()
        ],
        "tables": [one for one in report_tables(diagnosis) if one["rows"]],
        "record": record(diagnosis, findings),
    }  # fmt: skip


def _parts(diagnosis: Diagnosis) -> Iterator[tuple[int, str, Judgement]]:
    """The judgement itself; of joint data what it says of each part, with number and name."""
    if not isinstance(diagnosis.forward, JointForward):
        yield 0, "", diagnosis
        return
    for k, part in enumerate(diagnosis.forward.parts):
        yield k + 1, part.name, of_part(diagnosis, k)


def _gap(judgement: Judgement, of: str, end: str) -> dict[str, Any]:
    """Residuals of each series, or their root mean square by channel."""
    rows, names, series = judgement.forward.rows, shown_series(judgement), np.array(judgement.forward.rows.series)
    panels = []
    for name in names:
        here = series == name
        curves = [
            Curve(title, k, rows.abscissa[here].tolist(), gap[here].tolist(), "markers")
            for k, (title, gap) in enumerate(residuals(judgement).items())
        ]
        words = "" if rows.condition else rows.show(name).axis or rows.axis
        panels.append(Panel(name, words, "gap / sd", curves, level=(-2, 2), ticks=rows.condition))
    note = "Where the gap is: (measured − computed) / sd; noise alone stays within ±2."
    if not names:
        note = "Where the gap is: root mean square of (measured − computed) / sd; noise alone is 1."
        for name, (places, values) in rms_by_channel(judgement).items():
            curves = [Curve(t, k, places, rms, "lines+markers") for k, (t, rms) in enumerate(values.items())]
            panels.append(Panel(name, rows.axis, "rms gap / sd", curves, logarithmic=True))
    return entry(f"gap{end}", f"Gap map{of}", f"Gap map{of}", panels, note=note)


def _before_after(judgement: Judgement) -> tuple[list[Panel], str] | None:
    """Measured and computed: time traces of histories, values of what has them; None of others."""
    forward = judgement.forward
    if isinstance(forward, HistoryForward):
        return _traces(
            judgement, forward
        ), "The runs that the base model misses most; computed ones start where they fit best."
    if not hasattr(forward, "measured"):
        return None
    rows, series = forward.rows, np.array(forward.rows.series)
    measured, sd = forward.measured
    panels = []
    for name in dict.fromkeys(rows.series):
        here = np.flatnonzero(series == name)
        here = here[np.argsort(rows.abscissa[here], kind="stable")]
        at = rows.abscissa[here].tolist()
        curves = [Curve("measured, 95 %", MEASURED, at, measured[here].tolist(), "markers", (1.96 * sd[here]).tolist())]
        for k, (title, gap) in enumerate(residuals(judgement).items()):
            drawn = "markers" if rows.condition else "lines"
            curves.append(Curve(title, k, at, (measured[here] - sd[here] * gap[here]).tolist(), drawn))
        words = "" if rows.condition else rows.show(name).axis or rows.axis
        panels.append(Panel(rows.show(name).channel, words, rows.show(name).quantity, curves, ticks=rows.condition))
    return panels, "Measured values with 95 % intervals, and the models."


def _traces(judgement: Judgement, forward: HistoryForward) -> list[Panel]:
    missed, shown = missed_most(judgement)
    panels = []
    for k in shown:
        run = forward.runs[k]
        for c, name in enumerate(forward.noise):
            seen = run.channels[name]
            x, y = thinned(run.time, seen)
            curves = [Curve("measured", MEASURED, x.tolist(), y.tolist(), "markers")]
            for number, (title, rest) in enumerate(missed.items()):
                x, y = thinned(run.time, seen - rest[k][:, c])
                curves.append(Curve(title, number, x.tolist(), y.tolist()))
            panels.append(Panel(f"{run.name}, {run.speed:.3g} m/s", "time, s", name, curves))
    return panels
