"""The page of recordings in a browser: look, map, fit, diagnose, cancel, download, keyboard, accessibility.

The decay is made of the weave eigenvalue of the benchmark bicycle at 5 m/s: Meijaard, Papadopoulos, Ruina & Schwab
(2007), Proc. R. Soc. A 463, table 2. The modal table is that of docs/measurement_files.md: the weave of the benchmark
bicycle with a steer damper of 2 N m s/rad.
"""

import io
import json
import zipfile
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("dash", reason="the page needs dash (extra explore)")

from studies.cli import main
from tests.shared.explorer_page import serious
from tyre.base.paths import data_root

WEAVE = complex(-0.77534188219585, 4.46486771378823)
SLOW = 120_000  # ms, on a machine with other work
KICK = Path(str(data_root())) / "measured" / "synthetic_kicks" / "kick_5.2_a.csv"
MEASUREMENT = """kind = "modal"
bicycle = "benchmark"
[uncertainty]
lam = 0.005
[modal]
table = "weave.csv"
"""
TABLE = """speed_m_s,mode,real_1_s,imag_rad_s,real_sd_1_s,imag_sd_rad_s
4.0,weave,0.778,1.736,0.05,0.05
4.6,weave,-0.144,2.327,0.05,0.05
5.2,weave,-0.818,3.361,0.05,0.05
5.8,weave,-1.202,4.000,0.05,0.05
6.4,weave,-1.504,4.801,0.05,0.05
7.0,weave,-1.840,5.635,0.05,0.05
7.6,weave,-2.149,6.309,0.05,0.05
8.2,weave,-2.444,7.043,0.05,0.05
"""
LEFT_OUT = (
    "aerodynamic_drag, crown_radius, luggage, pneumatic_trail, relaxation_length, side_slip, twisting_torque, bar_bag, "
    "rider_arms, rider_lean, speed_scale, speed_offset, wrong_tilt, wrong_trail, front_compliance"
)


def log():
    """A decay as a logger wrote it: no units, a sensor upside down, deg/s and milliseconds."""
    time = np.arange(0, 5, 0.01)
    roll = -20 * np.exp(WEAVE * time).real + np.random.default_rng(1).normal(0, 0.1, time.size)
    return "clk,G1\n" + "".join(f"{1000 * t:.0f},{x:.4f}\n" for t, x in zip(time, roll, strict=True))


def load(page, **files):
    page.set_input_files(
        "#files",
        [{"name": name.replace("__", "."), "mimeType": "text/plain", "buffer": text.encode()}
         for name, text in files.items()],
    )  # fmt: skip
    for name in files:
        page.wait_for_selector(f"#file-rows td:text-is('{name.replace('__', '.')}')")


def answered(page, kind):
    """The sentence of a computation that has ended."""
    page.wait_for_selector(f"#result-{kind}[aria-busy=true]", state="attached")
    page.wait_for_selector(f"#result-{kind}[aria-busy=false] .verdict, #message:not(:empty)", timeout=SLOW)
    assert page.inner_text("#message") == ""
    return page.inner_text(f"#result-{kind} .verdict")


def table(page, kind, words):
    """Heads and cells, numbers with every digit."""
    details = page.locator(f"#result-{kind} details", has=page.locator(f"summary:text-is('{words}')"))
    if details.get_attribute("open") is None:
        details.locator("summary").click()
    heads = details.locator("th[scope=col]").all_text_contents()
    rows = details.locator("tbody tr").evaluate_all(
        "rows => rows.map(r => [...r.cells].map(c => 'value' in c.dataset ? Number(c.dataset.value) : c.textContent))"
    )
    return heads, rows


def downloaded(page, kind):
    """Every file of the zip of a result: name and bytes."""
    with page.expect_download() as found:
        page.locator(f"#result-{kind} a", has_text="all as a zip").click()
    with zipfile.ZipFile(found.value.path()) as opened:
        return {name: opened.read(name) for name in opened.namelist()}


