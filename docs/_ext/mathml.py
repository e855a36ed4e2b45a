"""Equations as MathML, which browsers draw themselves: no script and no network."""

from latex2mathml.converter import convert
from sphinx.application import Sphinx

LONG = 45  # characters of a formula in a line that may not fit on a phone
SCROLLS = "display: inline-block; max-width: 100%; overflow: auto hidden; vertical-align: bottom"


def _inline(translator, node):
    formula = _converted(node.astext())
    if len(node.astext()) > LONG:
        formula = f'<span style="{SCROLLS}">{formula}</span>'
    translator.body.append(formula)
    from docutils.nodes import SkipNode

    raise SkipNode


def _block(translator, node):
    from docutils.nodes import SkipNode

    formula = _converted(_one_line(node.astext()), display="block")
    translator.body.append(f'<div class="math" style="overflow-x: auto">{formula}</div>')
    raise SkipNode


def _converted(latex: str, **options: str) -> str:
    """MathML of a formula; the converter knows ``align*``, not ``aligned``. ValueError for lines
    that browsers would not part."""
    formula = convert(latex.replace("{aligned}", "{align*}"), **options)
    if 'linebreak="newline"' in formula:
        raise ValueError(f"lines of a formula outside of a table: {latex}")
    return formula.replace('<mtd columnalign="', '<mtd style="text-align: ')  # what browsers know


def _one_line(text: str) -> str:
    """Sphinx keeps blank lines between formulas of one block; they are one table of lines."""
    parts = [part for part in text.split("\n\n") if part.strip()]
    return parts[0] if len(parts) == 1 else r"\begin{array}{l}" + r"\\".join(parts) + r"\end{array}"


def setup(app: Sphinx) -> dict:
    """Register the renderer under the name that html_math_renderer gives."""
    app.add_html_math_renderer("mathml", (_inline, None), (_block, None))
    return {"parallel_read_safe": True}
