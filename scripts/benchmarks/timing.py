"""Interleaved timing: the same machine state for everything that is compared."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Row:
    """One comparison.

    Attributes:
        name: What is compared.
        ratio: Median over the repeats of the ratio, ours over the peer's unless `meaning` says otherwise.
        spread: 10th and 90th percentile of the ratio.
        limit: What must hold, for example "≥ 0.95"; empty where nothing is required.
        meaning: What the ratio is.
        detail: The absolute figures behind it.
    """

    name: str
    ratio: float
    spread: tuple[float, float]
    limit: str
    meaning: str
    detail: dict[str, Any]

    @property
    def holds(self) -> bool | None:
        """Whether the limit holds; None where there is none."""
        if not self.limit:
            return None
        sign, bound = self.limit.split()
        return self.ratio >= float(bound) if sign == "≥" else self.ratio <= float(bound)

    def to_dict(self) -> dict[str, Any]:
        """JSON form."""
        return {**asdict(self), "holds": self.holds}


def interleave(tasks: Mapping[str, Callable[[], Any]], repeats: int) -> dict[str, np.ndarray]:
    """Seconds of each task, run in turn A B C A B C …, after one uncounted round; the order alternates.

    Returns:
        Arrays ``(repeats,)`` by task name.
    """
    seconds: dict[str, list[float]] = {name: [] for name in tasks}
    order = list(tasks)
    for repeat in range(-1, repeats):
        for name in order if repeat % 2 else reversed(order):
            gc.collect()
            start = time.perf_counter()
            tasks[name]()
            if repeat >= 0:
                seconds[name].append(time.perf_counter() - start)
    return {name: np.array(values) for name, values in seconds.items()}


def ratio_row(
    name: str,
    ours: np.ndarray,
    peer: np.ndarray,
    *,
    limit: str = "",
    meaning: str,
    detail: dict[str, Any] | None = None,
) -> Row:
    """Speed ratio (peer seconds over ours, pair by pair): above 1 where ours is faster."""
    ratios = peer / ours
    low, high = np.percentile(ratios, [10, 90])
    return Row(
        name,
        float(np.median(ratios)),
        (float(low), float(high)),
        limit,
        meaning,
        {"ours_s": float(np.median(ours)), "peer_s": float(np.median(peer)), **(detail or {})},
    )
