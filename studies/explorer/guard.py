"""Who may ask the server of the page, and what: the page itself, in a browser on this machine.

A server on the loopback can be reached by every site that the browser visits. So the name by which it was called must
be its own (a foreign name that points here is refused: DNS rebinding), and so must the page that asks (origin).
"""

from collections.abc import Iterable, Mapping
from typing import Any

from dash.exceptions import DependencyException
from flask import Flask, Response, request
from werkzeug.exceptions import HTTPException

from studies.explorer.recording.desk import LARGEST_FILE
from tyre.base.errors import InputError

LARGEST_BODY = 3_000_000
"""Bytes of a request: a dropped file of 1 MB and a state, twice over."""

CALLBACK = "/_dash-update-component"
FOLDER = "/recording/"
"""Of the addresses of the page of recordings."""

ICON = "/_favicon.ico"
OPENED = ("/", "/recording")  # by a link, too
PAGES = (*OPENED, "/_dash-layout", "/_dash-dependencies", ICON)
FOLDERS = ("/assets/", "/_dash-component-suites/")
DEEPEST, MOST_VALUES = 6, 5_000


def guard(server: Flask, callbacks: Mapping[str, Any], hosts: Iterable[str], scripts: Iterable[str]) -> None:
    """Refuse all requests but those of the page.

    Parameters
    ----------
    server : Flask
    callbacks : mapping of str to mapping
        Those of the page by the name of their output, as Dash lists them.
    hosts : iterable of str
        ``name:port`` by which the page may be asked for.
    scripts : iterable of str
        Hashes of the scripts inside the page, for its content security policy.
    """
    allowed, inline = frozenset(hosts), " ".join(scripts)
    server.config["MAX_CONTENT_LENGTH"] = LARGEST_FILE
    policy = (
        f"default-src 'self'; script-src 'self' {inline}; style-src 'self' 'unsafe-inline'; "
        "img-src 'self' data: blob:; object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )

    @server.before_request
    def refuse() -> Response | None:
        host, origin = request.host, request.headers.get("Origin")
        if host not in allowed:
            return said(403, "this server answers to its own address only")
        if origin is not None and origin.removeprefix("http://") not in allowed:
            return said(403, "another site may not ask this server")
        if request.headers.get("Sec-Fetch-Site", "none") not in ("same-origin", "none") and not _opens_the_page():
            return said(403, "another site may not ask this server")
        if request.path == CALLBACK:
            return _refused_callback(callbacks)
        odd = "//" in request.path or ".." in request.path
        if request.path.startswith(FOLDER) and not odd:
            return _refused_of_recordings()
        if odd or (request.path not in PAGES and not request.path.startswith(FOLDERS)):
            return said(404, "there is no such page")
        return None if request.method in ("GET", "HEAD") else said(405, "only reading is allowed here")

    @server.errorhandler(DependencyException)
    def no_such_part(error: DependencyException) -> Response:
        return said(404, "there is no such page")

    @server.errorhandler(HTTPException)
    def refused(error: HTTPException) -> Response:
        return said(error.code or 500, (error.description or error.name).replace("\n", " "))

    @server.errorhandler(InputError)
    def in_words(error: InputError) -> Response:
        return Response(str(error), status=400, mimetype="text/plain")

    @server.after_request
    def harden(answer: Response) -> Response:
        answer.headers["Content-Security-Policy"] = policy
        answer.headers["X-Content-Type-Options"] = "nosniff"
        answer.headers["Referrer-Policy"] = "no-referrer"
        answer.headers["Cross-Origin-Resource-Policy"] = "same-origin"
        if request.path == ICON:  # browsers ask for it anew whenever the address changes, with every move of a slider
            answer.headers["Cache-Control"] = "max-age=3600"
        return answer


def _opens_the_page() -> bool:
    """A link on another page that leads here."""
    return request.path in OPENED and request.headers.get("Sec-Fetch-Mode") == "navigate"


def _too_large(most: int) -> Response | None:
    """A body of more than so many bytes, or of no stated size."""
    if request.content_length is None:
        return said(411, "a request must say how many bytes it has")
    return said(413, f"a request may have {most} bytes") if request.content_length > most else None


def _refused_of_recordings() -> Response | None:
    if request.url_rule is None or not request.url_rule.rule.startswith(FOLDER):
        return said(404, "there is no such page")
    if request.method != "POST":
        return None if request.method in ("GET", "HEAD") else said(405, "only reading is allowed here")
    return _too_large(LARGEST_FILE if "/file/" in request.path else LARGEST_BODY)


def _refused_callback(callbacks: Mapping[str, Any]) -> Response | None:
    if request.method != "POST":
        return said(405, "only the page itself asks here")
    if request.content_length is None:
        return said(400, "this is no request of the page")
    if (too_large := _too_large(LARGEST_BODY)) is not None:
        return too_large
    try:
        body = request.get_json(silent=True)
    except RecursionError:
        body = None
    if not isinstance(body, dict) or not isinstance(body.get("output"), str) or body["output"] not in callbacks:
        return said(400, "this is no request of the page")
    asked = callbacks[body["output"]]
    same = _same(body.get("inputs", []), asked["inputs"]) and _same(body.get("state", []), asked["state"])
    same = same and _outputs(body.get("outputs")) == body["output"]
    changed = body.get("changedPropIds", [])
    if not same or not isinstance(changed, list) or not all(isinstance(one, str) for one in changed):
        return said(400, "this is no request of the page")
    return None if _is_small(body) else said(400, "this is no request of the page")


def _same(given: Any, declared: Any) -> bool:
    """Whether values are given for what a callback takes, and for nothing else."""
    if not isinstance(given, list) or len(given) != len(declared):
        return False
    return all(
        isinstance(one, dict) and one.get("id") == wanted["id"] and one.get("property") == wanted["property"]
        for one, wanted in zip(given, declared, strict=True)
    )


def _outputs(given: Any) -> str:
    """The name of a callback from the outputs that a request lists."""
    listed = given if isinstance(given, list) else [given]
    if not all(isinstance(one, dict) for one in listed):
        return ""
    names = [f"{one.get('id')}.{one.get('property')}" for one in listed]
    return names[0] if isinstance(given, dict) else f"..{'...'.join(names)}.."


def _is_small(body: Any) -> bool:
    """Whether the values are few and not deeply nested."""
    level, count = [body], 0
    for _ in range(DEEPEST):
        inner = [value for one in level for value in _within(one)]
        count += len(inner)
        if count > MOST_VALUES:
            return False
        level = inner
    return not any(isinstance(one, dict | list) for one in level)


def _within(one: Any) -> Iterable[Any]:
    if isinstance(one, dict):
        return one.values()
    return one if isinstance(one, list) else ()


def said(code: int, words: str) -> Response:
    """An answer in plain words.

    Parameters
    ----------
    code : int
        Of HTTP, no unit.
    words : str
    """
    return Response(f"velotyre explore: {words}\n", status=code, mimetype="text/plain")
