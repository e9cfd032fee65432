"""The main study: what it computes, against independent paths; what it writes; what it refuses."""

import numpy as np
import pandas as pd
import pytest

from bicycle.bicycle_file import load_bicycle
from bicycle.critical import critical_speeds
from bicycle.effect import effect_class
from bicycle.model import Model
from bicycle.parameters import Bicycle
from studies.cli import main
from studies.main_study import study as main_study
from studies.main_study.cases import CONTACT, Settings, Setup, build, tyre_cases
from studies.main_study.checks import excess
from studies.main_study.figure_critical_speeds import draw_critical_speeds
from studies.main_study.figure_eigenvalues import draw_eigenvalues
from studies.main_study.figure_headline import draw_bands, draw_headline
from studies.main_study.figure_speed_locus import draw_speed_locus
from studies.main_study.solve import Crossing, damping_ratio, nearest, solve, unstable_bands
from studies.main_study.spread import uncertainty
from studies.main_study.study import DAMPING, count_steps, named_speeds, run_study
from studies.main_study.tables import tables
from studies.plotting import mode_look, mode_marker, mode_words

DEGREE = np.pi / 180


def exactly_known(name):
    """A bicycle whose file states standard deviations, without them: the uncertainty is the tyre's."""
    return Bicycle(name, load_bicycle(name).values, {})


@pytest.fixture(scope="module")
def study():
    settings = Settings(exactly_known("pista_rider_drops"), speeds=np.linspace(0, 30, 13), max_speed=40.0)
    told = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(main_study, "tyre_cases", lambda b, files: [c for c in tyre_cases(b) if c.tyre != "Tyre3"])
        found = run_study(settings, told.append)
        assert len(told) == count_steps(settings)
    return found


@pytest.fixture(scope="module")
def heavy():
    """A bicycle whose wheel loads lie outside the measured ones."""
    settings = Settings(load_bicycle("benchmark"), speeds=np.linspace(0, 30, 4), camber_shares=(0.0,), max_speed=30.0)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(main_study, "tyre_cases", one_tyre)
        return run_study(settings)


def one_tyre(bicycle, files):
    return [case for case in tyre_cases(bicycle) if case.name == "Tyre3 flat"]


def at_measured_loads(rear: float, front: float) -> Bicycle:
    """The default bicycle with mass and place of the rear frame chosen for these static loads (N)."""
    bicycle = load_bicycle("pista_rider_drops")
    v = dict(bicycle.values)
    total = (rear + front) / v["g"]
    others = v["mR"] + v["mH"] + v["mF"]
    v["xB"] = (front / v["g"] * v["w"] - v["mH"] * v["xH"] - v["mF"] * v["w"]) / (total - others)
    v["mB"] = total - others
    return Bicycle("at measured loads", v)


def test_tyre_values_at_measured_conditions_are_the_papers():
    cases = {(c.name, c.pressure_bar): c for c in tyre_cases(at_measured_loads(490.0, 340.0))}
    printed = {  # Dell'Orto et al., Tables 2-9: N/deg and mm, rear at 490 N, front at 340 N
        ("Tyre1 flat", 3.5): (110.7, 140.9, 105.3, 134.0),
        ("Tyre1 drum", 7.5): (100.8, 76.8, 80.5, 61.3),
        ("Tyre2 flat", 5.5): (107.9, 82.1, 88.8, 121.1),
        ("Tyre3 flat", 3.5): (120.0, 198.5, 103.6, 187.3),
    }
    for key, numbers in printed.items():
        case = cases[key]
        rear_c, rear_length, front_c, front_length = case.contact
        found = (rear_c * DEGREE, rear_length * 1e3, front_c * DEGREE, front_length * 1e3)
        assert found == pytest.approx(numbers, abs=0.051)
        assert case.rear.origin == case.front.origin == "measured"
        assert np.sqrt(np.diag(case.covariance)) == pytest.approx([0, 3e-3, 0, 3e-3], abs=2e-4)


@pytest.mark.parametrize(("length", "speed"), [(0.089, 37.8), (0.141, 34.5), (0.200, 30.4)])
def test_rigid_wobble_onset_of_the_benchmark_bicycle(length, speed):
    """Computed once by an independent formulation, C = 110 N/deg on both wheels, no camber thrust."""
    settings = Settings(load_bicycle("benchmark"))
    stiffness = 110 / DEGREE
    model = build(settings.bicycle, Setup(None, 0.0), [stiffness, length, stiffness, length])
    found = named_speeds(critical_speeds(model))
    assert found["wobble unstable above"] == pytest.approx(speed, abs=0.05)


