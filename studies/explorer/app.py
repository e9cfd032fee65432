"""Answer the page: each callback takes the address of a state and gives figures or words, no traceback."""

import base64
import binascii
import hashlib
import logging
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from dash import ClientsideFunction, Dash, Input, Output, State, dcc, html, no_update
from markupsafe import Markup

from bicycle.stability.mode_figure import mode_words
from studies.explorer import exports, figures
from studies.explorer.chart import chart_csv, chart_figure, chart_notes, chart_of
from studies.explorer.forms import controls_html
from studies.explorer.geometry import Misfit
from studies.explorer.models import (
    Computed,
    amplitudes,
    at_speed,
    bicycle_name,
    compute_modes,
    ranking,
    view_from_the_side,
    words_beside,
)
from studies.explorer.motion import mode_motion
from studies.explorer.state import State as Shown
from studies.explorer.state import parse_state
from studies.explorer.tyre_files import kept_here
from studies.explorer.uploads import ENDINGS, LARGEST, LARGEST_BODY, with_files
from tyre.ground.errors import InputError
from tyre.maps.find_tyre import FILE_ENDINGS

ALONG = (("modes", "Modes along speed"), ("critical", "Critical speeds"), ("locus", "Root locus"))
AT = (("damping", "Damping at the chosen speed"), ("sensitivity", "Sensitivities at the chosen speed"),
      ("amplitude", "Amplitude over speed"))  # fmt: skip
CHART = ("chart", "Stability chart")
"""Figures: id and what they are called. A further view is a row here and one in :data:`ANSWERS`.

They are drawn by ``assets/explorer.js``: a graph of Dash would draw each of them empty first, and all of them before
the first is seen. ``assets/plotly-basic.min.js`` is plotly.js 4.1.1 as its makers publish it for lines and bars (npm
plotly.js-basic-dist-min, MIT), a quarter of what Dash would ask for."""


def main_figures(question: Any, theme: Any) -> dict[str, Any]:
    """Draw the figures along speed of the address ``question``; under ``shown`` what the browser needs besides."""
    state = parse_state(question)
    model = compute_modes(state)
    palette = _palette(theme)
    pinned = exports.compute_pins(state)
    view = {
        "asked": question,
        "address": state.address,
        "name": f"{bicycle_name(state)}, {', '.join(e.identifier.replace('_', ' ') for e in model.model.effects)}",
        "modes": [{"value": name, "words": mode_words(name)} for name in model.named.names],
        "critical": [figures.critical_words(c) for c in model.critical]
        or [f"no critical speed up to {state.fast:g} m/s"],
        "sides": side_views(state, model, pinned),
        "beside": words_beside(model.model),
        "notes": [" ".join(str(note).split()) for note in (*model.notes, *model.named.events, *kept_here(state))],
    }
    locus = figures.root_locus(model, palette)
    del locus["layout"]["meta"]  # its table is that of the modes, which the browser has
    modes = figures.modes_figure(model, pinned, palette)
    critical = figures.critical_strip(model, palette)
    return {"figures": {"modes": modes, "critical": critical, "locus": locus}, "shown": view}


def side_views(state: Shown, model: Computed, pinned: Mapping[str, Computed]) -> str:
    """Draw the bicycle and the one pinned last to scale, side by side, with their critical speeds."""
    last_pin = list(zip(map(parse_state, state.pins), pinned.values(), strict=True))[-1:]
    views = []
    for drawn_state, drawn_model in ((state, model), *last_pin):
        critical = [figures.critical_words(speed) for speed in drawn_model.critical]
        views.append(view_from_the_side(drawn_state) | {"critical": critical, "fast": drawn_state.fast})
    low, top, wide, high = zip(*(view["box"] for view in views), strict=True)
    return str(exports.template("side_view").render(views=views, box=(min(low), min(top), max(wide), max(high))))


def _damping(state: Shown, palette: figures.Palette) -> dict[str, Any]:
    """Answer with the damping figure, and with command and Python that compute the same."""
    figure = figures.figure_or_words("damping", lambda: figures.damping_figure(at_speed(state), palette), palette)
    return {"figure": figure, "command": exports.as_command(state), "python": exports.as_python(state)}


