"""Scoring of blind trials against their answers.

What counts as right, by the class of a case:

- none: the verdict *none* (anything else is a false alarm); foreign: the verdict *unknown*, or what it is: by
  derivation, or by its own name and place where a catalogue has it that was not there when the case was made.
- single, double: the verdict *effect*, with the withheld effects and no others, each at its place; one of them may be another
  member of a set that the verdict declares indistinguishable, if the set holds the truth.
- struck (the true effect was taken out of the catalogue): *unknown*, or an effect of the truth's family.
- with a background (main, background, unstated, clean): see `background_score`; these have figures of their own.
"""

from __future__ import annotations

import hashlib
import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bench.discrepancy.blind.background_score import (
    CLASSES,
    background_class,
    background_right,
    background_summary,
    by_another_name,
)
from bench.discrepancy.blind.proportions import Share, calibration_error, reliability, share_of
from bench.discrepancy.blind.region_overlap import region_scores
from bench.discrepancy.blind.schema import ANSWER_LIMITS, AnswerDocument
from bench.discrepancy.blind.scores import BlindScore, Scored
from bench.discrepancy.blind.strata import bands_of, by_band
from bench.discrepancy.effects.catalogue import CATALOGUE
from bench.discrepancy.verdict_schema import ResultDocument
from bench.documents import checked, load_document, parse_json, read_text
from bench.errors import FileFormatError

FAMILIES = {e.name: e.family for e in CATALOGUE}


@dataclass(frozen=True)
class ScoringSettings:
    """Numbers of `bench.discrepancy.blind.scoring`."""

    tellable: float = 10.0
    """Expected log odds from which a record is said to be able to tell: noise then misleads in a few cases of ten thousand."""
    tellable_unknown: float = 30.0
    """The same for what no catalogue holds. No law of it is there to be fitted: a test that is free in some 25 coefficients, and wrong
    once in a thousand cases, finds it in 95 of 100 from so much on."""


SETTINGS = ScoringSettings()


def score_blind(results: str | Path, answers: str | Path, *, cases: str | Path | None = None) -> BlindScore:
    """Score diagnoses against answers.

    Args:
        results: Folder of JSON files written by a diagnosis.
        answers: Folder of answers, same file names.
        cases: Folder of cases; where given and a case has ``answer.sha256``, the answer is checked against it.

    Raises:
        FileFormatError: No result has an answer, or an answer does not match its hash.
        DocumentError: A result or an answer has an entry that is missing or of the wrong kind.
    """
    return summary(score_cases(results, answers, cases=cases))


def score_cases(results: str | Path, answers: str | Path, *, cases: str | Path | None = None) -> list[Scored]:
    """Score every case on its own; see `score_blind`."""
    results, answers = Path(results), Path(answers)
    out = []
    for path in sorted(results.glob("*.json")):
        file = answers / path.name
        if not file.is_file():
            continue
        text = read_text(file, ANSWER_LIMITS.json_bytes)
        _check_seal(text, path.stem, cases)
        answer = parse_json(text, str(file), limits=ANSWER_LIMITS)
        checked(AnswerDocument, answer, str(file))
        result = load_document(path)
        checked(ResultDocument, result, str(path))
        out.append(_scored(path.stem, result, answer))
    if not out:
        raise FileFormatError(f"no result in '{results}' has an answer in '{answers}'")
    return out


def _scored(name: str, result: Mapping[str, Any], answer: Mapping[str, Any]) -> Scored:
    truth = tuple((e["name"], e.get("where", "") or "") for e in answer["effects"])
    # a rig with one place has a name for it that answers need not state
    placed = any(where for _, where in truth)
    said = tuple((e["name"], (e.get("where", "") or "") if placed else "") for e in result["named"])
    kind = "struck" if answer.get("struck") else background_class(answer) or str(answer["class"])
    right = (
        background_right(answer, result)
        if kind in CLASSES
        else _right(result, set(said), set(truth), kind)
        or (kind == "foreign" and by_another_name(answer, [name for name, _ in said]))
    )
    families = None
    if kind in {"single", "double"}:
        families = right or (
            result["verdict"] == "effect"
            and sorted(_family(n) for n, _ in truth) == sorted(_family(n) for n, _ in said)
        )
    return Scored(
        name,
        kind,
        right,
        families,
        bands_of(name, answer, kind),
        truth,
        said,
        str(result["verdict"]),
        result,
        answer,
    )


