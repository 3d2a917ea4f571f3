"""The verdict in short answers: where, which, how far, how sure, how complete, and what to do next.

Page and console say the same words with the same numbers.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from shlex import quote
from typing import NamedTuple

from bench.discrepancy.case.case import Case
from bench.discrepancy.judgement.shares import closed_words, interval, probability
from bench.discrepancy.prediction.validation_discrepancy import DIVERGED_GAP
from bench.discrepancy.settings import DEFAULT, JudgementSettings
from bench.discrepancy.verdict import Location, NamedEffect, Verdict, by_name


@dataclass(frozen=True)
class AnswersSettings:
    """Numbers of `bench.discrepancy.report.answers`."""

    worth_naming: float = 0.1
    """Share of the excess from which a place is named beside the first, where no effect says where it is."""
    places: int = 3
    """Most places that are named."""
    effects: int = 3
    """Effects that are told with their numbers, those that close most; of a robot with many the others are told by name."""


SETTINGS = AnswersSettings()


class AnsweredQuestion(NamedTuple):
    """A question, and its answer in a line."""

    question: str
    answer: str


def answers(
    verdict: Verdict, *, settings: JudgementSettings = DEFAULT.judgement
) -> tuple[AnsweredQuestion, ...]:
    """Answer the five questions of a diagnosis.

    Args:
        verdict: The verdict.
        settings: Those that it was judged with.
    """
    return (
        AnsweredQuestion("Where", _where(verdict)),
        AnsweredQuestion("Which", _which(verdict)),
        AnsweredQuestion("How far", _how_far(verdict, settings)),
        AnsweredQuestion("How sure", _how_sure(verdict)),
        AnsweredQuestion("How complete", _how_complete(verdict)),
    )


def level(value: float) -> str:
    """A discrepancy (NRMSE) as it is written everywhere."""
    return "diverges" if value >= DIVERGED_GAP else f"{value:.3g}"


def estimates(effect: NamedEffect) -> str:
    """The parameters of an effect with their standard deviations and units."""
    return ", ".join(
        f"{name} {e.value:.4g} ± {e.std:.2g}{'' if e.unit in ('', '1') else ' ' + e.unit}"
        for name, e in effect.parameters.items()
    )


def _places(effect: NamedEffect) -> str:
    return ", ".join(_distinct((effect.where, effect.channel)))


def _called(effect: NamedEffect, verdict: Verdict) -> str:
    """Name of an effect, with its place where another of the same name is named."""
    alike = [e for e in verdict.named if e.name == effect.name]
    return f"{effect.name} ({effect.where})" if len(alike) > 1 and effect.where else effect.name


def _distinct(texts: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(text for text in texts if text))


def _where(verdict: Verdict) -> str:
    gathered = [p for p in verdict.locations if p.kind != "simulator"]
    places = _distinct(_places(effect) for effect in verdict.named)
    if not places and verdict.verdict == "none":
        if verdict.complete:
            return "nowhere: noise explains the residuals once the parameters are re-estimated"
        return "nowhere that an effect of the catalogue would close once the parameters are re-estimated"
    if not places:
        main = [p for i, p in enumerate(gathered) if i == 0 or p.share >= SETTINGS.worth_naming]
        places = [_place(p) for p in main[: SETTINGS.places]]
    own = next((p for p in verdict.locations if p.kind == "simulator"), None)
    if own is not None:
        places.append(f"the simulator itself ({100.0 * own.share:.0f} % of the discrepancy)")
    return "; ".join(places) or "the model as a whole"


def _place(location: Location) -> str:
    names = ", ".join(_distinct((location.dof, location.channel)))
    low, high = location.band_hz
    return f"{names} ({100.0 * location.share:.0f} %, {low:.3g} to {high:.3g} Hz)"


def _which(verdict: Verdict) -> str:
    if verdict.named:
        first, others = verdict.named[: SETTINGS.effects], verdict.named[SETTINGS.effects :]
        told = [(_called(e, verdict), e) for e in first]
        parts = [f"{name}: {estimates(e)}" if e.parameters else name for name, e in told]
        own = "; ".join((*parts, *([f"and of less weight {by_name(others)}"] if others else [])))
    elif verdict.verdict == "none":
        own = "no effect is missing" if verdict.complete else "no effect of the catalogue"
    else:
        nearest = "; ".join(f"{e.name} ({_places(e)})" if _places(e) else e.name for e in verdict.nearest)
        own = f"none of the catalogue; nearest: {nearest}" if nearest else "none of the catalogue"
    return "; ".join(
        (own, *(f"cannot be told apart: {', '.join(group)}" for group in verdict.indistinguishable))
    )


def _how_far(verdict: Verdict, settings: JudgementSettings) -> str:
    gap = verdict.gap
    place = f" of {gap.dof}" if gap.dof else ""
    runs = ""
    if gap.free_runs:
        before, after, _ = gap.free_runs
        place, runs = f" of the torque of {gap.dof}", f"; free runs {level(before)} → {level(after)}"
    return (
        f"{level(gap.before)} → {level(gap.after)} (NRMSE{place}; noise alone {level(gap.noise_floor)}); "
        f"closed: {closed_words(gap, settings=settings)}{runs}"
    )


def _how_sure(verdict: Verdict) -> str:
    own = f"probability of “{verdict.verdict}” {probability(verdict.probabilities.get(verdict.verdict))}"
    first, others = verdict.named[: SETTINGS.effects], verdict.named[SETTINGS.effects :]
    parts = [
        f"{_called(e, verdict)} {probability(e.probability)}, without it {interval(e.closed, e.closed_ci95)} comes back"
        for e in first
    ]
    if others:
        odds = sorted(e.probability for e in others)
        most = max(e.closed for e in others)
        parts.append(
            f"the {len(others)} others {probability(odds[0])} to {probability(odds[-1])}, up to {100.0 * most:.2g} % each"
        )
    return "; ".join((own, *parts))


def _how_complete(verdict: Verdict) -> str:
    if verdict.complete:
        return "complete: nothing but noise is left"
    return f"not complete. {verdict.left}" if verdict.left else "not complete"


class NextStep(NamedTuple):
    """Something to do next, in words, with a command where there is one."""

    text: str
    command: str = ""


class Files(NamedTuple):
    """What the commands that come next name.

    Attributes:
        model: Options of `jointbench apply` that name the user's own MJCF; empty where the rig is one of the bench.
        verdict: File of the verdict; empty where none was written.
        draft: Command that writes the case folder where there is none yet, which `model` names; empty where there is one.
    """

    model: str = ""
    verdict: str = ""
    draft: str = ""

    @classmethod
    def of(cls, case: Case, verdict: str = "") -> Files:
        """The case's own folder and model."""
        folder = Path(case.folder or ".")
        options = f"--model {quote(str(folder / case.rig))} --case {quote(str(folder))}"
        return cls(options if case.rig.endswith(".xml") else "", verdict)


