"""One recording of many conditions: cut by the levels of its channels, never pooled, alike in every format."""

import csv
import math

import numpy as np
import pytest
from consortium import (
    CAMBERS,
    LOADS,
    PRESSURES,
    TRAIL,
    TWIST,
    camber_stiffness,
    consortium_run,
    stiffness,
    write_dat,
    write_mat,
    write_tdx,
)

from studies.look import drafts, look
from studies.rig_campaign import campaign_table
from tyre import InputError
from tyre.fits import fit_campaign, measured_tables, read_events, split, stretches
from tyre.ground import write_csv
from tyre.recordings import Condition, RigRun, preflight

OPEN = Condition("T", math.nan, math.nan, "flat", camber=math.nan)  # what the channels must say
PER_DEG = math.pi / 180


@pytest.fixture(scope="module")
def protocol():
    return consortium_run()


@pytest.fixture(scope="module")
def folders(protocol, tmp_path_factory):
    """The protocol in three formats, with the sidecar that `look` drafts, filled in."""
    found = {}
    for write in (write_mat, write_dat, write_tdx):
        ending = write.__name__.removeprefix("write_")
        folder = found[ending] = tmp_path_factory.mktemp(ending)
        path = write(protocol, folder / f"run.{ending}")
        if ending == "mat":
            (draft,) = drafts(look(path), folder)
            assert draft.marks == 2  # tyre and surface: all else is in the channels
            text = draft.text.replace('tyre = ""', 'tyre = "Example"').replace('surface = ""', 'surface = "flat"')
        if ending != "tdx":
            (folder / "run.toml").write_text(text.replace("run.mat", path.name))
    return found


def test_three_loads_two_pressures_and_three_cambers_are_eighteen_conditions_in_every_format(folders):
    runs = {ending: read_events(folder / f"run.{ending}") for ending, folder in folders.items()}
    expected = sorted((n, p, g) for n in LOADS for p in PRESSURES for g in CAMBERS)
    for events in runs.values():
        assert sorted(levels(events)) == expected
        assert levels(events) == levels(runs["dat"])
        for event, other in zip(events.values(), runs["dat"].values(), strict=True):
            assert abs(event.time.size - other.time.size) < 60  # more or less of the rest at the ends
            inside = slice(*np.searchsorted(event.time, other.time[[30, -30]]))
            for name in ("slip_angle", "lateral_force", "aligning_moment", "pressure"):
                here, there = getattr(event, name)[inside], getattr(other, name)[30:-30]
                np.testing.assert_allclose(here, there, rtol=1e-7, atol=1e-5)  # of the printed digits


