"""Bench tests of the steering: readings of the published benchmark bicycle, by nothing of velotyre (synthetic)."""

import numpy as np
import pytest
from published_bicycle import K0, TILT, G, bar_stiffness

from studies.diagnosis import diagnose, read_measurement
from studies.inference import preflight
from tyre.ground import InputError

HEAD = "test,condition,steer_rad,steer_rate_rad_s,direction,steer_torque_N_m,steer_torque_sd_N_m"
TOML = 'kind = "bench"\nbicycle = "benchmark"\n[bench]\ntable = "b.csv"\n'
ANGLES = np.linspace(-0.3, 0.3, 7)


def sweep(condition="lifted", *, spring=0.0, friction=0.0, scrub=0.0, sd=0.02, noise=None, seed=2, tail=""):
    rng, found = np.random.default_rng(seed), []
    stiffness = bar_stiffness(lifted=condition == "lifted") + spring
    loop = friction + (scrub * np.cos(TILT) if condition == "floor" else 0.0)
    for word, sign in (("up", 1), ("down", -1)):
        for x in ANGLES:
            torque = stiffness * x + sign * loop + (sd if noise is None else noise) * rng.standard_normal()
            found.append(f"sweep,{condition},{x:.12g},,{word},{torque:.12g},{sd}{tail}")
    return found


def damped(*, damper=0.0, friction=0.0, sd=0.02, seed=4):
    rng = np.random.default_rng(seed)
    return [
        f"damper,lifted,0,{q},,{damper * q + friction * np.sign(q) + sd * rng.standard_normal():.12g},{sd}"
        for q in (-2, -1.5, -1, -0.5, 0.5, 1, 1.5, 2)
    ]


def write(folder, lines, *, head=HEAD, toml=TOML):
    (folder / "b.csv").write_text("\n".join([head, *lines]) + "\n")
    (folder / "m.toml").write_text(toml)
    return folder / "m.toml"


def chosen(forward, *names):
    found = tuple(c for c in forward.candidates if c.identifier in names)
    assert len(found) == len(names)
    return found


def test_the_stiffness_by_hand_is_that_of_the_published_matrix():
    """g K0 of steer,steer, Meijaard et al. (2007), table 2: the parts by hand add up to it."""
    assert bar_stiffness(lifted=False) == pytest.approx(G * K0[1, 1], rel=1e-12)


@pytest.mark.parametrize("condition", ["lifted", "free_plate", "floor"])
def test_torques_of_the_weight_are_those_by_hand(tmp_path, condition):
    forward = read_measurement(write(tmp_path, sweep(condition, noise=0.0))).prepare()
    assert np.abs(forward.residual((), forward.nominal)[0]).max() < 1e-6


def test_springs_dampers_and_friction_add_up(tmp_path):
    lines = [
        *sweep("floor", spring=3.0, friction=0.3, scrub=2.0, noise=0.0),
        *damped(damper=0.7, friction=0.3, sd=1e-9),
    ]
    forward = read_measurement(write(tmp_path, lines)).prepare()
    candidates = chosen(forward, "steer_spring", "steer_damper", "steer_friction", "contact_scrub")
    size = {"steer_spring": 3.0, "steer_damper": 0.7, "steer_friction": 0.3, "contact_scrub": 2.0}
    theta = np.array([*forward.nominal, *(size[c.identifier] for c in candidates)])
    residual, slope = forward.residual(candidates, theta)
    assert np.abs(residual[-14:]).max() < 1e-6  # the sweep; beside it noise of one sd
    assert np.abs(residual).max() < 5
    assert slope.shape == (22, len(theta))


def test_a_measured_load_takes_the_place_of_the_bicycle_s(tmp_path):
    """Half the load on the plate, half of what the ground adds, by hand."""
    ground = bar_stiffness(lifted=False) - bar_stiffness(lifted=True)
    load = -ground / (0.08 * np.cos(TILT) * np.sin(TILT))
    half = bar_stiffness(lifted=True) + ground / 2
    lines = [f"hold,free_plate,{x:g},,,{half * x:.12g},0.01,{load / 2:.12g}" for x in ANGLES]
    forward = read_measurement(write(tmp_path, lines, head=HEAD + ",front_load_N")).prepare()
    assert np.abs(forward.residual((), forward.nominal)[0]).max() < 1e-6
    assert not any("front_load" in note for note in forward.notes)


