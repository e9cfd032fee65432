"""What becomes of damaged recordings in every format: refused in words, or read right; never a silent wrong number.

A SYNTHETIC recording is written in every format by the libraries that laboratories use, damaged at random (cut off,
bytes flipped, a channel of text, an empty channel, a clock that jumps, another unit) and read through a channel map.
Counted: refused (one clear error), right (every number as written, or as written up to where the file was cut),
altered (bytes of a number were flipped in a file without a checksum there, so that it is another valid recording: no
reader can know), wrong (anything else) and crashed (another exception, or no end).
"""

import math
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from studies.validations._recording_words import WORDED
from studies.validations._recording_writers import OWN_TIMES, WRITERS, name_in_file
from tyre.base.arrays import Array
from tyre.base.csv_text import write_csv
from tyre.base.errors import InputError
from tyre.channels.channel_map import ChannelMap
from tyre.channels.record import Record, read_records

KINDS = ("cut off", "bytes flipped", "text in a channel", "empty channel", "clock jumps", "another unit")
CHECKED = ("xlsx", "parquet", "hdf5", "mat5", "timetable")
"""Formats whose numbers are under a checksum as written here."""

NO_UNITS = ("mat5", "mat73", "timetable")
"""Formats that hold no units as written here, so that none can contradict the channel map."""

QUANTITIES = {"slip_angle": "angle", "side_force": "force"}
_SAMPLES = 400
_MOST_FLIPPED = 4
_UNITS = {"slip": "deg", "force": "N"}
_PATIENCE = 60.0  # s


def run(*, out: Path, seed: int, cases: int = 200) -> dict[str, Any]:
    """Damage and read recordings.

    Parameters
    ----------
    out : Path
        Gets ``damaged_recordings.csv``, one row a case.
    seed : int
        Of the random numbers.
    cases : int
        Number of damaged files of each format.

    Returns
    -------
    dict
        Counts by format and by damage.
    """
    import pandas as pd

    from tyre.base.progress import progress_bar

    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for form in progress_bar(WRITERS, desc="formats"):
            for case in range(cases):
                kind, verdict, words = one_case(Path(folder), form, seed, case)
                rows.append({"format": form, "case": case, "damage": kind, "verdict": verdict, "words": words})
    frame = pd.DataFrame(rows)
    write_csv(out / "damaged_recordings.csv", frame.drop(columns="words"))
    failed = frame[frame.verdict.isin(["wrong", "crashed"])]
    return {
        "synthetic": True,
        "what": "recordings in every format, damaged at random and read through a channel map",
        "made_by": f"velotyre validate damaged-recordings --seed {seed} --cases {cases}",
        "seed": seed,
        "cases_per_format": cases,
        "by_format": {form: dict(Counter(part.verdict)) for form, part in frame.groupby("format", sort=False)},
        "by_damage": {kind: dict(Counter(part.verdict)) for kind, part in frame.groupby("damage", sort=False)},
        "failures": [f"{row.format} case {row.case} ({row.damage}): {row.words}" for row in failed.itertuples()],
        "targets": {"wrong": 0, "crashed": 0},
        "met": {"wrong": not (frame.verdict == "wrong").any(), "crashed": not (frame.verdict == "crashed").any()},
    }


def one_case(folder: Path, form: str, seed: int, case: int) -> tuple[str, str, str]:
    """Write, damage and read one file.

    Parameters
    ----------
    folder : Path
        For the file.
    form : str
        A key of ``WRITERS``.
    seed, case : int
        Numbers without unit that fix the recording and its damage.

    Returns
    -------
    kind, verdict, words : str
        What was done, what came of it, and the message.
    """
    import warnings

    rng = np.random.default_rng([seed, list(WRITERS).index(form), case])
    kind = KINDS[case % len(KINDS)]
    truth = {"t": np.arange(_SAMPLES) / 100, "slip": np.round(rng.normal(0, 2, _SAMPLES), 6),
             "force": np.round(rng.normal(0, 300, _SAMPLES), 4)}  # fmt: skip
    suffix, write = WRITERS[form]
    path = folder / f"case{suffix}"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the writers
        flipped = _write_damaged(path, form, write, kind, truth, rng)
    try:
        with _time_limit(_PATIENCE):
            (record,) = read_records(path, _map(form), QUANTITIES)
    except InputError as error:
        return kind, "refused", str(error)
    except Exception as error:
        return kind, "crashed", f"{type(error).__name__}: {error}"
    finally:
        path.unlink(missing_ok=True)
    verdict, words = _judged(record, truth, form, kind, may_alter=flipped if form not in CHECKED else 0)
    return kind, verdict, words


