"""The server of the page: on this machine only."""

import logging
import signal
import socket
import webbrowser
from contextlib import suppress
from threading import Thread, Timer
from typing import Any

import click

from studies.explorer.app import build_app, main_figures
from studies.explorer.computed import at_speed, ranking
from studies.explorer.controls import controls_html
from studies.explorer.guard import guard
from studies.explorer.motion import mode_motion
from studies.explorer.page import program_hash
from studies.explorer.recording.routes import add_routes
from studies.explorer.state import parse_state
from studies.explorer.tyre_files import TYRES
from tyre.base.errors import InputError

HOST = "127.0.0.1"
TELLS_AFTER = 0.3  # s, when the server listens for sure
CLOSE = "velotyre_close"
"""Extension of the server that ends computations and deletes what was loaded."""


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
    guard(app.server, app.callback_map, hosts, [*app.csp_hashes(), program_hash()])
    close = add_routes(app.server)

    def end() -> None:
        close()
        TYRES.close()

    app.server.extensions[CLOSE] = end
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


def _warm(initial: str) -> None:
    """Compute what the page asks for after its first figures, while the browser still reads its programs."""
    state = parse_state(initial)
    with suppress(InputError):  # the page says it
        controls_html(state)
        mode_motion(state, at_speed(state))
        ranking(state)


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
    application = build_server(initial, port)
    server = make_server(HOST, port, application, threaded=True, fd=place.fileno())
    logging.getLogger("werkzeug").setLevel(logging.WARNING)
    main_figures(initial, "light")  # what is derived once is ready before the first look
    url = f"http://{HOST}:{port}/"
    click.echo(f"velotyre explorer: {url} (this machine only; Ctrl+C ends it)")
    if browser:
        Timer(TELLS_AFTER, webbrowser.open, (url,)).start()
    Thread(target=_warm, args=(initial,), daemon=True).start()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # as Ctrl+C: what was loaded is deleted
    try:
        server.serve_forever()
    finally:
        application.extensions[CLOSE]()
