"""Scoring of cases whose truth holds small things besides the effect that was withheld: a background that no model has.

An answer holds "class" ("main": one effect and a background; "unstated": one effect and no stated noise; "background": only that;
"clean": nothing, no stated noise), "effects" with their parameters, and whether the noise is stated. What counts as right:

- main, unstated: the effect is named, or a set is declared that holds it; it closes the largest share; one other name at most.
- background, clean: nothing is named with certainty that does not shrink the discrepancy of the judging record.
- all: what is named shrinks that discrepancy, and no nominal parameter lies beyond four of its stated standard deviations unsaid.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bench.discrepancy.blind.proportions import Share, calibration_error, reliability, share_of

CERTAIN = 0.9
"""Probability from which a name is certain."""
PAYS = 0.8
"""Part of the judged discrepancy before that a name may leave."""
FAR = 4.0
"""Stated standard deviations beyond which a nominal parameter has to be named."""
INTERVAL = 1.96
"""Standard deviations of a 95 % interval."""


@dataclass(frozen=True)
class BackgroundScore:
    """Score of cases with a background.

    Attributes:
        shares: What is scored to its share.
        calibration: Expected calibration error of the names' probabilities; a name within a set that holds the truth counts as right.
        reliability: Stated probability, share right and number of each bin.
        wrong: Names of the cases that are not right, and what was said.
    """

    shares: Mapping[str, Share]
    calibration: float
    reliability: tuple[tuple[float, float, int], ...]
    wrong: tuple[str, ...] = field(repr=False)


def score_backgrounds(results: Path, answers: Path) -> BackgroundScore:
    """Score the verdicts of a folder against its answers.

    Args:
        results: One verdict a case, by the case's name.
        answers: One answer a case, by the same name.
    """
    hits: dict[str, list[bool]] = {}
    stated: list[tuple[float, bool]] = []
    wrong = []
    for path in sorted(answers.glob("*.json")):
        verdict = results / path.name
        if not verdict.exists():
            continue
        answer, result = (json.loads(p.read_text()) for p in (path, verdict))
        own = dict(_scored(answer, result))
        for what, hit in own.items():
            hits.setdefault(what, []).append(hit)
        stated += list(_stated(answer, result))
        if not all(own.values()):
            said = [effect["name"] for effect in result["named"]]
            missed = ", ".join(what for what, hit in own.items() if not hit)
            wrong.append(
                f"{path.stem}: {[e['name'] for e in answer['effects']]} -> {result['verdict']} {said}; not: {missed}"
            )
    return BackgroundScore(
        {what: share_of(flags) for what, flags in hits.items()},
        calibration_error(stated),
        tuple(reliability(stated)),
        tuple(wrong),
    )


def _scored(answer: Mapping[str, Any], result: Mapping[str, Any]) -> Iterable[tuple[str, bool]]:
    named, gap = result["named"], result["gap"]
    said = [effect["name"] for effect in named]
    pays = gap["after"] is not None and gap["after"] < PAYS * gap["before"]
    if answer["effects"]:
        true = answer["effects"][0]["name"]
        hit = _within_a_set(true, said, result)
        first = named[0]["name"] if named else ""
        yield "main effect named or in a declared set", hit
        yield "and first", hit and (first == true or any(true in s for s in _sets(result)))
        yield "not none", result["verdict"] != "none"
        yield "one other name at most", len([name for name in said if name != true]) <= 1
        covered = _covered(answer["effects"][0], named)
        if covered is not None:
            yield "95 % intervals of the main effect's parameters hold the truth", covered
    else:
        sure = [effect for effect in named if effect["probability"] >= CERTAIN]
        allowed = answer["class"] == "background" and pays
        yield (
            f"{answer['class']}: no certain name that does not pay on the judging record",
            not sure or allowed,
        )
    if said:
        yield "names shrink the judged discrepancy", pays
    far = [p for p in result.get("nominal", []) if abs(p["shift_in_std"]) > FAR]
    yield "no nominal parameter beyond 4 stated sigma unsaid", not far


def _sets(result: Mapping[str, Any]) -> list[list[str]]:
    return result.get("indistinguishable", [])


def _within_a_set(true: str, said: list[str], result: Mapping[str, Any]) -> bool:
    return true in said or any(true in s and set(s) & set(said) for s in _sets(result))


def _stated(answer: Mapping[str, Any], result: Mapping[str, Any]) -> Iterable[tuple[float, bool]]:
    """Probability of every name, and whether it is right."""
    true = {effect["name"] for effect in answer["effects"]}
    for effect in result["named"]:
        yield effect["probability"], effect["name"] in true


def _covered(truth: Mapping[str, Any], named: list[Mapping[str, Any]]) -> bool | None:
    """Whether the interval of the first parameter of the true effect holds it; None where it was not named as such."""
    own = next((effect for effect in named if effect["name"] == truth["name"]), None)
    if own is None or not own["parameters"] or not truth["parameters"]:
        return None
    estimate = next(iter(own["parameters"].values()))
    return abs(estimate["value"] - truth["parameters"][0]) <= INTERVAL * estimate["std"]
