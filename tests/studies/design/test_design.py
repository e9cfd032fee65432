"""Designs: the optimum against a grid of eigenvalues, what binds, what cannot be had, probability, the written file."""

import json
import tomllib

import numpy as np
import pytest
from scipy.stats import lognorm

from bicycle.files import load_bicycle
from bicycle.model import ModelFamily, build_model, read_model
from bicycle.motion import find_limit_cycles
from bicycle.stability import critical_speeds
from studies import design
from studies.cli import main
from studies.design import Demand, Wishes, demands, find_design, grid, lines
from studies.model_space import ModelSpace
from tyre.ground import InputError

HINGE = {"stiffness": 3000.0, "damping": 15.0, "joint_x": 0.85, "joint_z": -0.8}
TYRED = {
    "bicycle": "pista_charlie_drops",
    "effects": {
        "relaxation_length": {"tyre": "Tyre1", "pressure_bar": 5.5},
        "front_compliance": HINGE,
        "steer_damper": {"damping": 0.0},
    },
}
PLAIN = {
    "bicycle": dict(load_bicycle("pista_charlie_drops").values),
    "effects": {
        "relaxation_length": {"cornering_stiffness": 6500.0, "relaxation_length": 0.11},
        "front_compliance": HINGE,
        "steer_damper": {"damping": 0.0},
    },
}
WHIPPLE = {"bicycle": "benchmark"}
WOBBLE = (Demand("wobble"),)
RANGE = (3.0, 25.0)
SPEEDS = np.linspace(3, 25, 111)
FASTER = 2 * np.pi * 4.5  # rad/s: of these bicycles only wobble is slower than the tyres and faster than this


def nothing(**more):
    return Wishes(**({"costs": {}, "sd": {}, "limits": {}, "samples": 50} | more))


def wobble_growth(content, numbers, speeds=SPEEDS):
    """Largest real part (m,) of pairs between 4.5 and 14 Hz over speeds, by numpy; numbers (m,) by key."""
    family = ModelFamily(build_model(content))
    roots = np.linalg.eigvals(family.state_matrices(numbers, speeds[None]))
    own = (roots.imag > FASTER) & (roots.imag < 2 * np.pi * 14)
    return np.where(own, roots.real, -np.inf).max((1, 2))


def test_the_optimum_of_three_numbers_is_confirmed_by_a_grid():
    """No cheaper point of a grid keeps it, and those a little dearer in its direction do."""
    keys = ["steer_damper.damping", "front_compliance.damping", "c"]
    found = find_design(PLAIN, keys, WOBBLE, RANGE, nothing())
    x, start, scale = found.after.x, found.problem.start, found.problem.cost.scale
    assert found.after.kept
    assert found.problem.cost.kind == design.RELATIVE
    assert scale.tolist() == [5.0, 15.0, pytest.approx(PLAIN["bicycle"]["c"])]  # the damper stands at 0: typical 5
    ways = np.array(np.meshgrid(*[np.linspace(-1, 1, 15)] * 3)).reshape(3, -1).T
    ways = ways[(ways[:, 0] >= 0) & (np.abs(ways).max(1) == 1)]  # all directions, the damper positive
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    points = start + scale * ways * 0.985 * found.after.cost
    low, high = found.problem.limits.low, found.problem.limits.high
    points = points[((points >= low) & (points <= high)).all(1)]
    assert len(points) > 300
    assert wobble_growth(PLAIN, dict(zip(keys, points.T, strict=True)), SPEEDS[::5]).min() > 0
    at, beyond = (start + share * (x - start) for share in (1.0, 1.02))
    growth = wobble_growth(PLAIN, {key: np.array([a, b]) for key, a, b in zip(keys, at, beyond, strict=True)})
    assert abs(growth[0]) < 2e-3
    assert growth[1] < 0


