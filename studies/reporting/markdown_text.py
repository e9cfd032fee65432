"""Markdown and HTML of reports: whatever a user's file says stays text, and never becomes markup that runs."""

import re
from collections.abc import Mapping, Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from tyre.ground.files import write_text

if TYPE_CHECKING:
    import jinja2

SPECIAL = str.maketrans(
    {"&": "&amp;", "<": "&lt;", ">": "&gt;", "[": "&#91;", "]": "&#93;", "*": "&#42;", "\n": " ", "\r": " "}
)
"""Characters that open a tag, a link or emphasis, and a line's end, after which a heading or a table could begin."""


def escape_text(text: object) -> str:
    """Escape ``text`` for Markdown: no tag, no link, no picture, on one line."""
    return str(text).translate(SPECIAL)


def cell(text: object) -> str:
    """Escape ``text`` for a cell of a table: no ``|`` in it begins another."""
    return escape_text(text).replace("|", "&#124;")


def cells(row: Sequence[object]) -> Markup:
    """Join a ``row`` of a table, each cell escaped that is no ``Markup``; in a template ``row|cells``."""
    return Markup(" | ".join(str(x) if hasattr(x, "__html__") else cell(x) for x in row))


def code(text: object) -> str:
    """Put ``text`` between backticks, in which nothing is markup."""
    if "`" in str(text):
        return escape_text(text).replace("`", "&#96;")
    return f"`{' '.join(str(text).splitlines())}`"


def one_line(text: str) -> str:
    """Join the lines of a sentence that a template wrote; no space before its stops."""
    joined = re.sub(r" ([.,;])(?= |$)", r"\1", " ".join(text.split()))
    return Markup(joined) if hasattr(text, "__html__") else joined


def render_file(
    package: str,
    name: str,
    content: Mapping[str, Any],
    *,
    escaped: bool = True,
    filters: Mapping[str, Any] | None = None,
) -> str:
    """Fill the template ``name`` in the folder ``templates`` of a ``package``; ``escaped`` is False for a terminal."""
    environment = make_environment(package, escaped=escaped, trim_blocks=True, lstrip_blocks=True)
    if filters:  # of this template alone: the environment is that of all
        environment = environment.overlay()
        environment.filters = {**environment.filters, **filters}
    return re.sub(r"\n{3,}", "\n\n", environment.get_template(name).render(**content))


@cache
def make_environment(package: str = "", *, escaped: bool, **settings: Any) -> "jinja2.Environment":
    """Make an environment of jinja2, with the folder ``templates`` of a ``package``; ``escaped`` is for Markdown.

    It is made once, for a template takes longer to compile than to fill.
    """
    import jinja2

    if package:
        folder = resources.files(package).joinpath("templates")
        settings["loader"] = jinja2.FunctionLoader(lambda file: folder.joinpath(file).read_text(encoding="utf-8"))
    settings |= {"finalize": _escape if escaped else lambda value: value, "bytecode_cache": _code_cache()}
    environment = jinja2.Environment(autoescape=escaped, undefined=jinja2.StrictUndefined, **settings)
    environment.filters |= {"cells": cells, "oneline": one_line, "f": format}
    return environment


def _code_cache() -> "jinja2.BytecodeCache":
    """Make a cache of code, which overlays of an environment share; jinja's own cache is of one overlay."""
    import jinja2

    codes: dict[tuple[str, str], Any] = {}

    class Codes(jinja2.BytecodeCache):
        def load_bytecode(self, bucket: "jinja2.bccache.Bucket") -> None:
            bucket.code = codes.get((bucket.key, bucket.checksum))

        def dump_bytecode(self, bucket: "jinja2.bccache.Bucket") -> None:
            codes[bucket.key, bucket.checksum] = bucket.code

    return Codes()


def _escape(value: object) -> object:
    """Escape ``value`` as Markdown text, of which jinja's own escaping, made for HTML, then changes nothing."""
    if hasattr(value, "__html__"):
        return value
    return Markup("\n".join(escape_text(line) for line in str(value).split("\n")))


def html_template(text: str) -> Any:
    """Compile an HTML template of jinja2, in which every value is escaped that is no ``Markup``."""
    import jinja2

    return jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True).from_string(text)


def page(*, title: str, text: str, extensions: Sequence[Any] = ("tables",)) -> str:
    """Make the HTML of a report from its ``title`` and its Markdown ``text``; all reports share the style."""
    import jinja2
    import markdown

    template = resources.files("studies.reporting").joinpath("templates", "report.html.j2").read_text(encoding="utf-8")
    body = Markup(markdown.markdown(text, extensions=extensions))
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, keep_trailing_newline=True)
    return str(environment.from_string(template).render(title=title, body=body))


def write_page(folder: Path, *, title: str, text: str, extensions: Sequence[Any] = ("tables",)) -> Path:
    """Write the Markdown ``text`` of a report as ``folder``/report.html, under a ``title``; return the file."""
    file = folder / "report.html"
    write_text(file, page(title=title, text=text, extensions=extensions))
    return file
