"""The course of a monitored damper."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from bench.errors import ParameterError
from bench.figures.look import COLOURS, axes_grid, style
from bench.monitoring import DamperMonitor


def monitored(monitor: DamperMonitor) -> Figure:
    """Energy of each period over that learnt, running C and n, and the cumulative sums with their threshold.

    Args:
        monitor: After the record.

    Raises:
        ParameterError: It has judged no period yet.
    """
    if monitor.baseline is None or not monitor.judged:
        raise ParameterError("the monitor has judged no period; let it learn and take a record first")
    learnt, periods = monitor.baseline, monitor.judged
    end = np.array([period.end for period in periods])
    inside = np.array([period.inside for period in periods])
    share = np.array([period.share for period in periods])
    with style():
        figure, grid = axes_grid(8.0, 6.2, nrows=4, sharex=True)
        axes = grid[0, 0]
        axes.plot(end[inside], share[inside], ".", color="#1a1a1a", markersize=3, label="judged")
        if not inside.all():
            axes.plot(
                end[~inside], share[~inside], "x", color="#999999", markersize=4, label="motion not learnt"
            )
        axes.axhline(1.0, color="#777777", linewidth=0.8)
        axes.set_ylabel("energy over learnt [1]")
        axes.legend(loc="lower left")
        for axes, values, final, label in (
            (grid[1, 0], [period.coefficient for period in periods], learnt.coefficient, "C, running"),
            (grid[2, 0], [period.exponent for period in periods], learnt.exponent, "n, running"),
        ):
            axes.plot(end, values, color="#1a1a1a", linewidth=0.9)
            axes.axhline(final, color="#777777", linewidth=0.8)
            axes.set_ylabel(f"{label} [SI]")
        axes = grid[3, 0]
        axes.plot(end, [period.fallen for period in periods], color=COLOURS[0], label="fallen")
        axes.plot(end, [period.risen for period in periods], color=COLOURS[1], label="risen")
        axes.axhline(learnt.threshold, color="#D55E00", linestyle=(0, (5, 2)), label="threshold")
        axes.set_ylabel("cumulative sum [σ]")
        axes.set_xlabel("time [s]")
        axes.legend(loc="upper left", ncols=3)
        for axes in grid[:, 0]:
            for alarm in monitor.alarms:
                axes.axvline(alarm.time, color="#D55E00", linewidth=0.8)
            axes.margins(x=0.0)
    return figure
