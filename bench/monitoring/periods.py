"""A record of motion and force cut into periods, sample by sample or block by block with the same result.

A period runs from one upward passage of the displacement through its centre to the next. A passage counts where the displacement
has been below the centre by a tenth of the largest excursion so far, so that noise about the centre makes no periods.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.errors import RecordingError


@dataclass(frozen=True)
class PeriodsSettings:
    """Numbers of `bench.monitoring.periods`."""

    excursion: float = 0.1
    """Part of the largest excursion so far that a period must reach below the centre: ten times noise of a hundredth."""


SETTINGS = PeriodsSettings()


class Period(NamedTuple):
    """A period of motion.

    Attributes:
        start: Time of its first sample [s].
        end: Time of its last sample, the first of the next period [s].
        time: (n,) [s].
        displacement: About the centre (n,) [m].
        velocity: (n,) [m/s].
        force: (n,) [N].
    """

    start: float
    end: float
    time: NDArray[np.float64]
    displacement: NDArray[np.float64]
    velocity: NDArray[np.float64]
    force: NDArray[np.float64]

    @property
    def energy(self) -> float:
        """What the damper took from the motion over the period, ``∮ F dx`` [J]."""
        # by velocity rather than by differences of the displacement: noise of the latter times that of the force adds up
        return float(np.trapezoid(self.force * self.velocity, self.time))

    def energy_of_power(self, exponent: float) -> float:
        """What a force ``sgn(v)|v|^exponent`` takes over the period, ``∮ |v|^(exponent + 1) dt`` [(m/s)^exponent m]."""
        return float(np.trapezoid(np.abs(self.velocity) ** (exponent + 1.0), self.time))

    @property
    def peak_velocity(self) -> float:
        """Speed of a harmonic motion of the same mean square, √2 times the rms [m/s]."""
        return float(np.sqrt(2.0 * np.mean(self.velocity**2)))

    @property
    def frequency(self) -> float:
        """Periods a second [Hz]."""
        return 1.0 / (self.end - self.start)


class PeriodSplitter:
    """Cuts blocks of samples into periods; keeps the samples of the period that has not ended.

    Args:
        centre: Displacement about which the motion goes to and fro [m].
    """

    def __init__(self, *, centre: float = 0.0) -> None:
        self.centre = centre
        self._kept = np.empty((4, 0))
        self._largest = 0.0
        self._armed = False
        self._started = False

    def take(
        self,
        time: NDArray[np.float64],
        displacement: NDArray[np.float64],
        velocity: NDArray[np.float64],
        force: NDArray[np.float64],
    ) -> list[Period]:
        """Take the next samples.

        Args:
            time: (n,) [s].
            displacement: (n,) [m].
            velocity: (n,) [m/s].
            force: (n,) [N].

        Returns:
            The periods that ended in them.

        Raises:
            RecordingError: Lengths differ or a value is not finite.
        """
        rows = [
            np.atleast_1d(np.asarray(values, dtype=float)) for values in (time, displacement, velocity, force)
        ]
        if len({row.shape for row in rows}) != 1 or rows[0].ndim != 1:
            raise RecordingError(
                f"channels of shapes {', '.join(str(row.shape) for row in rows)} came; equal rows are expected"
            )
        block = np.stack(rows)
        if not np.all(np.isfinite(block)):
            raise RecordingError("a sample is not finite; cut the gap out of the record first")
        block[1] -= self.centre
        if block.shape[1] == 0:
            return []
        if self._kept.size and block[0, 0] <= self._kept[0, -1]:
            raise RecordingError(
                f"time {block[0, 0]:g} s came after {self._kept[0, -1]:g} s; time must go on"
            )
        return self._cut(block)

    def _cut(self, block: NDArray[np.float64]) -> list[Period]:
        before = self._kept.shape[1]
        x = block[1]
        largest = np.maximum(np.maximum.accumulate(np.abs(x)), self._largest)
        below = x < -SETTINGS.excursion * largest
        last = self._kept[1, -1] if before else np.inf
        upward = np.flatnonzero((x >= 0.0) & (np.concatenate([[last], x[:-1]]) < 0.0))
        count = np.concatenate([[0], np.cumsum(below)])
        samples = np.concatenate([self._kept, block], axis=1)
        begin, since, found = 0, 0, []
        for k in upward.tolist():
            if not (self._armed or count[k] > count[since]):
                continue
            if self._started:
                t, displacement, v, f = samples[:, begin : before + k + 1]
                found.append(
                    Period(float(t[0]), float(t[-1]), t.copy(), displacement.copy(), v.copy(), f.copy())
                )
            begin, since = before + k, k
            self._armed, self._started = False, True
        self._armed |= bool(count[-1] > count[since])
        self._largest = float(largest[-1])
        # Before the first passage nothing is kept but the last sample, to see the passage.
        self._kept = samples[:, begin:] if self._started else samples[:, -1:]
        return found
