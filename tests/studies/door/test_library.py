"""The library in a script: arrays of parameters against bicycles one by one, everyday names, refusals in a sentence."""

import doctest
import inspect

import numpy as np
import pytest

pytest.importorskip("xarray")

import velotyre as vt
from studies.cli import main
from studies.door import library
from tyre.ground import InputError

TYRE = vt.RelaxationLength(cornering_stiffness=6000.0, relaxation_length=0.1)
HINGE = {"joint_x": 0.8, "joint_z": -0.85, "damping": 15.0}


def hinged(stiffness, **changes):
    bicycle = vt.load_bicycle("benchmark").replace(**changes)
    return vt.Model(bicycle, [TYRE, vt.FrontCompliance(stiffness=stiffness, **HINGE)])


def test_the_examples_run():
    assert doctest.testmod(library, extraglobs={"np": np}).failed == 0


def test_arrays_are_bicycles_one_by_one():
    stiffness, trail, speeds = [2000.0, 4000.0], [0.06, 0.07, 0.09], [5.0, 12.0]
    found = vt.modes(hinged(3000.0), speeds, {"front_compliance.stiffness": stiffness}, trail=trail)
    assert found.sizes == {"front_compliance.stiffness": 2, "c": 3, "speed": 2, "mode": len(found.mode)}
    for i, one in enumerate(stiffness):
        for k, c in enumerate(trail):
            roots = np.linalg.eigvals(hinged(one, c=c).linear_model().state_matrix(speeds))
            here = found.isel({"front_compliance.stiffness": i, "c": k})
            for place in range(2):
                values = here.eigenvalue.values[place]
                values = values[np.isfinite(values)]
                assert len(values) >= 5
                assert np.abs(roots[place][:, None] - values).min(0).max() < 1e-7 * np.abs(roots[place]).max()
            wobble = here.eigenvalue.sel(mode="wobble").values
            np.testing.assert_allclose(here.frequency.sel(mode="wobble"), wobble.imag / (2 * np.pi), rtol=1e-12)
            np.testing.assert_allclose(here.damping_ratio.sel(mode="wobble"), -wobble.real / np.abs(wobble), rtol=1e-12)


def test_one_number_has_no_dimension_and_units_are_told():
    found = vt.modes("benchmark", 5.0, trail=0.06)
    assert set(found.sizes) == {"mode"}
    assert found.frequency.attrs["units"] == "Hz"
    assert found.coords["c"].item() == 0.06


def test_critical_speeds_over_arrays_and_a_sweep_with_draws():
    found = vt.critical_speeds("benchmark", wheelbase=[1.02, 1.1])
    # Meijaard et al. (2007), table 2
    published = {("weave", "stabilising"): 4.29238253634111, ("capsize", "destabilising"): 6.02426201538837}
    for (mode, change), speed in published.items():
        place = {"w": 1.02, "crossing_mode": mode, "as_speed_grows": change, "occurrence": 1}
        assert found.sel(place).item() == pytest.approx(speed, rel=1e-9)
    drawn = vt.sweep("benchmark", "parameters", samples=2000, sampled={"trail": {"sd": 0.002}})
    assert float(drawn.parameters.sel(parameter="c").std()) == pytest.approx(0.002, rel=0.06)


def test_head_angle_is_the_tilt_from_the_horizontal(no_pictures, tmp_path, capsys):
    bicycle = vt.load_bicycle("benchmark")
    lam = np.radians(90 - 71.0)
    assert bicycle.replace(head_angle=71.0)["steer_axis_tilt"] == pytest.approx(lam, rel=1e-15)
    values = {key: value for key, value in bicycle.values.items() if key not in ("w", "c", "lam")}
    named = values | {"wheelbase": 1.02, "trail": 0.08, "head_angle": "71.0(5)"}
    model = vt.build_model({"bicycle": named})
    assert model.bicycle["lam"] == pytest.approx(lam, rel=1e-15)
    assert model.bicycle.sd["lam"] == pytest.approx(np.radians(0.5), rel=1e-12)
    assert (model.bicycle["w"], model.bicycle["c"]) == (1.02, 0.08)
    found = vt.sweep("benchmark", "max_growth_rate", speeds=5.0, head_angle=[71.0, 72.0])
    assert found.lam.values == pytest.approx(np.radians([19.0, 18.0]))
    main(["root-locus", "benchmark", "--parameter", "trail", "--range", "0.06:0.1", "--speed", "5", "--json", "-",
          "--out", str(tmp_path)])  # fmt: skip
    one = capsys.readouterr().out
    main(["root-locus", "benchmark", "--parameter", "c", "--range", "0.06:0.1", "--speed", "5", "--json", "-",
          "--out", str(tmp_path)])  # fmt: skip
    assert one.replace('"trail"', '"c"') == capsys.readouterr().out


