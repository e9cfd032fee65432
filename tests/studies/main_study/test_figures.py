"""The figures show what the study found, and explain the marks that are there."""

from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from small_study import chosen, own_table, small

from studies.main_study import (
    figure_critical_speeds,
    figure_damping,
    figure_eigenvalues,
    figure_headline,
    figure_speed_locus,
)
from studies.main_study.figure_critical_speeds import draw_critical_speeds
from studies.main_study.figure_damping import draw_damping
from studies.main_study.figure_eigenvalues import draw_eigenvalues
from studies.main_study.figure_headline import draw_bands, draw_headline
from studies.main_study.figure_speed_locus import draw_speed_locus
from studies.main_study.settings import Settings
from studies.main_study.study import run_study
from studies.reporting.plotting import mode_look, mode_marker, mode_words


@pytest.fixture
def canvases(monkeypatch):
    """The figures that are drawn, instead of files."""
    drawn = []

    @contextmanager
    def drawing(target, *, width, height):
        drawn.append(Figure(figsize=(width, height)))
        yield drawn[-1]

    modules = (figure_critical_speeds, figure_damping, figure_eigenvalues, figure_headline, figure_speed_locus)
    for module in modules:
        monkeypatch.setattr(module, "drawing", drawing)
    return drawn


def texts(axes) -> str:
    return "\n".join(text.get_text() for text in axes.texts)


def test_bars_of_the_headline_are_the_bands(racing, canvases, tmp_path):
    reference = racing.settings.reference
    draw_headline(racing, reference, tmp_path / "f")
    bands, parts = canvases[0].axes
    assert canvases[0].get_suptitle() == "Where wobble is unstable: pista_charlie_drops"
    assert bands.get_title(loc="left") + bands.get_title() == "Unstable wobble: hands off, flexible front (assumed)"
    bars = [(p.get_x(), p.get_x() + p.get_width()) for p in bands.patches if p.get_alpha() == 0.85]
    spans = [r.span(30.0) for r in racing.of(reference)]
    np.testing.assert_allclose(bars, [(span.low, min(span.high, 30.0)) for span in spans])
    assert "pale ends" in texts(bands)
    assert "weave becomes stable (hollow)" in texts(bands)
    assert "unstable (filled)" not in texts(bands)  # weave of this bicycle stays stable
    assert "6 random bicycles" in texts(bands)
    assert "hatched" not in texts(bands)
    without = [p.without for p in racing.plausible[:5] if p.without]
    assert [text.get_text() for text in bands.texts if "without" in text.get_text()] == [
        f"{n} without" for n in without
    ]  # fmt: skip
    assert parts.get_xlabel() == "Change of speed, m/s"
    assert "from 7.5 bar to 3.5 bar" in parts.get_title(loc="left") + parts.get_title()


def test_no_unstable_wobble_in_any_case_leaves_no_empty_parts(heavy, canvases, tmp_path):
    draw_headline(heavy, heavy.settings.reference, tmp_path / "f")
    (figure,) = canvases
    (axes,) = figure.axes
    assert figure.get_suptitle() == "No unstable wobble on any tyre studied: benchmark"
    assert (axes.get_title(loc="left") + axes.get_title()).startswith("No unstable wobble in any case up to 30 m/s: ")
    assert "pale ends" not in texts(axes)
    assert "not at both pressures" not in texts(axes)


def test_a_band_beyond_the_speeds_looked_at_is_not_promised(racing, canvases, tmp_path):
    """Rigid fronts: wobble grows above 30 m/s only."""
    rigid = racing.settings.setups[2]
    assert any(c.mode == "wobble" and c.speed > 30 for r in racing.of(rigid) for c in r.crossings)
    draw_headline(racing, rigid, tmp_path / "f")
    assert canvases[0].get_suptitle().startswith("No unstable wobble on any tyre studied")


def test_extrapolated_tyre_values_are_hatched(heavy):
    axes = Figure().add_subplot()
    draw_bands(axes, heavy, heavy.settings.reference)
    assert "hatched: tyre values extrapolated" in texts(axes)
    assert sum(bool(patch.get_hatch()) for patch in axes.patches) == len(heavy.cases)


def test_frequency_curves_reach_zero_where_a_pair_splits(racing, canvases, tmp_path):
    """Weave comes out of two real roots; its frequency must start from zero there."""
    setup = racing.settings.reference
    meetings = [e.speed for e in racing.of(setup)[0].modes.events if e.kind == "merge" and e.modes == ("weave",)]
    draw_eigenvalues(racing, setup, tmp_path / "f")
    real, frequency = canvases[0].axes[0], canvases[0].axes[len(racing.names)]
    assert frequency.get_ylabel() == "Frequency, Hz"
    assert real.get_ylabel().startswith("Real part, 1/s")
    starts = []
    for line in frequency.lines:
        there = np.isfinite(line.get_ydata())
        if line.get_color() == mode_look("weave").colour and line.get_marker() == mode_look("weave").marker:
            starts.append((line.get_xdata()[there][0], line.get_ydata()[there][0]))
    assert len(meetings) == 1
    assert any(speed == pytest.approx(meetings[0], abs=1e-6) and abs(hertz) < 1e-3 for speed, hertz in starts)


def test_modes_are_told_apart_without_colour(racing, canvases, tmp_path):
    draw_eigenvalues(racing, racing.settings.reference, tmp_path / "f")
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