def test_a_recording_is_looked_at_mapped_and_fitted(opened, tmp_path, monkeypatch):
    page = opened(path="recording")
    load(page, log__csv=log())
    page.click("#run-look")
    assert "cannot be used for any fit as it is" in answered(page, "look")
    page.select_option("[aria-label='clk taken as']", "time")
    page.fill("[aria-label='Unit of clk']", "ms")
    page.select_option("[aria-label='G1 taken as']", "roll_rate")
    page.fill("[aria-label='Unit of G1']", "deg/s")
    page.select_option("[aria-label='Sign of G1']", "-1")
    page.click("#use-map")
    assert answered(page, "look") == "log.csv: 2 channels of numbers; it can be used for: free decay (modal)."
    assert page.input_value("#fit-map") == "channels_of_the_page.toml"

    page.fill("[aria-label='Speed of log.csv, m/s']", "5")
    page.fill("#to", "4.5")
    page.click("#run-fit")
    assert answered(page, "fit").startswith("weave at 5 m/s: -0.7")
    _, ((run, mode, speed, real, sd, low, high, imaginary, other, *_),) = table(page, "fit", "Roots and intervals")
    assert (run, mode, speed) == ("log.csv", "weave", 5)
    assert abs(real - WEAVE.real) < 4 * sd < 0.05
    assert abs(imaginary - WEAVE.imag) < 4 * other < 0.05
    assert (low, high) == (pytest.approx(real - 1.96 * sd), pytest.approx(real + 1.96 * sd))

    monkeypatch.chdir(tmp_path)  # the same by the command line
    (tmp_path / "log.csv").write_text(log())
    with page.expect_download() as found:
        page.locator("#file-rows a[download]").click()
    found.value.save_as(tmp_path / "channels_of_the_page.toml")
    (tmp_path / "fit").mkdir()
    mapped = "--channels=channels_of_the_page.toml"
    main(["look", "log.csv", mapped, "--out=look", "--json=look/look.json"])
    main(["modal", "log.csv@5.0", "--modes=weave", "--to=4.5", mapped, "--out=fit/modal.csv", "--figures=fit"])
    for kind in ("look", "fit"):
        written = {path.relative_to(tmp_path).as_posix(): path.read_bytes() for path in (tmp_path / kind).iterdir()}
        assert downloaded(page, kind) == written
    assert set(written) == {"fit/modal.csv", "fit/modal.manifest.json", "fit/log_5.png", "fit/log_5.svg"}

    page.click("text=Keep modal.csv among the files above")
    page.wait_for_selector("#file-rows td:text-is('modal.csv')")
    page.reload()  # files and results are still there
    page.wait_for_selector("#result-fit .verdict")
    assert page.locator("#file-rows tr").count() == 3


def rig_log():
    """A slip sweep as a rig wrote it: no sidecar, decimal commas, km/h, and C = 110 N/deg by construction."""
    rng, angle = np.random.default_rng(1), np.interp(np.arange(0, 20, 0.02), [0, 5, 15, 20], [0, 4, -4, 0])
    slip = np.concatenate([angle, angle])
    force = 500 * np.tanh(110 * slip / 500) + rng.normal(0, 2, slip.size)
    load = 400 + rng.normal(0, 2, slip.size)
    rows = [f"{20 * k:d};{slip[k]:.4f};{force[k]:.2f};{load[k]:.1f};20" for k in range(slip.size)]
    return "clk;enc_alpha;LC2;LC_FZ;v_belt\nms;deg;N;N;km/h\n" + "\n".join(rows).replace(".", ",") + "\n"


