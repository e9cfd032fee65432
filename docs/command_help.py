"""The help of every command, as ``velotyre COMMAND --help`` prints it on a terminal of 80 columns.

``python docs/command_help.py`` prints all of it; the documentation shows it on the page of the command line.
"""

from collections.abc import Iterator

import click

from studies.cli import build

WIDTH = 78  # characters: click leaves two of the 80 columns free


def command_helps() -> dict[str, str]:
    """Give the help of each command, by the words that are typed: ``velotyre``, ``velotyre amplitude``, ..."""
    group = build()
    return dict(_helps(group, click.Context(group, info_name="velotyre", terminal_width=WIDTH)))


def as_markdown() -> str:
    """Give a section for each command."""
    return "\n".join(f"### {words}\n\n```text\n{text}\n```\n" for words, text in command_helps().items())


def _helps(command: click.Command, context: click.Context) -> Iterator[tuple[str, str]]:
    yield context.command_path, command.get_help(context)
    if isinstance(command, click.Group):
        for name in command.list_commands(context):
            below = command.get_command(context, name)
            assert below is not None
            yield from _helps(below, click.Context(below, parent=context, info_name=name))


if __name__ == "__main__":
    print("\n\n".join(command_helps().values()))
