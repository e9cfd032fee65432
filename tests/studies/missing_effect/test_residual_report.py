"""What the report, the terminal and the JSON say of what could not be named; that it is never a name."""

import dataclasses
import json
import math
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from bicycle import Model, load_bicycle
from bicycle.files.model_file import read_model
from studies.cli import main
from studies.inference.checks import HeldOut
from studies.inference.fit import fit
from studies.missing_effect import diagnose, read_measurement
from studies.missing_effect.blind.generator import modal_case
from studies.missing_effect.blind.hidden import Cause
from studies.missing_effect.blind.histories import history_case
from studies.missing_effect.motion.joint_measurement import JointMeasurement
from studies.missing_effect.packaged import packaged_measurement
from studies.missing_effect.report import page, record, write_report
from studies.missing_effect.reporting.corrected_model import why_none
from studies.missing_effect.reporting.findings import find
from studies.missing_effect.reporting.sentences import first_lines
from studies.missing_effect.residual import words
from studies.missing_effect.residual.amplitude import Amplitude
from studies.missing_effect.residual.figure import _amplitude as draw_amplitude
from studies.missing_effect.residual.figure import caption, draw_torque
from studies.missing_effect.residual.kept import Kept, keep, plain
from studies.missing_effect.residual.kept import record as of_kept
from studies.missing_effect.residual.shapes import Likeness, Shape
from studies.missing_effect.residual.terms import SpeedScale
from tyre.base.errors import InputError

TRIED = ("steer_spring", "speed_scale", "lean_sensor_delay")


@pytest.fixture(scope="module")
def reported(tmp_path_factory):
    """Synthetic: a damper of a size of the generator's, and a library that does not know it."""
    folder = tmp_path_factory.mktemp("reported")
    modal_case(folder, hidden=("steer_damper",), rng=np.random.default_rng(11), bicycle="browser", kind="rolling")
    measurement = read_measurement(folder / "MEASUREMENT.toml")
    every = tuple(c.identifier for c in measurement.forward().candidates)
    found = diagnose(measurement, without=tuple(name for name in every if name not in TRIED))
    findings = find(found)
    write_report(found, folder / "report", findings)
    return SimpleNamespace(folder=folder / "report", diagnosis=found, findings=findings)


def test_the_verdict_and_its_words_stay_and_the_torque_is_no_name(reported):
    verdict = reported.diagnosis.verdict
    assert verdict.verdict == "unknown"
    assert verdict.effects == ()
    written = json.loads((reported.folder / "verdict.json").read_text())
    same = set(verdict.to_dict()) - {"refused_leaders"}  # which the report words anew
    plain_verdict = json.loads(json.dumps(verdict.to_dict()))
    assert {key: written[key] for key in same} == {key: plain_verdict[key] for key in same}
    named = (verdict.sentence, *verdict.posterior, *verdict.equivalent, *(m.what for m in verdict.mimics))
    assert not any("residual" in text for text in named)
    assert "residual_torque" in verdict.refused
    assert "residual_torque" not in {e["identifier"] for e in written["effects"]}


def test_the_json_has_the_torque_with_its_covariance(reported):
    found = json.loads((reported.folder / "verdict.json").read_text())["residual_torque"]
    assert found["fitted"] is True
    assert found["name_of_a_cause"] is False
    assert found["coefficients"]["steer_from_steer_rate"]["unit"] == "N m s/rad"
    names, matrix = found["covariance"]["coefficients"], np.array(found["covariance"]["matrix"])
    assert set(names) == {*found["coefficients"], *found["left_at_zero"]}
    for name, told in {**found["coefficients"], **found["left_at_zero"]}.items():
        k = names.index(name)
        assert math.sqrt(matrix[k, k]) == pytest.approx(told["sd"])
    rows = {row[0]: row[-2:] for row in words.coefficients(reported.findings.kept)}  # log evidence, held-out score
    gains = [found["coefficients"]["steer_from_steer_rate"][f"gain_{name}"] for name in ("log_evidence", "held_out")]
    assert [f"{gain:+.1f}" for gain in gains] == rows["steer torque from steer rate"]
    assert gains[0] != pytest.approx(gains[1], rel=0.01)
    assert sum(found["share_of_power"].values()) == pytest.approx(1.0)
    assert found["held_out"]["gap_with"] < found["held_out"]["gap_without"]
    assert found["amplitude"] is None