def test_what_binds_is_the_worst_speed_and_the_file_keeps_the_demand():
    found = find_design(TYRED, ["steer_damper.damping", "pressure_bar.front", "c"], WOBBLE, RANGE, nothing())
    (peak,) = found.binding
    assert peak.root.real == pytest.approx(0, abs=1e-4)
    model = build_model(found.content)
    grid = np.linspace(peak.speed - 0.5, peak.speed + 0.5, 11)
    roots = np.array([min(row, key=lambda z: abs(z - peak.root)) for row in model.linear_model().eigenvalues(grid)])
    assert (roots.real < 1e-5).all()
    assert np.argmax(roots.real) == 5
    assert not [c for c in critical_speeds(model, 25.0) if c.mode == "wobble"]
    assert [c for c in critical_speeds(build_model(TYRED), 25.0) if c.mode == "wobble"]
    assert found.agreed[0] >= 2
    assert found.at_limit == []
    said = "\n".join(lines(found))
    assert "requirement met from 3 to 25 m/s: wobble stable" in said
    assert f"active constraint: wobble at {peak.speed:.4g} m/s" in said


def test_a_search_that_ends_at_a_kink_of_a_tyre_s_table_keeps_the_demand():
    """Between measured pressures a table bends at them: 5.5 bar is best, and slopes tell two different things there."""
    hinge = {"stiffness": 2100.0, "damping": 9.0, "joint_x": 0.83, "joint_z": -0.74, "axis_tilt": 0.3}
    law = {"tyre": "Tyre2", "pressure_bar": {"rear": 4.2, "front": 6.1}}
    content = {"bicycle": "pista_charlie_drops", "effects": {"relaxation_length": law, "front_compliance": hinge}}
    space = ModelSpace(content, ["front_compliance.stiffness", "front_compliance.damping", "pressure_bar.front"])
    speeds = grid(*RANGE)
    problem = design.Problem(
        space, design.base_of(space), design.cost_of(space, {}, {}, assume=False), design.limits_of(space, {}),
        design.expand_all_modes(WOBBLE, space.linear, speeds), speeds,
    )  # fmt: skip
    found = design.search_cheapest(problem, {}, np.array([1148.75, 24.585, 7.151]))
    assert found.kept
    assert found.x[2] == pytest.approx(5.5, abs=1e-4)
    assert not [c for c in critical_speeds(space.model_at(found.x), 25.0) if c.mode == "wobble"]
    assert [c for c in critical_speeds(space.model_at(found.x - [0, 0.1, 0]), 25.0) if c.mode == "wobble"]


def test_a_damping_ratio_and_two_modes():
    asked = demands([("wobble", "0.05"), ("weave", "stable")])
    found = find_design(PLAIN, ["steer_damper.damping", "front_compliance.stiffness"], asked, (8.0, 25.0), nothing())
    assert found.after.kept
    roots = np.linalg.eigvals(build_model(found.content).linear_model().state_matrix(np.linspace(8, 25, 400)))
    wave = roots[(roots.imag > FASTER) & (roots.imag < 2 * np.pi * 14)]
    assert (-wave.real / np.abs(wave)).min() == pytest.approx(0.05, abs=1e-3)
    slow = roots[(roots.imag > 0) & (roots.imag <= FASTER)]
    assert slow.real.max() < 0


def test_what_cannot_be_had_is_said_with_the_best_there_is():
    limits = {"front_compliance.stiffness": (2500.0, 3500.0), "c": (0.055, 0.065)}
    found = find_design(PLAIN, list(limits), WOBBLE, RANGE, nothing(limits=limits))
    assert not found.after.kept
    grid = np.array(np.meshgrid(*[np.linspace(low, high, 9) for low, high in limits.values()])).reshape(2, -1)
    growth = wobble_growth(PLAIN, dict(zip(limits, grid, strict=True)))
    assert growth.min() > 0
    best = max(p.root.real for p in found.after.peaks)
    assert best <= growth.min() + 1e-3
    assert best == pytest.approx(growth.min(), rel=0.01)
    said = "\n".join(lines(found))
    assert "requirement not met within the limits" in said
    assert "best reached: wobble" in said
    assert {key for key, _, _ in found.at_limit} == set(limits)