def test_a_slip_sweep_is_described_and_the_tyre_fitted_as_the_command_does(opened, tmp_path, monkeypatch):
    page = opened(path="recording")
    load(page, rig__csv=rig_log())
    page.click("#run-look")
    assert "can be used for: slip sweep" in answered(page, "look")
    page.fill("#describe-look-rig-toml-tyre", "A")
    page.fill("#describe-look-rig-toml-pressure_bar", "6")
    page.select_option("#describe-look-rig-toml-surface", "flat")
    page.click("text=Keep as sidecar")
    page.wait_for_selector("#file-rows a:text-is('rig.toml')")
    page.click("text=Uncertainty of the rig, and the wheel")
    page.fill("#tyre-force_calibration", "0.5")
    page.click("#run-tyre_fit")
    sentence = answered(page, "tyre_fit")
    heads, (row,) = table(page, "tyre_fit", "Fitted tyre, 95 % intervals")
    found = dict(zip(heads[:7], row[:7], strict=True))
    assert (found["tyre"], found["surface"], found["load N"], found["pressure bar"]) == ("A", "flat", 400, 6)
    low, high = row[5], row[6]
    assert low < found["cornering stiffness C N/deg"] < high
    assert abs(found["cornering stiffness C N/deg"] / 110 - 1) < 0.05
    assert sentence == (
        f"1 recording of 1 condition: cornering stiffness C {row[4]:.4g} N/deg ({low:.4g} to {high:.4g})."
    )
    assert page.locator("#tyre_fit-tyre-C .scatterlayer .trace").count() == 1
    assert page.text_content("#tyre_fit-tyre-C .gtitle") == "Cornering stiffness over the load"
    assert serious(page) == []
    images = page.locator("#result-tyre_fit img")
    assert images.count() == 3
    assert images.evaluate_all("all => all.every(one => one.complete && one.naturalWidth > 0)")

    (tmp_path / "as_loaded").mkdir()  # the same by the command line
    (tmp_path / "as_loaded" / "rig.csv").write_text(rig_log())
    with page.expect_download() as sidecar:
        page.locator("#file-rows a[download]").click()
    sidecar.value.save_as(tmp_path / "as_loaded" / "rig.toml")
    written = downloaded(page, "tyre_fit")
    assert json.loads(written["tyre_fit/tyre_fit.manifest.json"])["command"].endswith("--force-calibration=0.5")
    monkeypatch.chdir(tmp_path)
    main(["tyre", "fit", "as_loaded", "--out=tyre_fit", "--force-calibration=0.5"])
    files = {
        path.relative_to(tmp_path).as_posix(): path.read_bytes()
        for path in (tmp_path / "tyre_fit").rglob("*") if path.is_file()
    }  # fmt: skip
    assert written == files
    assert {"tyre_fit/conditions.csv", "tyre_fit/recordings.csv", "tyre_fit/report.md"} < set(files)
    links = page.locator("#result-tyre_fit .files a").all_text_contents()
    assert "conditions.csv" in links
    assert not any("cache" in name for name in links)  # in the zip alone


def test_a_measurement_is_diagnosed_and_browsed(opened):
    page = opened(path="recording", color_scheme="dark")
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as zipped:
        zipped.writestr("set/m.toml", MEASUREMENT)
        zipped.writestr("set/weave.csv", TABLE)
    page.set_input_files("#files", {"name": "s.zip", "mimeType": "application/zip", "buffer": packed.getvalue()})
    page.wait_for_selector("#file-rows td:text-is('set/weave.csv')")
    page.select_option("#measurement", "set/m.toml")
    page.fill("#without", LEFT_OUT)
    page.click("#run-diagnosis")
    page.wait_for_selector("#job-words:has-text('fits')", timeout=SLOW)
    page.wait_for_selector("#result-diagnosis .verdict", timeout=SLOW)
    sentence = page.inner_text("#result-diagnosis .verdict")
    assert sentence.startswith("steer_damper (damping 2.")
    assert page.locator("#job").is_hidden()
    files = downloaded(page, "diagnosis")
    assert {"diagnosis/report.html", "diagnosis/report.md", "diagnosis/gap.svg", "diagnosis/model.toml"} <= set(files)
    verdict = json.loads(files["diagnosis/verdict.json"])
    assert sentence == verdict["sentence"]

    _, rows = table(page, "diagnosis", "Table: probability of the hypotheses")
    assert {name.replace(" + ", "+"): share for name, share, _ in rows} == {
        ("parameters only" if name == "none" else name): share for name, share in verdict["posterior"].items()
    }
    heads, rows = table(page, "diagnosis", "Table: parameters moved")
    assert heads[-1] == "moved in sd, with steer_damper"
    assert [(row[0], row[-1]) for row in rows] == [(one["parameter"], one["shift"]) for one in verdict["moved"]]
    _, rows = table(page, "diagnosis", "Table: gap map")
    gaps = np.array([row[3] for row in rows if row[1] == "with steer_damper"])
    assert gaps @ gaps == pytest.approx(verdict["chi2"]["final"])
    _, rows = table(page, "diagnosis", "Table: before and after")
    measured = [row[3] for row in rows if row[1] == "measured, 95 %"]
    assert sorted(measured) == sorted(float(x) for line in TABLE.splitlines()[1:] for x in line.split(",")[2:4])
    assert page.locator("#result-diagnosis img").evaluate_all("all => all.every(one => one.naturalWidth > 0)")


