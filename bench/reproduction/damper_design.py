"""B1: the damper's design model from 202 harmonic tests, and its limits (Tasbihgoo 2006, section 3.3.1, Fig 3.10)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from bench.figures import COLOURS, loops, style
from bench.figures.look import axes_grid
from bench.identification.damper import (
    DesignFit,
    OnlineDesignFit,
    TrustReport,
    check_design_model,
    design_force,
    fit_design_model,
    fit_design_model_online,
)
from bench.identification.damper_study import (
    Campaign,
    DamperRecord,
    harmonic_campaign,
    harmonic_record,
    random_record,
)
from bench.reproduction.damper_records import LOOPS, beside
from bench.reproduction.estimates import REFERENCE, fine
from bench.reproduction.item import Item, Picture, Progress, Row, fact_row, value_row

SEED = 31


def _table_rows(campaign: Campaign) -> list[Row]:
    rows = []
    for entry in campaign.table:
        unit = "kN (s/m)^n" if entry.parameter == "C" else "1"
        table = "3.1" if entry.method == "on line" else "3.2"
        name = f"Table {table}, {entry.method}: {entry.parameter}"
        rows.append(
            value_row(
                f"{name}, mean",
                unit,
                entry.printed_mean,
                entry.mean,
                low=entry.printed_mean - entry.printed_std,
                high=entry.printed_mean + entry.printed_std,
                requirement=f"within one printed σ, ±{entry.printed_std:g}",
            )
        )
        rows.append(value_row(f"{name}, standard deviation", unit, entry.printed_std, entry.std))
    return rows


def histograms(campaign: Campaign) -> Figure:
    """Densities of C and n over the tests, with the normal densities of ours and of the printed statistics (Fig 3.4)."""
    samples = {
        ("on line", "C"): [1e-3 * test.online_coefficient for test in campaign.tests],
        ("on line", "n"): [test.online_exponent for test in campaign.tests],
        ("least squares", "C"): [1e-3 * test.fitted_coefficient for test in campaign.tests],
        ("least squares", "n"): [test.fitted_exponent for test in campaign.tests],
    }
    with style():
        figure, grid = axes_grid(8.2, 5.0, nrows=2, ncols=2)
        for axes, entry in zip(grid.flat, campaign.table, strict=True):
            values = np.array(samples[entry.method, entry.parameter])
            end = 150.0 if entry.parameter == "C" else 1.5
            axes.hist(values, bins=25, range=(0.0, end), density=True, color="#bbbbbb", label="tests")
            x = np.linspace(0.0, end, 200)
            for label, mean, std, look in (
                ("normal, ours", entry.mean, entry.std, {"color": COLOURS[1]}),
                ("normal, printed", entry.printed_mean, entry.printed_std, REFERENCE),
            ):
                density = np.exp(-0.5 * ((x - mean) / std) ** 2) / (std * np.sqrt(2.0 * np.pi))
                axes.plot(x, density, label=label, **look)
            axes.set_xlabel("C [kN (s/m)^n]" if entry.parameter == "C" else "n [1]")
            axes.set_ylabel("density [1/(kN (s/m)^n)]" if entry.parameter == "C" else "density [1]")
            axes.set_title(entry.method)
        handles, labels = grid[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=3)
    return figure


def _course(time: np.ndarray, courses: dict[str, tuple[np.ndarray, float, tuple[float, float]]]) -> Figure:
    """Estimates over time with the off-line values dashed; the axes are those of the printed figures."""
    with style():
        figure, grid = axes_grid(8.0, 3.4, nrows=len(courses), sharex=True)
        for axes, (label, (values, final, span)) in zip(grid[:, 0], courses.items(), strict=True):
            axes.plot(time, values, color="#1a1a1a", linewidth=1.2, label="on line")
            axes.axhline(final, label="nonlinear least squares", **REFERENCE)
            axes.set_ylim(span)
            axes.set_ylabel(label)
            axes.margins(x=0.0)
        grid[-1, 0].set_xlabel("time [s]")
        handles, labels = grid[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=2)
    return figure


class _SlowTest(NamedTuple):
    """The harmonic test of 0.25 Hz and ±0.051 m, and the design models found from it."""

    record: DamperRecord
    online: OnlineDesignFit
    offline: DesignFit
    trust: TrustReport


def _slow_test(rng: np.random.Generator) -> _SlowTest:
    test = harmonic_record(0.25, 0.051, rng=rng, periods=15)
    return _SlowTest(
        test,
        fit_design_model_online(test.time, test.velocity, test.force, frequency=0.25),
        fit_design_model(test.velocity, test.force),
        check_design_model(test.time, test.displacement, test.velocity, test.force),
    )


def _rows(campaign: Campaign, slow: _SlowTest, trust: TrustReport) -> tuple[Row, ...]:
    return (
        *_table_rows(campaign),
        value_row("harmonic tests", "1", 202.0, float(len(campaign.tests)), low=202.0, high=202.0),
        value_row("0.25 Hz, ±0.051 m: on line settled after", "periods", 1.0, slow.online.settled, high=1.0),
        value_row("on line settled after, median of all tests", "periods", 1.0, campaign.settled, high=1.0),
        value_row("0.25 Hz, ±0.051 m: NMSE of the on-line model", "%", None, slow.online.nmse, high=5.0),
        fact_row(
            "0.25 Hz test: design model trusted",
            "yes" if slow.trust.trusted else "no",
            slow.trust.trusted,
            requirement="yes",
        ),
        fact_row(
            "random motion ±0.0254 m: design model trusted",
            "no: " + "; ".join(trust.reasons) if trust.reasons else "yes",
            not trust.trusted,
            printed="incapable of tracking C and n",
            requirement="no",
        ),
        value_row("random motion: NMSE of the best design model", "%", None, trust.fit.nmse),
        value_row(
            "tests of the campaign in which the model is trusted", "1", None, float(campaign.n_trusted)
        ),
    )


def _pictures(
    campaign: Campaign, slow: _SlowTest, wild: DamperRecord, trust: TrustReport
) -> tuple[Picture, ...]:
    online, offline = slow.online, slow.offline
    forces = {"design model": design_force(slow.record.velocity, online.coefficient, online.exponent)}
    wild_forces = {"design model": design_force(wild.velocity, trust.fit.coefficient, trust.fit.exponent)}
    courses = {
        "C [kN (s/m)^n]": (1e-3 * online.coefficients, 1e-3 * offline.coefficient, (0.0, 200.0)),
        "n [1]": (online.exponents, offline.exponent, (-2.0, 2.0)),
    }
    return (
        Picture(
            "course",
            "Harmonic test of 0.25 Hz and ±0.051 m: C and n on line (Fig 3.3 a, b).",
            _course(online.time, courses),
        ),
        Picture(
            "harmonic",
            "The same test: measured force and design model (Fig 3.3 d, e).",
            fine(loops(beside(slow.record, forces), LOOPS)),
        ),
        Picture("histograms", "C and n over the 202 tests (Fig 3.4).", histograms(campaign)),
        Picture(
            "random",
            "Random motion: the design model is a curve, the damper draws loops (Fig 3.10 d, e).",
            fine(loops(beside(wild, wild_forces), LOOPS, window=(15.0, 25.0))),
        ),
    )


def run(progress: Progress) -> Item:
    """Make the item."""
    rng = np.random.default_rng(SEED)
    progress("202 harmonic tests", 0.05)
    campaign = harmonic_campaign(rng)
    progress("one slow test", 0.8)
    slow = _slow_test(rng)
    progress("random motion", 0.85)
    wild = random_record(rng)
    trust = check_design_model(wild.time, wild.displacement, wild.velocity, wild.force)
    text = (
        "A synthetic damper of the printed size: a power-law dashpot in series with a spring, with seal "
        "friction, a small stiffness and a moving mass beside it. C and n of each test are drawn from "
        "the printed distributions of Table 3.2, within the axes of Fig 3.4; the list of tests was not "
        "printed and covers the actuator's limits. The fits see the measured force and velocity only. "
        "The logarithmic form weighs small speeds as much as large ones, where friction rules: its "
        "estimates lie below those of least squares, as printed. Table 3.2 thus comes out near what was "
        "put in; Table 3.1 comes out of the identification. Where the damper yields elastically the fits "
        "answer with a C that means nothing, which widens the spread: these tests fail the check of "
        "trust."
    )
    return Item(text, _rows(campaign, slow, trust), _pictures(campaign, slow, wild, trust))
