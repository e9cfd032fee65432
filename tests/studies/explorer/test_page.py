"""The page in a browser: numbers, names, address, pins, files, keyboard, accessibility.

Eigenvalues of the benchmark bicycle at 5 m/s: Meijaard, Papadopoulos, Ruina & Schwab (2007), Proc. R. Soc. A 463,
table 2; those of a tyre model are taken from its state matrix by numpy.
"""

import base64
import csv
import gzip
import io
import json
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from bicycle import Model, read_model
from bicycle.model import build_model
from studies.explorer import start_state
from tests.shared.explorer_page import NOTHING_WAITS, QUIET, serious, settled, until

PUBLISHED = {
    "weave": complex(-0.77534188219585, 4.46486771378823),
    "capsize": -0.32286642900409,
    "castering": -14.07838969279822,
}
TYRES = (
    "bicycle=benchmark&effects.relaxation_length.tyre=Tyre1&effects.relaxation_length.pressure_bar.rear=5.5"
    "&effects.relaxation_length.pressure_bar.front=4&effects.steer_damper.damping=0.5&slow=2&fast=12&at=7"
)


def rows(page, name):
    """Cells of the table behind a figure, numbers with every digit."""
    details = page.locator(f"details[data-table={name}]")
    if details.get_attribute("open") is None:
        details.locator("summary").click()
    page.wait_for_selector(f"#table-{name} td")
    return page.eval_on_selector_all(
        f"#table-{name} tbody tr",
        "rows => rows.map(r => [...r.cells].map(c => 'value' in c.dataset ? Number(c.dataset.value) : c.textContent))",
    )


def roots(page):
    """Name -> eigenvalues (upper half) of the table at the chosen speed."""
    found = {}
    for name, real, imaginary, *_ in rows(page, "damping"):
        found.setdefault(name, []).append(complex(real, imaginary))
    return found


def test_numbers_of_a_tyre_model_are_those_of_its_state_matrix_and_travel_with_the_address(opened):
    page = opened(TYRES)
    settled(page, "7")
    model = build_model({"bicycle": "benchmark", "effects": {
        "relaxation_length": {"tyre": "Tyre1", "pressure_bar": {"rear": 5.5, "front": 4.0}},
        "steer_damper": {"damping": 0.5},
    }})  # fmt: skip
    expected = np.linalg.eigvals(model.linear_model().state_matrix(7.0))
    expected = np.sort_complex(expected[expected.imag >= 0])
    found = roots(page)
    assert {"weave", "wobble", "capsize"} <= set(found)
    assert np.sort_complex([z for every in found.values() for z in every]) == pytest.approx(
        expected, rel=1e-9, abs=1e-9
    )
    link, tables = page.url, [rows(page, name) for name in ("damping", "modes")]
    other = opened(link.partition("#")[2], new=True)
    settled(other, "7")
    assert other.url == link
    assert [rows(other, name) for name in ("damping", "modes")] == tables
    assert other.locator("[id='n-effects.steer_damper.damping']").input_value() == "0.5"


def test_the_keyboard_is_enough_and_the_way_back_ends_at_the_published_numbers(opened):
    page = opened("", new=True)
    settled(page)
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.className") == "skip"
    for _ in range(60):  # to the switch of the hands, by Tab alone
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.id") == "s-effects.rider_arms":
            break
    page.keyboard.press("Space")
    page.wait_for_selector("[id='n-effects.rider_arms.damping']")
    until(page, f"{QUIET} && document.activeElement.id === 's-effects.rider_arms'")
    page.keyboard.press("Tab")
    page.keyboard.press("ArrowRight")  # the slider of the first parameter
    until(page, "!location.hash.includes('inertia=0.1&')")
    assert page.locator("[id='n-effects.rider_arms.inertia']").input_value() not in ("0.1", "")
    page.keyboard.press("Alt+p")
    until(page, "[...document.querySelectorAll('#modes .legendtext')].pop().textContent.includes('pin 1: benchmark')")
    for _ in range(3):  # pin, slider, switch
        page.keyboard.press("Alt+z")
    assert page.inner_text("#busy") == "computing …"
    until(page, f"{QUIET} && !location.hash.includes('rider_arms')")
    settled(page)
    found = roots(page)
    assert set(found) == set(PUBLISHED)
    for name, value in PUBLISHED.items():
        assert found[name] == [pytest.approx(value, abs=1e-9)]
    critical = [(row[1], row[0]) for row in rows(page, "critical")]
    assert critical == [("weave", pytest.approx(4.29238253634111, abs=1e-9)),
                        ("capsize", pytest.approx(6.02426201538837, abs=1e-9))]  # fmt: skip
    assert page.locator("#modes .legendtext").all_text_contents() == ["weave", "capsize", "castering"]


