"""The command ``velotyre``: finds one command per module of ``studies.commands`` and reports errors in one line."""

import pkgutil
import sys
from contextlib import ExitStack
from importlib import import_module
from pathlib import Path
from types import ModuleType

import click

from studies.reporting.examples import ARGUMENTS, example
from tyre.base.errors import InputError, unknown
from tyre.base.interrupts import interrupts_arrive

ABOUT = "From bicycle-tyre rig data to the stability of the bicycle."
EXAMPLE = ("velotyre bicycles", "velotyre modes benchmark", "velotyre run")
EFFECTS = "effect_files"
LONGEST = 400  # letters of one word of a message, such as a path: longer ones are cut in the middle
NO_ARGUMENTS = getattr(click.exceptions, "NoArgsIsHelpError", ())  # click before 8.2 shows the help by itself


class ModuleGroup(click.Group):
    """A click group whose commands are the modules of a package, imported when they are asked for.

    A module ``blind_test`` with a click command called ``command`` is the command ``blind-test``; a sub-package
    is a group of its own, with its docstring as help and its ``EXAMPLE`` at the end.
    """

    def __init__(self, package: ModuleType, **settings: object) -> None:
        super().__init__(**settings)  # type: ignore[arg-type]
        self.package = package

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Keep the ``args`` of the whole command line in ``ctx`` for the manifest of results, and parse them."""
        ctx.meta.setdefault(ARGUMENTS, list(args))
        return super().parse_args(ctx, args)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of the commands, sorted (``ctx``: click's context)."""
        return sorted(module.name.replace("_", "-") for module in pkgutil.iter_modules(self.package.__path__))

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the module of the command ``cmd_name``; None when there is none (``ctx``: click's context)."""
        if cmd_name not in self.list_commands(ctx):
            return None
        module = import_module(f"{self.package.__name__}.{cmd_name.replace('-', '_')}")
        if hasattr(module, "__path__"):
            return ModuleGroup(module, name=cmd_name, help=module.__doc__, epilog=example(*module.EXAMPLE))
        command: click.Command = module.command
        if not any(parameter.name == EFFECTS for parameter in command.params):
            command.params.append(effects_option())
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The command that the first of ``args`` names; an unknown one is refused with the nearest known.

        ``ctx`` is click's context.
        """
        if args and not args[0].startswith("-") and args[0] not in self.list_commands(ctx):
            raise InputError(unknown("command", args[0], self.list_commands(ctx)))
        return super().resolve_command(ctx, args)


def effects_option() -> click.Option:
    """``--effects FILE``, before or after the command: effects of the user, known while it runs."""
    return click.Option(
        ["--effects", EFFECTS], multiple=True, metavar="FILE", type=click.Path(), expose_value=False, is_eager=True,
        callback=_know_effects, help="Python file with effects of your own (docs/add_an_effect.md); may be repeated.",
    )  # fmt: skip


def _know_effects(context: click.Context, parameter: click.Parameter, files: tuple[str, ...]) -> None:
    if files and not context.resilient_parsing:
        from bicycle.effect import outside_effects

        stack = context.find_object(ExitStack)
        known = outside_effects(files)
        context.with_resource(known) if stack is None else stack.enter_context(known)


def build() -> click.Group:
    """Return the whole command tree."""
    package = import_module("studies.commands")
    group = ModuleGroup(package, name="velotyre", help=ABOUT, epilog=example(*EXAMPLE), params=[effects_option()])
    return click.version_option(package_name="velotyre", prog_name="velotyre")(group)


def main(arguments: list[str] | None = None) -> None:
    """Run ``velotyre`` with ``arguments`` (of the command line by default).

    Bad input or usage ends with exit code 2 and one line on stderr.
    """
    try:
        with ExitStack() as until_the_end, interrupts_arrive():
            build().main(args=arguments, prog_name="velotyre", standalone_mode=False, obj=until_the_end)
    except NO_ARGUMENTS as help_page:
        click.echo(help_page.format_message())
    except click.ClickException as error:
        _fail(error.format_message())
    except InputError as error:
        _fail(str(error))
    except OSError as error:
        _fail(f"{Path(error.filename).as_posix()}: {error.strerror}" if error.filename else str(error))
    except (KeyboardInterrupt, click.Abort):
        click.echo("velotyre: interrupted", err=True)
        sys.exit(130)


def _fail(message: str) -> None:
    line, gap, draft = message.partition("\n\n")  # what follows an empty line is to be pasted into a file
    words = [word if len(word) <= LONGEST else f"{word[: LONGEST - 60]}...{word[-57:]}" for word in line.split()]
    click.echo("velotyre: " + " ".join(words) + gap + draft, err=True)
    sys.exit(2)
