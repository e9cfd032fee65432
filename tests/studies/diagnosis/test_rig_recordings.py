"""Effects hidden by the rig simulator in synthetic recordings, and found by a forward model that does not know it."""

import ast
import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from read_report import read_report
from small_library import all_but, among

import studies.diagnosis
from studies.cli import main
from studies.diagnosis import Curve, Reference, RigRecordings, diagnose, read_measurement
from studies.inference import fit
from tyre.fits import write_csv
from tyre.ground import InputError
from tyre.measured import Calibration
from tyre.recordings import Condition
from tyre.rig import (
    DialGauge,
    DrumCurvature,
    ForceGainBySign,
    LoadCellDrift,
    Noise,
    PlySteer,
    Protocol,
    Remounting,
    RigFriction,
    RigTyre,
    RimCompliance,
    SensorGain,
    simulate_pull,
    simulate_step,
    simulate_sweep,
)

C, K = 7600.0, 75e3
LENGTH = C / K
STEADY = RigTyre(C, K, peak_force=430.0, shape=1.4, curvature=0.1, relaxation=False)
LAGGING = dataclasses.replace(STEADY, relaxation=True)
CURVE = Curve(400.0, 5.5e5, (C, 0.01 * C), (K, 0.01 * K), (LENGTH, 0.1 * LENGTH), 430.0, 1.4, 0.1)
REFERENCE = Reference((CURVE,), "the truth of the simulator")
FLAT = Condition(tyre="Synthetic", load=400.0, pressure=5.5e5, surface="flat", rim="laboratory", temperature=22.0)
DRUM = dataclasses.replace(FLAT, surface="drum", drum_radius=1.3)
FAIR = (Noise(), LoadCellDrift(rate=1.0), Remounting(), DialGauge(), SensorGain(force=0.002, slip=-0.002))
CHANNELS = ("time", "slip_angle", "lateral_force", "vertical_load", "aligning_moment", "speed", "temperature")


def sweep(seed, *effects, tyre=STEADY, condition=FLAT, rate=1.0, branch=None, **protocol):
    """A sweep of a fair laboratory with something hidden in it; ``rate`` deg/s; ``branch`` cuts one out."""
    how = Protocol(slip_rate=np.deg2rad(rate), **protocol)
    rng = np.random.default_rng(seed)
    run = simulate_sweep(tyre=tyre, condition=condition, protocol=how, effects=(*effects, *FAIR), rng=rng)
    if branch is None:
        return run
    quarter = how.slip_amplitude / how.slip_rate * how.sample_rate
    begin = {"down": 1, "up": 3}[branch]
    part = slice(int(begin * quarter), int((begin + 2) * quarter))
    return dataclasses.replace(run, **{name: getattr(run, name)[part] for name in CHANNELS})


def pull(seed, *effects):
    rng = np.random.default_rng(seed)
    return simulate_pull(tyre=STEADY, condition=FLAT, protocol=Protocol(), effects=(*effects, *FAIR), rng=rng)


def measurement(sweeps=(), pulls=(), reference=REFERENCE, **rest):
    named = [tuple((f"{kind} {k}", one) for k, one in enumerate(many)) for kind, many in (("s", sweeps), ("p", pulls))]
    return RigRecordings(name="synthetic", reference=reference, sweeps=named[0], pulls=named[1], **rest)


def verdict(sweeps=(), pulls=(), **rest):
    return diagnose(measurement(sweeps, pulls, **rest)).verdict


def check_size(found, effect, parameter, truth):
    """The effect is named, with the true size of its parameter within three sd."""
    value, sd = next(e for e in found.effects if e.identifier == effect).parameters[parameter]
    assert value == pytest.approx(truth, abs=3 * sd)


def test_nothing_hidden_is_nothing_missing():
    for seed in (0, 10):
        found = verdict([sweep(seed), sweep(seed + 1, rate=2.0)], [pull(seed + 2)])
        assert found.verdict == "none"
        assert found.goodness_of_fit_p > 0.01


def test_a_lag_that_the_base_model_contains_is_not_missing():
    runs = [sweep(1, tyre=LAGGING), sweep(2, tyre=LAGGING, rate=2.0)]
    assert verdict(runs, includes=("sweep_lag",)).verdict == "none"
    assert verdict(runs).verdict == "named"


