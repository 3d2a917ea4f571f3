"""What is drawn while the site is built: equations as MathML, flow charts as SVG. No page loads a script for them."""

from __future__ import annotations

import re
import sys
from html import unescape
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from documentation.flowchart import svg
from documentation.mathml import set_equations

CHART = re.compile(r'<pre class="mermaid"><code>(.*?)</code></pre>', re.DOTALL)


def on_page_content(html: str, **_: object) -> str:
    """A page's content, between Markdown and the theme."""
    return CHART.sub(lambda m: svg(unescape(m[1])), set_equations(html))
