"""Figures of horizontal bars for the page of recordings, as plotly dicts, for light and dark."""

from collections.abc import Sequence
from html import escape
from typing import Any

from studies.explorer.looks import PALETTES, colour_on, layout
from studies.reporting.plotting import look


def bars(
    name: str,
    words: str,
    title: str,
    names: Sequence[str],
    values: Sequence[float],
    told: Sequence[str],
    *,
    rows: dict[str, Any],
    hatched: Sequence[bool] = (),
    below: str = "",
    note: str = "",
    logarithmic: bool = False,
) -> dict[str, Any]:
    """A figure of horizontal bars, the first above.

    Parameters
    ----------
    name, words, title : str
        As in :func:`entry`.
    names : sequence of str
    values : sequence of float, shape (n,)
    told : sequence of str
        Beside each bar.
    rows : dict
        The table behind it: ``columns`` and ``rows``.
    hatched : sequence of bool, shape (n,), optional
    below, note : str, optional
        Of the axis; a caption.
    logarithmic : bool, optional
    """  # fmt: skip
    trace = {
        "type": "bar", "orientation": "h", "x": list(values)[::-1], "y": list(range(len(names)))[::-1],
        "text": [escape(one) for one in told][::-1], "textposition": "outside", "cliponaxis": False,
        "showlegend": False,
        "hovertext": [f"{escape(one)}: {escape(said)}" for one, said in zip(names, told, strict=True)][::-1],
        "hoverinfo": "text",
    }  # fmt: skip
    shapes = ["/" if one else "" for one in hatched or [False] * len(names)][::-1]
    colours = {theme: colour_on(look(1).colour, palette) for theme, palette in PALETTES.items()}
    return {
        "name": name, "words": words, "note": note, "table": rows, "data": [trace],
        "narrow": [{"text": [escape(one.partition(" (")[0]) for one in told][::-1]}],
        "styles": {theme: [{"marker": {"color": one, "pattern": {"shape": shapes}}}] for theme, one in colours.items()},
        "layouts": {
            theme: {
                width: layout(
                    palette, title=escape(title), height=130 + 26 * len(names),
                    xaxis={"title": {"text": escape(below)}} | _range(values, logarithmic=logarithmic, room=room),
                    yaxis={"tickvals": list(range(len(names))), "ticktext": [_cut(one, letters) for one in names],
                           "range": [len(names) - 0.5, -0.5], "zeroline": False, "showgrid": False},
                )
                for width, room, letters in (("wide", 0.45, 46), ("narrow", 0.7, 22))
            }
            for theme, palette in PALETTES.items()
        },
    }  # fmt: skip


def _range(values: Sequence[float], *, logarithmic: bool, room: float) -> dict[str, Any]:
    """Of the axis of bars, with so much room for the words beside them."""
    if logarithmic:
        ticks = {"tickvals": [1e-6, 1e-4, 1e-2, 1], "ticktext": ["10<sup>−6</sup>", "10<sup>−4</sup>", "0.01", "1"]}
        return ticks | {"type": "log", "range": [-6, 4 * room]}
    most = (1 + room) * (max((abs(value) for value in values), default=1.0) or 1.0)
    return {"range": [-most * any(v < 0 for v in values), most * (any(v >= 0 for v in values) or 0.1)]}


def _cut(text: str, most: int) -> str:
    return escape(text if len(text) <= most else f"{text[: most - 1]}…")
