"""Modes as a picture, a data frame and a dataset: nothing is lost and the units are there."""

import matplotlib
import numpy as np
import pandas as pd
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from bicycle import Model, load_bicycle
from bicycle.model import build_model
from bicycle.stability import UNITS, UNSTABLE, critical_speeds, mode_look, modes

SPEEDS = [0.5, 2.0, 5.5, 10.0, 30.5]
TYRE = {"relaxation_length": {"tyre": "Tyre1", "pressure_bar": 5.5}}


@pytest.fixture(params=["no_slip", "relaxation_length"])
def found(request):
    tables = TYRE if request.param == "relaxation_length" else {}
    return modes(build_model({"bicycle": "benchmark", "effects": tables}), SPEEDS)


def test_the_frame_holds_every_eigenvalue_with_its_unit(found):
    table = found.to_dataframe()
    assert list(table.columns) == list(UNITS)
    assert table.attrs["units"] == UNITS
    for speed, every in zip(found.speeds, found.eigenvalues, strict=True):
        rows = table[table["speed_m_s"] == speed]
        upper = every[every.imag >= 0]
        listed = rows["real_1_s"].to_numpy() + 1j * rows["imaginary_rad_s"].to_numpy()
        assert len(listed) == len(upper)
        assert all(np.abs(upper - z).min() < 1e-9 * (1 + abs(z)) for z in listed)
    assert np.allclose(table["frequency_Hz"], table["imaginary_rad_s"] / (2 * np.pi))
    pairs = table[table["imaginary_rad_s"] > 0]
    size = np.hypot(pairs["real_1_s"], pairs["imaginary_rad_s"])
    assert np.allclose(pairs["damping_ratio"], -pairs["real_1_s"] / size)


def test_the_dataset_has_units(found):
    dataset = found.to_xarray()
    assert dataset["eigenvalue"].attrs["units"] == "1/s"
    assert dataset["frequency"].attrs["units"] == "Hz"
    assert list(dataset["mode"].values) == list(found.names)


def test_critical_speeds_become_a_table_by_themselves():
    table = pd.DataFrame(critical_speeds(Model(load_bicycle("benchmark"))))
    assert list(table.columns) == ["speed", "kind", "mode", "frequency_hz", "direction", "bifurcation"]
    # Meijaard et al. (2007): weave 4.292 m/s, capsize 6.024 m/s
    assert np.allclose(table["speed"], [4.292, 6.024], atol=5e-4)


def test_the_picture_shows_every_mode_in_its_look(found):
    frequency, real = found.plot(Figure().subplots(2, 1))
    colours = {to_hex(line.get_color()) for line in real.lines}
    assert colours == {to_hex(mode_look(name).colour) for name in found.names}
    drawn = np.concatenate([line.get_ydata() for line in real.lines])
    expected = np.concatenate([values.real.ravel() for values in found.branches.values()])
    assert np.allclose(np.sort(drawn[~np.isnan(drawn)]), np.sort(expected[~np.isnan(expected)]))
    words = [text.get_text().removesuffix(" (out of view)") for text in frequency.get_legend().get_texts()]
    assert {"weave", "capsize", "castering"} <= set(words)
    assert len(words) == len(set(words))
    assert "Hz" in frequency.get_ylabel()
    assert "1/s" in real.get_ylabel()
    assert real.get_xlabel().startswith("Speed, m/s")


@pytest.mark.parametrize("relaxation", [{}, {"relaxation_length": 0.02}])  # with it what lies below is the fastest
def test_the_legend_says_which_modes_lie_below_the_picture(relaxation):
    tyre = {"relaxation_length" if relaxation else "side_slip": {"cornering_stiffness": 5000.0, **relaxation}}
    found = modes(build_model({"bicycle": "benchmark", "effects": tyre}), [4.37, 5.0])
    frequency, real = found.plot(Figure().subplots(2, 1))
    low = real.get_ylim()[0]
    seen = {line.get_label(): line.get_ydata().max() >= low for line in real.lines if line.get_label()[0] != "_"}
    assert {True, False} == set(seen.values())
    words = [text.get_text() for text in frequency.get_legend().get_texts()]
    assert words == [name if shown else f"{name} (out of view)" for name, shown in seen.items()]
    every = np.concatenate(found.eigenvalues)
    fastest = every[every.real >= low].imag.max() / (2 * np.pi)
    assert max(fastest, 0.5) <= frequency.get_ylim()[1] < 1.2 * max(fastest, 0.5)


def test_what_is_unstable_is_pale(found):
    frequency, real = found.plot(Figure().subplots(2, 1))
    drawn = real.patches[-1]  # a polygon up to matplotlib 3.8, a rectangle since
    band = drawn.get_patch_transform().transform_path(drawn.get_path()).get_extents()
    assert to_hex(real.patches[-1].get_facecolor()) == UNSTABLE
    assert (band.y0, band.y1) == (0, real.get_ylim()[1])
    pale = [line for line in frequency.lines if to_hex(line.get_color()) == UNSTABLE]
    shown = {
        (x, round(y, 9)) for line in pale for x, y in zip(*line.get_data(), strict=True) if not np.isnan(y)
    }  # fmt: skip
    unstable = {
        (v, round(z.imag / (2 * np.pi), 9))
        for v, row in zip(found.speeds, found.eigenvalues, strict=True) for z in row if z.real > 0 and z.imag > 0
    }  # fmt: skip
    assert shown == unstable
    assert unstable  # weave at 2 m/s


def test_extrapolated_tyres_are_hatched_and_measured_ones_are_not():
    for bicycle, beyond in (("benchmark", True), ("pista_charlie_drops", False)):
        found = modes(build_model({"bicycle": bicycle, "effects": TYRE}), [2.0, 5.0])
        frequency, real = found.plot(Figure().subplots(2, 1))
        assert [axes.patch.get_hatch() for axes in (frequency, real)] == (["//"] * 2 if beyond else [None] * 2)
        assert ("hatched: tyre values extrapolated" in real.get_xlabel()) == beyond


def test_a_single_speed_and_a_figure_of_its_own(monkeypatch):
    from matplotlib import pyplot

    frequency, real = modes(Model(load_bicycle("benchmark")), 5.0).plot()
    assert frequency.figure is real.figure
    assert matplotlib.get_backend().lower() == "agg"
    pyplot.close(frequency.figure)


def test_a_line_ends_where_two_modes_exchange_character():
    """Empty Pista on a racing tyre: behind the exchange another root is called weave; no stroke joins the two."""
    table = {"tyre": "Tyre1", "pressure_bar": 5.5, "extrapolate": True}
    model = build_model({"bicycle": "pista", "effects": {"relaxation_length": table}})
    found = modes(model, np.arange(3.0, 25.0, 0.5))
    exchanges = [e.speed for e in found.events if e.kind == "exchange" and set(e.modes) == {"weave", "wobble"}]
    assert exchanges
    near = modes(model, exchanges[0] + np.array([-0.25, 0.25])).events
    assert [e.modes for e in near if e.kind == "exchange"] == [("weave", "wobble")]
    real = Figure().add_subplot()
    found.plot((Figure().add_subplot(), real))
    for line in real.get_lines():
        if line.get_label() in ("weave", "wobble"):
            at = np.searchsorted(line.get_xdata(), exchanges[0])
            assert np.isnan(line.get_ydata()[at])
