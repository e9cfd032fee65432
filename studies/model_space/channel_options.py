"""Options of a command that assign columns of a recording to channels."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from studies.model_space.command_options import PATH

_FILE = "Channel map (TOML): column, unit and sign of each channel."
_ONE = "Map one channel: roll_rate='Gyro X' deg/s -1, time='t' ms or time=200 Hz; may be repeated."


def takes_channels(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a click ``command`` the options ``--channels`` and ``--channel``; see :func:`chosen_map`."""
    channel = click.option("--channel", "channel_texts", multiple=True, metavar="NAME=COLUMN [UNIT] [SIGN]", help=_ONE)
    file = click.option("--channels", "channels_file", type=PATH, metavar="FILE.toml", help=_FILE)
    return file(channel(command))


def chosen_map(channels_file: Path | None, channel_texts: tuple[str, ...]) -> Any:
    """The channel map of the options, None where none is given."""
    if channels_file is None and not channel_texts:
        return None
    from dataclasses import replace

    from tyre.formats.channel_map import ChannelMap

    base = replace(ChannelMap(), source="--channel") if channels_file is None else ChannelMap.from_file(channels_file)
    return base.with_channels(channel_texts)