def test_a_large_drum_looks_like_a_wrong_scale():
    """A few per cent of stiffness at one condition: curvature or calibration, and the bench decides."""
    large = dataclasses.replace(DRUM, drum_radius=2.7)
    known = Reference((dataclasses.replace(CURVE, cornering_stiffness=(C, 0.003 * C)),), "well known")
    good = Calibration(force=0.002, slip=0.002, repeatability=0.004)
    run = sweep(1, DrumCurvature(exponent=0.6), condition=large)
    found = verdict([run], reference=known, calibration=good)
    assert found.verdict == "class"
    assert "drum_curvature" in found.equivalent
    assert {"force_scale", "slip_scale"} & set(found.equivalent)
    assert any("bench test of" in s.what or "flat track" in s.what for s in found.separating_measurements if s.gain > 2)


def test_rim_displacement_ignored():
    test = pull(3, RimCompliance(stiffness=3e5))
    found = verdict(pulls=[test], pull_displacement="plate")
    assert (found.verdict, found.equivalent) == ("named", ("rim_compliance",))
    check_size(found, "rim_compliance", "compliance", 1 / 3e5)
    assert verdict(pulls=[test]).verdict == "none"
    unread = dataclasses.replace(test, rim_displacement=0 * test.rim_displacement)
    assert verdict(pulls=[unread]).equivalent == ("rim_compliance",)


def test_a_pull_that_falls_a_quarter_behind_a_straight_line_is_no_straight_line():
    test = pull(4)
    share = 0.25 * np.abs(test.plate_displacement) / np.abs(test.plate_displacement).max()
    assert (
        verdict(pulls=[dataclasses.replace(test, lateral_force=(1 - share) * test.lateral_force)]).verdict == "unknown"
    )


def test_rig_friction_in_a_pull():
    found = verdict(pulls=[pull(4, RigFriction(force=2.0))])
    assert found.equivalent == ("rig_friction",)
    check_size(found, "rig_friction", "friction", 2.0)


def test_lag_on_one_branch_looks_like_ply_steer_until_the_other_is_recorded():
    up = sweep(2003, tyre=LAGGING, rate=2.0, branch="up")
    one = verdict([up])
    assert one.verdict == "class"
    assert {"sweep_lag", "ply_steer"} <= set(one.equivalent)
    gain = {s.what: s.gain for s in one.separating_measurements}
    assert gain["the other branch of the sweep"] > 3
    assert "steering_play" in one.to_dict()["not_tried"]
    both = verdict([up, sweep(2004, tyre=LAGGING, rate=2.0, branch="down")])
    assert both.equivalent[0] == "sweep_lag"
    assert "ply_steer" not in both.equivalent


def test_lag_at_one_rate_looks_like_play_until_another_rate_is_recorded():
    one = verdict([sweep(11, tyre=LAGGING)])
    assert set(one.equivalent) == {"sweep_lag", "steering_play"}
    gain = {s.what: s.gain for s in one.separating_measurements}
    assert gain["both branches at 2 deg/s"] > 3
    two = verdict([sweep(11, tyre=LAGGING), sweep(12, tyre=LAGGING, rate=2.0)])
    assert (two.verdict, two.equivalent) == ("named", ("sweep_lag",))
    check_size(two, "sweep_lag", "relaxation_length", LENGTH)


def test_slip_offset_and_force_offset_are_told_apart_by_both_branches():
    slip = verdict([sweep(21, PlySteer(force=0.0, slip=2e-3))])
    assert (slip.verdict, slip.equivalent) == ("named", ("ply_steer",))
    check_size(slip, "ply_steer", "slip", 2e-3)
    force = verdict([sweep(22, PlySteer(force=20.0))])
    assert (force.verdict, force.equivalent) == ("named", ("conicity",))
    check_size(force, "conicity", "force", 20.0)


def test_a_late_force_channel():
    late = 0.012
    runs = [sweep(31), sweep(32, rate=2.0), sweep(33, rate=2.0, speed=5.0)]
    runs = [dataclasses.replace(r, lateral_force=np.interp(r.time - late, r.time, r.lateral_force)) for r in runs]
    found = verdict(runs)
    assert (found.verdict, found.equivalent) == ("named", ("channel_delay",))
    check_size(found, "channel_delay", "delay", late)


