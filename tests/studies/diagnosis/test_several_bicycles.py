"""Two bicycles with one tyre, and that tyre on a rig: weave by other equations than those fitted (synthetic)."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from bicycle import load_bicycle
from bicycle.model import read_model
from studies.diagnosis import corrected, model_files, read_measurement
from studies.inference import Hypotheses, fit, parts_against_rest
from tests.shared.refusals import refuses
from tests.validation.blind.closing import build
from tests.validation.blind.motion import shapes

PER_LOAD, LENGTH = 12.0, 0.1  # 1/rad, m: the true tyre
NAMES = ("benchmark", "pista_rider")
LOADS = {name: load_bicycle(name).static_loads for name in NAMES}
TOP = """
kind = "joint"
bicycle = "benchmark"
[uncertainty]
lam = 0.003
IBxx = 0.2
c = 0.002
"""
PART = """
[[part]]
name = "{}"
kind = "modal"
{}
[part.modal]
table = "{}.csv"
"""
RIG = """
[[part]]
name = "rig"
kind = "rig"
[part.rig]
tyre = "tyre.csv"
pressure_bar = 5.0
"""


def tyre(name, share, *, part=False):
    """The table of a base model whose tyre is a ``share`` of the true one."""
    rear, front = (share * PER_LOAD * load for load in LOADS[name])
    where = "part.effects" if part else "effects"
    return (
        f"[{where}.relaxation_length]\ncornering_stiffness = {{rear = {rear}, front = {front}}}\n"
        f"relaxation_length = {LENGTH}\n"
    )


SPREAD = "[uncertainty.relaxation_length]\ncornering_stiffness = 2500.0\nrelaxation_length = 0.02\n"
BASE = TOP + tyre("benchmark", 1.15) + SPREAD
ONE = PART.format("one", "", "benchmark")
TWO = PART.format("two", 'bicycle = "pista_rider"\n' + tyre("pista_rider", 1.15, part=True), "pista_rider")


def weave_table(folder, name, seed, **effects):
    rear, front = (PER_LOAD * load for load in LOADS[name])
    law = {"cornering_stiffness": {"rear": rear, "front": front}, "relaxation_length": LENGTH}
    machine = build(dict(load_bicycle(name).values), {"relaxation_length": law, **effects})
    rng = np.random.default_rng(seed)
    lines = [
        "speed_m_s,mode,real_1_s,imag_rad_s,real_sd_1_s,imag_sd_rad_s,steer_over_lean_re,steer_over_lean_im,steer_over_lean_sd"
    ]
    for speed in np.linspace(6, 16, 10).tolist():
        s, e = shapes(machine, speed)["weave"], rng.standard_normal(4)
        numbers = s.root.real + 0.03 * e[0], s.root.imag + 0.03 * e[1], 0.03, 0.03
        ratio = s.steer.real + 0.02 * e[2], s.steer.imag + 0.02 * e[3], 0.02
        lines.append(f"{speed:.3f},weave," + ",".join(f"{x:.5f}" for x in (*numbers, *ratio)))
    (folder / f"{name}.csv").write_text("\n".join(lines) + "\n")


def rig_table(folder, *, share=1.0, trail=""):
    """Both stiffnesses with 1 % at six loads and two pressures; C is a ``share`` of the true one."""
    head = "load_N,pressure_bar,cornering_stiffness_N_per_deg,lateral_stiffness_N_per_mm"
    head += ",cornering_stiffness_sd_N_per_deg,lateral_stiffness_sd_N_per_mm"
    rows = [head + ",pneumatic_trail_mm,pneumatic_trail_sd_mm" * bool(trail)]
    for load in (200, 350, 500, 650, 800, 950):
        for bar in (4.0, 6.0):
            c, k = PER_LOAD * share * load * np.pi / 180, PER_LOAD * share * load / LENGTH / 1e3
            rows.append(f"{load},{bar},{c:.4f},{k:.4f},{0.01 * c:.4f},{0.01 * k:.4f}{trail}")
    (folder / "tyre.csv").write_text("\n".join(rows) + "\n")
    (folder / "tyre.toml").write_text(
        'tyre = "Example"\nsurface = "flat"\nsource = "made up"\nsynthetic = true\n'
        'lateral_stiffness_origin = "measured"\n'
    )


def forward_of(folder, text):
    (folder / "MEASUREMENT.toml").write_text(text)
    return read_measurement(folder / "MEASUREMENT.toml").prepare()


def stiffness(found, wheel="rear"):
    """Cornering stiffness of the first bicycle and its sd."""
    k = [u.name for u in found.unknowns].index(f"relaxation_length.cornering_stiffness.{wheel}")
    return found.theta[k], np.sqrt(found.covariance[k, k])


@pytest.fixture
def folder(tmp_path):
    weave_table(tmp_path, "benchmark", 1)
    weave_table(tmp_path, "pista_rider", 2)
    rig_table(tmp_path)
    return tmp_path


def test_two_bicycles_measure_one_tyre(folder):
    """Both files state it 15 % too stiff; what they share is how far off that is."""
    alone = fit(forward_of(folder, BASE + ONE + ONE.replace('"one"', '"again"')))
    forward = forward_of(folder, BASE + ONE + TWO)
    found = fit(forward)
    for wheel, load in zip(("rear", "front"), LOADS["benchmark"], strict=True):
        value, sd = stiffness(found, wheel)
        assert value == pytest.approx(PER_LOAD * load, abs=4 * sd)
        assert sd < 0.06 * value
    assert alone.unknowns != found.unknowns
    names = [u.name for u in forward.nuisances]
    assert names.count("relaxation_length.cornering_stiffness.rear") == 1
    assert {"IBxx", "pista_rider/IBxx"} <= set(names)
    assert found.chi2 < 80 + 5 * np.sqrt(160)
    assert any("common to all of them: aligning_moment, camber_thrust" in note for note in forward.notes)


def test_what_is_common_may_be_said(folder):
    text = 'common = ["steer_damper", "relaxation_length"]\n' + BASE + ONE + TWO
    names = {c.identifier for c in forward_of(folder, text).candidates}
    assert {"steer_damper", "pneumatic_trail", "pista_rider/pneumatic_trail"} <= names
    assert "pista_rider/steer_damper" not in names


def test_a_stiffness_that_is_not_stated_goes_with_the_load(folder):
    """Without a tyre in the base model, side slip is one number for both, in proportion to the mean load."""
    forward = forward_of(folder, TOP + ONE + PART.format("two", 'bicycle = "pista_rider"', "pista_rider"))
    slip = next(c for c in forward.candidates if c.identifier == "side_slip")
    (one,), _ = forward.restrict_to_part(0, (slip,))
    (two,), _ = forward.restrict_to_part(1, (slip,))
    for wheel, k in (("rear", 0), ("front", 1)):
        shares = [c.unknowns[0].sets[f"side_slip.cornering_stiffness.{wheel}"] for c in (one, two)]
        assert shares[1] / shares[0] == pytest.approx(LOADS["pista_rider"][k] / LOADS["benchmark"][k])
    assert one.unknowns[0].scale == two.unknowns[0].scale


def test_each_number_of_the_tyre_is_compared_by_each_bicycle_alone_or_said_not_to_be(folder):
    """The truth is 12 N/rad a newton of load; a length of 0.1 m is 0.01 s at 10 m/s, which weave hardly shows."""
    forward = forward_of(folder, TOP + ONE + PART.format("two", 'bicycle = "pista_rider"', "pista_rider"))
    law = next(c for c in forward.candidates if c.identifier == "relaxation_length")
    found = parts_against_rest(forward, fit(forward, (law,)))
    for part in found:
        told = {c.name: c for c in part.effects}
        for wheel, load in zip(("rear", "front"), LOADS["benchmark"], strict=True):
            one = told[f"relaxation_length.cornering_stiffness.{wheel}"]
            assert one.own == pytest.approx(PER_LOAD * load, abs=4 * one.own_sd)
            assert one.rest == pytest.approx(PER_LOAD * load, abs=4 * one.rest_sd)
        assert ("relaxation_length.relaxation_length" in told) != ("relaxation_length.relaxation_length" in part.unseen)
        assert set(told) | set(part.unseen) == {
            "relaxation_length.cornering_stiffness.rear", "relaxation_length.cornering_stiffness.front",
            "relaxation_length.relaxation_length",
        }  # fmt: skip
    assert (found[0].effects[0].own, found[0].effects[0].own_sd) == pytest.approx(
        (found[1].effects[0].rest, found[1].effects[0].rest_sd)
    )


def test_a_rig_informs_the_tyre_of_a_bicycle(folder):
    forward = forward_of(folder, BASE + ONE + RIG)
    found = fit(forward)
    value, sd = stiffness(found)
    assert value == pytest.approx(PER_LOAD * LOADS["benchmark"][0], abs=4 * sd)
    assert sd < 0.012 * value  # the rig's 1 %
    assert not any(p.contradicts for p in parts_against_rest(forward, found))


def test_a_tyre_that_holds_nothing_is_far_from_a_rig_s_numbers_and_a_number(folder):
    """A search may try it: the least stiffness that is allowed."""
    forward = forward_of(folder, BASE + ONE + RIG)
    held = ["cornering_stiffness" in unknown.name for unknown in forward.nuisances]
    theta = np.where(held, 0.0, [unknown.centre for unknown in forward.nuisances])
    white, slopes = forward.residual((), theta)
    assert np.isfinite(white).all()
    assert np.isfinite(slopes).all()


def test_a_rig_with_another_stiffness_contradicts_the_bicycle(folder):
    rig_table(folder, share=1.6)
    forward = forward_of(folder, BASE + ONE + RIG)
    found = {p.part: p for p in parts_against_rest(forward, fit(forward))}
    assert found["rig"].contradicts
    assert found["rig"].sd > 5


def test_the_trail_of_a_rig_names_pneumatic_trail(folder):
    """12 mm +- 0.5 mm at every condition, which the base model has not."""
    rig_table(folder, trail=",12.0,0.5")
    forward = forward_of(folder, BASE + ONE + RIG)
    trail = next(c for c in forward.candidates if c.identifier == "pneumatic_trail")
    kept, places = forward.restrict_to_part(1, (trail,))
    nominal = np.array([u.centre for u in forward.nuisances])
    theta = np.array([*nominal, 0.012])
    with_trail, _ = forward.parts[1].kind.residual(kept, theta[places], slopes=False)
    without, _ = forward.parts[1].kind.residual((), nominal[: len(places) - 1], slopes=False)
    assert len(without) == 6
    assert without[-2:] @ without[-2:] - with_trail[-2:] @ with_trail[-2:] > 300  # 24 sd, the wheels perhaps one number
    assert "contact_length" not in {c.identifier for c in forward.candidates}
    left_out = forward_of(folder, BASE + ONE + RIG + "trail = false\n")
    assert len(left_out.parts[1].kind.rows.places) == 4


def test_rolling_without_slip_is_refuted_by_the_rig_alone(folder):
    forward = forward_of(folder, TOP + ONE + RIG)
    theta = np.array([u.centre for u in forward.nuisances])
    residual, _ = forward.residual((), theta, slopes=False)
    rig = residual[forward.slices()[1]]
    assert rig @ rig > 40**2  # 1/C and the length are known to 1 %, the model says zero


@pytest.mark.parametrize(("text", "words"), [
    (ONE + RIG.replace('tyre = "tyre.csv"', ""), r"part 'rig': \[rig\]: give one of tyre and recordings; write"),
    (ONE + RIG.replace("pressure_bar = 5.0", ""), "part 'rig': .*pressure_bar is missing; write tyre"),
    (ONE + RIG.replace("5.0", "500.0"), "part 'rig': pressure_bar = 500.* must be a number above 0"),
    (ONE + RIG.replace("5.0", "9.0"), "part 'rig': rear wheel: .*extrapolate = true"),
    (ONE + RIG + 'surface = "ice"\n', "surface = 'ice' must be 'flat' or 'drum'"),
    (ONE + RIG + "camber = 1\n", "part 'rig': .*unknown.* 'camber'"),
    (ONE + RIG.replace('tyre = "tyre.csv"', 'recordings = "."\nsurface = "flat"'), "surface belongs to a tyre"),
    (ONE + PART.format("two", "effects = {}", "pista_rider"), "part 'two': effects belongs to a bicycle; give the"),
    (ONE + PART.format("two", 'bicycle = "benchmark"', "benchmark"), "part 'two': bicycle is the one at the top"),
    (TWO + TWO.replace('"two"', '"three"'), "every .*part.* has a bicycle of its own; one at least must be of"),
    (ONE + TWO.replace('"two"', '"pista_rider"'), "'pista_rider' is the name of a part and of a bicycle"),
    (ONE.replace('"one"', '"a.b"') + TWO, r"'a.b' must be a name in quotes without '/', '\.', '\+', which join"),
    (ONE + TWO + "[modal]\ntable = 'benchmark.csv'\n", r"a table \[modal\] at the top; write it as \[part.modal\]"),
])  # fmt: skip
def test_files_that_cannot_be_read(folder, text, words):
    refuses(words, forward_of, folder, TOP + text)


@pytest.mark.parametrize(("text", "words"), [
    (ONE + RIG, "common: all parts are of one bicycle, which shares everything; take it out"),
    (ONE + TWO, "common.*side_slop.*did you mean 'side_slip'"),
])  # fmt: skip
def test_what_cannot_be_common(folder, text, words):
    refuses(words, forward_of, folder, 'common = ["side_slop"]\n' + TOP + text)


def begun(forward, found, *others):
    """What a diagnosis of a ``forward`` model would hold of its fits."""
    return SimpleNamespace(
        kind=forward, final=found, verdict=SimpleNamespace(verdict="named", equivalent=()),
        hypotheses=Hypotheses(others[0] if others else found, (found,) * bool(others), forward),
    )  # fmt: skip


@pytest.fixture(scope="module")
def damped(tmp_path_factory):
    """A damper of 2 N m s/rad hidden in the second bicycle, and fitted there."""
    folder = tmp_path_factory.mktemp("damped")
    weave_table(folder, "benchmark", 1)
    weave_table(folder, "pista_rider", 2, steer_damper={"damping": 2.0})
    forward = forward_of(folder, BASE + ONE + TWO)
    (damper,) = (c for c in forward.candidates if c.identifier == "pista_rider/steer_damper")
    return begun(forward, fit(forward, (damper,)), fit(forward))


def test_an_effect_of_one_bicycle_is_its_own_and_no_part_of_the_first_model(damped):
    forward, found = damped.kind, damped.final
    assert found.theta[-1] == pytest.approx(2.0, abs=4 * np.sqrt(found.covariance[-1, -1]))
    assert not found.jacobian[forward.slices()[0], -1].any()
    names = {c.identifier for c in forward.candidates}
    assert "pneumatic_trail" in names
    assert "pista_rider/pneumatic_trail" not in names
    left = {c.identifier for c in forward.prepare(without=("pista_rider/steer_damper",)).candidates}
    assert "steer_damper" in left
    assert "pista_rider/steer_damper" not in left


def test_a_fit_is_told_of_each_bicycle_in_its_own_names(damped):
    """The damper is the second one's alone; both hold the tyre that they share."""
    found, bicycles = damped.final, damped.kind.bicycles(damped.final)
    assert list(bicycles) == ["", "pista_rider"]
    assert bicycles[""][1].candidates == ()
    first, second = (own.corrected_model(final) for own, final in bicycles.values())
    assert {e.identifier for e in first.effects} == {"relaxation_length"}
    assert {e.identifier for e in second.effects} == {"relaxation_length", "steer_damper"}
    own, final = bicycles["pista_rider"]
    assert second.parameters["steer_damper.damping"] == pytest.approx(found.theta[-1])
    assert own.model.bicycle.name == "pista_rider"
    for name in ("IBxx", "mB"):
        k, j = ([u.name for u in f.unknowns].index(n) for f, n in ((found, f"pista_rider/{name}"), (final, name)))
        assert final.theta[j] == found.theta[k]
        assert final.covariance[j, j] == found.covariance[k, k]


