"""Figures of the main study: growth rate and speeds of wobble, causes of changes, damping, critical speeds."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.patches import Patch

from bicycle.stability.critical import CrossingIdentity
from studies.main_study.compare import Change
from studies.main_study.result import COMPARED, WEAVE, WOBBLE, Result
from studies.main_study.samples import growth_speeds
from studies.main_study.settings import HANDS, LIMITS, Setup, plain_name
from studies.main_study.study import Study
from studies.motion.amplitude import draw_trace, finish_amplitude
from studies.reporting import plotting
from studies.reporting.plotting import UNSTABLE, look, mode_look

EDGES = {word: CrossingIdentity(WOBBLE, destabilising=word == "onset") for word in ("onset", "end")}
SPREAD = "± one standard uncertainty of tyre and bicycle"
SMALL = {"fontsize": 8.5, "va": "center"}


def drawings(study: Study, folder: Path) -> list[Callable[[Study], None]]:
    """List the figures of a ``study`` for ``folder``, each to be called with it; causes if there are two pressures."""
    draws = {"headline": draw_headline, "damping_ratio": draw_damping, "critical_speeds": draw_critical_speeds}
    if study.decompositions:
        draws["causes"] = draw_causes
    if study.has_cycles:
        draws["amplitude"] = draw_amplitude
    return [partial(draw, target=folder / name) for name, draw in draws.items()]


def _title(canvas: Any, study: Study, text: str, results: Sequence[Result]) -> None:
    note = "; hatched: tyre values extrapolated" if any(r.case.extrapolated for r in results) else ""
    bicycle = plain_name(study.settings.bicycle)
    if bicycle.startswith(("a ", "the ")):  # a phrase; the name of a file stays as it is
        bicycle = bicycle[0].upper() + bicycle[1:]
    canvas.suptitle(f"{bicycle}{text}{note}", x=0.01, ha="left", fontsize=10)


def _hatch_row(axes: Any, height: float, *, extrapolated: bool) -> None:
    if extrapolated:
        axes.axhspan(height - 0.5, height + 0.5, facecolor="none", linewidth=0, zorder=0, **plotting.EXTRAPOLATED)


def draw_headline(study: Study, target: Path) -> None:
    """Draw growth rate of wobble and weave over speed, a colour per pressure, and below the unstable speeds by case."""
    with plotting.drawing(target, width=8.0, height=7.0) as canvas:
        growth, bars = canvas.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": (2.2, 1.3)})
        _draw_growth(growth, study)
        _draw_cases(bars, study)
        _title(canvas, study, f" on {study.names[0]}", study.results_of(study.settings.reference, study.names[0]))


def _draw_growth(axes: Any, study: Study) -> None:
    """Draw the reference case: one line per pressure, samples at the lowest one as a pale band."""
    reference, lowest, highest = study.settings.reference, -2.0, 1.0
    outer = study.samples_around(study.result(reference, study.subject[0]))
    bands = []
    if outer and outer.count:
        low, high = np.nanquantile(outer.growth[outer.computed], LIMITS.likely, axis=0)
        likely = LIMITS.likely[1] - LIMITS.likely[0]
        band = axes.fill_between(
            growth_speeds(study.settings),
            low,
            high,
            color=look(0).colour,
            alpha=0.15,
            linewidth=0,
            label=f"wobble of {100 * likely:g} % of the samples, {outer.case.condition}",
        )
        bands.append(band)
        highest = max(highest, float(np.nanmax(high)))
    handles: list[Any] = []
    for number, result in enumerate(study.results_of(reference, study.names[0])):
        at, colour = result.modes.speeds[:-1], look(number).colour
        for mode, line in ((WOBBLE, "-"), (WEAVE, (0, (4, 2)))):
            if mode in result.modes.branches:
                root = result.modes.branches[mode][:-1, 0]
                real = np.where((root.imag > 0) & (at >= 1.0), root.real, np.nan)
                axes.plot(at, real, color=colour, linestyle=line)
                if np.isfinite(real).any():
                    lowest, highest = min(lowest, float(np.nanmin(real))), max(highest, float(np.nanmax(real)))
        handles += axes.plot([], [], color=colour, linewidth=4, label=_name_condition(result))
    handles += axes.plot([], [], color="0.3", label="wobble")
    handles += axes.plot([], [], color="0.3", linestyle=(0, (4, 2)), label="weave")
    lowest = max(lowest, LIMITS.slowest)
    unstable = axes.axhspan(0, 2 * highest, color=UNSTABLE, zorder=0, label="unstable")
    axes.axhline(0, color="0.2", linewidth=0.8)
    threshold = axes.axhline(
        LIMITS.growth, color="0.2", linewidth=0.8, linestyle=":", label=f"wobble from {LIMITS.growth:g} 1/s"
    )
    axes.set(xlim=(1.0, study.settings.fastest), ylim=(1.06 * lowest, 1.15 * highest))
    axes.set_ylabel("Growth rate, 1/s")
    axes.set_title(f"Growth rate of wobble and weave, {case_words(reference)}", fontsize=9)
    axes.secondary_xaxis("top", functions=(lambda v: 3.6 * v, lambda v: v / 3.6)).set_xlabel("Speed, km/h")
    handles += [*bands, unstable, threshold]
    axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.45, -0.04), ncols=3, fontsize=8)


def _name_condition(result: Result) -> str:
    """Name the pressure of a result with the relaxation length of its front tyre."""
    return f"{result.case.condition}, σ = {1e3 * result.case.contact[3]:.0f} mm"


def case_words(setup: Setup) -> str:
    """Name a case, with "(assumed)" after hands or front frame that were not measured."""
    hands = HANDS[setup.hands] + (" (assumed)" if setup.hands_assumed else "")
    return f"{hands}, {setup.front_name} front frame" + (" (assumed)" if setup.assumed else "")


def _draw_cases(axes: Any, study: Study) -> None:
    """Draw bars over the speeds of wobble, a row per case, with the lowest and the highest pressure."""
    limit, ends = study.settings.fastest, (study.subject[0], study.subject[-1])
    cases = list(dict.fromkeys(ends))
    for row, setup in enumerate(study.settings.setups):
        results = [study.result(setup, case) for case in cases]
        _hatch_row(axes, row, extrapolated=cases[0].extrapolated)
        if all(result and not result.wobble for result in results):
            words = "no wobble" + _name_wobbling_share(study, results)
            axes.text(1.3, row, words, fontsize=8, va="center", color="0.3", style="italic")
            continue
        for k, (case, result) in enumerate(zip(cases, results, strict=True)):
            height = row + 0.36 * (k - (len(cases) - 1) / 2)
            colour = look(study.subject.index(case)).colour
            span = result.wobble if result else None
            if span:
                axes.barh(height, min(span.high, limit) - span.low, left=span.low, height=0.32, color=colour)
            else:
                words = f"no wobble, {case.condition}" if result else "not computed"
                axes.text(1.3, height, words, fontsize=7.5, va="center", color=colour, style="italic")
    setups = study.settings.setups
    axes.set_yticks(range(len(setups)), [case_words(setup).replace(", ", ",\n") for setup in setups], fontsize=8)
    axes.set(ylim=(len(setups) - 0.5, -0.5), xlabel="Speed, m/s")
    axes.set_title("Speeds of wobble, by case", fontsize=9)
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0)


def _name_wobbling_share(study: Study, results: Sequence[Result | None]) -> str:
    """Share of the samples that wobble of a case that does not, by pressure, as words; empty without samples."""
    samples = [study.samples_around(result) for result in results]
    shares = [
        f"{sample.wobbling_share:.0%} at {sample.case.condition}" for sample in samples if sample and sample.count
    ]
    return f"; samples that wobble: {', '.join(shares).replace('%', ' %')}" if shares else ""


def draw_amplitude(study: Study, target: Path) -> None:
    """Draw the steer amplitude of wobble over speed, a colour per pressure, with a band over typical peak factors."""
    with plotting.drawing(target, width=7.0, height=4.4) as canvas:
        axes = canvas.add_subplot()
        conditions = [case.condition for case in study.subject]  # not the cases, of which workers give copies
        for amplitude in study.amplitudes:
            condition = amplitude.case.condition
            colour = look(conditions.index(condition)).colour
            for trace in amplitude.traces:
                if WOBBLE in trace.mode.split("+"):
                    draw_trace(axes, trace, colour, amplitude.peak_factor)
            axes.plot([], [], color=colour, linewidth=4, label=condition)
        finish_amplitude(axes)
        axes.set(xlim=(0, study.settings.fastest), xlabel="Speed, m/s")
        axes.set_title(f"Steer amplitude of wobble, {case_words(study.settings.reference)}", fontsize=9)
        _title(canvas, study, f" on {study.names[0]}", study.results_of(study.settings.reference, study.names[0]))


def draw_causes(study: Study, target: Path) -> None:
    """Draw how lower pressure changes onset and end of unstable wobble in the reference case, and by what."""
    with plotting.drawing(target, width=7.0, height=1.9 + 0.9 * len(study.names)) as canvas:
        _draw_parts(canvas.add_subplot(), study, study.settings.reference)
        _title(canvas, study, f", {case_words(study.settings.reference)}", study.results_of(study.settings.reference))


def _draw_parts(axes: Any, study: Study, setup: Setup) -> None:
    """Draw stacked bars: change of onset and end at the lower pressure, by cause."""
    height = 0.0
    ticks = {}
    ends = [-0.5, 0.5]  # m/s, of all bars
    pressures = set()
    for number, name in enumerate(study.names):
        decomposition = study.decomposition(setup, name)
        axes.text(0.02, height - 0.72, name, fontweight="bold", va="center", transform=axes.get_yaxis_transform())
        for label, edge in EDGES.items():
            change = decomposition.change(edge) if decomposition else None
            ticks[height] = label
            if decomposition and change:
                higher, lower = decomposition.higher, decomposition.lower
                _hatch_row(axes, height, extrapolated=higher.extrapolated or lower.extrapolated)
                ends += _stack(axes, change, height, look(number).colour)
                pressures.add(f"{higher.condition} to {lower.condition}")
            else:
                axes.text(
                    0.5,
                    height,
                    "not at both pressures",
                    ha="center",
                    color="0.35",
                    style="italic",
                    transform=axes.get_yaxis_transform(),
                    **SMALL,
                )
            height += 1
        height += 1.4
    axes.axvline(0, color="0.2", linewidth=1)
    axes.set_yticks(list(ticks), list(ticks.values()))
    low, high = min(ends), max(ends)
    margin = 0.16 * (high - low)
    axes.set(xlim=(low - margin, high + margin), ylim=(height - 1.8, -1.2), xlabel="Change of speed, m/s")
    axes.grid(visible=False, axis="y")
    axes.tick_params(axis="y", length=0)
    axes.set_title(f"Change of onset and end of unstable wobble, {' and '.join(sorted(pressures))}", fontsize=9)
    names = ("relaxation length", "cornering stiffness", "interaction")
    handles = [Patch(label=part, **style) for part, style in zip(names, _part_styles("0.35"), strict=True)]
    axes.figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=8, columnspacing=1)


def _stack(axes: Any, change: Change, height: float, colour: str) -> list[float]:
    """Draw one stacked bar and the total; return how far it reaches to both sides, m/s."""
    ends = {True: 0.0, False: 0.0}
    values = (change.length_part, change.stiffness_part, change.interaction)
    for value, style in zip(values, _part_styles(colour), strict=True):
        axes.barh(height, value, left=ends[value > 0], height=0.62, **style)
        ends[value > 0] += value
    side = change.total > 0
    axes.annotate(
        f"{change.total:+.1f}",
        (ends[side], height),
        (4 if side else -4, 0),
        textcoords="offset points",
        ha="left" if side else "right",
        **SMALL,
    )
    return list(ends.values())


def _part_styles(colour: str) -> list[dict[str, Any]]:
    """Style the bars of length, stiffness and interaction, unlike each other in print too: full, dotted, grey."""
    return [
        {"facecolor": colour, "edgecolor": colour, "linewidth": 0.8},
        {"facecolor": "white", "edgecolor": colour, "linewidth": 1.0, "hatch": "...."},
        {"facecolor": "0.75", "edgecolor": "0.5", "linewidth": 0.8},
    ]


def draw_damping(study: Study, target: Path) -> None:
    """Draw damping ratios of the tyre in question against pressure, a column per case; bands: standard uncertainty."""
    setups, name = study.settings.setups, study.names[0]
    with plotting.drawing(target, width=11.0, height=5.6) as canvas:
        grid = canvas.subplots(len(COMPARED), len(setups), sharex=True, sharey="row", squeeze=False)
        for row, mode in zip(grid, COMPARED, strict=True):
            for axes, setup in zip(row, setups, strict=True):
                results = [r for r in study.results_of(setup, name) if mode in r.damping and r.case.pressures_bar]
                if results:
                    _draw_ratios(axes, results, mode)
                plotting.hatch_extrapolated(axes, extrapolated=any(r.case.extrapolated for r in results))
            low, high = row[0].get_ylim()
            for axes in row:
                if low < 0:
                    axes.axhspan(low, min(0.0, high), color=UNSTABLE, zorder=0)
                axes.set_ylim(low, high)
            row[0].set_ylabel(f"{mode.capitalize()} damping ratio")
        for axes, setup in zip(grid[0], setups, strict=True):
            words = case_words(setup).replace(", ", ",\n").replace(" (assumed)", "\n(assumed)")
            axes.set_title(words, fontsize=8.5)
        for axes in grid[-1]:
            axes.set_xlabel("Inflation pressure, bar")
            axes.set_xticks(sorted({case.pressure_bar for case in study.subject if case.pressures_bar}))
        text = (
            f" on {name}: damping ratio at {study.settings.report_speed:g} m/s\n"
            f"bands: {SPREAD} (darker: of the tyre data alone); shaded: unstable"
        )
        _title(canvas, study, text, study.results_of(study.settings.reference, name))


def _draw_ratios(axes: Any, results: list[Result], mode: str) -> None:
    """Draw damping ratio over pressure (bar), with a band for its sd and one for that of the tyre, if it differs."""
    pressures = [r.case.pressure_bar for r in results]
    ratios = [r.damping[mode] for r in results]
    values = np.array([ratio.value for ratio in ratios])
    style = look(0)
    sds = [[ratio.sd for ratio in ratios], [ratio.tyre_sd for ratio in ratios]]
    for sd in sds if sds[0] != sds[1] else sds[:1]:
        axes.fill_between(pressures, values - sd, values + sd, color=style.colour, alpha=0.2, linewidth=0)
    axes.plot(pressures, values, **style.plot)


def draw_critical_speeds(study: Study, target: Path) -> None:
    """Draw a panel per case, a row per pressure; filled: becomes unstable, hollow: stable."""
    setups, rows, name = study.settings.setups, study.subject, study.names[0]
    all_results = [r for setup in setups for r in study.results_of(setup, name)]
    crossed = list(dict.fromkeys(c.mode for r in all_results for c in r.crossings))
    heights = dict(zip(crossed, np.linspace(-0.28, 0.28, len(crossed)), strict=True))  # modes lie one above the other
    with plotting.drawing(target, width=8.5, height=2.2 + 0.34 * len(rows) * len(setups)) as canvas:
        grid = canvas.subplots(len(setups), 1, sharex=True, sharey=True, squeeze=False).ravel()
        for axes, setup in zip(grid, setups, strict=True):
            for row, result in enumerate(study.result(setup, case) for case in rows):
                if result:
                    _draw_crossings(axes, result, row, heights)
            axes.grid(visible=False, axis="y")
            axes.set_title(case_words(setup), fontsize=9)
            axes.set_xlim(0, study.settings.max_speed)
        grid[0].set_yticks(np.arange(len(rows)), [case.condition for case in rows])
        grid[0].set_ylim(len(rows) - 0.4, -0.6)
        grid[-1].set_xlabel("Speed, m/s")
        handles: dict[str, Any] = {}
        for mode in crossed:
            style = {"linestyle": "none", "color": mode_look(mode).colour, **plotting.mode_marker(mode)}
            (handles[plotting.mode_words(mode)],) = grid[0].plot([], [], **style)
        for words, face in (
            ("filled: becomes unstable with increasing speed", "0.3"),
            ("hollow: becomes stable", "none"),
        ):
            (handles[words],) = grid[0].plot([], [], "o", color="0.3", markerfacecolor=face)
        ncols = plotting.legend_columns(list(handles), width=8.5)
        canvas.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=ncols)
        text = f" on {name}: critical speeds\nbars: {SPREAD} (thick: of the tyre data alone)"
        _title(canvas, study, text, study.results_of(study.settings.reference, name))


def _draw_crossings(axes: Any, result: Result, row: int, heights: dict[str, float]) -> None:
    """Draw the critical speeds of one case in its row, with bars of one sd; ``heights`` shift modes within the row."""
    _hatch_row(axes, row, extrapolated=result.case.extrapolated)
    axes.axhline(row + 0.5, color="0.88", linewidth=0.6, zorder=0)
    for c in result.crossings:
        style = {"linestyle": "none", "color": mode_look(c.mode).colour}
        marker = plotting.mode_marker(c.mode) | ({} if c.destabilising else {"markerfacecolor": "white"})
        if c.tyre_sd != c.sd:
            axes.errorbar(c.speed, row + heights[c.mode], xerr=c.tyre_sd, elinewidth=3.5, alpha=0.6, **style)
        axes.errorbar(c.speed, row + heights[c.mode], xerr=c.sd, elinewidth=1.2, **style, **marker)
