"""Threshold of a cumulative sum from the mean number of periods that it may run without a false alarm.

The sum of one side is ``S_k = max(0, S_(k-1) + z_k - reference)``, with an alarm where S exceeds the threshold. Its mean run length
follows from the Markov chain of its values (Brook and Evans 1972), exactly but for the width of the cells. z is distributed as
Student's t: that is how the error of a prediction is distributed whose scatter was estimated from a finite number of periods;
the normal distribution would promise too few false alarms.

References:
    Page 1954, Continuous inspection schemes, Biometrika 41; Brook, D. and Evans, D. A. 1972, An approach to the probability
    distribution of CUSUM run length, Biometrika 59; Hawkins and Olwell 1998, Cumulative Sum Charts and Charting.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import optimize, stats

from bench.errors import ParameterError


@dataclass(frozen=True)
class RunLengthSettings:
    """Numbers of `bench.monitoring.run_length`."""

    cells: int = 80
    """Cells of the sum; the run length changes by less than a hundredth when they are doubled (see the test)."""


SETTINGS = RunLengthSettings()


def mean_run_length(threshold: float, reference: float, freedom: float) -> float:
    """Mean number of periods until one side alarms while nothing changes.

    Args:
        threshold: h, of the sum [standard deviations].
        reference: k, subtracted from each z [standard deviations].
        freedom: Degrees of freedom of z; infinite for the normal distribution.

    Raises:
        ParameterError: A negative threshold or reference.
    """
    if threshold < 0.0 or reference < 0.0:
        raise ParameterError(
            f"threshold {threshold:g} and reference {reference:g} came; numbers of at least 0 are expected"
        )
    z = stats.norm() if math.isinf(freedom) else stats.t(freedom)
    if threshold == 0.0:
        return 1.0 / max(float(z.sf(reference)), 1e-300)
    # Cells centred at 0, w, 2w, …; the first holds all sums that were cut at zero.
    width = 2.0 * threshold / (2.0 * SETTINGS.cells - 1.0)
    centre = width * np.arange(SETTINGS.cells)
    edge = centre[None, :] - centre[:, None] + reference
    step = np.asarray(z.cdf(edge + 0.5 * width)) - np.asarray(z.cdf(edge - 0.5 * width))
    step[:, 0] = z.cdf(edge[:, 0] + 0.5 * width)
    lengths = np.linalg.solve(np.eye(SETTINGS.cells) - step, np.ones(SETTINGS.cells))
    return float(lengths[0])


def alarm_threshold(reference: float, freedom: float, run_length: float) -> float:
    """Threshold at which a two-sided sum alarms once in so many periods, on average, while nothing changes.

    Args:
        reference: k [standard deviations].
        freedom: Degrees of freedom of z.
        run_length: Mean number of periods between false alarms of both sides together.

    Returns:
        h [standard deviations]; 0 where a single period beyond the reference is rarer than that already.

    Raises:
        ParameterError: A run length of two periods or fewer.
    """
    if not run_length > 2.0:
        raise ParameterError(
            f"a mean run of {run_length:g} periods between false alarms came; more than 2 are expected"
        )
    one_side = 2.0 * run_length

    def short(threshold: float) -> float:
        return math.log(mean_run_length(threshold, reference, freedom) / one_side)

    if short(0.0) >= 0.0:
        return 0.0
    high = 1.0
    while short(high) < 0.0:
        high *= 2.0
    low = 0.0 if high == 1.0 else 0.5 * high
    return float(optimize.root_scalar(short, bracket=(low, high), xtol=1e-4).root)
