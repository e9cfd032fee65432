"""What a person reads of the forces of a ride: table of the largest, sentences, figure."""

from pathlib import Path
from typing import Any

import numpy as np

from studies.rides.estimate import LINEAR_SHARE, TRUSTED, WHEELS, RideForces
from studies.rides.forces import SegmentForces
from tyre.ground.arrays import Array
from tyre.ground.number_with_sd import with_sd

LARGEST = 3  # rows a wheel
APART = 5.0  # s between two of the largest
AROUND = 10.0  # s shown before and after the largest
NORMAL_95 = 1.96  # sd within which 95 % lie
COLOURS = ("#123a6b", "#c8462f")  # rear, front
HEADERS = ("wheel", "segment", "time s", "lateral force N", "slip angle deg", "share of grip")


def largest_rows(forces: RideForces) -> list[list[str]]:
    """Rows of a table: the largest forces of each wheel, at least 5 s apart."""
    rows = []
    for wheel, name in enumerate(WHEELS):
        for segment, place in _largest(forces, wheel):
            slip, slip_sd = np.degrees(segment.slip[wheel, place]), np.degrees(segment.slip_sd[wheel, place])
            share, share_sd = forces.share(segment)[wheel, place], forces.share_sd(segment)[wheel, place]
            rows.append(
                [
                    name,
                    segment.name,
                    f"{segment.time[place]:.2f}",
                    with_sd(segment.force[wheel, place], segment.force_sd[wheel, place], places=0),
                    with_sd(slip, slip_sd, places=2),
                    f"{with_sd(100 * share, 100 * share_sd, places=0)} %",
                ]
            )
    return rows


def _largest(forces: RideForces, wheel: int) -> list[tuple[SegmentForces, int]]:
    """Segment and sample of the largest forces of a wheel."""
    peaks = []
    for segment in forces.segments:
        size = np.abs(segment.force[wheel])
        for _ in range(LARGEST):
            place = int(np.argmax(size))
            peaks.append((float(size[place]), segment, place))
            size = np.where(np.abs(segment.time - segment.time[place]) < APART, -1.0, size)
            if size.max() < 0:
                break
    ranked = sorted(peaks, key=lambda peak: -peak[0])[:LARGEST]
    return [(segment, place) for _, segment, place in ranked]


def segment_lines(forces: RideForces) -> list[str]:
    """A line for each segment: its name, speed and times."""
    return [f"{s.name}: {s.speed:.3g} m/s, {s.time[0]:.6g} to {s.time[-1]:.6g} s" for s in forces.segments]


def sentences(forces: RideForces) -> list[str]:
    """Sentences on loads, grip and trust, which belong to the table."""
    origin = "assumed" if forces.grip_assumed else "given"
    rear, front = forces.static_loads
    lines = [
        f"The share of the grip is over static loads of {rear:.0f} N rear and {front:.0f} N front; the grip of "
        f"{forces.grip:g} is {origin}."
    ]
    for wheel, share in zip(WHEELS, forces.nonlinear_shares, strict=True):
        if share > 0:
            lines.append(
                f"The {wheel} tyre is above {100 * LINEAR_SHARE:.0f} % of the grip in {100 * share:.2g} % of the time; "
                "the linear tyre no longer holds there."
            )
    lines.append(f"Chi^2 of the spectra and of shifted parameters is {forces.misfit:.2f} per number of the spectra.")
    if forces.widened > 1:
        lines.append(f"The bands are {forces.widened:.2f} times wider, by its root, because the model does not fit.")
    if forces.goodness < TRUSTED:
        lines.append(
            "This chi^2 is too large, so neither bands nor fitted parameters can be trusted. `velotyre diagnose` with "
            "kind ride_spectra searches for what is missing."
        )
    elif not forces.converged:
        lines.append(
            "The fit of the spectra did not converge, so the bands cannot be trusted; ride longer at one speed."
        )
    return lines


def narrowed_rows(forces: RideForces) -> list[list[str]]:
    """Rows of a table: parameters whose uncertainty the ride has narrowed; none where the model does not fit."""
    if forces.goodness < TRUSTED:
        return []
    return [
        [one.name, one.unit, with_sd(one.stated, one.stated_sd, places=0), with_sd(one.value, one.sd, places=0)]
        for one in forces.narrowed
    ]


