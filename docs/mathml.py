"""Mathematics of the pages as MathML, which browsers show by themselves: no script and no network.

LaTeX is converted while the documentation is built; what cannot be converted is an error. The font is STIX Two Math
(SIL Open Font License), for not every machine has one with which accents and fractions stand where they belong.
"""

import re
from importlib.resources import files
from pathlib import Path
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError

FONT = "STIXTwoMath-Regular.ttf"  # also in _static/pages.css


def mathml(latex: str, *, display: str) -> str:
    """One formula; ``display`` is ``inline`` or ``block``."""
    shown = str(convert(latex, display=display))
    if "\\" in shown:  # the converter leaves a command that it does not know as it is
        raise ExtensionError(f"{latex!r} cannot be shown as MathML")
    return re.sub(r"<mi>(arctan|cos|det|exp|ln|sin)</mi>", r'<mo lspace="0.17em" rspace="0.17em">\1</mo>', shown)


def _inline(writer: Any, node: nodes.Element) -> None:
    writer.body.append(mathml(node.astext(), display="inline"))
    raise nodes.SkipNode


def _block(writer: Any, node: nodes.Element) -> None:
    writer.body.append(f'<div class="math">{mathml(node.astext(), display="block")}</div>')
    raise nodes.SkipNode


def _copy_font(app: Sphinx, error: Exception | None) -> None:
    if error is None and app.builder.format == "html":
        font = files("ziamath") / "fonts" / FONT
        (Path(app.outdir) / "_static" / FONT).write_bytes(font.read_bytes())


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the renderer."""
    app.add_html_math_renderer("mathml", inline_renderers=(_inline, None), block_renderers=(_block, None))
    app.connect("build-finished", _copy_font)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
