"""The diagnosis of an articulated model as a page and as a rerun recording.

Below the answers the page shows how far the discrepancy shrinks joint by joint, what each effect would close at each joint, and what
was re-estimated.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.arrays import Array
from bench.discrepancy.articulated.diagnosis import ArticulatedDiagnosis
from bench.discrepancy.articulated_judgement.free_runs import FreeRuns
from bench.discrepancy.articulated_judgement.torque_error import TorqueProblem
from bench.discrepancy.articulated_search.fitting import ArticulatedFit
from bench.discrepancy.judgement.shares import closed_words
from bench.discrepancy.report.answers import Files, level
from bench.discrepancy.report.ghost import with_ghost
from bench.discrepancy.report.interactive import histories, matrix_plot
from bench.discrepancy.report.opening import add_next_test, add_ranking, opened, with_applied
from bench.discrepancy.report.simulated_records import MEASURED, NOMINAL
from bench.discrepancy.verdict import InSimulator
from bench.errors import ModelError
from bench.page import Page
from bench.recording import Recording
from bench.rig import Rig

FINAL = "with what is named"
CAPTIONS = {
    "position": "one joint free at a time",
    "torque": "torques of the drives along the measured motion",
}
"""Quantity that is judged to how it is drawn."""


@dataclass(frozen=True)
class ArticulatedReportSettings:
    """Numbers of `bench.discrepancy.report.articulated`."""

    shown_joints: int = 3
    """Joints whose histories are drawn: those with most of the discrepancy."""


SETTINGS = ArticulatedReportSettings()


def simulated_joints(diagnosis: ArticulatedDiagnosis) -> dict[str, Recording]:
    """Positions of all joints in the first judging record: measured, nominal, and with what is named.

    Where no servo holds a joint, the record begins with the second of its windows, as it does where it judges.
    """
    judging = diagnosis.judging
    prepared = judging.records[0]
    errors = {label: _errors(diagnosis, fit) for label, fit in ((NOMINAL, None), (FINAL, diagnosis.final))}
    length = min(len(one) for columns in errors.values() for one in columns)
    measured = np.column_stack([record.position for record in prepared.joints])[-length:]
    runs = {MEASURED: measured}
    for label, columns in errors.items():
        runs[label] = measured - np.column_stack([one[-length:] for one in columns])
    units = {joint.name: joint.unit for joint in judging.joints}
    return {
        label: Recording.from_arrays(
            prepared.record.time[-length:], {name: columns[:, j] for j, name in enumerate(units)}, units=units
        )
        for label, columns in runs.items()
        if np.isfinite(columns).all()
    }


def _errors(diagnosis: ArticulatedDiagnosis, fit: ArticulatedFit | None) -> list[Array]:
    """(n_joints,) of errors (n,) in the first judging record, the latter part of it where windows begin anew."""
    judging = diagnosis.judging
    hypothesis = fit.hypothesis if fit else ()
    vector = fit.vector if fit else np.zeros(len(judging.nominal))
    runs = FreeRuns(judging.settled(hypothesis, vector))
    prepared = runs.problem.motions(hypothesis, vector)[0]
    return [runs.errors(j, hypothesis, vector, prepared) for j in range(len(judging.joints))]


def judged_torques(diagnosis: ArticulatedDiagnosis) -> dict[str, Recording]:
    """Torques of all drives in the first judging record, means over short intervals: logged, and as the models ask for along the motion.

    Of a diagnosis by torque (`bench.discrepancy.articulated_judgement.torque_error`), in the places of what `simulated_joints` returns.
    """
    problem = TorqueProblem.like(diagnosis.judging)
    prepared, n = problem.records[0], problem.intervals[0]
    joints = range(len(problem.joints))
    logged = np.column_stack([problem.logged(j, 0) for j in joints])
    time = prepared.record.time[0] + (np.arange(len(logged)) + 0.5) * n * prepared.record.step
    runs = {MEASURED: logged}
    for label, hypothesis, vector in (
        (NOMINAL, (), np.zeros(len(problem.nominal))), (FINAL, diagnosis.final.hypothesis, diagnosis.final.vector),
    ):  # fmt: skip
        moved = problem.motions(hypothesis, vector)[0]
        missing = [problem.missing(j, hypothesis, vector, 0, moved) for j in joints]
        runs[label] = logged - np.column_stack(missing)
    names = {j.name: "N m" if j.unit == "rad" else "N" for j in problem.joints}
    return {
        label: Recording.from_arrays(time, {name: rows[:, j] for j, name in enumerate(names)}, units=names)
        for label, rows in runs.items()
    }


def articulated_page(
    diagnosis: ArticulatedDiagnosis, files: Files, applied: InSimulator | None = None
) -> Page:
    """Build the report.

    Args:
        diagnosis: The diagnosis.
        files: What the commands that come next name.
        applied: What was named in the user's own simulator, to be drawn beside it.
    """
    by_torque = isinstance(diagnosis.problem, TorqueProblem)
    runs = judged_torques(diagnosis) if by_torque else with_applied(simulated_joints(diagnosis), applied)
    out = opened(
        diagnosis.case.name, diagnosis.verdict, runs, files=files,
        settings=diagnosis.problem.settings.judgement, applied=applied,
    )  # fmt: skip
    _how_far(out, diagnosis, runs)
    _where(out, diagnosis)
    _parameters(out, diagnosis)
    add_next_test(out, diagnosis.verdict.next_excitation)
    return out


def _how_far(out: Page, diagnosis: ArticulatedDiagnosis, runs: Mapping[str, Recording]) -> None:
    section = out.section("How far the discrepancy shrinks")
    what, how = diagnosis.verdict.gap.metric.split(" NRMSE, ")
    quantity = what.split()[-1]
    section.table(
        f"NRMSE of the {quantity} on the judging records: {how}",
        ("joint", "nominal model", "parameters only", "with what is named", "noise alone", "closed"),
        [
            (
                g.dof,
                *(level(x) for x in (g.before, g.parameters_only, g.after, g.noise_floor)),
                closed_words(g),
            )
            for g in diagnosis.verdict.gaps
        ],
    )
    worst = sorted(diagnosis.verdict.gaps, key=lambda gap: -gap.over_noise)
    names = [g.dof for g in worst[: SETTINGS.shown_joints]]
    section.plots(
        [histories(runs, names), histories(runs, names, errors=True)],
        f"Judging record, {CAPTIONS[quantity]}: the joints with most of the discrepancy, and what each model misses them by.",
    )


def _where(out: Page, diagnosis: ArticulatedDiagnosis) -> None:
    section = out.section("Where the gap lies")
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
    if any(diagnosis.matrix.values()):
        section.plots(
            [matrix_plot(diagnosis.matrix)],
            "Part [%] of a joint's own discrepancy that one effect alone closes there, on the records for identification; empty where "
            "the screening promised too little for a fit.",
        )
    if diagnosis.verdict.ranking:
        add_ranking(section, diagnosis.verdict)


def _parameters(out: Page, diagnosis: ArticulatedDiagnosis) -> None:
    section = out.section("Parameters")
    section.table(
        "Re-estimated within their stated uncertainty",
        ("parameter", "stated", "estimate", "moved [stated sigma]"),
        [
            (
                p.name,
                p.stated_text,
                f"{p.value:.5g} ± {p.std:.2g}",
                f"{p.shift_in_std:+.2f}",
            )
            for p in diagnosis.verdict.nominal
        ],
    )


def write_articulated_rerun(diagnosis: ArticulatedDiagnosis, path: str | Path) -> None:
    """Write the first judging record, measured and simulated, as a ``.rrd`` file; the measured motion is a ghost over each simulation."""
    from bench.rerun_log import log_comparison  # noqa: PLC0415  (rerun, for pictures only)

    runs = simulated_joints(diagnosis)
    rigs: dict[str, Rig] = {}
    with contextlib.suppress(ModelError):  # the curves are worth having without the model
        rig = with_ghost(Path(diagnosis.case.folder or ".") / diagnosis.case.rig)
        rigs = {label: rig for label in runs if label != MEASURED}
    angles = {label: np.column_stack([run[name] for name in run.names]) for label, run in runs.items()}
    log_comparison(
        path, rigs, runs, loops=[], bands=[],
        poses={label: np.hstack([angles[label], angles[MEASURED]]) for label in rigs},
        title=f"diagnosis of {diagnosis.case.name}: {diagnosis.verdict.explanation}",
    )  # fmt: skip