def test_the_fit_of_a_protocol_holds_stiffness_trail_and_slopes_over_camber(folders, tmp_path):
    campaign = fit_campaign(folders["dat"], jobs=1, progress=False)
    write_csv(tmp_path / "c.csv", campaign_table(campaign))
    with (tmp_path / "c.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 18
    for row in rows:
        load, pressure = float(row["load_N"]), float(row["pressure_bar"])
        for name, unit, truth, within in (
            ("cornering_stiffness", "N_per_deg", stiffness(load, pressure) * PER_DEG, 0.015),
            ("pneumatic_trail", "mm", 1e3 * TRAIL, 0.02),
            ("camber_stiffness", "N_per_deg", camber_stiffness(load) * PER_DEG, 0.03),
            ("twisting_stiffness", "N_m_per_deg", TWIST * load / 400 * PER_DEG, 0.25),
        ):
            value, sd = (float(row[f"{name}{part}_{unit}"]) for part in ("", "_sd"))
            assert value == pytest.approx(truth, rel=within), (name, load, pressure)
            assert abs(value - truth) < 4 * sd, (name, load, pressure)
    tables, remarks = measured_tables(campaign)
    assert tables == []  # without lateral stiffness tests
    assert "Example on flat: conditions at more camber, not in the map: 12" in remarks


def triangle(samples, cycles):
    """Slip in deg, up and down between -4 and 4 from 0."""
    return 8 / np.pi * np.arcsin(np.sin(2 * np.pi * np.arange(samples) / samples * cycles))


SWEEPS = np.tile(np.concatenate([np.zeros(100), triangle(600, 2), np.zeros(100)]), 6)  # deg


def run(slip=SWEEPS, *, load=400.0, pressure=5.0, camber=0.0, condition=OPEN, seed=0):
    """A noisy recording at 50 Hz with the slip, load, pressure and camber given, in deg, N, bar and deg."""
    rng = np.random.default_rng(seed)

    def noisy(level, sd):
        return np.broadcast_to(level, slip.shape) + rng.normal(0, sd, slip.size)

    force = 1.1 * load * np.sin(1.3 * np.arctan(10.5 * np.radians(slip)))
    return RigRun(
        condition, "ISO", np.arange(slip.size) / 50, np.radians(noisy(slip, 0.005)), noisy(force, 1.5),
        noisy(load, 2.0), inclination=np.radians(noisy(camber, 0.01)), pressure=1e5 * noisy(pressure, 0.005),
        speed=noisy(3.0, 0.01),
    )  # fmt: skip


def test_noise_of_the_slip_angle_at_rest_is_no_motion():
    """Noise of 0.1 deg; sweeps of 600 samples between rests of 100."""
    noise = np.random.default_rng(1).normal(0, 0.1, SWEEPS.size)
    cuts = stretches(run(SWEEPS + noise, load=np.repeat([300.0, 400.0, 500.0] * 2, 800)))
    assert [cut.first for cut in cuts] == pytest.approx(np.arange(100, 4800, 800), abs=20)
    assert [cut.last for cut in cuts] == pytest.approx(np.arange(700, 4800, 800), abs=20)


def levels(events):
    """Load in N, pressure in bar and camber in deg of every event."""
    found = [event.condition for event in events.values()]
    return [(c.load, round(c.pressure / 1e5, 6), round(math.degrees(c.camber), 6)) for c in found]


def each(*values):
    """A level for each of the six sweeps."""
    return np.repeat(values, 800)


@pytest.mark.parametrize(("given", "expected"), [
    ({}, [(400, 5, 0)]),  # one condition stays whole
    ({"load": each(500.0, 300, 100, 700, 300, 500)}, [(n, 5, 0) for n in (500, 300, 100, 700, 300, 500)]),
    ({"camber": each(0, 0, 3, 3, -1.5, 0)}, [(400, 5, g) for g in (0, 0, 3, 3, -1.5, 0)]),
    ({"pressure": each(3.5, 3.5, 3.5, 3.7, 3.7, 3.7)}, [(400, p, 0) for p in (3.5, 3.5, 3.5, 3.7, 3.7, 3.7)]),
    # the slip never rests while the pressure is set anew
    ({"slip": triangle(4000, 8), "pressure": np.repeat([3.5, 5.5], 2000)}, [(400, 3.5, 0), (400, 5.5, 0)]),
    ({"load": each(*[402.9] * 6), "camber": 0.3}, [(402.9, 5, 0)]),  # is not rounded to 400 N; stands upright
])  # fmt: skip
def test_levels_are_found(given, expected):
    assert levels(split({"": run(**given)})) == [pytest.approx(level, rel=2e-3, abs=1e-6) for level in expected]


def test_steps_at_two_loads_are_steps_with_their_rests():
    slip = np.tile(np.repeat([0.0, 1.0], 300), 4)
    found = split({"": run(slip, load=np.repeat([300.0, 500.0], 1200))})
    assert {event.kind for event in found.values()} == {"slip_step"}
    assert {load for load, _, _ in levels(found)} == {300, 500}
    assert min(event.time.size for event in found.values()) > 500


def test_sweeps_whose_pressure_drifts_without_levels_are_refused():
    with pytest.raises(InputError, match=r"the pressure of its 6 stretches varies from 3\.\d+ to 3\.9\d* bar without"):
        split({"": run(pressure=np.linspace(3.5, 4.0, SWEEPS.size))})


def test_no_piece_spans_more_than_one_condition():
    """A pressure that never stands still during endless cycles is cut to pieces of one condition each."""
    drifting = run(triangle(4000, 8), pressure=np.linspace(3.5, 4.1, 4000))
    for piece in split({"": drifting}).values():
        assert np.ptp(np.quantile(piece.pressure, [0.1, 0.9])) < 0.06 * np.median(piece.pressure)


@pytest.mark.parametrize(("declared", "given", "words"), [
    ({"pressure": 3.5e5}, {"pressure": 5.5}, "median pressure is 5.5 bar, declared are 3.5 bar, off by more than"),
    ({"camber": 0.0}, {"camber": 2.0}, "median camber is 2 deg, declared are 0 deg"),
    ({"load": 400.0}, {"load": 300.0}, "median vertical load is 300 N, -25.0% off the declared 400 N"),
    ({}, {"load": 400 + 60 * np.sin(np.arange(SWEEPS.size) / 700)}, "load scatters: .* more than one condition"),
])  # fmt: skip
def test_what_is_declared_is_held_against_its_channel(declared, given, words):
    known = {"load": 400.0, "pressure": 5e5, "camber": 0.0} | declared
    verdict = preflight(run(condition=Condition("T", surface="flat", **known), **given))
    assert not verdict.usable
    with pytest.raises(AssertionError, match=words):
        raise AssertionError("; ".join(verdict.problems))


def test_declared_levels_stay_and_a_missing_pressure_is_asked_for():
    (event,) = split({"": run(condition=Condition("T", 410.0, 4.9e5, "flat", camber=0.0))}).values()
    assert (event.condition.load, event.condition.pressure) == (410.0, 4.9e5)
    silent = run()
    with pytest.raises(InputError, match="key 'pressure' is missing .* and no channel has it"):
        split({"": RigRun(**{**vars(silent), "pressure": None})})
