"""Where the gap lies: channels, degrees of freedom, frequency bands, times, and regions of the state space.

Two residuals are split. That of the free run of the nominal model, its parameters re-estimated, is whitened; what its
power has beyond one is excess, and is split by channel, by frequency band and by time. That of the equations is the force
missing along the measured motion (`force_smoother`); it is split by displacement, velocity, travel since the last reversal, in
and out of contact, band and time (`state_map`). Shares of a split add up to one, and in each the false discovery rate is
controlled. Channels that contradict one another whatever the force (`parity_relations`) make it a fault of a sensor.

No split knows which effect is named later. The regions are those of the force map, unless an effect that the records bear out
acts in a part of the state space only: its law then tells them better than any map (`law_regions`). So does a free force, where the
effect is unknown and the records tell that it has limits (`bounded_force`).

References:
    Y. Benjamini, Y. Hochberg, Journal of the Royal Statistical Society B 57 (1995) 289-300.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy import stats

from bench.discrepancy.fitting.goodness_of_fit import near
from bench.discrepancy.likelihood.problem import Array, Problem
from bench.discrepancy.likelihood.whitening import fast_length, whitened_spectrum
from bench.discrepancy.localisation.bounded_force import limited_regions
from bench.discrepancy.localisation.law_regions import acting_regions
from bench.discrepancy.localisation.parity_relations import Contradiction, contradictions
from bench.discrepancy.localisation.state_map import (
    Region,
    StateMap,
    state_maps,
)
from bench.discrepancy.localisation.state_splits import force_splits
from bench.discrepancy.search.explanation import Explanation
from bench.discrepancy.settings import LocalisationSettings
from bench.discrepancy.verdict import Location, Split

STATES = ("displacement", "velocity")
"""Coordinates of a region of the state space."""


class Whereabouts(NamedTuple):
    """Where the gap lies.

    Attributes:
        locations: Channels with an excess, by decreasing share.
        splits: Shares by channel, band, time and state.
        maps: Missing force over the state space, for every place with one coordinate.
        contradictions: Pairs of channels held against each other.
        acting: Regions of the named effects that act in a part of the state space only, or of an unknown one that does, by place;
            see `acting_regions` and `limited_regions`.
    """

    locations: tuple[Location, ...]
    splits: tuple[Split, ...]
    maps: tuple[StateMap, ...]
    contradictions: tuple[Contradiction, ...]
    acting: Mapping[str, tuple[dict[str, Any], ...]]


class _Excess(NamedTuple):
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


def locate(
    problem: Problem,
    nominal: Explanation,
    best: Explanation,
    *,
    borne_out: bool,
    unknown: bool,
) -> Whereabouts:
    """Locate the residuals of the nominal model.

    Args:
        problem: Records and structure on all degrees of freedom.
        nominal: The explanation without effects, its parameters re-estimated.
        best: The best explanation; where it is down to the noise its nominal parameters serve for the force map.
        borne_out: Whether the records bear out the forces of `best`, so that these tell where they act.
        unknown: Whether the gap is due to something unknown.
    """
    names = problem.structure.channels
    excess = _excess(problem, nominal)
    found = contradictions(problem)
    known = known_parameters(best)
    maps = state_maps(problem, problem.records, known=known)
    acting: Mapping[str, tuple[dict[str, Any], ...]] = {}
    if borne_out and best.noise_stated and all(near(fitted) for _, fitted in best.parts):
        acting = acting_regions(best)
    if unknown and not acting:
        acting = limited_regions(nominal, best)
    total = sum(max(e.chi2 - e.count, 0.0) for e in excess.values())
    p_values = [float(stats.chi2.sf(e.chi2, e.count)) for e in excess.values()]
    adjusted = dict(zip(excess, stats.false_discovery_control(p_values), strict=True)) if excess else {}
    locations = []
    for name, own in excess.items():
        share = max(own.chi2 - own.count, 0.0) / total if total > 0.0 else 0.0
        if share <= 0.0:
            continue
        observer = problem.structure.observers[names.index(name)]
        touched = [m for m in maps if np.any(m.place.rows[0] * observer.row != 0)]
        kind = _kind(name, found)
        regions = _regions_at(() if kind == "sensor" else touched, touched, acting)
        locations.append(
            Location(
                channel=name,
                dof=problem.structure.dofs[int(np.argmax(np.abs(observer.row)))],
                share=share,
                band_hz=_holding(own.frequency, own.power - 2.0, settings=problem.settings.localisation),
                time_s=_holding(own.time, own.signal**2 - 1.0, settings=problem.settings.localisation),
                state_region={k: v for k, v in regions[0].items() if k in STATES} if regions else {},
                p_value=float(adjusted[name]),
                kind=kind,
                regions=regions,
            )
        )
    return Whereabouts(
        tuple(sorted(locations, key=lambda location: -location.share)),
        (*_residual_splits(problem, excess), *force_splits(problem, problem.records, maps)),
        maps,
        found,
        acting,
    )


def _regions_at(
    trusted: Sequence[StateMap], touched: Sequence[StateMap], acting: Mapping[str, tuple[dict[str, Any], ...]]
) -> tuple[dict[str, Any], ...]:
    """Regions at the places of the maps that a channel touches: of the effects that are limited to a region, or else of the
    trusted maps; what a faulty sensor tells of a force is not."""
    limited = tuple(region for m in touched for region in acting.get(m.place.name, ()))
    return limited or tuple(
        {**box(r), "share": r.share, "force": r.force} for m in trusted for r in m.regions
    )


def box(region: Region) -> dict[str, tuple[float, float]]:
    """The limits of a region by coordinate; a coordinate that it does not depend on is left out."""
    limits = {"displacement": region.displacement, "velocity": region.velocity}
    return {name: limit for name, limit in limits.items() if limit is not None}


def known_parameters(best: Explanation) -> dict[str, float] | None:
    """Nominal parameters as the best explanation has them; None where it does not reach the noise and so proves nothing."""
    if not best.consistent or not best.noise_stated:
        return None
    out: dict[str, float] = {}
    for part, fitted in best.parts:
        values = part.nominal + part.spread * fitted.vector[: len(part.nominal)]
        out.update(dict(zip(part.structure.parameters, values, strict=True)))
    return out


def _kind(channel: str, found: tuple[Contradiction, ...]) -> str:
    own = [c for c in found if channel in c.channels]
    if not own:
        return "undetermined"
    if any(c.found and c.suspect in {"", channel} for c in own):
        return "sensor"
    return "force"


def _excess(problem: Problem, nominal: Explanation) -> dict[str, _Excess]:
    """Whitened free-run residuals by channel, records one after the other."""
    parts: dict[str, list[_Excess]] = {name: [] for name in problem.structure.channels}
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
                _Excess(
                    float(power.sum()), 2 * data.n_bins, frequency, power, data.record.time, signal,
                    2.0 * data.n_bins / length,
                )
            )  # fmt: skip
    return {name: _joined(entries) for name, entries in parts.items() if entries}


def _joined(entries: list[_Excess]) -> _Excess:
    return _Excess(
        sum(e.chi2 for e in entries),
        sum(e.count for e in entries),
        np.concatenate([e.frequency for e in entries]),
        np.concatenate([e.power for e in entries]),
        np.concatenate([e.time for e in entries]),
        np.concatenate([e.signal for e in entries]),
        float(np.mean([e.density for e in entries])),
    )


def left_by(problem: Problem, explanation: Explanation) -> dict[str, Any] | None:
    """Channel, band and interval that hold most of what an explanation leaves beyond noise; None where it leaves no more.

    Args:
        problem: Records and structure on all degrees of freedom.
        explanation: An explanation.
    """
    found = _excess(problem, explanation)
    beyond = {name: e.chi2 - e.count for name, e in found.items()}
    if not beyond or max(beyond.values()) <= 0.0:
        return None
    name = max(beyond, key=lambda n: beyond[n])
    own = found[name]
    return {
        "channel": name,
        "band_hz": _holding(own.frequency, own.power - 2.0, settings=problem.settings.localisation),
        "time_s": _holding(own.time, own.signal**2 - 1.0, settings=problem.settings.localisation),
    }


def _residual_splits(problem: Problem, excess: dict[str, _Excess]) -> list[Split]:
    """Splits of the free run's residual by channel, and of every channel's by band and by time."""
    settings = problem.settings.localisation
    if not excess:
        return []
    dofs = {
        o.channel: problem.structure.dofs[int(np.argmax(np.abs(o.row)))] for o in problem.structure.observers
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
            settings=problem.settings.localisation,
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
            settings=problem.settings.localisation)
        )  # fmt: skip
    for name, e in excess.items():
        positive = e.frequency[e.frequency > 0.0]
        edges = np.geomspace(positive.min(), e.frequency.max() * (1.0 + 1e-9), settings.residual_bands + 1)
        edges[0] = 0.0
        out.append(
            _histogram(
                "band_hz",
                name,
                dofs[name],
                edges,
                e.frequency,
                e.power,
                np.full(len(e.power), 2.0),
                settings=problem.settings.localisation,
            )
        )
        edges = np.linspace(e.time.min(), e.time.max() + 1e-9, settings.residual_intervals + 1)
        expected = np.full(len(e.signal), e.density)
        out.append(
            _histogram(
                "time_s",
                name,
                dofs[name],
                edges,
                e.time,
                e.signal**2 * e.density,
                expected,
                settings=problem.settings.localisation,
            )
        )
    return out


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


def _holding(axis: Array, excess: Array, *, settings: LocalisationSettings) -> tuple[float, float]:
    """Interval of an axis between whose ends the cumulated excess grows from 5 to 95 %."""
    order = np.argsort(axis, kind="stable")
    cumulated = np.cumsum(np.maximum(excess[order], 0.0))
    if cumulated[-1] <= 0.0:
        return float(axis.min()), float(axis.max())
    low, high = np.searchsorted(cumulated / cumulated[-1], settings.holds)
    return float(axis[order[low]]), float(axis[order[min(high, len(axis) - 1)]])