def test_a_crown_radius_lifts_the_wheel_that_stands(tmp_path):
    """N rho sin(tilt)^2 by hand, on the ground only; the same with the load measured."""
    ground = bar_stiffness(lifted=False) - bar_stiffness(lifted=True)
    load = -ground / (0.08 * np.cos(TILT) * np.sin(TILT))
    stands = bar_stiffness(lifted=False) + load * 0.02 * np.sin(TILT) ** 2
    lines = [f"hold,free_plate,{x:g},,,{stands * x:.12g},0.01,{n}" for x in ANGLES for n in ("", f"{load:.12g}")]
    lines += [f"hold,lifted,{x:g},,,{bar_stiffness(lifted=True) * x:.12g},0.01," for x in ANGLES]
    forward = read_measurement(write(tmp_path, lines, head=HEAD + ",front_load_N")).prepare()
    residual, _ = forward.residual(chosen(forward, "crown_radius"), np.array([*forward.nominal, 0.02]))
    assert np.abs(residual).max() < 1e-6


def test_slopes_are_the_differences_of_the_residual(tmp_path):
    tail = ",,,"
    head = HEAD + ",force_N,lever_arm_mm,force_sd_N"
    lines = [line + tail for line in [*sweep("floor"), *damped()]]
    lines += [f"hold,lifted,{x:g},,up,,,{x + 1:g},{arm},0.1" for x in ANGLES for arm in (200, 300)]
    forward = read_measurement(write(tmp_path, lines, head=head)).prepare()
    names = ("steer_spring", "steer_damper", "steer_friction", "contact_scrub", "steer_torque_scale",
             "steer_torque_zero", "force_scale", "force_zero", "lever_arm_error", "steer_zero", "handlebar_bag",
             "crown_radius")  # fmt: skip
    candidates = chosen(forward, *names)
    theta = np.array([*forward.nominal, *(x for c in candidates for x in c.starts[1])])
    _, slope = forward.residual(candidates, theta)
    for column, u in enumerate((*forward.nuisances, *(u for c in candidates for u in c.unknowns))):
        step = 1e-4 * u.scale * (np.arange(len(theta)) == column)
        up, down = (forward.residual(candidates, theta + sign * step)[0] for sign in (1, -1))
        expected = (up - down) / (2e-4 * u.scale)
        np.testing.assert_allclose(slope[:, column], expected, rtol=1e-4, atol=1e-5 * np.abs(expected).max() + 1e-7)


@pytest.mark.parametrize(
    ("name", "size", "prior", "read"),  # priors: docs/measurement_files.md
    [
        ("force_scale", 0.08, 0.1, lambda torque, x, arm: 1.08 * torque(x) / arm),
        ("force_zero", 0.4, 0.5, lambda torque, x, arm: torque(x) / arm + 0.4),
        ("lever_arm_error", 0.01, 0.005, lambda torque, x, arm: torque(x) / (arm + 0.01)),
        ("steer_zero", 0.03, 0.02, lambda torque, x, arm: torque(x + 0.03) / arm),
    ],
)
def test_mistakes_do_what_they_are_called_after(tmp_path, name, size, prior, read):
    head = "test,condition,steer_rad,force_N,force_sd_N,lever_arm_m"
    lines = [f"hold,free_plate,{x:g},{read(lambda a: bar_stiffness(lifted=False) * a, x, arm):.12g},0.1,{arm}"
             for x in ANGLES for arm in (0.2, 0.3)]  # fmt: skip
    forward = read_measurement(write(tmp_path, lines, head=head)).prepare()
    (candidate,) = chosen(forward, name)
    assert [u.scale for u in candidate.unknowns] == [prior]
    residual, _ = forward.residual((candidate,), np.array([*forward.nominal, size]))
    assert np.abs(residual).max() < 1e-6


