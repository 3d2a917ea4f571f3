"""Maps of the missing force: in which part of the state space, at what times, and how sure that is.

The plane of displacement and velocity of a place is cut into cells. The mean missing force of a cell is held against its
standard error over separate visits, moderated by the error that noise alone leaves in that very cell, and the false
discovery rate is controlled over the cells of all places. Regions are sets of touching cells with a force of one sign.

A wrong nominal stiffness also leaves a force, a weak one, all over the plane (`freed_parameters`).

References:
    Y. Benjamini, Y. Hochberg, Journal of the Royal Statistical Society B 57 (1995) 289-300.
    G. K. Smyth, Statistical Applications in Genetics and Molecular Biology 3 (2004), article 3 (moderated t-statistic).
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.likelihood.problem import Array
from bench.discrepancy.localisation.force_smoother import observers
from bench.discrepancy.localisation.freed_parameters import FreedParameters, freed
from bench.discrepancy.localisation.regions import Region, joined, regions_of
from bench.discrepancy.model.structure import Place
from bench.discrepancy.response.simulator import Simulator
from bench.discrepancy.settings import LocalisationSettings

CELLS = 12
"""Cells a coordinate of the state space is cut into; even, so that zero is an edge."""


class Track(NamedTuple):
    """Missing force at one place along all records, one after the other.

    Attributes:
        displacement: (n,).
        velocity: (n,).
        force: (n,).
        noise: (PASSES, n) what noise alone leaves.
        doubt: (n_doubts, n) changes of the force, one standard deviation each, that nominal parameters may still make.
        lengths: Number of samples of every record.
    """

    displacement: Array
    velocity: Array
    force: Array
    noise: Array
    doubt: Array
    lengths: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class StateMap:
    """Missing force at a place, over the plane of its states and over time.

    Attributes:
        place: The place.
        displacement_edges: (CELLS + 1,).
        velocity_edges: (CELLS + 1,).
        force: (CELLS, CELLS) mean missing force, displacement first; NaN where the motion did not come twice.
        error: (CELLS, CELLS) its standard error.
        p_value: (CELLS, CELLS) of a zero mean.
        significant: (CELLS, CELLS) after control of the false discovery rate over all places, weak cells left out.
        regions: Sets of touching significant cells, by decreasing share.
        times: For every record (TIMES + 1,) edges [s].
        power: For every record (TIMES,) mean square of the missing force above that of noise.
        time_p: For every record (TIMES,) p-values of no missing force, after correction.
        active: For every record (TIMES,) intervals with a significant and not weak missing force.
        track: The missing force along the records, behind the map.
    """

    place: Place
    displacement_edges: Array
    velocity_edges: Array
    force: Array
    error: Array
    p_value: Array
    significant: np.ndarray
    regions: tuple[Region, ...]
    times: tuple[Array, ...]
    power: tuple[Array, ...]
    time_p: tuple[Array, ...]
    active: tuple[np.ndarray, ...]
    track: Track

    @property
    def share(self) -> Array:
        """Part of the squared missing force in each cell (CELLS, CELLS); the parts of the visited cells add up to one."""
        square = np.nan_to_num(self.force) ** 2
        return square / (square.sum() or 1.0)


def tracks(
    simulator: Simulator,
    records: Sequence[CaseRecord],
    *,
    known: dict[str, float] | None = None,
) -> list[tuple[Place, Track]]:
    """Missing force along records at every place with one coordinate.

    Args:
        simulator: Records and priors.
        records: Records to look at.
        known: Values of nominal parameters, where they are known better than the case states; None leaves them to the
            robust regression.
    """
    out = []
    for observer in observers(simulator):
        fitted = FreedParameters(
            observer.nominal(known), np.zeros((0, sum(len(r) for r in records), len(observer.places)))
        )
        if known is None:
            fitted = freed(observer, records, fitted.values)
        estimates = [
            observer.estimate(r, fitted.values, noise=simulator.settings.localisation.passes) for r in records
        ]
        force = np.concatenate([e.force for e in estimates])
        noise = np.concatenate([e.noise for e in estimates], axis=1)
        for j, place in enumerate(observer.places):
            row = place.rows[0]
            track = Track(
                np.concatenate([e.position for e in estimates]) @ row,
                np.concatenate([e.velocity for e in estimates]) @ row,
                force[:, j],
                noise[:, :, j],
                fitted.doubt[:, :, j],
                tuple(len(r) for r in records),
            )
            full = next(p for p in simulator.structure.places if p.name == place.name)
            out.append((full, track))
    return out


def state_maps(
    simulator: Simulator,
    records: Sequence[CaseRecord],
    *,
    known: dict[str, float] | None = None,
) -> tuple[StateMap, ...]:
    """Map the missing force at every place with one coordinate; the arguments are those of `tracks`."""
    settings = simulator.settings.localisation
    found = tracks(simulator, records, known=known)
    cells = [_cells(track, settings=simulator.settings.localisation) for _, track in found]
    intervals = [_intervals(track, settings=simulator.settings.localisation) for _, track in found]
    p_values = np.concatenate([c[3][np.isfinite(c[1])] for c in cells]) if cells else np.zeros(0)
    time_p = np.concatenate([p for _, p in intervals]) if intervals else np.zeros(0)
    adjusted, time_adjusted = _adjusted(p_values), _adjusted(time_p)
    out, at, time_at = [], 0, 0
    unit_size = _largest_by_unit(found, cells)
    for (place, track), (edges, mean, error, p_value), (power, p) in zip(
        found, cells, intervals, strict=True
    ):
        visited = np.isfinite(mean)
        corrected = np.ones_like(p_value)
        corrected[visited] = adjusted[at : at + visited.sum()]
        at += int(visited.sum())
        largest = unit_size[place.force_unit]
        strong = np.abs(np.nan_to_num(mean)) > settings.weak * largest
        significant = joined((corrected < settings.false_discoveries) & strong, mean)
        own_p = time_adjusted[time_at : time_at + len(p)]
        in_time = own_p < settings.false_discoveries
        time_at += len(p)
        in_time &= power > settings.weak**2 * power.max(initial=0.0)
        out.append(
            StateMap(
                place, *edges, mean, error, p_value, significant, regions_of(edges, mean, corrected, significant, settings=settings),
                tuple(
                    r.start + r.step * np.linspace(0, len(r), settings.intervals + 1) for r in records
                ),
                tuple(np.split(np.maximum(power, 0.0), len(records))),
                tuple(np.split(own_p, len(records))),
                tuple(np.split(in_time, len(records))),
                track,
            )
        )  # fmt: skip
    return tuple(out)


def _adjusted(p_values: Array) -> Array:
    return stats.false_discovery_control(p_values) if len(p_values) else p_values


def _largest_by_unit(found, cells) -> dict[str, float]:
    """Largest mean force among the places whose forces have the same unit: a trace of it elsewhere is no region."""
    out: dict[str, float] = {}
    for (place, _), (_, mean, _, _) in zip(found, cells, strict=True):
        largest = float(np.nanmax(np.abs(mean), initial=0.0))
        out[place.force_unit] = max(out.get(place.force_unit, 0.0), largest)
    return out


def cell_index(displacement: Array, velocity: Array, edges: tuple[Array, Array]) -> np.ndarray:
    """Number of the cell (n,) of each state, displacement first."""
    columns = np.clip(np.digitize(displacement, edges[0]) - 1, 0, CELLS - 1)
    rows = np.clip(np.digitize(velocity, edges[1]) - 1, 0, CELLS - 1)
    return columns * CELLS + rows


def _edges(states: Array) -> Array:
    """(CELLS + 1,) about zero, as far as the states reach."""
    reach = float(np.abs(states).max()) * (1.0 + 1e-9) or 1.0
    return np.linspace(-reach, reach, CELLS + 1)


def _cells(
    track: Track, *, settings: LocalisationSettings
) -> tuple[tuple[Array, Array], Array, Array, Array]:
    """Edges, and (CELLS, CELLS) mean force, standard error and p-value."""
    edges = (_edges(track.displacement), _edges(track.velocity))
    cell = cell_index(track.displacement, track.velocity, edges)
    breaks = np.zeros(len(cell), dtype=bool)
    breaks[np.cumsum((0, *track.lengths))[:-1]] = True
    starts = np.flatnonzero(breaks | (np.diff(cell, prepend=-1) != 0))
    counts = np.diff(np.append(starts, len(cell)))
    visited = cell[starts]
    sums = np.add.reduceat(track.force, starts)
    noises = np.add.reduceat(track.noise, starts, axis=1)
    n_cells = CELLS * CELLS
    visits = np.bincount(visited, minlength=n_cells)
    samples = np.bincount(visited, counts, n_cells)
    with np.errstate(invalid="ignore", divide="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # cells without neighbours have no slope
        mean = np.bincount(visited, sums, n_cells) / samples
        trend = _trend(track, mean, samples, (starts, counts, visited), edges)
        scatter = np.bincount(visited, (sums - counts * (mean[visited] + trend)) ** 2, n_cells) / samples**2
        scatter *= visits / np.maximum(visits - 1, 1)
        alone = np.mean([np.bincount(visited, row**2, n_cells) for row in noises], axis=0) / samples**2
        own = np.maximum(visits - 1, 0)
        variance = (settings.passes * alone + own * scatter) / (settings.passes + own)
        for row in track.doubt:
            variance += (np.bincount(cell, row, n_cells) / samples) ** 2
        variance += (
            settings.map_floor
            * np.nanmax(np.abs(np.where(visits >= settings.visits, mean, 0.0)), initial=0.0)
        ) ** 2
        p_value = 2.0 * stats.t.sf(np.abs(mean) / np.sqrt(variance), settings.passes + own)
    few = visits < settings.visits
    mean[few], p_value[few] = np.nan, 1.0
    shape = (CELLS, CELLS)
    return edges, mean.reshape(shape), np.sqrt(variance).reshape(shape), p_value.reshape(shape)


def _trend(
    track: Track,
    mean: Array,
    samples: NDArray[np.number],
    visits: tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]],
    edges: tuple[Array, Array],
) -> Array:
    """What each visit's force is expected to be off the mean of its cell, by the slopes between neighbouring cells.

    A visit that crosses a corner of its cell has another force than one through its middle: that is no error of the map.
    """
    starts, counts, visited = visits
    grid = np.where(samples > 0, mean, np.nan).reshape(CELLS, CELLS)
    out = np.zeros(len(starts))
    for axis, state in enumerate((track.displacement, track.velocity)):
        width = edges[axis][1] - edges[axis][0]
        padded = np.pad(grid, [(1, 1) if k == axis else (0, 0) for k in (0, 1)], constant_values=np.nan)
        rises = np.diff(padded, axis=axis)
        low, high = (np.take(rises, range(k, CELLS + k), axis=axis) for k in (0, 1))
        slope = np.nan_to_num(np.nanmean([low, high], axis=0)) / width
        centre = np.bincount(visited, np.add.reduceat(state, starts), CELLS * CELLS) / np.maximum(samples, 1)
        own = np.add.reduceat(state, starts) / counts
        out += slope.ravel()[visited] * (own - centre[visited])
    return out


def _intervals(track: Track, *, settings: LocalisationSettings) -> tuple[Array, Array]:
    """Power above that of noise, and p-value, in `intervals` intervals of every record, one after the other."""
    powers, p_values = [], []
    at = 0
    for length in track.lengths:
        for part in np.array_split(np.arange(at, at + length), settings.intervals):
            own = float(np.mean(track.force[part] ** 2))
            noise = track.noise[:, part]
            alone = float(np.mean(noise**2)) + float(np.sum(np.mean(track.doubt[:, part] ** 2, axis=1)))
            # the smoothed noise is coloured: degrees of freedom from the sum of its squared autocorrelation
            count = independent(noise)
            ratio = own / max(alone, 1e-300)
            powers.append(own - alone)
            p_values.append(float(stats.f.sf(ratio, count, settings.passes * count)))
        at += length
    return np.array(powers), np.array(p_values)


def independent(noise: Array) -> float:
    """Number of independent samples among those of coloured noise (n_passes, n), as far as its power goes."""
    n = noise.shape[1]
    spectrum = np.mean(np.abs(np.fft.rfft(noise, 2 * n, axis=1)) ** 2, axis=0)
    correlation = np.fft.irfft(spectrum)[:n]
    if correlation[0] <= 0.0:
        return float(n)
    total = 1.0 + 2.0 * np.sum((correlation[1:] / correlation[0]) ** 2)
    return max(2.0, n / total)
