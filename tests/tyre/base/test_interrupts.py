"""An interrupt that a callback swallows ends the block all the same."""

import signal
import sys
import time

import pytest

from tyre.base.interrupts import interrupts_arrive


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


def test_other_errors_of_callbacks_are_told_as_before(monkeypatch):
    told = []
    monkeypatch.setattr(sys, "unraisablehook", told.append)
    with interrupts_arrive():
        Swallows(ValueError("x"))
    assert [found.exc_type for found in told] == [ValueError]