def test_other_units_are_the_same_readings(tmp_path):
    plain = read_measurement(write(tmp_path, [*sweep(), *damped()])).readings
    lines = []
    for r in plain:
        turned = {1: "up", -1: "down", 0: ""}[int(r.direction)]
        kilo = 0.25 * 9.80665
        rate = f"{np.degrees(r.rate):.12g}" if r.test == "damper" else ""
        place = f"{r.test},{r.condition},{np.degrees(r.steer):.12g}"
        lines.append(f"{place},{rate},{turned},{r.torque / kilo:.12g},250,{r.sd / kilo:.12g}")
    head = "test,condition,steer_deg,steer_rate_deg_s,direction,force_kgf,lever_arm_mm,force_sd_kgf"
    found = read_measurement(write(tmp_path, lines, head=head)).readings
    for name in ("steer", "rate", "direction", "torque", "sd"):
        np.testing.assert_allclose(
            [getattr(r, name) for r in found], [getattr(r, name) for r in plain], rtol=1e-9, atol=1e-12
        )
    milli = [line.replace(line.split(",")[5], f"{float(line.split(',')[5]) * 1e3:.12g}", 1) for line in sweep()]
    head = HEAD.replace("steer_torque_N_m", "steer_torque_N_mm")
    np.testing.assert_allclose(
        [r.torque for r in read_measurement(write(tmp_path, milli, head=head)).readings],
        [r.torque for r in plain[:14]],
        rtol=1e-9,
    )


def test_spring_and_friction_are_found(tmp_path):
    found = diagnose(
        read_measurement(
            write(tmp_path, [*sweep(spring=3.0, friction=0.3), *sweep("free_plate", spring=3.0, friction=0.3, seed=5)])
        )
    ).verdict
    assert found.verdict in ("named", "class")
    sizes = {e.identifier: next(iter(e.parameters.values())) for e in found.effects}
    assert sizes["steer_friction"][0] == pytest.approx(0.3, abs=3 * sizes["steer_friction"][1])
    assert sizes["steer_spring"][0] == pytest.approx(3.0, abs=3 * sizes["steer_spring"][1])


def test_a_damper_is_told_from_friction(tmp_path):
    found = diagnose(
        read_measurement(write(tmp_path, [*sweep(friction=0.2), *damped(damper=0.6, friction=0.2)]))
    ).verdict
    sizes = {e.identifier: next(iter(e.parameters.values())) for e in found.effects}
    assert set(sizes) == {"steer_friction", "steer_damper"}
    assert sizes["steer_damper"][0] == pytest.approx(0.6, abs=3 * sizes["steer_damper"][1])


def test_nothing_hidden_names_nothing_on_another_bicycle_with_faint_readings(tmp_path):
    toml = TOML.replace("benchmark", "pista")
    lines = [f"hold,lifted,{x:g},,,{0.5 * np.cos(9 * x):.3g},2.0" for x in ANGLES]
    assert diagnose(read_measurement(write(tmp_path, lines, toml=toml))).verdict.verdict == "none"


