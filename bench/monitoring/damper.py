"""A damper watched in service: learn what it dissipates, then ask after each period whether it still does.

Adaptive least squares identify ``F = C sgn(v)|v|^n`` on line (eq. 3.8), from the first sample to the last: what is told of the damper.
From the periods of the learning time comes the baseline: what a period takes is that of a sum of powers of the speed, with weights
not below zero by least squares (dry friction of the seals beside the fluid is no single power), and the logarithm of what is over

    ``y_k = log( ∮ F v dt / sum_i c_i ∮ |v|^(n_i+1) dt ) = b0 + b1 log v_k + b2 log f_k + e_k``,

regressed on the period's speed and frequency as far as these varied. The energy of a period is what the damper is there for, is
not touched by springs, offsets or backlash, and a loss of C by a share shows as the logarithm of that share. Later
periods are judged by the error of the prediction over its standard deviation, Student's t if the damper is unchanged, in
a two-sided cumulative sum. The reference is half the change sought, so that a smaller drift than that never adds up; the
threshold gives the mean run length without false alarm that is asked for. Periods of motion that was not learnt from are
told and not judged.

References:
    Tasbihgoo 2006, chapters 3.5 and 6 (monitoring on line as future work); Page 1954; Basseville and Nikiforov 1993, Detection of
    Abrupt Changes, chapters 2 and 5.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import optimize

from bench.errors import IdentificationError
from bench.identification.adaptive import AdaptiveLeastSquares
from bench.identification.regressors import damper_model
from bench.monitoring.findings import Alarm, Baseline, MonitorSettings, PeriodJudged
from bench.monitoring.periods import Period, PeriodSplitter
from bench.monitoring.run_length import alarm_threshold


@dataclass(frozen=True)
class DamperMonitorSettings:
    """Numbers of `bench.monitoring.damper`."""

    varied: float = 0.02
    """Standard deviation of log speed or log frequency over the learning below which it counts as constant: what two hundredths do to
    the force of a damper is a sixth of the change sought at most."""
    exponents: tuple[float, ...] = (0.0, 0.25, 0.5, 0.75, 1.0)
    """Powers of the speed that a damper's force is a sum of: dry friction, fluid dampers, which lie between, a linear damper."""
    beyond: float = 0.1
    """How far beyond the learnt range, in the logarithm, a period's speed and frequency may lie: an exponent that is wrong by a half makes
    less than half of the change sought there."""
    curvature: tuple[float, float] = (0.25, 1.0)
    """Largest second derivative of the log energy by log speed and by log frequency: of a sum of two forces whose exponents differ by one,
    as dry friction and a linear damper, with s and 1 - s of the energy, s (1 - s); of a spring in series with a damper, whose loss goes as
    w / (1 + w^2), 4 w^2 / (1 + w^2)^2."""


SETTINGS = DamperMonitorSettings()


