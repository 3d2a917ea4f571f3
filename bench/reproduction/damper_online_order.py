"""The text's own order study: the identification error of the on-line estimator over the orders of its polynomial.

Figs 3.11 and 3.12 draw the error of the adaptive least squares on the record that they learn from, and the values that the
estimates tend to. P(0) is not printed; the study is made for three of them. The panels of Fig 3.12 are labelled x'', x, x'^3,
x, x^3; its caption has x'', x, x', x^3, x'^3, and those are drawn here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from bench.figures import COLOURS, style
from bench.figures.look import axes_grid
from bench.identification.adaptive import AdaptiveLeastSquares
from bench.identification.damper_study import DamperRecord
from bench.identification.regressors import Reference, polynomial_model
from bench.recording import nmse


@dataclass(frozen=True)
class DamperOnlineOrderSetup:
    """Numbers of `bench.reproduction.damper_online_order`."""

    covariances: tuple[float, float, float] = (20.0, 1e3, 1e7)
    orders: tuple[int, ...] = (1, 2, 3, 4, 5, 6, 8, 10, 12, 15, 20, 27, 35)
    """Common orders: all of the low ones; beyond, a run costs the fourth power of the order."""
    map_orders: tuple[int, ...] = (0, 1, 2, 3, 5, 8, 12, 20, 27, 35)
    fixed: int = 5
    every: int = 10
    """Samples of the record taken: one in ten, 50 Hz for motion below 1 Hz."""


DAMPER_ONLINE_ORDER_SETUP = DamperOnlineOrderSetup()
FOLLOWED = {"m": "x''", "a10": "x", "a01": "x'", "a30": "x³", "a03": "x'³"}
"""Estimates drawn in Fig 3.12 a to e, and their terms."""


class OrderPoint(NamedTuple):
    """One run: its error, start included [%], and the asymptotic values of `FOLLOWED`, NaN where the order has no such term."""

    error: float
    values: NDArray[np.float64]


class OnlineStudy(NamedTuple):
    """The errors and estimates over the orders.

    Attributes:
        diagonal: Runs of `orders` in both, by start covariance.
        over_x: Error over orders 0 to 35 in x, v at `fixed` (36,) [%].
        over_v: The same over the order in v (36,) [%].
        surface: Error over `map_orders` in x (rows) and v [%].
    """

    diagonal: dict[float, list[OrderPoint]]
    over_x: NDArray[np.float64]
    over_v: NDArray[np.float64]
    surface: NDArray[np.float64]


def run_online(record: DamperRecord, order_x: int, order_v: int, covariance: float) -> OrderPoint:
    """Run the estimator over a record."""
    part = record.part(slice(None, None, DAMPER_ONLINE_ORDER_SETUP.every))
    peaks = [float(np.abs(channel).max()) for channel in part[1:]]
    model = polynomial_model(order_x, order_v, reference=Reference(peaks[3], peaks[0], peaks[1], peaks[2]))
    # A window longer than the record: the monitor of excitation costs the cube of the number of terms.
    estimator = AdaptiveLeastSquares(model, initial_covariance=covariance, window=1e4)
    history = estimator.run(
        part.time,
        force=part.force,
        displacement=part.displacement,
        velocity=part.velocity,
        acceleration=part.acceleration,
        every=1,
    )
    learnt = np.isfinite(history.measured)
    # orders of two digits are written apart: "a1,0" for "a10"
    end = dict(zip((name.replace(",", "") for name in model.names), history.theta[-1], strict=True))
    values = np.array([end.get(name, np.nan) for name in FOLLOWED])
    return OrderPoint(nmse(history.measured[learnt], history.predicted[learnt]), values)


def online_study(record: DamperRecord, highest: int) -> OnlineStudy:
    """Make the study on one record; the lines and the surface with the printed P(0) of chapter 2, 1000."""
    printed = DAMPER_ONLINE_ORDER_SETUP.covariances[1]
    orders = range(highest + 1)
    return OnlineStudy(
        {
            covariance: [
                run_online(record, order, order, covariance) for order in DAMPER_ONLINE_ORDER_SETUP.orders
            ]
            for covariance in DAMPER_ONLINE_ORDER_SETUP.covariances
        },
        np.array(
            [run_online(record, order, DAMPER_ONLINE_ORDER_SETUP.fixed, printed).error for order in orders]
        ),
        np.array(
            [run_online(record, DAMPER_ONLINE_ORDER_SETUP.fixed, order, printed).error for order in orders]
        ),
        np.array(
            [
                [run_online(record, p, q, printed).error for q in DAMPER_ONLINE_ORDER_SETUP.map_orders]
                for p in DAMPER_ONLINE_ORDER_SETUP.map_orders
            ]
        ),
    )


def surface_figure(study: OnlineStudy) -> Figure:
    """Identification error over both orders (Fig 3.11 a) and along each (b, c)."""
    with style():
        figure, grid = axes_grid(11.0, 3.4, ncols=3)
        axes = grid[0, 0]
        axes.grid(visible=False)
        place = np.arange(len(DAMPER_ONLINE_ORDER_SETUP.map_orders))
        drawn = axes.pcolormesh(place, place, study.surface.T, cmap="viridis", rasterized=True)
        figure.colorbar(drawn, ax=axes, label="identification error, NMSE [%]")
        axes.set_xticks(place, [str(order) for order in DAMPER_ONLINE_ORDER_SETUP.map_orders])
        axes.set_yticks(place, [str(order) for order in DAMPER_ONLINE_ORDER_SETUP.map_orders])
        axes.set_xlabel("order of x")
        axes.set_ylabel("order of v")
        for axes, error, name in (
            (grid[0, 1], study.over_x, "order of x (v at 5)"),
            (grid[0, 2], study.over_v, "order of v (x at 5)"),
        ):
            axes.plot(range(len(error)), error, color="#1a1a1a")
            axes.set_ylim(0.0, 100.0)
            axes.set_xlabel(name)
            axes.set_ylabel("identification error, NMSE [%]")
    return figure


def asymptotes_figure(study: OnlineStudy) -> Figure:
    """Asymptotic values over the order, each over its largest, and the identification error (Fig 3.12 a to f)."""
    with style():
        figure, grid = axes_grid(10.0, 5.0, nrows=2, ncols=3, sharex=True)
        for number, (covariance, points) in enumerate(study.diagonal.items()):
            values = np.array([point.values for point in points])
            for k, (axes, term) in enumerate(zip(grid.flat, FOLLOWED.values(), strict=False)):
                column = values[:, k] / np.nanmax(np.abs(values[:, k]))
                axes.plot(
                    DAMPER_ONLINE_ORDER_SETUP.orders,
                    column,
                    "o-",
                    markersize=3,
                    color=COLOURS[number],
                    label=f"P(0) = {covariance:g}",
                )
                axes.set_ylim(-1.1, 1.1)
                axes.set_title(f"estimate of {term}, over its largest", fontsize=8)
                axes.set_ylabel("[1]")
            axes = grid[1, 2]
            axes.plot(
                DAMPER_ONLINE_ORDER_SETUP.orders,
                [point.error for point in points],
                "o-",
                markersize=3,
                color=COLOURS[number],
            )
            axes.set_ylim(0.0, 20.0)
            axes.set_title("identification error", fontsize=8)
            axes.set_ylabel("NMSE [%]")
        for axes in grid[-1]:
            axes.set_xlabel("order of x and v")
        figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=3)
    return figure
