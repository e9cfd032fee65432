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

    from studies.explorer import CLOSE, HOST, build_server, listening

    place = listening(0)
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


@pytest.fixture
def opened(browser, address):
    """Open the page at a state in a browser of its own; at the end the console must be free of errors.

    Where ``path`` is None, nothing is opened yet.
    """
    contexts, errors = [], []

    def heard(message):
        errors.extend([message.text] if message.type in ("error", "warning") else [])

    def at(state="", path="", **settings):
        usual = {"viewport": {"width": 1300, "height": 900}, "accept_downloads": True}
        contexts.append(browser.new_context(**(usual | settings)))
        page = contexts[-1].new_page()
        page.on("console", heard)
        page.on("pageerror", lambda error: errors.append(str(error)))
        if path is not None:
            page.goto(f"{address}{path}#{state}" if state else f"{address}{path}")
        return page

    yield at
    for context in contexts:
        context.close()
    assert errors == []