def _chart(state: Shown, palette: figures.Palette) -> dict[str, Any]:
    """Answer with the stability chart, the address it is of, and its notes."""
    chart = chart_of(state)
    return {"figure": chart_figure(chart, palette), "address": state.address, "notes": chart_notes(chart)}


def _words_or(name: str, make: Callable[[Shown, figures.Palette], figures.Figure]) -> Any:
    """Make the answer of the figure ``name``: the figure, or words in its place."""
    return lambda state, palette: {"figure": figures.figure_or_words(name, lambda: make(state, palette), palette)}


# store of the answer, read by the function of assets/explorer.js of that name -> store of the question, answer
ANSWERS: dict[str, tuple[str, Callable[[Shown, figures.Palette], dict[str, Any]]]] = {
    "damping": ("ask-at", _damping),
    "sensitivity": ("ask-at", _words_or("sensitivity", lambda s, p: figures.sensitivity_figure(ranking(s), p))),
    "amplitude": ("ask-at", _words_or("amplitude", lambda s, p: figures.amplitude_figure(amplitudes(s), s.fast, p))),
    "motion": ("ask-motion", lambda state, _: mode_motion(state, at_speed(state))),
    "chart": ("ask-chart", _chart),
}

# stores that stay empty: the page asks these questions itself (assets/server.js), as Dash would
DIRECT = ("ask-along", "along", "ask-form", "form")

# what can be taken away -> end of its file name, content
FILES: dict[Any, tuple[str, Callable[[Shown, figures.Palette], str]]] = {
    "model": (".toml", lambda state, _: exports.model_toml(state)),
    "csv": ("_eigenvalues.csv", lambda state, _: exports.eigenvalues_csv(state)),
    "chart": ("_stability_chart.csv", lambda state, _: chart_csv(state)),
    "page": (".html", exports.saved_page),
    "page with chart": (".html", lambda state, palette: exports.saved_page(state, palette, chart=True)),
}


@cache
def program() -> str:
    """Program of the page, inlined in it: it asks for the figures before anything else is read."""
    return "".join(
        exports.read_packaged(f"assets/{name}.js") for name in ("appearance", "common", "server", "explorer")
    )


