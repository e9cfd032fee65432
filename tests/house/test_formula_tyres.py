"""Every command with a .tir tyre, and with Pacejka-89 coefficients where that is another way."""

import json
from dataclasses import replace

import numpy as np
import pytest

from studies.cli import main
from studies.diagnosis import read_measurement
from studies.main_study import settings_of, tyre_cases
from studies.motion import parameter_path
from studies.sweep import TYRE_DRAWS, Sampler, build_sweep
from studies.uncertainty import UncertainModel
from tests.shared.formula_tyres import MODEL, PACEJKA89, TIR
from tyre.ground import InputError
from tyre.laws import parse_tir

PRESSURE = 5.5
TAKEN = {
    "relaxation_length.cornering_stiffness": "cornering_stiffness",
    "relaxation_length.relaxation_length": "relaxation_length",
    "camber_thrust.camber_stiffness": "camber_stiffness",
    "pneumatic_trail.trail": "pneumatic_trail",
    "twisting_torque.twisting_stiffness": "twisting_stiffness",
}
"""Parameter of the model file -> what of the tyre it is."""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "my.tir").write_text(TIR)
    (tmp_path / "my89.toml").write_text(PACEJKA89)
    (tmp_path / "model.toml").write_text(MODEL.format(tyre="my.tir", pressure=PRESSURE))
    return tmp_path


def assert_taken(bicycle, pressure, value):
    """Every parameter of each wheel is that of the file at its load."""
    source = parse_tir(TIR, source="x")
    for wheel, load in zip(("rear", "front"), bicycle.static_loads, strict=True):
        expected = source.at(load=load, pressure=pressure)
        for key, name in TAKEN.items():
            assert value(f"{key}.{wheel}") == pytest.approx(getattr(expected, name), rel=1e-12)


def json_of(capsys, *words):
    main([str(word) for word in words])
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("tyre", ["my.tir", "my89.toml"])
def test_critical_speeds_with_the_option_and_with_a_model(folder, capsys, tyre):
    file = folder / "law.toml"
    file.write_text(f'bicycle = "benchmark"\n[effects.relaxation_length]\ntyre = "{tyre}"\npressure_bar = 5\n')
    by_file = json_of(capsys, "critical", file, "--json", "-")["critical_speeds"]
    option = ("critical", "benchmark", "--tyre", folder / tyre, "--pressure", "5", "--json", "-")
    assert json_of(capsys, *option)["critical_speeds"] == by_file
    assert by_file


def test_modes_say_that_the_values_are_extrapolated(folder, capsys):
    main(["modes", str(folder / "model.toml"), "--speeds", "5:6:1"])
    shown = capsys.readouterr()
    assert "wobble" in shown.out
    assert "Made-up 28 on flat" in shown.err
    main(["modes", "benchmark", "--tyre", str(folder / "my.tir"), "--pressure", "7.5", "--speeds", "5:6:1"])
    assert "extrapolated" in capsys.readouterr().err


def test_a_missing_pressure_lists_those_of_the_file(folder, capsys):
    with pytest.raises(SystemExit):
        main(["modes", "benchmark", "--tyre", str(folder / "my.tir")])
    assert "needs --pressure, in bar; it was measured at 3, 5, 7 bar" in capsys.readouterr().err


def test_simulate_and_sensitivity(folder, capsys):
    model = folder / "model.toml"
    out = folder / "s"
    main(f"simulate {model} --speed 6 --duration 0.5 --initial lean=0.02 --out {out}".split())
    assert "steer" in next((folder / "s").glob("response_*.csv")).read_text().splitlines()[0]
    capsys.readouterr()
    rows = json_of(capsys, "sensitivity", model, "--mode", "weave", "--speed", "6", "--json", "-")["parameters"]
    assert any(row["parameter"].startswith("camber_thrust.camber_stiffness") for row in rows)


def test_uncertainty_tells_what_is_assumed(folder, printed):
    shown = printed("uncertainty", str(folder / "model.toml"), "--speeds", "6", "--samples", "20", "--json", "-")
    assert "assumed" in shown
    assert "tyre lateral stiffness" in shown


def test_a_root_locus_over_pressure_moves_every_value_of_the_tyre(folder):
    path = parameter_path(folder / "model.toml", "pressure_bar", speed=6.0)
    model, _ = path.model_and_speed(4.0)
    assert_taken(model.bicycle, 4e5, model.parameters.__getitem__)
    found = path.matrices(np.array([4.0]))[0]
    np.testing.assert_allclose(found, model.linear_model().state_matrix(6.0), rtol=1e-9, atol=1e-9)
    assert path.space.inside([[6.9], [7.1]]).tolist() == [True, False]


