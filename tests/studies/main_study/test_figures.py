"""The figures show what the study found and what the paper prints, and explain the marks that are there."""

from itertools import pairwise

import numpy as np
import pytest
from small_study import small

from bicycle.stability import CrossingIdentity
from studies import main_study

EDGE = CrossingIdentity("wobble", destabilising=True)


def texts(axes) -> str:
    return "\n".join(text.get_text() for text in axes.texts)


def test_the_headline_shows_growth_with_relaxation_lengths_and_the_unstable_speeds(racing, canvases, tmp_path):
    reference = racing.settings.reference
    main_study.draw_headline(racing, tmp_path / "f")
    growth, bars = canvases[0].axes[:2]
    assert canvases[0].get_suptitle() == "A Pista track bicycle with a rider in the drops on Tyre1 flat"
    assert growth.get_title(loc="left") + growth.get_title() == (
        "Growth rate of wobble and weave, hands off, flexible front frame (assumed)"
    )
    results = racing.results_of(reference, "Tyre1 flat")
    drawn = [line for line in growth.lines if line.get_linestyle() == "-" and len(line.get_xdata()) > 2]
    for line, result in zip(drawn, results, strict=True):
        branch = result.modes.branch("wobble")[:-1, 0]
        np.testing.assert_array_equal(line.get_ydata()[1:], branch.real[1:])
    named = {text.get_text() for text in growth.get_legend().texts}
    assert named >= {f"{r.case.condition}, σ = {1e3 * r.case.contact[3]:.0f} mm" for r in results}
    assert named >= {"wobble", "weave", "unstable", "wobble of 90 % of the samples, 3.5 bar"}
    found = [(p.get_x(), p.get_x() + p.get_width()) for p in bars.patches if p.get_width() < 30]
    tense = racing.result(racing.settings.setups[2], results[0].case)
    spans = [results[0].wobble, results[-1].wobble, tense.wobble]
    np.testing.assert_allclose(found, [(span.low, min(span.high, 30.0)) for span in spans])
    shares = [f"{100 * one.wobbling_share:.0f} %" for one in racing.samples]
    calm = [f"no wobble; samples that wobble: {shares[k]} at 3.5 bar, {shares[k + 1]} at 7.5 bar" for k in (2, 6, 8)]
    assert texts(bars).splitlines() == [calm[0], "no wobble, 7.5 bar", *calm[1:]]  # the other cases


def test_the_causes_of_a_change_are_those_of_the_decomposition(racing, canvases, tmp_path):
    main_study.draw_causes(racing, tmp_path / "f")
    (axes,) = canvases[0].axes
    assert axes.get_xlabel() == "Change of speed, m/s"
    assert "wobble, 7.5 bar to 3.5 bar" in axes.get_title(loc="left") + axes.get_title()
    change = racing.decomposition(racing.settings.reference, "Tyre1 flat").change(EDGE)
    assert f"{change.total:+.1f}" in texts(axes).splitlines()


def test_extrapolated_tyre_values_are_hatched(heavy, canvases, tmp_path):
    main_study.draw_headline(heavy, tmp_path / "f")
    assert "hatched: tyre values extrapolated" in canvases[0].get_suptitle()
    assert sum(bool(patch.get_hatch()) for patch in canvases[0].axes[1].patches) == len(heavy.settings.setups)


