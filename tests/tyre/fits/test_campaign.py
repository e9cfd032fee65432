"""A folder of recordings to conditions, maps and figures; truth from the campaign's own truth file."""

import json
import os
import re
from dataclasses import replace
from threading import Timer

import numpy as np
import pandas as pd
import pytest

from tests.shared.refusals import refuses
from tyre.fits import (
    FitSettings,
    Key,
    RecordingSummary,
    Repeatability,
    combine,
    fit_campaign,
    points_of,
    pooled_repeatability,
    recordings_in,
    write_tables,
)
from tyre.laws import read_tir
from tyre.maps import TyreMap
from tyre.measured import Calibration
from tyre.recordings import Condition
from tyre.rig import CampaignPlan, default_effects, set_effect, write_campaign_files

QUIET = {"jobs": 1, "progress": False}


@pytest.fixture
def campaign(rig_campaign):
    return rig_campaign[0]


def test_conditions_hold_the_truth(rig_folder, campaign):
    truth = {(t["surface"], t["load_N"]): t for t in json.loads((rig_folder / "truth.json").read_text())["conditions"]}
    assert len(campaign.conditions) == 4
    for condition in campaign.conditions:
        expected = truth[condition.surface, condition.load]
        for name, key, within in (
            ("cornering_stiffness", "cornering_stiffness_N_per_rad", 0.03),
            ("lateral_stiffness", "lateral_stiffness_N_per_m", 0.03),
            ("relaxation_length", "relaxation_length_m", 0.04),
            ("pneumatic_trail", "pneumatic_trail_m", 0.05),
        ):
            estimate = getattr(condition, name)
            assert estimate.value == pytest.approx(expected[key], rel=within)
            assert abs(estimate.value - expected[key]) < 5 * estimate.sd
        assert condition.r_squared > 0.999


def test_drum_borrows_the_flat_stiffness_and_says_so(campaign):
    drums = [c for c in campaign.conditions if c.surface == "drum"]
    flats = {c.load: c for c in campaign.conditions if c.surface == "flat"}
    for drum in drums:
        assert drum.borrowed_stiffness
        assert drum.lateral_stiffness == flats[drum.load].lateral_stiffness
        assert any("lateral stiffness is that of the flat track" in text for text in drum.warnings)


def test_curvature_exponent_is_reported_not_applied(campaign):
    (item,) = campaign.curvature
    assert item.pairs == 2
    # the simulator's drum: (1 + 0.34 / 1.3)^0.6
    assert item.exponent.value == pytest.approx(0.6, abs=0.12)
    assert item.ratio == pytest.approx((1 + 0.34 / 1.3) ** 0.6, rel=0.02)
    at = {(c.surface, c.load): c.cornering_stiffness.value for c in campaign.conditions}
    one, other = (np.log(at["flat", load] / at["drum", load]) / np.log(1 + 0.34 / 1.3) for load in {n for _, n in at})
    assert item.exponent.value == pytest.approx((one + other) / 2)
    # the mean of two numbers scatters by half their distance, with one degree of freedom
    assert (item.exponent.sd, item.exponent.dof) == (pytest.approx(abs(one - other) / 2), 1.0)


def test_map_and_property_files_can_be_read_back(campaign, tmp_path):
    write_tables(campaign, out := tmp_path, wheel_radius=0.34)
    flat = next(c for c in campaign.conditions if c.surface == "flat" and c.load == 350.0)
    tyre = TyreMap.from_file(out / "maps" / "Synthetic_tyre_flat.csv")
    at = tyre.at(load=350.0, pressure=4e5)
    assert at.origin == "measured"
    assert at.cornering_stiffness == pytest.approx(flat.cornering_stiffness.value, rel=1e-9)
    assert at.lateral_stiffness_sd == pytest.approx(flat.lateral_stiffness.sd, rel=1e-9)
    for name in ("Synthetic_tyre_flat_mf61.tir", "Synthetic_tyre_flat_4.00bar_mf52.tir"):
        properties = read_tir(out / "tir" / name).at(load=350.0, pressure=4e5)
        assert properties.cornering_stiffness == pytest.approx(flat.cornering_stiffness.value, rel=0.02)
        assert properties.relaxation_length == pytest.approx(flat.relaxation_length.value, rel=0.02)
    assert "synthetic" in (out / "tir" / "Synthetic_tyre_flat_mf61.tir").read_text()


