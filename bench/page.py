"""Self-contained HTML pages: headings, paragraphs, tables and pictures in one file that can be mailed."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from bench.files import write_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_TEMPLATE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{{ page.title }}</title>
<style>
:root { color-scheme: light; --ink: #1d2430; --soft: #5b6675; --rule: #d9dee6; --accent: #0b5cad; }
body { font: 16px/1.55 system-ui, sans-serif; color: var(--ink); max-width: 62rem; margin: 2.5rem auto; padding: 0 1.25rem; }
h1 { font-size: 1.9rem; line-height: 1.2; margin-bottom: .3rem } h2 { margin-top: 2.6rem; border-top: 1px solid var(--rule); padding-top: 1.2rem }
p.lead { font-size: 1.15rem; } figure { margin: 1.4rem 0 } figure img { max-width: 100% } figcaption { color: var(--soft); font-size: .92rem }
table { border-collapse: collapse; margin: 1rem 0; font-variant-numeric: tabular-nums } caption { text-align: left; color: var(--soft); font-size: .92rem; padding-bottom: .3rem }
th, td { border-bottom: 1px solid var(--rule); padding: .3rem .9rem .3rem 0; text-align: left; vertical-align: top } th { color: var(--soft); font-weight: 600 }
pre { background: #f4f6f9; padding: .8rem 1rem; overflow-x: auto; font-size: .88rem } footer { color: var(--soft); margin-top: 3rem; font-size: .88rem }
</style></head><body>
<h1>{{ page.title }}</h1>
{% if page.lead %}<p class="lead">{{ page.lead }}</p>{% endif %}
{% for section in page.sections %}<h2>{{ section.title }}</h2>
{% for block in section.blocks %}
{% if block.kind == "text" %}<p>{{ block.text }}</p>
{% elif block.kind == "code" %}<pre><code>{{ block.text }}</code></pre>
{% elif block.kind == "table" %}<table><caption>{{ block.text }}</caption><thead><tr>{% for h in block.header %}<th>{{ h }}</th>{% endfor %}</tr></thead>
<tbody>{% for row in block.rows %}<tr>{% for cell in row %}<td>{{ cell }}</td>{% endfor %}</tr>{% endfor %}</tbody></table>
{% else %}<figure><img alt="{{ block.text }}" src="{{ block.source }}"><figcaption>{{ block.text }}</figcaption></figure>{% endif %}
{% endfor %}{% endfor %}
<footer>{{ page.footer }}</footer>
</body></html>
"""


@dataclass
class Block:
    """A paragraph, code, table or picture of a section."""

    kind: str
    text: str = ""
    header: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    source: str = ""


@dataclass
class Section:
    """A heading and what stands under it; the methods add blocks and return the section."""

    title: str
    blocks: list[Block] = field(default_factory=list)

    def text(self, text: str) -> Section:
        """Add a paragraph."""
        self.blocks.append(Block("text", text))
        return self

    def code(self, text: str) -> Section:
        """Add code, shown as it is."""
        self.blocks.append(Block("code", text))
        return self

    def table(self, caption: str, header: Sequence[str], rows: Sequence[Sequence[object]]) -> Section:
        """Add a table; cells are shown as strings."""
        self.blocks.append(Block("table", caption, header, [[str(cell) for cell in row] for row in rows]))
        return self

    def figure(self, figure: Figure, caption: str, *, dpi: int = 110) -> Section:
        """Add a matplotlib figure, embedded as PNG."""
        buffer = io.BytesIO()
        figure.savefig(buffer, format="png", dpi=dpi, bbox_inches="tight")
        return self.picture(buffer.getvalue(), caption)

    def picture(self, png: bytes, caption: str) -> Section:
        """Add a PNG picture."""
        source = "data:image/png;base64," + base64.b64encode(png).decode("ascii")
        self.blocks.append(Block("figure", caption, source=source))
        return self


@dataclass
class Page:
    """A page of sections."""

    title: str
    lead: str = ""
    footer: str = ""
    sections: list[Section] = field(default_factory=list)

    def section(self, title: str) -> Section:
        """Add a section and return it."""
        self.sections.append(Section(title))
        return self.sections[-1]

    def to_html(self) -> str:
        """The whole page; every text is escaped."""
        import jinja2  # noqa: PLC0415

        environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True)
        return environment.from_string(_TEMPLATE).render(page=self)

    def write(self, path: str | Path) -> None:
        """Write the page whole or not at all."""
        write_text(path, self.to_html())
