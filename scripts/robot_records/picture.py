"""One picture of all robots: the joint that its model misses most, measured, as stated and with what is named."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bench.discrepancy.articulated.diagnosis import ArticulatedDiagnosis
from bench.discrepancy.articulated_judgement.torque_error import TorqueProblem
from bench.discrepancy.report.articulated import judged_torques, simulated_joints
from bench.figures.look import axes_grid, legend, look, save, style


@dataclass(frozen=True)
class PictureSettings:
    """How the picture is laid out."""

    seconds: float = 6.0
    """Longest part of a record that is drawn, that in which the model misses most."""
    columns: int = 3
    """Robots in a row."""


SETTINGS = PictureSettings()


def trace(found: ArticulatedDiagnosis) -> dict[str, Any]:
    """The part of the first judging record in which a robot's worst joint is missed most: what, time, and the curves by name."""
    by_torque = isinstance(found.problem, TorqueProblem)
    runs = judged_torques(found) if by_torque else simulated_joints(found)
    joint = found.verdict.gap.dof
    measured, *others = runs.values()
    time = measured.time
    n = min(len(time), max(2, int(SETTINGS.seconds / (time[1] - time[0]))))
    missed = (
        np.cumsum(np.insert((others[0][joint] - measured[joint]) ** 2, 0, 0.0))
        if others
        else np.zeros(len(time) + 1)
    )
    first = int(np.argmax(missed[n:] - missed[:-n]))
    part = slice(first, first + n)
    return {
        "joint": joint,
        "unit": measured.channel(joint).unit,
        "time": time[part].tolist(),
        "curves": {name: run[joint][part].tolist() for name, run in runs.items()},
    }


def draw(traces: Mapping[str, Mapping[str, Any]], path: Path) -> None:
    """Draw the traces of several robots."""
    rows = -(-len(traces) // SETTINGS.columns)
    with style():
        figure, grid = axes_grid(4.0 * SETTINGS.columns, 0.5 + 2.2 * rows, nrows=rows, ncols=SETTINGS.columns)
        most: Sequence[Any] = ()
        for axes, (robot, told) in zip(grid.ravel(), traces.items(), strict=False):
            for number, (name, values) in enumerate(told["curves"].items()):
                axes.plot(told["time"], values, label=name, **look(number))
            spread = np.array(told["curves"]["measured"])
            middle, half = 0.5 * (spread.max() + spread.min()), 0.9 * float(np.ptp(spread))
            axes.set_ylim(middle - half, middle + half)  # a model that runs away leaves the picture
            axes.set_title(f"{robot}, {told['joint']}", loc="left")
            axes.set_ylabel(told["unit"])
            axes.margins(x=0.0)
            most = max(most, axes.lines, key=len)
        for axes in grid.ravel()[len(traces) :]:
            axes.set_visible(False)
        for axes in grid[-1]:
            axes.set_xlabel("time [s]")
        legend(figure, grid[0, 0], len(most))
    save(figure, path)
