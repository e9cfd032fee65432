"""Reports of a bicycle: the corrected model, the command."""

import dataclasses
import json
import re
import shlex
import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from read_report import read_report
from scipy.stats import chi2
from small_library import all_but

from bicycle import effect_class
from bicycle.model import read_model
from studies.cli import main
from studies.diagnosis import corrected_model, model_text, read_measurement
from tyre.ground import InputError

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples" / "measurements"


def at_values(nuisances, theta):
    """Values of the nuisances by name: their coordinates, but for inertias, which share those of their body."""
    found = {u.name: float(x) for u, x in zip(nuisances, theta, strict=False)}
    inertias = next(u.coupling for u in nuisances if u.coupling is not None)
    coordinates = np.array([[found[key]] for key in inertias.keys])
    return found | dict(zip(inertias.keys, inertias.values(coordinates)[:, 0].tolist(), strict=True))


def test_the_corrected_model_has_the_values_of_the_final_fit(damped, tmp_path):
    (tmp_path / "model.toml").write_text(model_text(damped))
    model = read_model(tmp_path / "model.toml")
    final = damped.final
    for name, x in at_values(damped.kind.nuisances, final.theta).items():
        assert model.parameters[name] == pytest.approx(x, rel=1e-12), name
    assert model.parameters["steer_damper.damping"] == pytest.approx(final.theta[-1], rel=1e-12)
    made = corrected_model(damped)
    assert (dict(model.bicycle.values), model.effects) == (dict(made.bicycle.values), made.effects)
    assert not np.allclose(final.theta[:-1], [u.centre for u in damped.kind.nuisances])


def test_the_corrected_model_is_known_as_well_as_the_data_tell(damped, modal, tmp_path):
    """As from the normal equations at the fit, by hand."""
    (tmp_path / "model.toml").write_text(model_text(damped))
    model = read_model(tmp_path / "model.toml")
    assert model.covariance.origin == "model file"
    assert 0 < model.sd["steer_damper.damping"] < 0.5 * model.effects[-1].damping
    assert model.sd["IBxx"] > 0
    names = list(model.covariance.names)
    residual, jacobian = damped.kind.residual(damped.final.candidates, damped.final.theta)
    prior = np.diag([1 / u.scale**2 for u in damped.final.unknowns])
    assert chi2.sf(damped.final.objective, len(residual) - 1) > 0.01  # it fits: the stated noise is the noise
    posterior = np.linalg.inv(jacobian.T @ jacobian + prior)
    slopes = np.eye(len(posterior))
    nuisances = damped.kind.nuisances
    for k, u in enumerate(nuisances):
        ways = []
        for shift in (1e-4, -1e-4):
            theta = damped.final.theta.copy()
            theta[k] += shift * u.scale
            ways.append(np.array(list(at_values(nuisances, theta).values())))
        slopes[: len(nuisances), k] = (ways[0] - ways[1]) / (2e-4 * u.scale)
    posterior = slopes @ posterior @ slopes.T
    for k, u in enumerate(damped.kind.nuisances):
        assert model.sd[u.name] == pytest.approx(np.sqrt(posterior[k, k]), rel=1e-4), u.name
    last = names.index("steer_damper.damping")
    for k, u in enumerate(damped.kind.nuisances):
        together = model.covariance.matrix[last, names.index(u.name)]
        assert together == pytest.approx(posterior[-1, k], abs=1e-4 * np.sqrt(posterior[-1, -1] * posterior[k, k]))


def test_what_the_measurement_states_to_be_exact_is_exact_in_the_corrected_model(modal, begun):
    measurement = dataclasses.replace(read_measurement(modal / "MEASUREMENT.toml"), uncertainty={"w": 0.0, "c": 0.002})
    model = corrected_model(begun(measurement, "steer_damper", verdict="named"))
    assert model.sd["w"] == 0.0
    assert 0 < model.sd["c"] <= 0.002