def test_model_is_the_one_put_together_by_hand(study):
    setup, case = study.settings.setups[-1], study.cases[0]
    front, bicycle = setup.front, study.settings.bicycle
    v, (rear_load, front_load) = bicycle.values, bicycle.static_loads
    by_hand = Model(
        bicycle,
        (
            effect_class("relaxation_length")(
                cornering_stiffness={"rear": case.contact[0], "front": case.contact[2]},
                relaxation_length={"rear": case.contact[1], "front": case.contact[3]},
            ),
            effect_class("camber_thrust")(camber_stiffness={"rear": 0.8 * rear_load, "front": 0.8 * front_load}),
            effect_class("front_compliance")(
                stiffness=front.stiffness, damping=front.damping, axis_tilt=v["lam"], joint_z=-front.joint_height,
                joint_x=v["w"] + v["c"] - front.joint_height * np.tan(v["lam"]),
            ),
        ),
    ).linear_model()  # fmt: skip
    assert build(bicycle, setup, case.contact).eigenvalues(7.0) == pytest.approx(by_hand.eigenvalues(7.0))


def unstable_above_3_hz(model, speed) -> int:
    values = model.eigenvalues(speed)
    return int(((values.real > 0) & (values.imag > 3 * 2 * np.pi)).sum())


def test_band_edges_are_where_the_eigenvalues_lose_and_regain_stability(study):
    setup = study.settings.setups[-1]
    for result in study.of(setup):
        model = build(study.settings.bicycle, setup, result.case.contact)
        (band,) = result.bands("wobble")
        for edge, inside in ((band.start, 0.01), (band.end, -0.01)):
            assert unstable_above_3_hz(model, edge.speed + inside) == 1
            assert unstable_above_3_hz(model, edge.speed - inside) == 0


def test_parts_of_a_change_by_varying_one_and_holding_the_other(study):
    setup = study.settings.setups[-1]
    decomposition = study.decomposition(setup, "Tyre1 drum")
    high, low = decomposition.higher.contact, decomposition.lower.contact
    change = decomposition.change("wobble stable above")

    def last_edge(contact) -> float:
        model = build(study.settings.bicycle, setup, contact)
        inside, outside = 12.0, 40.0
        for _ in range(40):
            middle = (inside + outside) / 2
            inside, outside = (middle, outside) if unstable_above_3_hz(model, middle) else (inside, middle)
        return inside

    before = last_edge(high)
    assert change.before == pytest.approx(before, abs=1e-6)
    assert change.length_part == pytest.approx(last_edge([high[0], low[1], high[2], low[3]]) - before, abs=1e-6)
    assert change.stiffness_part == pytest.approx(last_edge([low[0], high[1], low[2], high[3]]) - before, abs=1e-6)
    assert change.total == pytest.approx(last_edge(low) - before, abs=1e-6)
    assert change.stiffness_part + change.length_part + change.interaction == pytest.approx(change.total)


def test_capsize_speed_does_not_depend_on_the_relaxation_length(study):
    for decomposition in study.decompositions:
        change = decomposition.change("capsize unstable above")
        assert abs(change.length_part) < 1e-8
        assert abs(change.stiffness_part) > 1e-4


def test_damping_decomposition_ends_at_the_damping_of_the_results(study):
    for setup in study.settings.setups:
        for name in study.names:
            low, high = study.of(setup, name)[0], study.of(setup, name)[-1]
            for mode in ("wobble", "weave"):
                change = study.decomposition(setup, name).change(mode, DAMPING)
                assert change.before == pytest.approx(high.damping[mode].value)
                assert change.after == pytest.approx(low.damping[mode].value)


