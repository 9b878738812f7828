# SPDX-License-Identifier: Apache-2.0
"""Sphinx: formulas in LaTeX become MathML, which browsers typeset by themselves, without a script or a font."""

import re

from docutils import nodes
from latex2mathml.converter import convert

# MathML puts no space around the name of a function
NAME = r"<mi>(?:sin|cos|tan|cot|exp|ln|arctan|arccos)</mi>"
BEFORE = re.compile(rf"(</m(?:i|n|frac|sub|sup|sqrt)>|&#x00029;</mo>)(?={NAME})")
AFTER = re.compile(rf"({NAME})(?=<m(?:i|n|frac|sub|sup|sqrt)>)")
SPACE = r'\1<mspace width="0.167em" />'
# a prime is raised by itself: as an exponent it is made small too, and a derivative of the fourth order cannot be read
PRIME = re.compile(r"<msup>(<mi>[^<]+</mi>)<mi>(&#x020(?:32|33|34|57);)</mi></msup>")
RAISED = r'<mrow>\1<mo lspace="0" rspace="0" stretchy="false">\2</mo></mrow>'


def markup(latex: str, display: str) -> str:
    """MathML of a formula, ``inline`` or ``block``; an unknown command stops the build."""
    text = PRIME.sub(RAISED, convert(latex, display=display))
    if "\\" in text:
        raise ValueError(f"no MathML for the formula {latex}")
    return AFTER.sub(SPACE, BEFORE.sub(SPACE, text))


def inline(writer, node) -> None:
    """Writes a formula in a line of text."""
    writer.body.append(markup(node.astext(), "inline"))
    raise nodes.SkipNode


def block(writer, node) -> None:
    """Writes a formula on a line of its own."""
    writer.body.append(f'<div class="formula">{markup(node.astext(), "block")}</div>\n')
    raise nodes.SkipNode


def setup(app) -> dict:
    """As a Sphinx extension: the renderer named ``mathml``."""
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