def test_the_probability_is_that_of_the_distribution():
    """One uncertain number, lognormal with its mean where it stands: the highest stiffness allowed is exact."""
    limits, sd = {"front_compliance.stiffness": (300.0, 3000.0)}, {"front_compliance.stiffness": 500.0}
    content = PLAIN | {"effects": PLAIN["effects"] | {"steer_damper": {"damping": 1.2}}}
    asked = nothing(sd=sd, samples=200, limits=limits)
    found = find_design(content, ["front_compliance.stiffness"], WOBBLE, (9.0, 18.0), asked)
    assert found.problem.cost.kind == design.BY_SD
    most = found.after.x[0]
    assert most < 3000
    spread = np.sqrt(np.log1p((500.0 / most) ** 2))
    low, high = found.certainty.interval
    assert low < lognorm(spread, scale=most * np.exp(-(spread**2) / 2)).cdf(most) < high
    assert found.certainty.unknown == 0


def test_a_model_that_keeps_it_already_is_left_alone():
    found = find_design(PLAIN, ["c"], (Demand("weave"),), (8.0, 20.0), nothing())
    assert found.after.x.tolist() == found.problem.start.tolist()
    assert "already meets the requirement; unchanged" in "\n".join(lines(found))


def test_every_mode_at_once():
    found = find_design(WHIPPLE, ["c", "w"], (Demand("all"),), (4.1, 5.5), nothing())
    assert found.after.kept
    assert {d.mode for d in found.problem.demands} == {"weave", "capsize", "castering"}
    roots = build_model(found.content).linear_model().eigenvalues(np.linspace(4.1, 5.5, 50))
    assert roots.real.max() < 1e-6
    assert {peak.demand.mode for peak in found.binding} <= {"weave", "capsize"}


def test_two_modes_that_cannot_both_be_kept():
    """Weave asks for less trail, capsize for more: on no point of a grid are all roots stable from 4 to 5.5 m/s."""
    found = find_design(WHIPPLE, ["c", "w"], (Demand("all"),), (4.0, 5.5), nothing())
    grid = np.array(np.meshgrid(np.linspace(0.02, 0.1, 61), np.linspace(0.9, 1.1, 61))).reshape(2, -1)
    family, numbers = ModelFamily(build_model(WHIPPLE)), {"c": grid[0], "w": grid[1]}
    roots = np.linalg.eigvals(family.state_matrices(numbers, np.linspace(4, 5.5, 31)[None]))
    least = roots.real.max((1, 2)).min()
    best = max(peak.root.real for peak in found.after.peaks)
    assert not found.after.kept
    assert 0 < best <= least
    assert best == pytest.approx(least, abs=0.01)
    assert {peak.demand.mode for peak in found.binding} == {"weave", "capsize"}


def test_only_what_binds_asks_for_a_margin():
    """Two demands with draws as written: the second is far from its bound in all of them."""
    one, two = Demand("wobble"), Demand("weave")
    spread = np.linspace(-1, 1, 101)
    drawn = design.Certainty({one: spread, two: -50 + 10 * spread}, 0, 0)
    margins = drawn.back_off({one: 0.0, two: -50.0}, {}, 0.9)
    assert margins[one] == pytest.approx(0.8)  # 90 of 100 steps from -1 to 1
    assert drawn.probability == pytest.approx(51 / 101)
    near = design.Certainty({one: spread, two: -5 + 10 * spread}, 0, 0)
    assert near.back_off({one: 0.0, two: -5.0}, {}, 0.9)[one] == pytest.approx(0.8)
    low, high = near.interval
    assert low < near.probability < high


def test_effects_that_are_not_there_yet_are_added_without_influence():
    keys = ["steer_damper.damping", "c", "front_compliance.stiffness"]
    content, added = design.with_effects({"bicycle": "benchmark"}, keys)
    assert added == ("steer_damper",)
    assert content["effects"] == {"steer_damper": {"damping": 0.0}}
    assert design.with_effects(TYRED, ["steer_damper.damping"]) == (TYRED, ())


