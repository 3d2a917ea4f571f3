"""How often the monitor alarms for nothing, and how soon it finds a change: counted over many runs.

Synthetic dampers are those of `bench.identification.damper_study`, which are more than the monitored model can hold (memory, seal
friction, a spring), with C and n drawn for each run, a slow drift of the force by 2 % as of temperature, and noise. Records come as
harmonic tests, as motion whose amplitude and frequency wander, and as band-limited random motion. The measured friction damper
that comes with the bench is watched while its band tension is switched between tests: its measured cycles in random order.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.data import friction_damper
from bench.errors import UnknownNameError
from bench.identification.damper_study import (
    DAMPER_STUDY_SETTINGS,
    damper_record,
)
from bench.monitoring.damper import DamperMonitor, monitor_record
from bench.monitoring.findings import MonitorSettings
from bench.monitoring.periods import PeriodSplitter


@dataclass(frozen=True)
class StudySettings:
    """Numbers of `bench.monitoring.study`."""

    rate: float = 100.0
    drift: float = 0.02
    """Amplitude of the slow drift of the force: damper fluids lose about 1 % of their force in some 10 K."""
    healthy: int = 200
    after: int = 40
    """Periods watched before and after the change, on average."""


STUDY_SETTINGS = StudySettings()
MOTIONS = ("harmonic", "wandering", "random")


class StudyRun(NamedTuple):
    """One run of the monitor.

    Attributes:
        healthy: Periods judged before the change.
        false_alarms: Alarms before the change.
        delay: Periods from the change to its alarm; infinite if it was not found.
        share: Energy share that the alarm tells; NaN without one.
        true: Energy after the change over that of the unchanged damper in the same motion [1].
        outside: Periods not judged for their motion.
    """

    healthy: int
    false_alarms: int
    delay: float
    share: float
    true: float
    outside: int


class Line(NamedTuple):
    """Runs of one kind.

    Attributes:
        name: What was watched and what changed.
        runs: Number of runs.
        periods: Healthy periods judged in all of them.
        false_alarms: Alarms in these.
        rate: False alarms per 1,000 periods.
        found: Share of the changes found within 10 periods [1].
        missed: Changes not found at all.
        delay: Median, 95th percentile and largest delay [periods].
        share: Median share told by the alarm [1].
        true: Median true share [1]; seal friction and springs keep theirs when C falls.
    """

    name: str
    runs: int
    periods: int
    false_alarms: int
    rate: float
    found: float
    missed: int
    delay: tuple[float, float, float]
    share: float
    true: float


def motion(
    kind: str, seconds: float, rng: np.random.Generator
) -> tuple[NDArray[np.float64], list[NDArray[np.float64]]]:
    """Time and displacement, velocity, acceleration of a service motion of about 0.3 Hz and 25 mm.

    Args:
        kind: One of `MOTIONS`.
        seconds: Duration [s].
        rng: Draws it.

    Raises:
        UnknownNameError: There is no such motion.
    """
    time = np.arange(round(seconds * STUDY_SETTINGS.rate)) / STUDY_SETTINGS.rate
    if kind == "harmonic":
        omega = 2.0 * math.pi * 0.3
        return time, [0.025 * omega**k * np.sin(omega * time + 0.5 * math.pi * k) for k in range(3)]
    if kind == "random":
        frequency = np.fft.rfftfreq(time.size, 1.0 / STUDY_SETTINGS.rate)
        inside = (frequency >= 0.2) & (frequency <= 0.4)
        spectrum = np.where(
            inside, rng.standard_normal(frequency.size) + 1j * rng.standard_normal(frequency.size), 0.0
        )
        channels = [np.fft.irfft(spectrum * (2j * math.pi * frequency) ** k, time.size) for k in range(3)]
        scale = 0.0125 / channels[0].std()
        return time, [scale * channel for channel in channels]
    if kind == "wandering":
        amplitude = 0.025 * np.exp(0.4 * _slow(time, rng))
        phase = 2.0 * math.pi * np.cumsum(0.3 * np.exp(0.2 * _slow(time, rng))) / STUDY_SETTINGS.rate
        x = amplitude * np.sin(phase)
        v = np.gradient(x, 1.0 / STUDY_SETTINGS.rate)
        return time, [x, v, np.gradient(v, 1.0 / STUDY_SETTINGS.rate)]
    raise UnknownNameError("motion of the monitoring study", kind, MOTIONS)


def _slow(time: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Something between -1 and 1 that wanders over a minute or so."""
    rates = rng.uniform(0.005, 0.02, 4)
    phases = rng.uniform(0.0, 2.0 * math.pi, 4)
    return np.mean([np.sin(2.0 * math.pi * r * time + p) for r, p in zip(rates, phases, strict=True)], axis=0)


