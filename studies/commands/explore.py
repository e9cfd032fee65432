"""``velotyre explore``: the page on which parameters are moved and modes watched."""

import click

from studies.model_space.command_options import Number
from studies.reporting.command_context import example


@click.command(
    help="Open an interactive page in the browser. Controls for bicycle, rider, tyres and effects, linked figures, "
    "downloads. MODEL is the initial model.",
    epilog=example("velotyre explore", "velotyre explore model.toml --port 8060 --no-browser"),
)
@click.argument("model", required=False)
@click.option(
    "--port",
    default=8050,
    show_default=True,
    type=Number(0, 65535, whole=True),
    help="Port of the page; 0: any free port.",
)
@click.option("--no-browser", is_flag=True, help="Print the address without opening it.")
def command(model: str | None, port: int, *, no_browser: bool) -> None:
    from studies.explorer.uploads import start_state
    from tyre.ground.progress import optional_module

    address = start_state(model).address  # refused before what takes a second to import
    try:
        optional_module("dash", extra="explore")
    except ImportError as error:
        raise click.ClickException(str(error)) from error
    from studies.explorer.server import serve

    serve(address, port=port, browser=not no_browser)
