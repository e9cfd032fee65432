"""``velotyre explore``: the page on which parameters are moved and modes watched."""

import click

from studies.model_space.command_options import Number
from studies.reporting.command_context import example


@click.command(
    help="Open a page in the browser: controls for bicycle, rider, tyres and effects, linked figures, downloads. "
    "MODEL is what it begins with.",
    epilog=example("velotyre explore", "velotyre explore model.toml --port 8060 --no-browser"),
)
@click.argument("model", required=False)
@click.option("--port", default=8050, show_default=True, type=Number(0, 65535, whole=True), help="0 takes a free one.")
@click.option("--no-browser", is_flag=True, help="Only say the address.")
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