def test_a_force_cell_with_another_gain_to_the_left():
    """Readings are changed by hand; the simulator's own effect does the same to them."""
    runs = [sweep(34), sweep(35, rate=2.0)]
    by_hand = [dataclasses.replace(r, lateral_force=r.lateral_force + 0.02 * np.abs(r.lateral_force)) for r in runs]
    forward = measurement(by_hand).prepare()
    candidate = next(c for c in forward.candidates if c.identifier == "force_gain_by_sign")
    found = fit(forward, (candidate,))
    difference, sd = found.theta[-1], np.sqrt(found.covariance[-1, -1])
    assert difference == pytest.approx(0.04, abs=3 * sd)
    assert sd < 0.01
    assert fit(forward).objective - found.objective > 20
    assert candidate.unknowns[0].least == 0.002
    channels = {"lateral_force": runs[0].lateral_force.copy()}
    ForceGainBySign(difference=0.04).on_rolling(channels, np.random.default_rng(0))
    np.testing.assert_allclose(channels["lateral_force"], by_hand[0].lateral_force, rtol=1e-12)


def test_a_gain_by_sign_needs_both_signs():
    run = sweep(36, branch="up")
    right = run.slip_angle > np.deg2rad(0.3)
    half = dataclasses.replace(run, **{name: getattr(run, name)[right] for name in CHANNELS})
    refused = measurement([half]).prepare().refused["force_gain_by_sign"]
    assert refused == "every sweep has slip angles of one sign, where it is another gain of the force cell"
    assert measurement(pulls=[pull(2)]).prepare().refused["force_gain_by_sign"] == "no slip sweep"


def test_three_effects_at_once():
    hidden = (DrumCurvature(exponent=0.6), PlySteer(force=15.0))
    runs = [sweep(41 + k, *hidden, tyre=LAGGING, condition=DRUM, rate=k + 1.0) for k in range(2)]
    given = measurement(runs)
    found = among(given, ("drum_curvature", "conicity", "sweep_lag", "ply_steer")).verdict
    assert {e.identifier for e in found.effects} == {"drum_curvature", "conicity", "sweep_lag"}
    assert found.held_out_gap["final"] < 0.2


def test_another_load_than_the_reference():
    heavy = dataclasses.replace(FLAT, load=520.0)
    stiff = dataclasses.replace(STEADY, cornering_stiffness=C * (520 / 400) ** 0.6, peak_force=430 * 520 / 400)
    found = verdict([sweep(51), sweep(52, tyre=stiff, condition=heavy)])
    assert found.equivalent[0] == "load_dependence"
    check_size(found, "load_dependence", "exponent", 0.6)


def test_derivatives():
    forward = measurement([sweep(1, tyre=LAGGING, condition=DRUM)], [pull(2)]).prepare()
    stated, (read,) = np.array([u.centre for u in forward.nuisances]), forward.readings
    computed = forward.forces((), stated)["p 0"]
    assert np.linalg.norm(computed - read.force) < 0.2 * np.linalg.norm(read.force)
    rng = np.random.default_rng(3)
    candidates = forward.candidates
    unknowns = [*forward.nuisances, *(u for c in candidates for u in c.unknowns)]
    theta = np.array([u.centre + 0.3 * u.scale * rng.uniform(0.2, 1.0) for u in unknowns])
    _, slope = forward.residual(candidates, theta)
    for k, u in enumerate(unknowns):
        h = 1e-4 * u.scale
        move = np.zeros(len(theta))
        move[k] = h
        ahead, back = (forward.residual(candidates, theta + s * move, slopes=False)[0] for s in (1, -1))
        expected = (ahead - back) / (2 * h) * u.scale
        assert np.linalg.norm(slope[:, k] * u.scale - expected) <= 0.05 * np.linalg.norm(expected) + 1e-6, u.name


SIMULATOR = tuple(f"tyre.rig.{name}" for name in ("simulator", "tyre", "campaign"))


