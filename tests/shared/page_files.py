"""The files that a page of the documentation shows, each under its caption."""

import re
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"
BLOCK = re.compile(r"^```\{code-block\} \w+\n:caption: (\S+)\n(.*?)^```", flags=re.MULTILINE | re.DOTALL)
INCLUDED = re.compile(r"^```\{literalinclude\} (\S+)\n:caption: (\S+)\n```", flags=re.MULTILINE)


def page(name: str) -> str:
    """The text of a page in docs, by its name without an ending, with the files that it includes."""
    text = (DOCS / f"{name}.md").read_text(encoding="utf-8")
    return INCLUDED.sub(lambda m: f"```{{code-block}} text\n:caption: {m[2]}\n{(DOCS / m[1]).read_text()}```", text)


def write_files(text: str, folder: Path) -> Path:
    """Write what the page shows into a folder; the folder."""
    for name, content in BLOCK.findall(text):
        (folder / name).write_text(content, encoding="utf-8")
    return folder
