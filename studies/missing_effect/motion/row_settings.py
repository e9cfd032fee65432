"""Known settings of the rows of a table: columns that are called as a parameter of an effect, ``steer_assist.gain``.

In its row such a number takes the place of the model's, exactly: a controller's gain, a damper's notch, a pressure's
stiffness. Runs at several settings are so explained by one set of unknowns.
"""

from collections.abc import Mapping
from pathlib import Path

from bicycle.model import Model
from bicycle.model_family import ModelFamily
from bicycle.parameter_key import entries_of
from tyre.base.csv_table import Columns
from tyre.base.errors import InputError

Settings = tuple[tuple[str, float], ...]
"""Parameters of effects, ``effect.name[.wheel]``, and their SI values."""


def said(settings: Settings) -> tuple[str, ...]:
    """Each of ``settings`` (SI values) in words: ``steer_assist.gain = 8``."""
    return tuple(f"{key} = {value:g}" for key, value in settings)


def settable(model: Model) -> tuple[str, ...]:
    """Columns that the effects of a ``model`` allow: ``effect.name`` (both wheels) and ``effect.name.wheel``."""
    return tuple(
        f"{effect.identifier}.{entry}"
        for effect in model.effects
        for parameter in effect.parameters
        for entry in dict.fromkeys((parameter.name, *parameter.entries()))
    )


def read_settings(path: Path, columns: Columns, model: Model, uncertainty: Mapping[str, float]) -> tuple[Settings, ...]:
    """Settings of each row.

    Parameters
    ----------
    path : Path
        Of the table, for messages.
    columns : Columns
        As read.
    model : Model
        The base model.
    uncertainty : mapping
        1-sigma (SI) that the measurement file gives, by parameter.

    Raises
    ------
    InputError
        A value that the effect cannot have, a number given by two columns, a setting that is uncertain too.
    """
    given = {name: entries_of(name, model.parameters) for name in settable(model) if name in columns.numbers}
    own = [key for entries in given.values() for key in entries]
    for key in own:
        if own.count(key) > 1:
            raise InputError(f"{path}: {key} is given by two columns, for both wheels and for one; keep one of them")
    for key, sd in uncertainty.items():
        if sd and set(own).intersection(entries_of(key, model.parameters)):
            raise InputError(
                f"{path}: {key} is a column, known in each row, but [uncertainty] gives it a standard deviation of "
                f"{sd:g}; take one of the two out (for a gain, what all rows have in common, steer_motor.share, may be "
                "uncertain)"
            )
    family, found = ModelFamily(model), []
    for row, line in enumerate(columns.lines):
        here = {key: float(columns.numbers[name][row]) for name, entries in given.items() for key in entries}
        try:
            if here:
                family.with_values(here)
        except InputError as error:
            raise InputError(f"{path}, line {line}: {error}") from error
        found.append(tuple(here.items()))
    return tuple(found)