def test_a_shipped_recording_without_a_serious_finding_of_axe(opened):
    page = opened(path="recording")
    head, *samples = KICK.read_text().splitlines()
    load(page, kick__csv="\n".join([head, *samples[::4]]) + "\n")  # axe looks at every cell of the table of samples
    page.click("#run-look")
    assert answered(page, "look") == (
        "kick.csv: 4 channels of numbers; it can be used for: free decay (modal), replay (histories)."
    )
    assert page.locator("#look-channels .subplot").count() == 3  # all but the time
    heads, rows = table(page, "look", "Table: channels")
    assert heads == ["panel", "curve", "time, s", "value"]
    assert rows[0] == ["roll_rate_rad_s = roll_rate", "recorded", 0.0, 0.0035]
    for width, scheme in ((1300, "light"), (390, "dark")):
        page.set_viewport_size({"width": width, "height": 844})
        page.emulate_media(color_scheme=scheme)
        page.wait_for_selector(f"html[data-theme={scheme}]")
        # a figure takes the new width a tenth of a second after the window has it
        page.wait_for_function("width => document.documentElement.scrollWidth <= width", arg=width)
    page.wait_for_timeout(300)
    assert serious(page) == []  # in the dark; in the light a tyre that is fitted is looked at


def test_what_goes_wrong_is_said_and_the_keyboard_is_enough(opened, capsys, tmp_path, monkeypatch):
    """The last one: no other waits for the process that takes the place of the one that is stopped."""
    page = opened(path="recording")
    load(page, bad__csv="time,roll_rate\n0,1\n0.1\n", odd__toml="kind = 'modal'\n")
    for _ in range(40):  # to the button, by Tab alone
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.id") == "run-look":
            break
    page.keyboard.press("Enter")
    page.wait_for_selector("#message:not(:empty)", timeout=SLOW)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.csv").write_text("time,roll_rate\n0,1\n0.1\n")
    with pytest.raises(SystemExit):
        main(["look", "bad.csv"])
    assert capsys.readouterr().err == f"velotyre: {page.inner_text('#message')}\n"

    page.select_option("#measurement", "synthetic_kicks")
    page.focus("#run-diagnosis")
    page.keyboard.press("Enter")
    page.wait_for_selector("#job:not([hidden])")
    assert page.inner_text("#message") == ""
    assert page.is_disabled("#run-look")
    page.focus("#cancel")
    page.keyboard.press("Enter")
    page.wait_for_selector("#message:has-text('Diagnosis was cancelled; nothing is kept of it.')")
    assert page.locator("#job").is_hidden()
    assert page.is_enabled("#run-look")

    page.keyboard.press("Home")
    page.click("nav a:text-is('Model')")
    page.wait_for_selector("#modes .scatterlayer .trace", state="attached")
    page.click("nav a:text-is('Recording')")
    page.wait_for_selector("#file-rows td:text-is('odd.toml')")
