"""Scoring of cases whose truth holds small things besides the effect that was withheld: a background that no model has.

A case is "main" (one effect and a background), "unstated" (one effect and no stated noise), "background" (only that) or "clean"
(nothing, no stated noise), by its class or by the background that its answer tells; "foreign beside" where the effect stands outside
the catalogue. What counts as right:

- main, unstated: the effect is named, or a set is declared that holds it; it closes the largest share; one other name at most, and one
  false name, for what the background holds is a right name; and where there is a background whose noise is stated, what is named is not
  said to be complete.
- foreign beside: unknown, or what is named is said not to be complete, or is it (`BY_ANOTHER_NAME`); nothing is named with certainty
  that does not shrink the discrepancy of the judging record.
- background, clean: the same of certain names.
- all: what is named shrinks that discrepancy, no name of several makes it larger, every number is finite, and no nominal parameter lies
  beyond four of its stated standard deviations unsaid.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bench.discrepancy.blind.proportions import (
    Share,
    calibration_error,
    calibration_interval,
    calibration_scatter,
    reliability,
    share_of,
)
from bench.laws.registry import find_law

CLASSES = ("main", "unstated", "background", "clean", "foreign beside")
BY_ANOTHER_NAME = {
    "hidden_resonator": ("base_flexibility", "carried_mass", "mass_error"),
    "hum": ("displacement_hum", "velocity_hum", "acceleration_hum", "force_hum"),
}
"""Things of a background, or withheld, that are effects of the catalogue: hum in readings, and what is one by derivation, beside nominal
parameters.

