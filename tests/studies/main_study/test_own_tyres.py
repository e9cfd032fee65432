"""Tyre tables of the user in the main study, beside the packaged ones."""

from dataclasses import replace

import numpy as np
import pytest

from bicycle import load_bicycle
from studies.cli import main
from studies.main_study import cases, figure_eigenvalues, figure_speed_locus
from studies.main_study.cases import Settings, tyre_cases
from studies.main_study.study import run_study
from studies.main_study.tables import tables
from tyre import TyreMap
from tyre.errors import InputError


@pytest.fixture
def own(tmp_path):
    """Tyre3 under another name, said to be synthetic and to have been measured at 5.0 in place of 5.5 bar."""
    file = tmp_path / "own.csv"
    TyreMap.load("Tyre3").to_file(file)
    rows = [row.split(",") for row in file.read_text().splitlines()]
    file.write_text("\n".join(",".join([row[0], row[1].replace("5.5", "5.0"), *row[2:]]) for row in rows))
    sidecar = file.with_suffix(".toml")
    sidecar.write_text(
        sidecar.read_text().replace('"Tyre3"', '"Mine"').replace("synthetic = false", "synthetic = true")
    )
    return file


def test_a_table_is_a_case_like_the_packaged_ones(own):
    bicycle = load_bicycle("pista_rider_drops")
    found = [case for case in tyre_cases(bicycle, [str(own)]) if case.tyre.startswith("Mine")]
    like = [case for case in tyre_cases(bicycle) if case.name == "Tyre3 flat"]
    assert [case.name for case in found] == ["Mine (synthetic) flat"] * 3
    assert [case.pressure_bar for case in found] == [3.5, 5.0, 7.5]
    for one, other in zip(found[::2], like[::2], strict=True):  # 3.5 and 7.5 bar; between the loads the trend is fitted
        np.testing.assert_allclose(one.contact, other.contact, rtol=0.01)
        assert abs(one.contact[0] / one.contact[2] - 1) > 0.02  # rear and front are not alike


def test_figures_and_tables_show_every_pressure_and_what_is_synthetic(own, tmp_path, monkeypatch):
    monkeypatch.setattr(cases, "available_tyres", lambda: {"Tyre3": ("flat",)})
    settings = Settings.of("pista_rider_drops", [str(own)])
    settings = replace(
        settings, speeds=np.linspace(0, 30, 7), camber_shares=(0.0,), front=settings.front, max_speed=30.0, samples=50
    )
    study = run_study(settings)
    assert study.pressures == [3.5, 5.0, 5.5, 7.5]
    legends, styles = {}, {}
    for module, draw in ((figure_eigenvalues, "draw_eigenvalues"), (figure_speed_locus, "draw_speed_locus")):
        drawn = module.drawing

        def keep(target, *, drawn=drawn, draw=draw, **size):
            return _Kept(drawn(target, **size), legends, styles, draw)

        monkeypatch.setattr(module, "drawing", keep)
        getattr(module, draw)(study, settings.setups[-1], tmp_path / draw)
        assert [text for text in legends[draw] if "bar" in text] == ["3.5 bar", "5 bar", "5.5 bar", "7.5 bar"]
        assert "Mine (synthetic)\nflat" in styles[draw]
    found = {name: set(table["tyre"]) for name, table in tables(study).items() if "tyre" in table}
    assert found["critical_speeds"] == {"Tyre3", "Mine (synthetic)"}
    assert set.union(*found.values()) == {"Tyre3", "Mine (synthetic)"}


class _Kept:
    """A drawing whose legend and titles are kept."""

    def __init__(self, drawing, legends, titles, name):
        self.drawing, self.legends, self.titles, self.name = drawing, legends, titles, name

    def __enter__(self):
        self.canvas = self.drawing.__enter__()
        return self.canvas

    def __exit__(self, *error):
        (legend,) = self.canvas.legends
        self.legends[self.name] = [text.get_text() for text in legend.texts]
        self.titles[self.name] = [axes.get_title(loc="left") for axes in self.canvas.axes]
        return self.drawing.__exit__(*error)


@pytest.mark.parametrize(
    ("tyre", "words"),
    [
        ("Tyre1", "tyre 'Tyre1' is no file of a tyre table"),
        ("none.csv", "none.csv"),
        ("twice", "there is another Mine flat"),
    ],
)
def test_tyres_that_are_refused(own, tmp_path, capsys, tyre, words):
    given = [str(own), str(own)] if tyre == "twice" else [str(tmp_path / tyre) if "." in tyre else tyre]
    with pytest.raises(InputError, match=words):
        tyre_cases(load_bicycle("benchmark"), given)
    with pytest.raises(SystemExit):
        main(["run", "--out", str(tmp_path / "out"), *(part for one in given for part in ("--tyre", one))])
    assert words in capsys.readouterr().err
