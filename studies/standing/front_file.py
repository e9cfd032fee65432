"""``velotyre front-frame FILE``: stiffness and hinges of a front frame from a file of measurements."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from shlex import quote
from typing import Any

import click

from bicycle.files.bicycle_files import load_bicycle
from bicycle.model.model import Model
from bicycle.standing import HANDS, measure_front
from studies.diagnosis.measurement_file import read_measurement
from studies.diagnosis.standing import StandingKind
from studies.model_space.toml_target import check_toml_target
from studies.reporting.output import check_targets, write_json
from studies.standing.front_model import model_file_text
from studies.standing.front_report import Report, description, record, terminal
from studies.standing.hands_file import hands_of_file, hands_record, hands_text
from tyre.ground.errors import InputError
from tyre.ground.files import read_toml, write_text


def report_front_file(file: Path, *, bicycle: str | None, out: Path | None, json_file: str | None, force: bool) -> None:
    """Fit the front frame to the measurements of a ``file`` of kind standing, print the result and write it.

    ``bicycle`` is a packaged name or a file, used in place of the one that the ``file`` names; ``out`` takes the model
    file, ``json_file`` the numbers (``-``: standard output). Existing files are overwritten with ``force`` only.
    """
    if out is not None:
        check_toml_target(out, force=force)
    check_targets(json=json_file)
    content = read_toml(file, "measurement file")
    if content.get("kind") == HANDS:
        _report_hands(file, content, bicycle=bicycle, out=out, json_file=json_file)
        return
    measurement = read_measurement(file)
    if not isinstance(measurement, StandingKind):
        raise InputError(f"{file}: kind is {measurement.kind!r}; a front frame is measured by kind = 'standing'")
    model = measurement.model
    if bicycle is not None:
        model = replace(model, bicycle=load_bicycle(bicycle))
    try:
        result = measure_front(measurement.readings, Model(model.bicycle, model.effects), measurement.uncertainty)
    except InputError as error:
        raise InputError(f"{file}: {error}") from error
    report = Report(result, model, measurement.held)
    if json_file:
        write_json(record(report, measurement.notes), json_file)
    if json_file != "-":
        click.echo(terminal(report))
        for note in measurement.notes:
            click.echo(f"note: {note}", err=True)
    if out is None:
        return
    if result.fit is None:
        raise InputError(f"{out} is not written: the readings give no numbers")
    write_text(out, model_file_text(result, model, report.damping, description(report)))
    if json_file != "-":
        click.echo(f"\n{out}: next: velotyre run {quote(str(out))}")


def _report_hands(
    file: Path, content: Mapping[str, Any], *, bicycle: str | None, out: Path | None, json_file: str | None
) -> None:
    """Print the hands that a ``file`` with this ``content`` measures, or write them as JSON."""
    if out is not None:
        raise InputError(f"--out {out}: each grip is a case of its own; copy the table that is printed")
    try:
        hands = hands_of_file({**content, **({} if bicycle is None else {"bicycle": bicycle})}, file.parent)
    except InputError as error:
        raise InputError(f"{file}: {error}") from error
    if json_file:
        write_json(hands_record(hands), json_file)
    if json_file != "-":
        click.echo(hands_text(hands))
