"""Sensors that contradict one another: faults that no force on the structure can explain.

Where a coordinate is measured twice, as a position and as an acceleration say, the one is the derivative of the other
whatever forces act. Over a window w that vanishes smoothly at its ends, ``int w a dt = int w'' x dt`` holds exactly; the
difference of the two sums has a known variance under the stated noise, so windows that do not overlap give a
chi-squared test. It needs no model of the structure, no initial state and no numerical differentiation. Several lengths of
window look at several frequency bands.

References:
    J. J. Gertler, Fault Detection and Diagnosis in Engineering Systems, 1998, chapter 6 (parity relations).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from scipy import stats

from bench.discrepancy.likelihood.problem import Array, Problem
from bench.discrepancy.likelihood.whitening import fast_length
from bench.discrepancy.response.simulator import Simulator

WINDOW = Polynomial([1.0, 0.0, -1.0]) ** 4
"""``(1 - s^2)^4``: its first three derivatives vanish at the ends, so that sums over samples are as good as integrals."""


class Contradiction(NamedTuple):
    """Two channels of one coordinate held against each other.

    Attributes:
        dof: Degree of freedom.
        channels: The two channels, the lower derivative first.
        ratio: Power of their contradiction over that of the noise, at the length of window that shows it best.
        p_value: Probability of such a contradiction from noise alone, after correction.
        window_s: That length of window [s].
        found: Whether a fault of a sensor is to be concluded.
        suspect: The channel that the nominal model contradicts too; empty where it cannot be told.
    """

    dof: str
    channels: tuple[str, str]
    ratio: float
    p_value: float
    window_s: float
    found: bool = False
    suspect: str = ""


def contradictions(problem: Problem) -> tuple[Contradiction, ...]:
    """Hold against each other all pairs of response channels that measure one degree of freedom at different derivatives."""
    settings = problem.settings.localisation
    if problem.driven:
        return ()
    observers = problem.structure.observers
    pairs = [
        (a, b)
        for a in range(len(observers))
        for b in range(len(observers))
        if observers[a].order < observers[b].order
        and np.array_equal(observers[a].row, observers[b].row)
        and np.count_nonzero(observers[a].row) == 1
    ]
    out = []
    for a, b in pairs:
        tests = _tests(problem, a, b)
        if not tests:
            continue
        p_value, ratio, window = min(tests)
        corrected = min(1.0, p_value * len(tests) * len(pairs))
        found = Contradiction(
            problem.structure.dofs[int(np.argmax(np.abs(observers[a].row)))],
            (observers[a].channel, observers[b].channel),
            ratio,
            corrected,
            window,
            bool(corrected < settings.parity_doubtful and ratio > settings.parity_material),
        )
        out.append(found._replace(suspect=_suspect(problem, a, b)) if found.found else found)
    return tuple(out)


def _tests(simulator: Simulator, a: int, b: int) -> list[tuple[float, float, float]]:
    """(p-value, power ratio, window [s]) for windows of several lengths, all records together."""
    settings = simulator.settings.localisation
    low, high = (simulator.structure.observers[i] for i in (a, b))
    steps = high.order - low.order
    shortest = min(len(r) for r in simulator.records)
    lengths = np.unique(
        np.geomspace(
            settings.parity_shortest,
            max(shortest // settings.parity_windows, settings.parity_shortest),
            settings.parity_lengths,
        ).astype(int)
    )
    out = []
    for length in lengths:
        s = (np.arange(length) + 0.5) / length * 2.0 - 1.0
        squares, count = 0.0, 0
        step = simulator.records[0].step
        for record in simulator.records:
            step = record.step
            kernel = WINDOW(s)
            derived = WINDOW.deriv(steps)(s) * (2.0 / (length * step)) ** steps * (-1.0) ** steps
            x, y = record.values[low.channel], record.values[high.channel]
            n = len(x) // length
            parts = [v[: n * length].reshape(n, length) for v in (x, y)]
            difference = parts[1] @ kernel - parts[0] @ derived
            noise = simulator.noise[b] ** 2 + _sampling(y, simulator.noise[b])
            variance = noise * np.sum(kernel**2) + simulator.noise[a] ** 2 * np.sum(derived**2)
            squares += float(np.sum(difference**2) / variance)
            count += n
        if count >= settings.parity_windows:
            out.append((float(stats.chi2.sf(squares, count)), float(squares / count), float(length * step)))
    return out


def _sampling(y: Array, noise: float) -> float:
    """Variance that sampling adds to a signal with jumps, as friction makes of an acceleration.

    A jump between two samples is off by a uniform part of a sample: a twelfth of its square. Second differences show the
    jumps (twice their square) and little of what is smooth.
    """
    second = np.diff(y, 2)
    return max(float(np.mean(second**2)) - 6.0 * noise**2, 0.0) / 24.0


def _suspect(problem: Problem, a: int, b: int) -> str:
    """Of two channels, the one that the nominal model, its parameters re-estimated, explains worse on its own."""
    settings = problem.settings.localisation
    if problem.windowed:
        return ""
    n = len(problem.nominal)
    whole = [_by_channel(problem, step) for step in (np.zeros(n), *(settings.parity_probe * np.eye(n)))]
    if not all(np.isfinite(part).all() for part in whole):
        return ""
    left = []
    for c in (a, b):
        base = whole[0][c]
        matrix = np.column_stack([part[c] - base for part in whole[1:]]) / settings.parity_probe
        deviation = -np.linalg.solve(matrix.T @ matrix + np.eye(n), matrix.T @ base)
        rest = base + matrix @ deviation
        left.append(float(rest @ rest) / len(rest))
    if max(left) < settings.parity_clearly * min(left):
        return ""
    return problem.structure.channels[(a, b)[int(np.argmax(left))]]


def _by_channel(problem: Problem, vector: Array) -> Array:
    """Free-run residuals (n_channels, n_residuals), each channel whitened by its own noise alone."""
    parts = []
    for data in problem.data:
        residual = data.responses - problem.simulate((), vector, data.record)
        spectrum = np.fft.rfft(residual, fast_length(len(residual)), axis=0)[: data.n_bins]
        lower = np.linalg.inv(data.whitening)
        size = np.sqrt(np.sum(np.abs(lower) ** 2, axis=2) * len(residual) / 2.0)
        white = spectrum / size
        parts.append(np.concatenate([white.real, white.imag]).T)
    return np.concatenate(parts, axis=1)
