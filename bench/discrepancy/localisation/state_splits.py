"""The missing force split by displacement, velocity, travel since the last reversal, contact, frequency band and time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import stats

from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.likelihood.problem import Array
from bench.discrepancy.localisation.state_map import (
    StateMap,
    Track,
    independent,
)
from bench.discrepancy.response.simulator import Simulator
from bench.discrepancy.settings import LocalisationSettings
from bench.discrepancy.verdict import Split


def force_splits(
    simulator: Simulator, records: Sequence[CaseRecord], maps: Sequence[StateMap]
) -> tuple[Split, ...]:
    """Split the missing force of every place.

    Args:
        simulator: Records and structure.
        records: The records behind the maps.
        maps: Maps of the missing force.
    """
    out = []
    for found in maps:
        name = found.place.name or simulator.structure.dofs[0]
        out += [
            _marginal("displacement", name, found, axis=0, settings=simulator.settings.localisation),
            _marginal("velocity", name, found, axis=1, settings=simulator.settings.localisation),
            _after_reversal(name, found.track, settings=simulator.settings.localisation),
            _bands(name, found.track, records[0].step, settings=simulator.settings.localisation),
            _times(name, found, settings=simulator.settings.localisation),
        ]
        contact = _contact(name, found, settings=simulator.settings.localisation)
        if contact is not None:
            out.append(contact)
    return tuple(out)


def travel(track: Track) -> Array:
    """Distance (n,) since the velocity last changed its sign."""
    out = np.zeros(len(track.displacement))
    breaks = np.zeros(len(out), dtype=bool)
    breaks[np.cumsum((0, *track.lengths))[:-1]] = True
    turned = np.signbit(track.velocity[1:]) != np.signbit(track.velocity[:-1])
    starts = np.flatnonzero(breaks | np.concatenate([[True], turned]))
    origin = np.repeat(track.displacement[starts], np.diff(np.append(starts, len(out))))
    return np.abs(track.displacement - origin)


def in_contact(found: StateMap) -> np.ndarray | None:
    """Samples (n,) whose displacement lies in a region bounded by a displacement; None where there is no such region."""
    bounded = [r.displacement for r in found.regions if r.displacement is not None and r.velocity is None]
    if not bounded:
        return None
    x = found.track.displacement
    return np.any([(x >= low) & (x <= high) for low, high in bounded], axis=0)


def _make(
    kind: str,
    place: str,
    cells: tuple,
    power: Array,
    p_values: Array,
    significant: np.ndarray | None = None,
    *,
    settings: LocalisationSettings,
) -> Split:
    positive = np.maximum(np.nan_to_num(power), 0.0)
    total = float(positive.sum()) or 1.0
    adjusted = stats.false_discovery_control(np.clip(p_values, 0.0, 1.0))
    chosen = adjusted < settings.false_discoveries if significant is None else significant
    return Split(
        kind, "missing force", place, cells, tuple(float(x) for x in positive / total),
        tuple(float(x) for x in adjusted), tuple(bool(x) for x in chosen),
    )  # fmt: skip


def _marginal(kind: str, place: str, found: StateMap, *, axis: int, settings: LocalisationSettings) -> Split:
    """Squared mean force of the cells, summed over the other coordinate; a part is significant where one of its cells is."""
    edges = found.displacement_edges if axis == 0 else found.velocity_edges
    power = (np.nan_to_num(found.force) ** 2).sum(axis=1 - axis)
    count = np.maximum(np.isfinite(found.force).sum(axis=1 - axis), 1)
    smallest = np.minimum(found.p_value.min(axis=1 - axis) * count, 1.0)
    return _make(
        kind,
        place,
        tuple(float(x) for x in edges),
        power,
        smallest,
        np.any(found.significant, axis=1 - axis),
        settings=settings,
    )


def _after_reversal(place: str, track: Track, *, settings: LocalisationSettings) -> Split:
    """Mean square by travel since the last reversal, and whether it differs there from that of the whole record."""
    distance = travel(track)
    edges = np.linspace(0.0, float(distance.max()) * (1.0 + 1e-9) or 1.0, settings.travels + 1)
    cell = np.digitize(distance, edges) - 1
    square = track.force**2
    power = np.bincount(cell, square, settings.travels) / np.maximum(
        np.bincount(cell, minlength=settings.travels), 1
    )
    starts = np.flatnonzero(np.diff(cell, prepend=-1))
    lengths = np.diff(np.append(starts, len(cell)))
    visits, visited = np.add.reduceat(square, starts) / lengths, cell[starts]
    p_values = np.ones(settings.travels)
    for k in range(settings.travels):
        own, rest = visits[visited == k], visits[visited != k]
        if len(own) >= 4 and len(rest) >= 4 and np.ptp(visits) > 0.0:
            p_values[k] = float(stats.ttest_ind(own, rest, equal_var=False).pvalue)
    return _make(
        "after_reversal",
        place,
        tuple(float(x) for x in edges),
        power,
        np.nan_to_num(p_values, nan=1.0),
        settings=settings,
    )


def _bands(place: str, track: Track, step: float, *, settings: LocalisationSettings) -> Split:
    """Power above that of noise by frequency band, the records one after the other."""
    n = len(track.force)
    frequency = np.fft.rfftfreq(n, step)[1:]
    spectrum = np.abs(np.fft.rfft(track.force - track.force.mean())[1:]) ** 2
    noise = np.abs(np.fft.rfft(track.noise, axis=1)[:, 1:]) ** 2
    alone = noise.mean(axis=0)
    above = np.flatnonzero(np.cumsum(spectrum[::-1])[::-1] > settings.top_share * spectrum.sum())
    top = frequency[above[-1]] if len(above) else frequency[-1]
    edges = np.geomspace(max(frequency[0], 1e-3 * top), top, settings.force_bands + 1)
    edges[0] = 0.0
    cell = np.digitize(frequency, edges) - 1
    inside = (cell >= 0) & (cell < settings.force_bands)
    power = np.bincount(cell[inside], spectrum[inside], settings.force_bands)
    floor = np.bincount(cell[inside], alone[inside], settings.force_bands)
    count = np.maximum(2.0 * np.bincount(cell[inside], minlength=settings.force_bands), 2.0)
    ratio = power / np.maximum(floor, 1e-300)
    p_values = stats.f.sf(ratio, count, len(track.noise) * count)
    above_noise = np.asarray(power - floor, dtype=np.float64)
    return _make("band_hz", place, tuple(float(x) for x in edges), above_noise, p_values, settings=settings)


def _times(place: str, found: StateMap, *, settings: LocalisationSettings) -> Split:
    edges = found.times[0]
    return _make(
        "time_s", place, tuple(float(x) for x in edges), np.mean(found.power, axis=0),
        np.min(found.time_p, axis=0), np.any(found.active, axis=0),
    settings=settings)  # fmt: skip


def _contact(place: str, found: StateMap, *, settings: LocalisationSettings) -> Split | None:
    """Squared missing force in and out of the regions bounded by a displacement alone."""
    inside = in_contact(found)
    if inside is None:
        return None
    track = found.track
    groups = (inside, ~inside)
    power = np.array(
        [float(np.sum(track.force[g] ** 2 - np.mean(track.noise[:, g] ** 2, axis=0))) for g in groups]
    )
    p_values = []
    for g in groups:
        if not g.any():
            p_values.append(1.0)
            continue
        count = independent(track.noise[:, g])
        ratio = float(np.mean(track.force[g] ** 2) / max(np.mean(track.noise[:, g] ** 2), 1e-300))
        p_values.append(float(stats.f.sf(ratio, count, len(track.noise) * count)))
    return _make(
        "contact", place, ("in contact", "out of contact"), power, np.array(p_values), settings=settings
    )
