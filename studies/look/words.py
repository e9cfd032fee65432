"""A look at a recording as lines for the terminal."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import click
import numpy as np

from studies.look.look import Look
from studies.look.oddities import oddities
from studies.look.opened import rate
from studies.look.use import Use
from studies.reporting.output import print_table

WIDTH = 34
MOST_EVENTS = 8


def tell(found: Look, steps: Mapping[str, str]) -> None:
    """Print what was ``found``, with the next command of each use (``steps``)."""
    opened = found.opened
    click.echo(_headline(found))
    for note in opened.signals.notes:
        click.echo(f"  note: {note}")
    for note in opened.clock_notes:
        click.echo(f"  time: {note}")
    click.echo("")
    print_table(
        list(_rows(found)), ["channel", "unit", "samples", "lowest", "median", "highest", "step", "noise", "taken as"]
    )
    for name, reason in opened.unread.items():
        click.echo(f"  {name}: not numbers, left out ({reason[:120]})")
    remarks = [
        f"  {column.name}: {remark}" for column in opened.signals.columns
        for remark in (*opened.quality[column.name].remarks, *oddities(found.roles, column.name))
    ]  # fmt: skip
    if remarks:
        click.echo("\nremarks")
        for line in remarks:
            click.echo(line)
    click.echo(f"\nwhat it can be used for (channels {found.roles.origin})")
    said: list[list[Use]] = []
    for use in found.uses:
        same = next((others for others in said if replace(others[0], name=use.name) == use), None)
        if same is None or use.usable:
            said.append([use])
        else:
            same.append(use)
    for uses in said:
        _tell_use(uses, steps.get(uses[0].name, ""))


def _headline(found: Look) -> str:
    opened = found.opened
    times: dict[str, int] = {}
    for column in opened.signals.columns:
        size = opened.signals.signals[column.name].values.size
        time = opened.time_of(column.name) if found.is_timed(column.name) else None
        many = "1 sample" if size == 1 else f"{size} samples"
        if time is not None and time.size > 1 and np.isfinite(rate(time)):
            many += f" at {rate(time):.4g} Hz, {np.nanmax(time) - np.nanmin(time):.4g} s"
        times[many] = times.get(many, 0) + 1
    if len(times) == 1:
        said = next(iter(times))
    else:
        common = sorted(times.items(), key=lambda item: -item[1])
        said = "; ".join(f"{count} of {many}" for many, count in common[:4])
        said += f"; and {len(common) - 4} other rates or lengths" if len(common) > 4 else ""
    return f"{opened.path}: {len(opened.columns)} channel{'s' * (len(opened.columns) != 1)}, {said}"


def _rows(found: Look) -> Iterator[Sequence[object]]:
    taken = found.channels
    for column in found.opened.signals.columns:
        seen = found.opened.quality[column.name]
        name = column.name if len(column.name) <= WIDTH else f"...{column.name[3 - WIDTH :]}"
        noise = f"< {seen.step:.2g}" if seen.step and seen.noise < seen.step / 2 else f"{seen.noise:.2g}"
        noise = "-" if seen.noise < 1e-7 * (seen.highest - seen.lowest) and not seen.step else noise
        is_time = taken.get(column.name) == "time"
        missing = f"{seen.samples} ({seen.missing} missing)" if seen.missing else f"{seen.samples}"
        yield (
            name, column.unit or "-", missing, _number(seen.lowest), _number(seen.median), _number(seen.highest),
            f"{seen.step:.2g}" if seen.step else "-", "-" if is_time or seen.dead else noise,
            taken.get(column.name, ""),
        )  # fmt: skip


def _number(value: float) -> str:
    return f"{value:.5g}" if np.isfinite(value) else "-"


def _tell_use(uses: Sequence[Use], step: str) -> None:
    """Uses of which the same is to be said."""
    use = uses[0]
    verdict = "usable" if use.usable else "no"
    if use.usable and use.provided:
        verdict += f", once you give {use.provided}"
    if use.windows:
        verdict += ("; " if use.provided else ", ") + "in windows that the draft holds"
    click.echo(f"\n{', '.join(use.name for use in uses)}: {verdict}")
    for event in use.events[:MOST_EVENTS]:
        click.echo(f"  {event.words}")
        for note in event.notes[:MOST_EVENTS]:
            click.echo(f"    note: {note}")
    if len(use.events) > MOST_EVENTS:
        click.echo(f"  and {len(use.events) - MOST_EVENTS} more")
    for reason in use.reasons:
        click.echo(f"  {'not used' if use.usable else 'why'}: {reason}")
    for remedy in use.remedies:
        click.echo(f"  what to do: {remedy}")
    if step:
        click.echo(f"  next: {step}")