def test_tyres_whose_names_differ_in_signs_alone_get_files_of_their_own(campaign, tmp_path):
    names = ("Pro 25/28", "Pro 25-28", "Pro 25 28")
    conditions = tuple(
        replace(item, tyre=name) for name in names for item in campaign.conditions if item.surface == "flat"
    )
    paths, _ = write_tables(replace(campaign, conditions=conditions), tmp_path, wheel_radius=0.34)
    assert len(paths) == len(set(paths))
    tables = [path for path in paths if path.suffix == ".csv"]
    assert [path.name for path in tables] == ["Pro_25_28_flat.csv", "Pro_25-28_flat.csv", "Pro_25_28_2_flat.csv"]
    assert [TyreMap.from_file(path).tyre for path in tables] == list(names)


def test_a_second_run_with_workers_takes_its_fits_from_the_cache_but_for_damaged_ones(rig_folder, rig_campaign):
    campaign, cache = rig_campaign
    first, second, third, *others = sorted(cache.glob("*.fit"))
    whole = {path: (path.read_text(), path.stat().st_mtime_ns) for path in (first, second, third, *others)}
    first.write_text("{")  # cut off in the middle of writing
    second.write_bytes(b"\xff\n\n")
    third.write_text(whole[third][0].replace("0.", "1.", 1))  # another number
    (left := cache / ".ab12.part4711.fit").write_text("half")  # of a killed run
    again = fit_campaign(rig_folder, cache_folder=cache, jobs=2, progress=False)
    assert again.as_json() == campaign.as_json()
    assert {path: path.read_text() for path in cache.glob("*.fit")} == {path: text for path, (text, _) in whole.items()}
    assert all(path.stat().st_mtime_ns == whole[path][1] for path in others)
    assert not left.exists()


def test_a_fit_waits_for_another_that_fills_the_same_cache(rig_folder, rig_campaign, capsys):
    """It once removed what the other one was writing."""
    fcntl = pytest.importorskip("fcntl")
    campaign, cache = rig_campaign
    other = os.open(cache, os.O_RDONLY)
    fcntl.flock(other, fcntl.LOCK_EX)
    (part := cache / ".ab12.part4711.fit").write_text("of the other one")

    def finish():
        part.rename(cache / "ab12.fit")
        os.close(other)

    (later := Timer(0.3, finish)).start()
    again = fit_campaign(rig_folder, cache_folder=cache, **QUIET)
    later.join()
    (cache / "ab12.fit").unlink()  # it is there
    assert again.as_json() == campaign.as_json()
    said = capsys.readouterr().err
    assert said == f"warning: {cache}: another fit is writing there; this one waits for its end\n"


def test_other_settings_are_fitted_again(rig_folder, tmp_path):
    pulls = tmp_path / "pulls"
    pulls.mkdir()
    for path in rig_folder.glob("*pull*"):
        (pulls / path.name).write_bytes(path.read_bytes())
    for calibration in (Calibration(), Calibration(force=0.01)):
        settings = FitSettings(calibration=calibration)
        fit_campaign(pulls, settings=settings, cache_folder=tmp_path / "cache", **QUIET)
    assert len(list((tmp_path / "cache").glob("*.fit"))) == 2 * len(recordings_in(pulls))


