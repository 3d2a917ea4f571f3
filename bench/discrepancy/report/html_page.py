"""The diagnosis as a page: one self-contained HTML file with the verdict, the figures behind it, and the way back.

The first screen answers: where, which, how far, how sure, how complete, and what to do next. Below stand the judging records, where
the discrepancy lies, which effects were weighed, the parameters, the next test, and how to put the effect into one's own model.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from bench.discrepancy.articulated.diagnosis import ArticulatedDiagnosis
from bench.discrepancy.diagnosis import Diagnosis
from bench.discrepancy.judgement.shares import closed_words
from bench.discrepancy.report.answers import Files, level
from bench.discrepancy.report.articulated import articulated_page
from bench.discrepancy.report.interactive import correlation_plot, histories, waterfall_plot
from bench.discrepancy.report.locations import location_section
from bench.discrepancy.report.model_update import recipes
from bench.discrepancy.report.opening import add_next_test, add_ranking, opened, window, with_applied
from bench.discrepancy.report.simulated_records import MEASURED, NOMINAL, judged, variants
from bench.discrepancy.verdict import InSimulator
from bench.page import Page
from bench.recording import Recording


def page(
    diagnosis: Diagnosis | ArticulatedDiagnosis,
    applied: InSimulator | None = None,
    files: Files | None = None,
) -> Page:
    """Build the report of a diagnosis.

    Args:
        diagnosis: The diagnosis.
        applied: What was named in the user's own simulator, to be drawn beside it.
        files: What the commands that come next name; the case folder's where None.
    """
    files = files or Files.of(diagnosis.case)
    if isinstance(diagnosis, ArticulatedDiagnosis):
        return articulated_page(diagnosis, files, applied)
    verdict, case = diagnosis.verdict, diagnosis.case
    runs = variants(diagnosis)
    shown = with_applied(judged(diagnosis, runs), applied)
    out = opened(
        case.name, verdict, shown, files=files, settings=diagnosis.problem.settings.judgement, applied=applied
    )
    _gap_section(out, diagnosis, shown)
    location_section(out, diagnosis, runs)
    if verdict.ranking:
        _ranking_section(out, diagnosis)
    _parameter_section(out, diagnosis)
    add_next_test(out, verdict.next_excitation)
    _application_section(out, diagnosis)
    return out


def write_report(
    diagnosis: Diagnosis | ArticulatedDiagnosis,
    path: str | Path,
    *,
    applied: InSimulator | None = None,
    files: Files | None = None,
) -> None:
    """Write the report of a diagnosis as one HTML file.

    Args:
        diagnosis: The diagnosis.
        path: The file, written whole or not at all.
        applied: As of `page`.
        files: As of `page`.

    Raises:
        OutputError: The file cannot be written.
    """
    page(diagnosis, applied, files).write(path)


def _gap_section(out: Page, diagnosis: Diagnosis, shown: Mapping[str, Recording]) -> None:
    section = out.section("How far the discrepancy shrinks")
    settings = diagnosis.problem.settings.judgement
    for gap in diagnosis.verdict.gaps:
        section.table(
            f"{gap.metric}{' (' + gap.dof + ')' if gap.dof else ''}; closed, with its 95 % interval: "
            f"{closed_words(gap, settings=settings)}",
            ("model", "NRMSE", "closed"),
            [
                *(
                    (label, level(value), "" if i == 0 else closed_words(gap, value, settings=settings))
                    for i, (label, value) in enumerate(gap.steps)
                ),
                ("noise alone", level(gap.noise_floor), ""),
            ],
        )
    gap = diagnosis.verdict.gap
    if all(level(value) != "diverges" for _, value in gap.steps):
        section.plots([waterfall_plot(gap)], "The gap after each step, and the floor that the noise sets.")
    names = [g.dof for g in diagnosis.verdict.gaps if g.dof in shown[MEASURED].names]
    names = names or list(shown[MEASURED].names)
    if len(names) > 1:
        section.plots(
            [histories(shown, names, window=window(shown, names[0]))],
            "Every judged coordinate of the judging record, where the nominal model misses the first most.",
        )
    if len(shown) > 1:
        section.plots(
            [histories(shown, names, errors=True)],
            "What is left: simulated less measured, over the whole record.",
        )
    if NOMINAL not in shown:
        section.text("The nominal model diverges on the judging record; it is not drawn.")


def _ranking_section(out: Page, diagnosis: Diagnosis) -> None:
    verdict = diagnosis.verdict
    section = out.section("Which effect")
    add_ranking(section, verdict)
    first = diagnosis.explanations[0]
    rows = [
        (
            " + ".join(f"{p.effect.name}{f' ({p.place.name})' if p.place.name else ''}" for p in e.hypothesis)
            or "nothing",
            f"{e.log_posterior - first.log_posterior:.1f}",
            f"{e.reduced:.4g}",
            f"{e.reduced_on(diagnosis.case.validation[0]):.4g}",
        )
        for e in diagnosis.explanations[:8]
    ]
    section.table(
        "Explanations by posterior; a chi-squared of one is noise alone, and the last column is on a record that no fit has seen",
        ("explanation", "log odds against the first", "chi-squared", "chi-squared, judging record"),
        rows,
    )


def _parameter_section(out: Page, diagnosis: Diagnosis) -> None:
    section = out.section("Parameters")
    for problem, fitted in diagnosis.explanations[0].parts:
        deviations = np.sqrt(np.diag(fitted.covariance))
        rows = []
        for i, name in enumerate(problem.structure.parameters):
            value = problem.nominal[i] + problem.spread[i] * fitted.vector[i]
            std = problem.spread[i] * deviations[i]
            rows.append(
                (
                    name, f"{problem.nominal[i]:.5g}", f"{value:.5g}", f"{std:.2g}",
                    f"{value - 1.96 * std:.5g} to {value + 1.96 * std:.5g}", f"{fitted.vector[i]:+.2f}",
                )
            )  # fmt: skip
        header = ("parameter", "nominal", "estimate", "one-sigma", "95 % interval", "moved [stated sigma]")
        section.table("Re-estimated within their stated uncertainty, together with the effects", header, rows)
        free = [
            i
            for i, s in enumerate(deviations)
            if i >= len(problem.nominal) or (problem.spread[i] > 0.0 and s > 0.0)
        ]
        scale = np.maximum(deviations, 1e-300)
        correlation = (fitted.covariance / np.outer(scale, scale))[np.ix_(free, free)]
        labels = [
            *problem.structure.parameters,
            *(f"{p.effect.name}: {q.name}" for p in fitted.hypothesis for q in p.effect.parameters),
        ]
        if len(free) > 1:
            section.plots(
                [correlation_plot([labels[i] for i in free], correlation)],
                "Correlations of the estimates; a pair near one in magnitude is known as a combination only.",
            )


def _application_section(out: Page, diagnosis: Diagnosis) -> None:
    found = recipes(diagnosis)
    if not found:
        return
    section = out.section("Back into the model")
    section.text(
        "Each effect as an element of the bench in Python, as an entry of a rig configuration, and in MuJoCo's own elements where it "
        "has them. Re-estimated nominal parameters belong to it: see the table above."
    )
    for recipe in found:
        section.text(f"{recipe.title}: {recipe.equation}")
        if recipe.code:
            section.code(recipe.code)
            section.code(recipe.toml)
        if recipe.mjcf:
            section.code(recipe.mjcf)
        if recipe.note:
            section.text(recipe.note)
