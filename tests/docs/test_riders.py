"""The page about riders: its geometry file reads, its table is that of the packaged bicycles."""

import re

import pytest
from pages import missing_options, page, run_page

from bicycle import critical_speeds, load_bicycle
from bicycle.rider import read_geometry
from studies.main_study import Settings, model, tyre_cases

PAGE = page("riders")


def test_the_geometry_file_reads(tmp_path):
    file = tmp_path / "seat.toml"
    file.write_text(re.search("```toml\n(.*?)```", PAGE, re.DOTALL).group(1))
    assert read_geometry(file, "drops").values["drop_m"] == 0.18
    hoods = read_geometry(file, "hoods")
    assert (hoods.values["drop_m"], hoods.sd["saddle_distance_m"], hoods.sd["reach_m"]) == (0.05, 0.01, 0.005)


@pytest.mark.usefixtures("no_pictures")
def test_the_page_runs_and_shows_what_is_seen(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    seated, steered = run_page(PAGE)
    assert "front wheel" in seated
    assert "schwab2013" in steered
    assert missing_options("rider", PAGE) == []


@pytest.mark.parametrize("posture", ["upright", "hoods", "drops"])
def test_the_table_of_postures(posture):
    row = re.search(rf"^\| {posture} \|(.*)\|$", PAGE, re.MULTILINE).group(1)
    said = [float(number) for number in re.findall(r"-?\d+\.?\d*", row)]
    bicycle = load_bicycle(f"pista_charlie_{posture}")
    settings = Settings(bicycle, camber_share=0.8, trail=0.0, twisting=0.0)
    case = next(c for c in tyre_cases(settings).studied if c.name == "Tyre1 flat" and c.pressure_bar == 5.5)
    linear = model(settings, settings.reference, case.contact).linear_model()
    found = {(c.mode, c.direction): c.speed for c in critical_speeds(linear, max_speed=40.0)}
    expected = [bicycle[key] for key in ("xB", "zB", "IBxx", "IBxz", "IBzz")] + list(bicycle.static_loads)
    expected += [found["wobble", "destabilising"], found["wobble", "stabilising"]]
    expected += [found["weave", "stabilising"], found["capsize", "destabilising"]]
    for number, value in zip(said, expected, strict=True):
        assert number == pytest.approx(value, abs=0.51 if value > 100 else 0.0051)