def test_one_bad_file_is_left_out_with_the_reason_or_stops_when_asked(tmp_path):
    rng = np.random.default_rng(0)
    plan = CampaignPlan(loads=(400.0,), pressures=(5e5,), rates=(float(np.deg2rad(4.0)),), pulls=1)
    files = write_campaign_files(tmp_path, plan=plan, effects=default_effects(rng), rng=rng)
    (tmp_path / "broken.csv").write_text("time_s,slip_angle_deg\n0,1\n")
    refuses(r"broken.*leave it out with --skip-bad", fit_campaign, tmp_path, skip_bad=False, **QUIET)
    campaign = fit_campaign(tmp_path, **QUIET)
    assert list(campaign.skipped) == ["broken.csv"]
    assert campaign.conditions[0].files == tuple(sorted(path.name for path in files))
    assert any("no repeats in this campaign" in text for text in campaign.conditions[0].warnings)
    for path in files:
        path.unlink()
    refuses("none of 1 recordings could be used", fit_campaign, tmp_path, **QUIET)


BAD = [
    ("pull_1", "plate_displacement_mm", lambda x: 0 * x, r"stays at 0 mm: its gauge is dead"),
    ("pull_2", "plate_displacement_mm", lambda x: np.nan * x, r"no valid sample"),
    ("pull_3", "plate_displacement_mm", lambda x: x / 25.4, r"wrong sign|another unit|are needed"),
    ("sweep_4deg_s_1", "slip_angle_deg", lambda x: 0 * x, r"slip range"),
    ("sweep_4deg_s_2", "vertical_load_N", lambda x: 0.5 * x, r"load is 200\S* N, -50\.0% off the declared"),
]


def test_bad_recordings_do_not_stop_the_campaign(tmp_path):
    rng = np.random.default_rng(0)
    plan = CampaignPlan(loads=(400.0,), pressures=(5e5,), rates=(float(np.deg2rad(4.0)),), sweeps=3, pulls=4)
    files = write_campaign_files(tmp_path, plan=plan, effects=default_effects(rng), rng=rng)
    reasons = {}
    for stem, column, change, reason in BAD:
        bad = next(path for path in files if path.stem.endswith(stem))
        frame = pd.read_csv(bad)
        frame.assign(**{column: change(frame[column])}).to_csv(bad, index=False)
        reasons[bad.name] = reason
    campaign = fit_campaign(tmp_path, **QUIET)
    assert campaign.skipped.keys() == reasons.keys()
    assert all(re.search(reasons[name], said) for name, said in campaign.skipped.items()), campaign.skipped
    assert campaign.conditions[0].files == tuple(sorted({path.name for path in files} - reasons.keys()))


def _summary(value, *, number=0, kind="slip_sweep", fit_sd=10.0):
    condition = Condition(tyre="T", load=400.0, pressure=5e5, surface="flat")
    return RecordingSummary(f"{kind}_{number}", kind, condition, True, value, fit_sd, r_squared=0.999)


def test_repeatability_is_pooled_over_conditions():
    groups = [[_summary(v, fit_sd=1e-3 * v) for v in row] for row in ((99.0, 101.0), (198.0, 200.0, 202.0), (50.0,))]
    pooled = pooled_repeatability(groups, floor=0.02)
    # squared relative deviations: 2 (1 %)^2 + 2 (1 %)^2 of 1 + 2 degrees of freedom, and 8 of the stated 2 % with the
    # 0.1 % that each fit says of its own
    assert pooled.sd == pytest.approx(np.sqrt((4e-4 + 8 * (4e-4 + 1e-6)) / 11))
    assert (pooled.dof, pooled.repeats, pooled.conditions, pooled.measured, pooled.refuted) == (11, 3, 2, True, False)
    assert pooled.scatter == pytest.approx(np.sqrt(4e-4 / 3))
    none = pooled_repeatability([[_summary(50.0)]], floor=0.02)
    assert (none.sd, none.dof, none.measured, none.repeats) == (0.02, 8.0, False, 0.0)


def test_one_pair_does_not_replace_the_stated_repeatability_unless_it_refutes_it():
    alike = pooled_repeatability([[_summary(v, fit_sd=0.0) for v in (100.0, 100.001)]], floor=0.01)
    assert alike.sd == pytest.approx(0.01 * np.sqrt(8 / 9), rel=1e-4)
    far = pooled_repeatability([[_summary(v, fit_sd=0.0) for v in (95.0, 105.0)]], floor=0.01)
    assert (far.sd, far.dof, far.refuted) == (pytest.approx(0.05 * np.sqrt(2)), 1.0, True)
    pair = [_summary(v, number=n) for n, v in enumerate((95.0, 105.0))]
    settings = {"borrowed": [], "pull_repeatability": far, "calibration": Calibration()}
    result = combine(Key("T", "flat", 400.0, 5e5), pair, sweep_repeatability=far, **settings)
    assert any("repeats scatter by 7.07 %, more than the stated" in text for text in result.warnings)


