"""The report of a diagnosis: Markdown, HTML and figures in one folder."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from studies.missing_effect.diagnose import Diagnosis
from studies.missing_effect.figures import draw_all, explains
from studies.missing_effect.gap_figures import MOST_SERIES, residuals
from studies.reporting.output import write_json

SAYS = {
    "none": "Nothing is missing: the base model with its uncertain parameters explains the measurement.",
    "named": "One effect is missing and is named, relative to the library that was tried.",
    "class": "An effect is missing, but these data cannot tell which of several it is.",
    "partial": "An effect is named, but something significant remains; see the rules that do not hold.",
    "unknown": "Something is missing that no effect of the library explains.",
}

TEMPLATE = """# What is missing: {{ name }}

**{{ v.verdict }}** — {{ says }}

{% if description %}{{ description }}
{% endif %}{% if source %}Source: {{ source }}
{% endif %}
{% for e in v.effects %}- **{{ e.identifier }}**: {% for key, (value, sd) in e.parameters.items() -%}
{{ key }} = {{ '%.4g' % value }} ± {{ '%.2g' % sd }} {{ e.units[key] if e.units[key] != '1' }}
{{- ', ' if not loop.last }}
{%- endfor %} (1 sd){% if e.signature %}. What it does: {{ e.signature }}{% endif %}
{% endfor %}
{% if v.equivalent|length > 1 %}
These cannot be told apart with the data at hand: {{ v.equivalent|join(', ') }}.
{% endif %}
## Where the gap is

χ² over {{ v.chi2.n }} numbers: {{ '%.1f' % v.chi2.nominal }} for the base model,
{{ '%.1f' % v.chi2.nuisance_only }} with the parameters adjusted within their uncertainty,
{{ '%.1f' % v.chi2.final }} with what was named.

| χ² by | n | base model | parameters adjusted | final |
|---|---|---|---|---|
{% for row in parts %}| {{ row|join(' | ') }} |
{% endfor %}
{% for figure in ('gap', 'before_after') if figure in captions %}
![{{ captions[figure] }}]({{ figure }}.png)

*{{ captions[figure] }}*
{% endfor %}
Largest shares of the final χ²:
{% for where, share in v.worst %}
- {{ where }}: {{ '%.0f' % (100 * share) }} %{% endfor %}

## What was tried

| hypothesis | P | χ² | parameters |
|---|---|---|---|
{% for row in tried %}| {{ row|join(' | ') }} |
{% endfor %}
{% for reason, names in not_tried.items() %}- not tried: {{ names|join(', ') }}: {{ reason }}
{% endfor %}
{% for figure in ('posterior', 'similarity') if figure in captions %}
![{{ captions[figure] }}]({{ figure }}.png)

*{{ captions[figure] }}*
{% endfor %}
## How sure

| rule | figure | holds |
|---|---|---|
{% for c in v.checks %}| {{ c.what }} | {{ c.figure }} | {{ 'yes' if c.passed else 'no' }} |
{% endfor %}
The final model fits with p = {{ '%.3g' % v.goodness_of_fit_p }}. Gap on held-out data, relative to the base model:
{{ gaps }}.
{% if 'held_out' in captions %}
![{{ captions.held_out }}](held_out.png)

*{{ captions.held_out }}*
{% endif %}
{% if v.separating_measurements %}
## What to measure next

Predicted distance of the leading effect to its nearest rival, in standard deviations of the new measurement:

| measurement | gain |
|---|---|
{% for s in v.separating_measurements %}| {{ s.what }} | {{ '%.1f' % s.gain }} |
{% endfor %}{% endif %}
{% if v.mimics %}
## What would mimic the rest

Terms without a physical cause, and effects with the sign that nature does not give.
They are not named; they say where to look.

| term | value | χ² |
|---|---|---|
{% for m in v.mimics %}| {{ m.what }} | {{ '%.3g' % m.value }} | {{ '%.1f' % m.chi2 }} |
{% endfor %}{% endif %}
## Assumptions

