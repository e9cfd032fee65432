"""The 72 values of Tables 2-9 of Dell'Orto, Ballo, Mastinu & Gobbi, typed from the paper, through the public API.

"Racing bicycle tyres: experimental indoor evaluation of relaxation length". Rows: 340, 400, 490 N; columns: 3.5, 5.5,
7.5 bar. Table 7's caption says flat track; its symbol says RuotaVia, the drum, and so do its values.
"""

import math

import pytest

from tyre import TyreMap

LOADS_N = (340, 400, 490)
PRESSURES_BAR = (3.5, 5.5, 7.5)

CORNERING_STIFFNESS_N_PER_DEG = {
    ("Tyre1", "flat"): ((105.3, 106.4, 103.2), (111.1, 111.7, 108.4), (110.7, 114.8, 116.7)),  # Table 2
    ("Tyre1", "drum"): ((93.1, 88.1, 80.5), (96.7, 98.3, 93.4), (102.8, 106.3, 100.8)),  # Table 3
    ("Tyre2", "flat"): ((88.5, 88.8, 80.1), (101.0, 97.2, 92.0), (110.7, 107.9, 105.0)),  # Table 4
    ("Tyre3", "flat"): ((103.6, 91.0, 86.2), (111.5, 105.8, 95.6), (120.0, 117.2, 111.2)),  # Table 5
}
RELAXATION_LENGTH_MM = {
    ("Tyre1", "flat"): ((134.0, 100.9, 78.6), (141.5, 106.0, 82.6), (140.9, 108.9, 88.9)),  # Table 6
    ("Tyre1", "drum"): ((118.6, 83.5, 61.3), (123.1, 93.3, 71.2), (130.9, 100.9, 76.8)),  # Table 7
    ("Tyre2", "flat"): ((126.7, 121.1, 88.3), (112.0, 81.7, 90.5), (175.8, 82.1, 108.9)),  # Table 8
    ("Tyre3", "flat"): ((187.3, 123.2, 107.4), (192.2, 115.5, 145.8), (198.5, 143.3, 163.3)),  # Table 9
}
TABLES = list(CORNERING_STIFFNESS_N_PER_DEG)


@pytest.mark.parametrize(("tyre", "surface"), TABLES)
def test_every_printed_value_comes_back(tyre: str, surface: str) -> None:
    tyre_map = TyreMap.load(tyre, surface=surface)
    for row, load in enumerate(LOADS_N):
        for column, pressure in enumerate(PRESSURES_BAR):
            here = tyre_map.at(load=load, pressure=pressure * 1e5)
            stiffness = CORNERING_STIFFNESS_N_PER_DEG[tyre, surface][row][column]
            length = RELAXATION_LENGTH_MM[tyre, surface][row][column]
            assert here.origin == "measured"
            assert math.radians(here.cornering_stiffness) == pytest.approx(stiffness, rel=1e-12)
            assert 1e3 * here.relaxation_length == pytest.approx(length, rel=1e-12)
            ratio = here.cornering_stiffness / here.lateral_stiffness
            assert here.relaxation_length == pytest.approx(ratio, rel=1e-14)


@pytest.mark.parametrize(("tyre", "surface"), TABLES)
def test_stated_three_millimetres_is_one_standard_deviation(tyre: str, surface: str) -> None:
    tyre_map = TyreMap.load(tyre, surface=surface)
    for load in LOADS_N:
        for pressure in PRESSURES_BAR:
            here = tyre_map.at(load=load, pressure=pressure * 1e5)
            assert 1e3 * here.relaxation_length_sd == pytest.approx(3.0, rel=1e-9)
            assert math.isnan(here.cornering_stiffness_sd)  # the paper states none
            relative = here.relaxation_length_sd / here.relaxation_length
            assert here.lateral_stiffness_sd / here.lateral_stiffness == pytest.approx(relative, rel=1e-9)


@pytest.mark.parametrize(("pressure_bar", "stiffness_n_per_mm"), [(3.5, 45.0), (5.5, 60.4), (7.5, 75.2)])
def test_tyre1_has_one_lateral_stiffness_per_pressure(pressure_bar: float, stiffness_n_per_mm: float) -> None:
    """C / relaxation length of all six conditions contains 45.0, 60.4, 75.2 N/mm within the rounding."""
    for key in (("Tyre1", "flat"), ("Tyre1", "drum")):
        for row in range(3):
            column = PRESSURES_BAR.index(pressure_bar)
            stiffness, length = CORNERING_STIFFNESS_N_PER_DEG[key][row][column], RELAXATION_LENGTH_MM[key][row][column]
            low = math.degrees(stiffness - 0.05) / (length + 0.05)
            high = math.degrees(stiffness + 0.05) / (length - 0.05)
            assert low <= stiffness_n_per_mm <= high
            here = TyreMap.load(key[0], surface=key[1]).at(load=LOADS_N[row], pressure=pressure_bar * 1e5)
            assert low <= here.lateral_stiffness / 1e3 <= high


def test_lateral_stiffness_of_the_paper_figures() -> None:
    """The text to Figs. 5 and 6: Tyre2 at 7.5 bar is 25 % below Tyre1; Tyre3 at 490 N more at 5.5 than 7.5 bar."""
    one, two, three = (TyreMap.load(tyre) for tyre in ("Tyre1", "Tyre2", "Tyre3"))
    ratios = [
        two.at(load=load, pressure=7.5e5).lateral_stiffness / one.at(load=load, pressure=7.5e5).lateral_stiffness
        for load in LOADS_N
    ]
    assert 1 - sum(ratios) / 3 == pytest.approx(0.25, abs=0.025)
    assert three.at(load=490, pressure=5.5e5).lateral_stiffness > three.at(load=490, pressure=7.5e5).lateral_stiffness
