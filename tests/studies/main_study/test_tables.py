"""Tidy tables that agree with the study."""

import numpy as np
import pandas as pd
import pytest
from eigenvalue_sets import assert_same_eigenvalues

from studies.main_study.assemble import build
from studies.main_study.tables import tables, write_tables

NAMES = [
    "tyre_properties", "eigenvalues", "damping_ratios", "critical_speeds", "decomposition_damping_ratio",
    "decomposition_critical_speed", "wobble", "hinges", "plausible_fronts", "published", "monte_carlo",
]  # fmt: skip
UNITS_IN_A_COLUMN = ("decomposition_damping_ratio", "published", "monte_carlo")
CONDITION = ["bicycle", "tyre", "surface", "pressure_rear_bar", "pressure_front_bar", "hands", "front", "extrapolated"]


@pytest.fixture(scope="module")
def found(racing):
    return tables(racing)


def test_tables_are_tidy(racing, found):
    assert list(found) == NAMES
    for name in ("eigenvalues", "damping_ratios", "critical_speeds", "wobble", "plausible_fronts", "monte_carlo"):
        assert list(found[name])[: len(CONDITION)] == CONDITION, name
    lengths = {name: len(table) for name, table in found.items()}
    assert lengths["tyre_properties"] == 2 * 5
    assert lengths["wobble"] == 4 * 5
    assert lengths["hinges"] == 2 * len(racing.hinges)
    assert lengths["plausible_fronts"] == 6 * len(racing.plausible)
    assert lengths["critical_speeds"] == sum(len(r.crossings) for r in racing.results)
    keys = ["tyre", "surface", "pressure_rear_bar", "hands", "front"]
    assert not found["wobble"].duplicated(keys).any()
    assert not found["eigenvalues"].duplicated([*keys, "speed_m_s", "mode", "branch"]).any()
    assert not found["tyre_properties"].duplicated(["tyre", "surface", "pressure_bar", "wheel"]).any()


def test_every_column_with_a_unit_says_so(found):
    units = ("_m_s", "_Hz", "_bar", "_N", "_mm", "_N_per_deg", "_N_per_mm", "_1_s", "_rad_s")
    words = {
        *CONDITION, "wheel", "origin", "notes", "mode", "branch", "damping_ratio", "kind", "direction", "what", "unit",
        "unstable", "varied", "end", "value", "number", "computed", "who", "quantity", "verdict", "read", "source",
        "lost", "draws", "seed", "random_bicycles", "of_these_without_wobble",
    }  # fmt: skip
    for name, table in found.items():
        for column in table:
            dimensionless = "damping_ratio" in column or name in UNITS_IN_A_COLUMN
            assert column in words or column.endswith(units) or dimensionless, (name, column)


def test_every_eigenvalue_is_in_the_table_once(racing, found):
    case, setup = racing.cases[3], racing.settings.setups[1]
    table = found["eigenvalues"]
    mine = table[
        (table["tyre"] == case.tyre) & (table["pressure_rear_bar"] == case.pressure_bar) & (table["hands"] == "on")
        & (table["front"] == "flexible") & (table["speed_m_s"] == 10.0)
    ]  # fmt: skip
    values = build(racing.settings, setup, case.contact).eigenvalues(10.0)
    printed = mine["real_1_s"].to_numpy() + 1j * mine["imaginary_rad_s"].to_numpy()
    assert_same_eigenvalues(printed, values[values.imag >= 0], rtol=1e-9)
    moving = mine[mine["imaginary_rad_s"] > 0]
    ratio = -moving["real_1_s"] / np.hypot(moving["real_1_s"], moving["imaginary_rad_s"])
    np.testing.assert_allclose(moving["damping_ratio"], ratio)
    np.testing.assert_allclose(moving["frequency_Hz"], moving["imaginary_rad_s"] / (2 * np.pi))


def test_parts_add_up_to_the_total(found):
    for name in ("decomposition_critical_speed", "decomposition_damping_ratio"):
        table = found[name]
        parts = [column for column in table if "_part" in column or column.startswith("interaction")]
        (total,) = (column for column in table if column.startswith("total_change"))
        assert len(parts) == 3
        np.testing.assert_allclose(table[parts].sum(axis=1), table[total], atol=1e-12)
        after, before = (next(c for c in table if c.startswith(end)) for end in ("after", "before"))
        np.testing.assert_allclose(table[after] - table[before], table[total], atol=1e-12)
        assert (table["pressure_before_bar"] > table["pressure_after_bar"]).all()


def test_wobble_is_that_of_the_critical_speeds(found):
    keys = ["tyre", "surface", "pressure_rear_bar", "hands", "front"]
    critical = found["critical_speeds"]
    wobble = found["wobble"].set_index(keys).sort_index()
    for key, group in critical[(critical["mode"] == "wobble") & (critical["speed_m_s"] <= 30)].groupby(keys):
        row = wobble.loc[key]
        assert row["unstable"]
        assert row["from_m_s"] == group["speed_m_s"].min()
        if len(group) > 1:
            assert row["to_m_s"] == group["speed_m_s"].max()
        else:
            assert np.isinf(row["to_m_s"])
    stable = wobble[~wobble["unstable"]]
    assert len(stable) == 15
    assert stable["from_m_s"].isna().all()
    assert (stable["least_damping_ratio"] > 0).all()


def test_extrapolated_tyre_values_are_marked(heavy):
    for name, table in tables(heavy).items():
        if name == "tyre_properties":
            assert (table["origin"] == "extrapolated").all()
        elif "extrapolated" in table:
            assert table["extrapolated"].all(), name


def test_files_hold_the_tables(racing, found, tmp_path):
    written = write_tables(racing, tmp_path)
    assert sorted(file.name for file in tmp_path.iterdir()) == sorted(f"{name}.csv" for name in NAMES)
    back = pd.read_csv(written["critical_speeds"])
    np.testing.assert_allclose(back["speed_m_s"], found["critical_speeds"]["speed_m_s"], rtol=1e-9)
    assert list(back) == list(found["critical_speeds"])
    assert b"\r" not in written["wobble"].read_bytes()
