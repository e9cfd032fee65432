"""Waiting for the page of ``velotyre explore``."""

import time

import pytest

QUIET = "!document.getElementById('busy').textContent && !document.getElementById('message').textContent"

NOTHING_WAITS = "document.getElementById('figures').getAttribute('aria-busy') === 'false'"


def until(page, expression):
    """Wait for an expression; Playwright's own way needs eval, which the page's policy forbids."""
    end = time.monotonic() + 30
    tried = f"(() => {{ try {{ return Boolean({expression}) }} catch {{ return false }} }})()"  # not there yet
    while not page.evaluate(tried):
        assert time.monotonic() < end, f"{expression}: {page.inner_text('#page')[:300]} {page.url}"
        page.wait_for_timeout(30)


def settled(page, speed="5"):
    """Wait until the figures at one speed are those of ``speed``."""
    until(page, f"{QUIET} && document.querySelector('#damping .gtitle')?.textContent.includes('at {speed} m/s')")


def serious(page):
    """Serious findings of an accessibility check, each with the first elements it is about; axe-core must be there."""
    axe = pytest.importorskip("axe_core_python.sync_playwright", reason="the check needs axe-core-python")
    only_what_fails = {"resultTypes": ["violations"]}  # what passes is not described: thousands of elements
    return [
        (one["id"], [node["html"][:120] for node in one["nodes"][:3]])
        for one in axe.Axe().run(page, options=only_what_fails)["violations"]
        if one["impact"] in ("serious", "critical")
    ]
