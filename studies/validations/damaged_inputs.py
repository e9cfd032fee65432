"""What every reader does with damaged inputs: read, refused in words, or a traceback, a hang, a silent NaN.

Valid inputs, shipped and documented, are damaged at random: keys deleted, renamed, doubled, moved, of another type;
values huge, tiny, not finite, of other scripts; rows and cells taken out, put in, swapped; bytes flipped, files cut off
or in other encodings. Each is read as the command reads it, up to the model and one cheap computation, with
warnings as errors. A hang is more than 10 s. A silent NaN is one in what was read that is not in what is read of the
undamaged input. Input number k of a seed is always the same: --first k --inputs 1 repeats it.
"""

import math
import multiprocessing
import random
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Thread
from typing import Any

import click

from studies.validations._input_damage import damaged
from studies.validations._input_examples import Example
from studies.validations._input_numbers import not_finite
from studies.validations._input_readers import READERS, Reader
from tyre.base.csv_text import write_csv
from tyre.base.errors import InputError
from tyre.base.parallel import end_with_parent

OUTCOMES = ("read", "refused", "traceback", "silent NaN", "hang")
FAILURES = OUTCOMES[2:]
PATIENCE = 10.0  # s for one input
_STILL_WARM = 600.0  # s for the undamaged inputs, each read once before the first
_MOST_SHOWN = 200


def run(*, out: Path, seed: int, inputs: int = 20_000, first: int = 0, minutes: int = 0) -> dict[str, Any]:
    """Damage and read inputs.

    Parameters
    ----------
    out : Path
        Gets ``damaged_inputs.csv``, the failures.
    seed : int
        Of the random numbers.
    inputs : int
        How many.
    first : int
        Number of the first one.
    minutes : int
        Number of minutes after which to stop; 0: when all are read.

    Returns
    -------
    dict
        Counts by reader, and every failure with its number.
    """
    import pandas as pd

    began = time.monotonic()
    counts, failures = _supervised(seed, first, first + inputs, minutes * 60 or math.inf)
    columns = ("input", "reader", "example", "file", "damage", "outcome", "words")
    write_csv(out / "damaged_inputs.csv", pd.DataFrame(failures, columns=list(columns)))
    by_reader = {
        reader.name: dict(zip(OUTCOMES, row, strict=True)) for reader, row in zip(READERS, counts, strict=True)
    }
    total = {outcome: sum(row[outcome] for row in by_reader.values()) for outcome in OUTCOMES}
    return {
        "synthetic": True,
        "what": "valid inputs of every reader, damaged at random and read as the commands read them",
        "made_by": f"velotyre validate damaged-inputs --seed {seed} --inputs {inputs} --first {first}",
        "seed": seed, "inputs": sum(total.values()), "minutes": round((time.monotonic() - began) / 60, 1),
        "total": total, "by_reader": by_reader,
        "distinct_failures": dict(Counter(f"{f['reader']}: {f['outcome']}: {f['words'][-90:]}" for f in failures)),
        "failures": failures[:_MOST_SHOWN],
        "targets": dict.fromkeys(FAILURES, 0), "met": {outcome: total[outcome] == 0 for outcome in FAILURES},
    }  # fmt: skip


@dataclass
class Prepared:
    """An example in its folder, and where what is read of it is not finite though it is sound."""

    example: Example
    folder: Path
    usual: set[str]


def _supervised(seed: int, first: int, stop: int, seconds: float) -> tuple[list[list[int]], list[dict[str, Any]]]:
    """Read inputs in a process of its own, which is ended and begun anew behind an input that takes too long."""
    from tyre.base.progress import progress_bar

    context = multiprocessing.get_context("spawn")
    shared = context.Array("q", len(READERS) * len(OUTCOMES))
    place = context.Array("d", [-1.0, 0.0, math.inf])  # the input that is read, since when, and when to stop
    queue = context.SimpleQueue()
    failures: list[dict[str, Any]] = []
    following, end = first, time.monotonic() + seconds
    with progress_bar(total=stop - first, desc="inputs") as bar:
        while following < stop:
            worker = context.Process(target=_work, args=(seed, following, stop, shared, place, queue), daemon=True)
            place[:] = -1.0, time.monotonic(), end
            worker.start()
            while worker.is_alive() and not _late(place):
                worker.join(0.5)
                _told(_waiting(queue), failures)
                bar.update(max(int(place[0]) - first - bar.n, 0))
            _told(_waiting(queue), failures)
            if worker.exitcode == 0:
                break
            late = worker.is_alive()
            worker.kill()
            worker.join()
            if place[0] < 0:
                raise InputError("a reader cannot read the undamaged examples; run `velotyre validate` in a checkout")
            following = int(place[0]) + 1
            _told([_lost(seed, following - 1, "hang" if late else "traceback", worker.exitcode, shared)], failures)
    return [list(shared[k : k + len(OUTCOMES)]) for k in range(0, len(shared), len(OUTCOMES))], failures


def _waiting(queue: Any) -> Iterator[dict[str, Any]]:
    while not queue.empty():
        yield queue.get()


