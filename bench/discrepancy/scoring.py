"""Scoring of blind trials against their answers."""

from __future__ import annotations

import hashlib
import json
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np

from bench.discrepancy.blind import FAMILIES, BlindScore
from bench.errors import FileFormatError


def score_blind(results: str | Path, answers: str | Path, *, cases: str | Path | None = None) -> BlindScore:
    """Score diagnoses against answers.

    Args:
        results: Folder of JSON files written by a diagnosis.
        answers: Folder of answers, same file names.
        cases: Folder of cases; where given and a case has ``answer.sha256``, the answer is checked against it.

    Raises:
        FileFormatError: No result has an answer, or an answer does not match its hash.
    """
    results, answers = Path(results), Path(answers)
    pairs = []
    for path in sorted(results.glob("*.json")):
        answer = answers / path.name
        if answer.is_file():
            text = answer.read_text()
            _check_seal(text, path.stem, cases)
            pairs.append((path.stem, json.loads(path.read_text()), json.loads(text)))
    if not pairs:
        raise FileFormatError(f"no result in '{results}' has an answer in '{answers}'")
    by_class: dict[str, list[bool]] = defaultdict(list)
    families, places, hits, ratios, wrong = [], [], [], [], []
    confusion: dict[str, dict[str, int]] = defaultdict(lambda: defaultdict(int))
    for name, result, answer in pairs:
        truth = {(e["name"], e.get("where", "") or "") for e in answer["effects"]}
        right = _right(result, truth, answer["class"])
        by_class[answer["class"]].append(right)
        if not right:
            said = (
                ", ".join(f"{e['name']} {e['where']}".strip() for e in result["named"]) or result["verdict"]
            )
            wrong.append(f"{name}: {answer['class']} {sorted(n for n, _ in truth)} diagnosed as {said}")
        if answer["class"] == "single":
            (true_name, _), *_ = truth
            said = result["named"][0]["name"] if result["named"] else result["verdict"]
            confusion[true_name][said] += 1
            families.append(right or FAMILIES.get(said) == FAMILIES.get(true_name))
        wheres = dict(truth)
        places += [e["where"] == wheres[e["name"]] for e in result["named"] if wheres.get(e["name"])]
        hits += [(e["probability"], e["name"] in wheres) for e in result["named"]]
        ratios += [g["after"] / g["noise_floor"] for g in result.get("gaps") or [result["gap"]]]
    return BlindScore(
        n=len(pairs),
        exact=_share(by_class["single"]),
        family=_share(families),
        place=_share(places),
        false_alarms=1.0 - _share(by_class["none"]),
        unknown_caught=_share(by_class["foreign"]),
        both_named=_share(by_class["double"]),
        calibration_error=calibration_error(hits),
        median_ratio=float(np.median(ratios)),
        p90_ratio=float(np.percentile(ratios, 90)),
        confusion={k: dict(v) for k, v in confusion.items()},
        wrong=tuple(wrong),
    )


def _right(result: dict[str, Any], truth: set[tuple[str, str]], kind: str) -> bool:
    said = {(e["name"], e["where"]) for e in result["named"]}
    if kind == "none":
        return result["verdict"] == "none"
    if kind == "foreign":
        return result["verdict"] == "unknown"
    if result["verdict"] != "effect" or len(said) != len(truth):
        return False
    missed, extra = truth - said, said - truth
    if not missed:
        return True
    sets = [set(entry) for entry in result["indistinguishable"]]
    if len(missed) == len(extra) == 1:
        (name, where), (other, place) = *missed, *extra
        return where == place and any({name, other} <= entry for entry in sets)
    return False


def calibration_error(hits: list[tuple[float, bool]], bins: int = 10) -> float:
    """Expected calibration error: mean distance between stated and observed frequency, weighed by bin counts."""
    if not hits:
        return float("nan")
    stated = np.array([p for p, _ in hits])
    true = np.array([h for _, h in hits], dtype=float)
    which = np.minimum((stated * bins).astype(int), bins - 1)
    return float(
        sum(
            abs(stated[which == b].mean() - true[which == b].mean()) * np.mean(which == b) for b in set(which)
        )
    )


def _share(flags: list[bool]) -> float:
    return float(np.mean(flags)) if flags else float("nan")


def _check_seal(text: str, name: str, cases: str | Path | None) -> None:
    if cases is None:
        return
    seal = Path(cases) / name / "answer.sha256"
    if seal.is_file() and seal.read_text().strip() != hashlib.sha256(text.encode()).hexdigest():
        raise FileFormatError(
            f"the answer of '{name}' does not match its published hash; it was changed after sealing"
        )