def test_what_a_bench_test_cannot_see_is_said(tmp_path):
    tyre = "[effects.relaxation_length]\ncornering_stiffness = 9000\nrelaxation_length = 0.1\n"
    tyre += "[effects.twisting_torque]\n[bench]"
    measurement = read_measurement(write(tmp_path, sweep(), toml=TOML.replace("[bench]", tyre)))
    forward = measurement.prepare()
    refused = forward.refused
    for words, names in (
        ("acts through a rolling tyre", ("pneumatic_trail", "camber_thrust", "aligning_moment")),
        ("no rider in a bench test", ("rider_arms", "rider_lean")),
        ("motors are off", ("steer_assist",)),
        (
            "does not change the torque at the handlebar",
            ("steer_damper", "luggage", "crown_radius", "front_compliance"),
        ),
    ):
        assert all(words in refused[name] for name in names)
    assert {c.identifier for c in forward.candidates if c.effect is not None} == {"steer_spring", "handlebar_bag"}
    assert any(
        "relaxation_length, twisting_torque of the base model: without effect at rest" in n for n in forward.notes
    )
    assert np.abs(forward.residual((), forward.nominal)[0]).max() < 4  # the twisting torque has no part in it
    held = read_measurement(write(tmp_path, [f"hold,floor,{x:g},,,{x:g},0.1" for x in ANGLES])).prepare()
    assert "needs readings with a direction" in held.refused["steer_friction"]
    assert "needs readings with a direction" in held.refused["contact_scrub"]
    assert {"relaxation_length", "twisting_torque"}.isdisjoint(refused)  # what the base model has is not to be tried
    assert "no_slip" not in held.refused
    assert any("is treated as the middle of the friction band" in note for note in held.notes)


def test_one_lever_arm_cannot_tell_its_own_error(tmp_path):
    head = "test,condition,steer_rad,force_N,force_sd_N,lever_arm_m"
    lines = [f"hold,lifted,{x:g},{x:g},0.1,0.2" for x in ANGLES]
    forward = read_measurement(write(tmp_path, lines, head=head)).prepare()
    assert "looks like a scale of the balance, see force_scale" in forward.refused["lever_arm_error"]


def test_further_tests_are_predicted(tmp_path):
    forward = read_measurement(write(tmp_path, [f"hold,lifted,{x:g},,,{x:g},0.1" for x in ANGLES])).prepare()
    proposed = forward.propose_measurements()
    assert len(proposed) == 3
    spring = chosen(forward, "steer_spring")
    value, slope = proposed[0].predict_white(spring, np.array([*forward.nominal, 2.0]))
    np.testing.assert_allclose(slope[:, -1] * 0.1, np.repeat([-0.2, -0.1, 0.0, 0.1, 0.2], 2), atol=1e-9)
    assert len(value) == 10
    swept = read_measurement(write(tmp_path, [*sweep(), *damped()])).prepare().propose_measurements()
    assert [("free" in p.what) for p in swept] == [True]


def test_wrong_geometry_acts_at_rest_beside_effects_that_do_not(tmp_path):
    """A front hinge of the base model follows the tilt; it has no part in the test, and the tilt still may be wrong."""
    hinge = "[effects.front_compliance]\nstiffness = 3000\ndamping = 15\njoint_x = 0.8\njoint_z = -0.85\n[bench]"
    forward = read_measurement(write(tmp_path, sweep("free_plate"), toml=TOML.replace("[bench]", hinge))).prepare()
    tilted, _ = forward.residual(chosen(forward, "wrong_tilt"), np.array([*forward.nominal, 0.05]))
    assert np.abs(tilted).max() > 1


GOOD = sweep()
FORCE = "test,condition,steer_rad,force_N,force_sd_N,lever_arm_m"


