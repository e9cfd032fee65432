"""The callbacks: each takes the address of a state and gives figures or words; a refusal is words, no traceback."""

import base64
import binascii
import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any

from dash import ClientsideFunction, Dash, Input, Output, State, no_update

from bicycle.modal.looks import mode_words
from studies.explorer import exports
from studies.explorer.along_speed import critical_strip, critical_words, modes_figure, root_locus
from studies.explorer.chart import chart_csv, chart_figure, chart_notes, chart_of
from studies.explorer.computed import at_speed, computed, ranking
from studies.explorer.controls import controls_html
from studies.explorer.dropped import with_files
from studies.explorer.looks import LIGHT, PALETTES, Palette
from studies.explorer.models import bicycle_name
from studies.explorer.motion import mode_motion
from studies.explorer.one_speed import damping_figure, figure_or_words, sensitivity_figure
from studies.explorer.page import ANSWERED, carrier, index
from studies.explorer.saved_page import saved_page
from studies.explorer.state import State as Shown
from studies.explorer.state import parse_state
from studies.explorer.tyre_files import kept_here
from tyre.base.errors import InputError

FAILED = "this could not be computed; the terminal of velotyre explore says why"


def build_app(initial: str = "") -> Dash:
    """The page with its callbacks.

    Parameters
    ----------
    initial : str, optional
        Address of the state that it begins with.
    """
    app = Dash(
        "velotyre_explorer", assets_folder=str(Path(__file__).parent / "assets"), index_string=index(initial),
        title="velotyre explorer", update_title="", serve_locally=True, assets_ignore=r"\.(js|css)$",
        suppress_callback_exceptions=False,
    )  # fmt: skip
    app.layout = carrier()
    _figures(app)
    _forms(app)
    _files(app)
    _in_the_browser(app)
    return app


def main_figures(asked: Any, theme: Any) -> dict[str, Any]:
    """Figures along speed and what else is told of a state.

    Parameters
    ----------
    asked : str
        Address.
    theme : str
        ``light`` or ``dark``.

    Returns
    -------
    dict
        ``figures`` of modes, critical speeds and root locus, and ``shown``: what the browser needs beside them.
    """
    state = parse_state(asked)
    now, palette = computed(state), _palette(theme)
    pins = {f"pin {k + 1}": parse_state(pin) for k, pin in enumerate(state.pins)}
    pinned = {f"{label}: {bicycle_name(pin)}": computed(pin) for label, pin in pins.items()}
    shown = {
        "asked": asked,
        "address": state.address,
        "name": f"{bicycle_name(state)}, {', '.join(e.identifier.replace('_', ' ') for e in now.model.effects)}",
        "modes": [{"value": name, "words": mode_words(name)} for name in now.named.names],
        "critical": [critical_words(c) for c in now.critical] or [f"none up to {state.fast:g} m/s"],
        "notes": [" ".join(str(note).split()) for note in (*now.notes, *now.named.events, *kept_here(state))],
    }
    locus = root_locus(now, palette)
    del locus["layout"]["meta"]  # its table is that of the modes, which the browser has
    modes = modes_figure(now, pinned, palette)
    return {"figures": {"modes": modes, "critical": critical_strip(now, palette), "locus": locus}, "shown": shown}


def _figures(app: Dash) -> None:
    @app.callback(Output("along", "data"), Input("ask-along", "data"), prevent_initial_call=True)
    def along(asked: Any) -> Any:
        text, theme = _asked(asked)
        try:
            return main_figures(text, theme)
        except InputError as error:
            return _refusal(text, str(error))
        except Exception:
            logging.getLogger(__name__).exception("no figures")
            return _refusal(text, FAILED)

    @app.callback(Output("damping", "data"), Input("ask-at", "data"), prevent_initial_call=True)
    def damping(asked: Any) -> Any:
        text, theme = _asked(asked)
        palette = _palette(theme)

        def found(state: Shown) -> Any:
            made = _logged(lambda: damping_figure(at_speed(state), palette))
            drawn = figure_or_words("damping", made, palette)
            return {"figure": drawn, "command": exports.as_command(state), "python": exports.as_python(state)}

        return _said(text, found)

    @app.callback(Output("sensitivity", "data"), Input("ask-at", "data"), prevent_initial_call=True)
    def sensitivity(asked: Any) -> Any:
        text, theme = _asked(asked)
        palette = _palette(theme)

        def found(state: Shown) -> Any:
            made = _logged(lambda: sensitivity_figure(ranking(state), palette))
            return {"figure": figure_or_words("sensitivity", made, palette)}

        return _said(text, found)

    @app.callback(Output("motion", "data"), Input("ask-motion", "data"), prevent_initial_call=True)
    def motion(asked: Any) -> Any:
        def found(state: Shown) -> Any:
            try:
                return _logged(lambda: mode_motion(state, at_speed(state)))()
            except InputError as error:
                return {"message": str(error)}

        return _said(_asked(asked)[0], found)

    @app.callback(Output("chart", "data"), Input("ask-chart", "data"), prevent_initial_call=True)
    def chart(asked: Any) -> Any:
        text, theme = _asked(asked)
        try:
            state = parse_state(text)
            found = _logged(lambda: chart_of(state))()
            return {
                "figure": chart_figure(found, _palette(theme)),
                "address": state.address,
                "notes": chart_notes(found),
            }
        except InputError as error:
            return {"message": str(error)}