def test_each_bicycle_has_a_corrected_model_that_other_commands_read(damped, tmp_path):
    found, made = damped.final, corrected(damped)
    assert model_files(made) == {"": "model.toml", "pista_rider": "model_pista_rider.toml"}
    for name, text in made.texts.items():
        (tmp_path / model_files(made)[name]).write_text(text)
    models = {n: read_model(tmp_path / f"{f}.toml") for n, f in zip(NAMES, ("model", "model_pista_rider"), strict=True)}
    second = models["pista_rider"]
    assert {e.identifier for e in models["benchmark"].effects} == {"relaxation_length"}
    assert {e.identifier for e in second.effects} == {"relaxation_length", "steer_damper"}
    assert second.parameters["steer_damper.damping"] == pytest.approx(found.theta[-1])
    for name, model in models.items():
        for wheel, load in zip(("rear", "front"), LOADS[name], strict=True):
            value = model.parameters[f"relaxation_length.cornering_stiffness.{wheel}"]
            assert value == pytest.approx(PER_LOAD * load, rel=0.2)
        assert 0 < model.sd["relaxation_length.cornering_stiffness.front"] < 0.2 * value
        assert model.sd["IBxx"] > 0
    assert second.sd["steer_damper.damping"] == pytest.approx(np.sqrt(found.covariance[-1, -1]), rel=0.2)
    for own in ("IBxx", "mB"):
        k = [u.name for u in found.nuisances].index(f"pista_rider/{own}")
        assert second.bicycle[own] == pytest.approx(float(found.nuisances[k].value(found.theta[k])))


def test_other_models_that_cannot_be_are_said(damped):
    null = damped.hypotheses.null
    theta = null.theta.copy()
    theta[[u.name for u in null.nuisances].index("pista_rider/mB")] = -3.0
    made = corrected(begun(damped.kind, dataclasses.replace(null, theta=theta), null))
    assert "mB" in made.of_others
    assert list(made.texts) == [""]
