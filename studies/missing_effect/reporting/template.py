"""The report as text: a first page that answers, and the details behind a table of contents."""

TEMPLATE = """# What is missing: {{ name }}

{% if odd_note %}
**{{ odd_note.partition(': ')[0] }}:** {{ odd_note.partition(': ')[2] }}

All parts together: {% endif %}**{{ v.verdict }}** — {{ sentence }}

{% for doubt in f.doubts %}
**Check first:** {{ doubt }}.
{% endfor %}
{% if description %}{{ description }}

{% endif %}{% if source %}Source: {{ source }}

{% endif %}
{% if v.effects and v.verdict != 'partial' %}{{ named_table() }}{% endif %}
{% if v.equivalent|length > 1 %}
{% if ahead %}Not ruled out with the data at hand:{% else %}These cannot be told apart with the data at hand:{% endif %}

{% for member in v.equivalent %}
- {{ said(member) }}{% if member in v.reasons %}: {{ v.reasons[member] }}{% endif %}{% endfor %}
{% endif %}
{% if v.refused_leaders %}
More probable than what the verdict rests on, but refused:
{% for who, share, rule in v.refused_leaders %}
- {{ said(who) }} (P = {{ probability(share) }}): {{ rule }}{% endfor %}
{% endif %}
## The gap

{{ closing }}
{% for figure in captions if figure.startswith('gap') %}
![{{ captions[figure] }}]({{ figure }}.png)

*{{ captions[figure] }}*
{% endfor %}
{% if f.parts %}
## Do the parts agree?

| part | n | {{ models|cells }} | disagreement with the others | P(more, if one model is true) |
|---|---|---{{ '|---' * models|length }}|---|
{% for row in together %}| {{ row|cells }} |
{% endfor %}
{% for line in parts_lines %}{{ line }}

{% endfor %}
{% if compared_parts %}
| effect | by this part alone | by the others | apart by |
|---|---|---|---|
{% for row in compared_parts %}| {{ row|cells }} |
{% endfor %}
{% endif %}
{% if unseen_note %}
{{ unseen_note }}

{% endif %}
{% endif %}
{% if f.predicted %}
## Runs that were never fitted

| predicted | {{ predictors|cells }} |
|---|{{ '---|' * predictors|length }}
{% for row in predicted %}| {{ row|cells }} |
{% endfor %}
{{ predicted_note }}

{% endif %}
## Parameters that moved

{% if moved[0] %}
| parameter | stated | now | {{ went|cells }} |
|---|---|---|{{ '---|' * went|length }}
{% for row in moved[0] %}| {{ row|cells }} |
{% endfor %}
Values ± one standard deviation, now in the fit with {{ compared }}{{ without_torque }}; "moved" is how far
the parameter went, in its stated or assumed standard deviations;
{{ moved[1]|length }} others went less than half of one.
{% elif moved[1] %}
None of {{ moved[1]|length }} went farther than half its stated or assumed standard deviation, in the fit with
{{ compared }}{{ without_torque }}.
{% else %}
None floats.
{% endif %}
## What could still be there

{% if limits[0] %}
| effect | parameter | 95 % limit | share of what its prior allows |
|---|---|---|---|
{% for row in limits[0] %}| {{ row|cells }} |
{% endfor %}
{% endif %}
{% if limits[0] %}{{ limits_note }}
{% elif not limits[1] %}No further effect of the library has a size that could be limited.
{% endif %}
{% if limits[1] %}
Not limited by these data (the limit is that of the prior, or beyond): {{ limits[1]|join(', ') }}.
{% endif %}
## What to measure next

{% if further %}
| measurement | gain |
|---|---|
{% for s in further %}| {{ [s.what, '%.1f' % s.gain]|cells }} |
{% endfor %}
{% endif %}
{{ next_note }}

{% if f.stability %}
## Does the verdict stand?

{{ stability_note }}

| variant | verdict | names | P(nothing) | same? |
|---|---|---|---|---|
{% for row in varied %}| {{ row|cells }} |
{% endfor %}
{% endif %}
{% for figure in captions if figure.startswith('before_after') %}
{% if loop.first %}## Measured and computed{% endif %}

![{{ captions[figure] }}]({{ figure }}.png)

*{{ captions[figure] }}*
{% endfor %}
{% if f.kept %}
## What could not be named

{{ kept_note }}
{% if kept_amplitude %}
{{ kept_amplitude }}
{% endif %}
{% if kept_rows %}
| torque | value | 1 sd, these terms alone | 1 sd | gain of log evidence | gain of held-out score |
|---|---|---|---|---|---|
{% for row in kept_rows %}| {{ row|cells }} |
{% endfor %}
Slope and curve are those over half the range of measured speeds, about its middle ({{ kept_speeds }}). The second
standard deviation, which the corrected model carries, holds what the terms that were left out may take.

![{{ captions.residual_torque }}](residual_torque.png)

*{{ captions.residual_torque }}*
{% if kept_critical_note %}
{{ kept_critical_note }}
{% endif %}
{% if kept_critical %}

| what happens | speed | measured there? |
|---|---|---|
{% for row in kept_critical %}| {{ row|cells }} |
{% endfor %}
{% endif %}
{% endif %}
{% endif %}
{% if corrected %}
## The corrected model

{{ corrected }}
{% endif %}
{% if v.effects and v.verdict == 'partial' %}
## Named in part

{{ named_table() }}
{% endif %}
# Details

{% for anchor, title in contents %}- [{{ title }}](#{{ anchor }})
{% endfor %}
{{ open('places') }}

| χ² by | n | {{ models|cells }} |
|---|---|{{ '---|' * models|length }}
{% for row in parts %}| {{ row|cells }} |
{% endfor %}
Largest shares of the χ² that remains ({{ models[-1] }}):
{% for where, share in v.worst %}
- {{ where }}: {{ '%.0f' % (100 * share) }} %{% endfor %}

{{ close }}
{{ open('tried') }}

| hypothesis | P | χ² | sizes | what became of it |
|---|---|---|---|---|
{% for row in tried %}| {{ row|cells }} |
{% endfor %}
{% for reason, names in not_tried.items() %}- not tried: {{ names|join(', ') }}: {{ reason }}
{% endfor %}
{% for figure in ('posterior', 'similarity') if figure in captions %}
![{{ captions[figure] }}]({{ figure }}.png)

*{{ captions[figure] }}*
{% endfor %}
{{ close }}
{{ open('rules') }}

| rule | figure | holds |
|---|---|---|
{% for c in v.checks %}| {{ [c.what, c.figure]|cells }} | {{ 'yes' if c.passed else 'no' }} |
{% endfor %}
{{ fitting }} Gap on held-out data, relative to the base model: {{ gaps }}.
{% if 'held_out' in captions %}
![{{ captions.held_out }}](held_out.png)

*{{ captions.held_out }}*
{% endif %}
{{ close }}
{% if moved[1] %}
{{ open('still') }}

| parameter | stated | now | {{ went|cells }} |
|---|---|---|{{ '---|' * went|length }}
{% for row in moved[1] %}| {{ row|cells }} |
{% endfor %}
{{ close }}
{% endif %}
{% if mimics %}
{{ open('mimics') }}

Terms without a physical cause, and effects with the sign that nature does not give, each added to {{ compared }}
(χ² {{ '%.1f' % v.chi2.final }}). They are not named; they say where to look.

| term | value | χ² |
|---|---|---|
{% for m in mimics %}| {{ [m.what]|cells }} | {{ '%.3g' % m.value }} | {{ '%.1f' % m.chi2 }} |
{% endfor %}
{{ close }}
{% endif %}
{{ open('assumptions') }}

{% for line in v.warnings %}- {{ line }}
{% else %}None.
{% endfor %}
{{ close }}
"""

