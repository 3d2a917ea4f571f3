"""The diagnosis as a page: one self-contained HTML file with the verdict, the pictures behind it, and the way back.

The page answers in the order of the questions: what is missing, how far the gap shrinks, where it lies, how sure that is,
what to measure next, and how to put the effect into one's own model.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bench.discrepancy.articulated.diagnosis import ArticulatedDiagnosis
from bench.discrepancy.diagnosis import Diagnosis
from bench.discrepancy.judgement.shares import closed_words, percent, probability
from bench.discrepancy.judgement.validation_discrepancy import coordinates
from bench.discrepancy.localisation.localise import box
from bench.discrepancy.localisation.state_map import StateMap
from bench.discrepancy.report.articulated import articulated_page
from bench.discrepancy.report.model_update import recipes
from bench.discrepancy.report.simulated_records import MEASURED, NOMINAL, variants
from bench.discrepancy.verdict import Split
from bench.page import Page, Section
from bench.recording import Recording

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class HtmlPageSettings:
    """Numbers of `bench.discrepancy.report.html_page`."""

    cycles_shown: int = 12
    """Cycles around the largest response that the overlays show."""
    worth_showing: float = 0.02
    """Share of the excess below which a channel's own bands and times are not drawn."""


SETTINGS = HtmlPageSettings()


def simulated(diagnosis: Diagnosis) -> dict[str, Recording]:
    """Measured, nominal and final responses of the first judging record, see `variants`."""
    return variants(diagnosis)


def page(diagnosis: Diagnosis | ArticulatedDiagnosis) -> Page:
    """Build the report of a diagnosis."""
    if isinstance(diagnosis, ArticulatedDiagnosis):
        return articulated_page(diagnosis)
    verdict = diagnosis.verdict
    out = Page(
        f"Diagnosis of {diagnosis.case.name}", verdict.explanation, f"{verdict.seconds:.1f} s of computation"
    )
    runs = variants(diagnosis)
    _verdict_section(out, diagnosis)
    _gap_section(out, diagnosis, runs)
    _location_section(out, diagnosis, runs)
    if verdict.ranking:
        _ranking_section(out, diagnosis)
    _parameter_section(out, diagnosis)
    if verdict.next_excitation:
        _next_section(out, verdict.next_excitation)
    _application_section(out, diagnosis)
    return out


def write_report(diagnosis: Diagnosis | ArticulatedDiagnosis, path: str | Path) -> None:
    """Write the report of a diagnosis as one HTML file."""
    page(diagnosis).write(path)


def _draw(section: Section, make: Callable[[], Figure], caption: str) -> None:
    """Add a picture; one that cannot be drawn (all numbers NaN, nothing in range) is a sentence instead of the end of the page."""
    try:
        section.figure(make(), caption)
    except Exception as error:  # whatever matplotlib makes of numbers that are not finite, the verdict is worth more than a picture
        section.text(f"Not drawn ({error or type(error).__name__}): {caption}")


def _verdict_section(out: Page, diagnosis: Diagnosis) -> None:
    verdict = diagnosis.verdict
    section = out.section("Verdict")
    section.table(
        "Probabilities",
        ("verdict", "probability"),
        [(k, probability(p)) for k, p in verdict.probabilities.items()],
    )
    for effect in (*verdict.named, *verdict.nearest):
        where = f" ({effect.where})" if effect.where else ""
        rows = [
            (
                name, f"{e.value:.5g}", f"{e.std:.2g}",
                f"{e.value - 1.96 * e.std:.5g} to {e.value + 1.96 * e.std:.5g}", e.unit,
            )
            for name, e in effect.parameters.items()
        ]  # fmt: skip
        section.table(
            f"{'' if verdict.named else 'Nearest: '}{effect.name}{where}, probability {probability(effect.probability)}, closes "
            f"{percent(effect.closed)} of what is missing without it: {effect.equation}",
            ("parameter", "value", "one-sigma", "95 % interval", "unit"),
            rows,
        )
    for group in verdict.indistinguishable:
        section.text(f"These records cannot tell apart: {', '.join(group)}.")
    if verdict.left:
        section.text(verdict.left)
    for warning in verdict.warnings:
        section.text(f"Note: {warning}.")