class DamperMonitor:
    """Watches a damper; feed it with `take`.

    Args:
        settings: How.
        centre: Displacement about which the motion goes [m].
        sample_rate: [Hz].

    Attributes:
        baseline: What was learnt; None while learning.
        judged: Periods after the learning.
        alarms: Changes found. After one the sums begin anew from the changed level, so that a further change is found too.
    """

    def __init__(
        self,
        settings: MonitorSettings | None = None,
        *,
        centre: float = 0.0,
        sample_rate: float | None = None,
    ) -> None:
        self.settings = settings or MonitorSettings()
        self.baseline: Baseline | None = None
        self.judged: list[PeriodJudged] = []
        self.alarms: list[Alarm] = []
        self._splitter = PeriodSplitter(centre=centre)
        self._rate = sample_rate
        self._learnt: list[Period] = []
        self._estimator: AdaptiveLeastSquares | None = None
        self._scales = (1.0, 1.0)
        self._sums = np.zeros(2)
        self._level = 0.0
        self._since: list[list[float]] = [[], []]
        self._confirming: list[float] | None = None
        self._number = 0

    def take(
        self, time: ArrayLike, displacement: ArrayLike, velocity: ArrayLike, force: ArrayLike
    ) -> list[Alarm]:
        """Take the next samples.

        Args:
            time: (n,) [s].
            displacement: (n,) [m].
            velocity: (n,) [m/s].
            force: Force of the damper, positive along the velocity where it brakes (n,) [N].

        Returns:
            Alarms raised by the periods that ended in them.

        Raises:
            RecordingError: Lengths differ or a value is not finite.
            IdentificationError: The learning periods hold no damping to learn from.
        """
        channels = [np.asarray(values, dtype=float) for values in (time, displacement, velocity, force)]
        before = len(self.alarms)
        for period in self._splitter.take(*channels):
            self._number += 1
            if self.baseline is None:
                self._learnt.append(period)
                if len(self._learnt) == self.settings.learning:
                    self._learn()
            else:
                self._judge(period, self.baseline)
        return self.alarms[before:]

    def _learn(self) -> None:
        periods = self._learnt
        v_peak = max(float(np.abs(period.velocity).max()) for period in periods)
        f_peak = max(float(np.abs(period.force).max()) for period in periods)
        energies = np.array([period.energy for period in periods])
        if not np.all(energies > 0.0):
            raise IdentificationError(
                f"{int(np.sum(energies <= 0.0))} of the {len(periods)} learning periods take no energy; a damper's force is "
                "taken positive along its velocity: turn the sign of one channel"
            )
        frequency = float(np.median([period.frequency for period in periods]))
        # as in `fit_design_model_online`: floors at small parts of the peaks, channels over their peaks
        model = damper_model(velocity_floor=0.05, force_floor=0.02)
        self._estimator = AdaptiveLeastSquares(
            model,
            forgetting=frequency / self.settings.memory,
            initial_covariance=1e4 * frequency,
            window=2.0 / frequency,
            sample_rate=self._rate,
            gap=1e9,
        )
        self._scales = (v_peak, f_peak)
        thetas = np.array([self._estimate(period) for period in periods])
        exponent = float(np.median(thetas[:, 1]))
        model = np.array([period.energy_of_power(exponent) for period in periods])
        coefficient = math.exp(float(np.mean(np.log(energies / model))))
        of_terms = np.array([self._energies(period) for period in periods])
        weights, _ = optimize.nnls(of_terms / energies[:, None], np.ones(len(energies)))
        y = np.array([self._log_energy(period, weights) for period in periods])
        self.baseline = self._regressed(y, weights, coefficient, exponent)
        self._learnt = []

    def _estimate(self, period: Period) -> tuple[float, float]:
        """Running C and n after a period."""
        estimator, (v_peak, f_peak) = self._estimator, self._scales
        assert estimator is not None
        # the last sample is the first of the next period
        part = slice(None, -1)
        estimator.run(
            period.time[part], force=period.force[part] / f_peak, velocity=period.velocity[part] / v_peak
        )
        log_peak, exponent = (float(value) for value in estimator.theta)
        return math.exp(min(log_peak + math.log(f_peak) - exponent * math.log(v_peak), 700.0)), exponent

    @staticmethod
    def _energies(period: Period) -> NDArray[np.float64]:
        """What powers of the speed of weight one would take over a period ``(n_exponents,)``."""
        return np.array([period.energy_of_power(n) for n in SETTINGS.exponents])

    def _log_energy(self, period: Period, weights: NDArray[np.float64]) -> float:
        """Logarithm of the energy over that of the damper as learnt along the same motion."""
        model = float(self._energies(period) @ weights)
        return math.log(max(period.energy, 1e-6 * model) / model)

    @staticmethod
    def _motion(period: Period) -> NDArray[np.float64]:
        return np.array([1.0, math.log(period.peak_velocity), math.log(period.frequency)])

    def _regressed(
        self, y: NDArray[np.float64], weights: NDArray[np.float64], coefficient: float, exponent: float
    ) -> Baseline:
        x = np.array([self._motion(period) for period in self._learnt])
        terms = np.concatenate([[True], x[:, 1:].std(axis=0) > SETTINGS.varied])
        used = x[:, terms]
        inverse = np.asarray(np.linalg.pinv(used.T @ used), dtype=np.float64)
        b = inverse @ used.T @ y
        e = y - used @ b
        # the weights have a scale in common with the constant
        freedom = float(len(y) - used.shape[1] - max(int(np.count_nonzero(weights)) - 1, 0))
        neighbours = float(np.clip(np.sum(e[1:] * e[:-1]) / max(float(np.sum(e**2)), 1e-300), 0.0, 0.9))
        # Sums of correlated errors scatter as those of independent ones of a larger deviation.
        scatter = math.sqrt(float(np.sum(e**2)) / freedom * (1.0 + neighbours) / (1.0 - neighbours))
        # Not below rounding of the energies: a synthetic record without noise repeats itself.
        scatter = max(scatter, 1e-4)
        reference = 0.5 * abs(math.log(1.0 - self.settings.change)) / scatter
        return Baseline(
            coefficient,
            exponent,
            weights,
            b,
            terms,
            inverse,
            scatter,
            freedom,
            x[:, 1:].mean(axis=0),
            x[:, 1:].min(axis=0),
            x[:, 1:].max(axis=0),
            reference,
            alarm_threshold(reference, freedom, self.settings.run_length),
        )

    def _judge(self, period: Period, learnt: Baseline) -> None:
        coefficient, exponent = self._estimate(period)
        motion = self._motion(period)
        used = motion[learnt.terms]
        y = self._log_energy(period, learnt.weights) - float(used @ learnt.regression)
        z = math.nan
        inside = self._learnt_from(motion[1:], learnt)
        if inside:
            spread = learnt.scatter * math.sqrt(1.0 + float(used @ learnt.inverse @ used))
            z = (y - self._level) / spread
            self._add(y, z, learnt.reference)
        judged = PeriodJudged(
            self._number,
            period.end,
            period.energy,
            math.exp(y),
            z,
            float(self._sums[0]),
            float(self._sums[1]),
            inside,
            coefficient,
            exponent,
        )
        self.judged.append(judged)
        side = int(np.argmax(self._sums))
        if inside and self._sums[side] > learnt.threshold:
            since = self._since[side]
            self._level = float(np.mean(since))
            self.alarms.append(
                Alarm(period.end, self._number, self._number - len(since) + 1, math.exp(self._level))
            )
            self._sums[:] = 0.0
            self._since, self._confirming = [[], []], []

    def _learnt_from(self, motion: NDArray[np.float64], learnt: Baseline) -> bool:
        """Whether what was learnt holds for a log speed and log frequency (2,).

        It does in the learnt range, and a little beyond. The straight lines that were regressed go on as far as what may bend away from
        them takes up a quarter of the change sought, half of what is let pass as drift.
        """
        outside = (motion < learnt.low - SETTINGS.beyond) | (motion > learnt.high + SETTINGS.beyond)
        lines = learnt.terms[1:]
        bent = 0.5 * float(np.sum((SETTINGS.curvature * (motion - learnt.mean) ** 2)[lines]))
        near = bent < 0.25 * abs(math.log(1.0 - self.settings.change))
        return not bool(np.any(outside & ~lines if near else outside))

    def _add(self, y: float, z: float, reference: float) -> None:
        """Add a period to the sums, or to those that confirm the last change."""
        if self._confirming is None:
            self._sums = np.maximum(0.0, self._sums + np.array([-z, z]) - reference)
            for side in (0, 1):
                self._since[side] = [*self._since[side], y] if self._sums[side] > 0.0 else []
            return
        self._confirming.append(y)
        if len(self._confirming) == self.settings.confirm:
            self._level = float(np.mean(self._confirming))
            self.alarms[-1] = self.alarms[-1]._replace(share=math.exp(self._level))
            self._confirming = None


def monitor_record(
    time: ArrayLike,
    displacement: ArrayLike,
    velocity: ArrayLike,
    force: ArrayLike,
    settings: MonitorSettings | None = None,
    *,
    centre: float = 0.0,
) -> DamperMonitor:
    """Watch a damper over a whole record.

    Args:
        time: (n,) [s].
        displacement: (n,) [m].
        velocity: (n,) [m/s].
        force: (n,) [N].
        settings: How.
        centre: As of `DamperMonitor`.

    Returns:
        The monitor after the last sample.

    Raises:
        IdentificationError: Fewer periods than the learning needs, or no damping.
        RecordingError: Lengths differ or a value is not finite.
    """
    stamps = np.asarray(time, dtype=float)
    rate = (stamps.size - 1) / (stamps[-1] - stamps[0]) if stamps.size > 1 else None
    monitor = DamperMonitor(settings, centre=centre, sample_rate=rate)
    monitor.take(stamps, displacement, velocity, force)
    if monitor.baseline is None:
        raise IdentificationError(
            f"{monitor._number} whole periods came; the learning alone takes {monitor.settings.learning}"
        )
    return monitor
