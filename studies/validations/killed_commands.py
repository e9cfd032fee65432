"""What long commands leave when they are killed, interrupted or starved: no half file, no traceback, no orphan.

Each command is killed (kill -9) at random moments of its run, into one folder again and again. After each kill every
file under its final name must be whole, every process of the command must end, and what stands in the manifest must say
so; every fifth time the command runs to its end, and what it wrote must be what it writes undisturbed, to the last
byte. Interrupts (Ctrl-C, to the whole group of processes) must end it within 2 s without a traceback. Starved means
files limited to 2000 bytes (as a full disk), a folder that may not be written, and no HOME: an error with the name of
the file, without a traceback. Needs a system with fork.
"""

import io
import json
import os
import random
import re
import shutil
import signal
import tempfile
import time
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

from studies.validations._killed_inputs import COMMANDS, prepare
from studies.validations._killed_processes import ended, session, started, waited
from studies.validations._killed_starved import STARVED
from tyre.base.errors import InputError
from tyre.base.files import left_by_a_killed_run

AT_ONCE = 2.0  # s from an interrupt to the end
ORPHANED = 10.0  # s after which a process that outlives a killed command is an orphan
RERUN_EVERY = 5
LONGEST = 400  # characters that are kept of what a command said


def run(
    *, out: Path, seed: int, kills: int = 50, interrupts: int = 100, only: str = "", minutes: int = 0
) -> dict[str, Any]:
    """Kill, interrupt and starve commands.

    Parameters
    ----------
    out : Path
        Gets nothing but the result.
    seed : int
        Of the moments.
    kills : int
        Number of kills of each command.
    interrupts : int
        Number of interrupts of all commands together.
    only : str
        Names of commands, separated by commas; empty: all.
    minutes : int
        Number of minutes after which no further command is begun; 0: all are.

    Returns
    -------
    dict
        Counts by command.
    """
    from tyre.base.progress import progress_bar

    if not hasattr(os, "fork"):
        raise InputError("killed-commands needs a system with fork, such as Linux")
    wanted = only.split(",") if only else list(COMMANDS)
    rng = random.Random(seed)
    by_command: dict[str, Any] = {}
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as root:
        Path(root).chmod(0o755)
        prepare(Path(root))
        for name in progress_bar(wanted, desc="commands"):
            if minutes and time.monotonic() - began > 60 * minutes:
                break
            by_command[name] = _one(name, Path(root), rng, kills, -(-interrupts // len(wanted)))
    bad = ("half_files", "reruns_that_differ", "orphans", "late", "tracebacks", "unnamed")
    total = {key: sum(row[key] for row in by_command.values()) for key in ("kills", "interrupts", "starved", *bad)}
    return {
        "what": "long commands killed, interrupted and starved at random moments",
        "made_by": f"velotyre validate killed-commands --seed {seed} --kills {kills} --interrupts {interrupts}"
        + f" --only {only}" * bool(only),
        "seed": seed, "total": total, "by_command": by_command, "not_reached": wanted[len(by_command) :],
        "targets": dict.fromkeys(bad, 0), "met": {key: total[key] == 0 for key in bad},
    }  # fmt: skip


def _one(name: str, root: Path, rng: random.Random, kills: int, interrupts: int) -> dict[str, Any]:
    folder = root / name
    arguments = [part.format(out=folder / "out", data=root) for part in COMMANDS[name]]
    _warm(arguments, folder)
    folder.mkdir()
    began = time.monotonic()
    code, said = ended(started(arguments, folder))
    if code:
        raise InputError(f"{name}: the command does not run undisturbed: {said[-300:]}")
    took = time.monotonic() - began
    truth = _contents(folder)
    row: dict[str, Any] = {"seconds": round(took, 2)} | dict.fromkeys(
        ("kills", "killed_at_work", "half_files", "orphans", "reruns", "reruns_that_differ", "interrupts",
         "interrupted_at_work", "late", "starved", "tracebacks", "unnamed"), 0
    ) | {"worst_s": 0.0, "found": []}  # fmt: skip
    shutil.rmtree(folder)
    for number in range(1, kills + 1):
        folder.mkdir(exist_ok=True)
        _kill(arguments, folder, rng.uniform(0.0, took), row)
        if number % RERUN_EVERY == 0 or number == kills:
            code, said = ended(started(arguments, folder))
            row["reruns"] += 1
            differs = _differences(truth, _contents(folder))
            if code or differs:
                row["reruns_that_differ"] += 1
                row["found"].append(f"after kill {number}: exit {code}, {differs or kept(said)}")
            shutil.rmtree(folder)
    for _ in range(interrupts):
        folder.mkdir(exist_ok=True)
        _interrupt(arguments, folder, rng.uniform(0.0, took), row)
        shutil.rmtree(folder)
    for way, restrict in STARVED.items():
        folder.mkdir()
        folder.chmod(0o555 if way == "read-only folder" else 0o777)
        code, said = ended(started(arguments, folder, restrict))
        row["starved"] += 1
        _judge_starved(way, code, said, row)
        shutil.rmtree(folder)
    row["worst_s"] = round(row["worst_s"], 2)
    return row


def _warm(arguments: list[str], folder: Path) -> None:
    """Run it here, so that its children begin with modules and equations at hand and are killed at their work.

    Not a sweep: its libraries start threads, which a child would miss.
    """
    from studies.cli import main

    if arguments[0] == "sweep":
        folder.mkdir()
        ended(started(arguments, folder))  # compiled kernels are kept on the disk
        shutil.rmtree(folder)
        return
    folder.mkdir()
    before, said = os.getcwd(), io.StringIO()
    with redirect_stdout(said), redirect_stderr(said):
        try:
            os.chdir(folder)
            main(arguments)
        except SystemExit as error:
            raise InputError(f"{arguments[0]}: does not run undisturbed: {said.getvalue()[-300:]}") from error
        finally:
            os.chdir(before)
    shutil.rmtree(folder)


def _kill(arguments: list[str], folder: Path, moment: float, row: dict[str, Any]) -> None:
    process = started(arguments, folder)
    at_work = waited(process, moment) is None
    row["kills"] += 1
    if at_work:
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)
        row["killed_at_work"] += 1
    left = time.monotonic() + ORPHANED
    while (alive := session(process)) and time.monotonic() < left:
        time.sleep(0.05)
    row["orphans"] += len(alive)
    for orphan in alive:
        os.kill(orphan, signal.SIGKILL)
    half = [why for file in sorted(folder.rglob("*")) if file.is_file() and (why := _not_whole(file))]
    row["half_files"] += len(half)
    row["found"] += half


def _interrupt(arguments: list[str], folder: Path, moment: float, row: dict[str, Any]) -> None:
    process = started(arguments, folder)
    row["interrupts"] += 1
    if waited(process, moment) is not None:
        return
    row["interrupted_at_work"] += 1
    os.killpg(process, signal.SIGINT)
    began = time.monotonic()
    code, said = ended(process)
    took = time.monotonic() - began
    row["worst_s"] = max(row["worst_s"], took)
    row["late"] += took > AT_ONCE
    if "Traceback" in said or code not in (0, 130):
        row["tracebacks"] += 1
        row["found"].append(f"interrupted after {moment:.2f} s: exit {code}, {kept(said)}")
    row["orphans"] += len(session(process))


def kept(said: str) -> str:
    """The last lines of what a command ``said``, without the folders of the machine that it ran on."""
    lines = re.sub(r'File "[^"]*[/\\]([^"/\\]+)"', r'File "\1"', said).splitlines(keepends=True)
    while len(lines) > 1 and sum(map(len, lines)) > LONGEST:
        del lines[0]
    return "".join(lines)


def _judge_starved(way: str, code: int, said: str, row: dict[str, Any]) -> None:
    if "Traceback" in said or code not in (0, 2):
        row["tracebacks"] += 1
        row["found"].append(f"{way}: exit {code}, {kept(said)}")
    elif code == 2 and not any(mark in said.splitlines()[-1] for mark in ("/", "out")):
        row["unnamed"] += 1
        row["found"].append(f"{way}: {kept(said)}")
    elif (code == 0) != (way == "no home"):
        row["unnamed"] += 1
        row["found"].append(f"{way}: exit {code}, {kept(said)}")


def _contents(folder: Path) -> dict[str, bytes]:
    """Files by name; of the results of a blind test without the time that a case took."""
    found = {file.relative_to(folder).as_posix(): file.read_bytes() for file in folder.rglob("*") if file.is_file()}
    return {name: re.sub(rb'"seconds": [\d.]+', b"", x) if name.endswith(".jsonl") else x for name, x in found.items()}


def _differences(truth: dict[str, bytes], found: dict[str, bytes]) -> list[str]:
    return sorted(name for name in truth.keys() | found.keys() if truth.get(name) != found.get(name))[:5]


def _not_whole(file: Path) -> str:
    """What is half about a file under its final name; empty where nothing is."""
    if left_by_a_killed_run(file.name) or file.suffix == ".tmp" or ".partial" in str(file) or ".export" in str(file):
        return ""
    content = file.read_bytes()
    ends = {
        ".svg": b"</svg>",
        ".html": b"</html>",
        ".png": b"IEND\xaeB`\x82",
        ".csv": b"\n",
        ".md": b"\n",
        ".jsonl": b"\n",
    }
    end = ends.get(file.suffix)
    if end is not None and not content.rstrip(b" \n" if file.suffix in (".svg", ".html") else b" ").endswith(end):
        return f"{file.name} ends with {content[-20:]!r}"
    if file.suffix == ".json":
        try:
            json.loads(content)
        except ValueError:
            return f"{file.name} is no JSON"
    return ""
