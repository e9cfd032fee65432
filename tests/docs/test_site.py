"""The documentation as a site: every page in the index, every public name in the API, nothing from a network.

Where the site has been built (``sphinx-build docs out/docs``; the checks of a change do) its pages are read, too.
"""

import html
import re
import runpy
from html.parser import HTMLParser
from pathlib import Path

import pytest

import bicycle
import studies.velotyre as vt
import tyre
from studies.cli import build, main

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
BUILT = ROOT / "out" / "docs"
needs_site = pytest.mark.skipif(
    not (BUILT / "index.html").is_file(), reason="the site has not been built: sphinx-build docs out/docs"
)
OUTSIDE = re.compile(r"^(?:[a-z][a-z0-9+.-]*:)?//", re.I)


def test_every_public_name_is_in_the_api():
    text = (DOCS / "python.md").read_text(encoding="utf-8")
    listed = re.findall(r"^   ([\w.]+)$", text, flags=re.M)
    assert len(listed) == len(set(listed))
    public = {*vt.HOME, *dir(vt.effects)} | set(bicycle.__all__) | set(tyre.__all__)
    assert len(public) > 50
    assert public - set(listed) == set()


def test_every_page_is_in_the_index():
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    trees = "\n".join(re.findall(r"^```\{toctree\}\n(.*?)^```", index, flags=re.M | re.S))
    assert {page.stem for page in DOCS.glob("*.md")} - set(trees.split()) == {"index"}


def test_every_command_is_named_on_a_page():
    text = "\n".join(page.read_text(encoding="utf-8") for page in [*DOCS.glob("*.md"), ROOT / "README.md"])
    names = [name for name in build().list_commands(None) if not re.search(rf"velotyre {name}\b", text)]
    assert names == []


@pytest.fixture(scope="module")
def helps():
    return runpy.run_path(str(DOCS / "command_help.py"))["command_helps"]()


def test_the_printed_help_is_what_every_command_prints(helps, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    for words, text in helps.items():
        main([*words.split()[1:], "--help"])
        assert capsys.readouterr().out.rstrip("\n") == text.rstrip("\n"), words
    names = {" ".join(words.split()[1:]) for words in helps}
    assert names >= {"", "tyre fit", "tyre simulate", *build().list_commands(None)}


class Sources(HTMLParser):
    """What a page loads by itself: scripts, sheets, pictures, fonts, frames; links to follow are none."""

    def __init__(self):
        super().__init__()
        self.loaded, self.formulae = [], 0

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.formulae += tag == "math"
        if tag == "link":
            if not {"canonical", "next", "prev", "index", "search", "license"} & set((given.get("rel") or "").split()):
                self.loaded.append(given.get("href") or "")
        elif tag != "a":
            self.loaded += [given[key] or "" for key in ("src", "srcset", "poster", "data") if key in given]


def sources(text):
    reader = Sources()
    reader.feed(text)
    return reader


def outside(text):
    """Addresses on other machines that a page or a sheet loads."""
    found = sources(text).loaded + re.findall(r"url\(\s*['\"]?([^'\")]+)|@import\s+['\"]([^'\"]+)", text)
    flat = [part for one in found for part in ([one] if isinstance(one, str) else one)]
    return [address for address in flat if OUTSIDE.match(address)]


@pytest.mark.parametrize(("text", "found"), [
    ('<script src="https://cdn.example/x.js"></script>', 1), ('<img src="http://example.org/a.png">', 1),
    ('<link rel="stylesheet" href="//cdn.example/x.css">', 1),
    ("<style>@font-face {src: url('https://example.org/f.woff2')}</style>", 1),
    ('@import "https://example.org/x.css";', 1), ('<a href="https://example.org">there</a>', 0),
    ('<img src="_images/a.png"><link rel="stylesheet" href="_static/x.css">', 0),
])  # fmt: skip
def test_what_a_page_loads_is_seen(text, found):
    assert len(outside(text)) == found


@needs_site
def test_the_built_site_loads_nothing_from_a_network():
    pages = list(BUILT.rglob("*.html"))
    assert len(pages) > 100
    for file in [*pages, *BUILT.rglob("*.css")]:
        assert outside(file.read_text(encoding="utf-8")) == [], file
    physics = (BUILT / "physics.html").read_text(encoding="utf-8")
    assert sources(physics).formulae > 80  # MathML, which needs no script
    assert "$$" not in physics


@needs_site
def test_the_built_page_shows_the_help_of_every_command(helps):
    built = BUILT / "command_line.html"
    if built.stat().st_mtime < max(module.stat().st_mtime for module in (ROOT / "studies").rglob("*.py")):
        pytest.skip("the site was built before the commands changed: sphinx-build docs out/docs")
    shown = html.unescape(re.sub(r"<[^>]+>", "", built.read_text(encoding="utf-8")))
    assert [words for words, text in helps.items() if text.rstrip("\n") not in shown] == []


@needs_site
def test_a_former_address_leads_to_a_heading_that_exists():
    moved = {
        page.stem: re.search(r'refresh" content="0; url=([^"]+)', page.read_text()) for page in BUILT.glob("*.html")
    }
    targets = {name: found[1].partition("#") for name, found in moved.items() if found}
    assert {"api", "closed_loop", "rooms", "validation"} <= set(targets)
    for name, (file, _, heading) in targets.items():
        text = (BUILT / file).read_text(encoding="utf-8")
        assert not heading or f'id="{heading}"' in text, name
