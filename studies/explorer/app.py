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
from studies.explorer.page import ALONG, AT, CHART, INDEX, page
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
        "velotyre_explorer", assets_folder=str(Path(__file__).parent / "assets"), index_string=INDEX,
        title="velotyre explorer", update_title="", serve_locally=True,
        assets_ignore=r"recording\.js|plotly-basic", suppress_callback_exceptions=False,
    )  # fmt: skip
    app.layout = page(initial)
    _figures(app)
    _forms(app)
    _files(app)
    _in_the_browser(app)
    return app


def main_figures(asked: Any, theme: Any) -> tuple[Any, ...]:
    """Figures along speed and what else is told of a state.

    Parameters
    ----------
    asked : str
        Address.
    theme : str
        ``light`` or ``dark``.

    Returns
    -------
    tuple
        Figures of modes, critical speeds and root locus, and ``shown``: what the browser needs beside them.
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
    return modes_figure(now, pinned, palette), critical_strip(now, palette), locus, shown


def _figures(app: Dash) -> None:
    @app.callback(
        *(Output(f"drawn-{name}", "data") for name, _ in ALONG), Output("shown", "data"),
        Input("state", "data"), Input("theme", "data"), prevent_initial_call=True,
    )  # fmt: skip
    def along(asked: Any, theme: Any) -> Any:
        try:
            return main_figures(asked, theme)
        except InputError as error:
            return (*[no_update] * len(ALONG), _refusal(asked, str(error)))
        except Exception:
            logging.getLogger(__name__).exception("no figures")
            return (*[no_update] * len(ALONG), _refusal(asked, FAILED))

    @app.callback(
        Output("drawn-damping", "data"), Output("text-command", "children"), Output("text-python", "children"),
        Input("settled", "data"), Input("theme", "data"), prevent_initial_call=True,
    )  # fmt: skip
    def damping(asked: Any, theme: Any) -> Any:
        def found(state: Shown) -> Any:
            palette = _palette(theme)
            made = _logged(lambda: damping_figure(at_speed(state), palette))
            drawn = figure_or_words("damping", made, palette)
            return drawn, exports.as_command(state), exports.as_python(state)

        return _said(_numbered(asked), found, 3)

    @app.callback(
        Output("drawn-sensitivity", "data"), Input("settled", "data"), Input("theme", "data"), prevent_initial_call=True
    )
    def sensitivity(asked: Any, theme: Any) -> Any:
        palette = _palette(theme)

        def found(state: Shown) -> Any:
            made = _logged(lambda: sensitivity_figure(ranking(state), palette))
            return figure_or_words("sensitivity", made, palette)

        return _said(_numbered(asked), found, 1)

    @app.callback(Output("motion", "data"), Input("settled", "data"), prevent_initial_call=True)
    def motion(asked: Any) -> Any:
        def found(state: Shown) -> Any:
            try:
                return _logged(lambda: mode_motion(state, at_speed(state)))()
            except InputError as error:
                return {"message": str(error)}

        return _said(_numbered(asked), found, 1)

    @app.callback(
        Output("drawn-chart", "data"), Output("chart-told", "data"),
        Input("charted", "data"), Input("theme", "data"), prevent_initial_call=True,
    )  # fmt: skip
    def chart(asked: Any, theme: Any) -> Any:
        address = _numbered(asked)
        if address is None:
            return no_update, no_update
        try:
            state = parse_state(address)
            found = _logged(lambda: chart_of(state))()
            return chart_figure(found, _palette(theme)), {"address": state.address, "notes": chart_notes(found)}
        except InputError as error:
            return no_update, {"message": str(error)}


def _forms(app: Dash) -> None:
    @app.callback(Output("form", "data"), Input("redraw", "data"), prevent_initial_call=True)
    def form(asked: Any) -> Any:
        try:
            state = parse_state(_numbered(asked))
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
    def made(asked: Any, ending: str, text: Callable[[Shown], str]) -> Any:
        def found(state: Shown) -> Any:
            return {"content": text(state), "filename": f"{exports.file_stem(state)}{ending}", "type": "text/plain"}

        return _said(asked, found, 1)

    @app.callback(
        Output("file", "data"),
        Input("save-model", "n_clicks"), Input("save-csv", "n_clicks"), Input("save-page", "n_clicks"),
        Input("save-chart", "n_clicks"), State("shown", "data"), State("theme", "data"), State("charted", "data"),
        prevent_initial_call=True,
    )  # fmt: skip
    def save(model: Any, csv: Any, whole: Any, drawn: Any, shown: Any, theme: Any, charted: Any) -> Any:
        from dash import ctx

        asked = shown.get("asked") if isinstance(shown, dict) else None
        if ctx.triggered_id == "save-model":
            return made(asked, ".toml", exports.model_toml)
        if ctx.triggered_id == "save-csv":
            return made(asked, "_eigenvalues.csv", exports.eigenvalues_csv)
        if ctx.triggered_id == "save-chart":
            return made(_numbered(charted), "_stability_chart.csv", chart_csv)
        return made(asked, ".html", lambda state: saved_page(state, _palette(theme)))


def _in_the_browser(app: Dash) -> None:
    def client(function: str, *ends: Any, first: bool = False) -> None:
        app.clientside_callback(ClientsideFunction("velotyre", function), *ends, prevent_initial_call=not first)

    client("begin", Output("state", "data"), Input("initial", "data"), first=True)
    client("fill", Output("form-model", "title"), Input("form", "data"))
    client("told", Output("settled", "data"), Input("shown", "data"))
    client("moved", Output("motion-title", "title"), Input("motion", "data"))
    client("loaded", Output("loaded", "title"), Input("dropped", "data"))
    client("charted", Output("chart-said", "title"), Input("chart-told", "data"))
    for name, _ in (*ALONG, *AT, CHART):
        client("draw", Output(f"table-{name}", "title"), Input(f"drawn-{name}", "data"), State(name, "id"))


def _listed(given: Any) -> list[str]:
    """What the browser sends of one file or of several."""
    listed = given if isinstance(given, list) else [given]
    return listed if all(isinstance(one, str) for one in listed) else []


def _numbered(asked: Any) -> Any:
    """The address of what the browser sends with a running number, so that the same one is answered again."""
    return asked.get("text") if isinstance(asked, dict) else None


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


def _said(asked: Any, found: Callable[[Shown], Any], outputs: int) -> Any:
    """What a function finds of a state; nothing where the message already stands on the page."""
    nothing = no_update if outputs == 1 else (no_update,) * outputs
    try:
        return found(parse_state(asked))
    except InputError:
        return nothing
    except Exception:
        logging.getLogger(__name__).exception("no answer")
        return nothing


def _refusal(asked: Any, message: str) -> dict[str, Any]:
    return {"asked": asked, "message": message}


def _or_start(asked: Any) -> Shown:
    try:
        return parse_state(asked or "")
    except InputError:
        return Shown()


def _palette(theme: Any) -> Palette:
    return PALETTES.get(theme, LIGHT) if isinstance(theme, str) else LIGHT
