"""Run a page of the documentation as a reader would: write its files, type its commands, see what it says one sees."""

import contextlib
import io
import re
import shlex
from pathlib import Path

from studies.cli import main

BLOCK = re.compile(
    r"^```(?:\{code-block\} )?(?P<kind>\w+)\n(?::caption: (?P<file>\S+)\n)?(?P<text>.*?)^```", re.M | re.S
)


def run_page(text: str) -> list[str]:
    """Run the page in the working directory; what was shown, one text for each block of commands or Python.

    A block with a caption is a file, ``bash`` are commands of velotyre, ``python`` a script. A ``text`` block is what
    the block before it showed, on either stream: its parts between lines ``...`` in this order, white space aside.
    """
    shown: list[str] = []
    for block in BLOCK.finditer(text):
        kind, content = block["kind"], block["text"]
        if block["file"]:
            Path(block["file"]).write_text(content, encoding="utf-8")
        elif kind in ("bash", "python"):
            with contextlib.redirect_stdout(io.StringIO()) as said, contextlib.redirect_stderr(said):
                _commands(content) if kind == "bash" else exec(compile(content, "page", "exec"), {"__name__": "page"})
            shown.append(said.getvalue())
        elif kind == "text":
            _see(content, shown[-1])
    return shown


def _commands(text: str) -> None:
    for line in text.replace("\\\n", " ").splitlines():
        program, *arguments = shlex.split(line, comments=True)
        assert program == "velotyre", line
        main(arguments)


def _see(claimed: str, shown: str) -> None:
    """Whether what the page claims was shown."""
    rest = " ".join(shown.split())
    for part in re.split(r"^\.\.\.$", claimed, flags=re.M):
        words = " ".join(part.split())
        assert words in rest, f"the page says\n{words}\nwhere this was shown\n{rest}"
        rest = rest.partition(words)[2]
