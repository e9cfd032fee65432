"""Redraws of the paper's Fig. 1, 5-6 and 9-14 from its tables (Dell'Orto, Ballo, Mastinu & Gobbi)."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from studies.reporting import plotting
from studies.reporting.plotting import look
from tyre import TyreMap

TABLES = {  # tyre, surface -> the paper's tables of cornering stiffness and relaxation length
    ("Tyre1", "flat"): (2, 6), ("Tyre1", "drum"): (3, 7), ("Tyre2", "flat"): (4, 8), ("Tyre3", "flat"): (5, 9),
}  # fmt: skip
TYRE1, TYRE1_DRUM, TYRE2, TYRE3 = TABLES
LABELS = {
    "cornering_stiffness_N_per_deg": "Cornering stiffness C_Fy, N/deg",
    "lateral_stiffness_N_per_mm": "Lateral stiffness K_y, N/mm",
    "relaxation_length_mm": "Relaxation length, mm",
}
CORNERING, LATERAL, RELAXATION = LABELS
NOTES = {
    CORNERING: "no uncertainty is stated",
    LATERAL: "cornering stiffness over relaxation length; bars: the paper's 3 mm of relaxation length, read as one "
    "standard deviation",
    RELAXATION: "bars: the paper's 3 mm of relaxation length, read as one standard deviation",
}


@dataclass(frozen=True)
class PaperFigure:
    """One figure of the paper: a column of the tables over load for two tyres or surfaces."""

    number: int
    quantity: str
    series: tuple[tuple[str, str], tuple[str, str]]
    title: str

    @property
    def tables(self) -> list[int]:
        """Tables it is redrawn from."""
        used = {CORNERING: (0,), LATERAL: (0, 1), RELAXATION: (1,)}[self.quantity]
        return sorted(TABLES[key][column] for key in self.series for column in used)


FIGURES = (
    PaperFigure(5, LATERAL, (TYRE1, TYRE2), "Lateral stiffness, two brands, 26 mm"),
    PaperFigure(6, LATERAL, (TYRE2, TYRE3), "Lateral stiffness, 26 mm and 28 mm"),
    PaperFigure(9, CORNERING, (TYRE1, TYRE1_DRUM), "Cornering stiffness, flat track and drum"),
    PaperFigure(10, CORNERING, (TYRE1, TYRE2), "Cornering stiffness, two brands, 26 mm"),
    PaperFigure(11, CORNERING, (TYRE2, TYRE3), "Cornering stiffness, 26 mm and 28 mm"),
    PaperFigure(12, RELAXATION, (TYRE1, TYRE1_DRUM), "Relaxation length, flat track and drum"),
    PaperFigure(13, RELAXATION, (TYRE1, TYRE2), "Relaxation length, two brands, 26 mm"),
    PaperFigure(14, RELAXATION, (TYRE2, TYRE3), "Relaxation length, 26 mm and 28 mm"),
)


def draw_paper_figures(folder: Path) -> list[Path]:
    """Draw every redraw into ``folder``; return their files without ending."""
    stems = [folder / f"paper_fig{number:02d}" for number in (1, *(figure.number for figure in FIGURES))]
    return [draw_paper_figure(stem) for stem in stems]


def draw_paper_figure(target: Path) -> Path:
    """Draw one redraw, by the number at the end of the name ``target``."""
    figure = {one.number: one for one in FIGURES}.get(int(target.name[-2:]))
    with plotting.drawing(target, width=6.4, height=4.0) as canvas:
        if figure is None:
            _draw_step_response(canvas)
        else:
            _draw_over_load(canvas, figure)
    return target


def _draw_over_load(canvas: Any, figure: PaperFigure) -> None:
    """Draw a quantity over load, a line per tyre and pressure; the second tyre 2 N to the right for its bars."""
    axes = canvas.add_subplot()
    sd_column = figure.quantity.replace("stiffness_", "stiffness_sd_").replace("length_", "length_sd_")
    for which, (tyre, surface) in enumerate(figure.series):
        table = TyreMap.load(tyre, surface=surface).table
        for number, (bar, rows) in enumerate(table.groupby("pressure_bar")):
            style, sd = look((0, 2, 3)[number % 3]), rows[sd_column]
            axes.errorbar(
                rows["load_N"] + 2.0 * which, rows[figure.quantity], yerr=sd if (sd > 0).any() else None,
                color=style.colour, marker=style.marker, linestyle=("-", (0, (4, 2)))[which],
                markerfacecolor=(style.colour, "white")[which], capsize=2, elinewidth=0.9,
                label=f"{tyre} {surface}, {bar:g} bar",
            )  # fmt: skip
    axes.set(xlabel="Vertical load, N (dashed lines drawn 2 N to the right)", ylabel=LABELS[figure.quantity])
    axes.set_title(figure.title)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    _source(canvas, figure.number, figure.tables, NOTES[figure.quantity])


def _draw_step_response(canvas: Any, load: float = 400.0, pressure_bar: float = 5.5, speed: float = 9.3 / 3.6) -> None:
    """Draw the side force after a slip step: F/F_steady = 1 - exp(-v t / relaxation length), at the paper's speed."""
    axes = canvas.add_subplot()
    flat = [key for key in TABLES if key[1] == "flat"]
    time, share = np.linspace(0, 0.2, 201), 1 - np.exp(-1)
    for which, (tyre, surface) in enumerate(flat):
        table = TyreMap.load(tyre, surface=surface).table
        row = table[(table["load_N"] == load) & (table["pressure_bar"] == pressure_bar)]
        length = float(row["relaxation_length_mm"].iloc[0]) / 1e3
        style = look((0, 2, 3)[which])
        axes.plot(1e3 * time, 1 - np.exp(-speed * time / length), color=style.colour, linestyle=style.line,
                  label=f"{tyre}, {1e3 * length:.1f} mm")  # fmt: skip
        axes.plot(1e3 * length / speed, share, style.marker, color=style.colour)
    axes.axhline(share, color="0.4", linewidth=0.8)
    axes.annotate("63 %", (200, share), (0, 3), textcoords="offset points", ha="right")
    axes.set(xlabel=f"Time after the slip step at {speed * 3.6:.1f} km/h, ms", xlim=(0, 200), ylim=(0, 1.02))
    axes.set_ylabel("Side force / steady value")
    axes.set_title("Step response of the three tyres")
    axes.legend(title=f"relaxation length at {load:g} N, {pressure_bar:g} bar", loc="lower right")
    _source(canvas, 1, [TABLES[key][1] for key in flat], "marks: one relaxation length travelled")


def _source(canvas: Any, number: int, tables: Sequence[int], note: str) -> None:
    *most, last = (str(table) for table in tables)
    listed = f"{', '.join(most)} and {last}" if most else last
    canvas.supxlabel(
        f"Redrawn from Tables {listed} of Dell'Orto, Ballo, Mastinu & Gobbi, after their Fig. {number};\n{note}.",
        fontsize=7.5, color="0.3", x=0.01, ha="left",
    )  # fmt: skip
