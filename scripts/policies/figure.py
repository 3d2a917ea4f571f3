"""Figures of the experiments."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from bench.figures import COLOURS, save, style

from .rewards import ranking

SHOWN = ("information", "contrastive, local", "information, floored", "expected error")


def rewards_figure(rows: list[dict[str, Any]], path: Path) -> None:
    """What rewards say of records, over the error that is left of them; above without, below with a background."""
    numbers = {where: table for where, table in ranking(rows).items() if where != "both"}
    kinds = list(dict.fromkeys(row["kind"] for row in rows))
    with style():
        figure = Figure(figsize=(2.6 * len(SHOWN), 5.2), layout="constrained")
        axes = np.atleast_2d(figure.subplots(2, len(SHOWN), sharex=True))
        for line, (where, table) in zip(axes, numbers.items(), strict=True):
            some = [row for row in rows if row["background"] is (where == "with background")]
            for axis, name in zip(line, SHOWN, strict=True):
                for colour, kind in zip(COLOURS, kinds, strict=False):
                    points = [(r["error"], r["rewards"][name]) for r in some if r["kind"] == kind]
                    axis.plot(*np.array(points).T, ".", color=colour, label=kind, markersize=4)
                axis.set_xscale("log")
                axis.set_title(f"{name}, {table[name]['spearman']:.2f}", fontsize="medium")
            line[0].set_ylabel(f"reward [nat]\n{where}")
        for axis in axes[-1]:
            axis.set_xlabel("error [prior standard deviations]")
        axes[0, 0].legend()
        save(figure, path)


def contest_figure(numbers: dict[str, Any], path: Path) -> None:
    """Errors of all methods as shares of the best open-loop one's, with 95 % intervals; a panel without and one with a background."""
    with style():
        figure = Figure(figsize=(9.0, 3.6), layout="constrained")
        axes = figure.subplots(1, 2, sharey=True)
        for axis, where in zip(axes, ("without background", "with background"), strict=True):
            for k, (kind, group) in enumerate(numbers[where].items()):
                ratio = np.array([row["ratio"] for row in group.values()])
                ends = np.array([row["ratio_interval"] for row in group.values()])
                reach = np.abs(ends.T - ratio)
                place = np.arange(len(ratio)) + 0.15 * (k - 1.5)
                axis.errorbar(ratio, place, xerr=reach, fmt=".", color=COLOURS[k % len(COLOURS)], label=kind)
            methods = list(numbers[where]["all"])
            axis.set_yticks(np.arange(len(methods)), methods)
            axis.set_xscale("log")
            axis.axvline(1.0, color="#1a1a1a", linewidth=0.8)
            axis.set_xlabel("error, of the best open-loop method [1]")
            axis.set_title(where)
        axes[0].invert_yaxis()
        axes[0].legend()
        save(figure, path)