@pytest.mark.parametrize("name", ["Tyre1 flat", "Tyre2 flat"])
def test_uncertainty_against_monte_carlo(study, name):
    setup = study.settings.setups[-1]
    result = study.of(setup, name)[1]
    case, speed = result.case, study.settings.report_speed
    end = result.bands("wobble")[0].end
    random = np.random.default_rng(7)
    samples = random.multivariate_normal(case.contact, case.covariance, 400)
    around = end.speed + np.linspace(-4, 4, 17) * end.sd
    start = nearest(build(study.settings.bicycle, setup, case.contact), speed, complex(*_wobble(result)))
    damping, ends = [], []
    for contact in samples:
        model = build(study.settings.bicycle, setup, contact)
        damping.append(damping_ratio(nearest(model, speed, start)))
        values = model.eigenvalues(around)
        real = np.take_along_axis(
            values, np.argmin(np.abs(values - 2j * np.pi * end.frequency_hz), axis=1)[:, None], 1
        ).real
        ends.append(np.interp(0.0, -real[:, 0], around))
    assert result.damping["wobble"].sd == pytest.approx(np.std(damping), rel=0.12)
    assert end.sd == pytest.approx(np.std(ends), rel=0.12)
    assert end.speed == pytest.approx(np.mean(ends), abs=0.3 * end.sd)


def test_sd_of_the_bicycle_moves_loads_tyre_camber_thrust_and_hinge_with_it():
    """Central differences over everything built anew: another bicycle, its loads, its tyre, its camber thrust."""
    sd = {"w": 0.002, "c": 0.0016, "mB": 2.0, "xB": 0.01, "lam": 0.003, "IFyy": 0.001}
    plain = load_bicycle("pista_rider_drops")
    settings = Settings(Bicycle("with sd", plain.values, sd), speeds=np.linspace(0, 30, 3))
    assert settings.uncertain == "tyre data and bicycle parameters"
    setup = settings.setups[-1]

    def chosen_case(bicycle):
        return next(c for c in tyre_cases(bicycle) if (c.name, c.pressure_bar) == ("Tyre1 drum", 5.5))

    def quantities(bicycle, contact):
        found = build(bicycle, setup, contact)
        eigenvalue = nearest(found, 15.0, start)
        speeds = named_speeds(critical_speeds(found))
        return np.array([speeds["wobble stable above"], speeds["weave stable above"], damping_ratio(eigenvalue),
                         eigenvalue.imag / (2 * np.pi)])  # fmt: skip

    case = chosen_case(settings.bicycle)
    result = solve(settings, case, setup)
    start = complex(*_wobble(result))
    variance = np.zeros(4)
    for key, one in sd.items():
        moved = [plain.replace(**{key: plain[key] + sign * 0.05 * one}) for sign in (1, -1)]
        ends = [quantities(bicycle, chosen_case(bicycle).contact) for bicycle in moved]
        variance += ((ends[0] - ends[1]) / 0.1) ** 2
    steps = np.diag(1e-4 * case.contact)
    slopes = np.array(
        [(quantities(plain, case.contact + h) - quantities(plain, case.contact - h)) / (2 * h.sum()) for h in steps]
    )
    tyre = np.diag(slopes.T @ case.covariance @ slopes)
    edge = {c.mode + c.direction: c for c in result.crossings}
    found = (edge["wobblestabilising"], edge["weavestabilising"], result.damping["wobble"], result.frequency["wobble"])
    assert [one.tyre_sd for one in found] == pytest.approx(np.sqrt(tyre), rel=1e-5)
    assert [one.sd for one in found] == pytest.approx(np.sqrt(tyre + variance), rel=1e-4)
    assert all(one.sd > 1.02 * one.tyre_sd for one in found)


def test_covariance_of_the_random_bicycles_is_that_of_the_tyre_map(study):
    setup = study.settings.setups[-1]
    for case in study.cases[::4]:
        names, covariance = uncertainty(study.settings, case, setup).covariance()
        order = [names.index(name) for name in CONTACT]
        scale = np.sqrt(np.diag(case.covariance))
        assert len(names) == 4
        np.testing.assert_allclose(
            covariance[np.ix_(order, order)] / np.outer(scale, scale), case.covariance / np.outer(scale, scale),
            atol=1e-6,
        )  # fmt: skip