def _family(name: str) -> str:
    return str(FAMILIES.get(name, name))


def _right(
    result: Mapping[str, Any], said: set[tuple[str, str]], truth: set[tuple[str, str]], kind: str
) -> bool:
    verdict = result["verdict"]
    if kind == "none":
        return verdict == "none"
    if kind == "foreign":
        return verdict == "unknown" or (verdict == "effect" and said == truth)
    if kind == "struck":
        own = {FAMILIES.get(name) for name, _ in truth}
        return verdict == "unknown" or (
            verdict == "effect" and bool(said) and {FAMILIES.get(name) for name, _ in said} <= own
        )
    if verdict != "effect" or len(said) != len(truth):
        return False
    missed, extra = truth - said, said - truth
    if not missed:
        return True
    if len(missed) == len(extra) == 1:
        (name, where), (other, place) = *missed, *extra
        return where == place and any(
            {name, other} <= set(entry) for entry in result.get("indistinguishable") or ()
        )
    return False


def summary(scored: Sequence[Scored]) -> BlindScore:
    """Sum up scored cases."""
    every, scored = scored, [s for s in scored if s.kind not in CLASSES]
    beside = [(s.name, s.answer, s.result) for s in every if s.kind in CLASSES]
    sizes = [len(entry) for s in _declared(scored) for entry in s.result["indistinguishable"]]
    shares, hits, verdicts = _shares(scored), _effects_claimed(scored), _verdicts_claimed(scored)
    ratios = [r for s in scored for r in _ratios(s.result)]
    catalogued = [r for s in scored if s.kind in {"single", "double"} for r in _ratios(s.result)]
    by_rig: dict[str, list[float]] = defaultdict(list)
    for s in every:
        if s.result.get("seconds"):
            by_rig[s.bands["rig"]].append(float(s.result["seconds"]))
    seconds = [one for of in by_rig.values() for one in of]
    f1 = [f for s in scored for f in region_scores(s.result, s.answer)]
    return BlindScore(
        n=len(every),
        **{name: share.value for name, share in shares.items()},
        mean_set=float(np.mean(sizes)) if sizes else math.nan,
        region_f1=float(np.mean(f1)) if f1 else math.nan,
        calibration_error=calibration_error(hits),
        verdict_calibration_error=calibration_error(verdicts),
        median_ratio=_quantile(ratios, 0.5),
        p90_ratio=_quantile(ratios, 0.9),
        p90_ratio_catalogued=_quantile(catalogued, 0.9),
        median_seconds=_quantile(seconds, 0.5),
        p90_seconds=_quantile(seconds, 0.9),
        seconds={rig: (_quantile(of, 0.5), _quantile(of, 0.9)) for rig, of in sorted(by_rig.items())},
        failed=sum(s.verdict == "failed" for s in every),
        shares=shares,
        bands=by_band((s.bands, s.right) for s in every),
        reliability=tuple(reliability(hits)),
        confusion=_confusion(scored),
        wrong=tuple(_complaint(s) for s in scored if not s.right),
        background=background_summary(beside) if beside else None,
    )


def _declared(scored: Sequence[Scored]) -> list[Scored]:
    """Cases with sets of effects that their verdicts cannot tell apart."""
    return [s for s in scored if s.kind in {"single", "double"} and s.result.get("indistinguishable")]


def _shares(scored: Sequence[Scored]) -> dict[str, Share]:
    """Shares of what is right, by the name that the score has for each."""
    by_kind: dict[str, list[Scored]] = defaultdict(list)
    for s in scored:
        by_kind[s.kind].append(s)
    singles = by_kind["single"]
    tellable = [s for s in scored if s.kind != "struck" and _tellable(s)]
    return {
        "exact": share_of(s.right for s in singles),
        "strict": share_of(set(s.said) == set(s.truth) and s.verdict == "effect" for s in singles),
        "family": share_of(bool(s.family) for s in singles),
        "place": share_of(_places(scored)),
        "false_alarms": share_of(not s.right for s in by_kind["none"]),
        "unknown_caught": share_of(s.right for s in by_kind["foreign"]),
        "unfinished": share_of(s.right or s.result.get("complete") is False for s in by_kind["foreign"]),
        "both_named": share_of(s.right for s in by_kind["double"]),
        "tellable": share_of(s.right for s in tellable),
        "unknown_tellable": share_of(s.right for s in tellable if s.kind == "foreign"),
        "struck_right": share_of(s.right for s in by_kind["struck"]),
        "struck_unknown": share_of(s.verdict == "unknown" for s in by_kind["struck"]),
        "sets_hold_truth": share_of(_held(s) for s in _declared(scored)),
    }


