"""Does every measurement end in a verdict or in one clear line? SYNTHETIC ridden, unstable and hostile files.

Each case is a small file of modes or histories of the blind test's generator, made worse: a rider who steers without a
record of it, motion that runs away, signals that stand still or overflow, noise of no size, tables of one row. It is
read, diagnosed with one effect, judged section by section and written to the terminal and to JSON. An InputError is
one clear refusal; anything else is a crash, as is a section that fails.
"""

import csv
import json
import tomllib
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from studies.diagnosis import diagnose, find, read_measurement, record, terminal
from tests.validation.blind.generator import modal_case
from tests.validation.blind.histories import history_case
from tests.validation.cases import KeptCases, Row, attempted, share
from tyre.ground import Array, InputError, write_text

Random = np.random.Generator
Table = dict[str, Array]
BICYCLES = ("benchmark", "browser")
LARGEST = {"roll_rate_rad_s": 15.0, "steer_rad": 1.5, "yaw_rate_rad_s": 15.0}
TRIED = 1  # effect of a case, so that a thousand are cheap


def ridden(table: Table, rng: Random) -> None:
    """Take away the record of a torque with which somebody steers, late and against the lean rate."""
    table.pop("steer_torque_N_m", None)
    late = int(rng.integers(1, 10))
    push = np.concatenate([np.zeros(late), table["roll_rate_rad_s"][:-late]])
    table["steer_rad"] = table["steer_rad"] + rng.uniform(0.05, 1.0) * np.cumsum(push) * 0.01


def runaway(table: Table, rng: Random) -> None:
    """Let the motion grow until it leaves every model."""
    time = table["time_s"]
    for name in ("roll_rate_rad_s", "steer_rad", "yaw_rate_rad_s"):
        table[name] = table[name] * np.exp(rng.uniform(1, 30) * (time - time[0]))


def stopped(table: Table, rng: Random) -> None:
    """Let a channel stand still from some sample on."""
    name = str(rng.choice([name for name in table if name != "time_s"]))
    begin = int(rng.integers(0, len(table[name])))
    table[name] = np.where(np.arange(len(table[name])) >= begin, float(rng.choice([0.0, 1.0])), table[name])


def enormous(table: Table, rng: Random) -> None:
    """Scale a column by a factor from 1e-12 to 1e12."""
    name = str(rng.choice([name for name in table if name != "time_s"]))
    table[name] = table[name] * 10.0 ** rng.uniform(-12, 12)


def spiked(table: Table, rng: Random) -> None:
    """Put a few spikes, or what is no number, into a channel."""
    name = str(rng.choice([name for name in table if name != "time_s"]))
    places = rng.integers(0, len(table[name]), 3)
    table[name] = table[name].copy()
    table[name][places] = rng.choice([1e3, -1e9, np.nan, np.inf])


def coarse(table: Table, rng: Random) -> None:
    """Round every signal to a few steps."""
    for name in table:
        if name != "time_s":
            table[name] = np.round(table[name], int(rng.integers(1, 3)))


def cut(table: Table, rng: Random) -> None:
    """Keep a few samples."""
    most = int(rng.integers(18, 26))
    for name in table:
        table[name] = table[name][:most]


def noisy(table: Table, rng: Random) -> None:
    """Replace every signal with noise."""
    for name in table:
        if name != "time_s":
            table[name] = rng.standard_normal(len(table[name])) * 10.0 ** rng.uniform(-3, 3)


def shuffled(table: Table, rng: Random) -> None:
    """Give the columns each other's names."""
    names = [name for name in table if name != "time_s"]
    signals = [table[name] for name in names]
    for name, k in zip(names, rng.permutation(len(names)), strict=True):
        table[name] = signals[k]


WORSE: dict[str, Callable[[Table, Random], None]] = {
    one.__name__: one for one in (ridden, runaway, stopped, enormous, spiked, coarse, cut, noisy, shuffled)
}


def worsen_file(content: dict[str, Any], rng: Random) -> str:
    """State noise, uncertainty or speeds of an odd size, or leave them out; the name of what was done."""
    what = str(rng.choice(["as made", "noise", "no noise", "certain", "uncertain", "speeds", "one run"]))
    histories = content.get("histories", {})
    if what == "noise":
        histories["noise_sd"] = {name: sd * 10.0 ** rng.uniform(-9, 9) for name, sd in histories["noise_sd"].items()}
    elif what == "no noise":
        histories.pop("noise_sd", None)
    elif what in ("certain", "uncertain"):
        factor = 0.0 if what == "certain" else rng.uniform(2, 10)
        content["uncertainty"] = {key: factor * sd for key, sd in content["uncertainty"].items()}
    elif what == "speeds":
        for run in histories["runs"]:
            run["speed_m_s"] = float(10.0 ** rng.uniform(-3, 1.9))
    elif what == "one run":
        histories["runs"] = histories["runs"][:1]
    return what


