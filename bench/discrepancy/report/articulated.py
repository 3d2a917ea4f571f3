"""The diagnosis of an articulated model as a page and as a rerun recording.

The page answers in the order of the questions: what is missing, how far the discrepancy shrinks, at which joint it lies, what was
re-estimated, and how to put the effect into one's own MJCF.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.articulated.diagnosis import ArticulatedDiagnosis
from bench.discrepancy.articulated.free_runs import FreeRuns
from bench.discrepancy.articulated_search.fitting import ArticulatedFit
from bench.page import Page
from bench.recording import Recording

Array = NDArray[np.float64]
MEASURED, NOMINAL, FINAL = "measured", "nominal model", "with what is named"


@dataclass(frozen=True)
class ArticulatedSettings:
    """Numbers of `bench.discrepancy.report.articulated`."""

    shown_joints: int = 3
    """Joints whose histories are drawn: those with most of the discrepancy."""


SETTINGS = ArticulatedSettings()


def simulated_joints(diagnosis: ArticulatedDiagnosis) -> dict[str, Recording]:
    """Positions of all joints in the first judging record: measured, nominal, and with what is named."""
    judging = diagnosis.judging
    prepared = judging.records[0]
    measured = np.column_stack([record.position for record in prepared.joints])
    runs = {MEASURED: measured}
    for label, fit in ((NOMINAL, None), (FINAL, diagnosis.final)):
        runs[label] = measured - _errors(diagnosis, fit)
    units = {joint.name: joint.unit for joint in judging.joints}
    return {
        label: Recording.from_arrays(
            prepared.record.time, {name: columns[:, j] for j, name in enumerate(units)}, units=units
        )
        for label, columns in runs.items()
        if np.isfinite(columns).all()
    }


def _errors(diagnosis: ArticulatedDiagnosis, fit: ArticulatedFit | None) -> Array:
    judging = diagnosis.judging
    hypothesis = fit.hypothesis if fit else ()
    vector = fit.vector if fit else np.zeros(len(judging.nominal))
    runs = FreeRuns(judging.settled(hypothesis, vector))
    prepared = runs.problem.motions(hypothesis, vector)[0]
    factors = [1.0 + record.encoder.gain for record in prepared.joints]
    return np.column_stack([
        factors[j] * runs.errors(j, hypothesis, vector, prepared) for j in range(len(judging.joints))
    ])  # fmt: skip


def articulated_page(diagnosis: ArticulatedDiagnosis) -> Page:
    """Build the report."""
    verdict = diagnosis.verdict
    out = Page(
        f"Diagnosis of {diagnosis.case.name}", verdict.explanation, f"{verdict.seconds:.1f} s of computation"
    )
    _what(out, diagnosis)
    _how_far(out, diagnosis)
    _where(out, diagnosis)
    _parameters(out, diagnosis)
    return out


def _what(out: Page, diagnosis: ArticulatedDiagnosis) -> None:
    section = out.section("What is missing")
    for effect in diagnosis.verdict.named:
        low, high = effect.closed_ci95
        section.table(
            f"{effect.name} ({effect.where}): {effect.equation}; closes {100 * effect.closed:.3g} % of the squared discrepancy "
            f"({100 * low:.3g} to {100 * high:.3g} %)",
            ("parameter", "value", "one-sigma", "unit"),
            [(name, f"{e.value:.5g}", f"{e.std:.2g}", e.unit) for name, e in effect.parameters.items()],
        )
    for group in diagnosis.verdict.indistinguishable:
        section.text(f"These records cannot tell apart: {', '.join(group)}.")
    for warning in diagnosis.verdict.warnings:
        section.text(f"Note: {warning}.")


def _how_far(out: Page, diagnosis: ArticulatedDiagnosis) -> None:
    from bench.figures import time_histories  # noqa: PLC0415  (matplotlib)

    section = out.section("How far the discrepancy shrinks")
    section.table(
        "NRMSE of the position on the judging records: " + diagnosis.verdict.gap.metric.split("NRMSE, ")[-1],
        ("joint", "before", "parameters only", "after", "noise alone"),
        [
            (g.dof, *(f"{x:.3g}" for x in (g.before, g.parameters_only, g.after, g.noise_floor)))
            for g in diagnosis.verdict.gaps
        ],
    )
    runs = simulated_joints(diagnosis)
    worst = sorted(diagnosis.verdict.gaps, key=lambda g: -g.before / max(g.noise_floor, 1e-12))[
        : SETTINGS.shown_joints
    ]
    section.figure(
        time_histories(runs, [g.dof for g in worst]),
        "Judging record: measured, the nominal model, and the model with what is named; one joint free at a time.",
    )


def _where(out: Page, diagnosis: ArticulatedDiagnosis) -> None:
    section = out.section("Where it lies")
    section.table(
        "What the nominal model leaves beyond the noise, its parameters re-estimated",
        ("joint", "share", "band [Hz]", "time [s]"),
        [
            (
                p.dof,
                f"{100 * p.share:.3g} %",
                f"{p.band_hz[0]:.3g} to {p.band_hz[1]:.3g}",
                f"{p.time_s[0]:.3g} to {p.time_s[1]:.3g}",
            )
            for p in diagnosis.verdict.locations
        ],
    )
    joints = list(diagnosis.matrix)
    effects = sorted({name for row in diagnosis.matrix.values() for name in row})
    if effects:
        section.table(
            "Part of a joint's own discrepancy that one effect alone closes there (records for identification); empty where the "
            "screening promised too little for a fit",
            ("effect", *joints),
            [
                (
                    name,
                    *(
                        f"{100 * diagnosis.matrix[j][name]:.3g} %" if name in diagnosis.matrix[j] else ""
                        for j in joints
                    ),
                )
                for name in effects
            ],
        )


def _parameters(out: Page, diagnosis: ArticulatedDiagnosis) -> None:
    section = out.section("Nominal parameters")
    section.table(
        "Re-estimated within their stated uncertainty",
        ("parameter", "stated", "estimate", "shift in stated sigmas"),
        [
            (
                p.name,
                f"{p.stated:.5g} ± {p.stated_std:.2g}",
                f"{p.value:.5g} ± {p.std:.2g}",
                f"{p.shift_in_std:+.2f}",
            )
            for p in diagnosis.verdict.nominal
        ],
    )


def write_articulated_rerun(diagnosis: ArticulatedDiagnosis, path: str | Path) -> None:
    """Write the first judging record, measured and simulated, as a ``.rrd`` file."""
    from bench.rerun_log import log_comparison  # noqa: PLC0415  (rerun, for pictures only)

    log_comparison(
        path, {}, simulated_joints(diagnosis), loops=[], bands=[],
        title=f"diagnosis of {diagnosis.case.name}: {diagnosis.verdict.explanation}",
    )  # fmt: skip