NAMED = """
| effect | parameter | value | 1 sd | what it does |
|---|---|---|---|---|
{rows}

{note}
"""

SECTIONS = {
    "places": "Where the gap is", "tried": "What was tried", "rules": "How sure: the rules",
    "still": "Parameters that stayed", "mimics": "What would mimic the rest", "assumptions": "Assumptions",
}  # fmt: skip

OPEN = '<details markdown="1" id="{anchor}">\n<summary>{title}</summary>\n'
CLOSE = "</details>\n"

PAGE = """<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{{ title }}</title><style>
body{max-width:56rem;margin:2rem auto;padding:0 1rem;font:16px/1.5 Georgia,serif}
table{border-collapse:collapse;font-size:.85rem;display:block;overflow-x:auto}
td,th{border-bottom:1px solid #ccc;padding:.2rem .6rem;text-align:left;vertical-align:top}
h1,h2{line-height:1.25} h2{font-size:1.2rem;margin:1.6rem 0 .4rem}
summary{cursor:pointer;font-weight:bold;padding:.3rem 0} details{border-top:1px solid #ccc}
#tried td:nth-child(2){white-space:nowrap}
img{max-width:100%}</style><script>
function show(){const d=document.getElementById(location.hash.slice(1));if(d&&d.tagName=="DETAILS")d.open=true}
addEventListener("hashchange",show);addEventListener("DOMContentLoaded",show)
</script></head><body>{{ body }}</body></html>
"""
