"""The results as a page and as a Markdown table."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from bench.page import Page
from bench.provenance import software_versions
from bench.reproduction.item import HEADER, Result

TITLE = "The dissertation, reproduced"
LEAD = (
    "Figures and tables of F. Tasbihgoo, Analytical and experimental studies in the development of reduced-order "
    "computational models for nonlinear systems (USC 2006), made again on the bench's virtual rigs. The laboratory "
    "records were never published: their printed ranges and figures stand beside what the rigs give."
)


def _sentence(results: Sequence[Result]) -> str:
    required = [row for result in results for row in result.rows if row.holds is not None]
    held = sum(bool(row.holds) for row in required)
    seconds = sum(result.seconds for result in results)
    return f"{held} of {len(required)} requirements hold; {len(results)} items in {seconds:.0f} s."


def _footer() -> str:
    return "Made by jointbench with " + ", ".join(
        f"{name} {version}" for name, version in software_versions()
    )


def to_page(results: Sequence[Result], folder: Path) -> Page:
    """One page with every item; pictures are read from `folder` and embedded."""
    page = Page(TITLE, lead=f"{LEAD} {_sentence(results)}", footer=_footer())
    for result in results:
        section = page.section(f"{result.identifier}: {result.title}")
        for paragraph in result.text.split("\n\n"):
            section.text(paragraph)
        for name, caption in result.pictures:
            section.picture((folder / name).read_bytes(), caption)
        section.table(
            f"Printed and reproduced; {result.seconds:.1f} s", HEADER, [row.cells() for row in result.rows]
        )
    return page


def to_markdown(results: Sequence[Result]) -> str:
    """All rows as Markdown, a table an item."""
    lines = [f"# {TITLE}", "", _sentence(results), ""]
    for result in results:
        lines += [f"## {result.identifier}: {result.title}", ""]
        lines += ["| " + " | ".join(HEADER) + " |", "|" + "---|" * len(HEADER)]
        lines += [
            "| " + " | ".join(cell.replace("|", "\\|") for cell in row.cells()) + " |" for row in result.rows
        ]
        lines += [""]
    return "\n".join([*lines, _footer(), ""])
