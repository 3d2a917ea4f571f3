"""Self-contained HTML pages: headings, paragraphs, tables, pictures and interactive plots in one file that can be mailed.

Plots are plotly's. Its script is embedded compressed, once a page and only where there is a plot; what is drawn in the colours
`INK`, `RULE` and `PAPER` follows the reader's light or dark scheme.
"""

from __future__ import annotations

import base64
import gzip
import io
from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

from bench.files import write_text

if TYPE_CHECKING:
    import plotly.graph_objects as go
    from matplotlib.figure import Figure

INK, RULE, PAPER = "#1a1a1b", "#d9dee7", "#fefefd"
"""Colours of plots that stand for those of the page: text and reference curves, grid lines, background."""


@dataclass
class Block:
    """A paragraph, code, table, list of facts, picture or row of plots of a section."""

    kind: str
    text: str = ""
    header: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    source: str = ""
    plots: Sequence[str] = ()


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

    def facts(self, rows: Sequence[tuple[str, str]]) -> Section:
        """Add questions and their answers, the answers large."""
        self.blocks.append(Block("facts", rows=rows))
        return self

    def plots(self, figures: Sequence[go.Figure], caption: str) -> Section:
        """Add plotly figures, beside each other where the page is wide enough."""
        # "</" would end the script element that holds them
        texts = [str(figure.to_json()).replace("</", "<\\/") for figure in figures]
        self.blocks.append(Block("plots", caption, plots=texts))
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
        templates = resources.files("bench").joinpath("_data", "templates")
        template = templates.joinpath("page.html.j2").read_text(encoding="utf-8")
        plotted = any(block.kind == "plots" for section in self.sections for block in section.blocks)
        return environment.from_string(template).render(
            page=self,
            style=templates.joinpath("page.css").read_text(encoding="utf-8"),
            script=templates.joinpath("page.js").read_text(encoding="utf-8"),
            library=_library() if plotted else "",
            colours={"ink": INK, "rule": RULE, "paper": PAPER},
        )

    def write(self, path: str | Path) -> None:
        """Write the page whole or not at all."""
        write_text(path, self.to_html())


def _library() -> str:
    """Plotly's script, compressed, in base 64: a third of its size."""
    from plotly.offline import get_plotlyjs  # noqa: PLC0415  (for pages with plots only)

    return base64.b64encode(gzip.compress(get_plotlyjs().encode("utf-8"), mtime=0)).decode("ascii")
