"""The engine at the tyre: flat-track and drum tables of the paper (Dell'Orto, Ballo, Mastinu & Gobbi, 2 and 3)."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from studies.diagnosis import TyreTables, diagnose, read_measurement
from tests.shared.refusals import refuses
from tyre.ground import InputError
from tyre.maps import read_folder

ROOT = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def tables():
    return {(t.tyre, t.surface): t for t in read_folder()}


def test_the_drum_is_named_for_what_the_flat_track_values_miss(tables):
    """The tables differ by a tenth: more than a calibration error, in the sense in which a curved track acts."""
    flat, drum = tables["Tyre1", "flat"], tables["Tyre1", "drum"]
    assert (drum.cornering_stiffness < flat.cornering_stiffness).all()
    found = diagnose(read_measurement(ROOT / "data" / "measured" / "tyre1_drum.toml")).verdict
    assert found.equivalent[0] == "drum_curvature"
    exponent, sd = found.effects[0].parameters["exponent"]
    ratio = np.exp(np.mean(np.log(flat.cornering_stiffness / drum.cornering_stiffness)))
    assert exponent == pytest.approx(np.log(ratio) / np.log1p(0.34 / 1.3), abs=3 * sd)
    assert found.held_out_gap["final"] < found.held_out_gap["nuisance_only"]


def test_the_same_surface_again_misses_nothing(tables):
    flat = tables["Tyre1", "flat"]
    rng = np.random.default_rng(2)
    again = dataclasses.replace(
        flat, cornering_stiffness=flat.cornering_stiffness * (1 + 0.015 * rng.standard_normal(len(flat.load)))
    )
    assert diagnose(TyreTables(reference=flat, measured=again)).verdict.verdict == "none"


@pytest.mark.parametrize(
    ("scale", "power"),
    [("force_scale", 1.0), ("slip_angle_scale", -1.0), ("load_scale", 0.8), ("pressure_scale", -0.3)],
)
def test_a_scale_acts_by_its_power_and_counts_in_the_scatter_of_two_tables(tables, scale, power):
    """A tyre of C ~ load^0.8 pressure^-0.3, and C of one load and pressure known to 2 % on either surface."""
    flat = tables["Tyre1", "flat"]
    one = dataclasses.replace(flat, cornering_stiffness=3.0 * flat.load**0.8 * flat.pressure**-0.3)
    other = dataclasses.replace(one, cornering_stiffness=one.cornering_stiffness * 1.03**power)
    forward = TyreTables(reference=one, measured=other).prepare()
    (candidate,) = (c for c in forward.candidates if c.identifier == scale)
    residual, _ = forward.residual((), np.empty(0))
    np.testing.assert_allclose(residual, power * np.log(1.03) / np.hypot(0.02, 0.02), rtol=1e-9)
    explained, slope = forward.residual((candidate,), np.array([0.03]))
    np.testing.assert_allclose(explained, 0.0, atol=0.03)  # 3 % of 3 %, in sd
    np.testing.assert_allclose(slope[:, 0], -power / np.hypot(0.02, 0.02), rtol=2e-3)


def test_two_tyres_are_refused(tables):
    with pytest.raises(InputError, match="tables of two tyres, 'Tyre1' and 'Tyre2'; give one tyre on two surfaces"):
        TyreTables(reference=tables["Tyre1", "flat"], measured=tables["Tyre2", "flat"])


def test_few_conditions_are_refused(tables):
    flat = tables["Tyre1", "flat"]
    keys = ("load", "pressure", "cornering_stiffness", "lateral_stiffness", "lateral_stiffness_sd")
    few = dataclasses.replace(flat, **{key: getattr(flat, key)[:3] for key in keys}, lateral_stiffness_shared_over=())
    refuses("3 conditions are too few; 6 are needed", TyreTables, reference=few, measured=flat)
    six = dataclasses.replace(flat, **{key: getattr(flat, key)[:6] for key in keys}, lateral_stiffness_shared_over=())
    assert len(TyreTables(reference=six, measured=flat).reference.load) == 6  # as many as a quadratic in two has terms


def test_effects_may_be_left_out(tables):
    pair = TyreTables(reference=tables["Tyre1", "flat"], measured=tables["Tyre1", "drum"])
    found = diagnose(pair, without=("drum_curvature",))
    assert "drum_curvature" not in found.verdict.posterior
    refuses("--without: unknown effect 'drum'; known: drum_curvature", diagnose, pair, without=("drum",))


@pytest.mark.parametrize(("text", "words"), [
    ("", "is missing; write .tyre_tables., reference and measured below it"),
    ("wheel = 1\n", "unknown key 'wheel'"),
    ("[tyre_tables]\nreferenc = 'a.csv'\n", "unknown key 'referenc'; did you mean 'reference'"),
    ("[tyre_tables]\nreference = 'a.csv'\n", 'no measured; write measured = "TABLE.csv"'),
    ("[tyre_tables]\nmeasured = 'a.csv'\n", 'no reference; write reference = "TABLE.csv"'),
    ("[tyre_tables]\nreference = 3\n", "reference = 3 must be a path in quotes"),
    ("[tyre_tables]\nreference = 'none.csv'\nmeasured = 'a.csv'\n", "none.csv"),
])  # fmt: skip
def test_bad_files_of_tables(tmp_path, text, words):
    (tmp_path / "m.toml").write_text('kind = "tyre_tables"\n' + text)
    refuses(words, read_measurement, tmp_path / "m.toml")


def test_a_tyre_without_uncertain_parameters_has_its_story_in_the_terminal(printed):
    lines = printed("diagnose", "tyre1_drum").splitlines()
    assert len(lines) <= 12
    assert lines[0].startswith("partial. Partly explained by drum_curvature (exponent 0.606")
    assert any(
        line == "evidence: On held-out data 38 % of the base model's discrepancy remains with it." for line in lines
    )
    assert sum(line.endswith("#") for line in lines) == 2