def test_root_locus_shows_the_real_roots_and_every_pressure(racing, canvases, tmp_path):
    setup = racing.settings.reference
    draw_speed_locus(racing, setup, tmp_path / "f")
    columns = len(racing.names)
    plane, real = canvases[0].axes[0], canvases[0].axes[columns]
    assert {"weave", "capsize", "castering"} <= {label.get_text() for label in real.get_yticklabels()}
    (legend,) = canvases[0].legends
    assert [text.get_text() for text in legend.texts] == ["3.5 bar", "5.5 bar", "7.5 bar"]
    points = np.vstack([c.get_offsets() for c in plane.collections if len(c.get_offsets())])
    for result in racing.of(setup, racing.names[0]):
        capsize = result.modes.branch("capsize")[: len(racing.settings.speeds), 0]
        seen = capsize[(capsize.imag == 0) & (capsize.real > -60)]
        assert len(seen)
        for value in seen:
            assert np.abs(points - [value.real, 0.0]).max(axis=1).min() < 1e-9
    assert "front compliance" in plane.get_title(loc="right")  # too fast for the window, and said so


def test_critical_speeds_explain_hollow_marks_and_keep_modes_apart(racing, canvases, tmp_path):
    draw_critical_speeds(racing, tmp_path / "f")
    (legend,) = canvases[0].legends
    words = [text.get_text() for text in legend.texts]
    assert any(text.startswith("hollow: becomes stable") for text in words)
    hollow = legend.legend_handles[words.index("hollow: becomes stable")]
    assert hollow.get_markerfacecolor() == "none"
    panels = {axes.get_title(): axes for axes in canvases[0].axes}
    assert list(panels) == [setup.label for setup in racing.settings.setups]
    heights = {}
    for line in panels["hands off, flexible front"].lines:  # weave, capsize and both ends of unstable wobble
        if len(line.get_xdata()) == 1 and line.get_marker() not in ("", "None", "|"):
            heights.setdefault(line.get_color(), set()).add(round(float(line.get_ydata()[0]) % 1, 3))
    assert len(heights) == 3
    assert len(set.union(*heights.values())) == 3


def test_a_case_that_could_not_be_computed_leaves_its_row_empty(racing, canvases, tmp_path):
    setup = racing.settings.reference
    gone = racing.of(setup)[0]
    study = replace(racing, results=tuple(r for r in racing.results if r is not gone))
    draw_critical_speeds(study, tmp_path / "f")
    axes = canvases[0].axes[0]
    assert axes.get_yticklabels()[0].get_text() == "Tyre1 flat, 3.5 bar"
    rows = {round(float(line.get_ydata()[0])) for line in axes.lines if line.get_marker() not in ("", "None", "|")
            and len(line.get_xdata()) == 1}  # fmt: skip
    assert rows == {1, 2, 3, 4}


def test_damping_against_pressure_is_that_of_the_results(racing, canvases, tmp_path):
    draw_damping(racing, tmp_path / "f")
    wobble = canvases[0].axes[0]
    assert wobble.get_ylabel() == "Wobble: damping ratio"
    lines = {line.get_label(): line.get_xydata() for line in wobble.lines if not line.get_label().startswith("_")}
    for name in racing.names:
        expected = [
            [r.case.pressure_bar, r.damping["wobble"].value] for r in racing.of(racing.settings.reference, name)
        ]
        np.testing.assert_allclose(lines[name], expected)
    assert [tick.get_text() for tick in canvases[0].axes[-1].get_xticklabels()] == ["3.5", "5.5", "7.5"]


@pytest.fixture
def one_world(monkeypatch):
    """The world of the first sentence alone."""
    monkeypatch.setattr(Settings, "setups", property(lambda self: (self.reference,)))


def test_own_tyres_are_drawn_beside_the_packaged_ones(one_world, canvases, tmp_path):
    own = own_table(tmp_path, pressures=(3.5, 7.5))
    settings = small(tyres=(str(own),), pressures=(3.5, 5.0), fronts=2, samples=20, speeds=np.linspace(0, 30, 7))
    wanted = {"Mine (synthetic) flat": (3.5, 5.0), "Tyre3 flat": (3.5,)}
    study = run_study(settings, cases=chosen(settings, wanted))
    for draw in (draw_eigenvalues, draw_speed_locus):
        draw(study, settings.reference, tmp_path / "f")
        (legend,) = canvases[-1].legends
        assert [text.get_text() for text in legend.texts if "bar" in text.get_text()] == ["3.5 bar", "5 bar"]
        assert "Mine (synthetic)\nflat" in [axes.get_title() for axes in canvases[-1].axes]


def test_a_tyre_without_a_pressure_is_drawn(one_world, canvases, tmp_path):
    numbers = {"cornering_stiffness": 6000.0, "relaxation_length": 0.12}
    settings = small(contact=numbers, fronts=2, samples=20, speeds=np.linspace(0, 30, 4))
    study = run_study(settings, cases=chosen_given(settings))
    draw_headline(study, settings.reference, tmp_path / "f")
    draw_damping(study, tmp_path / "f")
    draw_critical_speeds(study, tmp_path / "f")
    draw_eigenvalues(study, settings.reference, tmp_path / "f")
    draw_speed_locus(study, settings.reference, tmp_path / "f")
    assert "as given" in [label.get_text() for label in canvases[0].axes[0].get_yticklabels()]


def chosen_given(settings):
    """The tyre of the model file alone."""
    from studies.main_study.cases import Cases, tyre_cases

    return Cases(tyre_cases(settings).found[:1], ())
