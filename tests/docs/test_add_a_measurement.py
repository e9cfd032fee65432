"""The page on a kind of one's own: its example is no part of velotyre, and finds what it found as a part of it."""

import csv
import json
import re
import runpy
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from pages import section
from read_report import read_report
from small_library import all_but

from bicycle import Bicycle, Model
from bicycle.files import load_bicycle
from studies.diagnosis import Kind, find_candidates, read_measurement
from tests.shared.refusals import refuses

PAGE = section("python", "A kind of measurement of your own")
EXAMPLE = Path(__file__).parents[2] / "docs" / "examples" / "kinds"
SCRIPT, MEASUREMENT, TABLE = "canonical_coefficients.py", "davis.toml", "davis_canonical_coefficients.csv"
SLIPPING = ("steer_damper", "side_slip", "relaxation_length")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A copy of the example; the kind is known in this test only, for other tests list the kinds that there are."""
    monkeypatch.chdir(shutil.copytree(EXAMPLE, tmp_path / "kinds"))
    for known in (Kind.top, Kind.part):
        monkeypatch.delitem(known, "canonical", raising=False)
        monkeypatch.setitem(known, "canonical", None)  # so that it is gone afterwards, whoever registers it
    return Path.cwd()


@pytest.fixture
def example(folder):
    """Names of the script, with its kind registered."""
    return runpy.run_path(SCRIPT)


def test_the_davis_coefficients_need_two_effects(folder, example, monkeypatch, capsys):
    """Slip takes C1 of phi,delta down as measured, but C1 of delta,delta the wrong way: a second effect is needed."""
    assert f"python {SCRIPT} diagnose {MEASUREMENT} --out report" in PAGE
    few = [f"--without={name}" for name in all_but(read_measurement(MEASUREMENT), SLIPPING)]
    line = [SCRIPT, "diagnose", MEASUREMENT, "--out", "report", "--json", "v.json", "--no-stability", *few]
    monkeypatch.setattr(sys, "argv", line)
    runpy.run_path(SCRIPT, run_name="__main__")
    assert capsys.readouterr().out.startswith("class. ")
    verdict = json.loads(Path("v.json").read_text())
    assert set(verdict["class"]) == {"steer_damper+side_slip", "steer_damper+relaxation_length"}
    tyre = next(e for e in verdict["effects"] if e["identifier"] == "side_slip")["parameters"]
    front, rear = (tyre[f"cornering_stiffness.{wheel}"]["value"] for wheel in ("front", "rear"))
    assert 2e3 < front < rear < 2e4  # N/rad, as tyres have
    assert verdict["chi2"]["n"] == 54
    assert verdict["chi2"]["nominal"] == pytest.approx(78.525, abs=1e-3)
    assert verdict["chi2"]["final"] == pytest.approx(34.793, abs=0.01)
    assert verdict["posterior"]["none"] < 0.01
    assert verdict["held_out_gap"]["final"] < 0.5 * verdict["held_out_gap"]["nuisance_only"]
    assert "| C on H | 9 |" in read_report("report")
    assert {"story.png", "before_after.png", "model.toml"} <= {path.name for path in Path("report").iterdir()}


def test_the_bicycle_is_the_one_of_the_thesis(folder, example):
    """Rider J's Whipple coefficients, from identified value and printed difference, are those of the bicycle; the frame
    and wheels are those of rigid.toml."""
    measurement = read_measurement(MEASUREMENT)
    coefficients, bare = measurement.coefficients, load_bicycle("rigid")
    assert coefficients.subsets == ("C on H", "C on P", "J on H", "J on P", "L on H", "L on P")
    ridden = Model(Bicycle("J", measurement.model.bicycle.values))
    whipple = example["WhippleMatrices"].of_bicycle(ridden).free
    np.testing.assert_allclose(coefficients.whipple[2, :8], whipple[:8], rtol=2e-3)
    for key in ("w", "c", "lam", "rR", "mR", "IRyy", "mH", "xH", "zH", "IHxx", "IHzz", "rF", "mF", "IFyy"):
        assert measurement.model.bicycle[key] == bare[key]
    assert measurement.model.bicycle["mB"] == pytest.approx(bare["mB"] + 83.5)
    with (folder / TABLE).open() as stream:
        printed = {(row["rider"], row["environment"], row["coefficient"]): row for row in csv.DictReader(stream)}
    assert len(printed) == 12 * 9
    # two cells as the thesis prints them, and the standard deviation that only the regression gives
    assert printed["J", "P", "C1_phi_delta"]["value"] == "30.04"
    assert printed["C", "P", "C1_delta_phi"]["difference_percent"] == "-366.5"
    for subset, row in zip(coefficients.subsets, coefficients.sd, strict=True):
        stated = [float(printed[(*subset.split(" on "), name)]["sd"]) for name in example["COEFFICIENTS"]]
        assert (row > 2 * np.array(stated)).all()


def test_the_identification_gives_what_is_known_by_hand(folder, example):
    """Whipple's coefficients without an effect; a steer spring adds its stiffness over g to K0 of delta, delta."""
    prepared = read_measurement(MEASUREMENT).prepare()
    whipple = example["WhippleMatrices"].of_bicycle(prepared.model)
    np.testing.assert_allclose(prepared.identified((), prepared.nominal[None])[0], whipple.free, rtol=1e-8)
    spring = tuple(c for c in prepared.candidates if c.identifier == "steer_spring")
    change = prepared.identified(spring, np.array([[*prepared.nominal, 3.0]]))[0] - whipple.free
    np.testing.assert_allclose(change, [0, 0, 0, 0, 0, 0, 3 / whipple.gravity, 0, 0], atol=1e-8)


