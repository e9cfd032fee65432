"""What do commands do with damaged files? Each must read them or refuse them with an error that is one line.

Valid files of every text format are damaged at random: characters, numbers, words and lines are changed, dropped,
doubled or put in, once to three times. Counted are what is read, what is refused and what ends in a traceback.
"""

import random
import re
import tempfile
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

from bicycle import load_bicycle
from studies.cli import main
from tyre.ground import data_root

ODD = ("nan", "inf", "-1", "0", "1e400", "1,5", '"', "=", "[", "]]", "#", "\t", "\x00", "é", "true", "{}", "10**9")
MODEL = """bicycle = "benchmark"
[effects.relaxation_length]
tyre = "Tyre1"
surface = "flat"
pressure_bar = {rear = 7.5, front = 5.5}
[effects.steer_damper]
damping = 1.0
"""
RECORDING = "time [s],roll rate [deg/s],steer [rad]\n" + "".join(
    f"{k / 100},{30 - k / 10},{0.01 * (k % 7)}\n" for k in range(40)
)


def examples() -> dict[str, tuple[str, str]]:
    """Give valid files: name -> command and content."""
    values = "".join(f"{key} = {value!r}\n" for key, value in load_bicycle("benchmark").values.items())
    table = data_root().joinpath("tyres", "Tyre1_flat.csv").read_text(encoding="utf-8")
    pacejka = data_root().joinpath("tyres", "schwalbe_energizer_plus_28x1.75.toml").read_text(encoding="utf-8")
    return {
        "mine.toml": ("bicycles", f"[values]\n{values}"),
        "mine.txt": ("bicycles", values),
        "mine.yml": ("bicycles", values.replace(" = ", ": ")),
        "tyre.csv": ("tyres", table),
        "tyre.toml": ("tyres", pacejka),
        "model.toml": ("critical", MODEL),
        "run.csv": ("look", RECORDING),
    }


def damaged(text: str, rng: random.Random) -> str:
    """Damage a ``text`` at one to three places."""
    for _ in range(rng.randint(1, 3)):
        lines = text.splitlines(keepends=True) or [""]
        k = rng.randrange(len(lines))
        way = rng.randrange(6)
        if way == 0:
            del lines[k]
        elif way == 1:
            lines.insert(k, rng.choice(lines))
        elif way == 2:
            lines[k] = lines[k][: rng.randint(0, len(lines[k]))]
        else:
            parts = re.split(r"([-+\d.e]+|\w+|\W)", lines[k])
            j = rng.randrange(len(parts))
            parts[j] = rng.choice(("", parts[j] * 2, rng.choice(ODD)))
            lines[k] = "".join(parts)
        text = "".join(lines)
    return text


def outcome(name: str, command: str, text: str) -> str:
    """Run a ``command`` on a file: "read", "refused", or the traceback in one line."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / name
        file.write_text(text, encoding="utf-8")
        said, erred = StringIO(), StringIO()
        try:
            with redirect_stdout(said), redirect_stderr(erred):
                main([command, str(file)])
        except SystemExit as end:
            lines = [line for line in erred.getvalue().splitlines() if line.startswith("velotyre: ")]
            return "refused" if end.code == 2 and len(lines) == 1 else f"exit {end.code}: {erred.getvalue()[-200:]}"
        except Exception as error:
            return f"{type(error).__name__}: {error}"
        return "read"


def run(*, out: Path, seed: int, inputs: int = 2000) -> dict[str, Any]:
    """Damage a number of ``inputs`` and count what commands do with them."""
    counts: dict[str, dict[str, int]] = {}
    failures = []
    files = list(examples().items())
    for number in range(inputs):
        name, (command, text) = files[number % len(files)]
        found = outcome(name, command, damaged(text, random.Random(1_000_003 * seed + number)))
        kind = found if found in ("read", "refused") else "failed"
        counts.setdefault(name, dict.fromkeys(("read", "refused", "failed"), 0))[kind] += 1
        if kind == "failed":
            failures.append({"input": number, "file": name, "what": found[:200]})
    return {"by_file": counts, "failures": failures[:20]}