def test_json_and_page_tell_the_same_critical_speeds(reported):
    written = json.loads((reported.folder / "verdict.json").read_text())["residual_torque"]["critical_speeds"]
    assert written == reported.findings.kept.critical.to_dict()
    rows = words.critical_rows(reported.findings.kept.critical)
    text = (reported.folder / "report.md").read_text()
    assert len(rows) == len(written["found"]) > 0
    assert all(f"| {' | '.join(row)} |" in text for row in rows)


def test_the_page_has_a_section_with_figure_and_critical_speeds(reported):
    text = (reported.folder / "report.md").read_text()
    section = text.split("## What could not be named")[1].split("## The corrected model")[0]
    assert "no cause, and no part of the verdict" in section
    assert "| steer torque from steer rate | " in section
    assert "has the shape of steer_damper" in section  # by shape, though it was left out of the search
    assert "![What could not be named, as a torque" in section
    assert (reported.folder / "residual_torque.png").stat().st_size > 10_000
    assert (reported.folder / "residual_torque.svg").exists()
    assert "Where modes of the corrected model may change their stability (95 %)" in section
    model = read_model(reported.folder / "model.toml")
    assert "residual_torque" in [e.identifier for e in model.effects]
    assert "the covariance of all that was fitted" in text
    assert (reported.folder / "report.html").read_text().count("residual_torque.png") == 1


def test_the_terminal_says_it(reported):
    lines = first_lines(reported.diagnosis, reported.findings, "")
    assert any(
        line.startswith("What remains beside parameters only is kept as a torque that is linear in the")
        for line in lines
    )


@pytest.mark.parametrize("command", [("modes",), ("critical",), ("uncertainty", "--samples", "50")])
def test_other_commands_read_the_corrected_model(reported, capsys, command):
    main([command[0], str(reported.folder / "model.toml"), *command[1:]])
    assert "weave" in capsys.readouterr().out


def test_nothing_is_said_where_nothing_was_left_open(reported):
    closed = dataclasses.replace(reported.findings, kept=None)
    text = page(reported.diagnosis, closed, {})
    assert "What could not be named" not in text
    assert record(reported.diagnosis, closed)["residual_torque"] is None


def test_where_a_tentative_name_leaves_no_gap_the_gain_is_told_in_chi2(reported):
    residual = reported.findings.kept.residual
    n = len(residual.before.residual)
    assert f"Gap on held-out data {residual.before.gap:.2g} sd without it" in words.sentence(reported.findings.kept)
    before, after = HeldOut(0.0, np.full(n, 0.5)), HeldOut(0.0, np.full(n, 0.25))
    closed = dataclasses.replace(residual, before=before, after=after)
    told = words.sentence(dataclasses.replace(reported.findings.kept, residual=closed))
    assert f"χ² of {n} held-out numbers is {n / 4:.1f} without it, {n / 16:.2f} with it." in told


def test_a_refusal_says_why(reported):
    refused = dataclasses.replace(reported.findings, kept=Kept(refused="all data are of one run"))
    text = page(reported.diagnosis, refused, {})
    assert "Nothing could be kept of what remains: all data are of one run." in text
    assert of_kept(refused.kept) == {"fitted": False, "why": "all data are of one run", "amplitude": None}
    assert draw_torque(refused.kept, reported.folder / "none") is False


@pytest.mark.parametrize("option", ["--with", "--without"])
def test_it_cannot_be_asked_for(reported, capsys, option):
    file = reported.folder.parent / "MEASUREMENT.toml"
    if option == "--with":
        with pytest.raises(SystemExit, match="2"):
            main(["diagnose", str(file), "--with", "residual_torque"])
        assert "residual_torque: no cause that could be named" in capsys.readouterr().err
    else:
        forward = read_measurement(file).forward(without=("residual_torque",))
        assert "residual_torque" not in {c.identifier for c in forward.candidates}


# ------------------------------------------------------------------ other kinds of data


def left_open(measurement):
    forward = measurement.forward()
    null = fit(forward)
    return SimpleNamespace(
        measurement=measurement, forward=forward, final=null, verdict=SimpleNamespace(verdict="unknown", checks=()),
    )  # fmt: skip


