"""Self-contained HTML pages: headings, paragraphs, tables and pictures in one file that can be mailed."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

from bench.files import write_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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
        template = (
            resources.files("bench")
            .joinpath("_data", "templates", "page.html.j2")
            .read_text(encoding="utf-8")
        )
        return environment.from_string(template).render(page=self)

    def write(self, path: str | Path) -> None:
        """Write the page whole or not at all."""
        write_text(path, self.to_html())
