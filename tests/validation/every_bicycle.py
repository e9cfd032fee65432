"""The main study of every packaged bicycle and of the text files of neighbouring projects, to the end.

Says of each how long it took, what was left out, and where wobble is unstable with hands off and on, front flexible.
"""

import time
from pathlib import Path
from typing import Any

from bicycle.files import available_bicycles, load_bicycle
from bicycle.parameters import Bicycle
from studies.main_study import Result, Settings, run_and_write
from tyre.ground import data_root, write_text


def every_bicycle(folder: Path) -> list[Bicycle]:
    """The packaged bicycles, and those in text files, which are copied to ``folder`` to be read as a user's."""
    found = [load_bicycle(name) for name in available_bicycles()]
    for text in sorted(data_root().joinpath("bicycle_text").iterdir(), key=lambda one: one.name):
        own = folder / text.name
        write_text(own, text.read_text(encoding="utf-8"))
        found.append(load_bicycle(own))
    return found


def run(*, out: Path, seed: int, fronts: int = 64, samples: int = 500, workers: int = 2) -> dict[str, Any]:
    """Run the study of each bicycle; ``rows`` has one entry a bicycle."""
    from tyre.ground import progress_bar

    rows = []
    for bicycle in progress_bar(every_bicycle(out), desc="bicycles"):
        started = time.perf_counter()
        settings = Settings(bicycle, seed=seed, fronts=fronts, samples=samples)
        study, _, report = run_and_write(settings, out / bicycle.name, workers=workers)
        off, on = settings.setups[:2]
        rows.append(
            {
                "bicycle": bicycle.name, "report_written": report.is_file(),
                "seconds": round(time.perf_counter() - started, 1), "left_out": list(study.left_out),
                "loads_N": [round(load, 1) for load in bicycle.static_loads],
                "hands_off": {r.case.condition: band(r, settings) for r in study.results_of(off, study.names[0])},
                "hands_on": {r.case.condition: band(r, settings) for r in study.results_of(on, study.names[0])},
            }
        )  # fmt: skip
    return {"rows": rows}


def band(result: Result, settings: Settings) -> dict[str, Any]:
    """Speeds of wobble (m/s; null: none, or beyond the speeds looked at) and its least damping ratio."""
    span = result.wobble
    return {
        "from_m_s": round(span.low, 2) if span else None,
        "to_m_s": round(span.high, 2) if span and span.high <= settings.fastest else None,
        "wobbles": span is not None,
        "min_damping_ratio": round(result.least.damping_ratio, 4) if result.least else None,
        "tyre_extrapolated": result.case.extrapolated,
    }
