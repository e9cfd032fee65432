"""A bicycle of ``velotyre new``, whose numbers are known together, through every door: its covariance is never lost.

The expected sd comes from differences of bicycles built by hand and the covariance as the file has it.
"""

import json
import tomllib

import numpy as np
import pytest

import velotyre as vt
from bicycle.files import WRITERS
from bicycle.parameters import UNITS
from studies.cli import main
from studies.diagnosis import nuisances
from studies.explorer import (
    LIGHT,
    as_python,
    at_speed,
    controls_html,
    damping_figure,
    model_toml,
    parse_state,
    saved_page,
    start_state,
    with_file,
)

SPEED = 5.0  # m/s
EIGHT = ["--wheelbase", "1.02", "--trail", "0.06", "--head-angle", "72.5", "--wheel", "28-622", "--mass", "9"]
TYRE = {"cornering_stiffness": 6000.0, "relaxation_length": 0.1}


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("new") / "mine.toml"
    main(["new", str(path), *EIGHT])
    return path


@pytest.fixture(scope="module")
def stated(file):
    """Values, names of what is uncertain and its covariance, from the text alone."""
    content = tomllib.loads(file.read_text())
    together, alone = content["covariance"]["parameters"], content["sd"]
    factor = np.array(content["covariance"]["factor"])
    names = [*together, *alone]
    spread = np.zeros((len(names), len(names)))
    spread[: len(together), : len(together)] = factor @ factor.T
    spread[range(len(together), len(names)), range(len(together), len(names))] = np.array(list(alone.values())) ** 2
    assert abs(spread[0, 1:]).max() > 0.1  # mR hangs together with others, else this test could not tell
    return content["values"], names, spread


def sd_of(stated, quantity):
    """Sd of a ``quantity`` of a model on a tyre, by central differences over everything that is uncertain."""
    values, names, spread = stated
    slopes = []
    for name, variance in zip(names, np.diag(spread), strict=True):
        step = 1e-4 * np.sqrt(variance)
        ends = [quantity(values | {name: values[name] + sign * step}) for sign in (1, -1)]
        slopes.append((ends[0] - ends[1]) / (2 * step))
    return float(np.sqrt(np.array(slopes) @ spread @ np.array(slopes)))


def weave_stable_above(values):
    model = vt.Model(vt.Bicycle("by hand", {key: values[key] for key in UNITS}))
    return next(one.speed for one in vt.critical_speeds(model, 10.0) if one.mode == "weave")


def weave_damping(values):
    model = vt.Model(vt.Bicycle("by hand", {key: values[key] for key in UNITS}))
    return float(vt.modes(model, SPEED).damping_ratio("weave")[0])


def forms(file):
    """The same bicycle in every form in which the door takes one."""
    bicycle = vt.load_bicycle(file)
    tyre = vt.RelaxationLength(**TYRE)
    return {
        "file": str(file), "bicycle": bicycle, "model": vt.Model(bicycle), "content": {"bicycle": str(file)},
        "on a tyre": vt.Model(bicycle, tyre),
    }  # fmt: skip


def test_every_function_of_the_door_takes_it_with_its_covariance(file, stated):
    expected = sd_of(stated, weave_stable_above)
    for name, model in forms(file).items():
        table = vt.uncertainty(model, assume=False, samples=50)
        weave = table[table.quantity == "weave stable above"].iloc[0]
        if name != "on a tyre":
            assert weave.linear_sd == pytest.approx(expected, rel=1e-4), name
        if name in ("content", "model"):  # the same as the file and the bicycle
            continue
        assert vt.modes(model, [4.0, SPEED], trail=[0.05, 0.06]).frequency.shape[:2] == (2, 2)
        assert np.isfinite(vt.critical_speeds(model, 15.0, trail=[0.05, 0.06])).sum() >= 4
        assert vt.critical_speeds(model, 15.0)[0].mode == "weave"
        assert {"weave"} <= set(vt.chart(model, "speed=3:8", "c=0.05:0.07").frame()["mode"])
        assert vt.root_locus(model, "trail", [0.05, 0.06], speed=SPEED).eigenvalues.shape[0] == 2
        assert "file" in set(vt.sensitivity(model, "weave", SPEED).sd_origin.str.partition(" ")[2])
        drawn = vt.sweep(model, "critical_speeds", samples=3, sampled={"bicycle_sd": True}).critical_speeds
        weaves = drawn.sel(crossing_mode="weave", as_speed_grows="stabilising", occurrence=1)
        assert np.nanmax(weaves) - np.nanmin(weaves) > 0.1  # one of the three has no weave
        assert np.isfinite(vt.simulate(model, SPEED, duration=0.1, initial={"lean": 0.02}).outputs["lean"]).all()
    designed = vt.design(forms(file)["bicycle"], {"weave": "stable"}, ["trail"], speeds=(3.8, 4.2))
    kept = vt.build_model(designed.content).bicycle.covariance
    np.testing.assert_allclose(kept.matrix, vt.load_bicycle(file).covariance.matrix, rtol=1e-12)