def test_the_slopes_are_those_of_the_prediction(folder, example):
    prepared = read_measurement(MEASUREMENT).prepare()
    damper = tuple(c for c in prepared.candidates if c.identifier == "steer_damper")
    theta = np.array([*prepared.nominal, 0.8])
    value, slope = prepared.value_and_jacobian(damper, theta)
    moved = theta + 1e-3 * np.eye(len(theta))[-1]
    step = (prepared.predict(damper, moved) - value) / 1e-3
    np.testing.assert_allclose(slope[:, -1], step, atol=1e-3 * np.abs(step).max())


def test_what_the_measurement_contains_is_not_tried(folder, example):
    prepared = read_measurement(MEASUREMENT).prepare(without=("steer_damper", "speed_scale"))
    tried = {c.identifier for c in prepared.candidates}
    assert not tried & {"rider_arms", "steer_damper", "speed_scale"}
    assert "rider_arms" in {c.identifier for c in find_candidates(prepared.model, {})[0]}  # it would be
    assert "the steer torque, which was measured" in prepared.refused["rider_arms"]
    slip = tuple(c for c in prepared.candidates if c.identifier == "side_slip")
    assert {c.identifier for c in prepared.enabled_by(slip)} == {"camber_thrust", "aligning_moment"}
    assert {"steer_delay", "lateral_push_scale"} <= tried


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("M_phi_delta", "M_fi_delta", "line 2: unknown coefficient 'M_fi_delta'; did you mean 'M_phi_delta'"),
        ("kg m^2", "g m^2", r"line 2: M_phi_delta is in 'g m\^2'; give it in 'kg m\^2'"),
        ("0.02", "0", "line 2: sd = 0 must be above 0"),
        ("C,H,M_phi", "C,P,M_phi", "line 11: M_phi_delta of C on P is given twice"),
        ("C,H,M_phi", "D,H,M_phi", "rider D, environment H lacks C1_phi_delta"),
    ],
)
def test_a_wrong_row_is_refused(folder, example, old, new, words):
    lines = Path(TABLE).read_text().splitlines()
    lines[1] = lines[1].replace(old, new, 1)
    Path(TABLE).write_text("\n".join(lines) + "\n")
    refuses(words, read_measurement, MEASUREMENT)


def test_every_method_that_the_example_writes_is_on_the_page():
    inside = re.search(r"^class CanonicalCoefficients.*", (EXAMPLE / SCRIPT).read_text(), flags=re.M | re.S)[0]
    names = re.findall(r"^    def ([a-z]\w*)\(", inside, flags=re.M)
    assert "value_and_jacobian" in names
    helpers = {"whipple", "identified"}
    assert [name for name in names if f"`{name}`" not in PAGE and name not in helpers] == []
