"""The results as a page, as Markdown tables, and as the two pages of the documentation that are made of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from bench.page import Page
from bench.provenance import software_versions
from bench.reproduction.item import Result
from bench.reproduction.verdict import HEADER, Row, RowVerdict

TITLE = "The dissertation, reproduced"
LEAD = (
    "Figures and tables of F. Tasbihgoo, Analytical and experimental studies in the development of reduced-order "
    "computational models for nonlinear systems (USC 2006), made again on the bench's virtual rigs. The laboratory "
    "records were never published: what the text prints of them (axes, numbers, sentences) stands beside what the rigs give."
)
_ASIDE = (
    (RowVerdict.FAILS, "What does not hold"),
    (RowVerdict.SHAPE, "What holds in shape only"),
    (RowVerdict.NOT_COMPARABLE, "What cannot be compared"),
)


def items_summary(results: Sequence[Result]) -> str:
    """How many rows came to which verdict, those that are no evidence told apart."""
    rows = [row for result in results for row in result.rows]
    printed = [row for row in rows if not row.own]
    counts = Counter(row.verdict for row in printed)
    chosen = sum(bool(row.chosen) and row.verdict is RowVerdict.HOLDS for row in printed)
    checks = [row for row in rows if row.own and row.holds is not None]
    told = ", ".join(f"{counts[verdict]} {_plural(verdict, counts[verdict])}" for verdict in RowVerdict)
    return (
        f"Of {len(printed)} things that the text prints, {told}; {chosen} of those that hold were put in or chosen for, and "
        f"are no evidence. Of {len(checks)} checks of our own, of which the text says nothing, "
        f"{sum(bool(row.holds) for row in checks)} hold."
    )


def _plural(verdict: RowVerdict, count: int) -> str:
    if verdict is RowVerdict.NOT_COMPARABLE:
        return "cannot be compared"
    words = {RowVerdict.HOLDS: ("holds", "hold"), RowVerdict.FAILS: ("does not hold", "do not hold")}
    return words.get(verdict, ("holds in shape only", "hold in shape only"))[count != 1]


def _footer() -> str:
    return "Made by jointbench with " + ", ".join(
        f"{name} {version}" for name, version in software_versions()
    )


def to_page(results: Sequence[Result], folder: Path) -> Page:
    """One page with every item; pictures are read from `folder` and embedded."""
    seconds = sum(result.seconds for result in results)
    page = Page(
        TITLE,
        lead=f"{LEAD} {items_summary(results)} {len(results)} items in {seconds:.0f} s.",
        footer=_footer(),
    )
    for verdict, heading in _ASIDE[:2]:
        found = _found(results, verdict)
        if found:
            page.section(heading).table(
                heading, ("item", *HEADER, "why"), [(name, *row.cells(), row.why) for name, row in found]
            )
    for result in results:
        section = page.section(f"{result.identifier}: {result.title}")
        for paragraph in (*result.text.split("\n\n"), f"Searched or chosen: {result.searched}"):
            section.text(paragraph)
        for shown in result.pictures:
            section.picture((folder / shown.file).read_bytes(), shown.caption)
        section.table(
            f"Printed and reproduced; {result.seconds:.1f} s", HEADER, [row.cells() for row in result.rows]
        )
    return page


def _found(results: Sequence[Result], verdict: RowVerdict) -> list[tuple[str, Row]]:
    return [(result.identifier, row) for result in results for row in result.rows if row.verdict is verdict]


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """A Markdown table."""
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return lines + [
        "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in row) + " |" for row in rows
    ]


def to_markdown(results: Sequence[Result]) -> str:
    """What does not hold and why, then all rows, a table an item."""
    lines = [f"# {TITLE}", "", LEAD, "", items_summary(results), ""]
    for verdict, heading in _ASIDE:
        lines += [f"## {heading}", ""]
        found = _found(results, verdict)
        for name, row in found:
            unit = f" [{row.unit}]" if row.unit else ""
            said = f"printed {row.printed} ({row.source})" if row.printed else row.source
            why = row.reason if verdict is RowVerdict.NOT_COMPARABLE else row.why or "not explained"
            over = f"; over ten seeds {row.spread}" if row.spread else ""
            lines += [f"- **{name}, {row.quantity}{unit}**: {said}; ours {row.ours}{over}. Why: {why}."]
        lines += [*([] if found else ["Nothing."]), ""]
    for result in results:
        lines += [f"## {result.identifier}: {result.title}", "", f"Searched or chosen: {result.searched}", ""]
        lines += [*table(HEADER, [row.cells() for row in result.rows]), ""]
    return "\n".join([*lines, ""])


def to_gallery(results: Sequence[Result]) -> str:
    """Every picture of every item, under the verdicts of its rows; pictures lie in the folder gallery."""
    lines = [
        "# Gallery: the dissertation, reproduced",
        "",
        f"{LEAD} Every figure with data is here, favourable or not. The rows behind it, and what does not hold and why: "
        "[reproduction.md](reproduction.md); both pages are made together by `python scripts/make_gallery.py`.",
        "",
        items_summary(results),
        "",
    ]
    for result in results:
        counts = Counter(row.verdict for row in result.rows)
        told = ", ".join(f"{counts[verdict]} {verdict.value}" for verdict in RowVerdict if counts[verdict])
        lines += [f"## {result.identifier}: {result.title}", "", result.text, ""]
        lines += [f"Searched or chosen: {result.searched}", "", f"Rows: {told}.", ""]
        for row in result.rows:
            if row.verdict is RowVerdict.FAILS:
                lines += [f"- Does not hold: {row.quantity}: printed {row.printed or '–'}, ours {row.ours}."]
        lines += [""] * bool(counts[RowVerdict.FAILS])
        for shown in result.pictures:
            lines += [f"![{shown.caption}](gallery/{shown.file})", "", f"*{shown.caption}*", ""]
    return "\n".join(lines)
