"""Serve the page on this machine only, to the page itself: every other request is refused."""

import logging
import signal
import socket
import webbrowser
from collections.abc import Iterable, Mapping
from contextlib import suppress
from threading import Thread, Timer
from typing import Any

import click
from dash.exceptions import DependencyException
from flask import Flask, Response, request
from werkzeug.exceptions import HTTPException

from studies.explorer.app import build_app, main_figures, program_hash
from studies.explorer.forms import controls_html
from studies.explorer.models import at_speed, ranking
from studies.explorer.motion import mode_motion
from studies.explorer.state import parse_state
from studies.explorer.tyre_files import TYRES
from studies.explorer.uploads import LARGEST_BODY
from tyre.ground.errors import InputError

CALLBACK = "/_dash-update-component"
ICON = "/_favicon.ico"
PAGES = ("/", "/_dash-layout", "/_dash-dependencies", ICON)
FOLDERS = ("/assets/", "/_dash-component-suites/")


def guard(server: Flask, callbacks: Mapping[str, Any], hosts: Iterable[str], scripts: Iterable[str]) -> None:
    """Refuse all requests but those of the page: from ``hosts`` only, to ``callbacks``; run only ``scripts``."""
    allowed = frozenset(hosts)
    inline = " ".join(scripts)
    server.config["MAX_CONTENT_LENGTH"] = LARGEST_BODY
    policy = (
        f"default-src 'self'; script-src 'self' {inline}; style-src 'self' 'unsafe-inline'; "
        "img-src 'self' data: blob:; object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )

    @server.before_request
    def refuse() -> Response | None:
        origin = request.headers.get("Origin")
        if request.host not in allowed:
            return answer_in_words(403, "this server answers to its own address only")
        if origin is not None and origin.removeprefix("http://") not in allowed:
            return answer_in_words(403, "another site may not ask this server")
        link = request.path == "/" and request.headers.get("Sec-Fetch-Mode") == "navigate"
        if request.headers.get("Sec-Fetch-Site", "none") not in ("same-origin", "none") and not link:
            return answer_in_words(403, "another site may not ask this server")
        if request.path == CALLBACK:
            return _refused_callback(callbacks)
        odd = "//" in request.path or ".." in request.path
        if odd or (request.path not in PAGES and not request.path.startswith(FOLDERS)):
            return answer_in_words(404, "there is no such page")
        return None if request.method in ("GET", "HEAD") else answer_in_words(405, "only reading is allowed here")

    @server.errorhandler(DependencyException)
    def no_such_part(error: DependencyException) -> Response:
        return answer_in_words(404, "there is no such page")

    @server.errorhandler(HTTPException)
    def refused(error: HTTPException) -> Response:
        return answer_in_words(error.code or 500, (error.description or error.name).replace("\n", " "))

    @server.errorhandler(InputError)
    def in_words(error: InputError) -> Response:
        return Response(str(error), status=400, mimetype="text/plain")

    @server.after_request
    def harden(answer: Response) -> Response:
        answer.headers.update(
            {
                "Content-Security-Policy": policy,
                "X-Content-Type-Options": "nosniff",
                "Referrer-Policy": "no-referrer",
                "Cross-Origin-Resource-Policy": "same-origin",
            }
        )
        if request.path == ICON:  # browsers ask for it anew whenever the address changes, with every move of a slider
            answer.headers["Cache-Control"] = "max-age=3600"
        return answer


def answer_in_words(code: int, words: str) -> Response:
    """Answer in plain words."""
    return Response(f"velotyre explore: {words}\n", status=code, mimetype="text/plain")


def _refused_callback(callbacks: Mapping[str, Any]) -> Response | None:
    """Refuse a question that no callback of the page asks, or one with values that no page sends."""
    if request.method != "POST":
        return answer_in_words(405, "only the page itself asks here")
    if request.content_length is not None and request.content_length > LARGEST_BODY:
        return answer_in_words(413, f"a request may have {LARGEST_BODY} bytes")
    try:
        body = request.get_json(silent=True) if request.content_length is not None else None
    except RecursionError:
        body = None
    return (
        None
        if _is_asked(body, callbacks) and _is_small(body)
        else answer_in_words(400, "this is no request of the page")
    )


def _is_asked(body: Any, callbacks: Mapping[str, Any]) -> bool:
    """True if ``body`` gives values for what one callback takes, and for nothing else."""
    if not isinstance(body, dict) or not isinstance(body.get("output"), str) or body["output"] not in callbacks:
        return False
    declared = callbacks[body["output"]]
    changed = body.get("changedPropIds", [])
    outputs = body.get("outputs")
    for key in ("inputs", "state"):
        values = body.get(key, [])
        if not isinstance(values, list) or len(values) != len(declared[key]):
            return False
        for value, expected in zip(values, declared[key], strict=True):
            if not isinstance(value, dict) or any(value.get(part) != expected[part] for part in ("id", "property")):
                return False
    named = isinstance(outputs, dict) and f"{outputs.get('id')}.{outputs.get('property')}" == body["output"]
    return named and isinstance(changed, list) and all(isinstance(value, str) for value in changed)


def _is_small(body: Any, *, deepest: int = 6, most: int = 5_000) -> bool:
    """True if the values are few and not deeply nested."""
    level = [body]
    count = 0
    for _ in range(deepest):
        inner: list[Any] = []
        for table in level:
            inner += table.values() if isinstance(table, dict) else table
        count += len(inner)
        if count > most:
            return False
        level = [value for value in inner if isinstance(value, dict | list)]
    return not level


HOST = "127.0.0.1"
CLOSE = "velotyre_close"  # extension of the server that deletes what was loaded


def build_server(initial: str, port: int) -> Any:
    """Build the guarded application that answers at a ``port``, beginning with the state of the address ``initial``."""
    app = build_app(initial)
    hosts = (f"{HOST}:{port}", f"localhost:{port}")
    app._setup_server()  # lists the callbacks, which it would do at the first request
    guard(app.server, app.callback_map, hosts, [*app.csp_hashes(), program_hash()])
    app.server.extensions[CLOSE] = TYRES.close
    return app.server


def open_socket(port: int) -> socket.socket:
    """Open a listening socket on this machine; port 0 takes a free one."""
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((HOST, port))
    except OSError as error:
        listener.close()
        why = f"--port {port} cannot be used ({error.strerror})"
        raise InputError(f"{why}; give another one, or 0 for a free one") from error
    listener.listen(256)
    return listener


def serve(initial: str, *, port: int, browser: bool) -> None:
    """Serve the page until it is interrupted."""
    from werkzeug.serving import make_server

    place = open_socket(port)
    port = place.getsockname()[1]
    application = build_server(initial, port)
    server = make_server(HOST, port, application, threaded=True, fd=place.fileno())
    logging.getLogger("werkzeug").setLevel(logging.WARNING)
    main_figures(initial, "light")  # what is derived once is ready before the first look
    url = f"http://{HOST}:{port}/"
    click.echo(f"velotyre explorer: {url} (this machine only; Ctrl+C ends it)")
    if browser:
        Timer(0.3, webbrowser.open, (url,)).start()

    def warm() -> None:  # what the page asks for next, while the browser still reads its programs
        state = parse_state(initial)
        with suppress(InputError):  # the page says it
            controls_html(state)
            mode_motion(state, at_speed(state))
            ranking(state)

    Thread(target=warm, daemon=True).start()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # as Ctrl+C: what was loaded is deleted
    try:
        server.serve_forever()
    finally:
        application.extensions[CLOSE]()
