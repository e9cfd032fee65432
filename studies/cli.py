"""The command ``velotyre``: finds one command per module of ``studies.commands`` and reports errors in one line."""

import pkgutil
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType

import click

from tyre.errors import InputError


class ModuleGroup(click.Group):
    """A click group whose commands are the modules of a package, imported when they are asked for.

    A module ``blind_test`` with a click command called ``command`` is the command ``blind-test``; a sub-package
    is a group of its own, with the first line of its docstring as help.
    """

    def __init__(self, package: ModuleType, **settings: object) -> None:
        super().__init__(**settings)  # type: ignore[arg-type]
        self.package = package

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of the commands, sorted."""
        return sorted(module.name.replace("_", "-") for module in pkgutil.iter_modules(self.package.__path__))

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the module of a command; None when there is no such command."""
        if cmd_name not in self.list_commands(ctx):
            return None
        module = import_module(f"{self.package.__name__}.{cmd_name.replace('-', '_')}")
        if hasattr(module, "__path__"):
            return ModuleGroup(module, name=cmd_name, help=module.__doc__)
        return module.command


def build() -> click.Group:
    """Return the whole command tree."""
    package = import_module("studies.commands")
    group = ModuleGroup(package, name="velotyre", help="From bicycle-tyre rig data to the stability of the bicycle.")
    return click.version_option(package_name="velotyre", prog_name="velotyre")(group)


def main(arguments: list[str] | None = None) -> None:
    """Run ``velotyre``; bad input or usage ends with exit code 2 and one line on stderr."""
    try:
        build().main(args=arguments, prog_name="velotyre", standalone_mode=False)
    except click.exceptions.NoArgsIsHelpError as help_page:
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
    click.echo("velotyre: " + " ".join(message.split()), err=True)
    sys.exit(2)