def test_canonical_coefficients_have_one_too():
    """Davis (Moore 2012): what tyres without slip leave is a lean torque against the lean rate, as side slip gives."""
    with packaged_measurement("davis") as file:
        found = keep(left_open(read_measurement(file)))
    assert found.residual.before.gap > found.residual.after.gap
    assert found.residual.values["steer_from_steer_rate"] < 0
    assert {one.identifier for one in found.shape.library[:2]} == {"side_slip", "relaxation_length"}
    assert "has the shape of side_slip" in words.sentence(found)


def test_joint_data_have_one_torque(reported):
    whole = reported.diagnosis.measurement
    parts = tuple((name, dataclasses.replace(whole, points=whole.points[k::2])) for k, name in enumerate("ab"))
    joint = JointMeasurement(
        name="joint", model=whole.model, uncertainty=whole.uncertainty, known=whole.known, parts=parts
    )
    found, alone = keep(left_open(joint)), reported.findings.kept
    gain = found.residual.values["steer_from_steer_rate"]
    assert gain == pytest.approx(alone.residual.values["steer_from_steer_rate"], abs=3 * alone.residual.sd[
        "steer_from_steer_rate"])  # fmt: skip
    assert sum(found.shape.shares.values()) == pytest.approx(1.0)


@pytest.fixture(scope="module")
def histories(tmp_path_factory):
    """Dry friction of 0.1 N m at the steer, in four runs of the generator."""
    folder = tmp_path_factory.mktemp("friction")
    cause = Cause({"steer_friction": {"torque": 0.1}}, friction=0.1)
    settings = {"bicycle": "browser", "kind": "rolling", "runs": 4, "duration": 2.5}
    history_case(folder, hidden=(), rng=np.random.default_rng(3), cause=cause, **settings)
    return keep(left_open(read_measurement(folder / "MEASUREMENT.toml")))


def test_dry_friction_in_histories_shows_as_damping_that_falls_with_the_amplitude(histories, tmp_path):
    found = histories.amplitude
    assert found.falls
    assert abs(found.dry[0] - 0.1) < 4 * found.dry[1]
    assert "falls as the amplitude of the steer rate grows" in words.amplitude_note(found)
    if histories.residual is not None:
        assert draw_torque(histories, tmp_path / "torque")
        assert "Last: equivalent damping" in caption(histories)


def test_the_curve_over_amplitude_goes_through_what_it_was_fitted_to():
    """4 T / (pi A) of Den Hartog (1931) beside viscous damping, without noise: the curve passes through each piece."""
    rate = np.array([0.5, 1.0, 2.0])
    found = Amplitude(rate, 0.7 + 4 * 0.2 / (np.pi * rate), np.full(3, 0.01), (0.7, 0.1), (0.2, 0.05))
    axis = Figure().subplots()
    draw_amplitude(axis, found)
    (curve,) = (line for line in axis.lines if "dry friction" in line.get_label())
    assert np.interp(rate, *curve.get_data()) == pytest.approx(found.damping, rel=1e-3)


# ------------------------------------------------------------------ words


def test_words_of_amplitude_are_those_of_the_numbers():
    numbers = {"rate": np.array([0.1, 1.0]), "damping": np.ones(2), "sd": np.ones(2), "viscous": (0.5, 0.1)}
    assert "falls as" in words.amplitude_note(Amplitude(**numbers, dry=(0.4, 0.1)))
    assert "rises with the amplitude" in words.amplitude_note(Amplitude(**numbers, dry=(-0.4, 0.1)))
    assert "does not depend on the amplitude" in words.amplitude_note(Amplitude(**numbers, dry=(0.2, 0.1)))
    assert words.amplitude_note(None) == ""


@pytest.mark.parametrize(
    ("library", "errors", "said"),
    [
        ((Likeness("steer_spring", 0.4, True),), (), "that of no effect of the library; the likest, steer_spring, has "
         "40 % of its power, with the opposite sign."),
        ((Likeness("steer_spring", 0.9), Likeness("crown_radius", 0.6, True)), (), "90 % of its power has the shape of "
         "steer_spring; crown_radius 60 %, with the opposite sign."),
        ((), (Likeness("steer_delay", 0.85), Likeness("bias", 0.3)), "would do the same to these data, and must be "
         "ruled out first: steer_delay (85 %)."),
        ((), (Likeness("steer_delay", 0.5),), "No error of the measurement would do the same to these data; "
         "steer_delay comes nearest, with 50 % of it."),
    ],
)  # fmt: skip
def test_likeness_is_told_with_its_sign(reported, library, errors, said):
    shape = Shape(reported.findings.kept.shape.shares, library, errors)
    assert said in words.sentence(dataclasses.replace(reported.findings.kept, shape=shape))