def test_the_forward_model_does_not_know_the_simulator():
    """It knows what the effects declare for a fit, and neither the simulated tyre nor what is done to its channels."""
    files = sorted(Path(studies.diagnosis.__file__).parent.glob("rig*.py"))
    assert len(files) >= 3
    for file in files:
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            module = getattr(node, "module", None) if isinstance(node, ast.ImportFrom) else None
            assert not (module or "").startswith(SIMULATOR), file.name


RIG = 'kind = "rig"\ndescription = "Synthetic."\n[rig]\nrecordings = "drum"\n[rig.reference]\n'
VALUES = (
    "[[rig.reference.conditions]]\nload_N = 400\npressure_bar = 5.5\ncornering_stiffness_N_per_rad = 7600\n"
    "lateral_stiffness_N_per_m = 75000\n"
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    root = tmp_path_factory.mktemp("rig")
    for name in ("flat", "drum", "other", "step", "short"):
        (root / name).mkdir()
    for k, rate in enumerate((1.0, 2.0)):
        write_csv(sweep(61 + k, tyre=LAGGING, rate=rate), root / "flat" / f"sweep_{k}.csv")
        hidden = DrumCurvature(exponent=0.6)
        write_csv(sweep(63 + k, hidden, tyre=LAGGING, rate=rate, condition=DRUM), root / "drum" / f"sweep_{k}.csv")
    few = sweep(61, branch="up")
    write_csv(dataclasses.replace(few, **{c: getattr(few, c)[:30] for c in CHANNELS}), root / "short" / "sweep.csv")
    write_csv(pull(65), root / "flat" / "pull.csv")
    other = dataclasses.replace(FLAT, tyre="Another")
    write_csv(sweep(66, condition=other), root / "other" / "sweep.csv")
    rng = np.random.default_rng(67)
    step = simulate_step(tyre=LAGGING, condition=FLAT, protocol=Protocol(), effects=FAIR, rng=rng)
    write_csv(step, root / "step" / "step.csv")
    return root


def written(folder, text):
    (folder / "rig.toml").write_text(text)
    return folder / "rig.toml"


@pytest.mark.usefixtures("two_variants")
def test_the_command_reads_recordings_and_their_reference(folder, tmp_path, capsys):
    tried = ("drum_curvature", "sweep_lag", "conicity", "force_scale")
    left_out = [f"--without={name}" for name in all_but(read_measurement(written(folder, RIG + VALUES)), tried)]
    file = written(folder, RIG + 'recordings = "flat"\n')
    where = ["--out", str(tmp_path / "out"), "--json", str(tmp_path / "v.json"), "--workers", "1"]
    main(["diagnose", str(file), *where, *left_out])
    found = json.loads((tmp_path / "v.json").read_text())
    assert {e["identifier"] for e in found["effects"]} == {"drum_curvature", "sweep_lag"}
    assert len(found["stability"]["variants"]) == 2
    assert "the recordings are synthetic" in found["warnings"]
    report = read_report(tmp_path / "out")
    assert "recordings in flat/, on a flat track" in report
    assert "bicycle" not in report
    for figure in ("story", "before_after"):
        assert (tmp_path / "out" / f"{figure}.png").stat().st_size > 10_000
    shown = capsys.readouterr()
    assert "drum_curvature" in shown.out
    assert "diagnose:" not in shown.err  # no progress bar: this is no terminal


def test_a_campaign_as_reference(folder, tmp_path):
    from tyre.fits import fit_campaign

    campaign = fit_campaign(folder / "flat", jobs=1, progress=False)
    (folder / "flat.json").write_text(json.dumps(campaign.as_json()))
    found = read_measurement(written(folder, RIG + 'campaign = "flat.json"\n'))
    (curve,) = found.reference.curves
    assert curve.cornering_stiffness[0] == pytest.approx(C, rel=0.02)
    assert curve.length[0] == pytest.approx(LENGTH, rel=0.03)
    assert found.reference.tyre == "Synthetic"


def test_a_step_is_left_out_and_said(folder):
    both = RIG.replace('"drum"', '["flat/sweep_0.csv", "step/step.csv"]')
    found = read_measurement(written(folder, both + VALUES))
    assert len(found.sweeps) == 1
    assert any("step: a slip step, not used" in note for note in found.notes)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('kind = "rig"\n', r"the table \[rig\] is missing"),
        ('kind = "rig"\nbicycle = "benchmark"\n', "unknown key 'bicycle'"),
        (RIG.replace("recordings", "recording") + VALUES, "unknown key 'recording'; did you mean 'recordings'"),
        ('kind = "rig"\n[rig]\nrecordings = "drum"\n', "reference is missing"),
        (RIG.replace('"drum"', '"nowhere"') + VALUES, "no such folder"),
        (RIG.replace('"drum"', "3") + VALUES, "must be a folder in quotes or a list of files"),
        (RIG.replace('"drum"', '["flat/sweep_0.csv", "drum/sweep_0.csv"]') + VALUES, "two files of that name"),
        (RIG.replace('"drum"', '["step/step.csv"]') + VALUES, "no slip sweep and no lateral stiffness test"),
        (RIG.replace('"drum"', '["flat/sweep_0.csv", "other/sweep.csv"]') + VALUES, "recordings of 2 tyres"),
        (RIG.replace('"drum"', '"other"') + 'recordings = "flat"\n', "of 'Another', the reference is of 'Synthetic'"),
        (
            RIG.replace("[rig.", 'pull_displacement = "rim"\n[rig.', 1) + VALUES,
            "pull_displacement = 'rim' is not allowed",
        ),
        (RIG.replace("[rig.", "wheel_radius_m = 34\n[rig.", 1) + VALUES, "wheel_radius_m = 34 must be a radius"),
        (RIG.replace("[rig.", "includes = 1\n[rig.", 1) + VALUES, "must be a list of rig effects"),
        (RIG.replace("[rig.", "calibration = 1\n[rig.", 1) + VALUES, r"write \[rig.calibration\]"),
        (RIG + VALUES + "[rig.calibration]\nforc = 0.01\n", "unknown key 'forc'; did you mean 'force'"),
        (RIG + VALUES + '[rig.calibration]\nforce = "a"\n', "force = 'a' must be a number"),
        (RIG + VALUES + "[rig.calibration]\nforce = 2\n", "calibration.force = 2.0 must be .*0 to 0.5"),
        (RIG, "no source; give one of"),
        ('kind = "rig"\n[rig]\nrecordings = "drum"\nreference = 3\n', r"reference = 3 must be a table"),
        (RIG + 'table = "x.csv"\ncampaign = "x.json"\n', "campaign, table; give one of"),
        (RIG + "surprise = 1\n", "unknown key 'surprise'"),
        (RIG + "table = 1\n", "must be a path in quotes"),
        (RIG + "conditions = 1\n", "write conditions as"),
        (RIG + "conditions = [1]\n", "number 1: 1 must be a table"),
        (RIG + 'campaign = "none.json"\n', "cannot be read"),
        (RIG + 'campaign = "rig.toml"\n', "not JSON"),
        (RIG + 'campaign = "empty.json"\n', "holds no conditions"),
        (RIG + 'campaign = "wrong.json"\n', "not the JSON of `velotyre tyre fit --json`"),
        (RIG + 'campaign = "drum.json"\n', "add drum_radius_m"),
        (RIG + VALUES.replace("load_N = 400\n", ""), "number 1: load_N is missing"),
        (RIG + VALUES.replace("load_N = 400", "load_N = 0"), "load_N = 0 must be a number > 0"),
        (RIG + VALUES.replace("load_N = 400", "load_N = 5e-324"), "load_N = 5e-324 must be .* at least 1e-12"),
        (RIG + VALUES + 'surface = "drum"\n', "together with drum_radius_m"),
        (RIG + VALUES + "relaxation_length_sd_m = 0.1\n", "relaxation_length_sd_m without relaxation_length_m"),
        (RIG + VALUES + "peek_N = 1\n", "unknown key 'peek_N'; did you mean 'peak_N'"),
        (RIG + VALUES.replace("5.5", "4.0"), "has nothing at 5.5 bar"),
        (RIG + "drum_radius_m = 1.3\n" + VALUES, "drum_radius_m = 1.3, but values in the file: a flat track; take one"),
        (RIG + 2 * VALUES, "number 2: load and pressure of number 1 again; keep one"),
        (RIG + VALUES.replace("7600", "133"), "cornering_stiffness_N_per_rad = 133 is below 400.*is it in N/deg"),
        (RIG + VALUES.replace("75000", "75"), "lateral_stiffness_N_per_m = 75 is below 4000.*is it in N/mm"),
        (RIG.replace('"drum"', '["short/sweep.csv"]') + VALUES, "sweep.csv: not usable: "),
    ],
)
def test_what_is_wrong_in_the_file_is_said(folder, text, words):
    (folder / "empty.json").write_text('{"conditions": []}')
    (folder / "wrong.json").write_text("[]")
    row = {"tyre": "T", "surface": "drum", "load_N": 400, "pressure_bar": 5.5}
    row |= dict.fromkeys(("cornering_stiffness_N_per_rad", "lateral_stiffness_N_per_m", "relaxation_length_m"))
    (folder / "drum.json").write_text(json.dumps({"conditions": [row]}))
    with pytest.raises(InputError, match=words):
        read_measurement(written(folder, text))


