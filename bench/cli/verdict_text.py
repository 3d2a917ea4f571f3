"""A verdict for people, at the console: the explanation, five answers, and what to do next."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from bench.discrepancy.verdict import Verdict


def verdict_summary(verdict: Verdict, model: str = "") -> list[Any]:
    """A verdict for people: a sentence and a table to print; the report holds the rest.

    Args:
        verdict: The verdict.
        model: Options of `jointbench apply` that name the user's own MJCF; empty where the rig is one of the bench.
    """
    from bench.discrepancy.report.answers import answers, next_steps

    table = Table.grid(padding=(0, 2, 0, 0))
    for question, answer in answers(verdict):
        table.add_row(question, Text(answer))
    for step in next_steps(verdict, model):
        table.add_row("Next", Text(f"{step.text} {step.command}".rstrip()))
    return [Text(verdict.explanation), table]
