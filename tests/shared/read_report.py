"""The text of a report as its reader sees it: the page report.html, with tables, headings and links as in Markdown."""

import math
from html.parser import HTMLParser
from pathlib import Path

AROUND = {"strong": "**", "code": "`", "em": "*"}
LITERAL = ("details", "summary")  # tests look for what a section folds


class _Text(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.parts: list[str] = []
        self.cells = 0  # of the current row of a table
        self.hidden = False

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        given = dict(attributes)
        if tag in ("style", "script", "title"):
            self.hidden = True
        elif tag in AROUND:
            self.parts.append(AROUND[tag])
        elif tag in LITERAL:
            self.parts.append(f"\n<{tag}>")
        elif tag[0] == "h" and tag[1:].isdigit():
            self.parts.append(f"\n{'#' * int(tag[1:])} ")
        elif tag == "tr":
            self.cells = 0
            self.parts.append("\n|")
        elif tag in ("td", "th"):
            self.cells += 1
            self.parts.append(" ")
        elif tag == "li":
            self.parts.append("\n- ")
        elif tag == "p":
            self.parts.append("\n")
        elif tag == "a":
            self.parts.append("[")
            self.target = given.get("href")
        elif tag == "img":
            self.parts.append(f"![{given.get('alt')}]({given.get('src')})")

    def handle_endtag(self, tag: str) -> None:
        if tag in ("style", "script", "title"):
            self.hidden = False
        elif tag in AROUND:
            self.parts.append(AROUND[tag])
        elif tag in LITERAL:
            self.parts.append(f"</{tag}>\n")
        elif tag in ("td", "th"):
            self.parts.append(" |")
        elif tag == "thead":
            self.parts.append("\n" + "|---" * self.cells + "|")
        elif tag == "a":
            self.parts.append(f"]({self.target})")
        elif tag in ("p", "table", "h1", "h2", "h3"):
            self.parts.append("\n")

    def handle_data(self, data: str) -> None:
        if not self.hidden:
            self.parts.append(data if data.strip() else " " * (data == " "))


def text_of_page(page: str) -> str:
    """Convert a page of HTML to text, for what a test looks for in it."""
    parser = _Text()
    parser.feed(page)
    return "".join(parser.parts)


def printed(value: float, sd: float) -> str:
    """A value and its sd, of 0.0001 or more, to the second digit of the sd."""
    places = 1 - math.floor(math.log10(sd))
    return " ± ".join(f"{round(x, places):.{max(places, 0)}f}" for x in (value, sd))


def read_report(folder: str | Path) -> str:
    """The text of the report in a ``folder``."""
    return text_of_page((Path(folder) / "report.html").read_text(encoding="utf-8"))