def test_checks_take_the_most_uncertain_cases_and_the_same_linear_sd(study):
    first, last = study.settings.setups[0], study.settings.setups[-1]
    assert [one.result.setup for one in study.checks] == [first] + [last] * len(study.names)
    for one in study.checks:
        rivals = study.of(one.result.setup, None if one.result.setup == first else one.result.case.name)
        relative = [max([c.sd / c.speed for c in r.crossings if c.mode == "wobble"], default=0) for r in rivals]
        assert one.result is rivals[int(np.argmax(relative))]
        found = {q.name: q for q in one.quantities}
        known = {f"wobble {what} at 15 m/s": part["wobble"].sd for what, part in (
            ("frequency", one.result.frequency), ("damping ratio", one.result.damping))}  # fmt: skip
        known |= {name: c.sd for c in one.result.crossings for name in named_speeds([c]) if c.mode == "wobble"}
        assert {name: q.linear_sd for name, q in found.items()} == pytest.approx(known, rel=1e-6)
        assert all(len(q.samples) == study.settings.samples and not q.lost for q in found.values())
        if one.result.case.name == "Tyre1 flat" and one.result.setup == last:  # the tyre measured best
            assert max(abs(excess(q)) for q in found.values()) < 0.02


def _wobble(result):
    value = result.modes.branch("wobble")[-1, 0]
    return value.real, value.imag


def test_camber_thrust_is_shown_without_and_with(study):
    assert [(s.front_name, s.camber_share) for s in study.settings.setups] == [
        ("rigid", 0.0), ("rigid", 0.8), ("flexible", 0.0), ("flexible", 0.8)
    ]  # fmt: skip
    assert all(("assumed" in s.label) == (s.camber_share > 0 or s.front is not None) for s in study.settings.setups)


def test_bands_open_at_both_ends():
    def crossing(speed, direction):
        return Crossing("weave", "oscillatory", direction, speed, 0.1, 0.1, 1.0)

    first, second, third = crossing(4.0, "stabilising"), crossing(9.0, "destabilising"), crossing(5.0, "destabilising")
    assert [(b.start, b.end) for b in unstable_bands([second, first], "weave")] == [(None, first), (second, None)]
    assert unstable_bands([first], "wobble") == []
    assert [(b.start, b.end) for b in unstable_bands([third], "weave")] == [(third, None)]


def test_tables_are_tidy_and_agree(study):
    found = tables(study)
    assert list(found) == [
        "tyre_properties", "eigenvalues", "damping_ratios", "critical_speeds", "decomposition_damping_ratio",
        "decomposition_critical_speed", "other_fronts", "monte_carlo",
    ]  # fmt: skip
    assert len(found["tyre_properties"]) == 2 * 9
    assert {"load_N", "relaxation_length_mm", "cornering_stiffness_N_per_deg", "origin"} < set(found["tyre_properties"])
    assert {"speed_m_s", "real_1_per_s", "imaginary_rad_per_s", "frequency_Hz"} < set(found["eigenvalues"])
    parts = found["decomposition_critical_speed"]
    summed = parts[[c for c in parts if c.endswith("part_m_s")]].sum(axis=1) + parts["interaction_m_s"]
    assert summed.to_numpy() == pytest.approx(parts["total_change_m_s"].to_numpy())
    assert not found["critical_speeds"]["extrapolated"].any()


def test_every_eigenvalue_is_in_the_table_once(study):
    table = tables(study)["eigenvalues"]
    case, setup = study.cases[4], study.settings.setups[2]
    mine = table[
        (table["tyre"] == case.tyre) & (table["surface"] == case.surface) & (table["pressure_bar"] == case.pressure_bar)
        & (table["front"] == setup.front_name) & (table["camber_stiffness_over_load_per_rad"] == setup.camber_share)
        & (table["speed_m_s"] == 10.0)
    ]  # fmt: skip
    upper = build(study.settings.bicycle, setup, case.contact).eigenvalues(10.0)
    upper = np.sort_complex(upper[upper.imag >= 0])
    found = np.sort_complex(mine["real_1_per_s"].to_numpy() + 1j * mine["imaginary_rad_per_s"].to_numpy())
    assert found == pytest.approx(upper, rel=1e-9)


def test_extrapolated_tyre_values_are_marked_in_tables_and_figure(heavy):
    from matplotlib.figure import Figure

    assert all(case.extrapolated for case in heavy.cases)
    for name, table in tables(heavy).items():
        if name == "tyre_properties":
            assert (table["origin"] == "extrapolated").all()
        else:
            assert table["extrapolated"].all(), name
    axes = Figure().add_subplot()
    draw_bands(axes, heavy, heavy.settings.setups[-1])
    assert any("hatched: tyre values extrapolated" in text.get_text() for text in axes.texts)
    assert sum(bool(patch.get_hatch()) for patch in axes.patches) == len(heavy.cases)


