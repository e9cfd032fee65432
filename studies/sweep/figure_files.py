"""Files of the figures of a sweep: titles, tables of their numbers, and the reasons for those not drawn."""

import re
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from studies.reporting.markdown_text import render_file
from studies.reporting.output import write_csv
from studies.sweep.stored import Stored
from tyre.ground.arrays import Array

BLUE = "#123a6b"
MOST_LINES = 6  # combinations of the grid with a line of their own
LEVELS: tuple[float, ...] = (0.05, 0.25, 0.5, 0.75, 0.95)  # quantiles of a figure, shares of the bicycles


@dataclass
class Drawn:
    """Figures of a result so far: each that is drawn is added."""

    stored: Stored  # the result that is drawn
    folder: Path  # into which figures and their tables are written
    figures: dict[str, str]  # name of a figure's files, without ending -> its title
    lacking: dict[str, Any]  # what was not drawn, by the keys of ``templates/remarks.txt.j2``

    @property
    def remarks(self) -> list[str]:
        """Lines on what was not drawn and why, and on bicycles that are impossible or extrapolated."""
        return render_file("studies.sweep", "remarks.txt.j2", vars(self), escaped=False).splitlines()

    def title(self, canvas: Any, name: str, text: str, width: float) -> None:
        """Write the title of figure ``name`` in lines of ``width`` inches, with what is true of all figures."""
        self.figures[name] = text
        if self.stored.extrapolated:
            text += f"\nTyre values extrapolated: {self.stored.extrapolated} of {self.stored.number}"
        lines = [wrap_lines(line, int(width / 0.083)) for line in text.splitlines()]
        canvas.suptitle("\n".join(lines), x=0.01, ha="left", fontsize=9.5)

    def table(self, name: str, rows: Any) -> None:
        """Write the numbers of a figure: a table, a list of rows or tables, or a dict of columns."""
        tables = isinstance(rows, list) and rows and isinstance(rows[0], pd.DataFrame)
        write_csv(pd.concat(rows) if tables else pd.DataFrame(rows), self.folder / f"{name}.csv")


def wrap_lines(text: str, width: int) -> str:
    """Text in lines of at most ``width`` letters, names of parameters broken at their dots only."""
    spaced = re.sub(r"\.(?=[a-z])", ".\t", text)  # a tab is where a name may be broken
    lines = textwrap.wrap(spaced, width, break_long_words=False, expand_tabs=False, replace_whitespace=False)
    return "\n".join(line.replace("\t", "") for line in lines)


def quantiles_of(values: Array, levels: Sequence[float]) -> Array:
    """Quantiles (levels, k) of the finite ones of values (m, k); NaN where there is none."""
    return pd.DataFrame(np.where(np.isfinite(values), values, np.nan)).quantile(list(levels)).to_numpy()
