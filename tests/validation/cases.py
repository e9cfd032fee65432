"""Cases of a long count, kept as they end: one JSON object a line, so that an interrupted count goes on."""

import json
import math
import tempfile
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bicycle.effects import model_workers
from tyre.ground import InputError

Row = dict[str, Any]
Job = tuple[Any, ...]


def attempted(row: Row, work: Callable[[Path, Row], None]) -> Row:
    """Let ``work`` fill a ``row`` with a temporary folder at hand; what it raises is the row's ``error``."""
    row |= {"error": None}
    try:
        with tempfile.TemporaryDirectory() as name:
            work(Path(name), row)
    except Exception as error:  # whatever it is: it is counted, and the count goes on
        where = traceback.extract_tb(error.__traceback__)[-1]
        row["error"] = f"{type(error).__name__}: {error} ({Path(where.filename).name}, line {where.lineno})"
    return row


def wilson(hits: float, total: float, z: float = 1.96) -> tuple[float, float]:
    """Return Wilson's interval of the share ``hits`` of ``total`` (Wilson 1927, J. Am. Stat. Assoc. 22)."""
    if not total:
        return 0.0, 1.0
    share, extra = hits / total, z * z / total
    middle = (share + extra / 2) / (1 + extra)
    half = z * math.sqrt(share * (1 - share) / total + extra / (4 * total)) / (1 + extra)
    return max(0.0, middle - half), min(1.0, middle + half)


def share(hits: float, total: float) -> Row:
    """Return the share ``hits`` of ``total`` with its 95 % interval."""
    low, high = wilson(hits, total)
    return {"hits": hits, "of": total, "share": hits / total if total else None, "low": low, "high": high}


def share_of(rows: Sequence[Any], *keys: str) -> Row:
    """Return the share of ``rows`` (flags, or mappings in which ``keys`` lead to one) that are true."""
    values = list(rows)
    for key in keys:
        values = [row[key] for row in values]
    return share(sum(map(bool, values)), len(values))


@dataclass(frozen=True)
class KeptCases:
    """File of the cases of a count; ``keys`` are the columns that tell them apart."""

    path: Path
    keys: tuple[str, ...]
    also: tuple[str, ...] = ("error",)

    def read(self) -> list[Row]:
        """Rows so far; InputError where the file is something else."""
        if not self.path.exists():
            return []
        wanted = {*self.keys, *self.also}
        try:
            lines = self.path.read_text(encoding="utf-8").splitlines(keepends=True)
            if lines and self._is_half(lines[-1]):
                lines.pop()
            rows: list[Row] = [json.loads(line) for line in lines if line.strip()]
            if not all(wanted <= set(row) for row in rows):
                raise ValueError(f"a row without {', '.join(sorted(wanted))}")
        except (TypeError, ValueError) as error:
            raise InputError(f"{self.path}: not the cases of such a count ({error}); give another --out") from error
        return rows

    def computed(self, jobs: Sequence[Job], one: Callable[..., Row], *, workers: int, what: str) -> list[Row]:
        """Rows of some ``jobs``, in their order; those that the file lacks are computed, and appended as they end."""
        from tyre.ground import progress_bar

        known = {self._job(row): row for row in self.read()}
        todo = [job for job in jobs if job not in known]
        self._forget_half_line()
        self.path.parent.mkdir(parents=True, exist_ok=True)
        for row in progress_bar(_results(todo, one, workers), total=len(todo), desc=what):
            known[self._job(row)] = row
            with self.path.open("a", encoding="utf-8") as file:  # not before: a run killed now leaves no empty one
                file.write(json.dumps(row) + "\n")
        return [known[job] for job in jobs]

    def _job(self, row: Mapping[str, Any]) -> Job:
        return tuple(row[key] for key in self.keys)

    def _is_half(self, line: str) -> bool:
        """Tell the beginning of a row, and no more: the file of somebody else is not touched."""
        begin = f'{{"{self.keys[0]}": '
        return not line.endswith("\n") and bool(line) and (line.startswith(begin) or begin.startswith(line))

    def _forget_half_line(self) -> None:
        """Cut off what a killed run, or a full disk, left of a line: its case is computed again."""
        content = self.path.read_bytes() if self.path.exists() else b""
        kept = content.rfind(b"\n") + 1
        if self._is_half(content[kept:].decode("utf-8", "replace")):
            with self.path.open("rb+") as file:
                file.truncate(kept)


def _results(jobs: Sequence[Job], one: Callable[..., Row], workers: int) -> Iterator[Row]:
    """Rows as they end."""
    if workers == 1:
        yield from (one(*job) for job in jobs)
        return
    with model_workers(workers) as pool:
        yield from (done.result() for done in as_completed({pool.submit(one, *job) for job in jobs}))