@pytest.mark.parametrize(
    ("rest", "words"),
    [
        ({"includes": ("sweep_leg",)}, "unknown rig effect 'sweep_leg'; did you mean 'sweep_lag'"),
        ({"includes": ("rim_compliance",)}, "includes 'rim_compliance', but: no lateral stiffness test"),
        (
            {"reference": Reference((Curve(400.0, 5.5e5, None, (K, 1.0)),), "K only")},
            "the reference .K only. has no cornering stiffness at 400 N",
        ),
    ],
)
def test_what_the_recordings_cannot_show_is_refused(rest, words):
    with pytest.raises(InputError, match=words):
        measurement([sweep(1)], **rest).prepare()


def test_a_recording_counts_once():
    """Pulls with the same weights are not the same recording; a copy is, gaps included."""
    first, second = pull(68), pull(69)
    measurement(pulls=[first, dataclasses.replace(second, lateral_force=first.lateral_force)])
    gap = first.lateral_force.copy()
    gap[3] = np.nan
    copy = dataclasses.replace(first, lateral_force=gap)
    with pytest.raises(InputError, match="p 1: the same recording as p 0; keep one, or it counts twice"):
        measurement(pulls=[copy, copy])
    run = sweep(1)
    with pytest.raises(InputError, match="s 1: the same recording as s 0"):
        measurement([run, run])


