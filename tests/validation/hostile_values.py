"""Does every value that no one means end in one clear line or in numbers? Options of all commands, keys of all files.

Each option of each command, and each key of each kind of file, gets values that a program makes by mistake: what is no
number, what is too large or too small, digits of another script, wrong types, nothing, the key left out, twice or
nested, or a number far from what it was; alone, in place of a number or a word within a valid text, and two at a time.
What is computed after the checks is computed, but for the long studies, whose last step is left out. An error of one
line (exit 2) and numbers without NaN are right; anything else is a failure: traceback, warning, over 5 s, over 1 GB. A
kind whose valid text is not read ends the study, which would test nothing of it.
"""

import copy
import math
import random
import re
import shlex
import shutil
import signal
import time
import tomllib
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import chdir, redirect_stderr, redirect_stdout
from datetime import date
from datetime import time as clock
from functools import partial, reduce
from importlib import import_module
from importlib.resources import as_file
from io import StringIO
from multiprocessing import get_context
from operator import getitem
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest.mock import patch

import click
import tomli_w

from bicycle import load_bicycle, registry
from studies.cli import build, main
from studies.model_space import typical_values
from tyre.ground import InputError, data_root

ENDS = ("numbers", "checked", "refused", "failed")
INPUTS = Path(__file__).parents[1] / "golden" / "inputs"
with Path(__file__).with_suffix(".toml").open("rb") as stream:
    VALID = tomllib.load(stream)
LINES: dict[str, str] = VALID["lines"]
TEXTS = ["", " ", "\0", "\n", str(10**30), "9" * 5000, "x" * 3000, *VALID["texts"]]
NUMBERS = [x for x in TEXTS if re.search(r"\d|nan|inf|^$", x)]
VALUES: list[Any] = [
    *(math.nan, math.inf, -math.inf, 1e308, -1e308, 1e-320, -0.0, 0, -1, 1, 0.5, 1e-9, 1e6, 10**30, -(10**400), 2**63),
    *(True, False, "", " ", ".", "..", "nan", "5", "x" * 3000, "٣", "1 +/- nan", "1+/-1e400", "\0", "é", [], [[]], {}),
    *([math.nan], [0, 1, 2], ["x"], [1, "x"], [True], {"rear": 1e308, "front": -0.0}, {"rear": 1}, {"sd": math.nan}),
    *({"from": 0, "to": math.inf, "count": 3}, {"a": {"b": {"c": []}}}, {"low": 1, "high": 1}),
    *(date(2020, 1, 1), clock(7, 32)),
]


class Hang(BaseException):
    """An input without an end after 5 s."""


class Reached(Exception):
    """All options are checked: the long part begins."""


def leaves(command: click.Command, name: str = "") -> Iterator[tuple[str, click.Command]]:
    """Commands below a group with their full names."""
    if not isinstance(command, click.Group):
        yield name, command
        return
    context = click.Context(command)
    for below in command.list_commands(context):
        yield from leaves(command.get_command(context, below), f"{name} {below}".strip())  # type: ignore[arg-type]


def spoilt_text(example: str, rng: random.Random) -> str:
    """A hostile text: whole, or within a valid one in place of a number, a word or a mark."""
    places = list(re.finditer(r"\d[\d.]*|\w+|\W", example))
    if not places or rng.random() < 0.4:
        return rng.choice(TEXTS)
    one = rng.choice(places)
    return example[: one.start()] + rng.choice(NUMBERS if one[0][0].isdigit() else TEXTS) + example[one.end() :]


def hostile_line(name: str, command: click.Command, rng: random.Random) -> list[str]:
    """Arguments of a command: one to three options, each with a hostile text."""
    words = shlex.split(LINES[name])
    options = [one for one in command.params if one.param_type_name == "option" and one.expose_value]
    for option in rng.sample(options, min(len(options), rng.choice((1, 1, 2, 3)))):
        flag = option.opts[0]
        if getattr(option, "is_flag", False):
            words.append(flag)
            continue
        given = VALID["examples"].get(flag, str(option.default) if isinstance(option.default, int | float) else "1")
        texts = [spoilt_text(given, rng) for _ in range(option.nargs)]
        if flag in words and not option.multiple:
            at = words.index(flag)
            del words[at : at + 1 + option.nargs]
        words += [flag, *texts] if option.nargs > 1 or rng.random() < 0.5 else [f"{flag}={texts[0]}"]
    if rng.random() < 0.05 and len(words) > 1:
        words[1] = rng.choice(TEXTS)
    return words


