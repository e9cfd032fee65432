"""Waiting for the page of ``velotyre explore``."""

import time

QUIET = "!document.getElementById('busy').textContent && !document.getElementById('message').textContent"


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