def next_steps(verdict: Verdict, files: Files) -> tuple[NextStep, ...]:
    """What to do next, the most useful first.

    Args:
        verdict: The verdict.
        files: What the commands name.
    """
    steps = []
    file = quote(files.verdict or "verdict.json")
    unwritten = "" if files.verdict else f" (--json {file} writes the verdict)"
    if verdict.named or verdict.nearest:
        nearest = "" if verdict.named else " --nearest"
        text = "Put it into your model" if verdict.named else "Put what comes nearest into your model"
        if files.draft:
            steps.append(NextStep("Keep the case, whose records run in your model:", files.draft))
        if files.model:
            command = f"jointbench apply {file} {files.model} -o corrected.xml{nearest}"
            steps.append(NextStep(f"{text} and run the judging records there{unwritten}:", command))
        elif verdict.named:
            steps.append(NextStep("Put it into your model; the end of the report (--html) writes how."))
    if any(p.kind == "simulator" for p in verdict.locations):
        steps.append(NextStep("Simulate with a smaller step, RK4 or a harder solreffriction."))
    proposal = verdict.next_excitation
    if proposal.get("separates") and proposal.get("excitation"):
        steps.append(
            NextStep(
                f"Measure again, to separate {' from '.join(proposal['separates'])}: {proposal['excitation']}, peak load "
                f"{proposal['peak_load']:.3g}, {proposal['duration_s']:.3g} s; power {100.0 * proposal['power']:.0f} %."
            )
        )
        if proposal.get("closed_loop"):
            command = f"jointbench excite {file} --method planner -o next.csv"
            steps.append(
                NextStep(
                    f"Or have a planner shape the force while it measures, which decides sooner{unwritten}:",
                    command,
                )
            )
    elif proposal.get("reason"):
        steps.append(NextStep(str(proposal["reason"])))
    if verdict.verdict == "none" and verdict.gap.before > verdict.gap.parameters_only:
        steps.append(NextStep("Take the re-estimated parameters over."))
    return tuple(steps)
