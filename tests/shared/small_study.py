"""Small main studies for tests: few speeds, few random bicycles, chosen tyres and pressures."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.files import load_bicycle
from bicycle.parameters import Bicycle
from studies.main_study import Cases, Settings, tyre_cases
from tyre import TyreMap

RACING = "pista_charlie_drops"  # its wheel loads lie inside the tyre tests


def exactly_known(name: str) -> Bicycle:
    """A packaged bicycle with every standard deviation stated as 0: the uncertainty is the tyre's."""
    values = load_bicycle(name).values
    return Bicycle(name, values, dict.fromkeys(values, 0.0))


def small(bicycle: Bicycle | str = RACING, **others: Any) -> Settings:
    """Settings of a study of some seconds."""
    known = exactly_known(bicycle) if isinstance(bicycle, str) else bicycle
    few = {"speeds": np.linspace(0, 30, 13), "max_speed": 40.0, "samples": 60, "fronts": 6}
    return Settings(known, **(few | others))


def chosen(settings: Settings, wanted: Mapping[str, Sequence[float]], left_out: Sequence[str] = ()) -> Cases:
    """Of the cases of a study those of the named tyres and pressures (bar), in this order."""
    found = {(case.name, case.pressure_bar): case for case in tyre_cases(settings).studied}
    return Cases(tuple(found[name, bar] for name, bars in wanted.items() for bar in bars), tuple(left_out))


def own_table(folder: Path, tyre: str = "Mine", pressures: Sequence[float] = (3.5, 5.5, 7.5)) -> Path:
    """A table as ``velotyre tyre fit`` writes it: Tyre3 under another name, at some of its pressures, synthetic."""
    file = folder / f"{tyre}.csv"
    TyreMap.load("Tyre3").to_file(file)
    head, *rows = file.read_text().splitlines()
    kept = [row for row in rows if float(row.split(",")[1]) in pressures]
    file.write_text("\n".join([head, *kept]) + "\n")
    sidecar = file.with_suffix(".toml")
    told = sidecar.read_text().replace('"Tyre3"', f'"{tyre}"').replace("synthetic = false", "synthetic = true")
    sidecar.write_text(told)
    return file
