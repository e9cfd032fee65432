"""The page about riders: its geometry file reads, its table is that of the packaged bicycles."""

import re
import tomllib

import pytest
from pages import missing_options, page, run_page

from bicycle import critical_speeds, load_bicycle, modes
from bicycle.model import build_model
from bicycle.rider import read_geometry, seated_rider
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


UPPER = {"mass": 40.0, "x": 0.5, "z": -1.15, "Ixx": 1.5, "Izz": 0.8, "joint_z": -0.98}  # made up


def test_the_table_of_the_rider_on_the_saddle():
    """The page's own model file, on the tyre and front frame that it names."""
    file = tomllib.loads(re.findall("```toml\n(.*?)```", PAGE, re.DOTALL)[-1])
    saddle, roll = file["effects"]["rider_saddle"], file["effects"]["rider_saddle_roll"]
    rider = seated_rider(load_bicycle("pista_charlie_drops"), load_bicycle("pista"))
    riders = {
        "fixed": {},
        "`rider_saddle`": {"rider_saddle": saddle},
        "`rider_saddle`, `rider_saddle_roll`": {"rider_saddle": saddle, "rider_saddle_roll": roll | {"damping": 57.0}},
        "whole body rolls, `rider_lean`": {"rider_lean": rider | roll | {"damping": 57.0}},
        "upper body of 40 kg, `rider_lean`": {"rider_lean": UPPER},
        "`rider_saddle`, `rider_lean` of 40 kg": {"rider_saddle": saddle, "rider_lean": UPPER},
    }
    front = {"stiffness": 5000.0, "damping_ratio": 0.03, "joint_x": 0.867, "joint_z": -0.65}
    base = {
        "relaxation_length": {"tyre": "Tyre1", "pressure_bar": 5.5},
        "camber_thrust": {"camber_stiffness": {"rear": 0.8 * 442, "front": 0.8 * 426}},
        "front_compliance": front,
    }
    for words, effects in riders.items():
        model = build_model({"bicycle": file["bicycle"], "effects": base | effects})
        unstable = [c.speed for c in critical_speeds(model.linear_model(), max_speed=40.0) if c.mode == "wobble"]
        row = re.search(rf"^\| {re.escape(words)} \| (.*) \| (.*) \|$", PAGE, re.MULTILINE)
        said = [] if row.group(1) == "stable" else [float(number) for number in row.group(1).split(" to ")]
        assert said == pytest.approx(unstable, abs=0.0051), words
        assert float(row.group(2)) == pytest.approx(modes(model, [8.0]).frequency("wobble")[0], abs=0.0051), words
