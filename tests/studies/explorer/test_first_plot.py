"""What is seen first, and what follows a slider, does not wait for Dash; what comes later is complete all the same."""

import json
import threading
from collections import Counter

import pytest

from tests.shared.explorer_page import NOTHING_WAITS, QUIET, settled, until

CURVES = "#modes .scatterlayer .trace"
DAMPER = "effects.steer_damper.damping"
DAMPED = f"bicycle=benchmark&{DAMPER}=0.5"
LOCUS = "document.querySelector('#locus .graph').data.map(one => one.x)"
MOVE = """([key, values]) => {
  const field = document.querySelector(`input[type=number][data-key="${key}"]`);  // which takes a value as it is
  for (const value of values) { field.value = value; field.dispatchEvent(new Event('input', {bubbles: true})); }
}"""

MOVE_ON = """async ([key, values]) => {
  const graph = document.querySelector('#modes .js-plotly-plot');
  const field = document.querySelector(`input[type=number][data-key="${key}"]`);
  for (const value of values) {
    const drawn = new Promise(done => graph.once('plotly_afterplot', done));
    field.value = value;
    field.dispatchEvent(new Event('input', {bubbles: true}));
    await drawn;
    await new Promise(done => setTimeout(done, 0));
  }
}"""


def questions(page):
    """Names of the callbacks that the page asks, counted, from now on."""
    found = Counter()

    def asked(request):
        if "/_dash-update-component" in request.url:
            found[request.post_data_json["output"]] += 1

    page.on("request", asked)
    return found


@pytest.fixture
def held(shared, address):
    """Opens a state on a page whose programs of Dash do not come until it is told; what it asked; and how it is told.

    The event of a page that is loaded would wait for Dash where the first plot, which asks for it, comes before.
    """
    page, may_come = shared.context.new_page(), threading.Event()
    waiting, errors = [], []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.on("console", lambda said: errors.extend([said.text] if said.type in ("error", "warning") else []))

    def hold(route):
        if may_come.is_set():
            route.continue_()
        else:
            waiting.append(route)

    page.route("**/_dash-component-suites/**", hold)
    found = questions(page)

    def let():
        may_come.set()
        for route in waiting:
            route.continue_()

    def go(state):
        page.goto(f"{address}#{state}", wait_until="domcontentloaded")
        return page

    yield go, found, let
    page.close()
    assert errors == []


def test_the_first_plot_its_names_and_its_controls_need_no_dash(held):
    go, asked, let = held
    page = go(DAMPED)
    page.wait_for_selector(CURVES, state="attached")
    page.wait_for_selector(f"[id='n-{DAMPER}']")
    assert page.evaluate("typeof window.DashRenderer") == "undefined"
    assert {"weave", "capsize", "castering"} <= set(page.locator("#modes .legendtext").all_text_contents())
    assert page.inner_text("#what") == "benchmark, no slip, steer damper"
    assert asked == {"along.data": 1, "form.data": 1}
    page.evaluate(MOVE, [DAMPER, ["0.7"]])  # and moves before Dash is there
    until(page, f"location.hash.includes('{DAMPER}=0.7') && {LOCUS}.length")
    let()
    settled(page)
    until(page, NOTHING_WAITS)
    assert "damping = 0.7" in page.inner_text("#text-command")
    assert asked["along.data"] == 2  # Dash asks none of it again
    assert asked["form.data"] == 1


def test_a_slider_that_moves_is_followed_and_what_is_at_one_speed_waits_for_the_end_of_a_move(opened):
    """By its last value where it is faster than the page, and every figure with it."""
    values = [f"{0.6 + k / 10:g}" for k in range(20)]
    page = opened(f"bicycle=benchmark&{DAMPER}={values[-1]}", new=True)
    settled(page)
    until(page, f"{NOTHING_WAITS} && {LOCUS}.length")
    loaded = page.evaluate(f"JSON.stringify({LOCUS})")
    opened(DAMPED)
    settled(page)
    until(page, f"{NOTHING_WAITS} && JSON.stringify({LOCUS}) !== {json.dumps(loaded)}")
    asked = questions(page)
    page.evaluate(MOVE, [DAMPER, values])
    until(page, f"document.getElementById('text-command').textContent.includes('damping = {values[-1]}')")
    until(page, f"{NOTHING_WAITS} && {QUIET}")
    assert asked["along.data"] == 2  # the first value and the last one
    assert asked["damping.data"] == asked["motion.data"] == 1
    assert page.url.endswith(f"{DAMPER}={values[-1]}")
    assert page.locator("#locus").bounding_box()["y"] > 900  # it is not seen, yet drawn anew
    until(page, f"JSON.stringify({LOCUS}) === {json.dumps(loaded)}")
    until(page, NOTHING_WAITS)
    asked.clear()
    page.evaluate(MOVE_ON, [DAMPER, ["0.6", "0.7", "0.8"]])
    until(page, f"document.getElementById('text-command').textContent.includes('damping = 0.8') && {NOTHING_WAITS}")
    assert asked == {"along.data": 3, "damping.data": 1, "sensitivity.data": 1, "amplitude.data": 1, "motion.data": 1}


def test_a_server_that_ended_or_refuses_is_told_in_words(shared, address):
    page = shared.context.new_page()
    page.goto(f"{address}#{DAMPED}")
    settled(page)
    until(page, NOTHING_WAITS)
    page.route("**/_dash-update-component*", lambda route: route.abort())
    page.evaluate(MOVE, [DAMPER, ["0.9"]])
    until(page, "document.getElementById('message').textContent")
    assert page.inner_text("#message") == (
        "velotyre explore does not answer; start it again in the terminal, then load this page again (The figures show "
        "the last model that could be computed.)"
    )
    page.unroute_all()
    refusal = "velotyre explore: this is no request of the page"
    page.route("**/_dash-update-component*", lambda route: route.fulfill(status=400, body=f"{refusal}\n"))
    page.reload()
    until(page, "document.getElementById('message').textContent")
    assert page.inner_text("#message") == refusal
    page.close()
