"""Cases of a long count, kept as they end: one JSON object a line, so that an interrupted count goes on."""

import json
import traceback
from collections.abc import Callable, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bicycle.effect_registry import model_workers
from tyre.errors import InputError

Row = dict[str, Any]
Job = tuple[Any, ...]


def what_was_raised(error: Exception) -> str:
    """Kind, words and place of an ``error``, for the row of its case."""
    where = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} ({Path(where.filename).name}, line {where.lineno})"


@dataclass(frozen=True)
class KeptCases:
    """File of the cases of a count."""

    path: Path
    keys: tuple[str, ...]
    also: tuple[str, ...] = ()
    what: str = "the cases of such a count"
    remedy: str = "give another --out"

    def read(self) -> list[Row]:
        """Rows so far; InputError where the file is something else."""
        if not self.path.exists():
            return []
        try:
            lines = self.path.read_text(encoding="utf-8").splitlines(keepends=True)
            if lines and self._is_half(lines[-1]):
                lines.pop()
            rows: list[Row] = [json.loads(line) for line in lines if line.strip()]
            if not all({*self.keys, *self.also} <= set(row) for row in rows):
                raise ValueError(f"a row without {', '.join((*self.keys, *self.also))}")
        except (TypeError, ValueError) as error:
            raise InputError(f"{self.path}: not {self.what} ({error}); {self.remedy}") from error
        return rows

    def computed(self, jobs: Sequence[Job], one: Callable[..., Row], *, workers: int, what: str) -> list[Row]:
        """Rows of some ``jobs``, in their order; those that the file lacks are computed, and appended as they end."""
        from tyre.progress import progress_bar

        known = {self._job(row): row for row in self.read()}
        todo = [job for job in jobs if job not in known]
        self._forget_half_line()
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with model_workers(workers) as pool, progress_bar(total=len(todo), desc=what, unit=" cases") as bar:
            for future in as_completed({pool.submit(one, *job) for job in todo}):
                row = future.result()
                known[self._job(row)] = row
                with self.path.open("a", encoding="utf-8") as file:  # not before: a run killed now leaves no empty one
                    file.write(json.dumps(row) + "\n")
                bar.update()
        return [known[job] for job in jobs]

    def _job(self, row: Row) -> Job:
        return tuple(row[key] for key in self.keys)

    def _is_half(self, line: str) -> bool:
        """Whether a line is the beginning of a row, and no more: the file of somebody else is not touched."""
        begin = f'{{"{self.keys[0]}": '
        return not line.endswith("\n") and bool(line) and (line.startswith(begin) or begin.startswith(line))

    def _forget_half_line(self) -> None:
        """Cut off what a killed run, or a full disk, left of a line: its case is computed again."""
        if not self.path.exists():
            return
        content = self.path.read_bytes()
        kept = content.rfind(b"\n") + 1
        if self._is_half(content[kept:].decode("utf-8", "replace")):
            with self.path.open("rb+") as file:
                file.truncate(kept)
