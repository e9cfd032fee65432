"""The redrawn figures of the paper show what its tables print."""

import numpy as np
import pytest

from studies.cli import main
from studies.paper_audit import draw_paper_figure


def lines(figure) -> dict[str, np.ndarray]:
    """Label -> points of each curve."""
    (axes,) = figure.axes
    return {c.get_label(): c.lines[0].get_xydata() for c in axes.containers}


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


def test_the_audit_draws_them_where_it_is_told(tmp_path, no_pictures):
    main(["tyre", "audit", "--out", str(tmp_path / "a.md"), "--figures", str(tmp_path / "figures")])
    names = {file.name for file in (tmp_path / "figures").glob("*.png")}
    assert names == {f"paper_fig{number:02d}.png" for number in (1, 5, 6, 9, 10, 11, 12, 13, 14)}
