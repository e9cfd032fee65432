"""The server of the page: on this machine only."""

import logging
import socket
import webbrowser
from threading import Timer
from typing import Any

import click

from studies.explorer.app import build_app, main_figures
from studies.explorer.guard import guard
from tyre.base.errors import InputError

HOST = "127.0.0.1"
TELLS_AFTER = 0.3  # s, when the server listens for sure


def build_server(initial: str, port: int) -> Any:
    """The guarded application that answers at a port.

    Parameters
    ----------
    initial : str
        Address of the state that the page begins with.
    port : int
        Of the address, no unit.

    Returns
    -------
    flask.Flask
    """
    app = build_app(initial)
    hosts = (f"{HOST}:{port}", f"localhost:{port}")
    app._setup_server()  # lists the callbacks, which it would do at the first request
    guard(app.server, app.callback_map, hosts, app.csp_hashes())
    return app.server


def listening(port: int) -> socket.socket:
    """A socket on this machine; port 0: a free one.

    Parameters
    ----------
    port : int
        No unit.

    Raises
    ------
    InputError
        The port is taken or not allowed.
    """
    found = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        found.bind((HOST, port))
    except OSError as error:
        found.close()
        why = f"--port {port} cannot be used ({error.strerror})"
        raise InputError(f"{why}; give another one, or 0 for a free one") from error
    found.listen(256)
    return found


def serve(initial: str, *, port: int, browser: bool) -> None:
    """Serve the page until it is interrupted.

    Parameters
    ----------
    initial : str
        Address of the state that it begins with.
    port : int
        No unit; 0: a free one.
    browser : bool
        Open it.
    """
    from werkzeug.serving import make_server

    place = listening(port)
    port = place.getsockname()[1]
    server = make_server(HOST, port, build_server(initial, port), threaded=True, fd=place.fileno())
    logging.getLogger("werkzeug").setLevel(logging.WARNING)
    main_figures(initial, "light")  # what is derived once is ready before the first look
    url = f"http://{HOST}:{port}/"
    click.echo(f"velotyre explorer: {url} (this machine only; Ctrl+C ends it)")
    if browser:
        Timer(TELLS_AFTER, webbrowser.open, (url,)).start()
    server.serve_forever()
