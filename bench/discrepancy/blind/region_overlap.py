"""How well the found regions of the state agree with the planted ones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class RegionOverlapSettings:
    """Numbers of `bench.discrepancy.blind.region_overlap`."""

    cells: int = 32
    """Cells of the reach of a coordinate in which planted and found regions are compared."""


SETTINGS = RegionOverlapSettings()


def region_scores(result: Mapping[str, Any], answer: Mapping[str, Any]) -> list[float]:
    """F1 of the found regions of displacement, for every place where some are planted, in cells of the coordinate's reach.

    Planted is what the effects of the place cover together, since the force that is missing there is their sum. Found is
    what the locations of the degree of freedom (or of the place) mark: all their regions, or the strongest one where only that is
    given.
    """
    planted: dict[tuple[str, str, float], list[Sequence[float]]] = {}
    for region in answer.get("regions") or ():
        key = (region["dof"], region["coordinate"], region["reach"])
        planted.setdefault(key, []).extend(region["intervals"])
    out = []
    for (place, coordinate, reach), intervals in planted.items():
        edges = np.linspace(-reach, reach, SETTINGS.cells + 1)
        middle = 0.5 * (edges[1:] + edges[:-1])
        truth = _inside(middle, [_widened(interval, 2.0 * reach / SETTINGS.cells) for interval in intervals])
        found = np.zeros(SETTINGS.cells, dtype=bool)
        for location in result.get("locations") or ():
            dof = str(location.get("dof", ""))
            if place and not dof.startswith({"axial": ("x", "axial"), "torsional": ("th", "tor")}[place]):
                continue
            for region in location.get("regions") or [location.get("state_region") or {}]:
                if region:  # a region that does not depend on the coordinate lies everywhere along it
                    low, high = region.get(coordinate) or (None, None)  # null: without a limit
                    limits = (-reach if low is None else low, reach if high is None else high)
                    found |= _inside(middle, [_widened(limits, 2.0 * reach / SETTINGS.cells)])
        both = np.sum(truth & found)
        out.append(float(2.0 * both / max(np.sum(truth) + np.sum(found), 1)))
    return out


def _widened(interval: Sequence[float], width: float) -> tuple[float, float]:
    """An interval, at least a cell wide: what is narrower, as the contact with a hard stop, lies in the cell that holds its middle."""
    low, high = interval
    margin = max(0.5 * (width - (high - low)), 0.0)
    return low - margin, high + margin


def _inside(middle: np.ndarray, intervals: Iterable[Sequence[float]]) -> np.ndarray:
    return np.any([(middle >= low) & (middle <= high) for low, high in intervals], axis=0)
