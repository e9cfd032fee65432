"""Build the documentation: ``pip install -e ".[docs]" && sphinx-build -W docs out/docs``.

The effect pages are generated here from the declarations of the effects; nothing generated is kept in the tree.
"""

from pathlib import Path

from bicycle.effect import registry
from bicycle.files.effect_docs import describe

HERE = Path(__file__).parent

project = "velotyre"
author = "the velotyre authors"
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.mathjax",
    "numpydoc",
    "sphinx_gallery.gen_gallery",
]
myst_enable_extensions = ["dollarmath", "colon_fence"]
autosummary_generate = True
numpydoc_show_class_members = False
exclude_patterns = ["gallery/README.rst", "sg_execution_times.rst"]
html_theme = "alabaster"
html_theme_options = {"description": "From the tyre rig to the stability of the bicycle", "page_width": "1100px"}
sphinx_gallery_conf = {
    "examples_dirs": str(HERE / "gallery"),
    "gallery_dirs": "auto_gallery",
    "filename_pattern": r"/\w+\.py$",
    "download_all_examples": False,
    "abort_on_example_error": True,
}
suppress_warnings = ["config.cache"]


def write_effect_pages() -> None:
    """One page per registered effect, under ``effects/`` (ignored by git)."""
    folder = HERE / "effects"
    folder.mkdir(exist_ok=True)
    for identifier, effect in registry().items():
        (folder / f"{identifier}.md").write_text(describe(effect), encoding="utf-8")


write_effect_pages()
