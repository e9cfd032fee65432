"""How series look on the page: the looks of all figures of the house, in words of plotly, on light and dark."""

import colorsys
from dataclasses import dataclass
from typing import Any

from bicycle.modal.looks import Look, mode_look

MARKERS = {
    "o": "circle", "s": "square", "^": "triangle-up", "D": "diamond", "v": "triangle-down", "P": "cross", "X": "x",
    "*": "star", "H": "hexagon", "h": "hexagon2", "<": "triangle-left", ">": "triangle-right", "8": "octagon",
    "p": "pentagon", "d": "diamond-tall",
}  # fmt: skip
LINE_WIDTH = 2.0  # pixels; the house's lines are counted in widths
LEAST_LIGHTNESS = 0.62  # of a colour on dark ground


HEIGHTS = {"modes": 580, "critical": 240, "locus": 460, "damping": 400, "sensitivity": 520, "chart": 520}
"""Of the figures, pixels."""


@dataclass(frozen=True)
class Palette:
    """Colours of the page around the series.

    Attributes
    ----------
    dark : bool
    text, grid, line, unstable : str
        Of letters, grid lines, lines that stand out, and what is unstable.
    """

    dark: bool
    text: str
    grid: str
    line: str
    unstable: str


LIGHT = Palette(False, "#1b1f24", "#dfe3e8", "#57606a", "rgba(200,70,47,0.13)")
DARK = Palette(True, "#e6e9ed", "#3a414b", "#aab2bd", "rgba(240,120,95,0.20)")
PALETTES = {"light": LIGHT, "dark": DARK}


def colour_on(colour: str, palette: Palette) -> str:
    """A colour of the house that can be seen on the ground of a palette.

    Parameters
    ----------
    colour : str
        ``#rrggbb``.
    palette : Palette
    """
    if not palette.dark:
        return colour
    red, green, blue = (int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
    hue, lightness, saturation = colorsys.rgb_to_hls(red, green, blue)
    lighter = colorsys.hls_to_rgb(hue, max(lightness, LEAST_LIGHTNESS), saturation)
    return "#" + "".join(f"{round(255 * part):02x}" for part in lighter)


def dashes(look: Look) -> str:
    """The dashes of a look as plotly writes them.

    Parameters
    ----------
    look : Look
    """
    if isinstance(look.line, str):
        return "solid"
    return ",".join(f"{LINE_WIDTH * length:g}px" for length in look.line[1])


def series(mode: str, palette: Palette, *, pinned: bool = False) -> dict[str, Any]:
    """Line and marker of a mode, as keywords of a plotly trace.

    Parameters
    ----------
    mode : str
    palette : Palette
    pinned : bool, optional
        Drawn thin and pale, to be compared with.
    """
    look = mode_look(mode)
    colour = colour_on(look.colour, palette)
    return {
        "line": {"color": colour, "dash": dashes(look), "width": 1.2 if pinned else LINE_WIDTH},
        "marker": {"color": colour, "symbol": MARKERS.get(look.marker, "circle"), "size": 7},
        "opacity": 0.55 if pinned else 1.0,
    }


def layout(palette: Palette, *, title: str, height: int, below: str = "", **more: Any) -> dict[str, Any]:
    """What the figures have in common.

    Parameters
    ----------
    palette : Palette
    title : str
        Words above the figure, for its picture; plotly's marks in it are escaped by who gives them.
    height : int
        Pixels (no SI unit).
    below : str, optional
        A second line, in smaller letters.
    more : object
        Further keys of a plotly layout, in its units.
    """
    axis: dict[str, Any] = {
        "gridcolor": palette.grid,
        "zerolinecolor": palette.line,
        "linecolor": palette.grid,
        "automargin": True,
    }
    found: dict[str, Any] = {
        "height": height, "paper_bgcolor": "rgba(0,0,0,0)", "plot_bgcolor": "rgba(0,0,0,0)",
        "font": {"color": palette.text, "size": 13, "family": "system-ui, sans-serif"},
        "title": {
            "text": title, "font": {"size": 14}, "x": 0, "xref": "container", "y": 0.985, "yref": "container",
            "yanchor": "top", "pad": {"l": 8, "t": 6},
            **({"subtitle": {"text": below, "font": {"size": 12}}} if below else {}),
        },
        "margin": {"l": 60, "r": 12, "t": 72 if below else 48, "b": 48}, "uirevision": "same",
        "hoverlabel": {"font": {"size": 13}},
        "legend": {"orientation": "h", "y": -0.19, "yanchor": "top", "x": 0},
    } | more  # fmt: skip
    for key in [key for key in found if key.startswith(("xaxis", "yaxis"))]:
        found[key] = axis | found[key]
    return found