def test_critical_speeds_explain_hollow_marks_and_keep_modes_apart(racing, canvases, tmp_path):
    main_study.draw_critical_speeds(racing, tmp_path / "f")
    (legend,) = canvases[0].legends
    words = [text.get_text() for text in legend.texts]
    assert any(text.startswith("hollow: becomes stable") for text in words)
    hollow = legend.legend_handles[words.index("hollow: becomes stable")]
    assert hollow.get_markerfacecolor() == "none"
    panels = {axes.get_title(): axes for axes in canvases[0].axes}
    assert list(panels) == [
        "hands off, flexible front frame (assumed)",
        "relaxed hands on (assumed), flexible front frame (assumed)",
        "tense hands on (assumed), flexible front frame (assumed)",
        "hands off, rigid front frame",
        "relaxed hands on (assumed), rigid front frame",
    ]
    heights = {}
    for line in panels[
        "hands off, flexible front frame (assumed)"
    ].lines:  # weave, capsize and both ends of unstable wobble
        if len(line.get_xdata()) == 1 and line.get_marker() not in ("", "None", "|"):
            heights.setdefault(line.get_color(), set()).add(round(float(line.get_ydata()[0]) % 1, 3))
    assert len(heights) == 3
    assert len(set.union(*heights.values())) == 3


def test_damping_against_pressure_is_that_of_the_results(racing, canvases, tmp_path):
    main_study.draw_damping(racing, tmp_path / "f")
    wobble = canvases[0].axes[0]
    assert wobble.get_ylabel() == "Wobble damping ratio"
    results = racing.results_of(racing.settings.reference, "Tyre1 flat")
    expected = [[r.case.pressure_bar, r.damping["wobble"].value] for r in results]
    np.testing.assert_allclose(wobble.lines[0].get_xydata(), expected)
    assert [tick.get_text() for tick in canvases[0].axes[-1].get_xticklabels()] == ["3.5", "5.5", "7.5"]


@pytest.fixture
def one_world(monkeypatch, results_alone):
    """The world of the first sentence alone."""
    monkeypatch.setattr(main_study.Settings, "setups", property(lambda self: (main_study.Setup(self.front),)))


def test_the_names_of_neighbouring_cases_do_not_touch(racing, canvases, tmp_path):
    main_study.draw_damping(racing, tmp_path / "f")
    canvases[0].draw_without_rendering()
    columns = canvases[0].axes[: len(racing.settings.setups)]
    titles = [title for axes in columns for title in (axes.title, axes._left_title) if title.get_text()]
    boxes = [title.get_window_extent() for title in titles]
    assert len(boxes) == len(columns)
    space = 0.02 * canvases[0].bbox.width / len(columns)
    assert all(left.x1 + space < right.x0 for left, right in pairwise(boxes))


def test_a_tyre_without_a_pressure_is_drawn(one_world, canvases, tmp_path):
    numbers = {"cornering_stiffness": 6000.0, "relaxation_length": 0.12}
    settings = small(contact=numbers, fronts=2, samples=20, speeds=np.linspace(0, 30, 4))
    study = main_study.run_study(settings, cases=main_study.Cases(main_study.tyre_cases(settings).studied[:1], ()))
    main_study.draw_headline(study, tmp_path / "f")
    main_study.draw_causes(study, tmp_path / "f")
    main_study.draw_damping(study, tmp_path / "f")
    main_study.draw_critical_speeds(study, tmp_path / "f")
    assert "as given, σ = 120 mm" in [text.get_text() for text in canvases[0].axes[0].get_legend().texts]


def test_the_amplitudes_are_those_of_both_ends_of_pressure(racing, canvases, tmp_path):
    main_study.draw_amplitude(racing, tmp_path / "f")
    (axes,) = canvases[0].axes
    bands = [band for band in axes.collections if band.get_alpha() == 0.15]
    for one, band in zip(racing.amplitudes, bands, strict=True):
        top = max(path.vertices[:, 1].max() for path in band.get_paths())
        assert top == pytest.approx(max(trace.amplitude.max() for trace in one.traces) / 0.8, rel=1e-9)  # D = 1
    assert [text.get_text() for text in canvases[0].legends[0].texts][:2] == ["3.5 bar", "7.5 bar"]
    assert (
        axes.get_title(loc="left") + axes.get_title()
        == "Steer amplitude of wobble, hands off, flexible front frame (assumed)"
    )
    assert axes.get_ylabel() == "Steer amplitude, °"