def test_what_is_taken_away_opens(opened, tmp_path, browser):
    page = opened(TYRES + "&name=x")
    settled(page, "7")
    page.wait_for_selector("#motion-views path", state="attached")
    still = page.locator("#motion-views path:not(.ghost)").first.get_attribute("d")
    page.click("#play")
    until(page, f"document.querySelector('#motion-views path:not(.ghost)').getAttribute('d') !== {still!r}")
    page.click("#play")

    def saved(button, name):
        with page.expect_download() as found:
            page.locator(button).click()
        assert found.value.suggested_filename == name
        found.value.save_as(tmp_path / name)
        return tmp_path / name

    model = read_model(saved("#save-model", "benchmark.toml"))
    assert isinstance(model, Model)
    assert {effect.identifier for effect in model.effects} == {"relaxation_length", "steer_damper"}
    table = list(csv.DictReader(io.StringIO(saved("#save-csv", "benchmark_eigenvalues.csv").read_text())))
    assert [float(table[0]["speed_m_s"]), float(table[-1]["speed_m_s"])] == [2.0, 12.0]
    assert len(rows(page, "modes")) == len(table)
    svg = saved("button[data-image=modes][data-format=svg]", "velotyre_modes.svg").read_text()
    assert svg.startswith("<svg")
    assert "wobble" in svg
    assert saved("button[data-image=locus][data-format=png]", "velotyre_locus.png").read_bytes()[:4] == b"\x89PNG"
    assert page.inner_text("#text-command").startswith("cat > model.toml <<'END_OF_MODEL'")
    assert "vt.build_model({'bicycle': 'benchmark'" in page.inner_text("#text-python")

    whole = saved("#save-page", "benchmark.html")
    assert whole.stat().st_size < 2_000_000
    context = browser.new_context(offline=True, reduced_motion="reduce")
    other, asked, errors = context.new_page(), [], []
    other.on("request", lambda request: asked.append(request.url))
    other.on("pageerror", lambda error: errors.append(str(error)))
    other.goto(whole.as_uri())
    other.wait_for_selector("html[data-ready=yes]")
    assert other.locator(".js-plotly-plot").count() == 5
    assert errors == []
    assert [url for url in asked if not url.startswith(("file:", "blob:", "data:"))] == []
    other.locator("summary", has_text="Table: damping").click()
    other.wait_for_selector("figure[aria-label^=Damping] td[data-value]")
    shown = other.eval_on_selector_all(
        "figure[aria-label^=Damping] td[data-value]", "c => c.map(x => Number(x.dataset.value))"
    )
    assert roots(page)["wobble"][0].real in shown
    with other.expect_download() as found:
        other.locator("a[download$='.toml']").click()
    assert tomllib.loads(Path(found.value.path()).read_text())["effects"]["steer_damper"] == {"damping": 0.5}
    context.close()


def test_files_that_are_dropped(opened):
    page = opened()
    settled(page)

    def drop(name, text):
        page.set_input_files("#upload input", files={"name": name, "mimeType": "text/plain", "buffer": text.encode()})

    drop("long.txt", "0" * 1_000_001)
    until(page, "document.getElementById('message').textContent")
    assert page.inner_text("#message").startswith("long.txt: 1000001 bytes exceed the limit of 1000000 bytes for a")
    page.set_input_files(
        "#upload input",
        files=[{"name": f"{k}.csv", "mimeType": "text/plain", "buffer": b"0" * 900_000} for k in range(3)],
    )
    until(page, "document.getElementById('message').textContent.startsWith('the files have 2700000 bytes together')")
    drop("mine.toml", "[values]\nw = 'wide'\n")
    until(page, "document.getElementById('message').textContent.startsWith(\"mine.toml: [values]: w = 'wide'\")")
    drop(
        "model.toml",
        'bicycle = "pista"\n[effects.steer_damper]\ndamping = 1.0\n[effects.side_slip]\ntyre="/etc/passwd.csv"\n',
    )
    until(page, "document.getElementById('message').textContent.includes('which was not dropped; drop both together')")
    drop("model.toml", 'bicycle = "pista"\n[effects.steer_damper]\ndamping = 1.0\n')
    until(page, f"{QUIET} && document.getElementById('what').textContent === 'pista, no slip, steer damper'")
    assert page.url.endswith("#bicycle=pista&effects.steer_damper.damping=1")