def _window(diagnosis: Diagnosis, reference: Recording) -> tuple[float, float]:
    """Some cycles around the largest response."""
    channels = [name for _, names in coordinates(diagnosis.problem.structure) for name, _ in names]
    y = reference[channels[0]] - np.mean(reference[channels[0]])
    crossings = max(int(np.count_nonzero(np.diff(np.signbit(y)))), 1)
    first, last = float(reference.time[0]), float(reference.time[-1])
    width = min((last - first) * 2.0 * SETTINGS.cycles_shown / crossings, last - first)
    middle = float(reference.time[int(np.argmax(np.abs(y)))])
    start = float(np.clip(middle - 0.5 * width, first, last - width))
    return start, start + width


def _gap_section(out: Page, diagnosis: Diagnosis, runs: Mapping[str, Recording]) -> None:
    from bench.figures import error_histories, time_histories, waterfall  # noqa: PLC0415  (matplotlib)

    section = out.section("How far the gap shrinks")
    for gap in diagnosis.verdict.gaps:
        closed = closed_words(gap, settings=diagnosis.problem.settings.judgement)
        section.table(
            f"{gap.metric}{' (' + gap.dof + ')' if gap.dof else ''}; closed, with its 95 % interval: {closed}",
            ("stage", "NRMSE", "closed"),
            [
                *(
                    (
                        label,
                        f"{value:.4f}",
                        ""
                        if i == 0
                        else closed_words(gap, value, settings=diagnosis.problem.settings.judgement),
                    )
                    for i, (label, value) in enumerate(gap.steps)
                ),
                ("noise floor", f"{gap.noise_floor:.4f}", ""),
            ],
        )
    gap = diagnosis.verdict.gap
    values = [value for _, value in gap.steps]
    if np.all(np.isfinite(values)):
        labels = [label.replace(" + ", "\n+ ") for label, _ in gap.steps[1:]]
        _draw(
            section,
            lambda: waterfall(labels, values, floor=gap.noise_floor, axis="NRMSE [1]"),
            "The gap after each step, and the floor that the noise sets.",
        )
    channels = [name for _, names in coordinates(diagnosis.problem.structure) for name, _ in names]
    window = _window(diagnosis, runs[MEASURED])
    before = {label: run for label, run in runs.items() if label in {MEASURED, NOMINAL}}
    after = {label: run for label, run in runs.items() if label != NOMINAL}
    for shown, caption in (
        (before, "Judging record, before: measured and nominal model, around the largest response."),
        (after, "The same after: measured and final model."),
    ):
        if len(shown) > 1:
            _draw(section, partial(time_histories, shown, channels, window=window), caption)
    if len(runs) > 1:
        _draw(
            section,
            lambda: error_histories(runs, channels),
            "What is left: simulated less measured, over the whole record.",
        )
    if NOMINAL not in runs:
        section.text("The nominal model diverges on the judging record; it is not drawn.")


def _location_section(out: Page, diagnosis: Diagnosis, runs: Mapping[str, Recording]) -> None:
    section = out.section("Where the gap lies")
    where, verdict = diagnosis.where, diagnosis.verdict
    rows = []
    for location in verdict.locations:
        band = f"{location.band_hz[0]:.3g} to {location.band_hz[1]:.3g}"
        span = f"{location.time_s[0]:.3g} to {location.time_s[1]:.3g}"
        share = f"{100 * location.share:.1f} %"
        rows.append(
            (location.channel, location.dof, share, band, span, location.kind, f"{location.p_value:.1g}")
        )
    if rows:
        header = ("channel", "degree of freedom", "share", "band [Hz]", "time [s]", "cause in", "p-value")
        section.table("Residuals of the nominal model's free run, parameters re-estimated", header, rows)
    for found in where.contradictions:
        section.text(_contradiction_text(found))
    for found in where.maps:
        _map(section, found, runs, verdict.splits, found.place.name or diagnosis.problem.structure.dofs[0])
        for region in where.acting.get(found.place.name, ()):
            fitted = "As named" if verdict.verdict == "effect" else "As the closure has it"
            actor = f"{fitted}, {region['effect']}" if "effect" in region else "By free runs, what is missing"
            section.text(
                f"{actor} acts at {_limits(region, found.place.position_unit)}: {region['force']:+.3g} "
                f"{found.place.force_unit} on average, {100 * region['share']:.0f} % of its square."
            )
    main = {location.channel for location in verdict.locations if location.share > SETTINGS.worth_showing}
    residual = [s for s in verdict.splits if s.kind in {"band_hz", "time_s"} and s.of in main]
    if residual:
        from bench.discrepancy.report.figures import shares  # noqa: PLC0415  (matplotlib)

        _draw(
            section,
            lambda: shares(residual),
            "Excess power of the free run's residuals by frequency and by time; filled parts are significant, false discoveries "
            "held at 5 %.",
        )


