"""Report, terminal and JSON of what could not be named; it is never a name."""

import dataclasses
import json
import math
from types import SimpleNamespace

import numpy as np
import pytest
from read_report import printed, read_report
from small_library import among

from bicycle import Model, load_bicycle
from bicycle.model import read_model
from studies.cli import main
from studies.diagnosis import (
    JointData,
    corrected,
    find,
    fit_residual,
    page,
    read_measurement,
    record,
    term_name,
    write_report,
)
from studies.inference import HeldOut, Part, Verdict, fit
from tests.validation.blind.generator import modal_case

TRIED = ("steer_spring", "speed_scale", "lean_sensor_delay")


@pytest.fixture(scope="module")
def reported(tmp_path_factory):
    """Synthetic: a damper of a size of the generator's, and a library that does not know it."""
    folder = tmp_path_factory.mktemp("reported")
    modal_case(folder, hidden=("steer_damper",), rng=np.random.default_rng(11), bicycle="browser", kind="rolling")
    measurement = read_measurement(folder / "MEASUREMENT.toml")
    found = among(measurement, TRIED)
    findings = find(found)
    write_report(found, folder / "report", findings)
    return SimpleNamespace(folder=folder / "report", diagnosis=found, findings=findings)


def test_the_verdict_stays_and_the_torque_is_no_name(reported):
    verdict = reported.diagnosis.verdict
    assert (verdict.verdict, verdict.effects) == ("unknown", ())
    written = json.loads((reported.folder / "verdict.json").read_text())
    plain = json.loads(json.dumps(verdict.to_dict()))
    assert {key: written[key] for key in plain} == plain
    named = (written["sentence"], *verdict.posterior, *verdict.equivalent, *(m.what for m in verdict.mimics))
    assert not any("residual" in text for text in named)
    assert "unmodelled_torque" in verdict.refused
    assert "unmodelled_torque" not in {e["identifier"] for e in written["effects"]}


def test_the_json_has_the_torque_with_its_covariance(reported):
    found = json.loads((reported.folder / "verdict.json").read_text())["unmodelled_torque"]
    assert (found["fitted"], found["name_of_a_cause"]) == (True, False)
    assert found["coefficients"]["steer_from_steer_rate"]["unit"] == "N m s/rad"
    names, matrix = found["covariance"]["coefficients"], np.array(found["covariance"]["matrix"])
    assert set(names) == {*found["coefficients"], *found["left_at_zero"]}
    for name, told in {**found["coefficients"], **found["left_at_zero"]}.items():
        k = names.index(name)
        assert math.sqrt(matrix[k, k]) == pytest.approx(told["sd"])
    gains = reported.findings.torque.gains["steer_from_steer_rate"]
    told = found["coefficients"]["steer_from_steer_rate"]
    assert (told["gain_log_evidence"], told["gain_held_out"]) == pytest.approx(gains)
    assert found["held_out"]["gap_with"] < found["held_out"]["gap_without"]


def test_the_page_has_a_section_with_its_figure(reported):
    text = read_report(reported.folder)
    section = text.split("Unmodelled torque</summary>")[1].split("</details>")[0]
    assert "are fitted by an empirical torque, linear in the state (`unmodelled_torque`)." in section
    torque = reported.findings.torque
    value, sd = printed(*(of["steer_from_steer_rate"] for of in (torque.values, torque.sd))).split(" ± ")
    assert f"| steer torque from steer rate | {value} N m s/rad | {sd} |" in section
    assert (reported.folder / "unmodelled_torque.png").stat().st_size > 10_000
    model = read_model(reported.folder / "model.toml")
    assert "unmodelled_torque" in [e.identifier for e in model.effects]
    assert (reported.folder / "report.html").read_text().count("unmodelled_torque.png") == 1


@pytest.mark.parametrize("command", [("modes",), ("critical",), ("uncertainty", "--samples", "50")])
def test_other_commands_read_the_corrected_model(reported, printed, command):
    assert "weave" in printed(command[0], str(reported.folder / "model.toml"), *command[1:])


def test_nothing_is_said_if_nothing_was_left_open_and_a_refusal_says_why(reported):
    closed = dataclasses.replace(reported.findings, torque=None)
    assert "Unmodelled torque</summary>" not in page(reported.diagnosis, closed, {})
    assert record(reported.diagnosis, closed)["unmodelled_torque"] is None
    refused = dataclasses.replace(closed, no_torque="all data are of one run")
    text = page(reported.diagnosis, refused, {})
    assert "No unmodelled torque is fitted: all data are of one run." in text
    assert record(reported.diagnosis, refused)["unmodelled_torque"] == {
        "fitted": False,
        "why": "all data are of one run",
    }


def test_the_gain_on_data_left_out_is_told_in_chi2(reported):
    torque = reported.findings.torque
    n = len(torque.before.residual)
    before, after = HeldOut(0.0, np.full(n, 0.5)), HeldOut(0.0, np.full(n, 0.25))
    closed = dataclasses.replace(torque, before=before, after=after)
    told = page(reported.diagnosis, dataclasses.replace(reported.findings, torque=closed), {})
    assert f"χ² of {n} held-out data points: {n / 4:.1f} without it, {n / 16:.2f} with it." in told


