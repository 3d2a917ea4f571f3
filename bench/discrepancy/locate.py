"""Where the gap lies: channels, frequency bands, times, and regions of the state space.

Channels, bands and times are read off the whitened residuals of the nominal model, whose power beyond one is excess.
Shares are of the total excess and add up to one. State regions are read off the force that is missing along the
measured motion: cells of displacement and of velocity in which its mean over separate visits differs from zero, the
false discovery rate being controlled over all cells.

References:
    Y. Benjamini, Y. Hochberg, Journal of the Royal Statistical Society B 57 (1995) 289-300.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import stats

from bench.discrepancy.explain import Explanation
from bench.discrepancy.problem import Array, Problem, fast_length, whitened
from bench.discrepancy.structure import Place
from bench.discrepancy.verdict import Location

CELLS = 16
"""Cells a coordinate of the state space is cut into."""
FALSE_DISCOVERIES = 0.05
WEAK = 0.1
"""Cells whose mean force is below this part of the largest one do not count towards a region."""
HOLDS = (0.05, 0.95)
"""Cumulated parts of the excess between which a band or an interval is said to hold it."""


class CellMap(NamedTuple):
    """Missing force by cells of one coordinate.

    Attributes:
        edges: (CELLS + 1,) cell edges.
        force: (CELLS,) mean missing force; NaN in cells never visited.
        p_value: (CELLS,) of a zero mean.
        significant: (CELLS,) after control of the false discovery rate.
    """

    edges: Array
    force: Array
    p_value: Array
    significant: np.ndarray


def locate(problem: Problem, nominal: Explanation, best: Explanation) -> tuple[Location, ...]:
    """Locate the residuals of the re-estimated nominal model; by decreasing share.

    Args:
        problem: Records and structure on all degrees of freedom.
        nominal: The explanation without effects.
        best: The best explanation; its nominal parameters serve for the map of the missing force.
    """
    excess: dict[str, tuple[float, Array, Array, Array, Array, float]] = {}
    names = problem.structure.channels
    for c, name in enumerate(names):
        excess[name] = _channel_excess(problem, nominal, c, name)
    total = sum(max(entry[0], 0.0) for entry in excess.values())
    if total <= 0.0:
        return ()
    regions = {
        place.name: _regions(problem, best, place)
        for place in problem.structure.places
        if len(place.rows) == 1
    }
    out = []
    for name, (power, frequency, by_frequency, time, by_time, p_value) in excess.items():
        if power <= 0.0:
            continue
        observer = next(o for o in problem.structure.observers if o.channel == name)
        touched = [
            p.name
            for p in problem.structure.places
            if len(p.rows) == 1 and np.any(p.rows[0] * observer.row != 0)
        ]
        out.append(
            Location(
                channel=name,
                dof=problem.structure.dofs[int(np.argmax(np.abs(observer.row)))],
                share=power / total,
                band_hz=_holding(frequency, by_frequency),
                time_s=_holding(time, by_time),
                state_region=regions[touched[0]] if touched else {},
                p_value=min(1.0, p_value * len(names)),
            )
        )
    return tuple(sorted(out, key=lambda location: -location.share))


def _channel_excess(problem: Problem, nominal: Explanation, c: int, name: str):
    """Excess power of a channel, by frequency and by time, and its p-value."""
    chi2 = 0.0
    count = 0
    frequencies, powers, times, local = [], [], [], []
    for data in problem.data:
        predicted = nominal.predict(data.record)
        residual = np.column_stack([data.record.values[n] - predicted[n] for n in problem.structure.channels])
        if not np.isfinite(residual).all():
            continue
        white = whitened(residual, data).reshape(2, data.n_bins, -1)[:, :, c]
        power = np.sum(white**2, axis=0)
        chi2 += float(power.sum())
        count += 2 * data.n_bins
        frequencies.append(np.arange(data.n_bins) / (fast_length(len(data.record)) * data.record.step))
        powers.append(power - 2.0)
        times.append(data.record.time)
        local.append(residual[:, c] ** 2 - problem.noise[c] ** 2)
    if not count:
        return 0.0, np.zeros(1), np.zeros(1), np.zeros(1), np.zeros(1), 1.0
    longest = int(np.argmax([len(t) for t in times]))
    return (
        chi2 - count, np.concatenate(frequencies), np.concatenate(powers), times[longest], local[longest],
        float(stats.chi2.sf(chi2, count)),
    )  # fmt: skip


def _holding(axis: Array, excess: Array) -> tuple[float, float]:
    """Interval of an axis between whose ends the cumulated excess grows from 5 to 95 %."""
    order = np.argsort(axis, kind="stable")
    cumulated = np.cumsum(np.maximum(excess[order], 0.0))
    if cumulated[-1] <= 0.0:
        return float(axis.min()), float(axis.max())
    low, high = np.searchsorted(cumulated / cumulated[-1], HOLDS)
    return float(axis[order[low]]), float(axis[order[min(high, len(axis) - 1)]])


def missing_force(problem: Problem, best: Explanation, place: Place, index: int) -> Array:
    """Force (n,) that the linear structure, at the best parameters, lacks along the measured motion of a record."""
    values = {}
    for part, fitted in best.parts:
        split, _ = part.split(fitted.hypothesis, fitted.vector)
        values.update(dict(zip(part.structure.parameters, split, strict=True)))
    vector = np.array([values[name] for name in problem.structure.parameters])
    linear = problem.structure.at(vector)
    motion = problem.motion(index)
    row = place.rows[0]
    if problem.driven:
        force = problem.data[index].responses[:, 0]
        return force - motion.position @ linear.stiffness[0] - motion.velocity @ linear.damping[0]
    loads = problem.data[index].loads @ linear.inputs.T
    rest = loads - motion.acceleration @ linear.mass.T - motion.velocity @ linear.damping.T
    rest = rest - motion.position @ linear.stiffness.T
    return rest @ row / (row @ row)


def cell_map(coordinate: Array, force: Array) -> CellMap:
    """Mean missing force in cells of one coordinate, with significance over separate visits.

    Args:
        coordinate: (n,) displacement or velocity.
        force: (n,) missing force.
    """
    reach = float(np.abs(coordinate).max()) or 1.0
    edges = np.linspace(-reach, reach, CELLS + 1)
    cell = np.clip(np.digitize(coordinate, edges) - 1, 0, CELLS - 1)
    starts = np.flatnonzero(np.diff(cell, prepend=-1))
    lengths = np.diff(np.append(starts, len(cell)))
    visits = np.add.reduceat(force, starts) / lengths
    visited = cell[starts]
    mean, p_value = np.full(CELLS, np.nan), np.ones(CELLS)
    for k in range(CELLS):
        own = visits[visited == k]
        if len(own) < 4:
            continue
        mean[k] = own.mean()
        error = own.std(ddof=1) / np.sqrt(len(own))
        p_value[k] = 2.0 * stats.t.sf(abs(mean[k]) / max(error, 1e-300), len(own) - 1)
    rejected = stats.false_discovery_control(p_value) < FALSE_DISCOVERIES
    strong = np.abs(np.nan_to_num(mean)) > WEAK * np.nanmax(np.abs(mean), initial=0.0)
    return CellMap(edges, mean, p_value, rejected & strong)


def _regions(problem: Problem, best: Explanation, place: Place) -> dict[str, tuple[float, float]]:
    force = np.concatenate([missing_force(problem, best, place, i) for i in range(len(problem.records))])
    out = {}
    for name, kind in (("displacement", "position"), ("velocity", "velocity")):
        samples = [getattr(problem.motion(i), kind) @ place.rows[0] for i in range(len(problem.records))]
        cells = cell_map(np.concatenate(samples), force)
        found = np.flatnonzero(cells.significant)
        if len(found):
            out[name] = (float(cells.edges[found[0]]), float(cells.edges[found[-1] + 1]))
    return out
