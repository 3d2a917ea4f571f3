"""Equations of a built page as MathML, which browsers set by themselves: no script, nothing fetched from elsewhere."""

from __future__ import annotations

import re
from html import unescape

from latex2mathml.converter import convert

INLINE = re.compile(r'<span class="arithmatex">\\\((.*?)\\\)</span>', re.DOTALL)
DISPLAY = re.compile(r'<div class="arithmatex">\\\[(.*?)\\\]</div>', re.DOTALL)
NAMED = re.compile(r"<mo>([A-Za-z]{2,})</mo>")
"""A function as an operator: browsers would put wide spaces about it."""


def mathml(latex: str, *, display: bool = False) -> str:
    """LaTeX as MathML.

    Raises:
        ValueError: It holds a command or an environment that is not known, which would stand in the page as text.
    """
    made = convert(latex.strip(), display="block" if display else "inline")
    if "\\" in made or "&amp;" in made or "<mi>&</mi>" in made or "<mo>&</mo>" in made:
        raise ValueError(f"cannot be set as MathML: {latex.strip()}")
    return NAMED.sub(r"<mi>\1</mi>", made)


def set_equations(html: str) -> str:
    """A page with the equations that Arithmatex marked set as MathML."""
    html = DISPLAY.sub(lambda m: f'<div class="equation">{mathml(unescape(m[1]), display=True)}</div>', html)
    return INLINE.sub(lambda m: mathml(unescape(m[1])), html)
