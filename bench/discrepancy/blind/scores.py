"""The scores of blind trials: of one case, and of a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from bench.discrepancy.blind.background_score import BackgroundScore
from bench.discrepancy.blind.proportions import Share
from bench.files import json_values


@dataclass(frozen=True)
class Scored:
    """One case with its score.

    Attributes:
        name: Name of the case.
        kind: "none", "single", "double", "foreign", "struck", or one of `background_score.CLASSES`.
        right: Whether the verdict is right.
        family: Whether the families are right; None where there is no catalogued effect.
        bands: Dimension to band.
        truth: Withheld effects, (name, place).
        said: Named effects, (name, place).
        verdict: The verdict.
        result: The result as JSON.
        answer: The answer as JSON.
    """

    name: str
    kind: str
    right: bool
    family: bool | None
    bands: Mapping[str, str]
    truth: tuple[tuple[str, str], ...]
    said: tuple[tuple[str, str], ...]
    verdict: str
    result: Mapping[str, Any] = field(repr=False)
    answer: Mapping[str, Any] = field(repr=False)


@dataclass(frozen=True)
class BlindScore:
    """Scores of a blind run; shares are NaN where no case of the kind exists.

    Attributes:
        n: Number of cases scored.
        exact: Share of single-effect cases named exactly, or with the truth in a declared indistinguishable set.
        strict: Share of single-effect cases named exactly, no set helping.
        family: Share of single-effect cases with the right family.
        place: Share of named joint-rig effects at the right place.
        false_alarms: Share of clean cases with another verdict than "none".
        unknown_caught: Share of foreign cases with the verdict "unknown", or named as what they are.
        unfinished: Share of foreign cases like that, or with names that are said not to be all (`complete`).
        both_named: Share of double cases with both effects named.
        tellable: Share of right verdicts over all cases whose records can tell: expected log odds of at least `tellable`
            (foreign ones: `tellable_unknown`) against the nearest rival and against none, where the answers state them.
        unknown_tellable: Share of the foreign cases among these that end so.
        struck_right: Share of cases with the true effect struck from the catalogue that end in unknown or in an effect of its family.
        struck_unknown: Share of them that end in unknown.
        sets_hold_truth: Share of verdicts with a declared indistinguishable set whose names, sets included, hold the truth.
        mean_set: Mean size of the declared sets.
        region_f1: Mean F1 of found against planted regions of the state, over effects that act in a region only.
        calibration_error: Expected calibration error of the named effects' probabilities, in ten bins.
        verdict_calibration_error: The same of the probability of the verdict.
        median_ratio: Median of after / noise_floor over cases.
        p90_ratio: Its 90th percentile.
        p90_ratio_catalogued: The same over cases of catalogued effects.
        median_seconds, p90_seconds: The same of the time of a diagnosis [s].
        seconds: Rig to that median and percentile of its cases.
        failed: Number of diagnoses that ended in an error.
        shares: The shares above with their numbers of cases and intervals.
        bands: Dimension to band to the share of right cases.
        reliability: Bins of stated probability: (mean stated, share true, count).
        confusion: True name to named name to count, single-effect cases.
        wrong: One line for every case that is not right.
        background: Score of the cases with a background, which count in none of the shares above; None where there is none.
    """

    n: int
    exact: float
    strict: float
    family: float
    place: float
    false_alarms: float
    unknown_caught: float
    unfinished: float
    both_named: float
    tellable: float
    unknown_tellable: float
    struck_right: float
    struck_unknown: float
    sets_hold_truth: float
    mean_set: float
    region_f1: float
    calibration_error: float
    verdict_calibration_error: float
    median_ratio: float
    p90_ratio: float
    p90_ratio_catalogued: float
    median_seconds: float
    p90_seconds: float
    failed: int
    seconds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    shares: Mapping[str, Share] = field(default_factory=dict)
    bands: Mapping[str, Mapping[str, Share]] = field(default_factory=dict)
    reliability: tuple[tuple[float, float, int], ...] = ()
    confusion: Mapping[str, Mapping[str, int]] = field(default_factory=dict)
    wrong: tuple[str, ...] = ()
    background: BackgroundScore | None = None

    def to_json(self) -> dict[str, Any]:
        """Return the score as JSON values: NaN as None, a share as {value, n, low, high}."""
        return json_values(asdict(self))