@pytest.mark.parametrize(("keys", "asked", "wanted", "message"), [
    (["c"], "flutter", {}, "--keep: unknown mode 'flutter'; known: "),
    (["speed"], "wobble", {}, "--vary speed: it is no number of the model file"),
    (["load_N.front"], "wobble", {}, "--vary load_N.front: it is no number of the model file"),
    (["c"], "wobble", {"costs": {"w": 1.0}}, "--cost: unknown varied parameter 'w'"),
    (["c", "w"], "wobble", {"costs": {"w": 1.0}}, "--cost: c has none; give a cost to every varied parameter"),
    (["c"], "wobble", {"costs": {"c": 0.0}}, "--cost: a change must cost more than 0"),
    (["c"], "wobble", {"limits": {"w": (1.0, 2.0)}}, "--limits: unknown varied parameter 'w'"),
    (["c"], "wobble", {"limits": {"c": (0.1, 0.2)}}, "--limits c: the model's 0.06173 m is not between them"),
    (["w"], "wobble", {"limits": {"w": (-1.0, 2.0)}}, "--limits w=-1:2: possible are 0 to inf m"),
])  # fmt: skip
def test_what_is_no_design(keys, asked, wanted, message):
    with pytest.raises(InputError) as error:
        find_design(TYRED, keys, (Demand(asked),), RANGE, nothing(**wanted))
    assert message in str(error.value)


def test_numbers_that_cannot_be_varied():
    split = TYRED | {"effects": TYRED["effects"] | {
        "relaxation_length": {"tyre": "Tyre1", "pressure_bar": {"rear": 6, "front": 5}}}}  # fmt: skip
    with pytest.raises(InputError, match="rear and front differ; vary pressure_bar.rear, pressure_bar.front or both"):
        find_design(split, ["pressure_bar"], WOBBLE, RANGE, nothing())
    with pytest.raises(InputError, match="--probability 0.9: nothing is uncertain"):
        find_design({"bicycle": "benchmark"}, ["c"], (Demand("weave"),), (4.0, 6.0), nothing(probability=0.9))


def test_a_largest_amplitude_costs_less_than_stability_and_is_kept():
    stable, small = (find_design(TYRED, ["steer_damper.damping"], demands([("wobble", what)]), RANGE, nothing())
                     for what in ("stable", "4deg"))  # fmt: skip
    assert small.after.kept
    assert 0 < small.after.cost < 0.99 * stable.after.cost
    found = find_limit_cycles(build_model(small.content))
    sizes = [found.amplitude(cycle) for v in np.linspace(*RANGE, 45) for mode, cycle in found.at(v) if mode == "wobble"]
    assert np.degrees(max(sizes)) == pytest.approx(small.amplitude, rel=0.01)
    assert 3.8 < small.amplitude <= 4.0
    assert any(f"maximum steer amplitude: {small.amplitude:.2f}°" in line for line in lines(small))
    wide = find_design(TYRED, ["steer_damper.damping"], demands([("wobble", "18deg")]), RANGE, nothing())
    assert wide.after.cost == 0


@pytest.mark.parametrize(("keep", "speeds", "more", "message"), [
    ([("weave", "2deg")], (34.5, 37.0), {}, "--keep weave 2deg: an impulse starts a larger limit cycle"),
    ([("wobble", "2deg"), ("weave", "2deg")], RANGE, {}, "--keep wobble 2deg: give one amplitude, without"),
    ([("wobble", "2deg")], RANGE, {"probability": 0.9, "sd": {"c": 0.001}}, "give one amplitude, without --prob"),
])  # fmt: skip
def test_amplitudes_that_no_design_keeps(keep, speeds, more, message):
    faq = TYRED | {"effects": TYRED["effects"] | {"front_compliance": HINGE | {
        "stiffness": 4000.0, "damping": 12.0, "joint_x": 0.86, "joint_z": -0.65}}}  # fmt: skip
    with pytest.raises(InputError) as error:
        find_design(faq, ["steer_damper.damping"], demands(keep), speeds, nothing(**more))
    assert message in str(error.value)


@pytest.mark.parametrize(("keep", "message"), [
    (
        [("wobble", "calm")],
        "--keep wobble calm: give stable, a minimum damping ratio from 0 to below 1, or a maximum",
    ),
    ([("wobble", "1.5")], "from 0 to below 1"),
    ([("wobble", "25deg")], "a maximum steer amplitude of one mode such as 2deg, up to 20deg"),
    ([("all", "2deg")], "a maximum steer amplitude of one mode such as 2deg, up to 20deg"),
    ([("wobble", "stable"), ("wobble", "0.1")], "--keep wobble is given twice; keep one"),
])  # fmt: skip
def test_demands_that_are_none(keep, message):
    with pytest.raises(InputError) as error:
        demands(keep)
    assert message in str(error.value)


