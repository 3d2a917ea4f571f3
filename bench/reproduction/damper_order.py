"""B3: how many powers the damper's model bears (Tasbihgoo 2006, Figs 3.11 and 3.12)."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from bench.figures import COLOURS, style
from bench.figures.look import axes_grid
from bench.identification.damper_study import OrderStudy, order_study, random_record
from bench.reproduction.estimates import REFERENCE
from bench.reproduction.item import Item, Picture, Progress, Row, fact_row, value_row

SEED = 33
HIGHEST = 35
FIXED = 5


def error_map(study: OrderStudy) -> Figure:
    """Error over both orders, and along each with the other fixed (Fig 3.11)."""
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
            study.orders, error[:, FIXED], color=COLOURS[1], label=f"order of x varied, v at {FIXED}"
        )
        axes.semilogy(
            study.orders, error[FIXED, :], color=COLOURS[0], label=f"order of v varied, x at {FIXED}"
        )
        axes.set_xlabel("order")
        axes.set_ylabel("NMSE on unseen data [%]")
        axes.legend()
    return figure


def indicators(study: OrderStudy) -> Figure:
    """Mass and error over the common order (Fig 3.12 a and f)."""
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
        axes.axvline(study.optimum, label=f"optimum {study.optimum}", **REFERENCE)
        if study.blow_up is not None:
            axes.axvline(study.blow_up, color="#777777", linestyle=":", label=f"blow-up {study.blow_up}")
        axes.set_ylabel("NMSE [%]")
        axes.set_xlabel("order of x and v")
        axes.legend()
    return figure


def _rows(study: OrderStudy) -> tuple[Row, ...]:
    error = np.diag(study.validation)
    by_x = float(np.ptp(np.log10(study.validation[1:11, FIXED])))
    by_v = float(np.ptp(np.log10(study.validation[FIXED, 0:11])))
    last = float(error[-1])
    return (
        value_row(
            "optimum common order, found automatically",
            "1",
            None,
            float(study.optimum),
            low=2.0,
            high=float(HIGHEST - 1),
            requirement="inside the orders tried",
        ),
        value_row("NMSE on unseen data at the optimum", "%", None, float(error[study.optimum])),
        value_row("lowest order within 10 % of it", "1", None, float(study.sufficient)),
        fact_row(
            "over-parameterisation found: error above twice its least from order",
            "never" if study.blow_up is None else str(study.blow_up),
            study.blow_up is not None,
            printed="error rises again at high orders",
            requirement="found",
        ),
        value_row(
            f"NMSE on unseen data at order {HIGHEST}", "%", None, last, low=2.0 * float(error[study.optimum])
        ),
        fact_row(
            "error ruled by the order of v, not of x (orders to 10, decades)",
            f"v {by_v:.2f}, x {by_x:.2f}",
            by_v > 2.0 * by_x,
            printed="largely invariant to x",
            requirement="v more than twice x",
        ),
        fact_row(
            "mass estimate leaves its plateau at order",
            "never" if study.mass_leaves is None else str(study.mass_leaves),
            study.mass_leaves is not None,
            printed="invariant until over-parameterised",
            requirement="found",
        ),
        value_row(
            "coefficient of the acceleration on the plateau (the moving mass is 20)",
            "kg",
            None,
            study.mass_plateau,
        ),
    )


def _pictures(study: OrderStudy) -> tuple[Picture, ...]:
    return (
        Picture(
            "map", "Error over both orders, and along each with the other at 5 (Fig 3.11).", error_map(study)
        ),
        Picture(
            "indicators", "Estimated mass and error over the common order (Fig 3.12 a, f).", indicators(study)
        ),
    )


def run(progress: Progress) -> Item:
    """Make the item."""
    progress("random tests", 0.02)
    rng = np.random.default_rng(SEED)
    training, validation = random_record(rng), random_record(rng)
    progress(f"fitting all {(HIGHEST + 1) ** 2} pairs of orders", 0.1)
    study = order_study(training, validation, highest=HIGHEST)
    text = (
        "Polynomials of all pairs of orders 0 to 35 in displacement and velocity, with the mass, fitted "
        "to one random record of 60 s and judged on another of the same kind. Chebyshev columns span the "
        "same models as the printed powers and remain distinguishable in double precision. The "
        "coefficient of the acceleration is the indicator that the text proposes. It is no mass: in so "
        "narrow a band the lag of the damper's force behind its velocity looks like a negative one of "
        "tonnes, and the 20 kg that move are lost beside it; that it stays the same until the model has "
        "too many terms is what counts."
    )
    return Item(text, _rows(study), _pictures(study))
