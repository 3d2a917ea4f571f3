"""B3: how many powers the damper's model bears (Tasbihgoo 2006, Figs 3.11 and 3.12).

First the text's own quantity, the error of the on-line estimator on the record that it learns from; then, beside it, batch
least squares of all orders judged on a record that they have not seen.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from bench.figures import COLOURS, style
from bench.figures.look import axes_grid
from bench.identification.damper_study import OrderStudy, order_study, random_record
from bench.progress import ShowProgress
from bench.reproduction.damper_online_order import (
    DAMPER_ONLINE_ORDER_SETUP,
    FOLLOWED,
    OnlineStudy,
    OrderPoint,
    asymptotes_figure,
    online_study,
    surface_figure,
)
from bench.reproduction.estimates import (
    ESTIMATES_SETUP,
)
from bench.reproduction.item import Item, Picture
from bench.reproduction.printed_figures import fig, panels
from bench.reproduction.verdict import (
    VERDICT_SETUP,
    Row,
    fact_row,
    value_row,
)


@dataclass(frozen=True)
class DamperOrderSetup:
    """Numbers of `bench.reproduction.damper_order`."""

    seed: int = 33
    highest: int = 35
    fixed: int = 5
    seeds_highest: int = 14
    """Highest order of the study on further seeds; all of them are over-parameterised before it."""


SETUP = DamperOrderSetup()


def error_map(study: OrderStudy) -> Figure:
    """Error over both orders, and along each with the other fixed, on unseen data."""
    error = np.clip(study.validation, 1e-2, 1e3)
    with style():
        figure, grid = axes_grid(9.6, 3.4, ncols=2)
        axes = grid[0, 0]
        axes.grid(visible=False)
        drawn = axes.pcolormesh(
            study.orders, study.orders, error.T, norm="log", cmap="viridis", rasterized=True
        )
        figure.colorbar(drawn, ax=axes, label="NMSE on unseen data [%]")
        axes.plot(study.optimum, study.optimum, "o", color=COLOURS[0], label=f"optimum {study.optimum}")
        axes.set_xlabel("order of x")
        axes.set_ylabel("order of v")
        axes.legend(loc="upper right", frameon=True, framealpha=1.0)
        axes = grid[0, 1]
        axes.semilogy(
            study.orders,
            error[:, SETUP.fixed],
            color=COLOURS[1],
            label=f"order of x varied, v at {SETUP.fixed}",
        )
        axes.semilogy(
            study.orders,
            error[SETUP.fixed, :],
            color=COLOURS[0],
            label=f"order of v varied, x at {SETUP.fixed}",
        )
        axes.set_xlabel("order")
        axes.set_ylabel("NMSE on unseen data [%]")
        axes.legend()
    return figure


def indicators(study: OrderStudy) -> Figure:
    """Mass and error over the common order, of batch least squares."""
    mass, error, trained = (np.diag(values) for values in (study.mass, study.validation, study.training))
    with style():
        figure, grid = axes_grid(8.0, 4.4, nrows=2, sharex=True)
        axes = grid[0, 0]
        axes.plot(study.orders, mass, "o-", markersize=3, color="#1a1a1a")
        axes.axhspan(
            study.mass_plateau - study.mass_band,
            study.mass_plateau + study.mass_band,
            color="#dddddd",
            label="plateau",
        )
        span = 6.0 * study.mass_band
        axes.set_ylim(study.mass_plateau - span, study.mass_plateau + span)
        axes.set_ylabel("estimated mass [kg]")
        axes.legend()
        axes = grid[1, 0]
        axes.semilogy(
            study.orders, np.clip(error, 1e-2, 1e4), "o-", markersize=3, color=COLOURS[0], label="unseen data"
        )
        axes.semilogy(
            study.orders,
            np.clip(trained, 1e-2, 1e4),
            "o-",
            markersize=3,
            color=COLOURS[1],
            label="data fitted",
        )
        axes.axvline(study.optimum, label=f"optimum {study.optimum}", **ESTIMATES_SETUP.reference)
        if study.blow_up is not None:
            axes.axvline(study.blow_up, color="#777777", linestyle=":", label=f"blow-up {study.blow_up}")
        axes.set_ylabel("NMSE [%]")
        axes.set_xlabel("order of x and v")
        axes.legend()
    return figure


def _diagonal_rows(covariance: float, points: list[OrderPoint]) -> list[Row]:
    """Error and mass over the common order, for one start covariance."""
    error = np.array([point.error for point in points])
    mass = np.array([point.values[0] for point in points])
    rises = float(error[-1] / error.min())
    return [
        fact_row(
            f"identification error falls with the order, P(0) = {covariance:g}",
            f"{error[0]:.2f} % at order {DAMPER_ONLINE_ORDER_SETUP.orders[0]}, "
            f"{error.min():.2f} % at order {DAMPER_ONLINE_ORDER_SETUP.orders[int(error.argmin())]}",
            error.min() < error[0],
            printed="decreases with the model order until over-parameterisation",
            source=f"p. 61, sentence (i); {fig('3.12 f')}",
            tolerance="least at a higher order than the first",
            reason="no number is printed",
        ),
        value_row(
            f"identification error at order {DAMPER_ONLINE_ORDER_SETUP.orders[-1]} over its least, P(0) = {covariance:g}",
            "1",
            "will not always decrease with increasing order; over-parameterisation",
            rises,
            low=1.1,
            source=f"p. 61, sentence (ii); {fig('3.11')}, {fig('3.12 f')}",
            reason="a tenth of the error can be told in the printed figure",
            why="a finite P(0) is a ridge that holds back what the record does not determine: the on-line error then only "
            "flattens. On unseen data the error of batch least squares does rise (below)",
        ),
        fact_row(
            f"estimate of the mass over the orders from 3 on, P(0) = {covariance:g}",
            f"{mass[2:].min():.0f} … {mass[2:].max():.0f} kg",
            float(np.ptp(mass[2:])) < 0.1 * abs(float(np.median(mass[2:]))),
            printed="the only parameter that remains largely invariant until over-parameterised",
            source=f"p. 61, sentence (iii); {fig('3.12 a')}",
            tolerance="within a tenth of its median",
            reason="a tenth of the axis of ±1 can be told in the printed figure",
            why="with a large P(0) the coefficient of the acceleration moves with the order as the others do",
        ),
    ]


def _order_rows(study: OnlineStudy) -> list[Row]:
    """What moves with the order, and which of the two orders rules the error."""
    points = study.diagonal[1e3]
    moved = [
        float(np.ptp(values[2:]) / np.abs(np.median(values[2:])))
        for values in np.array([point.values for point in points]).T
    ]
    by_x, by_v = (float(np.ptp(values[1:11])) for values in (study.over_x, study.over_v))
    return [
        fact_row(
            "the mass is the estimate that moves least with the order, P(0) = 1000",
            ", ".join(
                f"{name} {100.0 * value:.0f} %" for name, value in zip(FOLLOWED.values(), moved, strict=True)
            ),
            moved[0] == min(moved),
            printed="the only parameter largely invariant; the others change with the order",
            source=f"p. 61, sentences (ii), (iii); {fig('3.12 a to e')}",
            tolerance="least range over its median, orders from 3 on",
            reason="an order of the five has no tolerance",
            shape=moved[0] < 0.1,
            why="the estimate of x moves as little as that of x''; those of v, x³ and v³ change with the order, as printed",
        ),
        fact_row(
            "identification error ruled by the order of v, not of x (orders 1 to 10, range)",
            f"v {by_v:.2f} %, x {by_x:.2f} %",
            by_v > 2.0 * by_x,
            printed="largely invariant to the order of x, whereas the order of v controls the error",
            source=f"p. 61, sentence (i); {fig('3.11 b, c')}",
            tolerance="range along v more than twice that along x",
            reason="no number is printed; less than the double is not to be ruled",
        ),
    ]


def _online_rows(study: OnlineStudy) -> list[Row]:
    """The sentences of section 3.4.2 on the identification error of the on-line estimator."""
    diagonal = [
        row for covariance, points in study.diagonal.items() for row in _diagonal_rows(covariance, points)
    ]
    return [*diagonal, *_order_rows(study), _indicator_row(study)]


def _indicator_row(study: OnlineStudy) -> Row:
    """Whether the on-line mass leaves its value where the on-line error rises, for any start covariance."""
    told, found = [], False
    for covariance, points in study.diagonal.items():
        error, mass = (
            np.array(column) for column in zip(*((p.error, p.values[0]) for p in points), strict=True)
        )
        rises = np.flatnonzero((np.arange(len(error)) > error.argmin()) & (error > 1.1 * error.min()))
        leaves = np.flatnonzero(np.abs(mass[2:] / np.median(mass[2:]) - 1.0) > 0.1) + 2
        told.append(
            f"P(0) = {covariance:g}: error rises at {DAMPER_ONLINE_ORDER_SETUP.orders[rises[0]] if rises.size else 'no order'}, "
            f"mass leaves at {DAMPER_ONLINE_ORDER_SETUP.orders[leaves[0]] if leaves.size else 'no order'}"
        )
        found |= bool(rises.size and leaves.size and abs(int(rises[0]) - int(leaves[0])) <= 1)
    return fact_row(
        "on line, the mass leaves its value where the error rises",
        "; ".join(told),
        found,
        printed="can be used as an indicator of model over-parameterisation",
        source="p. 61, sentence",
        tolerance="both happen for some P(0), within one of the orders tried",
        reason="an indicator that never changes indicates nothing",
        why="held back by P(0), the estimates of too many terms stay small instead of running wild, and the coefficient of the "
        "acceleration with them. It is no mass either: the lag of the damper's force looks like minus tonnes, 20 kg move",
    )


def _batch_rows(study: OrderStudy, others: list[OrderStudy]) -> list[Row]:
    """Batch least squares of all orders on unseen data."""
    error = np.diag(study.validation)
    optimum = [float(other.optimum) for other in others]
    blow = [other.blow_up for other in others]
    leaves = [other.mass_leaves for other in others]
    both = [(a, b) for a, b in zip(blow, leaves, strict=True) if a is not None and b is not None]
    near = sum(abs(a - b) <= 1 for a, b in both)
    best = [float(np.diag(other.validation).min()) for other in others]
    return [
        value_row(
            "unseen data, batch: NMSE at the best common order",
            "%",
            None,
            float(error[study.optimum]),
            high=VERDICT_SETUP.good_fit,
            reason="a good fit (section 3.4.2)",
            seeds=best,
        ),
        value_row(
            "unseen data, batch: best common order",
            "1",
            None,
            float(study.optimum),
            reason="reported",
            seeds=optimum,
        ),
        fact_row(
            "unseen data, batch: error above twice its least from order",
            "never" if study.blow_up is None else str(study.blow_up),
            all(value is not None for value in blow),
            printed="over-parameterisation",
            source="p. 61, sentence (ii), there of the data identified",
            tolerance="on every seed",
            reason="double the error is not noise",
            spread=f"{min(v for v in blow if v is not None)} … {max(v for v in blow if v is not None)}"
            if any(v is not None for v in blow)
            else "never",
            shape=any(value is not None for value in blow),
            why=f"on some seeds the error does not double up to order {SETUP.seeds_highest}, where the study of further seeds ends",
        ),
        fact_row(
            "unseen data, batch: the mass leaves its plateau within one order of where the error doubles",
            f"error {study.blow_up}, mass {study.mass_leaves}",
            near > len(others) // 2,
            printed="can be used as an indicator of model over-parameterisation",
            source="p. 61, sentence",
            tolerance="on most seeds",
            reason="an indicator names the order, or the one beside it",
            spread=f"within one order on {near} of {len(others)}; error {_list(blow)}, mass {_list(leaves)}",
            why="the coefficient of the acceleration leaves its plateau after the error has doubled, or not at all: the error on "
            "unseen data is the sharper sign",
        ),
    ]


def _list(values: list[int | None]) -> str:
    return ", ".join("never" if value is None else str(value) for value in values)


def _pictures(study: OrderStudy, online: OnlineStudy) -> tuple[Picture, ...]:
    return (
        Picture(
            "online_map",
            "Identification error of the on-line estimator over both orders, and along each, P(0) = 1000 (Fig 3.11).",
            surface_figure(online),
            panels("3.11", "abc"),
        ),
        Picture(
            "asymptotes",
            "Asymptotic values of five estimates and the identification error over the common order (Fig 3.12 a to f).",
            asymptotes_figure(online),
            panels("3.12", "abcdef"),
        ),
        Picture(
            "map", "Beside it: batch least squares, error on unseen data over both orders.", error_map(study)
        ),
        Picture(
            "indicators",
            "Beside it: mass and error of batch least squares over the common order.",
            indicators(study),
        ),
    )


def run(progress: ShowProgress) -> Item:
    """Make the item."""
    progress("random tests", 0.02)
    rng = np.random.default_rng(SETUP.seed)
    training, validation = random_record(rng), random_record(rng)
    progress("on-line estimator over the orders", 0.05)
    online = online_study(training, SETUP.highest)
    progress(f"fitting all {(SETUP.highest + 1) ** 2} pairs of orders", 0.5)
    study = order_study(training, validation, highest=SETUP.highest)
    others = []
    for number, seed in enumerate(VERDICT_SETUP.seeds):
        progress(f"seed {seed}", 0.8 + 0.015 * number)
        draws = np.random.default_rng(seed)
        pair = random_record(draws), random_record(draws)
        others.append(order_study(*pair, highest=SETUP.seeds_highest))
    text = (
        "First the text's own quantity: the on-line estimator with polynomials of orders up to 35, its error on the record "
        "it learns from, and the values its estimates tend to. Beside it batch least squares of all pairs of orders "
        "(Chebyshev columns, which span the same models as powers and remain distinguishable in double precision), fitted to "
        "one random record of 60 s and judged on another. The text proposes the estimate of the mass as the indicator of too "
        "many terms."
    )
    rows = (*_online_rows(online), *_batch_rows(study, others))
    searched = (
        "damper, band and P(0), none printed; lines and surface with P(0) = 1000, printed for chapter 2"
    )
    return Item(text, rows, _pictures(study, online), searched)