def service_run(
    kind: str,
    loss: float,
    seed: int,
    *,
    noise: float = 0.01,
    gradual: float = 0.0,
    settings: MonitorSettings | None = None,
) -> StudyRun:
    """Watch one synthetic damper that loses a share of C in service.

    Args:
        kind: One of `MOTIONS`.
        loss: Share of C lost [1].
        seed: Draws damper, motion and noise.
        noise: Of force and velocity, over their peaks [1].
        gradual: Time over which the loss grows [s]; at once where 0.
        settings: Of the monitor.
    """
    rng = np.random.default_rng([seed, 33])
    chosen = settings or MonitorSettings()
    coefficient, exponent = 1e3 * rng.uniform(30.0, 90.0), rng.uniform(0.4, 1.0)
    seconds = (chosen.learning + STUDY_SETTINGS.healthy + STUDY_SETTINGS.after) / 0.3
    time, (x, v, a) = motion(kind, seconds, rng)
    change = (chosen.learning + STUDY_SETTINGS.healthy) / 0.3
    draws = rng.integers(2**32)
    records = [
        damper_record(
            time, x, v, a, rng=np.random.default_rng(draws), noise=noise,
            C=share * coefficient, n=exponent, series_stiffness=DAMPER_STUDY_SETTINGS.series_stiffness * coefficient,
        )
        for share in (1.0, 1.0 - loss)
    ]  # fmt: skip
    weight = np.clip((time - change) / gradual, 0.0, 1.0) if gradual > 0.0 else (time >= change).astype(float)
    drift = 1.0 + STUDY_SETTINGS.drift * np.sin(
        2.0 * math.pi * time / 300.0 + rng.uniform(0.0, 2.0 * math.pi)
    )
    force = drift * ((1.0 - weight) * records[0].force + weight * records[1].force)
    late = time > change + gradual
    energies = [float(np.sum(record.force[late] * v[late])) for record in records]
    monitor = monitor_record(time, x, records[0].velocity, force, settings)
    return _counted(monitor, change, energies[1] / energies[0])


def _counted(monitor: DamperMonitor, change: float, true_share: float) -> StudyRun:
    healthy = [period for period in monitor.judged if period.end <= change]
    false = [alarm for alarm in monitor.alarms if alarm.time <= change]
    true = [alarm for alarm in monitor.alarms if alarm.time > change]
    if not true:
        delay, share = math.inf, math.nan
    else:
        delay = float(true[0].number - (healthy[-1].number if healthy else 0))
        share = true[0].share
    outside = sum(not period.inside for period in monitor.judged)
    return StudyRun(sum(period.inside for period in healthy), len(false), delay, share, true_share, outside)


def line(name: str, run: Callable[[int], StudyRun], seeds: Sequence[int]) -> Line:
    """Count runs of one kind over seeds.

    Args:
        name: What it is.
        run: Makes the run of a seed.
        seeds: The seeds.
    """
    made = [run(seed) for seed in seeds]
    periods, false = sum(r.healthy for r in made), sum(r.false_alarms for r in made)
    delays = np.array([r.delay for r in made])
    found = delays[np.isfinite(delays)]
    spread = (math.nan, math.nan, math.nan)
    if found.size:
        spread = (float(np.median(found)), float(np.percentile(found, 95.0)), float(found.max()))
    return Line(
        name,
        len(made),
        periods,
        false,
        1000.0 * false / periods,
        float(np.mean(delays <= 10.0)),
        int(np.sum(~np.isfinite(delays))),
        spread,
        float(np.nanmedian([r.share for r in made])) if found.size else math.nan,
        float(np.median([r.true for r in made])),
    )


def measured_cycles(tension: int) -> list[NDArray[np.float64]]:
    """Steady cycles of the measured friction damper at a band tension, displacement, velocity, force in SI units (3, n) each.

    Args:
        tension: Band tension of a shipped test [lbf].
    """
    cycles = []
    for frequency in ("0.5", "1"):
        record = friction_damper(f"{frequency}Hz_{tension}lb").to_si()
        x = record["displacement"]
        splitter = PeriodSplitter(centre=float(np.mean([x.min(), x.max()])))
        v = np.gradient(x, 1.0 / record.sample_rate)
        found = splitter.take(record.time, x, v, record["force"])
        stroke = max(float(np.ptp(period.displacement)) for period in found)
        # the first cycles grow to the amplitude of the test, the last is smaller
        cycles += [
            np.stack([period.displacement, period.velocity, period.force])[:, :-1]
            for period in found
            if float(np.ptp(period.displacement)) > 0.97 * stroke
        ]
    return cycles


def switched_run(before: int, after: int, seed: int, settings: MonitorSettings | None = None) -> StudyRun:
    """Watch the measured friction damper while its band tension is switched.

    Args:
        before: Band tension that is learnt [lbf].
        after: Band tension after the change [lbf].
        seed: Draws the order of the measured cycles.
        settings: Of the monitor.
    """
    rng = np.random.default_rng([seed, 34])
    chosen = settings or MonitorSettings()
    parts, ends, energies = [], 0, []
    for tension, count in ((before, chosen.learning + STUDY_SETTINGS.healthy), (after, STUDY_SETTINGS.after)):
        cycles = measured_cycles(tension)
        energies.append(np.mean([np.sum(v * force) for _, v, force in cycles]))
        parts += [cycles[i] for i in rng.integers(len(cycles), size=count)]
        ends = ends or sum(part.shape[1] for part in parts)
    x, v, force = np.concatenate(parts, axis=1)
    # the cycles of both frequencies were sampled at 1024 Hz
    monitor = monitor_record(np.arange(x.size) / 1024.0, x, v, force, settings)
    return _counted(monitor, ends / 1024.0, float(energies[1] / energies[0]))
