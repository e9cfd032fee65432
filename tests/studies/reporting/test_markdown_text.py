"""What a user's file says stays text in every report: no tag, link or picture comes out of a name."""

import ast
import html
import re
from html.parser import HTMLParser
from pathlib import Path

import pytest
from jinja2 import UndefinedError
from markdown import markdown
from markupsafe import Markup

from studies.reporting import cell, cells, code, escape_text, make_environment, page, render_file

ROOT = Path(__file__).parents[3]
HOSTILE = (
    "<script>alert(1)</script>", "<img src=x onerror=alert(1)>", "[click](javascript:alert(1))", "&lt;script&gt;",
    "![x](http://a/b.png)", "<http://a>", "a\n# heading", "a\n\n<script>", "on*, flexible*", "**a**",
    '"><svg onload=alert(1)>', "</title><script>",
)  # fmt: skip


class Tags(HTMLParser):
    def __init__(self):
        super().__init__()
        self.found, self.text = [], ""

    def handle_starttag(self, tag, attrs):
        self.found.append(tag)

    def handle_data(self, data):
        self.text += data


def tags(text):
    parser = Tags()
    parser.feed(text)
    return parser.found, parser.text


@pytest.mark.parametrize("name", HOSTILE)
def test_a_name_is_shown_as_it_is(name):
    found, text = tags(markdown(f"Tyre {escape_text(name)} here", extensions=["tables", "md_in_html"]))
    assert found == ["p"]
    assert " ".join(text.split()) == " ".join(f"Tyre {name} here".split())


def rendered(template, **content):
    return make_environment(escaped=True, keep_trailing_newline=True).from_string(template).render(**content)


@pytest.mark.parametrize("name", HOSTILE)
def test_a_template_escapes_every_value(name):
    text = rendered("# {{ name }}\n\n{% for n in names %}- {{ n }}\n{% endfor %}\n{{ rows|join(' | ') }}\n",
                    name=name, names=[name, 3], rows=["a", name])  # fmt: skip
    found, _ = tags(markdown(text, extensions=["tables", "md_in_html"]))
    assert not set(found) - {"h1", "ul", "li", "p"}


def test_a_name_with_a_bar_stays_in_its_cell():
    name = "a|b [c](d)"
    rows = f"| {cells([name, 3])} |\n| {{{{ row|cells }}}} |"
    text = rendered(f"| x | y |\n|---|---|\n{rows}\n", row=[name, Markup("`n`")])
    found = html.unescape(markdown(text, extensions=["tables"]))
    assert found.count(f"<td>{name}</td>") == 2
    assert found.count("<td>") == 4
    assert cell("x|y") == "x&#124;y"


def test_a_value_that_a_template_lacks_is_an_error():
    with pytest.raises(UndefinedError, match="'lacking' is undefined"):
        rendered("{{ lacking }}")


def test_a_filter_is_that_of_one_template_alone():
    content = {"exact": {}, "assumed": [("c", 0.08, "0.003")]}
    shown = [render_file("studies.uncertainty", "stated.txt.j2", content, filters=own)
             for own in (None, {"f": lambda *_: "mine"}, None)]  # fmt: skip
    assert shown[0] == shown[2] != shown[1]


@pytest.mark.parametrize("name", HOSTILE)
def test_the_title_of_a_page_is_escaped(name):
    made = page(title=name, text="**text**")
    head, _, body = made.partition("<body>")
    assert body.strip().startswith("<p><strong>text</strong></p>")
    found, text = tags(f"{head[head.index('<title>') : head.index('<style>')]}{body}")
    assert found == ["title", "p", "strong"]
    assert "".join(html.unescape(text).split()) == "".join(f"{html.unescape(name)}text".split())


def test_all_reports_share_one_style():
    """One typeface, and figures as wide as the page: a second page template would not know."""
    templates = [file for file in (ROOT / "studies").rglob("*.html.j2") if "explorer" not in file.parts]
    assert [file.name for file in templates] == ["report.html.j2"]
    style = page(title="a", text="b").partition("<style>")[2].partition("</style>")[0]
    assert re.findall(r"font(?:-family)?: [^;]*(?=sans-serif)", style) == ["font: 16px/1.5 system-ui, "]
    assert "serif" not in style.replace("sans-serif", "")
    assert re.search(r"^img { width: 100%;", style, re.MULTILINE)


@pytest.mark.parametrize("name", [*HOSTILE, "a`b", "`<script>`", "a``b<script>"])
def test_code_holds_any_name(name):
    found, text = tags(markdown(f"- {code(name)}: reason"))
    assert not set(found) - {"ul", "li", "code"}
    assert "".join(text.split()) == "".join(f"{name}: reason".split())


def test_every_template_is_filled_here():
    """No other file makes an environment of jinja, in which escaping could be forgotten."""
    files = [file for top in ("tyre", "bicycle", "studies") for file in (ROOT / top).rglob("*.py")]
    naming = {file: text for file in files if "jinja2" in (text := file.read_text(encoding="utf-8"))}
    makers = [
        file.relative_to(ROOT).as_posix()
        for file, text in naming.items()
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Call) and "jinja2" in ast.unparse(node.func)
    ]
    assert set(makers) == {"studies/reporting/markdown_text.py"}
    assert not any("from jinja2" in text for text in naming.values())
