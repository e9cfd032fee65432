"""How long the page of ``velotyre explore`` takes, measured inside headless Chromium: a script, not a test.

    python tests/benchmarks/explorer_in_the_browser.py

First plot: from the start of the navigation until the curves of the modes are in the page, the server being up and
each browser new. Slider: from the event of the slider until the figure of the modes is drawn anew, 8 states, 60 speeds,
names and critical speeds. The load of the machine is told, for it counts.

Where ``dash-bootstrap-components`` is installed too, the neighbouring project's web app (in BicycleParameters) is
measured in the same browser: its first curve, and its range of speeds moved until its curves are
drawn anew (100 speeds, 4 states).
"""

import os
import shutil
import socket
import subprocess
import sys
import time
from importlib.util import find_spec
from statistics import median

from playwright.sync_api import sync_playwright

STATE = (
    "bicycle=benchmark&effects.relaxation_length.tyre=Tyre1&effects.relaxation_length.pressure_bar.rear=5.5"
    "&effects.relaxation_length.pressure_bar.front=4&effects.steer_damper.damping=0.5"
)
STARTS, CHANGES = 5, 40
WATCH = """new MutationObserver((_, self) => {
  if (!document.querySelector('CURVE')) return;
  window.firstPlot = performance.now();
  self.disconnect();
}).observe(document, {childList: true, subtree: true});"""
CHANGE = """value => new Promise(done => {
  const slider = document.querySelector('input[type=range][data-key="KEY"]');
  const graph = document.querySelector('#modes .js-plotly-plot');
  const start = performance.now();
  const drawn = () => { graph.removeListener('plotly_afterplot', drawn); done(performance.now() - start); };
  graph.on('plotly_afterplot', drawn);
  slider.value = value;
  slider.dispatchEvent(new Event('input', {bubbles: true}));
})"""

OWN, NEIGHBOUR = "#modes .scatterlayer .trace", ".js-plotly-plot .scatterlayer .trace"
NEIGHBOUR_CHANGE = """value => new Promise(done => {
  const graph = document.querySelector('#geometry-plot .js-plotly-plot');  // its eigenvalues go there
  const start = performance.now();
  const drawn = () => { graph.removeListener('plotly_afterplot', drawn); done(performance.now() - start); };
  graph.on('plotly_afterplot', drawn);
  dash_clientside.set_props('range-slider', {value: [0, value]});
})"""


def main() -> None:
    """Print one line per measure: median and range in ms."""
    code = "from studies.cli import main; main(['explore', '--port', '0', '--no-browser'])"
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as served:
        assert served.stdout is not None
        address = served.stdout.readline().split()[2]
        try:
            with sync_playwright() as driver:
                browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
                print(f"load of the machine {os.getloadavg()[0]:.1f}; {os.cpu_count()} processors")
                first = [_first_plot(browser, f"{address}#{STATE}", OWN) for _ in range(STARTS)]
                _say("first plot", first)
                for key, low, high in (
                    ("effects.steer_damper.damping", 0.1, 4.9),
                    ("effects.relaxation_length.pressure_bar.front", 3.6, 7.4),
                ):
                    page = browser.new_page()
                    page.goto(f"{address}#{STATE}")
                    page.wait_for_selector("#motion-views path", state="attached", timeout=120_000)
                    page.wait_for_timeout(3000)
                    values = [low + (high - low) * k / CHANGES for k in range(CHANGES)]
                    times = []
                    for value in values:
                        times.append(page.evaluate(CHANGE.replace("KEY", key), f"{value:.4g}"))
                        page.wait_for_timeout(100)
                    _say(f"slider {key}", times)
                    page.close()
                if find_spec("dash_bootstrap_components"):
                    _neighbour(browser)
                browser.close()
        finally:
            served.terminate()


def _neighbour(browser: object) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    code = f"from bicycleparameters.app import app; app.run(port={port})"
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as served:
        try:
            _until_it_answers(port)
            address = f"http://127.0.0.1:{port}/"
            _say("neighbour, first plot", [_first_plot(browser, address, NEIGHBOUR) for _ in range(STARTS)])
            page = browser.new_page()  # type: ignore[attr-defined]
            page.goto(address)
            page.wait_for_selector(NEIGHBOUR, state="attached", timeout=120_000)
            page.wait_for_timeout(5000)
            times = []
            for k in range(CHANGES):
                times.append(page.evaluate(NEIGHBOUR_CHANGE, 5 + 5 * (k % 2)))
                page.wait_for_timeout(500)
            _say("neighbour, range of speeds", times)
        finally:
            served.terminate()


def _until_it_answers(port: int) -> None:
    for _ in range(600):
        with socket.socket() as trial:
            if trial.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.1)
    raise TimeoutError(f"nothing answers on port {port} after 60 s")


def _first_plot(browser: object, address: str, curve: str) -> float:
    context = browser.new_context()  # type: ignore[attr-defined]
    page = context.new_page()
    page.add_init_script(WATCH.replace("CURVE", curve))
    page.goto(address)
    page.wait_for_selector(curve, state="attached", timeout=120_000)
    found = float(page.evaluate("window.firstPlot"))
    context.close()
    return found


def _say(what: str, times: list[float]) -> None:
    print(f"{what}: median {median(times):.0f} ms ({min(times):.0f} to {max(times):.0f}, {len(times)} times)")


if __name__ == "__main__":
    main()
