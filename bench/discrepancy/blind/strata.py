"""Bands: the dimensions of a case by which accuracy is reported."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from bench.discrepancy.blind.proportions import Share, share_of


@dataclass(frozen=True)
class StrataSettings:
    """Numbers of `bench.discrepancy.blind.strata`."""

    bands: Mapping[str, tuple[float, ...]] = field(
        default_factory=lambda: {
            "gap": (0.0, 0.06, 0.12, 0.25, math.inf),
            "noise": (0.0, 0.006, 0.012, math.inf),
            "log odds against the nearest rival": (-math.inf, 3.0, 10.0, 50.0, math.inf),
            "log odds against none": (-math.inf, 10.0, 100.0, math.inf),
        }
    )
    """Edges of the bands that accuracy is reported by."""


SETTINGS = StrataSettings()


def bands_of(name: str, answer: Mapping[str, Any], kind: str) -> dict[str, str]:
    """The band of a case in every dimension that its answer states."""
    gap = answer.get("gap_nrmse_identification", answer.get("gap_nrmse_validation"))
    odds = answer.get("detectability") or {}
    numbers = {
        "gap": None if gap is None or kind == "none" else float(np.max(gap)),
        "noise": None if isinstance(answer.get("noise"), dict) else answer.get("noise"),
        "log odds against the nearest rival": odds.get("log_odds_rival"),
        "log odds against none": odds.get("log_odds_none"),
    }
    bands = {
        key: _band(value, SETTINGS.bands[key], percent=key in {"gap", "noise"})
        for key, value in numbers.items()
        if value is not None
    }
    bands["class"] = kind
    bands["rig"] = str(answer.get("rig") or name.partition("-")[0])
    if answer.get("sensors"):
        sensors = answer["sensors"]
        bands["sensors"] = sensors if isinstance(sensors, str) else "+".join(sensors)
    if answer.get("signals"):
        bands["identification signal"] = (
            answer["signals"][0] if bands["rig"] != "joint" else "several (joint)"
        )
    if answer["effects"]:
        bands["effect"] = answer["effects"][0]["name"] if len(answer["effects"]) == 1 else "double"
    return bands


def _band(value: float, edges: Sequence[float], *, percent: bool) -> str:
    i = int(np.clip(np.searchsorted(edges, value, side="right") - 1, 0, len(edges) - 2))
    low, high = edges[i], edges[i + 1]
    scale, unit = (100.0, " %") if percent else (1.0, "")
    if math.isinf(high):
        return f"above {scale * low:g}{unit}"
    if math.isinf(low):
        return f"below {scale * high:g}{unit}"
    return f"{scale * low:g} to {scale * high:g}{unit}"


def by_band(scored: Iterable[tuple[Mapping[str, str], bool]]) -> dict[str, dict[str, Share]]:
    """Dimension to band to the share of cases that are right, from the bands of each case and whether it is."""
    flags: dict[str, dict[str, list[bool]]] = defaultdict(lambda: defaultdict(list))
    for bands, right in scored:
        for dimension, band in bands.items():
            flags[dimension][band].append(right)
    ordered = ("class", "rig", *SETTINGS.bands, "sensors", "identification signal", "effect")
    return {
        d: {band: share_of(flags[d][band]) for band in sorted(flags[d], key=_order(d))}
        for d in ordered
        if d in flags
    }


def _order(dimension: str) -> Callable[[str], Any]:
    if dimension not in SETTINGS.bands:
        return lambda band: band
    edges = SETTINGS.bands[dimension]
    names = [
        _band(low + 1e-9 if math.isfinite(low) else high - 1e-9, edges, percent=dimension in {"gap", "noise"})
        for low, high in pairwise(edges)
    ]
    return names.index
