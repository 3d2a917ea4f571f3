"""The diagnosis as a page: one self-contained HTML file with the verdict, the pictures behind it, and the way back.

The page answers in the order of the questions: what is missing, where the gap lies, how sure that is, how far the gap
shrinks, and how to put the effect into one's own model.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bench.discrepancy.diagnosis import Diagnosis
from bench.discrepancy.locate import cell_map, missing_force
from bench.discrepancy.shrink import coordinates, nominal_prediction
from bench.discrepancy.structure import Place
from bench.page import Page
from bench.recording import Recording

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PERIODS_SHOWN = 8.0
"""Seconds around the largest response that the overlays show."""


def simulated(diagnosis: Diagnosis) -> dict[str, Recording]:
    """Measured, nominal and final responses of the first judging record, as recordings.

    Returns:
        "measured", "nominal model" and "with the effect" (or "with the closure").
    """
    record = diagnosis.case.validation[0]
    units = {c.name: c.unit or "1" for c in diagnosis.case.channels}
    final = "with the closure" if diagnosis.verdict.verdict == "unknown" else "with the effect"
    runs = {
        "measured": dict(record.values),
        "nominal model": dict(nominal_prediction(diagnosis.problem)(record)),
        final: diagnosis.final.predict(record),
    }
    return {
        label: Recording.from_arrays(record.time, values, units={name: units[name] for name in values})
        for label, values in runs.items()
        if all(np.isfinite(v).all() for v in values.values())
    }


def page(diagnosis: Diagnosis) -> Page:
    """Build the report of a diagnosis."""
    verdict = diagnosis.verdict
    out = Page(
        f"Diagnosis of {diagnosis.case.name}", verdict.explanation, f"{verdict.seconds:.1f} s of computation"
    )
    section = out.section("Verdict")
    section.table(
        "Probabilities",
        ("verdict", "probability"),
        [(k, f"{p:.3f}") for k, p in verdict.probabilities.items()],
    )
    for effect in verdict.named:
        where = f" ({effect.where})" if effect.where else ""
        section.table(
            f"{effect.name}{where}, probability {effect.probability:.3f}: {effect.equation}",
            ("parameter", "value", "one-sigma", "unit"),
            [(name, f"{e.value:.5g}", f"{e.std:.2g}", e.unit) for name, e in effect.parameters.items()],
        )
    for group in verdict.indistinguishable:
        section.text(f"These records cannot tell apart: {', '.join(group)}.")
    for warning in verdict.warnings:
        section.text(f"Note: {warning}.")
    _gap_section(out, diagnosis)
    _location_section(out, diagnosis)
    rows = [(r.name, r.where, f"{r.probability:.4f}") for r in verdict.ranking[:12]]
    if rows:
        out.section("Ranking").table(
            "Effects by posterior probability", ("effect", "place", "probability"), rows
        )
    _parameter_section(out, diagnosis)
    if verdict.next_excitation:
        proposal = verdict.next_excitation
        out.section("The next test").text(
            f"To tell {proposal['separates'][0]} from {proposal['separates'][1]}: {proposal['excitation']}, peak load "
            f"{proposal['peak_load']:.3g}, {proposal['duration_s']:.3g} s. Expected log odds "
            f"{proposal['expected_log_odds']:.3g}; the present records give {proposal['log_odds_now']:.3g}."
        )
    _application_section(out, diagnosis)
    return out


def write_report(diagnosis: Diagnosis, path: str | Path) -> None:
    """Write the report of a diagnosis as one HTML file."""
    page(diagnosis).write(path)


def _gap_section(out: Page, diagnosis: Diagnosis) -> None:
    from bench.figures import time_histories, waterfall  # noqa: PLC0415  (matplotlib, for reports only)

    section = out.section("How far the gap shrinks")
    for gap in diagnosis.verdict.gaps:
        low, high = gap.closed_ci95
        section.table(
            f"{gap.metric}{' (' + gap.dof + ')' if gap.dof else ''}: {100 * gap.closed:.1f} % closed "
            f"(95 % interval {100 * low:.1f} to {100 * high:.1f} %)",
            ("stage", "NRMSE"),
            [
                *((label, f"{value:.4f}") for label, value in gap.steps),
                ("noise floor", f"{gap.noise_floor:.4f}"),
            ],
        )
    gap = diagnosis.verdict.gap
    values = [value for _, value in gap.steps]
    if np.all(np.isfinite(values)):
        figure = waterfall(
            [label for label, _ in gap.steps[1:]], values, floor=gap.noise_floor, axis="NRMSE [1]"
        )
        section.figure(figure, "The gap after each step, and the floor that the noise sets.")
    runs = simulated(diagnosis)
    channels = [name for _, names in coordinates(diagnosis.problem.structure) for name, _ in names]
    reference = runs["measured"]
    middle = float(reference.time[int(np.argmax(np.abs(reference[channels[0]])))])
    window = (
        max(float(reference.time[0]), middle - 0.5 * PERIODS_SHOWN),
        min(float(reference.time[-1]), middle + 0.5 * PERIODS_SHOWN),
    )
    figure = time_histories(runs, channels, window=window)
    section.figure(
        figure, "Judging record: measured, nominal model, and final model, around the largest response."
    )


def _location_section(out: Page, diagnosis: Diagnosis) -> None:
    section = out.section("Where the gap lies")
    rows = []
    for location in diagnosis.verdict.locations:
        region = (
            "; ".join(f"{k} {a:.3g} to {b:.3g}" for k, (a, b) in location.state_region.items())
            or "everywhere"
        )
        band = f"{location.band_hz[0]:.3g} to {location.band_hz[1]:.3g}"
        span = f"{location.time_s[0]:.3g} to {location.time_s[1]:.3g}"
        rows.append((location.channel, location.dof, f"{100 * location.share:.1f} %", band, span, region))
    if rows:
        header = ("channel", "degree of freedom", "share", "band [Hz]", "time [s]", "region of the state")
        section.table("Residuals of the nominal model, parameters re-estimated", header, rows)
    for place in diagnosis.problem.structure.places:
        if len(place.rows) == 1:
            section.figure(
                state_map(diagnosis, place),
                f"Force that the nominal model lacks along the measured motion{' (' + place.name + ')' if place.name else ''}; "
                "filled cells differ from zero significantly.",
            )


def state_map(diagnosis: Diagnosis, place: Place) -> Figure:
    """Draw the missing force over displacement and over velocity, by cells, with their significance."""
    from bench.figures.look import axes_grid, style  # noqa: PLC0415  (matplotlib, for reports only)

    problem, best = diagnosis.problem, diagnosis.explanations[0]
    force = np.concatenate([missing_force(problem, best, place, i) for i in range(len(problem.records))])
    with style():
        figure, axes = axes_grid(9.0, 3.2, nrows=1, ncols=2)
        for ax, kind, unit in zip(
            np.ravel(axes),
            ("position", "velocity"),
            (place.position_unit, f"{place.position_unit}/s"),
            strict=True,
        ):
            samples = [getattr(problem.motion(i), kind) @ place.rows[0] for i in range(len(problem.records))]
            cells = cell_map(np.concatenate(samples), force)
            centres = 0.5 * (cells.edges[1:] + cells.edges[:-1])
            width = 0.9 * (cells.edges[1] - cells.edges[0])
            ax.bar(centres, np.nan_to_num(cells.force), width, color="none", edgecolor="0.6")
            ax.bar(centres[cells.significant], cells.force[cells.significant], width, color="#0072b2")
            ax.set_xlabel(f"{kind} [{unit}]")
            ax.set_ylabel(f"mean missing force [{place.force_unit}]")
    return figure


def _parameter_section(out: Page, diagnosis: Diagnosis) -> None:
    section = out.section("Nominal parameters")
    for problem, fitted in diagnosis.explanations[0].parts:
        deviations = np.sqrt(np.diag(fitted.covariance))
        rows = []
        for i, name in enumerate(problem.structure.parameters):
            value = problem.nominal[i] + problem.spread[i] * fitted.vector[i]
            rows.append(
                (
                    name,
                    f"{problem.nominal[i]:.5g}",
                    f"{value:.5g}",
                    f"{problem.spread[i] * deviations[i]:.2g}",
                    f"{fitted.vector[i]:+.2f}",
                )
            )
        header = ("parameter", "nominal", "estimate", "one-sigma", "moved [stated sigma]")
        section.table("Re-estimated within their stated uncertainty, together with the effects", header, rows)
        covariance = fitted.covariance
        scale = np.sqrt(np.diag(covariance))
        correlation = covariance / np.outer(scale, scale)
        labels = [
            *problem.structure.parameters,
            *(f"{p.effect.name}: {q.name}" for p in fitted.hypothesis for q in p.effect.parameters),
        ]
        strong = [
            (labels[i], labels[j], f"{correlation[i, j]:+.2f}")
            for i in range(len(labels))
            for j in range(i)
            if abs(correlation[i, j]) > 0.7
        ]
        if strong:
            section.table("Correlations above 0.7", ("parameter", "with", "correlation"), strong)


def _application_section(out: Page, diagnosis: Diagnosis) -> None:
    laws = [effect for effect in diagnosis.verdict.named if effect.law]
    if not laws:
        return
    section = out.section("Back into the model")
    section.text("The effect as an element of the bench; put the name of your own joint in place of JOINT.")
    for effect in laws:
        section.code(element_code(effect.law, effect.theta))


def element_code(law: str, theta: tuple[float, ...]) -> str:
    """Python code that makes the element of a found effect."""
    numbers = ", ".join(f"{value:.6g}" for value in theta)
    return f'Element(law=LAWS["{law}"], joints=("JOINT",), theta=LAWS["{law}"].theta([{numbers}]))'
