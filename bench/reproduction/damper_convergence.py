"""What the start covariance of B2 decides: errors, and how many of the 37 parameters reach their batch values (Fig 3.6).

The text does not print P(0) of chapter 3. A small one holds the estimates back as a ridge would: the record is followed
worse while it is learnt (Fig 3.5), terms of high order, which trade against each other, stay small, and the estimates do
not go to the batch values. A larger one reverses each of these.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bench.identification.damper_study import (
    DAMPER_STUDY_SETTINGS,
    INCH,
    PolynomialExperiment,
    polynomial_experiment,
)
from bench.progress import ShowProgress
from bench.reproduction.printed_figures import fig
from bench.reproduction.verdict import (
    VERDICT_SETUP,
    Row,
    fact_row,
    one_of_ours,
    value_row,
)


@dataclass(frozen=True)
class DamperConvergenceSetup:
    """Numbers of `bench.reproduction.damper_convergence`."""

    covariances: tuple[float, float, float] = (20.0, 1e3, 1e7)
    """Start covariances: that of the pictures, that printed for chapter 2, and one that hardly holds back."""
    near: float = 0.1
    few_cycles: float = 10.0
    """[s]; about six cycles of motion whose mean frequency is 0.6 Hz."""


SETUP = DamperConvergenceSetup()
CHOSEN = "P(0) = 20, for the printed errors and their order"


class ConvergenceOutcome(NamedTuple):
    """One run of the experiment."""

    online: float
    half: float
    segment: float
    soon: int  # parameters within a tenth of their batch values after FEW_CYCLES, to the end
    end: int  # at the end
    rest: float  # largest contribution of a parameter that is not, over the largest force
    cancel: float  # correlation of the contributions of v^3 and v^5


def outcome(experiment: PolynomialExperiment) -> ConvergenceOutcome:
    """What is judged of a run."""
    away = np.abs(experiment.theta / experiment.theta_batch - 1.0) > SETUP.near
    late = experiment.time >= SETUP.few_cycles
    peak = float(np.abs(experiment.measured).max())
    largest = np.abs(experiment.contributions).max(axis=0) / peak
    names = list(experiment.names)
    third, fifth = (experiment.contributions[:, names.index(name)] for name in ("a03", "a05"))
    return ConvergenceOutcome(
        experiment.online,
        experiment.half_amplitude,
        experiment.other_segment,
        int(np.sum(~away[late].any(axis=0))),
        int(np.sum(~away[-1])),
        float(largest[away[-1]].max(initial=0.0)),
        float(np.corrcoef(third, fifth)[0, 1]),
    )


class Study(NamedTuple):
    """Outcomes over all seeds, by start covariance, and the errors within one record of half the amplitude."""

    by_covariance: dict[float, list[ConvergenceOutcome]]
    within_half: list[float]


def study(progress: ShowProgress) -> Study:
    """Run the experiment for each start covariance and seed."""
    found: dict[float, list[ConvergenceOutcome]] = {}
    within = []
    for number, covariance in enumerate(SETUP.covariances):
        progress(f"P(0) = {covariance:g}", number / len(SETUP.covariances))
        found[covariance] = [
            outcome(polynomial_experiment(np.random.default_rng(seed), initial_covariance=covariance))
            for seed in VERDICT_SETUP.seeds
        ]
    for seed in VERDICT_SETUP.seeds:
        small = polynomial_experiment(np.random.default_rng(seed), peak=0.5 * INCH)
        within.append(small.other_segment)
    return Study(found, within)


def rows(shown: PolynomialExperiment, found: Study) -> list[Row]:
    """The errors beside the printed ones, what P(0) does to them, and the sentences on Figs 3.6 and 3.7."""
    first = found.by_covariance[SETUP.covariances[0]]
    ours = outcome(shown)
    return [
        *_error_rows(ours, found),
        _order_row(ours, first),
        *_covariance_rows(found),
        *_convergence_rows(ours, found),
    ]


def _error_rows(ours: ConvergenceOutcome, found: Study) -> list[Row]:
    first = found.by_covariance[SETUP.covariances[0]]
    drawn = {
        "on line": ("3.5", "p. 51", ours.online, [run.online for run in first]),
        "half amplitude": ("3.8", "p. 55", ours.half, [run.half for run in first]),
        "other segment": ("3.9", "p. 56", ours.segment, [run.segment for run in first]),
    }
    made = []
    for name, (number, page, value, seeds) in drawn.items():
        printed = DAMPER_STUDY_SETTINGS.printed_nmse[name]
        good = printed < VERDICT_SETUP.good_fit
        made.append(
            one_of_ours(
                f"{name}: NMSE",
                "%",
                printed,
                value,
                seeds,
                source=f"{page}, number; {fig(number)}",
                shape=(0.0, VERDICT_SETUP.good_fit) if good else (VERDICT_SETUP.good_fit, 100.0),
                shape_text=f"both are {'below' if good else 'above'} 5 %, a good fit",
                chosen=CHOSEN,
                why="damper, band and P(0) are ours; the synthetic damper's memory leaves 1.2 to 1.4 % to the best polynomial "
                "of this order, so that little room is left below the printed 1.40 %",
            )
        )
    made.append(
        one_of_ours(
            "other segment, both of the record of half the amplitude: NMSE",
            "%",
            DAMPER_STUDY_SETTINGS.printed_nmse["other segment"],
            found.within_half[0],
            found.within_half,
            source=f"p. 56, number; the axes of {fig('3.9')} are those of the record of ±0.013 m",
            shape=(0.0, VERDICT_SETUP.good_fit),
            shape_text="both are below 5 %, a good fit",
            chosen=CHOSEN,
            why="as before: P(0) = 20 holds the estimates back, and more so on half the motion",
        )
    )
    return made


def _order_row(ours: ConvergenceOutcome, first: list[ConvergenceOutcome]) -> Row:
    def ordered(run: ConvergenceOutcome) -> bool:
        return run.segment < run.online < run.half

    held = sum(ordered(run) for run in first)
    names = {"other segment": ours.segment, "on line": ours.online, "half amplitude": ours.half}
    return fact_row(
        "order of the three errors",
        " < ".join(sorted(names, key=lambda name: names[name])),
        held > len(first) // 2,
        printed="other segment < on line < half amplitude",
        source="pp. 51, 55, 56, numbers",
        tolerance="as printed, on most seeds",
        reason="an order has no tolerance; seeds may differ",
        spread=f"as printed on {held} of {len(first)}",
        chosen=CHOSEN,
    )


def _covariance_rows(found: Study) -> list[Row]:
    made = []
    measures: dict[str, tuple[str, Callable[[ConvergenceOutcome], float]]] = {
        "on line": ("3.5", lambda run: run.online),
        "half amplitude": ("3.8", lambda run: run.half),
        "other segment": ("3.9", lambda run: run.segment),
    }
    for covariance in SETUP.covariances[1:]:
        for name, (number, of) in measures.items():
            seeds = [of(run) for run in found.by_covariance[covariance]]
            made.append(
                one_of_ours(
                    f"{name}, P(0) = {covariance:g}: NMSE",
                    "%",
                    DAMPER_STUDY_SETTINGS.printed_nmse[name],
                    seeds[0],
                    seeds,
                    source=f"number; {fig(number)}",
                    shape=(0.0, VERDICT_SETUP.good_fit)
                    if DAMPER_STUDY_SETTINGS.printed_nmse[name] < VERDICT_SETUP.good_fit
                    else (VERDICT_SETUP.good_fit, 100.0),
                    shape_text="on the same side of 5 %, a good fit",
                    why="with a larger P(0) the estimator follows the record from its first seconds on, as batch least squares "
                    "would, and its estimates bear half the amplitude better: the printed errors are those of an "
                    "estimator held back, or of a worse start",
                )
            )
    return made


def _convergence_rows(ours: ConvergenceOutcome, found: Study) -> list[Row]:
    made = []
    for covariance in SETUP.covariances:
        runs = found.by_covariance[covariance]
        shown = ours if covariance == SETUP.covariances[0] else runs[0]
        for when, value, of in (
            (f"from {SETUP.few_cycles:g} s on", shown.soon, lambda run: run.soon),
            ("at 60 s", shown.end, lambda run: run.end),
        ):
            made.append(
                value_row(
                    f"parameters within a tenth of their batch values {when}, P(0) = {covariance:g}",
                    "of 37",
                    "most, with few exceptions, within a few cycles",
                    float(value),
                    low=19.0,
                    source=f"p. 52, sentence; {fig('3.6')}",
                    reason="most: more than half of 37; a tenth of a value can be told in the printed panels",
                    seeds=[float(of(run)) for run in runs],
                    why="powers of x and v on a narrow band are nearly dependent: many sets of 37 values give the same force, "
                    "and 60 s of noise decide between them only for P(0) of 1e7, at the end, on some records",
                )
            )
    first = found.by_covariance[SETUP.covariances[0]]
    made += [
        value_row(
            "largest contribution of a parameter that has not converged at 60 s, over the largest force",
            "1",
            "insignificant",
            ours.rest,
            high=0.05,
            source=f"p. 52, sentence; {fig('3.7')}",
            reason="a twentieth of the printed axis (±1), about what can be seen",
            seeds=[run.rest for run in first],
            why="with P(0) = 20 even the terms in v, which carry the force, have not reached their batch values",
        ),
        value_row(
            "contributions of v³ and v⁵: correlation",
            "1",
            "cancel each other",
            ours.cancel,
            high=-0.5,
            source=f"p. 54, sentence (θ4 and θ6); {fig('3.7')}",
            reason="terms that cancel are of opposite sign most of the time",
            seeds=[run.cancel for run in first],
            why="with P(0) = 20 both stay small and of one sign; the batch values of v³ and v⁵ are of opposite sign",
        ),
    ]
    return made
