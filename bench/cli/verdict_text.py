"""A verdict for people, at the console: the explanation, five answers, and what to do next."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from bench.discrepancy.report.answers import Files
    from bench.discrepancy.verdict import Verdict


def verdict_summary(verdict: Verdict, files: Files) -> list[Any]:
    """A verdict for people: a sentence and a table to print; the report holds the rest.

    Args:
        verdict: The verdict.
        files: What the commands that come next name.
    """
    from bench.discrepancy.report.answers import answers, next_steps

    table = Table.grid(padding=(0, 2, 0, 0))
    for question, answer in answers(verdict):
        table.add_row(question, Text(answer))
    for step in next_steps(verdict, files):
        table.add_row("Next", Text(f"{step.text} {step.command}".rstrip()))
    return [Text(verdict.explanation), table]