@pytest.mark.parametrize(
    ("most", "gains", "said"),
    [
        (1, (-2.0, -2.0), "steer torque against the lean rate"),
        (2, (-2.0, -2.0), "steer torque against the lean rate, the same at all speeds"),
        (3, (2.0, 2.0), "steer torque with the lean rate, the same at all speeds"),
        (2, (1.0, 4.0), "steer torque with the lean rate, growing with speed"),
        (2, (-4.0, -1.0), "steer torque against the lean rate, falling with speed"),
        (2, (-1.0, 1.0), "steer torque from the lean rate that changes its sign with speed"),
    ],
)
def test_a_coefficient_is_told_as_it_goes_with_speed(most, gains, said):
    """From 4 to 6 m/s; of data at one speed nothing is said of others."""

    def gains_at(speeds):
        every = np.zeros((len(speeds), 2, 4))
        every[:, 0, 2] = np.interp(speeds, [4.0, 6.0], gains)
        return every, 0 * every

    kept = Kept(residual=SimpleNamespace(scale=SpeedScale(5.0, 1.0, most), gains_at=gains_at))
    assert words._direction(kept, ("steer", "lean_rate")) == said


def test_coefficients_have_plain_names():
    assert plain("steer_from_lean_rate_slope") == "steer torque from lean rate, slope"
    assert plain("lean_from_steer") == "lean torque from steer"


def test_a_corrected_model_that_is_none_has_no_critical_speeds(reported, monkeypatch):
    def none(diagnosis, residual=None):
        raise InputError("no bicycle")

    monkeypatch.setattr("studies.missing_effect.residual.kept.corrected_model", none)
    without = dataclasses.replace(reported.findings, kept=keep(reported.diagnosis))
    assert "Where modes of the corrected model" not in page(reported.diagnosis, without, {"residual_torque": ""})
    assert of_kept(without.kept)["critical_speeds"] is None


def test_the_terminal_says_that_there_is_no_corrected_model_and_why(reported, monkeypatch, capsys):
    def none(diagnosis, residual=None):
        raise InputError("the mass is below what is left")

    monkeypatch.setattr("studies.missing_effect.reporting.corrected_model.corrected_model", none)
    every = [c.identifier for c in reported.diagnosis.measurement.forward().candidates]
    left_out = [part for name in every if name not in TRIED for part in ("--without", name)]
    main(["diagnose", str(reported.folder.parent / "MEASUREMENT.toml"), *left_out])
    assert "There is no corrected model: the mass is below what is left. No bicycle has" in capsys.readouterr().out


def test_why_there_is_no_corrected_model_names_the_value_and_what_to_do(reported):
    """A swaying rider without mass and with 24.6 kg m^2 about x, of a rear frame with less."""
    measurement = reported.diagnosis.measurement.on(Model(load_bicycle("benchmark")))
    forward = measurement.forward()
    (rider,) = (c for c in forward.candidates if c.identifier == "rider_lean")
    start = dict(zip((u.name for u in rider.unknowns), rider.starts[0], strict=True)) | {"mass": 0.0, "Ixx": 24.6}
    theta = np.array([*(u.centre for u in forward.nuisances), *start.values()])
    unknowns = (*forward.nuisances, *rider.unknowns)
    massless = dataclasses.replace(
        reported.diagnosis.final, candidates=(rider,), unknowns=unknowns, theta=theta,
        covariance=np.eye(len(theta)), jacobian=np.zeros((1, len(theta))),
    )  # fmt: skip
    diagnosis = SimpleNamespace(measurement=measurement, final=massless)
    told = why_none(diagnosis, SimpleNamespace(fit=massless))
    assert told.startswith(
        "There is no corrected model: the base model cannot take the values of rider_lean: effect 'rid"
    )
    assert "negative principal inertia -" in told
    assert told.endswith("in [candidates.rider_lean] of the measurement file, or try --without rider_lean.")
    assert why_none(reported.diagnosis, reported.findings.kept.residual) == ""