def test_the_page_shows_the_sd_of_the_file(file, stated):
    expected = sd_of(stated, weave_damping)
    opened = start_state(str(file)).address
    dropped, _ = with_file(parse_state("bicycle=benchmark"), file.name, file.read_bytes())
    exported, _ = with_file(parse_state("bicycle=benchmark"), "model.toml", model_toml(dropped).encode())
    moved = f"{opened}&geometry.trail={vt.load_bicycle(file)['c']!r}"
    for address in (opened, dropped.address, exported.address, moved):
        state = parse_state(f"{address}&at={SPEED!r}".replace("&at=5.0", ""))
        assert parse_state(state.address) == state
        assert at_speed(state).sd["weave"] == pytest.approx(expected, rel=1e-4)
    state = parse_state(opened)
    shown = json.dumps(damping_figure(at_speed(state), LIGHT), default=str, ensure_ascii=False)
    assert f"± {expected:.1g}" in shown
    assert "trail" in controls_html(state)["model"]
    assert saved_page(state, LIGHT).startswith("<!DOCTYPE html>")
    ran: dict[str, object] = {}
    exec(as_python(state), ran)
    assert ran["model"].bicycle.covariance == vt.load_bicycle(file).covariance
    pinned = "&".join([opened, *(f"pin={opened.replace('%', '%25').replace('&', '%26').replace('=', '%3D')}",) * 4])
    assert len(parse_state(pinned).pins) == 4


@pytest.mark.parametrize("ending", WRITERS)
def test_each_format_keeps_it_or_says_what_it_loses(file, ending, tmp_path, capsys):
    bicycle, path = vt.load_bicycle(file), tmp_path / f"other{ending}"
    main(["convert", str(file), "--to", str(path)])
    told, again = capsys.readouterr().err, vt.load_bicycle(path)
    assert dict(again.sd) == pytest.approx(dict(bicycle.sd), rel=1e-12)
    if ending == ".txt":
        assert again.covariance.names == ()
        assert "the covariance of 18 parameters is not in this text" in told
        assert "correlations are lost" in path.read_text()
    else:
        np.testing.assert_array_equal(again.covariance.matrix, bicycle.covariance.matrix)
        assert "lost" not in told


def test_json_keeps_it(file, tmp_path):
    bicycle, path = vt.load_bicycle(file), tmp_path / "mine.json"
    path.write_text(json.dumps(tomllib.loads(file.read_text())))
    assert vt.load_bicycle(path).covariance == bicycle.covariance
    main(["bicycles", str(file), "--json", str(path)])
    assert json.loads(path.read_text())["covariance"]["parameters"] == list(bicycle.covariance.names)


def test_a_rider_on_it_keeps_it(file):
    """The mass of the rider adds to the variance of mB and leaves its covariance with mR as it was."""
    pytest.importorskip("yeadon")
    from bicycle.rider import SeatGeometry, rider_on_bicycle, scaled_rider
    from studies.reporting import with_provenance

    frame = vt.load_bicycle(file)
    seated = rider_on_bicycle(frame, scaled_rider(height=1.8, mass=75.0), posture="hoods", geometry=SeatGeometry())
    ridden = with_provenance(seated, "ridden")
    before, after = (one.covariance.among(["mB", "mR", "mF"]) for one in (frame, ridden))
    np.testing.assert_allclose(after[1:], before[1:], rtol=1e-9)
    assert after[0, 0] - before[0, 0] == pytest.approx(seated.rider.mass_sd**2, rel=1e-6)
    assert ridden.sd["zB"] < frame.sd["zB"]  # the rider weighs ten times as much
    address, _ = with_file(parse_state("bicycle=benchmark"), file.name, file.read_bytes())
    state = parse_state(f"{address.address}&rider=charlie&posture=hoods")
    assert np.isfinite(at_speed(state).sd["weave"])


def test_a_diagnosis_says_that_it_takes_the_numbers_one_by_one(file):
    unknowns, notes = nuisances(vt.Model(vt.load_bicycle(file)), {})
    assert {"mR", "IRxx"} <= {one.name for one in unknowns}
    assert any("their stated correlations are not; each is fitted as known by itself" in note for note in notes)
    _, notes = nuisances(vt.Model("benchmark"), {})
    assert not any("correlations" in note for note in notes)


def test_what_stands_alone_in_a_model_is_not_lost(file):
    """Sd of an effect without a covariance, and an sd of 0, which is exact."""
    bicycle = vt.load_bicycle("benchmark")
    exact = vt.Bicycle("exact", dict(bicycle.values), {"c": 0.002, "w": 0.0})
    model = vt.Model(exact, vt.SteerDamper(damping=2.0), (), {"steer_damper.damping": 0.5})
    shares = vt.uncertainty(model, assume=False, samples=50)
    assert set(shares.main_cause) <= {"c", "steer_damper.damping"}
    again = vt.sensitivity(model, "weave", SPEED).set_index("parameter")
    assert (again.sd["steer_damper.damping"], again.sd["w"]) == (0.5, 0.0)
    twice = {"bicycle": str(file), "covariance": {"parameters": ["mR"], "matrix": [[0.01]]}}
    with pytest.raises(vt.InputError, match="states an sd of mR already"):
        vt.build_model(twice)
