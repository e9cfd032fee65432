"""Kernels are compiled by a second process while the first one compiles others: of the right types, and only there."""

import subprocess

import pytest

pytest.importorskip("numba")

from numba import typeof

from bicycle.critical.critical_speeds import critical_speeds
from bicycle.modal import compiled_ahead as module
from bicycle.modal.compiled_ahead import compile_half, compiled_ahead, examples


def test_the_types_are_those_of_every_call(tyred):
    """Another type would be compiled a second time, and the first for nothing."""
    critical_speeds(tyred(), 10.0, fast=True)
    compile_half(0)  # at hand: compiles nothing
    compile_half(1)
    for kernel, arguments in (*examples()[0], *examples()[1]):
        assert kernel.signatures == [tuple(typeof(x) for x in arguments)]


class Process:
    """Of a compiler that never ends."""

    def __init__(self, asked):
        self.asked = asked

    def wait(self, timeout=None):
        self.asked.append(("wait", timeout))
        if timeout is not None:
            raise subprocess.TimeoutExpired("compile", timeout)

    def kill(self):
        self.asked.append(("kill", None))


@pytest.fixture
def begun(monkeypatch):
    """What the other process was asked; nothing is kept."""
    asked = []
    monkeypatch.setattr(module, "kept", lambda _: False)
    monkeypatch.setattr(module, "compile_half", lambda half: asked.append(("compile", half)))
    monkeypatch.setattr(module, "_begun", module._begun.__wrapped__)

    def opened(command, **settings):
        asked.append(("begin", command[1]))
        return Process(asked)

    monkeypatch.setattr(module.subprocess, "Popen", opened)
    return asked


def test_one_that_never_ends_is_stopped(begun):
    with compiled_ahead():
        assert begun == [("begin", "-c")]
    assert begun[1:] == [("compile", 1), ("wait", module.LONGEST), ("kill", None), ("wait", None)]


@pytest.mark.parametrize("why", ["a worker", "frozen", "no room", "kept"])
def test_where_none_is_begun(begun, monkeypatch, why):
    def full(*_, **__):
        raise OSError("no more processes")

    if why == "a worker":
        monkeypatch.setattr(module, "parent_process", lambda: "parent")
    elif why == "frozen":
        monkeypatch.setattr(module.sys, "frozen", True, raising=False)
    elif why == "no room":
        monkeypatch.setattr(module.subprocess, "Popen", full)
    else:
        monkeypatch.setattr(module, "kept", lambda _: True)
    with compiled_ahead():
        pass
    assert begun == []