@pytest.mark.parametrize(
    ("head", "lines", "words"),
    [
        (HEAD, ["pull,lifted,0,,,1,1"], "line 2: unknown test 'pull'; .*known: damper, hold, sweep"),
        (HEAD, ["hold,hung,0,,,1,1"], "line 2: unknown condition 'hung'; .*known: floor, free_plate, lifted"),
        (HEAD, ["sweep,lifted,0,,left,1,1"], "line 2: unknown direction 'left'"),
        (HEAD, ["hold,lifted,15,,,1,1"], r"line 2: steer_rad = 15 must be .* -0.35 up to 0.35"),
        (HEAD, ["damper,lifted,0,,up,1,1"], "line 2: a damper test needs a steer_rate other than 0"),
        (HEAD, ["damper,lifted,0,1,down,1,1"], "line 2: the direction down is not that of the steer_rate, 1 rad/s"),
        (HEAD, ["damper,lifted,0,90,,1,1"], "line 2: steer_rate_rad_s = 90 must be .* -50 up to 50"),
        (HEAD, ["sweep,lifted,0,1,up,1,1"], "line 2: a sweep test has no steer_rate; call it a damper test"),
        (HEAD, ["sweep,lifted,0,,,1,1"], r"line 2: a sweep needs a direction, up \(to the right\) or down"),
        (HEAD, ["hold,lifted,0,,,5000,1"], "line 2: steer_torque_N_m = 5000 must be .* up to 1000"),
        (HEAD, ["hold,lifted,0,,,,1"], "line 2: the torque is missing: give a torque, or a force and its lever_arm"),
        (HEAD, ["hold,lifted,0,,,1,0"], "line 2: .*steer_torque_sd_N_m, must be there and positive"),
        (HEAD, ["hold,lifted,0,,,one,1"], "line 2: .*'one' must be a finite number"),
        (HEAD, ["hold,lifted,,,,1,1"], "line 2: steer_rad = '' must be a finite number"),
        (HEAD, [*GOOD, GOOD[0]], "line 16: the same reading as line 2; keep one"),
        (HEAD, GOOD[:2], r"2 row\(s\) cannot be diagnosed; give at least 3 readings"),
        (HEAD + ",front_load_N", [f"{GOOD[0]},400"], "line 2: a lifted wheel carries no front_load"),
        (HEAD + ",front_load_N", ["hold,floor,0,,,1,1,-4"], "line 2: front_load_N = -4 must be .* from 0 up to 10000"),
        (FORCE, ["hold,lifted,0,1,1,0"], "line 2: a force needs a positive lever_arm"),
        (FORCE, ["hold,lifted,0,1,1,250"], "line 2: lever_arm_m = 250 must be .* from 0 up to 2"),
        (FORCE, ["hold,lifted,0,1,,0.2"], "line 2: .*force_sd_N, must be there and positive"),
        (
            FORCE.replace("force_sd_N,", ""),
            ["hold,lifted,0,1,0.2"],
            "line 2: the column force_sd with its unit, such as",
        ),
        (FORCE.replace("rad", "deg"), ["hold,lifted,25,1,1,0.2"], "line 2: steer_deg = 25 must be .* up to 20.05"),
        (FORCE + ",steer_torque_N_m", ["hold,lifted,0,1,1,0.2,3"], "line 2: steer_torque and force give the same"),
        (HEAD.replace("steer_rad,", ""), ["hold,lifted,,,1,1"], "the column steer_deg or steer_rad is missing"),
        (HEAD.replace("steer_rad", "steer"), GOOD, "column steer: no unit of angle is given"),
        (HEAD.replace("steer_rad", "steer_mm"), GOOD, "column steer_mm: unit 'mm' is not a unit of angle"),
        (HEAD + ",steer_deg", [f"{GOOD[0]},0"], "two columns give the steer; keep one"),
        (
            HEAD + ",torque",
            [f"{GOOD[0]},0"],
            "unknown column 'torque'.* known: .*steer_torque_N_m.*; the name of a column",
        ),
        (HEAD.replace("condition,", ""), ["hold,0,,,1,1"], "the column condition is missing"),
    ],
)
def test_tables_that_cannot_be_read(tmp_path, head, lines, words):
    with pytest.raises(InputError, match=words):
        read_measurement(write(tmp_path, lines, head=head))


def test_forces_in_kgf_are_told(tmp_path):
    """Lifted and on the floor, by hand; a spring of half the weight's is no other unit."""
    for unit, spring, asked in ((9.80665, 0.0, True), (1.0, 0.0, False), (1.0, 0.5, False)):
        hidden = {"spring": -spring * bar_stiffness(lifted=True)}
        lines = [",".join([*line.split(",")[:-2], *(f"{float(x) / unit:.12g}" for x in line.split(",")[-2:])])
                 for line in [*sweep(**hidden), *sweep("floor", **hidden)]]  # fmt: skip
        found = preflight(read_measurement(write(tmp_path, lines)).prepare())
        assert (found is not None and found.readings[0] == "steer_torque in kgf") == asked
