"""Options that commands share; numbers among them are finite, within both ends, and no more than memory holds."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import click.core

from tyre.ground.errors import InputError, plain_digits, read_number
from tyre.ground.number_with_unit import typed_number, typed_numbers

MOST_BYTES = 1e9  # of the arrays that one number asks for


class Number(click.ParamType):
    """A finite number of the command line from ``least`` to ``most``, or ``above`` the one and ``below`` the other.

    It is in ``unit`` unless another unit of the same quantity is typed behind it.
    """

    name = "number"

    def __init__(
        self,
        least: float,
        most: float,
        *,
        above: bool = False,
        below: bool = False,
        whole: bool = False,
        unit: str = "",
    ) -> None:
        self.least, self.most, self.above, self.below, self.whole = least, most, above, below, whole
        self.unit = unit

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Give the number; click refuses anything else with the option's name."""
        try:
            number = int(value) if self.whole and plain_digits(value) else self._read(value)
        except InputError as error:
            self.fail(f"{value}: {error}", param, ctx)
        except (ValueError, OverflowError):
            number = math.nan
        low = self.least < number if self.above else self.least <= number
        high = number < self.most if self.below else number <= self.most
        if not (low and high):
            kind, begin = "whole number" if self.whole else "number", "above" if self.above else "from"
            end = "below" if self.below else "up to"
            unit = f" {self.unit}" if self.unit else ""
            self.fail(f"{value}: give a {kind} {begin} {self.least:.12g} {end} {self.most:.12g}{unit}", param, ctx)
        return number

    def _read(self, value: Any) -> float:
        return typed_number(value, self.unit) if self.unit and isinstance(value, str) else read_number(value)


class Numbers(click.ParamType):
    """So many finite numbers in ``unit``, separated by commas."""

    name = "numbers"

    def __init__(self, least: int, most: int, *, unit: str, example: str) -> None:
        self.least, self.most, self.unit, self.example = least, most, unit, example

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[float, ...]:
        """Give the numbers; click refuses anything else with the option's name."""
        if not isinstance(value, str):
            return tuple(value)
        try:
            numbers = typed_numbers(value.split(","), self.unit, alike=False)
        except InputError as error:
            self.fail(str(error), param, ctx)
        if not self.least <= len(numbers) <= self.most:
            count = f"{self.least}" if self.least == self.most else f"{self.least} or {self.most}"
            self.fail(f"{value}: give {count} numbers in {self.unit}, such as {self.example}", param, ctx)
        return tuple(numbers)


SPEED = Number(0, 1000, unit="m/s")
SPEED_ABOVE_0 = Number(0, 1000, above=True, unit="m/s")
SEED = Number(0, 2**32 - 1, whole=True)
WORKERS = Number(1, 1024, whole=True)
COUNT = Number(0, 1000, whole=True)
PATH, FOLDER = click.Path(path_type=Path), click.Path(path_type=Path, file_okay=False)
POSTURE = click.Choice(("upright", "hoods", "drops"))
FINITE, POSITIVE, ANGLE = Number(-1e6, 1e6), Number(0, 1e6, above=True), Number(-360, 360, unit="deg")
LENGTH, LENGTH_ABOVE_0 = Number(-1e6, 1e6, unit="m"), Number(0, 1e6, above=True, unit="m")
MASS, INERTIA = Number(0, 1e6, above=True, unit="kg"), Number(0, 1e6, above=True, unit="kg m^2")
PLACE = Numbers(2, 2, unit="m", example="0.35,1.05")
INERTIAS = Numbers(3, 4, unit="kg m^2", example="8,9,2.5,1.2")
DURATION = Number(-1e6, 1e6, unit="s")
TIME = Number(-1e12, 1e12, unit="s")  # also since 1970


def stated(name: str) -> bool:
    """True if the option of the running command with this parameter ``name`` was given on the command line."""
    return click.get_current_context().get_parameter_source(name) is not click.core.ParameterSource.DEFAULT


def refuse_next_to(flag: str, *allowed: str) -> None:
    """Refuse the options of the running command that ``flag`` does not use: all but the parameters ``allowed``."""
    context = click.get_current_context()
    for parameter in context.command.params:
        name = parameter.name or ""
        if stated(name) and flag not in parameter.opts and name not in allowed:
            is_option = isinstance(parameter, click.Option)
            called = max(parameter.opts, key=len) if is_option else parameter.human_readable_name.strip("[]")
            raise InputError(f"{flag} prints and ends; leave out {called}")


def check_memory(name: str, number: float, bytes_each: float) -> None:
    """Refuse a ``number`` of things, called ``name``, whose arrays of so many bytes each would not fit into memory."""
    if not number * bytes_each <= MOST_BYTES:
        raise InputError(
            f"{name} = {number:.12g}: the arrays would take {1e-9 * number * bytes_each:.3g} GB of memory; up to "
            f"{int(MOST_BYTES / bytes_each)} fit into the {1e-9 * MOST_BYTES:g} GB that are allowed"
        )


Decorator = Callable[[Any], Any]


def speed_option(words: str = "Forward speed, m/s.", *, required: bool = True) -> Decorator:
    """Option ``--speed`` of a command that takes one; ``--speeds`` is answered with it."""
    refuse_speeds = _refuse_option("--speeds", "one speed is meant here: give --speed, for example --speed 5")
    return lambda command: refuse_speeds(click.option("--speed", type=SPEED, required=required, help=words)(command))


def speeds_option(words: str, default: str | None = None) -> Decorator:
    """Option ``--speeds`` of a command that takes several; ``--speed`` is answered with it."""
    words = f"Speeds, m/s: start:stop:step, both ends included, or a list 2,5,8{words}"
    refuse_speed = _refuse_option("--speed", "give --speeds, one or more: --speeds 5, a list 2,5,8 or start:stop:step")
    option = click.option("--speeds", default=default, show_default=default is not None, help=words)
    return lambda command: refuse_speed(option(command))


def _refuse_option(option: str, advice: str) -> Decorator:
    def tell(context: click.Context, parameter: click.Parameter, value: str | None) -> None:
        if value is not None:
            raise InputError(f"{option} {value}: {advice}")

    return click.option(option, hidden=True, expose_value=False, callback=tell)


def max_speed_option(default: float) -> Decorator:
    """Option ``--max-speed`` of commands that look for critical speeds."""
    words = "Search critical speeds up to this speed, m/s."
    return click.option("--max-speed", type=SPEED_ABOVE_0, default=default, show_default=True, help=words)


seed_option = click.option("--seed", type=SEED, default=0, show_default=True, help="Seed of the random numbers.")
sd_option = click.option(
    "--sd", "sds", multiple=True, metavar="NAME=VALUE", help="Standard uncertainty of a parameter, SI; may be repeated."
)
assume_option = click.option(
    "--assume", is_flag=True, help="Assume default standard uncertainties for the other parameters."
)