def _forms(app: Dash) -> None:
    @app.callback(Output("form", "data"), Input("ask-form", "data"), prevent_initial_call=True)
    def form(asked: Any) -> Any:
        try:
            state = parse_state(_asked(asked)[0])
        except InputError:
            state = Shown()
        try:
            html = controls_html(state)
        except InputError:  # of a rider or another name that is not known: the message stands beside the figures
            state = Shown()
            html = controls_html(state)
        return {"html": html}

    @app.callback(
        Output("dropped", "data"), Input("upload", "contents"), State("upload", "filename"), State("state", "data"),
        prevent_initial_call=True,
    )  # fmt: skip
    def dropped(contents: Any, name: Any, asked: Any) -> Any:
        given, names = _listed(contents), _listed(name)
        if not given or len(given) != len(names):
            return no_update
        try:
            files = [
                (one, base64.b64decode(text.partition(",")[2], validate=True))
                for one, text in zip(names, given, strict=True)
            ]
            state, remarks = _logged(lambda: with_files(_or_start(asked), files))()
        except InputError as error:
            return {"message": str(error)}
        except binascii.Error:
            return {"message": f"{names[0][:80]}: the browser did not send it whole; drop it again"}
        return {"address": state.address, "remarks": list(remarks), "name": ", ".join(one[:80] for one in names)}


def _files(app: Dash) -> None:
    endings: dict[Any, tuple[str, Callable[[Shown, Palette], str]]] = {
        "model": (".toml", lambda state, _: exports.model_toml(state)),
        "csv": ("_eigenvalues.csv", lambda state, _: exports.eigenvalues_csv(state)),
        "chart": ("_stability_chart.csv", lambda state, _: chart_csv(state)),
        "page": (".html", saved_page),
        "page with chart": (".html", lambda state, palette: saved_page(state, palette, chart=True)),
    }

    @app.callback(Output("file", "data"), Input("save", "data"), prevent_initial_call=True)
    def save(asked: Any) -> Any:
        text, theme = _asked(asked)
        what = asked.get("what") if isinstance(asked, dict) else None
        if not isinstance(what, str) or what not in endings:
            return no_update
        ending, made = endings[what]

        def found(state: Shown) -> Any:
            content = made(state, _palette(theme))
            return {"content": content, "filename": f"{exports.file_stem(state)}{ending}", "type": "text/plain"}

        return _said(text, found)


def _in_the_browser(app: Dash) -> None:
    """What comes is read by ``assets/explorer.js``; the first call says that Dash is there."""
    for name in ANSWERED:
        read = ClientsideFunction("velotyre", name)
        app.clientside_callback(read, Input(name, "data"), prevent_initial_call=True)
    app.clientside_callback(ClientsideFunction("velotyre", "carry"), Input("file", "id"))


def _listed(given: Any) -> list[str]:
    """What the browser sends of one file or of several."""
    listed = given if isinstance(given, list) else [given]
    return listed if all(isinstance(one, str) for one in listed) else []


def _asked(asked: Any) -> tuple[Any, Any]:
    """Address and colours of what the browser asks (with a running number, so that the same is answered again)."""
    return (asked.get("text"), asked.get("theme")) if isinstance(asked, dict) else (None, None)


def _logged(made: Callable[[], Any]) -> Callable[[], Any]:
    """The same function; what nobody foresaw goes to the terminal, and the page says so."""

    def call() -> Any:
        try:
            return made()
        except InputError:
            raise
        except Exception as error:
            logging.getLogger(__name__).exception("no answer")
            raise InputError(FAILED) from error

    return call


def _said(asked: Any, found: Callable[[Shown], Any]) -> Any:
    """What a function finds of a state; nothing where the message already stands on the page."""
    try:
        return found(parse_state(asked))
    except InputError:
        return no_update
    except Exception:
        logging.getLogger(__name__).exception("no answer")
        return no_update


def _refusal(asked: Any, message: str) -> dict[str, Any]:
    return {"shown": {"asked": asked, "message": message}}


def _or_start(asked: Any) -> Shown:
    try:
        return parse_state(asked or "")
    except InputError:
        return Shown()


def _palette(theme: Any) -> Palette:
    return PALETTES.get(theme, LIGHT) if isinstance(theme, str) else LIGHT
