"""Export a state: model as TOML, eigenvalues as CSV, a command, Python, or a page that works from the disk."""

import base64
import gzip
import json
import shlex
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from functools import cache
from importlib.resources import files
from pprint import pformat
from typing import Any

from bicycle.effects.effect_registry import outside_origins
from studies.explorer import figures as drawn
from studies.explorer.chart import chart_figure, chart_notes, chart_of
from studies.explorer.models import POINTS, Computed, at_speed, bicycle_name, compute_modes, model_content, ranking
from studies.explorer.motion import mode_motion
from studies.explorer.state import State, parse_state, write_value
from studies.explorer.tyre_files import TYRES, files_of, kept_here, tyre_names
from studies.reporting.markdown_text import html_template
from tyre.ground.files import slug

HEAD = "# made by velotyre explore, {address}\n{needed}"
NEEDED = "# needs beside it, as they were loaded: {names}\n"
COMMAND = "cat > model.toml <<'END_OF_MODEL'\n{model}END_OF_MODEL\nvelotyre{own} modes model.toml --speeds {speeds}"
PYTHON = """\
import numpy as np
import velotyre as vt

{own}model = vt.build_model({model})
found = vt.modes(model, np.linspace({slow!r}, {fast!r}, {points}))
critical = vt.critical_speeds(model, max_speed={fast!r})
print(found, *critical, sep='\\n')
"""


def read_packaged(name: str) -> str:
    """Read the text of a file of the page."""
    return files("studies.explorer").joinpath(name).read_text(encoding="utf-8")


@cache
def template(name: str) -> Any:
    """Read a template of the page; it escapes all that is not markup."""
    return html_template(read_packaged(f"templates/{name}.html.j2"))


def file_stem(state: State) -> str:
    """Make a name for files of a state, without ending."""
    bicycle = state.content["bicycle"]
    return slug(bicycle if isinstance(bicycle, str) else state.name or "own")


def model_toml(state: State) -> str:
    """Write the model file of a state, its rider part of the bicycle."""
    import tomli_w

    head = HEAD.format(address=replace(state, pins=()).address, needed=_name_needed_files(state))
    return head + tomli_w.dumps(TYRES.with_file_names(model_content(state)))


def _name_needed_files(state: State) -> str:
    """Write a comment that names the loaded tyre files; empty without any."""
    names = ", ".join(TYRES.content(tyre_names(state.content)))
    return NEEDED.format(names=names) if names else ""


def eigenvalues_csv(state: State) -> str:
    """Write a row per speed, mode and root, as ``velotyre modes --csv`` writes it."""
    return str(compute_modes(state).named.to_dataframe().to_csv(index=False, lineterminator="\n"))


def as_command(state: State) -> str:
    """Write the command that computes the same on a packaged bicycle, or on a model file that it writes first."""
    step = (state.fast - state.slow) / (POINTS - 1)
    speeds = (
        f"{write_value(state.slow)}:{write_value(state.fast)}:{write_value(step)} --max-speed {write_value(state.fast)}"
    )
    effects_option = "".join(
        f" --effects {shlex.quote(str(origin.file))}" for origin in outside_origins() if origin.file
    )
    content = model_content(state)
    if isinstance(content["bicycle"], str) and set(content) == {"bicycle"}:
        return f"velotyre{effects_option} modes {content['bicycle']} --speeds {speeds}"
    return COMMAND.format(model=model_toml(state), own=effects_option, speeds=speeds)


def as_python(state: State) -> str:
    """Write lines of Python that compute the same."""
    load_lines = "".join(f"vt.load_effects({str(origin.file)!r})\n" for origin in outside_origins() if origin.file)
    model = pformat(TYRES.with_file_names(model_content(state)), sort_dicts=False, width=100)
    return PYTHON.format(
        own=load_lines + _name_needed_files(state), model=model, slow=state.slow, fast=state.fast, points=POINTS
    )


def compute_pins(state: State) -> dict[str, Computed]:
    """Compute the models that a state pins, by number and name."""
    return {
        f"pin {k}: {bicycle_name(pin)}": compute_modes(pin) for k, pin in enumerate(map(parse_state, state.pins), 1)
    }


def saved_page(state: State, palette: drawn.Palette, *, chart: bool = False) -> str:
    """Write the present view as one HTML file, with figures, tables, data and the model file inside."""
    model = compute_modes(state)
    at = at_speed(state)
    figures = {
        "Modes along speed": drawn.modes_figure(model, compute_pins(state), palette),
        "Critical speeds": drawn.critical_strip(model, palette),
        "Root locus": drawn.root_locus(model, palette),
        "Damping at the chosen speed": drawn.damping_figure(at, palette),
        "Sensitivities at the chosen speed": drawn.figure_or_words(
            "sensitivity", lambda: drawn.sensitivity_figure(ranking(state), palette), palette
        ),
    }
    notes = [*model.notes, *kept_here(state)]
    if chart:
        stability = chart_of(state)
        figures["Stability chart"] = chart_figure(stability, palette)
        notes += [f"stability chart: {line}" for line in chart_notes(stability)]
    files = {
        f"{file_stem(state)}.toml": model_toml(state),
        f"{file_stem(state)}_eigenvalues.csv": eigenvalues_csv(state),
    }
    for name, data in files_of(state).items():
        with suppress(UnicodeDecodeError):  # of a .mat: its numbers stand in the tables
            files[name] = data.decode()
    content = {"figures": figures, "motion": mode_motion(state, at), "files": files, "notes": notes}
    return str(
        template("saved_page").render(
            name=bicycle_name(state),
            dark=palette.dark,
            made=datetime.now(UTC).strftime("%Y-%m-%d"),
            effects=", ".join(e.identifier.replace("_", " ") for e in model.model.effects),
            at=state.at,
            address=state.address,
            plotly=_plotly(),
            content=_compress(json.dumps(content, allow_nan=False).encode()),
            common=read_packaged("assets/common.js"),
            style=read_packaged("assets/explorer.css"),
        )
    )


@cache
def _plotly() -> str:
    """Read the program that draws, compressed."""
    return _compress(read_packaged("assets/plotly-basic.min.js").encode())


def _compress(data: bytes) -> str:
    """Compress to letters that no tag of HTML can be made of (base 85 has no slash)."""
    return base64.b85encode(gzip.compress(data, 9, mtime=0)).decode("ascii")
