"""The first screen of a report: the answers, one picture of the judging record before and after, and what to do next."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.discrepancy.prediction.validation_discrepancy import DIVERGED_GAP
from bench.discrepancy.report.answers import Files, answers, next_steps
from bench.discrepancy.report.interactive import histories, ranking_plot
from bench.discrepancy.report.simulated_records import APPLIED
from bench.discrepancy.settings import JudgementSettings
from bench.discrepancy.verdict import Gap, InSimulator, NamedEffect, Verdict
from bench.page import Page, Section
from bench.recording import Recording


@dataclass(frozen=True)
class OpeningSettings:
    """Numbers of `bench.discrepancy.report.opening`."""

    cycles: int = 4
    """Cycles that a picture shows at first: with more of them, before and after would be one line on a telephone."""
    seen: float = 0.1
    """Part of the motion from which an error shows beside it; a smaller one is as wide as the lines, and is drawn itself."""


SETTINGS = OpeningSettings()


def opened(
    name: str,
    verdict: Verdict,
    runs: Mapping[str, Recording],
    *,
    files: Files,
    settings: JudgementSettings,
    applied: InSimulator | None,
) -> Page:
    """A page with its first screen.

    Args:
        name: Of the case.
        verdict: The verdict.
        runs: The first judging record by judged coordinate: measured, before, after, and applied.
        files: What the commands that come next name.
        settings: Those that it was judged with.
        applied: What came of it in the user's simulator.
    """
    page = Page(f"Diagnosis of {name}", footer=f"{verdict.seconds:.1f} s of computation")
    section = page.section("")
    section.facts(answers(verdict, settings=settings))
    dof = _shown(verdict.gap, next(iter(runs.values())))
    errors = verdict.gap.before < SETTINGS.seen
    what = f"what every simulation misses {dof} by" if errors else dof
    section.plots(
        [histories(runs, [dof], window=window(runs, dof), errors=errors)],
        f"Judging record, {what}, where the nominal model misses it most; no fit has seen it. Drag to zoom; a double click shows all.",
    )
    for step in next_steps(verdict, files):
        section.text(step.text)
        if step.command:
            section.code(step.command)
    if applied is not None:
        section.text(f"{applied.line[0].upper()}{applied.line[1:]}.")
    words = page.section("In words")
    words.text(verdict.explanation)
    for warning in verdict.warnings:
        words.text(f"Note: {warning}.")
    _parameters(words, verdict)
    return page


def _parameters(section: Section, verdict: Verdict) -> None:
    """What is named or nearest with its parameters: laws of one name in a table."""
    laws: dict[str, list[NamedEffect]] = {}
    for effect in (*verdict.named, *verdict.nearest):
        laws.setdefault(effect.name, []).append(effect)
    for name, effects in laws.items():
        place = f" ({effects[0].where})" if len(effects) == 1 and effects[0].where else ""
        section.table(
            f"{'' if verdict.named else 'Nearest: '}{name}{place}: {effects[0].equation}",
            (*(("where",) if len(effects) > 1 else ()), "parameter", "value", "one-sigma", "95 % interval", "unit"),
            [
                (
                    *((effect.where,) if len(effects) > 1 else ()), key, f"{e.value:.4g}", f"{e.std:.2g}",
                    f"{e.value - 1.96 * e.std:.4g} to {e.value + 1.96 * e.std:.4g}", e.unit,
                )
                for effect in effects
                for key, e in effect.parameters.items()
            ],
        )  # fmt: skip


def add_ranking(section: Section, verdict: Verdict) -> None:
    """Add the effects by posterior probability."""
    figure, hidden = ranking_plot(verdict.ranking)
    shared = (
        " Those that cannot be told apart share the probability of what is named."
        if verdict.indistinguishable
        else ""
    )
    rest = f" {hidden} more have less than 0.001." if hidden else ""
    section.plots([figure], f"Effects by posterior probability, each alone.{shared}{rest}")


def _shown(gap: Gap, measured: Recording) -> str:
    return gap.dof if gap.dof in measured.names else measured.names[0]


def with_applied(runs: Mapping[str, Recording], applied: InSimulator | None) -> dict[str, Recording]:
    """Runs with that of the user's own simulator, where it is on the same clock, from its beginning or later on, and did not diverge."""
    measured = next(iter(runs.values()))
    n = len(measured.time)
    own = {} if applied is None else {name or measured.names[0]: y for name, y in applied.record.items()}
    shown = {
        name: values[-n:]
        for name, values in own.items()
        if name in measured.names
        and len(values) >= n
        and np.max(np.abs(values)) < DIVERGED_GAP * max(float(np.max(np.abs(measured[name]))), 1e-300)
    }
    if not shown:
        return dict(runs)
    units = {name: measured.channel(name).unit for name in shown}
    return {**runs, APPLIED: Recording.from_arrays(measured.time, shown, units=units)}


def window(runs: Mapping[str, Recording], channel: str) -> tuple[float, float]:
    """First and last time [s] of some cycles around the largest error of the first simulation.

    Args:
        runs: The measured record first.
        channel: Channel that errors and cycles are those of.
    """
    measured, *simulated = runs.values()
    y = measured[channel] - np.mean(measured[channel])
    error = simulated[0][channel] - measured[channel] if simulated else y
    crossings = max(int(np.count_nonzero(np.diff(np.signbit(y)))), 1)
    first, last = float(measured.time[0]), float(measured.time[-1])
    width = min((last - first) * 2.0 * SETTINGS.cycles / crossings, last - first)
    middle = float(measured.time[int(np.argmax(np.abs(error)))])
    start = float(np.clip(middle - 0.5 * width, first, last - width))
    return start, start + width


def add_next_test(out: Page, proposal: Mapping[str, Any]) -> None:
    """Tell the test that would separate what the records leave open, or why none is known; nothing where they decide.

    Args:
        out: The page.
        proposal: `next_excitation` of a verdict.
    """
    if not proposal:
        return
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