def _confusion(scored: Sequence[Scored]) -> dict[str, dict[str, int]]:
    """How often each effect was called what, of cases with a single one."""
    counts: dict[str, dict[str, int]] = defaultdict(lambda: defaultdict(int))
    for s in scored:
        if s.kind == "single":
            counts[s.truth[0][0]][" + ".join(sorted(n for n, _ in s.said)) or s.verdict] += 1
    return {k: dict(v) for k, v in sorted(counts.items())}


def _effects_claimed(scored: Sequence[Scored]) -> list[tuple[float, bool]]:
    """Probability that each named effect was given, and whether it is there."""
    return [
        (float(e["probability"]), e["name"] in {n for n, _ in s.truth})
        for s in scored
        if s.kind != "struck"
        for e in s.result["named"]
    ]


def _verdicts_claimed(scored: Sequence[Scored]) -> list[tuple[float, bool]]:
    """Probability that each verdict was given, and whether it is the right one."""
    own = {"none": "none", "foreign": "unknown", "single": "effect", "double": "effect"}
    return [
        (float(s.result["probabilities"][s.verdict]), s.verdict == own[s.kind])
        for s in scored
        if s.kind in own and s.verdict in (s.result.get("probabilities") or {})
    ]


def _least_odds(answer: Mapping[str, Any]) -> float:
    """Smaller one of the expected log odds that an answer states; minus infinity where it states none."""
    odds = answer.get("detectability") or {}
    stated = [odds.get(name) for name in ("log_odds_rival", "log_odds_none")]
    return min(-math.inf if value is None else value for value in stated)


def _tellable(s: Scored) -> bool:
    """Whether the records can tell the truth of a case."""
    return _least_odds(s.answer) >= (SETTINGS.tellable_unknown if s.kind == "foreign" else SETTINGS.tellable)


def _complaint(s: Scored) -> str:
    truth = ", ".join(f"{n} {w}".strip() for n, w in s.truth) or "nothing"
    said = ", ".join(f"{n} {w}".strip() for n, w in s.said) or s.verdict
    odds = (s.answer.get("detectability") or {}).get("log_odds_rival")
    rival = (
        f" (expected log odds {odds:.1f} against {s.answer['detectability']['rival']})"
        if odds is not None
        else ""
    )
    return f"{s.name}: {s.kind}, {truth} diagnosed as {said}{rival}"


def _places(scored: Sequence[Scored]) -> list[bool]:
    """Whether each effect named rightly stands at its place.

    What stands exactly where it is withheld is taken out first: beside it the same law may be named for another effect.
    """
    right: list[bool] = []
    for s in scored:
        missed = {n for n, w in s.truth if w and (n, w) not in s.said}
        right += [True] * sum(bool(w) and (n, w) in s.said for n, w in s.truth)
        right += [False for n, w in s.said if (n, w) not in s.truth and n in missed]
    return right


def _held(s: Scored) -> bool:
    """Whether the named effects and the sets they stand in hold all withheld effects."""
    declared = (label.split(" + ") for entry in s.result["indistinguishable"] for label in entry)
    held = {n for n, _ in s.said}.union(*declared)
    return {n for n, _ in s.truth} <= held


def _ratios(result: Mapping[str, Any]) -> list[float]:
    gaps = result.get("gaps") or ([result["gap"]] if result.get("gap") else [])
    return [
        g["after"] / g["noise_floor"] if g.get("after") is not None else math.inf
        for g in gaps
        if g.get("noise_floor")
    ]


def _quantile(values: Sequence[float], q: float) -> float:
    return float(np.quantile(values, q, method="linear")) if len(values) else math.nan


def _check_seal(text: str, name: str, cases: str | Path | None) -> None:
    if cases is None:
        return
    seal = Path(cases) / name / "answer.sha256"
    if seal.is_file() and seal.read_text().strip() != hashlib.sha256(text.encode()).hexdigest():
        raise FileFormatError(
            f"the answer of '{name}' does not match its published hash; it was changed after sealing"
        )