def test_a_sweep_over_pressure_and_mass_follows_the_tyre(folder):
    sweep = build_sweep(
        {"model": "model.toml", "outputs": ["parameters"], "grid": {"pressure_bar": [4, 6.5, 8], "mB": [80, 90]}},
        folder=folder,
    )
    sampler = Sampler(sweep)
    points = sampler.points(0, 6)
    assert points.extrapolated.tolist() == [False] * 4 + [True] * 2
    for item, bar in enumerate([4.0, 4.0, 6.5, 6.5, 8.0, 8.0]):
        bicycle = sampler.variant(points, item).bicycle
        assert_taken(bicycle, bar * 1e5, lambda key, item=item: points.value(key, item))
    before = sweep.fingerprint
    (folder / "my.tir").write_text(TIR.replace("PKY2 = 1.8", "PKY2 = 1.9"))
    assert replace(sweep).fingerprint != before


def test_drawn_stiffnesses_of_a_formula_are_common_to_the_wheels(folder):
    uncertain = UncertainModel(folder / "model.toml", defaults=True)
    d = uncertain.deviations
    for wheel in ("rear", "front"):
        value = uncertain.nominal.parameters[f"relaxation_length.cornering_stiffness.{wheel}"]
        assert d[f"relaxation_length.cornering_stiffness.{wheel}"].sd == pytest.approx(0.03 * value, rel=1e-4)
        length = uncertain.nominal.parameters[f"relaxation_length.relaxation_length.{wheel}"]
        found = d[f"relaxation_length.relaxation_length.{wheel}"]
        assert found.origin == "assumed"
        assert "of either stiffness" in found.why
        # to first order in the wheel loads that masses and lengths move, C / K moves little
        assert found.sd == pytest.approx(np.sqrt(2) * 0.03 * length, rel=1e-3)
    columns = [uncertain.names.index(name) for name in TYRE_DRAWS]
    rear, front = (
        uncertain.jacobian[f"relaxation_length.cornering_stiffness.{wheel}"][columns] for wheel in ("rear", "front")
    )
    assert rear @ front / np.sqrt((rear @ rear) * (front @ front)) == pytest.approx(1.0, abs=1e-6)


def test_the_main_study_takes_the_tyre_as_its_subject(folder):
    settings = settings_of(str(folder / "model.toml"))
    source = parse_tir(TIR, source="x")
    rear, front = (source.at(load=load, pressure=PRESSURE * 1e5) for load in settings.bicycle.static_loads)
    given = settings.further["camber_thrust"]["camber_stiffness"]
    assert given == pytest.approx({"rear": rear.camber_stiffness, "front": front.camber_stiffness})
    found = tyre_cases(settings).studied
    assert found[0].name == "Made-up 28 (synthetic) flat"
    assert found[0].synthetic
    assert found[0].contact == pytest.approx(
        [rear.cornering_stiffness, rear.relaxation_length, front.cornering_stiffness, front.relaxation_length]
    )
    others = tyre_cases(settings_of(bicycle="benchmark", tyre=str(folder / "my89.toml"))).studied
    assert [case.pressure_bar for case in others] == [3.0, 5.0]


def test_a_diagnosis_starts_from_a_tir_tyre(folder):
    file = folder / "measurement.toml"
    (folder / "modes.csv").write_text(
        "speed_m_s,mode,real_1_s,imag_rad_s\n5,weave,-0.7,2.5\n6,weave,-1.3,4.2\n7,weave,-1.9,5.6\n"
    )
    file.write_text(
        'kind = "modal"\nbicycle = "benchmark"\n[effects.relaxation_length]\ntyre = "my.tir"\npressure_bar = 5\n'
        '[modal]\ntable = "modes.csv"\n'
    )
    base = read_measurement(file).model
    source = parse_tir(TIR, source="x").at(load=base.bicycle.static_loads[0], pressure=5e5)
    assert base.parameters["relaxation_length.cornering_stiffness.rear"] == pytest.approx(source.cornering_stiffness)


def test_a_tyre_file_is_listed_with_all_it_holds(folder, capsys, printed):
    shown = printed("tyres", str(folder / "my.tir"))
    for word in ("camber_stiffness_N_per_deg", "pneumatic_trail_mm", "twisting_stiffness", "note: synthetic"):
        assert word in shown
    record = json_of(capsys, "tyres", folder / "my89.toml", "--json", "-")
    assert record["pressures_bar"] == [3.0, 5.0]
    assert len(record["pneumatic_trail_mm"]) == record["conditions"] == 12


def test_the_main_study_says_what_it_needs(tmp_path):
    file = tmp_path / "m.toml"
    file.write_text(
        'bicycle = "benchmark"\n[effects.relaxation_length]\ntyre = "Schwalbe 50km Energizer Plus 28 x 1.75"\n'
        "pressure_bar = 4\nrelaxation_length = 0.1\n"
    )
    with pytest.raises(
        InputError, match="has no lateral stiffness, so no relaxation length, .* add the result of a lateral"
    ):
        tyre_cases(settings_of(str(file)))
