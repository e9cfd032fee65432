"""What the page shows of fits of free decays: the roots first, then measured channels, fit and drift."""

from typing import Any

import numpy as np

from bicycle.eigenvalues.oscillation import frequency_hz
from studies.explorer.recording.panels import MEASURED, Curve, Panel, entry
from studies.free_decays.figure import ASIDE, WORDS
from studies.free_decays.words import with_sd
from studies.look.figure import thinned

MOST_FITS = 12  # that are drawn


def fit_shown(found: tuple[Any, Any]) -> dict[str, Any]:
    """What the page shows of fits.

    Parameters
    ----------
    found : tuple, shape (2,)
        Runs with their decays, and every decay as it was judged.
    """
    fitted, judged = found
    used = [each for each in judged if not each.rejected]
    said = [
        f"{each.mode} at {each.decay.speed:g} m/s: {with_sd(each.decay.eigenvalue.real, each.decay.sd[0])} 1/s, "
        f"{with_sd(each.decay.eigenvalue.imag, each.decay.sd[1])} rad/s (1 sd)"
        for each in used
    ]  # fmt: skip
    many = f"{len(used)} of {len(judged)} fits can be used. " if len(judged) > 1 else ""
    sentence = f"{many}{'; '.join(said[:3])}{'; and more below' if len(said) > 3 else ''}." if used else (
        "No fit can be used: " + "; ".join(dict.fromkeys(each.rejected for each in judged)) + "."
    )  # fmt: skip
    rows = [_root(each) for each in judged]
    interval = ["sd", "95 % from", "to"]
    columns = ["run", "mode", "speed m/s", "real 1/s", *interval, "imaginary rad/s", *interval]
    columns += ["frequency Hz", "cycles", "R²", "judgement"]
    drawn = [one for one in fitted if one[1][0][1].estimate is not None]
    return {
        "sentence": sentence,
        "figures": [_decay(k, *one) for k, one in enumerate(drawn[:MOST_FITS], 1)],
        "tables": [{"words": "Roots and intervals", "columns": columns, "rows": rows}],
    }


def _root(each: Any) -> list[Any]:
    d = each.decay
    z, sd = d.eigenvalue, d.sd
    cells = [d.run, each.mode, d.speed]
    for value, one in ((z.real, sd[0]), (z.imag, sd[1])):
        cells += [value, one, value - 1.96 * one, value + 1.96 * one]
    cells += [float(frequency_hz(z)), d.cycles, d.r_squared, each.rejected or "can be used"]
    return [None if isinstance(cell, float) and not np.isfinite(cell) else cell for cell in cells]


def _decay(number: int, run: Any, decays: Any) -> dict[str, Any]:
    """Measured channels, fit and drift of one run, and its window."""
    first = decays[0][1]
    w, (fit, drift) = first.estimate.window, first.estimate.curves()
    time = run.time - run.time[0]
    begin, end = w.start, w.start + w.length + (w.block - 1) * run.step
    near = (time >= begin - ASIDE * w.length) & (time <= end + ASIDE * w.length)
    at = (w.start + (w.block - 1) * run.step / 2 + w.time).tolist()
    panels = []
    for place, name in enumerate(w.channels):
        shown = thinned(time[near], run.channels[name][near])
        words = WORDS[name]
        curves = [
            Curve("measured", MEASURED, shown[0].tolist(), shown[1].tolist(), "markers"),
            Curve("fit", 0, at, (w.scale[place] * fit[:, place]).tolist()),
            Curve(f"drift ({first.drift})", 2, at, (w.scale[place] * drift[:, place]).tolist()),
        ]
        panels.append(
            Panel(words.partition(" in ")[0], "time after the first sample, s", words, curves, [(begin, end)])
        )
    title = f"{run.name} at {run.speed:g} m/s: {', '.join(mode for mode, _ in decays)}"
    return entry(f"fit-{number}", f"Fit of {run.name}", title, panels, columns=1, note="Shaded: the window of the fit.")
