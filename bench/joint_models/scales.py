"""Where the fit of a law begins: its parameters in the sizes that force, stroke and speed of the records set."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bench.identification.parametric import ComponentRecord
from bench.laws.base import ForceLaw, Parameter
from bench.recording.units import dimensions


@dataclass(frozen=True)
class SearchRanges:
    """Ranges of the starts, in the natural sizes of the records.

    A parameter of a law has by dimension one size that matters in a record: a stiffness is of the order of peak force over stroke,
    a clearance is a part of the stroke. Two decades around it hold all of them but those that cannot be told from nothing.

    Attributes:
        low: Smallest start, in that size.
        high: Largest start.
        start: First start.
    """

    low: float = 0.03
    high: float = 3.0
    start: float = 0.3


def starts_of(
    law: ForceLaw, motions: Sequence[ComponentRecord], ranges: SearchRanges | None = None
) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
    """First start and ranges of the further starts of a law's parameters, for `fit_law`.

    Args:
        law: The law.
        motions: The records.
        ranges: Ranges in natural sizes.
    """
    own = ranges or SearchRanges()
    force = max(float(np.percentile(np.abs(m.force), 99)) for m in motions)
    stroke = max(float(np.ptp(m.displacement, axis=0).max()) / 2.0 for m in motions)
    speed = max(float(np.percentile(np.abs(m.velocity), 99)) for m in motions)
    start, search = {}, {}
    for parameter in law.parameters:
        size = _size(parameter, force, stroke, speed)
        if size is None:
            continue
        low, high = parameter.bounds
        signed = low < 0.0
        start[parameter.name] = min(max(0.0 if signed else own.start * size, low), high)
        edges = (-size, size) if signed else (own.low * size, own.high * size)
        search[parameter.name] = (min(max(edges[0], low), high), max(min(edges[1], high), low))
    return start, {name: edge for name, edge in search.items() if edge[1] > edge[0]}


def _size(parameter: Parameter, force: float, stroke: float, speed: float) -> float | None:
    """The size of a parameter by its unit; None where it is a plain number, which starts at its default."""
    mass, length, time = dimensions(parameter.unit)
    if (mass, length, time) == (0.0, 0.0, 0.0) or min(force, stroke, speed) <= 0.0:
        return None
    # force = mass length / time^2, and time = stroke / speed
    second = stroke / speed
    kilogram = force * second**2 / stroke
    size = kilogram**mass * stroke**length * second**time
    return size if math.isfinite(size) and size > 0.0 else None
