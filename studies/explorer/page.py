"""The page as Dash draws it: places for the forms (``controls.py``), figures with their tables, downloads."""

from typing import Any

from dash import dcc, html

from studies.explorer.guard import LARGEST_BODY
from studies.explorer.loaded import ENDINGS, LARGEST
from studies.explorer.looks import HEIGHTS
from tyre.find_tyre import FILE_ENDINGS

INDEX = """<!DOCTYPE html>
<html lang="en">
<head>
{%metas%}
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{%title%}</title>
{%favicon%}
{%css%}
</head>
<body>
{%app_entry%}
<footer><script src="/assets/plotly-basic.min.js"></script>
{%config%}{%scripts%}{%renderer%}</footer>
</body>
</html>
"""
"""What draws is asked for at once: Dash would ask for it only when it meets the first figure, and for four times as
much. ``assets/plotly-basic.min.js`` is plotly.js 4.1.1 as its makers publish it for lines and bars (npm
plotly.js-basic-dist-min, MIT)."""

ALONG = (("modes", "Modes along speed"), ("critical", "Critical speeds"), ("locus", "Root locus"))
AT = (("damping", "Damping at the chosen speed"), ("sensitivity", "Sensitivities at the chosen speed"))
CHART = ("chart", "Stability chart")
"""Figures: id and what they are called. A further view is a row here, its figure in a callback of ``app.py``.

The figures are drawn by ``assets/explorer.js`` from what comes into the store ``drawn-ID``: a graph of Dash would draw
each of them empty first, and all of them before the first is seen."""

ACCEPTED = ",".join(dict.fromkeys((*ENDINGS, *FILE_ENDINGS)))

STORES = (
    "state",
    "theme",
    "redraw",
    "form",
    "shown",
    "settled",
    "motion",
    "dropped",
    "copied",
    "charted",
    "chart-told",
)


def page(initial: str) -> Any:
    """The components of the page.

    Parameters
    ----------
    initial : str
        Address of the state that it begins with.
    """
    return html.Div(
        [
            dcc.Store(id="initial", data=initial),
            *(dcc.Store(id=name) for name in STORES),
            *(dcc.Store(id=f"drawn-{name}") for name, _ in (*ALONG, *AT, CHART)),
            dcc.Download(id="file"),
            html.A("Skip to the figures", href="#figures", className="skip"),
            html.Header(
                [
                    html.H1("velotyre explorer"),
                    html.Nav(
                        [html.A("Model", href="/", **{"aria-current": "page"}), html.A("Recording", href="/recording")],
                        **{"aria-label": "Pages"},
                    ),
                    html.P(id="what"),
                    html.Div(
                        [
                            html.Button("Undo", id="undo", title="Take the last change back (Alt+Z)"),
                            html.Button("Pin", id="pin", title="Keep the present curves to compare (Alt+P)"),
                            html.Button("Unpin", id="unpin", title="Drop what is pinned"),
                            html.Div(id="theme-place"),
                            html.Span(id="busy", role="status"),
                        ],
                        className="bar",
                    ),
                ]
            ),
            html.Div(id="message", role="alert", **{"data-largest": LARGEST, "data-largest-body": LARGEST_BODY}),
            html.Div([_controls(), _figures()], className="columns"),
        ],
        id="page",
    )


def _controls() -> Any:
    words = "Load a bicycle, model or tyre, or drop it here (a model together with its tyre files)"
    drop = dcc.Upload(
        html.Div(words, className="drop"),
        id="upload", accept=ACCEPTED, max_size=LARGEST, multiple=True, className="upload", className_active="over",
    )  # fmt: skip
    inside = [html.Summary("Model"), drop, html.Div(id="loaded", role="status"), html.Div(id="form-model")]
    return html.Section(html.Details(inside, open=True, id="controls"), className="controls", **{"aria-label": "Model"})


def _figures() -> Any:
    return html.Main(
        [
            html.Section([html.H2("Along speed"), html.Div(id="form-speeds"), *(_figure(*one) for one in ALONG)]),
            html.Section([
                html.H2("At one speed"), html.Div(id="form-at"),
                html.Div([*(_figure(*one) for one in AT), _motion()], className="pair"),
            ]),
            _chart(),
            html.Section([html.H2("Notes on this model"), html.Ul(id="notes")]),
            _take_away(),
        ],
        id="figures", tabIndex=-1,
    )  # fmt: skip


def _figure(name: str, words: str) -> Any:
    graph = html.Div(html.Div(className="graph"), id=name, style={"minHeight": f"{HEIGHTS[name]}px"})
    buttons = [
        html.Button(f"{kind.upper()}", **{"data-image": name, "data-format": kind, "aria-label": f"{words} as {kind}"})
        for kind in ("svg", "png")
    ]
    table = html.Details(
        [html.Summary(f"Table: {words.lower()}"), html.Div(id=f"table-{name}", className="table", tabIndex=0)],
        **{"data-table": name},
    )
    under = html.Div([table, html.Div(buttons, className="images")], className="under")
    return html.Figure([graph, under], **{"aria-label": words})


def _chart() -> Any:
    """Drawn when it is asked for: it takes seconds."""
    buttons = [html.Button("Draw the chart", id="draw-chart"), html.Span(id="chart-busy", role="status")]
    parts = [html.H2("Stability chart of two numbers"), html.Div(id="form-chart"), html.Div(buttons, className="bar")]
    taken = html.Button("Chart (CSV)", id="save-chart")
    drawn = html.Div([_figure(*CHART), html.Ul(id="chart-notes"), taken], id="chart-place", hidden=True)
    return html.Section([*parts, html.Div(id="chart-said", role="alert"), drawn], id="chart-section")


def _motion() -> Any:
    table = html.Details(
        [html.Summary("Table: mode shape"), html.Div(id="table-motion", className="table", tabIndex=0)],
        **{"data-table": "motion"},
    )
    parts = [
        html.H3("Mode shape", id="motion-title"),
        html.Div(id="motion-views", className="views"),
        html.Div([html.Button("Play", id="play"), html.Span(id="motion-said")], className="bar"),
        table,
    ]
    return html.Figure(parts, className="motion", **{"aria-label": "Mode shape"})


def _take_away() -> Any:
    buttons = [
        html.Button("Model (TOML)", id="save-model"),
        html.Button("Eigenvalues (CSV)", id="save-csv"),
        html.Button("Save as page (HTML)", id="save-page", title="One file that works offline"),
    ]
    texts = [
        html.Div(
            [
                html.H3(words),
                html.Button(f"Copy {what}", **{"data-copy": f"text-{what}"}),
                html.Pre(id=f"text-{what}", tabIndex=0),
            ]
        )
        for what, words in (("command", "As command"), ("python", "As Python"))
    ]
    return html.Section([html.H2("Take away"), html.Div(buttons, className="bar"), *texts])
