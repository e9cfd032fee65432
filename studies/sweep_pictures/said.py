"""What a command prints of the figures that it drew."""

import click

from studies.sweep_pictures.draw import Drawn


def say_what_is_drawn(drawn: Drawn, *, quiet: bool) -> None:
    """A line for each figure on standard output, unless ``quiet``, and the remarks on standard error."""
    if not quiet:
        for name, words in drawn.figures.items():
            click.echo(f"{(drawn.folder / name).as_posix()}.png, .svg, .csv: {' '.join(words.split())}")
    for remark in drawn.remarks:
        click.echo(f"remark: {remark}", err=True)