def make_histories(folder: Path, rng: Random) -> str:
    """Two short runs, each made worse, and their file; the names of what was done."""
    low = float(rng.uniform(0.5, 6.0))
    history_case(
        folder, hidden=("steer_damper",), rng=rng, bicycle=str(rng.choice(BICYCLES)), runs=2,
        duration=float(rng.uniform(0.25, 0.5)), speeds=(low, low + float(rng.uniform(0.0, 6.0))),
    )  # fmt: skip
    content = tomllib.loads((folder / "MEASUREMENT.toml").read_text(encoding="utf-8"))
    how, within = str(rng.choice(list(WORSE))), bool(rng.random() < 0.8)
    for run in content["histories"]["runs"]:
        file = folder / run["file"]
        with file.open(encoding="utf-8") as stream:
            rows = list(csv.reader(stream))
        table = {name: np.array(x, float) for name, x in zip(rows[0], zip(*rows[1:], strict=True), strict=True)}
        WORSE[how](table, rng)
        for name, most in LARGEST.items() if within else ():  # else most are refused as they are read
            size = np.abs(table[name]).max(initial=0.0)
            with np.errstate(invalid="ignore"):  # an endless number stays no number
                table[name] = table[name] * (most / size if size > most else 1.0)
        lines = [",".join(table), *(",".join(f"{x:.9g}" for x in row) for row in zip(*table.values(), strict=True))]
        write_text(file, "\n".join(lines) + "\n")
    return f"{how}, {_written(folder, content, worsen_file(content, rng))}"


def make_modal(folder: Path, rng: Random) -> str:
    """A table of modes with numbers and standard deviations of odd sizes, and its file; the name of what was done."""
    modal_case(folder, hidden=(), rng=rng, points=int(rng.integers(6, 10)))
    with (folder / "modes.csv").open(encoding="utf-8") as stream:
        head, *rows = list(csv.reader(stream))
    how = str(rng.choice(["sizes", "signs", "deviations", "labels", "rows", "speeds", "holes", "still"]))
    column = int(rng.integers(2, len(head)))
    for row in rows if how != "rows" else ():
        if how == "labels":
            row[1] = str(rng.choice(["weave", "capsize", "wobble", "castering"]))
        elif how == "speeds":
            row[0] = f"{10.0 ** rng.uniform(-3, 1.8):.6g}"
        elif how == "holes":
            row[column] = "" if rng.random() < 0.5 else row[column]
        else:
            wanted = [k for k, name in enumerate(head) if ("sd" in name) == (how == "deviations") and k > 1]
            factor = {"signs": -1.0, "still": 0.0}.get(how, 10.0 ** rng.uniform(-8, 8))
            k = int(rng.choice(wanted))
            row[k] = f"{float(row[k]) * factor:.9g}"
    rows = rows[: int(rng.integers(1, 3))] if how == "rows" else rows
    write_text(folder / "modes.csv", "\n".join(",".join(row) for row in [head, *rows]) + "\n")
    content = tomllib.loads((folder / "MEASUREMENT.toml").read_text(encoding="utf-8"))
    factor = float(rng.choice([0.0, 1.0, 10.0]))
    content["uncertainty"] = {key: factor * sd for key, sd in content["uncertainty"].items()}
    return f"{how}, {_written(folder, content, f'uncertainty x {factor:g}')}"


def _written(folder: Path, content: dict[str, Any], what: str) -> str:
    import tomli_w

    write_text(folder / "MEASUREMENT.toml", tomli_w.dumps(content))
    return what


def one_case(seed: int) -> Row:
    """Make and diagnose the case of a ``seed``; its ``end`` is a verdict, ``refused``, or a crash."""
    row: Row = {"seed": seed, "made": "", "end": "crash", "said": ""}
    return attempted(row, partial(_ended, seed))


def _ended(seed: int, folder: Path, row: Row) -> None:
    rng = np.random.default_rng([seed, 46])
    make = make_modal if seed % 4 == 0 else make_histories
    row["made"] = f"{make.__name__[5:]}: {make(folder, rng)}"
    try:
        measurement = read_measurement(folder / "MEASUREMENT.toml")
        names = [c.identifier for c in measurement.prepare().candidates]
        kept = rng.permutation(names)[:TRIED].tolist()
        as_read = bool(rng.random() < 0.8)
        found = diagnose(measurement, without=tuple(n for n in names if n not in kept), as_read=as_read)
    except InputError as error:
        row |= {"end": "refused", "said": str(error)[-200:]}
        return
    told = find(found)
    json.dumps(record(found, told), allow_nan=False)
    row["said"] = "; ".join(f"{section}: {why}" for section, why in told.failed.items())
    terminal(found, told)
    row["end"] = "section failed" if told.failed else found.verdict.verdict


def run(*, out: Path, seed: int, cases: int = 1000, workers: int = 1) -> dict[str, Any]:
    """Make and diagnose a number of ``cases``."""
    jobs = [(seed + k,) for k in range(cases)]
    rows = KeptCases(out / "hostile_cases.jsonl", ("seed",)).computed(jobs, one_case, workers=workers, what="hostile")
    bad = [row for row in rows if row["error"] or row["end"] == "section failed"]
    return {
        "crashed": share(sum(bool(row["error"]) for row in rows), len(rows)),
        "sections_failed": share(sum(row["end"] == "section failed" for row in rows), len(rows)),
        "ends": dict(Counter(row["end"] for row in rows).most_common()),
        "errors": dict(Counter(row["error"] or row["said"] for row in bad).most_common(20)),
    }
