"""Build the documentation: ``pip install -e ".[docs]" && sphinx-build -W --keep-going docs out/docs``.

Pages that follow from the code are generated here: the effects from their declarations, the help from the commands,
the audit of the paper from its tables, the published numbers from their tests. Nothing generated is kept in the tree,
and nothing is fetched from a network, now or when a page is read.
"""

import csv
import importlib.metadata
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from sphinx.application import Sphinx

from bicycle.effects import describe, registry

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]  # mathml.py, command_help.py, tests.published

project = "velotyre"
author = "the velotyre authors"
copyright = f"2026, {author}"
release = importlib.metadata.version("velotyre")
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "mathml",
    "numpydoc",
    "sphinx_gallery.gen_gallery",
]
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 4
autosummary_generate = True
autosummary_filename_map = {"velotyre.Modes": "velotyre.Modes_class"}  # beside velotyre.modes where case does not count
autodoc_typehints = "none"
numpydoc_show_class_members = False
templates_path = ["_templates"]
exclude_patterns = ["gallery/README.rst", "generated", "sg_execution_times.rst", "included"]
html_theme = "furo"
html_title = f"velotyre {release}"
html_static_path = ["_static"]
html_css_files = ["pages.css"]
html_math_renderer = "mathml"
html_copy_source = False
sphinx_gallery_conf = {
    "examples_dirs": str(HERE / "gallery"),
    "gallery_dirs": "auto_gallery",
    "filename_pattern": r"/\w+\.py$",
    "download_all_examples": False,
    "abort_on_example_error": True,
    "write_computation_times": False,  # its page would load scripts from a network
}
suppress_warnings = ["config.cache"]


def counts(content: dict[str, Any], path: str = "") -> Iterator[tuple[str, str]]:
    """Every number of a summary with its place; hits of a number of cases in one row."""
    for key, value in content.items():
        place = f"{path}, {key}" if path else key
        if isinstance(value, dict) and {"hits", "of"} <= value.keys():
            yield place, f"{value['hits']} of {value['of']}"
        elif isinstance(value, dict):
            yield from counts(value, place)
        elif isinstance(value, list) and len(value) == 2 and all(isinstance(one, int) for one in value):
            yield place, f"{value[0]} of {value[1]}"
        elif isinstance(value, int | float) and not isinstance(value, bool):
            yield place, f"{value:.4g}" if isinstance(value, float) else str(value)


def summary(name: str, content: dict[str, Any]) -> str:
    """A section on one study: its command, and a table of its counts."""
    about = "; ".join(str(content[key]) for key in ("what", "made_by", "date") if key in content)
    rows = "\n".join(f"| {place.replace('_', ' ')} | {count} |" for place, count in counts(content))
    return f"## {name.replace('_', ' ')}\n\n{about}\n\n| count | |\n|---|---|\n{rows}\n"


def targets() -> str:
    """What was asked of velotyre, what was measured, and the command that prints it."""
    with (HERE.parent / "data/validation/targets.csv").open(newline="", encoding="utf-8") as stream:
        head, *rows = [[cell.replace("|", r"\|") for cell in row] for row in csv.reader(stream)]
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines) + "\n"


def published() -> str:
    """Rows of ``tests/published/papers.py``: what others computed, and the same here."""
    from tests.published.papers import page

    environment = Environment(loader=FileSystemLoader(HERE / "_templates"), undefined=StrictUndefined, trim_blocks=True)
    return environment.get_template("published.md.j2").render(page())


def write_pages() -> None:
    """One page per registered effect under ``effects/`` and, under ``generated/``, what others include."""
    from command_help import as_markdown as command_help

    from tests.published.paper_claims import as_markdown, audit

    pages = {f"effects/{identifier}.md": describe(effect) for identifier, effect in registry().items()}
    pages["generated/command_help.md"] = command_help()
    pages["generated/paper_audit.md"] = as_markdown(audit())
    pages["generated/published.md"] = published()
    pages["generated/targets.md"] = targets()
    pages["generated/validation.md"] = "\n".join(
        summary(file.stem, json.loads(file.read_text()))
        for file in sorted((HERE.parent / "data/validation").glob("*.json"))
    )
    for name, text in pages.items():
        (HERE / name).parent.mkdir(exist_ok=True)
        (HERE / name).write_text(text, encoding="utf-8")


# Pages of former versions, and where their text is now.
MOVED = {
    "add_a_measurement": "python.html#a-kind-of-measurement-of-your-own",
    "add_an_effect": "effects.html#add-an-effect",
    "api": "python.html#names",
    "benchmark": "reliability.html#a-benchmark-of-answers",
    "benchmarks": "reliability.html#benchmarks-of-speed",
    "bring_your_recordings": "recordings.html",
    "changelog": "contributing.html#changelog",
    "closed_loop": "riders.html#a-rider-who-steers",
    "design": "charts_and_design.html#design",
    "how_to": "index.html",
    "missing_effect": "diagnose.html",
    "neighbours": "literature.html#neighbours",
    "paper": "literature.html#known-discrepancies-of-the-paper",
    "published": "literature.html#who-computed-what-and-what-we-get",
    "rig_effects": "effects.html#rig-effects",
    "rooms": "contributing.html#how-the-code-is-laid-out",
    "scripts": "python.html#scripts",
    "simulate_identify_diagnose": "diagnose.html#simulate-identify-diagnose",
    "sources": "literature.html#where-the-numbers-come-from",
    "stability_charts": "charts_and_design.html#stability-charts",
    "validation": "reliability.html#every-count",
}


def redirects(_app: Sphinx) -> Iterator[tuple[str, dict[str, str], str]]:
    """A page at each former address that leads to the present one."""
    for name, address in MOVED.items():
        yield name, {"address": address}, "moved.html"


def bars_are_absolute_values(
    _app: Sphinx, _what: str, _name: str, _it: object, _options: object, lines: list[str]
) -> None:
    """In docstrings ``|z|`` is the size of z; to reStructuredText it is a substitution."""
    lines[:] = [line if "``" in line else line.replace("|", r"\|") for line in lines]


def setup(app: Sphinx) -> None:
    """Take part in the build: before numpydoc, which has priority 500."""
    app.connect("html-collect-pages", redirects)
    app.connect("autodoc-process-docstring", bars_are_absolute_values, priority=400)


write_pages()