def test_what_an_effect_takes_from_the_one_it_replaces_is_known_as_well(modal, begun):
    measurement = read_measurement(modal / "MEASUREMENT.toml")
    slip = effect_class("side_slip")(cornering_stiffness=8000.0)
    found = begun(dataclasses.replace(measurement, model=measurement.model.with_effect(slip)), "relaxation_length")
    place = [u.name for u in found.final.unknowns].index("side_slip.cornering_stiffness.front")
    sd = np.sqrt(found.final.covariance[place, place] * max(1.0, found.final.objective / len(found.final.residual)))
    assert corrected_model(found).sd["relaxation_length.cornering_stiffness.front"] == pytest.approx(sd)


def test_errors_of_the_measurement_are_not_in_the_model(modal, begun):
    found = begun(read_measurement(modal / "MEASUREMENT.toml"), "speed_scale", verdict="named")
    assert [e.identifier for e in corrected_model(found).effects] == ["no_slip"]


def test_a_model_that_cannot_be_says_why(damped):
    broken = SimpleNamespace(**vars(damped))
    theta = damped.final.theta.copy()
    theta[[u.name for u in damped.kind.nuisances].index("mB")] = -3.0
    broken.final = dataclasses.replace(damped.final, theta=theta)
    with pytest.raises(InputError, match="mB"):
        model_text(broken)


@pytest.mark.usefixtures("two_variants")
@pytest.mark.parametrize("variants", [True, False])
def test_the_command_says_the_sentence_and_where_the_report_is(modal, tmp_path, capsys, no_pictures, variants):
    measurement = read_measurement(modal / "MEASUREMENT.toml")
    few = [f"--without={name}" for name in all_but(measurement, ("steer_damper", "pneumatic_trail", "speed_scale"))]
    more = [] if variants else ["--no-stability"]
    out = tmp_path / "out"
    main(["diagnose", str(modal / "MEASUREMENT.toml"), "--out", str(out), "--workers", "1", *few, *more])
    shown = capsys.readouterr().out.splitlines()
    found = json.loads((out / "verdict.json").read_text())
    assert shown[0].startswith(f"{found['verdict']}. {found['sentence']}")
    assert any(line.endswith(f"Report: {out / 'report.html'}") for line in shown)
    assert (found["stability"] is not None) == variants
    if variants:
        confidence = next(line for line in shown if line.startswith("confidence: named, probability "))
        assert found["stability"]["sentence"] in confidence
    line = next(line for line in shown if line.startswith("model: "))
    main(shlex.split(re.search(r"Use: `velotyre (.*?)`", line)[1]))  # as it stands there, from this folder
    assert "weave" in capsys.readouterr().out
    text = read_report(out)
    written = r"`model.toml` with steer_damper added, parameters re-estimated \(largest shift: .*\)"
    assert re.search(rf"\*\*Model file:\*\* {written}", text)
    assert isinstance(found["moved"], list)


def test_a_corrected_model_keeps_the_damping_ratio_of_its_base(begun, tmp_path):
    """Weave alone says little of a stiff front, so its damping stays near that of the ratio, not at the default 20."""
    folder = shutil.copytree(EXAMPLES / "modal", tmp_path / "modal")
    front = "[effects.front_compliance]\nstiffness = 5000\nheight_above_hub = 0.3\ndamping_ratio = 0.02\n"
    with (folder / "MEASUREMENT.toml").open("a") as file:
        file.write(f"\n{front}")
    kind = read_measurement(folder / "MEASUREMENT.toml")
    stated = kind.model.parameters["front_compliance.damping"]
    assert stated < 5.0
    found = corrected_model(begun(kind)).parameters
    assert found["front_compliance.damping"] == pytest.approx(stated, rel=0.3)
    assert found["front_compliance.joint_z"] == pytest.approx(
        kind.model.parameters["front_compliance.joint_z"], abs=0.1
    )