{% for line in v.warnings %}- {{ line }}
{% else %}None.
{% endfor %}"""

PAGE = """<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{title}</title><style>
body{{max-width:52rem;margin:2rem auto;padding:0 1rem;font:16px/1.5 Georgia,serif}}
table{{border-collapse:collapse;font-size:.85rem;display:block;overflow-x:auto}}
td,th{{border-bottom:1px solid #ccc;padding:.2rem .6rem;text-align:left}}
img{{max-width:100%}}</style></head><body>{body}</body></html>
"""


def write_report(diagnosis: Diagnosis, folder: Path) -> None:
    """Write ``report.md``, ``report.html``, ``verdict.json`` and the figures of a ``diagnosis`` into ``folder``."""
    import jinja2
    import markdown

    folder.mkdir(parents=True, exist_ok=True)
    captions = draw_all(diagnosis, folder)
    environment = jinja2.Environment(trim_blocks=False, autoescape=False, undefined=jinja2.StrictUndefined)
    text = environment.from_string(TEMPLATE).render(**_content(diagnosis), captions=captions)
    lines = [line.rstrip() for line in text.splitlines()]
    text = "\n".join(line for k, line in enumerate(lines) if line or (k and lines[k - 1])) + "\n"
    (folder / "report.md").write_text(text, encoding="utf-8")
    body = markdown.markdown(text, extensions=["tables"])
    title = f"What is missing: {diagnosis.measurement.name}"
    (folder / "report.html").write_text(PAGE.format(title=title, body=body), encoding="utf-8")
    write_json(diagnosis.verdict.to_dict(), str(folder / "verdict.json"))


def _content(diagnosis: Diagnosis) -> dict[str, Any]:
    verdict, measurement = diagnosis.verdict, diagnosis.measurement
    not_tried: dict[str, list[str]] = {}
    for name, reason in verdict.refused.items():
        not_tried.setdefault(reason, []).append(name)
    absent = "no gap to close" if verdict.held_out_gap["nominal"] is None else "not known, one run"
    gaps = [
        f"{name.replace('_', ' ')} {absent if value is None else format(value, '.2f')}"
        for name, value in verdict.held_out_gap.items()
    ]
    return {
        "v": verdict, "name": measurement.name, "says": SAYS[verdict.verdict], "gaps": ", ".join(gaps),
        "description": measurement.description, "source": measurement.source, "parts": _parts(diagnosis),
        "tried": _tried(diagnosis), "not_tried": not_tried,
    }  # fmt: skip


def _parts(diagnosis: Diagnosis) -> list[list[str]]:
    """Chi^2 by series and by third of the speeds, of the three models."""
    rows, models = diagnosis.forward.rows, residuals(diagnosis)
    series, table = np.array(rows.series), []
    edges = np.quantile(rows.abscissa, [0, 1 / 3, 2 / 3, 1])
    if len(set(rows.series)) > MOST_SERIES:
        series = rows.channels
    groups = {str(name): series == name for name in dict.fromkeys(series.tolist())}
    for number, name in enumerate(rows.condition):
        groups[name] = rows.abscissa == number
    for low, high in pairwise(edges) if rows.one_axis else ():
        inside = (rows.abscissa >= low) & ((rows.abscissa < high) | (high == edges[-1]))
        if inside.any() and high > low:
            groups[f"{low:.3g} to {high:.3g} m/s"] = inside
    for name, inside in groups.items():
        table.append([name, str(inside.sum()), *(f"{float(r[inside] @ r[inside]):.1f}" for r in models.values())])
    return table


def _tried(diagnosis: Diagnosis) -> list[list[str]]:
    known, posterior = diagnosis.hypotheses, diagnosis.hypotheses.posterior
    shown = [known.null, *known.best(1), *known.best(2)[:5], *known.best(3)[:3]]
    table = []
    for f in sorted(shown, key=lambda f: -posterior[f.name]):
        values = [
            f"{u.name} {float(u.value(np.asarray(x))):.3g} {'' if u.unit == '1' else u.unit}".rstrip()
            for u, x in zip(f.unknowns[f.effect_columns], f.theta[f.effect_columns], strict=True)
        ]
        table.append([explains(f), f"{posterior[f.name]:.2g}", f"{f.chi2:.1f}", ", ".join(values)])
    return table