@contextmanager
def _time_limit(seconds: float) -> Iterator[None]:
    """Raise TimeoutError in a reader that does not end (where the system can)."""
    import signal

    def stop(*_: object) -> None:
        raise TimeoutError(f"no end after {seconds:g} s")

    if not hasattr(signal, "SIGALRM"):
        yield
        return
    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def _map(form: str) -> ChannelMap:
    table: dict[str, Any] = {
        "slip_angle": {"column": name_in_file(form, "slip"), "unit": "deg"},
        "side_force": {"column": name_in_file(form, "force"), "unit": "N"},
    }
    if form not in OWN_TIMES:
        table["time"] = {"column": name_in_file(form, "t"), "unit": "s"}
    return ChannelMap.from_table({"channels": table}, Path(), where="map")


def _write_damaged(
    path: Path, form: str, write: Any, kind: str, truth: dict[str, Array], rng: np.random.Generator
) -> int:
    """Write the damaged file; how many bytes were flipped."""
    units = {"t": "s", **_UNITS}
    written = {name: x.copy() for name, x in truth.items()}
    victim = ("slip", "force")[rng.integers(2)]
    if kind == "empty channel":
        written[victim][:] = np.nan
    elif kind == "clock jumps":
        place = int(rng.integers(2, _SAMPLES - 2))
        written["t"][place:] += rng.choice([-0.5, -0.01, 0.75])
    elif kind == "another unit":
        units[victim] = {"slip": "rad", "force": "kN"}[victim]
    elif kind == "text in a channel":
        _write_text(path, form, write, written, units, victim, rng)
        return 0
    try:
        write(path, {name: (x, units[name]) for name, x in written.items()})
    except ValueError:  # a writer of its own that asks for rising times
        path.write_bytes(b"")
    raw = bytearray(path.read_bytes())
    if kind == "cut off":
        path.write_bytes(raw[: int(rng.integers(0, len(raw)))])
    if kind != "bytes flipped":
        return 0
    places = rng.choice(len(raw), int(rng.integers(1, _MOST_FLIPPED + 1)), replace=False)
    for place in places:
        raw[place] ^= int(rng.integers(1, 256))
    path.write_bytes(raw)
    return len(places)


def _write_text(
    path: Path, form: str, write: Any, columns: Mapping[str, Array], units: Mapping[str, str], victim: str,
    rng: np.random.Generator,
) -> None:  # fmt: skip
    """One sample of a text format, a whole channel of another, is words."""
    write(path, {name: (x, units[name]) for name, x in columns.items()})
    if form in ("csv", "tsv", "tdx"):
        encoding = "cp1252" if form == "csv" else "utf-8"
        lines = path.read_bytes().decode(encoding).split("\n")
        last = len(lines) - (2 if form == "tdx" else 1)  # lines end with a line end, TYDEX with a keyword
        row = int(rng.integers(last - _SAMPLES, last))
        cells = lines[row].split({"csv": ";", "tsv": "\t", "tdx": " "}[form])
        cells[1 + (victim == "force")] = "error"
        lines[row] = {"csv": ";", "tsv": "\t", "tdx": " "}[form].join(cells)
        path.write_bytes("\n".join(lines).encode(encoding))
        return
    WORDED[form](path, columns, units, victim)


def _judged(record: Record, truth: Mapping[str, Array], form: str, kind: str, *, may_alter: int) -> tuple[str, str]:
    found = {"t": record.time, "slip": np.rad2deg(record.values["slip_angle"]), "force": record.values["side_force"]}
    count = len(record.time)
    if kind in ("text in a channel", "empty channel") or (kind == "another unit" and form not in NO_UNITS):
        return "wrong", "was accepted"
    if kind == "clock jumps":
        steps = np.diff(record.time)
        said = any("time jumps" in note for note in record.notes)
        sound = bool((steps > 0).all()) and (said or math.isclose(steps.max(), steps.min(), rel_tol=1e-6))
        return ("right", "said") if sound else ("wrong", f"a jump of the clock was not said: {record.notes}")
    if count != _SAMPLES and kind not in ("cut off", "bytes flipped"):
        return "wrong", f"{count} samples"
    differ = sum(
        int(np.count_nonzero(~np.isclose(found[name], truth[name][:count], rtol=1e-9, atol=1e-9))) for name in truth
    ) if count <= _SAMPLES else _SAMPLES  # fmt: skip
    if not differ and (count == _SAMPLES or kind == "cut off"):
        return "right", f"{count} samples"
    if differ + abs(_SAMPLES - count) <= may_alter:
        return "altered", f"{differ} of {3 * count} numbers"
    return "wrong", f"{differ} numbers differ, {count} samples, {record.notes}"
