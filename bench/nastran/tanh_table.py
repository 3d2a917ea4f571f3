"""A piecewise linear table of tanh, for solvers that know functions only as tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError
from bench.nastran.numbers import parse_real, real_text


@dataclass(frozen=True)
class TanhTableSettings:
    """Numbers of `bench.nastran.tanh_table`."""

    end: float = 10.0
    """Beyond it tanh is 1 to 4e-9, and the table is constant."""


SETTINGS = TanhTableSettings()


def tanh_points(n: int = 2001, width: int = 16) -> tuple[tuple[float, float], ...]:
    """Points of a table of tanh, closer together where it bends more.

    The error of a chord is ``h^2 |f''| / 8``; points at equal steps of the integral of ``sqrt|f''|`` make it the same
    everywhere. Nastran continues a table by its last straight line, so the last two points on each side are ±1.

    Args:
        n: Number of points, odd and at least 11.
        width: Characters a number has on the card; each point lies on tanh at the abscissa as it will be written.

    Returns:
        (x, tanh x) in increasing x.

    Raises:
        ParameterError: `n` is even or too small, or neighbouring abscissae coincide in this width.
    """
    if n < 11 or n % 2 == 0:
        raise ParameterError(
            f"a tanh table of {n} points was asked for; an odd number of at least 11 is expected"
        )
    x = np.linspace(0.0, SETTINGS.end, 200_001)
    bend = np.sqrt(2.0 * np.tanh(x)) / np.cosh(x)
    length = np.concatenate([[0.0], np.cumsum(0.5 * (bend[1:] + bend[:-1]) * np.diff(x))])
    inner = np.interp(np.linspace(0.0, length[-1], (n - 1) // 2 - 1), length, x)
    # the negative abscissa has one digit less: round to what both signs can hold
    rounded = [
        -parse_real(real_text(-value, width))
        for value in [*inner, 2.0 * SETTINGS.end, 2.0 * SETTINGS.end + 1.0]
    ]
    if not np.all(np.diff(rounded) > 0.0):
        raise ParameterError(f"{n} points of tanh cannot be told apart in {width} characters; ask for fewer")
    positive = [(value, 1.0 if value > SETTINGS.end else float(np.tanh(value))) for value in rounded[1:]]
    return (*((-value, -y) for value, y in reversed(positive)), (0.0, 0.0), *positive)


def table_error(points: Sequence[tuple[float, float]]) -> float:
    """Largest deviation of a table from tanh, over its own range and twice as far."""
    x, y = np.array(points, dtype=float).T
    slopes = (y[1] - y[0]) / (x[1] - x[0]), (y[-1] - y[-2]) / (x[-1] - x[-2])

    def deviation(at: NDArray[np.float64]) -> NDArray[np.float64]:
        value = np.interp(at, x, y)
        value += slopes[0] * np.minimum(at - x[0], 0.0) + slopes[1] * np.maximum(at - x[-1], 0.0)
        return np.abs(value - np.tanh(at))

    reach = 2.0 * float(np.max(np.abs(x)))
    # between two points the largest deviation of a chord from a smooth curve is near the middle
    inside = x[:-1, None] + np.diff(x)[:, None] * np.linspace(0.0, 1.0, 9)
    return float(np.max(deviation(np.concatenate([[-reach, reach], inside.ravel()]))))
