"""One server and one headless browser for all tests of the page."""

import os
import shutil
import threading

import pytest

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


@pytest.fixture(scope="session")
def address():
    """Where the page is served, as ``velotyre explore`` does it."""
    pytest.importorskip("dash", reason="the page needs dash (extra explore)")
    from werkzeug.serving import make_server

    from studies.explorer import CLOSE, HOST, build_server, open_socket

    place = open_socket(0)
    port = place.getsockname()[1]
    application = build_server("", port)
    server = make_server(HOST, port, application, threaded=True, fd=os.dup(place.fileno()))
    place.close()
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield f"http://{HOST}:{port}/"
    server.shutdown()
    thread.join()
    server.server_close()
    application.extensions[CLOSE]()


@pytest.fixture(scope="session")
def client():
    """Asks a server that does not listen; the process of its computations serves all tests: its imports take long."""
    pytest.importorskip("dash", reason="the page needs dash (extra explore)")
    from studies.explorer import CLOSE, build_server

    server = build_server("", 8050)
    yield server.test_client()
    server.extensions[CLOSE]()


@pytest.fixture(scope="session")
def browser():
    """Headless Chromium."""
    playwright = pytest.importorskip("playwright.sync_api", reason="browser tests need playwright")
    if CHROMIUM is None:
        pytest.skip("browser tests need chromium (apt-get install chromium)")
    with playwright.sync_playwright() as driver:
        found = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield found
        found.close()


STILL = {"viewport": {"width": 1300, "height": 900}, "accept_downloads": True, "reduced_motion": "reduce"}
"""What moves unasked would be drawn all the time."""


@pytest.fixture(scope="session")
def shared(browser):
    """The page of all tests: reading its programs in another one costs more than what is done on it."""
    return browser.new_context(**STILL).new_page()


@pytest.fixture
def opened(shared, address):
    """Open the page at a state; at the end the console must be free of errors.

    It goes there as from a link, or is loaded anew where it is ``new``.
    """
    errors = []

    def heard(message):
        errors.extend([message.text] if message.type in ("error", "warning") else [])

    def failed(error):
        errors.append(str(error))

    def at(state="bicycle=benchmark", *, new=False):
        if new:
            shared.goto("about:blank")
        shared.goto(f"{address}#{state}" if state else address)
        return shared

    shared.on("console", heard)
    shared.on("pageerror", failed)
    yield at
    shared.remove_listener("console", heard)
    shared.remove_listener("pageerror", failed)
    assert errors == []
