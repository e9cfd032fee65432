"""Markdown and HTML of reports: whatever a user's file says stays text, and never becomes markup that runs."""

from collections.abc import Sequence
from typing import Any

from markupsafe import Markup

SPECIAL = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;", "[": "&#91;", "]": "&#93;", "\n": " ", "\r": " "})
"""What opens a tag or a link, and a line's end, behind which a heading or a table could begin."""


def plain(text: object) -> str:
    """The ``text`` as Markdown shows it: no tag, no link, no picture, on one line."""
    return str(text).translate(SPECIAL)


def cell(text: object) -> str:
    """The ``text`` as :func:`plain`, for a cell of a table: no ``|`` in it begins another."""
    return plain(text).replace("|", "&#124;")


def cells(row: Sequence[object]) -> Markup:
    """A ``row`` of a table, each cell escaped that is no ``Markup``; in a template ``row|cells``."""
    return Markup(" | ".join(str(x) if hasattr(x, "__html__") else cell(x) for x in row))


def code(text: object) -> str:
    """The ``text`` between backticks, in which nothing is markup."""
    if "`" in str(text):
        return plain(text).replace("`", "&#96;")
    return f"`{' '.join(str(text).splitlines())}`"


def rendered(template: str, content: dict[str, Any]) -> str:
    """A Markdown ``template`` filled with the ``content``, every value of it escaped that is no ``Markup``.

    Parameters
    ----------
    template : str
        Of jinja2; what it does not know is an error.
    content : mapping of str to value
        Values by name; text that is Markdown itself is given as ``Markup``.
    """
    import jinja2

    environment = jinja2.Environment(
        autoescape=True, finalize=_escaped, undefined=jinja2.StrictUndefined, keep_trailing_newline=True
    )
    environment.filters["cells"] = cells
    return str(environment.from_string(template).render(**content))


def _escaped(value: object) -> object:
    """``value`` as Markdown text, of which jinja's own escaping, made for HTML, then changes nothing."""
    if hasattr(value, "__html__"):
        return value
    return Markup("\n".join(plain(line) for line in str(value).split("\n")))


def html_template(text: str) -> Any:
    """The HTML template of jinja2 in ``text``, ready to be filled: every value of it is escaped that is no ``Markup``.

    Parameters
    ----------
    text : str
    """
    import jinja2

    environment = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    return environment.from_string(text)


def page(template: str, *, title: str, text: str, extensions: Sequence[Any], **settings: Any) -> str:
    """The HTML ``template`` with the ``title`` and the Markdown ``text`` in it.

    Parameters
    ----------
    template : str
        Of jinja2, with ``title`` and ``body``.
    title, text : str
    extensions : sequence of str
        Of the package markdown.
    **settings
        Further ones of ``markdown.markdown``.
    """
    import jinja2
    import markdown

    body = Markup(markdown.markdown(text, extensions=extensions, **settings))
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, keep_trailing_newline=True)
    return str(environment.from_string(template).render(title=title, body=body))