def _told(further: Iterable[dict[str, Any]], failures: list[dict[str, Any]]) -> None:
    """Take over what failed, and say it at once: a long run may be stopped."""
    for found in further:
        failures.append(found)
        click.echo(f"input {found['input']}, {found['reader']}: {found['outcome']}: {found['words']}", err=True)


def _late(place: Any) -> bool:
    return time.monotonic() - place[1] > (PATIENCE if place[0] >= 0 else _STILL_WARM)


def _lost(seed: int, index: int, outcome: str, code: int | None, shared: Any) -> dict[str, Any]:
    """The record of an input whose process did not end by itself."""
    with tempfile.TemporaryDirectory() as folder:
        reader, example, victim, _, what = _drawn(seed, index, _Examples(Path(folder)))
    shared[reader * len(OUTCOMES) + OUTCOMES.index(outcome)] += 1
    words = f"no end after {PATIENCE:g} s" if outcome == "hang" else f"the process ended with {code}"
    return _record(index, READERS[reader], example, victim, what, outcome, words)


def _record(
    index: int, reader: Reader, example: Example, victim: str, what: str, outcome: str, words: str
) -> dict[str, Any]:
    return {"input": index, "reader": reader.name, "example": example.name, "file": victim, "damage": what,
            "outcome": outcome, "words": words[-400:]}  # fmt: skip


class _Examples(dict[int, Sequence[Example]]):
    """Examples of the readers by number, made in a folder of their own when they are asked for."""

    def __init__(self, root: Path) -> None:
        self.root = root

    def __missing__(self, reader: int) -> Sequence[Example]:
        self[reader] = READERS[reader].examples(Path(tempfile.mkdtemp(dir=self.root)))
        return self[reader]


def _drawn(seed: int, index: int, every: _Examples) -> tuple[int, Example, str, bytes, str]:
    """Reader, example, file, damaged content and what was done, of one input."""
    rng = random.Random(f"{seed} {index}")
    (reader,) = rng.choices(range(len(READERS)), [reader.share for reader in READERS])
    example = rng.choice(every[reader])
    victim = rng.choice(example.victims)
    content, what = damaged(example.files[victim], victim, rng)
    return reader, example, victim, content, what


def _work(seed: int, first: int, stop: int, shared: Any, place: Any, queue: Any) -> None:
    """Read inputs, counting into what is shared."""
    Thread(target=end_with_parent, daemon=True).start()
    warnings.simplefilter("ignore")
    with tempfile.TemporaryDirectory() as root:
        every = _Examples(Path(root))
        ready: dict[int, dict[str, Prepared]] = {}
        for index in range(first, stop):
            place[1] = time.monotonic()
            if place[1] > place[2]:
                break
            place[0] = -1.0  # nothing damaged is read yet
            number, example, victim, content, what = _drawn(seed, index, every)
            if number not in ready:
                ready[number] = _prepared(READERS[number], every[number], Path(root))
            place[:2] = index, time.monotonic()
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                for hidden in (DeprecationWarning, ResourceWarning):  # which Python does not show users either
                    warnings.simplefilter("ignore", hidden)
                outcome, words = _outcome(READERS[number], ready[number][example.name], victim, content)
            shared[number * len(OUTCOMES) + OUTCOMES.index(outcome)] += 1
            if outcome in FAILURES:
                queue.put(_record(index, READERS[number], example, victim, what, outcome, words))


def _prepared(reader: Reader, found: Sequence[Example], root: Path) -> dict[str, Prepared]:
    """Every example in a folder of its own, read once; one that is refused has no places."""
    ready: dict[str, Prepared] = {}
    usual: set[str] = set()
    for example in found:
        folder = Path(tempfile.mkdtemp(dir=root))
        for name, content in example.files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
        with suppress(InputError):  # of a disordered recording
            usual |= not_finite(reader.read(folder / example.main, example))
        ready[example.name] = Prepared(example, folder, usual)
    return ready


def _outcome(reader: Reader, prepared: Prepared, victim: str, content: bytes) -> tuple[str, str]:
    """What comes of one input, and the words of a failure."""
    file = prepared.folder / victim
    file.write_bytes(content)
    try:
        found = reader.read(prepared.folder / prepared.example.main, prepared.example)
        strange = not_finite(found) - prepared.usual
    except (InputError, click.ClickException):
        return "refused", ""
    except OSError as error:  # which the command line says in one line, too
        return ("refused", "") if error.filename else ("traceback", _said(error))
    except Exception as error:
        return "traceback", _said(error)
    finally:
        file.write_bytes(prepared.example.files[victim])
    return ("silent NaN", ", ".join(sorted(strange))) if strange else ("read", "")


def _said(error: BaseException) -> str:
    """The last lines of the traceback that are of the house, and what was raised."""
    own = [f for f in traceback.extract_tb(error.__traceback__) if "site-packages" not in f.filename]
    last = [f"{'/'.join(Path(f.filename).parts[-2:])}:{f.lineno}" for f in own][-2:]
    return f"{' < '.join(reversed(last))}: {type(error).__name__}: {' '.join(str(error).split())[:200]}"
