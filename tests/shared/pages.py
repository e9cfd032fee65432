"""Pages of the documentation as a reader uses them: their files, their commands, and what they say one sees."""

import contextlib
import io
import re
import shlex
from collections.abc import Callable, Collection, Mapping
from pathlib import Path

from small_library import all_but

from studies.cli import build, main
from studies.diagnosis import read_measurement

DOCS = Path(__file__).parents[2] / "docs"
BLOCK = re.compile(
    r"^```(?:\{code-block\} )?(?P<kind>\w+)\n(?::caption: (?P<file>[^\s,]+)[^\n]*\n)?(?P<text>.*?)^```", re.M | re.S
)
INCLUDED = re.compile(r"^```\{literalinclude\} (\S+)\n:caption: (\S+)\n```", flags=re.MULTILINE)
OF_EVERY_COMMAND = {"--tyre", "--pressure", "--surface", "--extrapolate", "--verbose", "--effects"}


def page(name: str) -> str:
    """The text of a page in docs, by its name without an ending, with the files that it includes."""
    text = (DOCS / f"{name}.md").read_text(encoding="utf-8")
    return INCLUDED.sub(lambda m: f"```{{code-block}} text\n:caption: {m[2]}\n{(DOCS / m[1]).read_text()}```", text)


def section(name: str, heading: str) -> str:
    """The text below a heading of second order on a page, up to the next one."""
    _, _, text = page(name).partition(f"\n## {heading}\n")
    assert text, f"no section {heading!r} on the page {name}"
    return text.partition("\n## ")[0]


def blocks(text: str, kind: str) -> list[str]:
    """Blocks of a kind without a caption."""
    return [block["text"] for block in BLOCK.finditer(text) if block["kind"] == kind and not block["file"]]


def write_files(text: str, folder: Path) -> Path:
    """Write what the page shows into a folder; the folder."""
    for block in BLOCK.finditer(text):
        if block["file"]:
            (folder / block["file"]).write_text(block["text"], encoding="utf-8")
    return folder


def without_files(text: str) -> str:
    """The page without the files that it shows, for pages with commands before the files."""
    return BLOCK.sub(lambda block: "" if block["file"] else block[0], text)


def run_page(text: str, typed: Callable[[list[str]], list[str]] = list) -> list[str]:
    """Run the page in the working directory; what was shown, one text for each block of commands or Python.

    A block with a caption is a file, or lines to fill in where the file is there; ``bash`` are commands of velotyre,
    whose words may be changed as they are ``typed``; ``python`` is a script. A ``text`` block is what the block before
    it showed, on either stream: its parts between lines ``...`` in this order, white space aside.
    """
    shown: list[str] = []
    for block in BLOCK.finditer(text):
        kind, content = block["kind"], block["text"]
        if block["file"]:
            path = Path(block["file"])
            path.write_text(_filled_in(path.read_text(), content) if path.exists() else content, encoding="utf-8")
        elif kind in ("bash", "python"):
            with contextlib.redirect_stdout(io.StringIO()) as said, contextlib.redirect_stderr(said):
                if kind == "python":
                    exec(compile(content, "page", "exec"), {"__name__": "page"})
                for line in content.replace("\\\n", " ").splitlines() if kind == "bash" else ():
                    program, *words = shlex.split(line, comments=True)
                    assert program == "velotyre", line
                    main(typed(words))
            shown.append(said.getvalue())
        elif kind == "text":
            _see(content, shown[-1])
    return shown


def few_hypotheses(tried: Mapping[str, Collection[str]]) -> Callable[[list[str]], list[str]]:
    """Let the diagnosis of a file try only what stands beside its name; the blind test tries the whole library."""

    def typed(words: list[str]) -> list[str]:
        if words[0] != "diagnose" or words[1] not in tried:
            return words
        return [*words, *(f"--without={name}" for name in all_but(read_measurement(words[1]), tried[words[1]]))]

    return typed


def missing_options(command: str, text: str) -> list[str]:
    """Options of a ``command``, without those of every command, that a text does not name."""
    shown = [p for p in build().get_command(None, command).params if not getattr(p, "hidden", False)]
    options = {option for p in shown for option in p.opts if option.startswith("--")} - OF_EVERY_COMMAND
    return [one for one in sorted(options) if not re.search(rf"(?<![\w-]){re.escape(one)}(?![\w-])", text)]


def _filled_in(text: str, given: str) -> str:
    lines = text.splitlines()
    for line in given.splitlines():
        (place,) = [n for n, one in enumerate(lines) if one.startswith(line.partition("=")[0])]
        assert "# FILL IN" in lines[place]
        lines[place] = line
    return "\n".join(lines) + "\n"


def _see(claimed: str, shown: str) -> None:
    rest = " ".join(shown.split())
    for part in re.split(r"^\.\.\.$", claimed, flags=re.M):
        words = " ".join(part.split())
        assert words in rest, f"the page says\n{words}\nwhere this was shown\n{rest}"
        rest = rest.partition(words)[2]