def places(content: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths to every key and entry of a file, of lists to the first three."""
    inside = range(min(len(content), 3)) if isinstance(content, list) else content if isinstance(content, dict) else ()
    for key in inside:
        yield (*path, key)
        yield from places(content[key], (*path, key))


def spoilt_content(content: dict[str, Any], rng: random.Random) -> dict[str, Any]:
    """The content of a file with one to three keys given a hostile value, left out, renamed, doubled or nested."""
    found = copy.deepcopy(content)
    for path in rng.choices(list(places(found)), k=rng.choice((1, 1, 2, 3))):
        way = rng.randrange(-8, len(VALUES) + 5)
        try:
            home = reduce(getitem, path[:-1], found)
            old = home[path[-1]]
        except (KeyError, IndexError, TypeError):
            continue  # the first damage took the place of the second
        if way < 0 and type(old) in (int, float) and abs(old) < 1e9:
            home[path[-1]] = type(old)(old * rng.choice((-1, 1, 1, 1)) * 10.0 ** rng.uniform(-6, 6))
        elif way < len(VALUES) and not isinstance(home, str):
            home[path[-1]] = copy.deepcopy(VALUES[way])
        elif way == len(VALUES) and not isinstance(home, str):
            del home[path[-1]]
        elif isinstance(home, dict) and way < len(VALUES) + 3:
            home[str(path[-1]) + "_x" if way % 2 else str(path[-1]).swapcase()] = copy.deepcopy(old)
        elif not isinstance(home, str):
            home[path[-1]] = [old] if way % 2 else {str(path[-1]): old}
    return found


def files() -> dict[str, tuple[dict[str, Any], str, str]]:
    """Kinds of files: name -> valid content; the command, or the door with its arguments, that reads it; its place."""

    def opened(path: str | Path) -> dict[str, Any]:
        with as_file(data_root()) as data:
            return tomllib.loads((data / path).read_text(encoding="utf-8"))

    inputs = {name: (opened(INPUTS / file), reader, "given.toml") for name, (file, reader) in VALID["inputs"].items()}
    found = inputs | {name: (opened(file), *rest) for name, (file, *rest) in VALID["packaged"].items()}
    found["histories"][0]["histories"]["runs"] = found["histories"][0]["histories"]["runs"][:2]
    benchmark = load_bicycle("benchmark")
    bicycle = {"description": "x", "values": dict(benchmark.values), "sd": {"c": 0.005}}
    found["bicycle"] = (bicycle, "critical FILE", "given.toml")
    found["channel map"] = (VALID["map"], "look run/recording.csv --channels FILE", "given.toml")
    for sidecar in sorted(Path("campaign").glob("*.toml"))[:1]:
        found["sidecar"] = (opened(sidecar.resolve()), "tyre.fits.recording_files:read_recording", str(sidecar))
    for effect in registry().values():
        values = typical_values(effect, benchmark)
        tyred = {"relaxation_length": {"tyre": "Tyre1", "pressure_bar": 5.5}} if effect.slot != "contact law" else {}
        if values:
            content = {"bicycle": "benchmark", "effects": tyred | {effect.identifier: values}}
            found[f"effect {effect.identifier}"] = (content, "critical FILE", "given.toml")
    return found


def read_by(reader: str, file: Path) -> None:
    """Give a file to the ``reader``: a line of the command, or ``module:function`` and what it takes beside."""
    first, *rest = shlex.split(reader.replace("FILE", str(file)))
    module, _, name = first.partition(":")
    if name:
        getattr(import_module(module), name)(str(file) if name == "settings_of" else file, *rest)
    else:
        main([first, *rest])


def prepared(folder: Path) -> Path:
    """Put what valid lines name into a ``folder`` and give it."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    for file in INPUTS.iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
    with as_file(data_root()) as data:
        for name in ("tyres", "measured", "riders"):
            shutil.copytree(data / name, folder / name)
    with chdir(folder), redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        for line in VALID["setting"]["lines"]:
            main(shlex.split(line))
    return folder.resolve()


def _alarm(*_: object) -> None:
    raise Hang


def outcome(action: Callable[[], Any], later: str = "") -> tuple[str, str]:
    """Run an ``action``: "numbers", "checked" (the long part would begin), "refused" or "failed", and what was said."""
    out, err = StringIO(), StringIO()
    signal.signal(signal.SIGPROF, _alarm)
    signal.setitimer(signal.ITIMER_PROF, 5.0)  # s of processor: the clock tells of other work, too
    try:
        with redirect_stdout(out), redirect_stderr(err), warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always")
            if later:
                with patch(later, side_effect=Reached):
                    action()
            else:
                action()
        end = "numbers"
    except Reached:
        end = "checked"
    except (InputError, OSError) as error:
        err.write(f"velotyre: {error}\n")
        end = "refused"
    except SystemExit as stop:
        end = "refused" if stop.code == 2 else "failed"
    except Hang:
        return "failed", "hang: no end after 5 s"
    except Exception as error:
        trace = error.__traceback__
        while trace is not None and trace.tb_next is not None:
            trace = trace.tb_next
        where = f"{Path(trace.tb_frame.f_code.co_filename).name}:{trace.tb_lineno}" if trace else ""
        return "failed", f"{type(error).__name__}: {str(error)[:200]} ({where})"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    if warned:
        return "failed", f"warning: {str(warned[0].message)[:200]} ({Path(warned[0].filename).name}:{warned[0].lineno})"
    lines = [line for line in err.getvalue().splitlines() if line.startswith("velotyre: ")]
    if end == "refused" and (len(lines) != 1 or len(lines[0]) < 20):
        return "failed", f"refused in {len(lines)} lines: {err.getvalue()[-200:]}"
    if end == "numbers" and re.search(r"(?<![\w-])nan\b(?!:)", out.getvalue(), re.IGNORECASE):
        return "failed", f"NaN in what is shown: {out.getvalue()[-200:]}"
    return end, lines[0] if lines else ""


def attacked(kind: str, seed: int, inputs: int, seconds: float) -> Counter[str]:
    """Count how ``inputs`` end of a command (``-name``) or of the readers of a kind of file, for so long at most."""
    name = kind.removeprefix("-")
    command = dict(leaves(build())).get(name) if kind != name else None
    content, reader, place = ({}, "", "") if command is not None else files()[kind]

    def given(rng: random.Random | None) -> tuple[str, str]:
        if command is not None:
            words = shlex.split(LINES[name]) if rng is None else hostile_line(name, command, rng)
            return outcome(partial(main, words), VALID["later"].get(name, ""))
        text = tomli_w.dumps(content if rng is None else spoilt_content(content, rng))
        Path(place).write_text(text, encoding="utf-8")
        return outcome(partial(read_by, reader, Path(place)))

    end, said = given(None)
    if end not in ("numbers", "checked"):
        raise InputError(f"{kind}: its valid text ends {end} ({said}); nothing of it would be tested")
    ends: Counter[str] = Counter()
    deadline = time.process_time() + seconds
    for number in range(inputs):
        if time.process_time() > deadline:
            break
        end, said = given(random.Random(f"{seed} {kind} {number}"))
        ends[end] += 1
        if end == "failed":
            ends[f"{kind}, input {number}: {said}"] += 1
    return ends


def in_a_child(kind: str, seed: int, inputs: int, seconds: float) -> Counter[str]:
    """Count in a process of its own with 1 GB of memory more than it begins with."""
    import resource

    with Path("/proc/self/statm").open() as file:
        room = int(file.read().split()[0]) * resource.getpagesize() + 1_000_000_000
    resource.setrlimit(resource.RLIMIT_AS, (room, room))
    return attacked(kind, seed, inputs, seconds)


def run(*, out: Path, seed: int, inputs: int = 200_000, seconds: int = 40, kinds: str = "") -> dict[str, Any]:
    """Give up to so many ``inputs`` in all, for so many ``seconds`` a kind at most; ``kinds`` (a,b): only those."""
    every = kinds.split(",") if kinds else [*(f"-{name}" for name in LINES), *files(), "sidecar"]
    total: Counter[str] = Counter()
    by_kind = {}
    valid = prepared(out / "hostile_values")
    for kind in every:
        with (
            TemporaryDirectory() as name, chdir(shutil.copytree(valid, Path(name) / "here")),
            ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool,
        ):  # fmt: skip
            ends = pool.submit(in_a_child, kind, seed, -(-inputs // len(every)), seconds).result()
        by_kind[kind] = {end: ends[end] for end in ENDS if ends[end]}
        total += ends
    return {
        "by_kind": by_kind,
        "total": {end: total[end] for end in ENDS},
        "errors": {said: count for said, count in total.items() if said not in ENDS},
    }