def test_refusals_are_words_and_names_are_text(opened):
    page = opened("bicycle=benchmark&name=%3Cimg%20src%3Dx%20onerror%3Dalert(1)%3E&effects.steer_damper.damping=-3")
    until(page, "document.getElementById('message').textContent")
    assert page.inner_text("#message") == (
        "effect 'steer_damper': damping = -3 N m s/rad is outside 0 .. inf N m s/rad (wrong sign?) "
        "(The figures show the last model that could be computed.)"
    )
    values = "&".join(
        f"bicycle.{key}={value!r}" for key, value in build_model({"bicycle": "pista"}).bicycle.values.items()
    )
    page.evaluate(
        "state => { location.hash = state; }",
        f"{values}&name=%3Cimg%20src%3Dx%20onerror%3Dalert(1)%3E&pin=bicycle%3Dbenchmark",
    )
    settled(page)
    assert page.inner_text("#what").startswith("<img src=x onerror=alert(1)>")
    assert page.locator("#page img[src=x]").count() == 0


def test_no_serious_finding_of_axe(opened):
    """Wide and light, narrow and dark."""
    page = opened(f"{TYRES}&effects.rider_arms.damping=1")
    for width, scheme in ((1300, "light"), (390, "dark")):
        page.set_viewport_size({"width": width, "height": 844})
        page.emulate_media(color_scheme=scheme)
        page.wait_for_selector(f"html[data-theme={scheme}]")
        page.wait_for_timeout(300)  # the figures are asked for in other colours
        settled(page, "7")
        until(page, NOTHING_WAITS)
        page.wait_for_selector("#motion-views path", state="attached")
        assert serious(page) == []
        page.wait_for_function("width => document.documentElement.scrollWidth <= width", arg=width)
    assert page.inner_text("#play") == "Play"  # nothing moves unasked where motion is to be reduced
    still = page.locator("#motion-views svg path").first.get_attribute("d")
    page.wait_for_timeout(200)
    assert page.locator("#motion-views svg path").first.get_attribute("d") == still
    page.emulate_media(color_scheme="light")
    page.set_viewport_size({"width": 1300, "height": 900})


BOXES = """name => {
  const graph = document.querySelector('#' + name + ' .js-plotly-plot');
  const box = part => { const r = part.getBoundingClientRect(); return [r.left, r.top, r.right, r.bottom]; };
  const all = selector => [...graph.querySelectorAll(selector)].map(box);
  return {graph: box(graph), titles: all('.gtitle, .gtitle-subtitle'), legend: all('.legend .bg'),
          axes: all('.xtitle, .x2title, .xtick text'), labels: all('.textpoint text'), bars: all('.yerror')};
}"""


def overlap(one, other):
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


def test_no_axis_title_is_cut_on_a_phone(shared, opened):
    """The sensitivities of this model leave their axis the least width."""
    shared.set_viewport_size({"width": 390, "height": 900})
    page = opened(TYRES, new=True)
    settled(page, "7")
    until(page, NOTHING_WAITS)
    for name in ("modes", "critical", "locus", "damping", "sensitivity", "amplitude"):
        boxes = page.evaluate(BOXES, name)
        assert all(boxes["graph"][0] <= part[0] < part[2] <= boxes["graph"][2] for part in boxes["axes"]), name
    shared.set_viewport_size({"width": 1300, "height": 900})


@pytest.mark.parametrize("width", [390, 1280, 1440])  # the last has three figures side by side
def test_nothing_of_a_figure_is_cut_or_printed_over(shared, opened, width):
    """With a soft front frame: six modes, wobble unstable at 10 m/s, a title of three lines."""
    shared.set_viewport_size({"width": width, "height": 900})
    page = opened(f"{start_state(None).address}&x=speed%3D2:30&y=pressure_bar", new=True)
    settled(page, "10")
    until(page, NOTHING_WAITS)
    page.click("#draw-chart")
    page.wait_for_selector("#chart-place:not([hidden]) #chart .scatterlayer .trace", state="attached")
    page.wait_for_selector("#amplitude .legend", state="attached")
    for name in ("modes", "critical", "locus", "damping", "sensitivity", "amplitude", "chart"):
        boxes = page.evaluate(BOXES, name)
        left, top, right, bottom = boxes.pop("graph")
        assert boxes["titles"]
        for part in (part for parts in boxes.values() for part in parts):
            assert left - 1 <= part[0] < part[2] <= right + 1, (name, part)
            assert top - 1 <= part[1] < part[3] <= bottom + 1, (name, part)
        for label in boxes["labels"]:
            assert not any(overlap(label, bar) for bar in boxes["bars"]), name
            assert not any(overlap(label, other) for other in boxes["labels"] if other != label), name
        for legend in boxes["legend"]:
            assert boxes["axes"]
            assert all(part[3] <= legend[1] + 1 for part in boxes["axes"]), (name, legend, boxes["axes"])
    sizes = page.eval_on_selector_all("#damping .textpoint text", "all => all.map(t => getComputedStyle(t).fontSize)")
    assert sizes == ["12px"] * 4
    marks = page.eval_on_selector_all(
        "#chart .legend .traces",
        "all => all.map(one => [one.textContent, getComputedStyle(one.querySelector('.js-line')).strokeDasharray])",
    )
    looks = {words: dash for words, dash in marks if words in ("model", "measured pressure")}
    assert len(looks) == len(set(looks.values())) == 2
    shared.set_viewport_size({"width": 1300, "height": 900})


