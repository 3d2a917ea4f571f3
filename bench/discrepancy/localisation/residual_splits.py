"""Splits of the whitened residual of a free run: by channel, by degree of freedom, and of every channel by band and by time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy import stats

from bench.discrepancy.likelihood.problem import Array, Problem
from bench.discrepancy.likelihood.whitening import fast_length, whitened_spectrum
from bench.discrepancy.response.simulator import Simulator
from bench.discrepancy.search.explanation import Explanation
from bench.discrepancy.settings import LocalisationSettings
from bench.discrepancy.verdict import Split


class Excess(NamedTuple):
    """Whitened free-run residual of a channel over all records.

    Attributes:
        chi2: Sum of squares.
        count: Its expectation.
        frequency: (n_bins,) [Hz].
        power: (n_bins,) squares, two each in expectation.
        time: (n,) [s].
        signal: (n,) band-limited whitened residual, of unit variance in expectation.
        density: Independent samples of the signal per sample.
    """

    chi2: float
    count: int
    frequency: Array
    power: Array
    time: Array
    signal: Array
    density: float


def excess_of(problem: Problem, nominal: Explanation) -> dict[str, Excess]:
    """Whitened free-run residuals by channel, records one after the other."""
    parts: dict[str, list[Excess]] = {name: [] for name in problem.structure.channels}
    for data in problem.data:
        predicted: Mapping[str, Array] = nominal.predict(data.record)
        residual = np.column_stack([data.record.values[n] - predicted[n] for n in problem.structure.channels])
        if not np.isfinite(residual).all():
            continue
        white = whitened_spectrum(residual, data).reshape(2, data.n_bins, -1)
        length = fast_length(len(residual))
        for c, name in enumerate(problem.structure.channels):
            spectrum = np.zeros(length // 2 + 1, dtype=complex)
            spectrum[: data.n_bins] = white[0, :, c] + 1j * white[1, :, c]
            power = np.abs(spectrum[: data.n_bins]) ** 2
            # Parseval: of 2 n_bins unit variances the signal keeps a mean square of one
            signal = np.fft.irfft(spectrum, length)[: len(residual)] * length / (2.0 * np.sqrt(data.n_bins))
            frequency = np.arange(data.n_bins) / (length * data.record.step)
            parts[name].append(
                Excess(
                    float(power.sum()), 2 * data.n_bins, frequency, power, data.record.time, signal,
                    2.0 * data.n_bins / length,
                )
            )  # fmt: skip
    return {name: _joined(entries) for name, entries in parts.items() if entries}


def _joined(entries: list[Excess]) -> Excess:
    return Excess(
        sum(e.chi2 for e in entries),
        sum(e.count for e in entries),
        np.concatenate([e.frequency for e in entries]),
        np.concatenate([e.power for e in entries]),
        np.concatenate([e.time for e in entries]),
        np.concatenate([e.signal for e in entries]),
        float(np.mean([e.density for e in entries])),
    )


def residual_splits(simulator: Simulator, excess: dict[str, Excess]) -> list[Split]:
    """Splits of the free run's residual by channel, and of every channel's by band and by time."""
    settings = simulator.settings.localisation
    if not excess:
        return []
    dofs = {
        o.channel: simulator.structure.dofs[int(np.argmax(np.abs(o.row)))]
        for o in simulator.structure.observers
    }
    chi2 = np.array([e.chi2 for e in excess.values()])
    count = np.array([float(e.count) for e in excess.values()])
    out = [
        split(
            "channel",
            "free run",
            "",
            tuple(excess),
            chi2 - count,
            stats.chi2.sf(chi2, count),
            settings=settings,
        )
    ]
    by_dof = sorted(set(dofs.values()))
    if len(by_dof) > 1:
        own = [np.array([dofs[name] == dof for name in excess]) for dof in by_dof]
        sums = [(chi2[mask].sum(), count[mask].sum()) for mask in own]
        out.append(
            split(
                "dof", "free run", "", tuple(by_dof), np.array([a - b for a, b in sums]),
                np.array([stats.chi2.sf(a, b) for a, b in sums]),
            settings=settings)
        )  # fmt: skip
    for name, e in excess.items():
        out += _along_axes(name, dofs[name], e, settings=settings)
    return out


def _along_axes(name: str, dof: str, e: Excess, *, settings: LocalisationSettings) -> list[Split]:
    """Splits of the residual of a channel by band and by time."""
    positive = e.frequency[e.frequency > 0.0]
    bands = np.geomspace(positive.min(), e.frequency.max() * (1.0 + 1e-9), settings.residual_bands + 1)
    bands[0] = 0.0
    times = np.linspace(e.time.min(), e.time.max() + 1e-9, settings.residual_intervals + 1)
    two, dense = np.full(len(e.power), 2.0), np.full(len(e.signal), e.density)
    return [
        _histogram("band_hz", name, dof, bands, e.frequency, e.power, two, settings=settings),
        _histogram("time_s", name, dof, times, e.time, e.signal**2 * e.density, dense, settings=settings),
    ]


def _histogram(
    kind: str,
    channel: str,
    dof: str,
    edges: Array,
    axis: Array,
    squares: Array,
    expected: Array,
    *,
    settings: LocalisationSettings,
) -> Split:
    """Split squares along an axis, each cell held against the chi-squared distribution of its expectation."""
    cell = np.clip(np.digitize(axis, edges) - 1, 0, len(edges) - 2)
    power = np.bincount(cell, squares, len(edges) - 1)
    count = np.bincount(cell, expected, len(edges) - 1)
    excess = np.asarray(power - count, dtype=np.float64)
    p_values = np.where(count > 0.0, stats.chi2.sf(power, np.maximum(count, 1e-9)), 1.0)
    return split(kind, channel, dof, tuple(float(x) for x in edges), excess, p_values, settings=settings)


def split(
    kind: str,
    of: str,
    dof: str,
    cells: tuple[str, ...] | tuple[float, ...],
    excess: Array,
    p_values: Array,
    *,
    settings: LocalisationSettings,
) -> Split:
    """Make a split of excess power whose shares add up to one."""
    positive = np.maximum(np.nan_to_num(excess), 0.0)
    total = float(positive.sum())
    adjusted = stats.false_discovery_control(np.clip(p_values, 0.0, 1.0))
    return Split(
        kind=kind,
        of=of,
        dof=dof,
        cells=cells,
        shares=tuple(float(x) for x in (positive / total if total > 0.0 else positive)),
        p_values=tuple(float(x) for x in adjusted),
        significant=tuple(bool(x < settings.false_discoveries) for x in adjusted),
    )


def holding(axis: Array, excess: Array, *, settings: LocalisationSettings) -> tuple[float, float]:
    """Interval of an axis between whose ends the cumulated excess grows from 5 to 95 %."""
    order = np.argsort(axis, kind="stable")
    cumulated = np.cumsum(np.maximum(excess[order], 0.0))
    if cumulated[-1] <= 0.0:
        return float(axis.min()), float(axis.max())
    low, high = np.searchsorted(cumulated / cumulated[-1], settings.holds)
    return float(axis[order[low]]), float(axis[order[min(high, len(axis) - 1)]])