def test_it_cannot_be_asked_for(reported, capsys):
    file = reported.folder.parent / "MEASUREMENT.toml"
    with pytest.raises(SystemExit, match="2"):
        main(["diagnose", str(file), "--with", "unmodelled_torque"])
    assert "unmodelled_torque: an empirical term, never a name" in capsys.readouterr().err
    forward = read_measurement(file).prepare(without=("unmodelled_torque",))
    assert "unmodelled_torque" not in {c.identifier for c in forward.candidates}


def left_open(measurement):
    forward = measurement.prepare()
    verdict = Verdict("unknown", (), (), {}, {}, {}, (), (), 0.0)
    return SimpleNamespace(kind=forward, final=fit(forward), verdict=verdict)


def test_joint_data_have_one_torque(reported):
    whole = reported.diagnosis.kind
    parts = tuple((name, dataclasses.replace(whole, points=whole.points[k::2])) for k, name in enumerate("ab"))
    joint = JointData(name="joint", model=whole.model, parts=tuple(Part(name, part) for name, part in parts))
    found, alone = fit_residual(left_open(joint)), reported.findings.torque
    three = 3 * alone.sd["steer_from_steer_rate"]
    assert found.values["steer_from_steer_rate"] == pytest.approx(alone.values["steer_from_steer_rate"], abs=three)


@pytest.mark.parametrize(
    ("mass", "x", "told"), [(0.0, 0.352, ["mass"]), (8.0, 0.36, ["mass", "xB"]), (10.0, 0.352, [])]
)
def test_a_parameter_that_the_torque_moves_by_more_than_one_sd_is_told(reported, mass, x, told):
    """Luggage of 11.6 +- 1.9 kg was named and has another mass with the torque; xB is 0.352 +- 0.005 m."""
    torque = reported.findings.torque
    every = reported.diagnosis.kind.prepare()
    (luggage,) = (c for c in every.candidates if c.identifier == "luggage")
    names = [u.name for u in torque.named.unknowns]
    size = [u.name for u in luggage.unknowns].index("mass")
    theta = np.concatenate([torque.named.theta, luggage.starts[0]])
    theta[names.index("xB")], theta[len(names) + size] = 0.352, 11.6
    sd = np.full(len(theta), 1e3)
    sd[names.index("xB")], sd[len(names) + size] = 0.005, 1.9
    beside = dataclasses.replace(
        torque.named, candidates=(luggage,), unknowns=(*torque.named.unknowns, *luggage.unknowns), theta=theta,
        covariance=np.diag(sd**2),
    )  # fmt: skip
    now, after = theta.copy(), sd.copy()
    now[names.index("xB")], now[len(names) + size], after[len(names) + size] = x, mass, 3.2
    moved = dataclasses.replace(torque.fit, theta=np.append(now, -3.0))
    changed = dataclasses.replace(torque, named=beside, fit=moved, covariance=np.diag(np.append(after, 0.1) ** 2))
    found = changed.list_changes()
    assert [one.name for one in found] == told
    if told:
        assert (found[0].effect, found[0].named, found[0].value) == ("luggage", 11.6, mass)
        assert found[0].replaced == (mass == 0.0)


def test_coefficients_have_plain_names():
    assert term_name("steer_from_lean_rate_slope") == "steer torque from lean rate, slope"
    assert term_name("lean_from_steer") == "lean torque from steer"


def test_a_model_that_cannot_be_names_the_value_and_what_to_do(reported):
    """A swaying rider without mass and with 24.6 kg m^2 about x, of a rear frame with less."""
    measurement = reported.diagnosis.kind.with_model(Model(load_bicycle("benchmark")))
    forward = measurement.prepare()
    (rider,) = (c for c in forward.candidates if c.identifier == "rider_lean")
    start = dict(zip((u.name for u in rider.unknowns), rider.starts[0], strict=True)) | {"mass": 0.0, "Ixx": 24.6}
    theta = np.array([*(u.centre for u in forward.nuisances), *start.values()])
    massless = dataclasses.replace(
        reported.diagnosis.final, candidates=(rider,), unknowns=(*forward.nuisances, *rider.unknowns), theta=theta,
        covariance=np.eye(len(theta)), jacobian=np.zeros((1, len(theta))),
    )  # fmt: skip
    diagnosis = dataclasses.replace(reported.diagnosis, kind=forward, final=massless)
    made = corrected(diagnosis, SimpleNamespace(fit=massless, covariance=massless.covariance, dropped=()))
    assert made.texts == {}
    assert "rider_lean" in made.error
    assert "negative principal inertia -" in made.error
    text = page(reported.diagnosis, reported.findings, {}, made)
    assert "**Model file:** None: the base model cannot take the values of rider_lean" in text