def _contradiction_text(found) -> str:
    low, high = found.channels
    if not found.found:
        return (
            f"{low} and {high} agree with each other (power of their contradiction {found.ratio:.2f} times the noise's): "
            "a force is missing rather than a sensor at fault, as far as they can tell."
        )
    blame = f" The nominal model contradicts {found.suspect}." if found.suspect else ""
    return (
        f"{low} and {high} contradict each other whatever force acts (power {found.ratio:.3g} times the noise's over windows of "
        f"{found.window_s:.2g} s, p = {found.p_value:.1g}): a sensor or its clock is at fault.{blame}"
    )


def _map(
    section: Section, found: StateMap, runs: Mapping[str, Recording], splits: Sequence[Split], name: str
) -> None:
    from bench.discrepancy.report.figures import force_loops, shares, state_figure  # noqa: PLC0415  (matplotlib)

    place = found.place
    title = f" ({place.name})" if place.name else ""
    section.text(f"Missing force{title}: {region_words(found)}")
    _draw(
        section,
        lambda: state_figure(found),
        f"Force that the nominal model lacks along the measured motion{title}. Outlined cells differ from zero significantly; "
        "grey: never visited twice.",
    )
    _draw(
        section,
        lambda: force_loops(runs, place.name),
        f"The same force on the judging record{title}, beside that of the simulations, all through the same estimator.",
    )
    own = [s for s in splits if s.of == "missing force" and s.dof == name]
    if own:
        _draw(
            section,
            lambda: shares(own, units=(place.position_unit, place.force_unit)),
            f"Shares of the squared missing force{title}; filled parts are significant.",
        )


def region_words(found: StateMap) -> str:
    """The regions of a map in words."""
    unit = found.place.position_unit
    if not found.regions:
        return "no region of the state space stands out."
    parts = []
    for region in found.regions[:4]:
        parts.append(
            f"{_limits(box(region), unit)}: {region.force:+.3g} {found.place.force_unit} on average, "
            f"{100 * region.share:.0f} % of its square"
        )
    return "; ".join(parts) + "."


def _limits(region: Mapping[str, Any], unit: str) -> str:
    """The limits of a region in words."""
    units = {"displacement": unit, "velocity": f"{unit}/s"}
    limits = [
        f"{name} {region[name][0]:.3g} to {region[name][1]:.3g} {units[name]}"
        for name in units
        if name in region
    ]
    return " and ".join(limits) or "all states"


def _ranking_section(out: Page, diagnosis: Diagnosis) -> None:
    from bench.discrepancy.report.figures import ranking_bars  # noqa: PLC0415  (matplotlib)

    verdict = diagnosis.verdict
    section = out.section("Which effect")
    _draw(section, lambda: ranking_bars(verdict.ranking), "Effects by posterior probability.")
    rows = [
        (
            " + ".join(f"{p.effect.name}{f' ({p.place.name})' if p.place.name else ''}" for p in e.hypothesis)
            or "nothing",
            f"{e.log_posterior - diagnosis.explanations[0].log_posterior:.1f}",
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
    from bench.discrepancy.report.figures import correlation_map  # noqa: PLC0415  (matplotlib)

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
        _draw(
            section,
            partial(correlation_map, [labels[i] for i in free], correlation),
            "Correlations of the estimates; a pair near one in magnitude is known as a combination only.",
        )


def _next_section(out: Page, proposal: Mapping) -> None:
    section = out.section(
        "The next test" if proposal.get("excitation") else "What these records could have shown"
    )
    if proposal.get("reason"):
        section.text(str(proposal["reason"]))
    if not proposal.get("excitation"):
        return
    first, second = proposal["separates"]
    section.text(
        f"To tell {first} from {second}: {proposal['excitation']}, for {proposal['duration_s']:.3g} s. It is expected to bring "
        f"log odds of {proposal['expected_log_odds']:.3g}; with a probability of {100 * proposal['power']:.0f} % the true one of "
        f"the two is then known with 99 %. The present records give {proposal['log_odds_now']:.3g}."
    )
    rows = [(name, f"{value:.4g}") for name, value in proposal["peak_loads"].items()]
    rows += [(name, f"{value:.4g}") for name, value in proposal["largest_response"].items()]
    section.table("Largest values, within what the records show the rig to do", ("channel", "peak"), rows)
    repeating = proposal.get("repeating")
    if repeating:
        section.text(
            f"Repeating the longest present record instead: expected log odds {repeating['expected_log_odds']:.3g}, "
            f"probability of a decision {100 * repeating['power']:.0f} %."
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
