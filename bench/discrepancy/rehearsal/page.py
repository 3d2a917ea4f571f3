"""A rehearsal as a table, a figure and a page."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bench.discrepancy.rehearsal.rehearsing import Outcome, Rehearsal
from bench.figures.look import COLOURS, axes_grid, style
from bench.page import Page

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def table(done: Rehearsal) -> tuple[list[str], list[list[str]]]:
    """Header and rows: an effect a row, a size a column, and from which size on it is found."""
    header = ["effect", "where", *(f"{100 * size:g} %" for size in done.sizes), "found from"]
    rows = []
    for label in done.labels:
        outcomes = {o.size: o for o in done.of(label)}
        least = done.threshold(label)
        found = f"{100 * least.size:g} %: {least.amplitude}" if least else "not found"
        rows.append([*label, *(word(outcomes.get(size)) for size in done.sizes), found])
    return header, rows


def word(outcome: Outcome | None) -> str:
    """An outcome in a word or two; empty where it was not tried."""
    if outcome is None:
        return ""
    if outcome.found:
        return "found" if len(outcome.named) == 1 else f"found, and {len(outcome.named) - 1} more"
    return ", ".join(outcome.named) or outcome.verdict


def figure(done: Rehearsal) -> Figure:
    """Effects over sizes: found or not."""
    labels = done.labels
    with style():
        drawn, grid = axes_grid(6.4, 0.34 * len(labels) + 1.3)
        axes = grid[0, 0]
        for k, label in enumerate(labels):
            for outcome in done.of(label):
                axes.plot(
                    100.0 * outcome.size, k, marker="o" if outcome.found else "x", markersize=8,
                    color=COLOURS[2] if outcome.found else COLOURS[0], linestyle="none",
                )  # fmt: skip
        axes.set_xscale("log")
        axes.set_yticks(np.arange(len(labels)), [" ".join(filter(None, label)) for label in labels])
        axes.set_ylim(len(labels) - 0.5, -0.5)
        axes.set_xlabel(
            "change of a response by the effect [% of its standard deviation]; dot: found, cross: not"
        )
    return drawn


def rehearsal_page(done: Rehearsal) -> Page:
    """The page."""
    alarms = ", ".join(done.false_alarms)
    lead = (
        f"With nothing put in, the diagnosis names {alarms}: a false alarm, so that a finding of that size means little."
        if alarms
        else "With nothing put in, the diagnosis names nothing."
    )
    out = Page(f"Rehearsal of {done.case}", lead, "jointbench rehearse")
    section = out.section("From which size on an effect would be found")
    section.figure(figure(done), "Sealed cases of the user's own model with the planned signals")
    section.table("Sizes are the change of a response over its standard deviation", *table(done))
    rows = [
        [o.effect, o.where, f"{100 * o.size:g} %", o.amplitude, o.verdict, ", ".join(o.named), f"{o.before:.3g}", f"{o.after:.3g}", o.note]
        for o in done.outcomes
    ]  # fmt: skip
    out.section("Every sealed case").table(
        "Discrepancy of the judging records, nominal and with what was named",
        ["effect", "where", "size", "put in", "verdict", "named", "before", "after", ""],
        rows,
    )
    return out
