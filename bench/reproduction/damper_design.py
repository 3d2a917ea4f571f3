"""B1: the damper's design model from 202 harmonic tests, and its limits (Tasbihgoo 2006, section 3.3.1, Fig 3.10)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from bench.figures import COLOURS, loops, style, time_histories
from bench.figures.look import axes_grid
from bench.identification.damper import (
    DesignFit,
    OnlineDesignFit,
    design_force,
    fit_design_model,
    fit_design_model_online,
)
from bench.identification.damper_study import DamperRecord, harmonic_record
from bench.identification.damper_trust import TrustReport, check_design_model
from bench.identification.harmonic_tests import HarmonicCampaign, harmonic_campaign
from bench.progress import ShowProgress
from bench.reproduction import damper_random
from bench.reproduction.damper_records import LOOPS, beside
from bench.reproduction.estimates import (
    ESTIMATES_SETUP,
    courses,
    fine,
)
from bench.reproduction.item import Item, Picture
from bench.reproduction.printed_figures import fig, panels
from bench.reproduction.verdict import (
    VERDICT_SETUP,
    Row,
    fact_row,
    told_row,
    value_row,
)


@dataclass(frozen=True)
class DamperDesignSetup:
    """Numbers of `bench.reproduction.damper_design`."""

    seed: int = 31


SETUP = DamperDesignSetup()


def _table_rows(campaign: HarmonicCampaign) -> list[Row]:
    rows = []
    for entry in campaign.table:
        unit = "kN (s/m)^n" if entry.parameter == "C" else "1"
        table = "3.1" if entry.method == "on line" else "3.2"
        name = f"Table {table}, {entry.method}: {entry.parameter}"
        n = len(campaign.tests)
        of_mean = 2.0 * math.sqrt((entry.printed_std**2 + entry.std**2) / n)
        of_std = 2.0 * math.sqrt((entry.printed_std**2 + entry.std**2) / (2.0 * (n - 1)))
        for what, printed, ours, error in (
            ("mean", entry.printed_mean, entry.mean, of_mean),
            ("standard deviation", entry.printed_std, entry.std, of_std),
        ):
            if table == "3.2":
                put_in = (
                    "C and n of the tests are drawn from this table: no evidence; "
                    f"ours is {ours:.4g}, {(ours - printed) / error:+.1f} limits away"
                )
                told = told_row(
                    f"{name}, {what}",
                    unit,
                    f"{ours:.4g}",
                    put_in,
                    printed=f"{printed:g}",
                    source="Table 3.2, p. 49, number",
                )
                rows.append(told._replace(chosen="drawn from this table"))
                continue
            rows.append(
                value_row(
                    f"{name}, {what}",
                    unit,
                    printed,
                    ours,
                    low=printed - error,
                    high=printed + error,
                    source="Table 3.1, p. 49, number",
                    tolerance=f"within {error:.2g} of the printed",
                    reason=f"two standard errors of the difference of two samples of {n}",
                    why="the list of tests, the friction and the elasticity of the damper are not printed; where these tests "
                    "drive the synthetic damper into its elasticity the fit answers with a C that is too large",
                )
            )
    return rows


def _nearly_the_same(campaign: HarmonicCampaign) -> Row:
    """Whether on-line and off-line means are nearly the same, as the text says of its own."""
    by = {(entry.method, entry.parameter): entry for entry in campaign.table}
    online, fitted = by["on line", "C"], by["least squares", "C"]
    ours = 100.0 * (fitted.mean / online.mean - 1.0)
    printed = 100.0 * (fitted.printed_mean / online.printed_mean - 1.0)
    return fact_row(
        "off-line mean of C over the on-line one",
        f"{ours:+.1f} %",
        ours > 0.0,
        printed=f"nearly the same measures; the tables differ by {printed:+.1f} %",
        source="p. 50, sentence; Tables 3.1, 3.2",
        tolerance="of the printed sign",
        reason="the text's own difference is four standard errors of its means: only its sign says something",
    )


def histograms(campaign: HarmonicCampaign) -> Figure:
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
                ("normal, printed", entry.printed_mean, entry.printed_std, ESTIMATES_SETUP.reference),
            ):
                density = np.exp(-0.5 * ((x - mean) / std) ** 2) / (std * np.sqrt(2.0 * np.pi))
                axes.plot(x, density, label=label, **look)
            axes.set_xlabel("C [kN (s/m)^n]" if entry.parameter == "C" else "n [1]")
            axes.set_ylabel("density [1/(kN (s/m)^n)]" if entry.parameter == "C" else "density [1]")
            axes.set_title(entry.method)
        handles, labels = grid[0, 0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=3)
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


def _convergence_row(slow: _SlowTest) -> Row:
    """How soon the estimates on line come to those of least squares."""
    late = slow.online.time > 4.0  # the first period
    c, n = slow.online.coefficients[late], slow.online.exponents[late]
    near = [
        100.0 * max(abs(values.max() / final - 1.0), abs(values.min() / final - 1.0))
        for values, final in ((c, slow.offline.coefficient), (n, slow.offline.exponent))
    ]
    return fact_row(
        "0.25 Hz, ±0.051 m: C and n on line converge to the off-line values within the first period",
        f"after it C stays within {near[0]:.1f} %, n within {near[1]:.1f} %",
        max(near) < 10.0,
        printed="converges to their optimum values within the first period",
        source=f"p. 48, sentence, and {fig('3.3 a, b')}",
        tolerance="within 10 % of the off-line values from the second period on",
        reason="5 % of the printed axis of C (200), about a tenth of its value, can be seen in the figure",
        shape=slow.online.settled <= 1.0,
        why="C and n trade against one another: the force they give together settles within the first period, C and n "
        "each a little away from least squares, which weighs the seal's friction less",
    )


def _settling_rows(campaign: HarmonicCampaign) -> list[Row]:
    """After how many periods the force of the estimates on line has settled."""
    settled = np.array([test.settled for test in campaign.tests])
    return [
        value_row(
            "on line, force of C and n settled after, median of all tests",
            "periods",
            "within the first cycle",
            float(np.median(settled)),
            high=1.0,
            source="p. 58, sentence",
            reason="one cycle",
        ),
        value_row(
            "the same: share of the tests within one period",
            "%",
            "within the first cycle",
            100.0 * float(np.mean(settled <= 1.0)),
            low=95.0,
            source="p. 58, sentence",
            reason="said of all data, with no exception named: all but what two standard deviations leave out",
            why="tests in which the damper yields elastically or its friction rules take longer",
        ),
    ]


def _fit_rows(slow: _SlowTest) -> list[Row]:
    """How good the design model is in the slow test."""
    return [
        value_row(
            "0.25 Hz, ±0.051 m: NMSE of the on-line model",
            "%",
            "curves of Fig 3.3 c to e nearly coincide",
            slow.online.nmse,
            high=VERDICT_SETUP.good_fit,
            source=fig("3.3 c"),
            reason="a good fit (section 3.4.2); no number is printed",
        ),
        fact_row(
            "0.25 Hz test: design model trusted by our own check",
            "yes" if slow.trust.trusted else "no",
            slow.trust.trusted,
            tolerance="yes",
            reason="in slow harmonic motion the model holds",
        ),
    ]


def _rows(campaign: HarmonicCampaign, slow: _SlowTest) -> tuple[Row, ...]:
    return (
        *_table_rows(campaign),
        _nearly_the_same(campaign),
        value_row(
            "harmonic tests",
            "1",
            202.0,
            float(len(campaign.tests)),
            low=202.0,
            high=202.0,
            source="p. 49, number",
            reason="a count",
            chosen="the number of tests",
        ),
        _convergence_row(slow),
        *_settling_rows(campaign),
        *_fit_rows(slow),
        value_row(
            "tests of the campaign in which the model is trusted",
            "1",
            None,
            float(campaign.n_trusted),
            reason="reported: where it is not, the damper yields elastically",
        ),
        *damper_random.rows(),
    )


def _pictures(campaign: HarmonicCampaign, slow: _SlowTest) -> tuple[Picture, ...]:
    online, offline = slow.online, slow.offline
    forces = {"design model": design_force(slow.record.velocity, online.coefficient, online.exponent)}
    drawn = {
        "C [kN (s/m)^n]": (1e-3 * online.coefficients, 1e-3 * offline.coefficient, (0.0, 200.0)),
        "n [1]": (online.exponents, offline.exponent, (-2.0, 2.0)),
    }
    records = beside(slow.record, forces)
    return (
        Picture(
            "course",
            "Harmonic test of 0.25 Hz and ±0.051 m: C and n on line (Fig 3.3 a, b).",
            courses(online.time, drawn),
            panels("3.3", "ab"),
        ),
        Picture(
            "harmonic_force",
            "The same test: measured force and design model over time (Fig 3.3 c).",
            fine(time_histories(records, ["force"], window=(15.0, 25.0))),
            panels("3.3", "c"),
        ),
        Picture(
            "harmonic",
            "The same test: measured force and design model (Fig 3.3 d, e).",
            fine(loops(records, LOOPS)),
            panels("3.3", "de"),
        ),
        Picture(
            "histograms",
            "C and n over the 202 tests (Fig 3.4).",
            histograms(campaign),
            panels("3.4", "abcd"),
        ),
        *damper_random.pictures(),
    )


def run(progress: ShowProgress) -> Item:
    """Make the item."""
    rng = np.random.default_rng(SETUP.seed)
    progress("202 harmonic tests", 0.05)
    campaign = harmonic_campaign(rng)
    progress("one slow test", 0.8)
    slow = _slow_test(rng)
    progress("random motion", 0.85)
    text = (
        "A synthetic damper of the printed size: a power-law dashpot in series with a spring, with seal "
        "friction, a small stiffness and a moving mass beside it. C and n of each test are drawn from "
        "the printed distributions of Table 3.2, within the axes of Fig 3.4; the list of tests was not "
        "printed and covers the actuator's limits. The fits see the measured force and velocity only. "
        "The logarithmic form weighs small speeds as much as large ones, where friction rules: its "
        "estimates lie below those of least squares, as printed. Table 3.2 is what was put in, and no evidence; Table 3.1 "
        "comes out of the identification. Where the damper yields elastically the fits answer with a C that means "
        "nothing, which widens the spread: these tests fail the check of trust. On random motion the design model is "
        "run on line as in Fig 3.10, in a narrow band, in that of B2, and from 0.1 to 3 Hz."
    )
    searched = "the scatter of C and n, drawn from Table 3.2; list of tests, friction, elasticity and bands, none printed"
    return Item(text, _rows(campaign, slow), _pictures(campaign, slow), searched)
