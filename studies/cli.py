"""Command ``velotyre``: one command per module of ``studies.commands``; errors become one line."""

import sys

try:
    import errno
    import os
    import pkgutil
    from contextlib import ExitStack, nullcontext, suppress
    from importlib import import_module
    from pathlib import Path
    from types import ModuleType

    import click

    from studies.reporting.command_context import ARGUMENTS, count_seconds, example, version_of
    from studies.reporting.terminal_letters import spell_out_what_is_lacking
    from tyre.ground.errors import InputError, unknown
    from tyre.ground.progress import interrupts_arrive
    from tyre.ground.renamed import new_name
except KeyboardInterrupt:  # while the imports last
    sys.stderr.write("velotyre: interrupted\n")
    sys.exit(130)

NO_ARGUMENTS = getattr(click.exceptions, "NoArgsIsHelpError", ())  # click before 8.2 shows the help by itself


class ModuleGroup(click.Group):
    """A click group whose commands are the modules of a package, imported when they are asked for."""

    def __init__(self, package: ModuleType, **settings: object) -> None:
        super().__init__(**settings)  # type: ignore[arg-type]
        self.package = package

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Keep the ``args`` of the whole command line in ``ctx`` for the manifest of results, and parse them."""
        ctx.meta.setdefault(ARGUMENTS, list(args))
        if odd := next((one for one in args if "\0" in one), ""):  # which no file name may hold
            raise InputError(f"{odd!r} holds a NUL character; leave it out")
        return super().parse_args(ctx, args)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of the commands, sorted."""
        return sorted(module.name.replace("_", "-") for module in pkgutil.iter_modules(self.package.__path__))

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the module of the command ``cmd_name``; None if there is none."""
        if cmd_name not in self.list_commands(ctx):
            return None
        module = import_module(f"{self.package.__name__}.{cmd_name.replace('-', '_')}")
        if hasattr(module, "__path__"):
            return ModuleGroup(module, name=cmd_name, help=module.__doc__, epilog=example(*module.EXAMPLE))
        command: click.Command = module.command
        if not any(parameter.name == "effect_files" for parameter in command.params):
            command.params.append(effects_option())
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command that the first of ``args`` names; an unknown one is refused with the nearest known."""
        if args and not args[0].startswith("-") and args[0] not in self.list_commands(ctx):
            raise InputError(unknown("command", args[0], self.list_commands(ctx)))
        return super().resolve_command(ctx, args)


def effects_option() -> click.Option:
    """Make ``--effects FILE``, before or after the command: effects of the user, known while it runs."""
    return click.Option(
        ["--effects", "effect_files"],
        multiple=True,
        metavar="FILE",
        type=click.Path(),
        expose_value=False,
        is_eager=True,
        callback=_know_effects,
        help="Load your effects from a Python file (docs/effects.md); may be repeated.",
    )


def _know_effects(context: click.Context, parameter: click.Parameter, files: tuple[str, ...]) -> None:
    if files and not context.resilient_parsing:
        from bicycle.effects.effect_registry import outside_effects

        stack = context.find_object(ExitStack)
        known = outside_effects(files)
        context.with_resource(known) if stack is None else stack.enter_context(known)


def build() -> click.Group:
    """Make the whole command tree."""
    version = click.Option(
        ["--version"],
        is_flag=True,
        is_eager=True,
        expose_value=False,
        callback=_show_version,
        help="Show the version and exit; with --verbose also the libraries and limits in use.",
    )
    verbose = click.Option(["--verbose"], is_flag=True, expose_value=False, hidden=True)
    return ModuleGroup(
        import_module("studies.commands"),
        name="velotyre",
        params=[effects_option(), version, verbose],
        help="Compute the stability of a bicycle from tyre rig data.",
        epilog=example("velotyre bicycles", "velotyre modes benchmark", "velotyre run"),
    )


def _show_version(context: click.Context, parameter: click.Parameter, value: bool) -> None:  # noqa: FBT001 (as click calls it)
    if not value or context.resilient_parsing:
        return
    click.echo(f"velotyre, version {version_of('velotyre')}")
    if "--verbose" in context.meta[ARGUMENTS]:
        from bicycle.model.eigen import KERNEL
        from tyre.formats.child import apart
        from tyre.formats.limits import MEMORY, PROCESSOR

        click.echo(f"eigenvalues: {KERNEL}; numpy {version_of('numpy')}, scipy {version_of('scipy')}")
        limits = f"at most {MEMORY[-1] / 1e9:g} GB and {PROCESSOR[-1]:g} s a file"
        click.echo(
            f"binary files are parsed in {f'a process of {limits}' if apart() else 'this process, without limits'}"
        )
    context.exit()


def main(arguments: list[str] | None = None) -> None:
    """Run ``velotyre`` with ``arguments`` (of the command line by default)."""
    given = sys.argv[1:] if arguments is None else arguments
    spell_out_what_is_lacking()
    try:
        os.getcwd()
    except OSError:  # no path can be resolved then
        _fail("the current folder is not there any more; change to one that is")
    try:
        _run(arguments, serves="explore" in given[:1])
    except click.NoSuchOption as error:
        options = [] if error.ctx is None else [name for o in error.ctx.command.params for name in o.opts]
        current = new_name(error.option_name, options)
        _fail(f"the option {error.option_name} is now called {current}" if current else error.format_message())
    except click.ClickException as error:
        _fail(error.format_message())
    except InputError as error:
        _fail(str(error))
    except BrokenPipeError:  # the reader, such as head, has seen enough
        _drop_output()
        sys.exit(1)
    except OSError as error:
        full = error.errno in (errno.ENOSPC, errno.EIO, errno.EFBIG) and not error.filename  # files have names
        where = "the output cannot be written" if full else Path(error.filename or "").as_posix()
        if full:
            _drop_output()
        _fail(f"{where}: {error.strerror}" if full or error.filename else str(error))
    except (KeyboardInterrupt, click.Abort):
        click.echo("velotyre: interrupted", err=True)
        sys.exit(130)


def _run(arguments: list[str] | None, *, serves: bool) -> None:
    """Run the group of commands; one that needs arguments and has none shows its help."""
    try:
        with ExitStack() as until_the_end, interrupts_arrive(), nullcontext() if serves else count_seconds():
            build().main(args=arguments, prog_name="velotyre", standalone_mode=False, obj=until_the_end)
    except NO_ARGUMENTS as help_page:
        click.echo(help_page.format_message())
    sys.stdout.flush()  # what waits in it fails here, if it fails, and not once nobody can say why


def _drop_output() -> None:
    """Send what waits for a full disk nowhere: Python would fail with it once more at its end."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _fail(message: str, longest: int = 400) -> None:
    """Print one line, in which words of more letters than ``longest``, such as a path, are cut in the middle."""
    line, gap, draft = message.partition("\n\n")  # what follows an empty line is to be pasted into a file
    words = [word if len(word) <= longest else f"{word[: longest - 60]}...{word[-57:]}" for word in line.split()]
    click.echo("velotyre: " + " ".join(words) + gap + draft, err=True)
    sys.exit(2)
