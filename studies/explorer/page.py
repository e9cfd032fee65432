"""The page: its words and places (``templates/explorer.html.j2``), and what of it is Dash's."""

import base64
import hashlib
from functools import cache
from importlib.resources import files
from types import SimpleNamespace
from typing import Any

from dash import dcc, html
from markupsafe import Markup

from studies.explorer.guard import LARGEST_BODY
from studies.explorer.loaded import ENDINGS, LARGEST
from studies.explorer.looks import HEIGHTS
from studies.reporting.markdown_text import html_template
from tyre.find_tyre import FILE_ENDINGS

ALONG = (("modes", "Modes along speed"), ("critical", "Critical speeds"), ("locus", "Root locus"))
AT = (("damping", "Damping at the chosen speed"), ("sensitivity", "Sensitivities at the chosen speed"))
CHART = ("chart", "Stability chart")
"""Figures: id and what they are called. A further view is a row here, its figure in a callback of ``app.py``.

They are drawn by ``assets/explorer.js``: a graph of Dash would draw each of them empty first, and all of them before
the first is seen. ``assets/plotly-basic.min.js`` is plotly.js 4.1.1 as its makers publish it for lines and bars (npm
plotly.js-basic-dist-min, MIT), a quarter of what Dash would ask for."""

PROGRAM = ("appearance", "common", "server", "explorer")

ACCEPTED = ",".join(dict.fromkeys((*ENDINGS, *FILE_ENDINGS)))

ASKED = ("ask-at", "ask-motion", "ask-chart", "save")
"""Stores of what the browser asks: a running number, the address of the state, the colours."""

ANSWERED = ("damping", "sensitivity", "motion", "chart", "dropped")
"""Stores of what the server answers, each read by the function of ``assets/explorer.js`` of that name."""

DIRECT = ("ask-along", "along", "ask-form", "form")
"""Stores that stay empty: the page asks these questions itself (``assets/server.js``), as Dash would."""


@cache
def program() -> str:
    """The program of the page, which stands in it: it asks for the figures before anything else is read."""
    return "".join(_asset(f"{name}.js") for name in PROGRAM)


def program_hash() -> str:
    """What the content security policy calls :func:`program`."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(program().encode()).digest()).decode()}'"


def index(initial: str) -> str:
    """The page as the browser gets it, but for the places that Dash fills.

    Dash's own programs lie in a template, read when the first figure is drawn (``assets/server.js``).

    Parameters
    ----------
    initial : str
        Address of the state that it begins with.
    """
    places = ("metas", "title", "favicon", "css", "app_entry", "config", "scripts", "renderer")
    text = files("studies.explorer").joinpath("templates/explorer.html.j2").read_text(encoding="utf-8")
    return str(
        html_template(text).render(
            initial=initial, style=Markup(_asset("explorer.css")), program=Markup(program()),
            along=ALONG, at=AT, chart=CHART, heights=HEIGHTS, largest=LARGEST, largest_body=LARGEST_BODY,
            dash=SimpleNamespace(**{name: Markup(f"{{%{name}%}}") for name in places}),
        )
    )  # fmt: skip


def _asset(name: str) -> str:
    return files("studies.explorer").joinpath("assets", name).read_text(encoding="utf-8")


def carrier() -> Any:
    """What Dash carries: questions and answers, the files that are dropped and those that are taken away."""
    words = "Load a bicycle, model or tyre, or drop it here (a model together with its tyre files)"
    drop = dcc.Upload(
        html.Div(words, className="drop"),
        id="upload", accept=ACCEPTED, max_size=LARGEST, multiple=True, className="upload", className_active="over",
    )  # fmt: skip
    return html.Div(
        [*(dcc.Store(id=name) for name in ("state", *ASKED, *ANSWERED, *DIRECT)), dcc.Download(id="file"), drop]
    )