def test_demands():
    assert demands([("wobble", "stable"), ("weave", "0.1")], 0.05) == (Demand("wobble", 0.05), Demand("weave", 0.1))
    assert str(Demand("wobble")) == "wobble stable"
    assert str(Demand("weave", 0.1)) == "weave with a damping ratio of 0.1"
    # a pair of damping ratio 0.1 has no excess over 0.1
    assert Demand("weave", 0.1).excess(np.array([-0.1 + 1j * np.sqrt(0.99)])) == pytest.approx(0, abs=1e-12)


def test_the_command_writes_a_model_that_others_read(tmp_path, monkeypatch, printed):
    monkeypatch.chdir(tmp_path)
    main(["convert", "benchmark", "--to", "mine.txt"])
    call = ["design", "mine.txt", "--keep", "weave", "stable", "--from", "4", "--up-to", "5"]
    call += ["--vary", "steer_damper.damping,c"]
    shown = printed(*call, "--out", "better.toml", "--json", "better.json")
    assert "added: [effects.steer_damper], initially neutral" in shown
    assert "written: better.toml" in shown
    told = json.loads((tmp_path / "better.json").read_text())
    content = tomllib.loads((tmp_path / "better.toml").read_text())
    assert content["effects"]["steer_damper"]["damping"] == told["parameters"][0]["design"]
    assert content["bicycle"]["c"] == told["parameters"][1]["design"] != 0.08
    assert "Changed by velotyre design: --keep weave stable --from 4 --up-to 5." in content["description"]
    assert np.linalg.eigvals(read_model("better.toml").linear_model().state_matrix(4.0)).real.max() < 1e-4
    for command in (["modes", "better.toml", "--speeds", "4,5"], ["critical", "better.toml"]):
        assert "weave" in printed(*command)


def test_the_command_ends_with_1_and_writes_nothing_where_there_is_no_design(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    call = ["design", "benchmark", "--keep", "weave", "stable", "--from", "1", "--up-to", "5", "--vary", "w"]
    with pytest.raises(SystemExit) as stop:
        main([*call, "--limits", "w=1:1.05", "--out", "better.toml"])
    assert stop.value.code == 1
    assert "requirement not met within the limits" in capsys.readouterr().out
    assert not (tmp_path / "better.toml").exists()


@pytest.mark.parametrize(("options", "message"), [
    (["--vary", "c", "--up-to", "1", "--out", "a.toml"], "--up-to 1 must be above --from 1 m/s"),
    (["--vary", "c", "--up-to", "5", "--out", "a.txt"], "--out a.txt: a model file ends in .toml"),
    (["--vary", ",", "--up-to", "5", "--out", "a.toml"], "--vary: give at least one parameter"),
])  # fmt: skip
def test_commands_that_are_none(options, message, refused):
    assert message in refused("design", "benchmark", "--keep", "weave", "stable", *options)


def test_a_demand_without_its_second_word_is_told_what_it_lacks(refused):
    message = "--keep weave --vary: state the requirement, for example --keep weave stable"
    assert message in refused("design", "benchmark", "--keep", "weave", "--vary", "c", "--out", "a.toml")


def test_a_demand_on_wobble_binds_the_root_that_is_wobble():
    """Stiff tyres with a long lag: the pair at 12 Hz is all steer. A damper of 1 N m s/rad is needed up to 45 m/s."""
    tyre = {"cornering_stiffness": 8279.0, "relaxation_length": 0.142}
    effects = {"relaxation_length": tyre, "camber_thrust": {"camber_stiffness": 474.3, "lag_share": 1.0}}
    content = {"bicycle": "benchmark", "effects": effects | {"steer_damper": {"damping": 0.0}}}
    found = find_design(content, ["steer_damper.damping"], WOBBLE, (3.0, 45.0), nothing())
    assert found.after.kept
    family, speeds = ModelFamily(build_model(content)), np.linspace(3, 45, 211)[None]
    growth = []
    for damping in (0.0, found.after.x[0], 1.02 * found.after.x[0]):
        roots = np.linalg.eigvals(family.state_matrices({"steer_damper.damping": np.array([damping])}, speeds))
        growth.append(roots.real[(roots.imag > 50) & (roots.imag < 100)].max())
    assert growth[0] > 0.3
    assert abs(growth[1]) < 1e-3
    assert growth[2] < 0
