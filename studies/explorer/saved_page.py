"""The present view as one HTML file that works from the disk: figures, tables, data and the model file inside."""

import base64
import gzip
import json
from contextlib import suppress
from datetime import UTC, datetime
from functools import cache
from importlib.resources import files
from typing import Any

from studies.explorer import exports
from studies.explorer.along_speed import Figure, critical_strip, modes_figure, root_locus
from studies.explorer.chart import chart_figure, chart_notes, chart_of
from studies.explorer.computed import at_speed, computed, ranking
from studies.explorer.looks import Palette
from studies.explorer.models import bicycle_name
from studies.explorer.motion import mode_motion
from studies.explorer.one_speed import damping_figure, figure_or_words, sensitivity_figure
from studies.explorer.state import State, parse_state
from studies.explorer.tyre_files import files_of, kept_here
from studies.reporting.markdown_text import html_template


def saved_page(state: State, palette: Palette, *, chart: bool = False) -> str:
    """The file.

    Parameters
    ----------
    state : State
    palette : Palette
        The figures keep its colours.
    chart : bool, optional
        With the stability chart over the axes of the state, which is there at once where the page has shown it.

    Raises
    ------
    InputError
        The state makes no model.
    """
    now, at, needed = computed(state), at_speed(state), kept_here(state)
    pins = {f"pin {k + 1}: {bicycle_name(pin)}": pin for k, pin in enumerate(map(parse_state, state.pins))}
    drawn, told = _chart(state, palette) if chart else ({}, [])
    content = {
        "figures": {
            "Modes along speed": modes_figure(now, {label: computed(pin) for label, pin in pins.items()}, palette),
            "Critical speeds": critical_strip(now, palette),
            "Root locus": root_locus(now, palette),
            "Damping at the chosen speed": damping_figure(at, palette),
            "Sensitivities at the chosen speed": figure_or_words(
                "sensitivity", lambda: sensitivity_figure(ranking(state), palette), palette
            ),
            **drawn,
        },
        "motion": mode_motion(state, at),
        "files": {
            f"{exports.file_stem(state)}.toml": exports.model_toml(state),
            f"{exports.file_stem(state)}_eigenvalues.csv": exports.eigenvalues_csv(state),
            **_texts(state),
        },
        "notes": [*now.notes, *needed, *told],
    }
    return str(
        _template().render(
            name=bicycle_name(state), dark=palette.dark, made=datetime.now(UTC).strftime("%Y-%m-%d"),
            effects=", ".join(e.identifier.replace("_", " ") for e in now.model.effects), at=state.at,
            address=state.address, plotly=_plotly(), content=_packed(json.dumps(content, allow_nan=False).encode()),
            common=_asset("common.js"), style=_asset("explorer.css"),
        )
    )  # fmt: skip


def _chart(state: State, palette: Palette) -> tuple[dict[str, Figure], list[str]]:
    """The stability chart under its title, and how to read it."""
    found = chart_of(state)
    notes = [f"stability chart: {line}" for line in chart_notes(found)]
    return {"Stability chart": chart_figure(found, palette)}, notes


def _texts(state: State) -> dict[str, str]:
    """Tyre files that were loaded, as text."""
    found = {}
    for name, data in files_of(state).items():
        with suppress(UnicodeDecodeError):  # of a .mat: its numbers stand in the tables
            found[name] = data.decode()
    return found


def _packed(data: bytes) -> str:
    """Compressed, as letters that no tag of HTML can be made of (base 85 has no slash)."""
    return base64.b85encode(gzip.compress(data, 9, mtime=0)).decode("ascii")


@cache
def _plotly() -> str:
    """The program that draws."""
    return _packed(files("studies.explorer").joinpath("assets", "plotly-basic.min.js").read_bytes())


def _asset(name: str) -> str:
    return files("studies.explorer").joinpath("assets", name).read_text(encoding="utf-8")


@cache
def _template() -> Any:
    text = files("studies.explorer").joinpath("templates/saved_page.html.j2").read_text(encoding="utf-8")
    return html_template(text)
