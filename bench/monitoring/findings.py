"""What a monitor is set to, what it learnt, and what it says of a period."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.errors import ParameterError


@dataclass(frozen=True)
class MonitorSettings:
    """How a damper is watched.

    Attributes:
        learning: Periods from which the baseline is learnt. With 30 the threshold is within a tenth of that of a known scatter.
        change: Smallest change of a period's energy to be found, as a share of it. 0.12 is what the loss of a fifth of C makes where two
            fifths of the energy are the seals' friction, which is not lost with it; half of it is more than what fluids drift.
        run_length: Mean number of periods between false alarms. Twice the thousand that is asked of a monitor, since the
            scatter of neighbouring periods is not quite independent.
        memory: Periods that the running estimate of C and n remembers.
        confirm: Periods after an alarm that give the changed level, from which further changes are told; five bring its error to
            half of a single period's.
    """

    learning: int = 30
    change: float = 0.12
    run_length: float = 2000.0
    memory: float = 10.0
    confirm: int = 5

    def __post_init__(self) -> None:
        if self.learning < 10:
            raise ParameterError(
                f"learning = {self.learning} periods came; at least 10 are expected, to know their scatter"
            )
        if not 0.0 < self.change < 1.0:
            raise ParameterError(f"change = {self.change:g} came; a share between 0 and 1 is expected")
        if not (self.run_length > 2.0 and self.memory > 0.0 and self.confirm >= 1):
            raise ParameterError(
                f"run_length = {self.run_length:g}, memory = {self.memory:g} and confirm = {self.confirm} came; more than 2, more "
                "than 0 and at least 1 period are expected"
            )


class Baseline(NamedTuple):
    """What was learnt.

    Attributes:
        coefficient: C [N (s/m)^n].
        exponent: n [1].
        weights: Of the powers of the speed (n_exponents,) [N (s/m)^exponent].
        regression: b of the terms in use (p,).
        terms: Which of 1, log speed, log frequency these are.
        inverse: Inverse of the normal matrix (p, p).
        scatter: Standard deviation of e, correlation of neighbours counted in [1].
        freedom: Degrees of freedom of it.
        mean: Mean log speed and log frequency learnt from (2,).
        low: Least log speed and log frequency learnt from (2,).
        high: Largest (2,).
        reference: Of the cumulative sum [standard deviations].
        threshold: Of the cumulative sum [standard deviations].
    """

    coefficient: float
    exponent: float
    weights: NDArray[np.float64]
    regression: NDArray[np.float64]
    terms: NDArray[np.bool_]
    inverse: NDArray[np.float64]
    scatter: float
    freedom: float
    mean: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    reference: float
    threshold: float


class PeriodJudged(NamedTuple):
    """A period after the learning.

    Attributes:
        number: Count from the first period of the record.
        end: When it ended [s].
        energy: Energy taken [J].
        share: Energy over that of the damper as learnt [1].
        z: The same as logarithm, over its standard deviation; NaN where it was not judged.
        fallen: Cumulative sum of the falling side [standard deviations].
        risen: Of the rising side.
        inside: Whether its motion lies in what was learnt from; otherwise it is not judged.
        coefficient: Running estimate of C [N (s/m)^n].
        exponent: Of n.
    """

    number: int
    end: float
    energy: float
    share: float
    z: float
    fallen: float
    risen: float
    inside: bool
    coefficient: float
    exponent: float


class Alarm(NamedTuple):
    """A change.

    Attributes:
        time: When it was found [s].
        number: Period in which it was found.
        since: Period from which on it holds, the last at which the sum was zero, plus one.
        share: Energy since then over that of the damper as learnt, from the periods that confirm it once they are over [1].
    """

    time: float
    number: int
    since: int
    share: float