def figure_of_forces(forces: RideForces, target: Path, *, synthetic: bool) -> None:
    """Draw forces and slip angles of both wheels around the largest force; ``target`` has no ending."""
    from studies.reporting.plotting import drawing

    segment, wheel, place = _largest_of_all(forces)
    middle, share = segment.time[place], 100 * forces.share(segment)[wheel, place]
    shown = np.abs(segment.time - middle) <= AROUND
    label = "SYNTHETIC ride " if synthetic else ""
    with drawing(target, width=8.0, height=7.6) as figure:
        panels = figure.subplots(4, 1, sharex=True)
        for k, name in enumerate(WHEELS):
            force, slip = panels[k], panels[2 + k]
            _draw_band(force, segment.time[shown], segment.force[k][shown], segment.force_sd[k][shown], k)
            degrees, degrees_sd = np.degrees(segment.slip[k][shown]), np.degrees(segment.slip_sd[k][shown])
            _draw_band(slip, segment.time[shown], degrees, degrees_sd, k)
            force.set(title=f"{name} wheel: lateral force, to the right positive", ylabel="force, N")
            slip.set(title=f"{name} wheel: slip angle", ylabel="slip angle, deg")
            _draw_linear_range(force, LINEAR_SHARE * forces.grip * forces.static_loads[k])
        for pair in (panels[:2], panels[2:]):
            reach = 1.1 * max(np.abs(panel.get_ylim()).max() for panel in pair)
            for panel in pair:
                panel.set_ylim(-reach, reach)
        panels[wheel].plot(middle, segment.force[wheel, place], "o", color="black", markersize=4)
        panels[wheel].annotate(
            f"{segment.force[wheel, place]:.0f} N, {share:.0f} % of the grip",
            (middle, segment.force[wheel, place]),
            xytext=(6, 0),
            textcoords="offset points",
            fontsize=8.5,
            bbox={"facecolor": "white", "alpha": 0.8, "linewidth": 0, "pad": 0.5},
        )
        panels[-1].set_xlabel("time, s")
        figure.suptitle(f"{label}{segment.name} at {segment.speed:.3g} m/s", x=0.01, ha="left", fontsize=10)
        entries: dict[str, Any] = {}
        for panel in panels[:2]:
            handles, labels = panel.get_legend_handles_labels()
            entries |= dict(zip(labels, handles, strict=True))
        figure.legend([*entries.values()], [*entries], loc="outside lower center", ncols=5)


def _largest_of_all(forces: RideForces) -> tuple[SegmentForces, int, int]:
    """Segment, wheel and sample of the largest share of the grip."""
    candidates = [(forces.share(s)[w, k], s, w, k) for w in range(2) for s, k in _largest(forces, w)]
    _, segment, wheel, place = max(candidates, key=lambda one: float(one[0]))
    return segment, wheel, place


def _draw_band(panel: Any, time: Array, value: Array, sd: Array, wheel: int) -> None:
    """Draw a value (n,) of a wheel over ``time`` (n,), s, with its 95 % band."""
    colour, name = COLOURS[wheel], WHEELS[wheel]
    low, high = value - NORMAL_95 * sd, value + NORMAL_95 * sd
    panel.fill_between(time, low, high, color=colour, alpha=0.3, linewidth=0, label=f"{name}, 95 % band")
    panel.plot(time, value, color=colour, linewidth=0.9, label=f"{name} wheel")
    panel.set_xlim(time[0], time[-1])


def _draw_linear_range(panel: Any, force: float) -> None:
    """Draw the ``force`` (N) up to which the linear tyre holds where the panel shows it."""
    reach = np.abs(panel.get_ylim()).max()
    if force < 1.3 * reach:
        for sign in (-1, 1):
            label = f"{100 * LINEAR_SHARE:.0f} % of the grip" if sign > 0 else None
            panel.axhline(sign * force, color="0.35", linewidth=0.9, linestyle="--", label=label)