A resonator is a carried mass, which is part of the stated one, beside a mass that is larger by as much. It is another effect, too.
A resonator of mass m on k and c pulls with ``f = k (q - y) + c (v - y')``, ``m y'' = f``. Of a base flexibility
``-kappa (w + tau w')``, ``w'' + 2 zeta omega w' + omega^2 w = omega^2 (q + tau v)``; with ``omega^2 = k/m``, ``tau = c/k`` and
``2 zeta = omega tau`` both states obey one equation, so ``w = y`` and ``f = k q + c v + (the base's force, kappa = k)``: a
resonator is a base flexibility beside a stiffness k and a damping c more. The catalogue takes ``tau`` from the nominal joint, by which
the phase of the resonance, of damping zeta, is off by less than 4 zeta.

Nothing else of a background is here. A stiffness that swings as ``sin(2 pi f t + phase)`` is no ramp: of a third of a period a ramp and a
constant hold 98 % of its power, of a whole one 61 % to none by its phase, and no answer tells which. Friction that comes and goes along
the stroke is no constant one, which holds two thirds of its power. Both stand outside the catalogue where they are withheld, and such
names count as wrong there."""


@dataclass(frozen=True)
class BackgroundScoreSettings:
    """Numbers of `bench.discrepancy.blind.background_score`."""

    certain: float = 0.9
    """Probability from which a name is certain."""
    pays: float = 0.8
    """Part of the judged discrepancy before that a name may leave."""
    far: float = 4.0
    """Stated standard deviations beyond which a nominal parameter has to be named."""
    interval: float = 1.96
    """Standard deviations of a 95 % interval."""


SETTINGS = BackgroundScoreSettings()


@dataclass(frozen=True)
class BackgroundScore:
    """Score of cases with a background.

    Attributes:
        shares: What is scored to its share.
        calibration: Expected calibration error of the names' probabilities; a name is right if it is that of the withheld effect, or
            of something in the background (`BY_ANOTHER_NAME`).
        interval: Its 95 % interval over a bootstrap of the names.
        scatter: What it would be on average if every probability were exact: so many names scatter by it.
        reliability: Stated probability, share right and number of each bin.
        wrong: Names of the cases that are not right, and what was said.
    """

    shares: Mapping[str, Share]
    calibration: float
    interval: tuple[float, float]
    scatter: float
    reliability: tuple[tuple[float, float, int], ...]
    wrong: tuple[str, ...] = field(repr=False)


def background_class(answer: Mapping[str, Any]) -> str:
    """Class of a case among those with a background, by its answer; empty where it is none of them."""
    own = str(answer["class"])
    if own in CLASSES:
        return own
    if answer.get("background") is None:
        return ""
    if own == "foreign":
        return "foreign beside"
    if answer["background"]:
        return "main" if answer["effects"] else "background"
    return "unstated" if answer["effects"] else "clean"


def score_backgrounds(results: Path, answers: Path) -> BackgroundScore:
    """Score the verdicts of a folder against its answers.

    Args:
        results: One verdict a case, by the case's name.
        answers: One answer a case, by the same name.
    """
    pairs = [
        (path.stem, json.loads(path.read_text()), json.loads((results / path.name).read_text()))
        for path in sorted(answers.glob("*.json"))
        if (results / path.name).exists()
    ]
    return background_summary(pairs)


def background_summary(cases: Iterable[tuple[str, Mapping[str, Any], Mapping[str, Any]]]) -> BackgroundScore:
    """Sum up cases with a background.

    Args:
        cases: Name, answer and result of each.
    """
    hits: dict[str, list[bool]] = {}
    stated: list[tuple[float, bool]] = []
    wrong = []
    for name, answer, result in cases:
        own = dict(background_scored(answer, result))
        for what, hit in own.items():
            hits.setdefault(what, []).append(hit)
        stated += list(_stated(answer, result))
        if not all(own.values()):
            said = [effect["name"] for effect in result["named"]]
            missed = ", ".join(what for what, hit in own.items() if not hit)
            truth = [effect["name"] for effect in answer["effects"]]
            wrong.append(f"{name}: {truth} -> {result['verdict']} {said}; not: {missed}")
    return BackgroundScore(
        {what: share_of(flags) for what, flags in hits.items()},
        calibration_error(stated),
        calibration_interval(stated),
        calibration_scatter([p for p, _ in stated]),
        tuple(reliability(stated)),
        tuple(wrong),
    )


def right_names(answer: Mapping[str, Any]) -> set[str]:
    """Names that are right of a case: those of the effects that were withheld, and of what the things of its background are."""
    besides = (BY_ANOTHER_NAME.get(name, ()) for name in answer.get("background") or ())
    return {effect["name"] for effect in answer["effects"]}.union(*besides)


def by_another_name(answer: Mapping[str, Any], said: Sequence[str]) -> bool:
    """Whether all names that were said are what a foreign effect is by derivation (`BY_ANOTHER_NAME`)."""
    return bool(said) and set(said) <= set(BY_ANOTHER_NAME.get(answer["effects"][0]["name"], ()))


def background_right(answer: Mapping[str, Any], result: Mapping[str, Any]) -> bool:
    """Whether all that is scored of a case is right."""
    return all(hit for _, hit in background_scored(answer, result))


def background_scored(answer: Mapping[str, Any], result: Mapping[str, Any]) -> Iterable[tuple[str, bool]]:
    """What is scored of a case, and whether it is right."""
    kind, named, gap = background_class(answer), result["named"], result.get("gap") or {}
    said = [effect["name"] for effect in named]
    pays = gap.get("after") is not None and gap["after"] < SETTINGS.pays * gap["before"]
    if kind == "foreign beside":
        open_ended = result["verdict"] == "unknown" or (named and not result.get("complete"))
        right = bool(open_ended or by_another_name(answer, said))
        yield "foreign beside a background: unknown, or said not to be complete", right
        yield "foreign beside a background: not none", result["verdict"] != "none"
    elif answer["effects"]:
        true = answer["effects"][0]["name"]
        hit = _within_a_set(true, said, result)
        first = named[0]["name"] if named else ""
        yield "main effect named or in a declared set", hit
        if answer.get("main_gap") is not None and answer["main_gap"] > float(answer.get("noise") or np.inf):
            yield "the same, of effects that leave more than noise does when parameters are re-estimated", hit
        yield "and first", hit and (first == true or any(true in s for s in _sets(result)))
        yield "not none", result["verdict"] != "none"
        yield "one other name at most", len([name for name in said if name != true]) <= 1
        yield "one false name at most", len([name for name in said if name not in right_names(answer)]) <= 1
        if kind == "main" and result["verdict"] == "effect" and _above_noise(answer):
            yield "not said to be complete", not result.get("complete")
        covered = _covered(answer["effects"][0], named)
        if covered is not None:
            yield "95 % intervals of the main effect's parameters hold the truth", covered
    if kind in {"background", "clean", "foreign beside"}:
        sure = [effect for effect in named if effect["probability"] >= SETTINGS.certain]
        allowed = kind != "clean" and pays
        yield (
            f"{kind}: no certain name that does not pay on the judging record",
            not sure or allowed,
        )
    if said:
        yield "names shrink the judged discrepancy", pays
        yield "none of them makes it larger", all(effect.get("closed", 1.0) >= 0.0 for effect in named)
    yield "every number is finite", all(map(math.isfinite, _numbers(result)))
    far = [p for p in result.get("nominal", []) if abs(p["shift_in_std"]) > SETTINGS.far]
    yield "no nominal parameter beyond 4 stated sigma unsaid", not far


def _numbers(document: Any) -> Iterator[float]:
    """All numbers of a JSON document."""
    if isinstance(document, int | float):
        yield float(document)
    elif isinstance(document, Mapping | list):
        for entry in document.values() if isinstance(document, Mapping) else document:
            yield from _numbers(entry)


def _above_noise(answer: Mapping[str, Any]) -> bool:
    """Whether the noise is stated rightly and the background is larger than it is, so that what is left cannot be noise."""
    share = answer.get("background_share", answer.get("share")) or 0.0
    gap = float(answer.get("main_gap") or np.max(answer.get("gap_nrmse_identification") or 0.0))
    return answer.get("noise_stated") == "true" and share * gap > float(answer.get("noise") or np.inf)


def _sets(result: Mapping[str, Any]) -> list[list[str]]:
    return result.get("indistinguishable", [])


def _within_a_set(true: str, said: list[str], result: Mapping[str, Any]) -> bool:
    return true in said or any(true in s and set(s) & set(said) for s in _sets(result))


def _stated(answer: Mapping[str, Any], result: Mapping[str, Any]) -> Iterable[tuple[float, bool]]:
    """Probability of every name, and whether it is right: the effect that was withheld, or what a thing of the background is."""
    true = right_names(answer)
    for effect in result["named"]:
        yield effect["probability"], effect["name"] in true


def _covered(truth: Mapping[str, Any], named: list[Mapping[str, Any]]) -> bool | None:
    """Whether the interval of the first parameter of the true effect holds it; None where no estimate of it was named."""
    own = next((effect for effect in named if effect["name"] == truth["name"]), None)
    if own is None or not own["parameters"] or not truth["parameters"]:
        return None
    found = _estimate(own, next(iter(truth.get("names") or own["parameters"])))
    if found is None:
        return None
    value, std = found
    return abs(value - truth["parameters"][0]) <= SETTINGS.interval * std


def _estimate(effect: Mapping[str, Any], name: str) -> tuple[float, float] | None:
    """Value and standard deviation of a parameter as its law has it, whatever the effect's own is referred to (a record's length, say).

    The law's is in proportion to the effect's, so it is known as well relative to its size.
    """
    parameters, theta = effect["parameters"], effect.get("theta") or ()
    law = [p.name for p in find_law(effect["law"]).parameters] if effect.get("law") else []
    own = parameters.get(name) or (next(iter(parameters.values())) if name in law else None)
    if own is None:
        return None
    if name not in law or len(theta) != len(law) or not own["value"]:
        return own["value"], own["std"]
    value = theta[law.index(name)]
    return value, abs(value / own["value"]) * own["std"]