def test_an_unknown_effect_is_not_left_out():
    with pytest.raises(InputError, match="--without: unknown rig effect 'wobble'"):
        diagnose(measurement([sweep(1)]), without=("wobble",))


def test_a_tyre_has_no_bicycle_model():
    with pytest.raises(InputError, match="no bicycle model"):
        diagnose(measurement([sweep(1)]), model=object())


def test_a_table_as_reference(folder):
    head = "load_N,pressure_bar,cornering_stiffness_N_per_deg,lateral_stiffness_N_per_mm\n"
    (folder / "table.csv").write_text(head + "400,5.5,130,75\n500,5.5,150,76\n")
    sidecar = 'tyre = "Synthetic"\nsurface = "drum"\nsource = "made up"\n'
    (folder / "table.toml").write_text(sidecar)
    with pytest.raises(InputError, match="a drum without drum_diameter_m"):
        read_measurement(written(folder, RIG + 'table = "table.csv"\n'))
    (folder / "table.toml").write_text(sidecar + "drum_diameter_m = 2.6\n")
    found = read_measurement(written(folder, RIG + 'table = "table.csv"\n')).reference
    assert found.curves[0].drum_radius == pytest.approx(1.3)
    assert found.curves[0].cornering_stiffness[0] == pytest.approx(130 * 180 / np.pi)
    with pytest.raises(InputError, match="drum_radius_m = 1.2, but table table.csv.*: a radius of 1.3 m; take one of"):
        read_measurement(written(folder, RIG + 'table = "table.csv"\ndrum_radius_m = 1.2\n'))
    mixed = folder / "mixed"
    mixed.mkdir()
    write_csv(sweep(71), mixed / "a.csv")
    write_csv(sweep(72, condition=DRUM), mixed / "b.csv")
    with pytest.raises(InputError, match="a reference of 2 surfaces, drum, flat; give one"):
        read_measurement(written(folder, RIG + 'recordings = "mixed"\n'))
