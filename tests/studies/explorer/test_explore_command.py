"""``velotyre explore``: it says its address, refuses what it cannot use, and says how to install what is missing."""

import http.client
import os
import shlex
import socket
import subprocess
import sys
import time

import pytest


def test_without_dash_it_says_how_to_install_it(refused, monkeypatch):
    monkeypatch.setitem(sys.modules, "dash", None)
    said = refused("explore")
    assert said.startswith("velotyre: dash is not installed; install it with: pip install ")
    assert "[explore]" in said


def test_a_port_that_is_taken_is_refused(refused):
    pytest.importorskip("dash", reason="the page needs dash (extra explore)")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        line = refused("explore", "--no-browser", "--port", port)
    assert line.startswith(f"velotyre: --port {port} cannot be used (")
    assert line.endswith("; give another one, or 0 for a free one\n")


def test_it_opens_the_browser_at_the_address_that_it_says_serves_there_and_ends_when_interrupted(tmp_path):
    pytest.importorskip("dash", reason="the page needs dash (extra explore)")
    opened = tmp_path / "opened"
    browser = tmp_path / "browser"
    browser.write_text(f'#!/bin/sh\nprintf "%s" "$1" > {shlex.quote(str(opened))}.part\n'
                       f'mv {shlex.quote(str(opened))}.part {shlex.quote(str(opened))}\n')  # fmt: skip
    browser.chmod(0o755)
    code = "from studies.cli import main; main(['explore', 'pista', '--port', '0'])"
    settings = os.environ | {"BROWSER": str(browser)}
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=settings) as served:
        try:
            line = served.stdout.readline()
            assert line.startswith("velotyre explorer: http://127.0.0.1:")
            address = line.split()[2]
            page = http.client.HTTPConnection(address.removeprefix("http://").rstrip("/"), timeout=30)
            page.request("GET", "/")
            assert b'data-initial="bicycle=pista"' in page.getresponse().read()
            page.close()
            for _ in range(300):
                if opened.exists():
                    break
                time.sleep(0.1)
            assert opened.read_text() == address
        finally:
            served.terminate()
