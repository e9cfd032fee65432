"""The figures show what the study found and what the paper prints, and explain the marks that are there."""

from contextlib import contextmanager

import numpy as np
import pytest
from matplotlib.figure import Figure
from small_study import small

from studies.main_study import (
    Cases,
    Settings,
    draw_critical_speeds,
    draw_damping,
    draw_headline,
    draw_paper_figure,
    run_study,
    tyre_cases,
)


@pytest.fixture
def canvases(monkeypatch):
    """The figures that are drawn, instead of files."""
    drawn = []

    @contextmanager
    def drawing(target, *, width, height):
        drawn.append(Figure(figsize=(width, height)))
        yield drawn[-1]

    monkeypatch.setattr("studies.reporting.plotting.drawing", drawing)
    return drawn


def lines(figure) -> dict[str, np.ndarray]:
    """Label -> points of each curve."""
    (axes,) = figure.axes
    return {c.get_label(): c.lines[0].get_xydata() for c in axes.containers}


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


def test_a_band_beyond_the_speeds_looked_at_is_not_promised(racing, canvases, tmp_path):
    """Rigid fronts: wobble grows above 30 m/s only."""
    rigid = racing.settings.setups[2]
    assert any(c.mode == "wobble" and c.speed > 30 for r in racing.of(rigid) for c in r.crossings)
    draw_headline(racing, rigid, tmp_path / "f")
    assert canvases[0].get_suptitle().startswith("No unstable wobble on any tyre studied")


def test_extrapolated_tyre_values_are_hatched(heavy, canvases, tmp_path):
    draw_headline(heavy, heavy.settings.reference, tmp_path / "f")
    axes = canvases[0].axes[0]
    assert "hatched: tyre values extrapolated" in texts(axes)
    assert sum(bool(patch.get_hatch()) for patch in axes.patches) == len(heavy.cases)


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
def one_world(monkeypatch, results_alone):
    """The world of the first sentence alone."""
    monkeypatch.setattr(Settings, "setups", property(lambda self: (self.reference,)))


def test_a_tyre_without_a_pressure_is_drawn(one_world, canvases, tmp_path):
    numbers = {"cornering_stiffness": 6000.0, "relaxation_length": 0.12}
    settings = small(contact=numbers, fronts=2, samples=20, speeds=np.linspace(0, 30, 4))
    study = run_study(settings, cases=Cases(tyre_cases(settings).found[:1], ()))
    draw_headline(study, settings.reference, tmp_path / "f")
    draw_damping(study, tmp_path / "f")
    draw_critical_speeds(study, tmp_path / "f")
    assert "as given" in [label.get_text() for label in canvases[0].axes[0].get_yticklabels()]


def test_relaxation_length_figure_shows_the_table_with_3_mm(canvases, tmp_path):
    draw_paper_figure(tmp_path / "paper_fig13")
    found = lines(canvases[0])
    assert found["Tyre1 flat, 3.5 bar"][:, 1] == pytest.approx([134.0, 141.5, 140.9])  # Table 6
    assert found["Tyre2 flat, 5.5 bar"][:, 1] == pytest.approx([121.1, 81.7, 82.1])  # Table 8
    assert found["Tyre1 flat, 3.5 bar"][:, 0] == pytest.approx([340, 400, 490])
    assert found["Tyre2 flat, 5.5 bar"][:, 0] == pytest.approx([342, 402, 492])
    for container in canvases[0].axes[0].containers:
        (bars,) = container.lines[2]
        assert [np.ptp(s[:, 1]) / 2 for s in bars.get_segments()] == pytest.approx(3 * [3.0], abs=0.2)
    assert canvases[0].get_supxlabel().startswith("Redrawn from Tables 6 and 8 of Dell'Orto")


def test_lateral_stiffness_is_cornering_stiffness_over_relaxation_length(canvases, tmp_path):
    draw_paper_figure(tmp_path / "paper_fig06")
    printed = np.degrees([103.6, 111.5, 120.0]) / [187.3, 192.2, 198.5]  # Tables 5 and 9, 3.5 bar: N/rad over mm
    assert lines(canvases[0])["Tyre3 flat, 3.5 bar"][:, 1] == pytest.approx(printed)
    assert "cornering stiffness over relaxation length" in canvases[0].get_supxlabel()


def test_saved_figures_do_not_differ_between_runs(tmp_path):
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        draw_paper_figure(tmp_path / folder / "paper_fig05")
    for suffix in ("png", "svg"):
        assert (tmp_path / "a" / f"paper_fig05.{suffix}").read_bytes() == (
            tmp_path / "b" / f"paper_fig05.{suffix}"
        ).read_bytes()