def program_hash() -> str:
    """Name of :func:`program` in the content security policy."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(program().encode()).digest()).decode()}'"


def build_app(initial: str = "") -> Dash:
    """Build the page with its callbacks, beginning with the state of the address ``initial``."""
    places = ("metas", "title", "favicon", "css", "app_entry", "config", "scripts", "renderer")
    page = exports.template("explorer").render(
        initial=initial,
        style=Markup(exports.read_packaged("assets/explorer.css")),
        program=Markup(program()),
        along=ALONG,
        at=AT,
        chart=CHART,
        heights=figures.HEIGHTS,
        largest=LARGEST,
        largest_body=LARGEST_BODY,
        dash=SimpleNamespace(**{name: Markup(f"{{%{name}%}}") for name in places}),
    )
    app = Dash(
        "velotyre_explorer",
        assets_folder=str(Path(__file__).parent / "assets"),
        index_string=str(page),
        title="velotyre explorer",
        update_title="",
        serve_locally=True,
        assets_ignore=r"\.(js|css)$",
        suppress_callback_exceptions=False,
    )
    questions = dict.fromkeys(question for question, _ in ANSWERS.values())
    stores = ("state", *questions, *ANSWERS, "save", "dropped", *DIRECT)
    words = "Load a bicycle, model or tyre, or drop it here (a model together with its tyre files)"
    drop = dcc.Upload(
        html.Div(words, className="drop"),
        id="upload",
        accept=",".join(dict.fromkeys((*ENDINGS, *FILE_ENDINGS))),
        max_size=LARGEST,
        multiple=True,
        className="upload",
        className_active="over",
    )
    app.layout = html.Div([*(dcc.Store(id=name) for name in stores), dcc.Download(id="file"), drop])
    for name, (question, answer) in ANSWERS.items():
        _answer(app, name, question, answer)
    _form_and_files(app)
    for name in (*ANSWERS, "dropped"):
        app.clientside_callback(ClientsideFunction("velotyre", name), Input(name, "data"), prevent_initial_call=True)
    app.clientside_callback(ClientsideFunction("velotyre", "carry"), Input("file", "id"))  # says that Dash is there
    return app


def _answer(app: Dash, name: str, question: str, answer: Callable[[Shown, figures.Palette], dict[str, Any]]) -> None:
    """Let the store ``name`` hold the answer to the question in the store ``question``."""

    @app.callback(Output(name, "data"), Input(question, "data"), prevent_initial_call=True)
    def answered(asked: Any) -> Any:
        text, theme = _read_question(asked)
        try:
            state = parse_state(text)
        except InputError as error:  # else the page already shows the message
            return {"message": str(error)} if name == "chart" else no_update
        return _or_message(lambda: answer(state, _palette(theme)))


def _form_and_files(app: Dash) -> None:
    """Answer what is asked along speed, for the form, with dropped files, and for a file to save."""

    @app.callback(Output("along", "data"), Input("ask-along", "data"), prevent_initial_call=True)
    def along(asked: Any) -> Any:
        text, theme = _read_question(asked)
        view = {"asked": text}
        return _or_message(
            lambda: main_figures(text, theme), lambda figures_and_view: {"shown": view | figures_and_view}
        )

    @app.callback(Output("form", "data"), Input("ask-form", "data"), prevent_initial_call=True)
    def form(asked: Any) -> Any:
        try:
            return {"html": controls_html(parse_state(_read_question(asked)[0]))}
        except InputError:  # also of a rider or another name that is not known: the page shows the message
            return {"html": controls_html(Shown())}

    @app.callback(
        Output("dropped", "data"),
        Input("upload", "contents"),
        State("upload", "filename"),
        State("state", "data"),
        prevent_initial_call=True,
    )
    def dropped(contents: Any, name: Any, asked: Any) -> Any:
        texts, names = _read_list(contents), _read_list(name)
        if not texts or len(texts) != len(names):
            return no_update
        try:
            start = parse_state(asked or "")
        except InputError:
            start = Shown()

        def load() -> dict[str, Any]:
            try:
                contents = [base64.b64decode(text.partition(",")[2], validate=True) for text in texts]
            except binascii.Error as error:
                raise InputError(f"{names[0][:80]}: the browser sent it incompletely; drop it again") from error
            state, remarks = with_files(start, list(zip(names, contents, strict=True)))
            return {"address": state.address, "remarks": list(remarks), "name": ", ".join(name[:80] for name in names)}

        return _or_message(load)

    @app.callback(Output("file", "data"), Input("save", "data"), prevent_initial_call=True)
    def save(asked: Any) -> Any:
        text, theme = _read_question(asked)
        kind = asked.get("what") if isinstance(asked, dict) else None
        if not isinstance(kind, str) or kind not in FILES:
            return no_update
        ending, make = FILES[kind]

        def content() -> dict[str, Any]:
            state = parse_state(text)
            name = f"{exports.file_stem(state)}{ending}"
            return {"content": make(state, _palette(theme)), "filename": name, "type": "text/plain"}

        return _or_message(content, lambda _: no_update)


def _or_message(make: Callable[[], Any], refuse: Callable[[dict[str, str]], Any] = dict) -> Any:
    """Answer with what ``make`` returns, or a refusal in words; an unforeseen error goes to the terminal."""
    try:
        return make()
    except Misfit as error:  # the page shows it next to the slider
        return refuse({"message": str(error), "key": error.key})
    except InputError as error:
        return refuse({"message": str(error)})
    except Exception:
        logging.getLogger(__name__).exception("no answer")
        return refuse({"message": figures.FAILED})


def _read_list(sent: Any) -> list[str]:
    """Read one text or several, as the browser sends them for one file or several; empty if they are no texts."""
    texts = sent if isinstance(sent, list) else [sent]
    return texts if all(isinstance(text, str) for text in texts) else []


def _read_question(question: Any) -> tuple[Any, Any]:
    """Read address and theme of a question; its running number makes the same question be answered again."""
    return (question.get("text"), question.get("theme")) if isinstance(question, dict) else (None, None)


def _palette(theme: Any) -> figures.Palette:
    """Choose the colours of a theme; light ones if it is none."""
    return figures.PALETTES.get(theme, figures.LIGHT) if isinstance(theme, str) else figures.LIGHT
