"""Loads that read nothing but their noise.

A load cell of an axis that nobody drives still has noise. A free run driven by that moves, the real axis does not, and any friction
that holds it still would fit better than the truth: such a load is zero, and known to be.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.settings import DEFAULT, CaseSettings


def without_idle_noise(case: Case, *, settings: CaseSettings = DEFAULT.case) -> Case:
    """Return a case whose measured loads are zero in those records where they read nothing but their stated noise."""
    noise = {c.name: c.noise_std or 0.0 for c in case.channels if c.role == "measured"}

    def quiet(record: CaseRecord) -> CaseRecord:
        silent = {
            name: np.zeros_like(record.values[name])
            for name, level in noise.items()
            if level > 0.0 and name in record.values and idle(record.values[name], level, settings=settings)
        }
        return replace(record, values={**record.values, **silent}) if silent else record

    return replace(
        case,
        identification=tuple(quiet(record) for record in case.identification),
        validation=tuple(quiet(record) for record in case.validation),
    )


def idle_notes(case: Case, quiet: Case) -> tuple[str, ...]:
    """What `without_idle_noise` made of a case, in words."""
    silent: dict[str, list[str]] = {}
    before, after = ((*c.identification, *c.validation) for c in (case, quiet))
    for record, without in zip(before, after, strict=True):
        for name, samples in record.values.items():
            if np.any(samples) and not np.any(without.values[name]):
                silent.setdefault(name, []).append(f"'{record.name}'")
    return tuple(
        f"'{name}' reads nothing but its stated noise in {', '.join(records)}: it counts as zero there"
        for name, records in silent.items()
    )


def idle(samples: NDArray[np.float64], noise: float, *, settings: CaseSettings = DEFAULT.case) -> bool:
    """Whether samples (n,) are white noise of a standard deviation at most that stated, in every band of frequencies."""
    power = np.abs(np.fft.rfft(samples)[1:-1]) ** 2 / (0.5 * len(samples) * noise**2)
    if len(power) < settings.idle_bins or abs(np.mean(samples)) > noise:
        return False
    bands = (
        power[: len(power) // settings.idle_bins * settings.idle_bins]
        .reshape(-1, settings.idle_bins)
        .sum(axis=1)
    )
    return bool(bands.max() < chi2.isf(settings.idle_surprise / len(bands), 2 * settings.idle_bins))
