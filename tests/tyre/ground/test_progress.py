"""Progress bars on terminals, and how to get a package that is missing."""

import io
import json
import signal
import sys
import time

import pytest

from tyre.ground import install_command, interrupts_arrive, optional_module, progress_bar

FOLDER, WHEEL = "file:///home/me/velo%20tyre", "file:///home/me/velotyre-1.0.0-py3-none-any.whl"


class Installed:
    def __init__(self, origin):
        self.origin = origin

    def read_text(self, name):
        assert name == "direct_url.json"
        return json.dumps(self.origin) if self.origin else None


@pytest.mark.parametrize(("origins", "command"), [
    ([], 'pip install "velotyre[rider]"'), ([None], 'pip install "velotyre[rider]"'),
    ([{"url": FOLDER, "dir_info": {}}], 'pip install "/home/me/velo tyre[rider]"'),
    ([None, {"url": FOLDER, "dir_info": {"editable": True}}], 'pip install -e "/home/me/velo tyre[rider]"'),
    ([{"url": WHEEL, "archive_info": {}}], f'pip install "velotyre[rider] @ {WHEEL}"'),
    ([{"url": "https://example.org/velotyre", "vcs_info": {"vcs": "git", "commit_id": "0"}}],
     'pip install "velotyre[rider] @ git+https://example.org/velotyre"'),
])  # fmt: skip
def test_an_extra_comes_from_where_velotyre_came(monkeypatch, origins, command):
    monkeypatch.setattr("importlib.metadata.distributions", lambda name: map(Installed, origins))
    assert install_command("rider") == command
    with pytest.raises(ImportError, match="^no_such_package is not installed; install it with: ") as missing:
        optional_module("no_such_package", extra="rider")
    assert str(missing.value).endswith(f"{command} ([all] instead of [rider] installs every extra)")


def test_no_progress_bar_where_standard_error_is_no_terminal(monkeypatch):
    silent = io.StringIO()
    monkeypatch.setattr(sys, "stderr", silent)
    assert list(progress_bar(range(3), desc="work")) == [0, 1, 2]
    assert silent.getvalue() == ""

    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    for show in (True, False):
        screen = Terminal()
        monkeypatch.setattr(sys, "stderr", screen)
        assert list(progress_bar(range(3), desc="work", show=show)) == [0, 1, 2]
        assert ("work" in screen.getvalue()) == show


class Swallows:
    """Raises where Python prints exceptions and goes on."""

    def __init__(self, error):
        self.error = error

    def __del__(self):
        raise self.error


def work_until_interrupted(end):
    with interrupts_arrive():
        Swallows(KeyboardInterrupt())
        while time.monotonic() < end:
            time.sleep(0.01)


@pytest.fixture
def interruptible():
    """A process that was started in the background ignores interrupts."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_in_a_callback_arrives(capsys):
    before = sys.unraisablehook
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        work_until_interrupted(began + 20)
    assert time.monotonic() < began + 10
    assert sys.unraisablehook is before
    assert capsys.readouterr().err == ""
