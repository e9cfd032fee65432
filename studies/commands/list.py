"""``velotyre list``: the bicycles, tyres and effects that there are."""

from copy import copy

import click

from studies.commands import bicycles, effects, tyres
from studies.reporting.command_context import example

EXAMPLES = {
    bicycles: ("velotyre list bicycles", "velotyre list bicycles pista"),
    effects: ("velotyre list effects", "velotyre list effects relaxation_length"),
    tyres: ("velotyre list tyres", "velotyre list tyres Tyre1 --surface drum"),
}

command = click.Group(
    help="List what there is: bicycles, tyres or effects; with a name, one of them in full.",
    epilog=example(*(lines[0] for lines in EXAMPLES.values())),
)
for module, lines in EXAMPLES.items():
    own = copy(module.command)  # the command of that name, by this one
    own.epilog = example(*lines)
    command.add_command(own, module.__name__.rpartition(".")[2])
