"""Equations as MathML, which browsers draw themselves: no script and no network."""

from latex2mathml.converter import convert
from sphinx.application import Sphinx


def _inline(translator, node):
    translator.body.append(convert(node.astext()))
    from docutils.nodes import SkipNode

    raise SkipNode


def _block(translator, node):
    from docutils.nodes import SkipNode

    formula = convert(_one_line(node.astext()), display="block")
    translator.body.append(f'<div class="math" style="overflow-x: auto">{formula}</div>')
    raise SkipNode


def _one_line(text: str) -> str:
    """Sphinx keeps blank lines between formulas of one block; they are one table of lines."""
    parts = [part for part in text.split("\n\n") if part.strip()]
    return parts[0] if len(parts) == 1 else r"\begin{array}{l}" + r"\\".join(parts) + r"\end{array}"


def setup(app: Sphinx) -> dict:
    """Register the renderer under the name that html_math_renderer gives."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    return {"parallel_read_safe": True}