def test_what_a_model_may_be(tmp_path):
    file = tmp_path / "model.toml"
    file.write_text('bicycle = "benchmark"\n')
    expected = vt.modes("benchmark", [5.0]).frequency("weave")
    for model in (vt.Model("benchmark"), vt.load_bicycle("benchmark"), file, str(file), {"bicycle": "benchmark"},
                  vt.Model("benchmark").linear_model()):  # fmt: skip
        np.testing.assert_array_equal(vt.modes(model, [5.0]).frequency("weave"), expected)
    spread = vt.uncertainty(vt.load_bicycle("pista"), assume=False, samples=300)
    assert spread.linear_sd.tolist() == vt.uncertainty("pista", assume=False, samples=300).linear_sd.tolist()


def test_a_design_keeps_what_it_was_asked_for():
    found = vt.design("benchmark", {"weave": "stable"}, ["trail"], speeds=(4.2, 5.5))
    roots = np.linalg.eigvals(vt.build_model(found.content).linear_model().state_matrix(np.linspace(4.2, 5.5, 60)))
    waves = roots[np.abs(roots.imag) > 1.0]
    assert -1e-3 < waves.real.max() < 1e-6


@pytest.mark.parametrize(("call", "words"), [
    (lambda: vt.modes(5, 5.0), "5 is no model; give a bicycle's name, a file, a Bicycle or a Model"),
    (lambda: vt.modes("benchmark", "fast"), "speeds = 'fast': give numbers"),
    (lambda: vt.modes("benchmark", 5.0, trial=[0.06]), "unknown parameter 'trial'"),
    (lambda: vt.modes("benchmark", 5.0, c=[0.06], trail=[0.06]), "trail is c, which is given, too; keep one"),
    (lambda: vt.modes("benchmark", 5.0, c=["x"]), "grid.c = 'x' must be a finite number"),
    (lambda: vt.modes("benchmark", 5.0, c=[np.nan]), "grid.c = nan must be a finite number"),
    (lambda: vt.modes(vt.Model("benchmark").linear_model(), 5.0, c=[0.06]), "give the Model it was made of"),
    (lambda: vt.modes("benchmark", 5.0, c=np.linspace(0.05, 0.1, 1000), w=np.linspace(1, 1.1, 5000)),
     "points = 5000000: the arrays would take 1.28 GB of memory; up to 3906250 fit"),
    (lambda: vt.root_locus("benchmark", "c", [0.1], speed=5.0), "values of c: give two or more finite numbers"),
    (lambda: vt.root_locus("benchmark", "head_angle", [70, 72], speed=5.0), "here give steer_axis_tilt"),
    (lambda: vt.simulate("benchmark", 5.0, duration=-1.0), "give 1 to a million steps"),
    (lambda: vt.Model("benchmrk"), "unknown bicycle 'benchmrk'; did you mean 'benchmark'"),
])  # fmt: skip
def test_wrong_arguments_get_one_sentence(call, words):
    with pytest.raises(InputError) as error:
        call()
    assert words in str(error.value)
    assert "\n" not in str(error.value)


def test_signatures_are_read_at_a_glance_and_help_lists_names():
    for name in vt.HOME:
        found = getattr(vt, name)
        if inspect.isfunction(found):
            assert "numpy._typing" not in str(inspect.signature(found)), name
    for name in ("modes", "sweep", "root_locus", "uncertainty", "chart", "design", "simulate", "diagnose", "TyreMap"):
        assert f"``{name}``" in vt.__doc__


def test_results_with_arrays_print_two_or_three_lines():
    """A result of a thousand numbers is read at a glance; the numbers are in its fields."""
    model = vt.Model("benchmark", vt.RelaxationLength(cornering_stiffness=6000.0, relaxation_length=0.1))
    history = vt.InputHistory(np.linspace(0.0, 1.0, 500), np.zeros(500))
    table = vt.read_tyre("Tyre1").measured
    locus = vt.root_locus(model, "speed", [1, 8])
    bode = vt.frequency_response(model, speed=5.0, input="steer_torque", frequency_hz=np.linspace(0.1, 5, 50))
    results = [
        (history, "500 times, 0 to 1 s"),
        (table, "Tyre1 on flat: 9 conditions, 340-490 N and 3.5-7.5 bar"),
        (locus, f"crossings of the imaginary axis: weave {locus.crossings[0].value:.6g} m/s"),
        (vt.simulate("benchmark", 5.0, inputs={"steer_torque": history}), "at 5 m/s: 1001 times, 0 to 5 s"),
        (bode, "to steer_torque at 5 m/s: 50 frequencies, 0.1 to 5 Hz"),
        (vt.chart("benchmark", "speed=1:10", "c=0.05:0.1"), "speed 1 to 10 m/s, c 0.05 to 0.1 m"),
        (vt.limit_cycles("sharp1994"), "onsets: weave at"),
    ]
    for result, words in results:
        assert words in str(result)
        assert str(result).startswith(f"<{type(result).__name__}")
        assert len(str(result).splitlines()) <= 3
        assert len(str(result)) < 300
