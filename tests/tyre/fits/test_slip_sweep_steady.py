"""Settled points of slip angle, load and lateral force without time: one steady curve for every level."""

import json

import numpy as np
import pytest

from studies.cli import main
from studies.look import drafts, look, write_drafts
from tests.shared.refusals import refuses
from tyre.fits import fit_slip_sweep, read_events

SLIP = np.arange(-6, 6.01, 0.5)  # deg
SHAPE, CURVATURE = 1.35, -0.4
TRUTH = {300: (82.03, 300.0), 400: (97.74, 386.0), 500: (109.96, 464.0)}  # load in N -> C in N/deg, peak in N
SIDECAR = 'tyre = "A"\npressure_bar = 4.5\nsurface = "flat"\naxes = "adapted SAE"\nkind = "steady"\n'


def force(load, slip, shift=0.05):
    """Magic Formula (Pacejka 2012, eq. 4.E9) over slip, deg, with a stiffness C = B C D."""
    stiffness, peak = TRUTH[load]
    x = stiffness / (SHAPE * peak) * (slip + shift)
    return peak * np.sin(SHAPE * np.arctan(x - CURVATURE * (x - np.arctan(x))))


def rows(seed, loads=TRUTH, slip=SLIP, noise=1.0):
    rng = np.random.default_rng(seed)
    found = [(a, load, force(load, a) + rng.normal(0, noise)) for load in loads for a in slip]
    return [found[k] for k in rng.permutation(len(found))]  # in no order


def write(path, table, head="slip angle [deg],Fz [N],Fy [N]"):
    path.write_text("\n".join([head, *(",".join(f"{x:.2f}" for x in row) for row in table), ""]))
    return path


def test_look_drafts_a_sidecar_of_its_kind_and_fit_finds_each_load(tmp_path, capsys, no_pictures):
    path = write(tmp_path / "t.csv", rows(1))
    found = look(path)
    steady, step = (next(use for use in found.uses if use.name.startswith(name)) for name in ("steady", "step"))
    assert [(event.name, event.used) for event in steady.events] == [("300N", 25), ("400N", 25), ("500N", 25)]
    assert "rate_hz" not in " ".join((*steady.remedies, *step.remedies))
    (draft,) = drafts(found, tmp_path)
    assert 'kind = "steady"' in draft.text
    assert "rate_hz" not in draft.text
    write_drafts([draft], tmp_path, force=False)
    text = (tmp_path / "t.toml").read_text()
    for key, value in {"tyre": '"A"', "pressure_bar": "4.5", "surface": '"flat"'}.items():
        text = text.replace(f'{key} = ""', f"{key} = {value}")
    (tmp_path / "t.toml").write_text(text)
    described = look(path)  # with its sidecar
    assert [(use.name, len(use.events)) for use in described.uses][:3] == [
        ("steady curve", 3), ("lateral stiffness test", 0), ("step (relaxation)", 0),
    ]  # fmt: skip
    main(["tyre", "fit", str(tmp_path), "--out", str(tmp_path / "fit"), "--json", "-", "--jobs", "1"])
    conditions = json.loads(capsys.readouterr().out)["conditions"]
    assert [c["load_N"] for c in conditions] == [300, 400, 500]
    for condition in conditions:
        low, high = (np.deg2rad(x) for x in condition["cornering_stiffness_N_per_rad"]["ci95"])
        assert low < TRUTH[condition["load_N"]][0] < high


def test_nineteen_of_twenty_intervals_hold_the_stiffness(tmp_path):
    """By the fit's own sd: more than 6 misses of 40 have a probability of 1.4 %."""
    path = tmp_path / "t.csv"
    path.with_suffix(".toml").write_text(SIDECAR.replace("kind", "load_N = 400\nkind"))
    misses, values = 0, []
    for seed in range(40):
        write(path, [(a, f) for a, _, f in rows(seed, [400])], "slip_angle_deg,lateral_force_N")
        (run,) = read_events(path).values()
        fit = fit_slip_sweep(run)
        values.append(np.deg2rad(fit.cornering_stiffness.value))
        misses += abs(values[-1] - TRUTH[400][0]) > 2.1 * np.deg2rad(fit.fit_sd)
    assert misses <= 6
    assert np.mean(values) == pytest.approx(TRUTH[400][0], rel=0.01)


def test_levels_of_load_and_pressure_are_conditions_of_their_own(tmp_path):
    table = [(*row, bar) for bar in (3.5, 5.5) for row in rows(3, [300, 500])]
    path = write(tmp_path / "t.csv", table, "slip_angle_deg,vertical_load_N,lateral_force_N,pressure_bar")
    path.with_suffix(".toml").write_text(SIDECAR.replace("pressure_bar = 4.5\n", ""))
    found = {
        name: (run.condition.load, round(run.condition.pressure / 1e5, 6)) for name, run in read_events(path).items()
    }
    assert found == {
        "300N_3.5bar": (300, 3.5), "300N_5.5bar": (300, 5.5), "500N_3.5bar": (500, 3.5), "500N_5.5bar": (500, 5.5),
    }  # fmt: skip


@pytest.mark.parametrize(("slip", "words"), [
    (np.arange(-2, 3.0), "5 points are too few for a steady curve; at least 12 are needed"),
    (np.arange(0.5, 8, 0.5), "the points do not cross zero slip"),
])  # fmt: skip
def test_what_is_no_curve_is_refused(tmp_path, slip, words):
    path = write(tmp_path / "t.csv", rows(1, [400], slip), "slip_angle_deg,vertical_load_N,lateral_force_N")
    path.with_suffix(".toml").write_text(SIDECAR)
    (run,) = read_events(path).values()
    refuses(words, fit_slip_sweep, run)


def test_points_a_degree_apart_are_enough(tmp_path):
    path = write(
        tmp_path / "t.csv", rows(1, [400], np.arange(-7, 8.0)), "slip_angle_deg,vertical_load_N,lateral_force_N"
    )
    path.with_suffix(".toml").write_text(SIDECAR)
    (run,) = read_events(path).values()
    fit = fit_slip_sweep(run)
    assert np.deg2rad(fit.cornering_stiffness.value) == pytest.approx(TRUTH[400][0], abs=3 * np.deg2rad(fit.fit_sd))


def test_without_the_kind_the_sidecar_is_told(tmp_path):
    path = write(tmp_path / "t.csv", rows(1), "slip_angle_deg,vertical_load_N,lateral_force_N")
    path.with_suffix(".toml").write_text(SIDECAR.replace('kind = "steady"\n', ""))
    refuses('time_s is missing .* write kind = "steady" into the sidecar', read_events, path)


def test_so_many_points_are_rather_a_sweep(tmp_path):
    found = look(write(tmp_path / "t.csv", rows(1, [400], np.linspace(-6, 6, 400))))
    (steady,) = (use for use in found.uses if use.name == "steady curve")
    assert "rather samples of a sweep" in steady.remedies[0]
