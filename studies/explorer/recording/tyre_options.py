"""Numbers of ``velotyre tyre fit`` that the page asks for: its own options, so that nothing is said twice."""

from dataclasses import dataclass
from functools import cache

import click

from studies.cli import build


@dataclass(frozen=True)
class TyreOption:
    """A number.

    Attributes
    ----------
    name : str
        Of the option, with underscores.
    flag : str
        As it is typed.
    words : str
        What it is, with its unit at the end.
    usual : float
        Its value where none is given, in that unit.
    """

    name: str
    flag: str
    words: str
    usual: float


@cache
def tyre_options() -> tuple[TyreOption, ...]:
    """Every number of the command, in its order."""
    command: click.Command = build()
    with click.Context(command) as context:
        for name in ("tyre", "fit"):
            assert isinstance(command, click.Group)
            found = command.get_command(context, name)
            assert found is not None
            command = found
    return tuple(
        TyreOption(str(one.name), one.opts[0], (one.help or "").rstrip("."), float(str(one.default)))
        for one in command.params
        if isinstance(one, click.Option) and isinstance(one.type, click.types.FloatParamType)
    )