WIDTHS = """() => [...document.querySelectorAll('.under')].map(part =>
    [part.getBoundingClientRect().width, part.querySelector('.table').getBoundingClientRect().width])"""
CUT = """() => [...document.querySelectorAll('input[type=number]')]
    .filter(one => one.clientWidth && one.scrollWidth > one.clientWidth).map(one => one.id + ' ' + one.value)"""


@pytest.mark.parametrize("width", [390, 1440])
def test_a_table_is_as_wide_as_its_figure_and_a_field_shows_its_number(shared, opened, width):
    shared.set_viewport_size({"width": width, "height": 900})
    page = opened(start_state(None).address, new=True)
    settled(page, "10")
    until(page, NOTHING_WAITS)
    page.evaluate("document.querySelectorAll('details').forEach(one => { one.open = true; })")
    widths = page.evaluate(WIDTHS)
    assert len(widths) == 7  # the last is the chart, not drawn yet
    assert all(table == pytest.approx(figure, abs=1) for figure, table in widths)
    assert page.evaluate(CUT) == []
    shared.set_viewport_size({"width": 1300, "height": 900})


def kept_in(download):
    """What a saved page holds, which its script unpacks."""
    packed = re.search(r'id="content">(.*?)</script>', Path(download.path()).read_text(encoding="utf-8"), re.DOTALL)[1]
    return json.loads(gzip.decompress(base64.b85decode(packed)))


EVERY_WORD_OF_THE_CHART = """() => {
    const place = document.getElementById("chart-busy");
    window.said = [];
    new MutationObserver(() => window.said.push(place.textContent)).observe(place, {childList: true, subtree: true});
}"""


def test_a_stability_chart_of_two_numbers(opened):
    page = opened("bicycle=benchmark&x=speed=1:10:log")
    settled(page)
    page.select_option("#chart-y", "c")
    assert page.input_value("#chart-y-low") == "0.04"
    page.fill("#chart-y-low", "0.05")
    page.evaluate(EVERY_WORD_OF_THE_CHART)
    page.click("#draw-chart")
    page.wait_for_selector("#chart-place:not([hidden]) #chart .scatterlayer .trace", state="attached")
    until(page, "!document.getElementById('chart-busy').textContent")
    assert "computing the chart …" in page.evaluate("window.said")
    assert page.url.endswith("&x=speed%3D1:10:log&y=c%3D0.05:0.12")
    assert sorted(page.locator("#chart .legendtext").all_text_contents()) == ["capsize", "model", "weave"]
    points = rows(page, "chart")
    for mode, speed in (("weave", 4.29238253634111), ("capsize", 6.02426201538837)):  # of the paper, at its trail
        here = sorted((trail, along) for _, name, along, trail, *_ in points if name == mode)
        assert np.interp(0.08, *zip(*here, strict=True)) == pytest.approx(speed, abs=1e-4)
    weave = [hertz for _, name, _, _, hertz, *_ in points if name == "weave"]
    assert all(0.3 < hertz < 0.7 for hertz in weave)
    with page.expect_download() as found:
        page.click("#save-chart")
    assert found.value.suggested_filename == "benchmark_stability_chart.csv"
    table = list(csv.DictReader(io.StringIO(Path(found.value.path()).read_text())))
    assert [float(row["speed_m_s"]) for row in table] == [row[2] for row in points]
    page.fill("#n-at", "6")  # the speed is an axis: the chart stays true
    settled(page, "6")
    assert page.inner_text("#chart-busy") == ""
    with page.expect_download() as found:
        page.click("#save-page")
    content = kept_in(found.value)
    kept = content["figures"]["Stability chart"]["layout"]["meta"]["rows"]
    assert {row[2] for row in points} <= {cell for row in kept for cell in row}
    assert (
        sum(line.startswith("stability chart: shaded: at least one mode is unstable") for line in content["notes"]) == 1
    )
    page.select_option("#c-bicycle", "pista")
    until(page, "document.getElementById('chart-busy').textContent === 'of an earlier model; redraw'")
    with page.expect_download() as found:  # which is not of what is shown
        page.click("#save-page")
    assert "Stability chart" not in kept_in(found.value)["figures"]
    page.fill("#chart-y-low", "0.2")
    page.click("#draw-chart")
    until(
        page, "document.getElementById('chart-said').textContent.includes('the range must be finite, LOW below HIGH')"
    )