def test_a_recording_noisier_than_the_others_keeps_its_own_sd():
    noisy = [_summary(100.0, fit_sd=4.0)]
    pooled = Repeatability(0.01, 30.0, True, 10)
    settings = {"borrowed": [], "pull_repeatability": pooled, "calibration": Calibration(force=0, slip=0)}
    result = combine(Key("T", "flat", 400.0, 5e5), noisy, sweep_repeatability=pooled, **settings)
    assert result.cornering_stiffness.sd == pytest.approx(4.0)


def test_a_condition_that_scatters_more_uses_its_own_scatter():
    wild = [_summary(value, number=n) for n, value in enumerate((5500.0, 6000.0, 6500.0))]
    settings = {
        "borrowed": [], "sweep_repeatability": Repeatability(0.005, 30.0, True, 10),
        "pull_repeatability": Repeatability(0.01, 5.0, True, 3), "calibration": Calibration(),
    }  # fmt: skip
    result = combine(Key("T", "flat", 400.0, 5e5), wild, **settings)
    assert any("more than the campaign's 0.50 %" in text for text in result.warnings)
    assert result.cornering_stiffness.sd > 0.04 * 6000.0
    assert result.lateral_stiffness is None
    assert any("no lateral stiffness test" in text for text in result.warnings)
    alone = combine(Key("T", "flat", 400.0, 5e5), [replace(wild[0], kind="lateral_stiffness")], **settings)
    assert alone.cornering_stiffness is None
    assert any("no slip sweep" in text for text in alone.warnings)


def test_routes_that_disagree_are_said(tmp_path):
    # a soft rim is seen by the rolling wheel but not by plate - rim, so C/K is too short for it: 1 + K/K_rim = 1.4
    rng = np.random.default_rng(2)
    effects = set_effect(default_effects(rng), "rim_compliance", {"stiffness": 1.2e5})
    effects = set_effect(effects, "noise", {"white": 1.0, "correlated": 0.2})
    plan = CampaignPlan(loads=(400.0,), pressures=(4e5,), rates=(float(np.deg2rad(4.0)),), sweeps=2, pulls=2, steps=3)
    write_campaign_files(tmp_path, plan=plan, effects=effects, rng=rng)
    (condition,) = fit_campaign(tmp_path, **QUIET).conditions
    assert condition.direct["slip step"].value > 1.2 * condition.relaxation_length.value
    assert any("routes to the relaxation length disagree" in text for text in condition.warnings)


def test_tables_of_the_rig_and_whatever_has_a_sidecar(tmp_path):
    for name in ["a.csv", "b.parquet", "b.toml", "c.parquet", "notes.xlsx", "sub/d.TDX", "out/e.csv", "f.doc"]:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    refuses("jobs = 0 must be at least 1", fit_campaign, tmp_path, jobs=0, progress=False)
    refuses("no such folder", recordings_in, tmp_path / "nowhere")
    refuses(r"holds no recordings; expected \.csv", recordings_in, tmp_path / "out", exclude=tmp_path / "out")
    found = recordings_in(tmp_path, exclude=tmp_path / "out")
    assert [str(path.relative_to(tmp_path)) for path in found] == ["a.csv", "b.parquet", "sub/d.TDX"]


def test_the_force_less_its_residual_is_smooth(campaign):
    for summary in (item for c in campaign.conditions for item in c.sweeps):
        points = points_of(summary)
        rough = [np.diff(points["force_N"] + sign * points["residual_N"], n=2).std() for sign in (-1.0, 1.0)]
        assert rough[0] < rough[1]