@pytest.fixture
def canvases(monkeypatch):
    """The figures that are drawn, instead of files."""
    from contextlib import contextmanager

    from matplotlib.figure import Figure

    from studies.main_study import figure_critical_speeds, figure_eigenvalues, figure_headline, figure_speed_locus

    drawn = []

    @contextmanager
    def drawing(target, *, width, height):
        drawn.append(Figure(figsize=(width, height)))
        yield drawn[-1]

    for module in (figure_critical_speeds, figure_eigenvalues, figure_headline, figure_speed_locus):
        monkeypatch.setattr(module, "drawing", drawing)
    return drawn


def test_no_unstable_wobble_in_any_case_leaves_no_empty_parts(heavy, canvases, tmp_path):
    flexible = heavy.settings.setups[-1]
    assert not any(r.bands("wobble") for r in heavy.of(flexible))
    draw_headline(heavy, [flexible], tmp_path / "f")
    (figure,) = canvases
    (axes,) = figure.axes
    assert figure.get_suptitle() == "No unstable wobble on any measured tyre: benchmark, with an assumed flexible front"
    assert axes.get_title(loc="left") + axes.get_title() == f"No unstable wobble in any case: {flexible.label}"
    texts = [text.get_text() for text in axes.texts]
    assert not any("pale ends" in text or "not at both pressures" in text for text in texts)


def test_headline_says_that_the_front_is_assumed(study, canvases, tmp_path):
    draw_headline(study, [study.settings.setups[-1]], tmp_path / "f")
    assert canvases[0].get_suptitle().endswith("pista_rider_drops, with an assumed flexible front")
    bands, parts = canvases[0].axes
    assert "pale ends" in bands.texts[-1].get_text()
    assert "unstable (filled)" not in bands.texts[-1].get_text()  # weave of this bicycle stays stable
    assert parts.get_xlabel() == "Change of speed, m/s"


def test_frequency_curves_reach_zero_where_a_pair_splits(study, canvases, tmp_path):
    """Weave comes out of two real roots near 0.7 m/s; its frequency must start from zero there."""
    setup = study.settings.setups[-1]
    (meeting,) = (e.speed for e in study.of(setup)[0].modes.events if e.kind == "merge" and e.modes == ("weave",))
    draw_eigenvalues(study, setup, tmp_path / "f")
    real, frequency = canvases[0].axes[0], canvases[0].axes[len(study.names)]
    assert frequency.get_ylabel() == "Frequency, Hz"
    assert real.get_ylabel().startswith("Real part, 1/s")
    starts = []
    for line in frequency.lines:
        speeds, values = (
            line.get_xdata()[np.isfinite(line.get_ydata())],
            line.get_ydata()[np.isfinite(line.get_ydata())],
        )
        if line.get_color() == mode_look("weave").colour and line.get_marker() == mode_look("weave").marker:
            starts.append((speeds[0], values[0]))
    assert any(speed == pytest.approx(meeting, abs=1e-6) and abs(hertz) < 1e-3 for speed, hertz in starts)


def test_modes_are_told_apart_without_colour(study, canvases, tmp_path):
    draw_eigenvalues(study, study.settings.setups[-1], tmp_path / "f")
    (legend,) = canvases[0].legends
    marks = {
        text.get_text(): handle.get_marker() for text, handle in zip(legend.texts, legend.legend_handles, strict=True)
    }
    modes = {name: mark for name, mark in marks.items() if "bar" not in name and " or " not in name}
    assert {"weave", "wobble", "capsize", "castering"} <= set(modes)
    assert len(set(modes.values())) == len(modes)


def test_joint_names_have_looks_of_their_own():
    joint = ("castering+rear_tyre", "castering+wobble", "weave+wobble", "capsize+rear_tyre+wobble")
    names = (*joint, "castering", "other_1", "other_2")
    looks = [tuple(mode_marker(name).values()) for name in names]
    assert len(set(looks)) == len(names)
    assert mode_words("castering+rear_tyre") == "castering or rear tyre"


def test_root_locus_shows_the_real_roots_and_every_pressure(study, canvases, tmp_path):
    setup = study.settings.setups[-1]
    draw_speed_locus(study, setup, tmp_path / "f")
    columns = len(study.names)
    plane, real = canvases[0].axes[0], canvases[0].axes[columns]
    assert {"weave", "capsize", "castering"} <= {label.get_text() for label in real.get_yticklabels()}
    (legend,) = canvases[0].legends
    assert [text.get_text() for text in legend.texts] == ["3.5 bar", "5.5 bar", "7.5 bar"]
    points = np.vstack([c.get_offsets() for c in plane.collections if len(c.get_offsets())])
    for result in study.of(setup, study.names[0]):
        capsize = result.modes.branch("capsize")[: len(study.settings.speeds), 0]
        assert (capsize.imag == 0).all()
        for value in capsize:
            assert np.abs(points - [value.real, 0.0]).max(axis=1).min() < 1e-9
    assert "front compliance" in plane.get_title(loc="right")  # too fast for the window, and said so


def test_critical_speeds_explain_hollow_marks_and_keep_modes_apart(study, canvases, tmp_path):
    draw_critical_speeds(study, tmp_path / "f")
    (legend,) = canvases[0].legends
    texts = [text.get_text() for text in legend.texts]
    assert any(text.startswith("hollow: becomes stable") for text in texts)
    hollow = legend.legend_handles[texts.index("hollow: becomes stable")]
    assert hollow.get_markerfacecolor() == "none"
    heights = {}
    for line in canvases[0].axes[-1].lines:  # flexible front: weave, capsize and both ends of unstable wobble
        if len(line.get_xdata()) == 1 and line.get_marker() not in ("", "None", "|"):
            heights.setdefault(line.get_color(), set()).add(round(float(line.get_ydata()[0]) % 1, 3))
    assert len(heights) == 3
    assert len(set.union(*heights.values())) == 3


def test_run_writes_figures_tables_and_report(tmp_path, monkeypatch, capsys):
    from studies import plotting

    monkeypatch.setattr(plotting, "STYLE", {**plotting.STYLE, "savefig.dpi": 20})
    monkeypatch.setattr(plotting, "FORMATS", ("png",))  # both are tested with the paper's figures
    quick = Settings(load_bicycle("pista_rider_drops"), np.linspace(0, 30, 5), camber_shares=(0.8,), max_speed=35.0)
    monkeypatch.setattr(Settings, "of", classmethod(lambda cls, name, tyres: quick))
    monkeypatch.setattr(main_study, "tyre_cases", one_tyre)
    main(["run", "--out", str(tmp_path / "new" / "out")])
    captured = capsys.readouterr()
    assert captured.out == f"report: {(tmp_path / 'new' / 'out' / 'report.html').as_posix()}\n"
    assert "velotyre run: 100%" in captured.err
    names = {file.name for file in (tmp_path / "new" / "out").iterdir()}
    figures = {
        "headline", "wobble_bands", "damping_ratio", "critical_speeds", "eigenvalues_1", "root_locus_2",
        *(f"paper_fig{n:02d}" for n in (1, 5, 6, 9, 10, 11, 12, 13, 14)),
    }  # fmt: skip
    assert {f"{name}.png" for name in figures} < names
    assert {"report.md", "report.html", "eigenvalues.csv", "critical_speeds.csv"} < names
    table = pd.read_csv(tmp_path / "new" / "out" / "critical_speeds.csv")
    assert set(table["mode"]) >= {"wobble", "weave", "capsize"}


def test_unknown_bicycle_is_refused_in_one_line(capsys, tmp_path):
    with pytest.raises(SystemExit) as stop:
        main(["run", "--bicycle", "benchmrk", "--out", str(tmp_path)])
    assert stop.value.code == 2
    error = capsys.readouterr().err
    assert error.startswith("velotyre: unknown bicycle 'benchmrk'; did you mean 'benchmark'?")
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("out", ["", "  ", "a\0b"])
def test_a_folder_without_a_name_is_refused(out, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stop:
        main(["run", "--out", out])
    assert stop.value.code == 2
    error = capsys.readouterr().err
    assert "is no folder name; give a folder to write into, for example out" in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_file_in_place_of_the_folder_is_refused(capsys, tmp_path):
    (tmp_path / "taken").write_text("mine")
    with pytest.raises(SystemExit) as stop:
        main(["run", "--out", str(tmp_path / "taken")])
    assert stop.value.code == 2
    assert "taken' is a file; give a folder to write into" in capsys.readouterr().err
