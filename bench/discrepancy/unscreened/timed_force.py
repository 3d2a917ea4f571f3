"""A force from outside in windows of time, found in the force that the records lack.

No grid can hold windows: they are read off the missing force along the measured motion (`time_windows`), and the effect that has
them, with one force for all and a common shift to be fitted, competes with those of the catalogue. Each window costs the
logarithm of what could have been chosen instead, so that a force of the motion, whose windows would be many, stays one of the motion.

When the windows are open is a property of a record, not of the rig: those of the validation records are read off these, as initial
states are. Their force is not; it is what the records for identification say.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from bench.discrepancy.effects.effect import (
    EFFECT_SETTINGS,
    Effect,
    FreeParameter,
    Scales,
    Values,
)
from bench.discrepancy.effects.read_off import FORCE, TIMED
from bench.discrepancy.fitting.fits import Search, converge
from bench.discrepancy.fitting.goodness_of_fit import consistent, key_of
from bench.discrepancy.fitting.map_fit import Fit
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.model.structure import Place
from bench.discrepancy.numerics.threads import in_threads
from bench.discrepancy.response.simulator import Simulator
from bench.discrepancy.settings import SearchSettings
from bench.discrepancy.unscreened.missing_force import missing_force
from bench.discrepancy.unscreened.time_windows import (
    TimeWindows,
    follows_motion,
    windows_of,
)
from bench.laws.timed_force import MAX_WINDOWS, timed_force_law

SHIFT = FreeParameter("shift", "step", signed=True, std=1.0, bounds=(-20.0, 20.0), unit="s")


class _Found(NamedTuple):
    """Windows at a place: by record, the reference force, and the share of the missing force that they are."""

    place: Place
    windows: Mapping[str, TimeWindows]
    reference: float
    share: float


def with_timed_force(search: Search) -> None:
    """Fit a force in time windows alone, where there are windows and nothing explains the records yet.

    Args:
        search: Fits so far; the new one is added.
    """
    problem = search.problem
    if consistent(search.ranked()[0]):
        return
    found = [
        one for place in problem.structure.places if len(place.rows) == 1 and (one := _at(problem, place))
    ]
    if not found:
        return
    best = max(found, key=lambda one: one.share)
    placed = Placed(_effect(problem, best), best.place)
    start = np.concatenate([np.zeros(len(problem.nominal)), _start(placed, best, problem)])
    for _ in range(search.problem.settings.search.timed.refinements):
        converge(search, [((placed,), start)])
        fitted = search.fits[key_of((placed,))]
        if not np.isfinite(fitted.cost) or consistent(fitted):
            break
        best = best._replace(windows=_sharpened(problem, fitted, best))
        placed = Placed(_effect(problem, best), best.place)
        start = np.append(fitted.vector[: len(problem.nominal) + 2], _start(placed, best, problem)[2:])
    else:
        converge(search, [((placed,), start)])


def _sharpened(problem: Problem, fitted: Fit, found: _Found) -> dict[str, TimeWindows]:
    """Windows of every record, their edges moved to where the free run of a fit misses least, each by a sample or so."""
    (placed,), vector = fitted.hypothesis, fitted.vector
    out = {}
    for record in (*problem.records, *problem.case.validation):
        if record.name not in found.windows:
            continue
        data = next((d for d in problem.data if d.record is record), None) or problem.prepare(record)
        own = found.windows[record.name]
        edges = np.concatenate([own.start, own.start + own.duration])

        def residual(edges: Array, own=own, data=data) -> Array | None:
            first, last = np.split(edges, 2)
            moved = found._replace(windows={data.record.name: TimeWindows(first, last - first, own.level)})
            hypothesis = (Placed(_effect(problem, moved), placed.place),)
            return problem.residual_of(data, hypothesis, vector, lenient=False)

        out[record.name] = own
        edges = _moved(residual, edges, record.step, settings=problem.settings.search)
        first, last = np.split(edges, 2)
        if np.all(last > first):
            out[record.name] = TimeWindows(first, last - first, own.level)
    return out


def _moved(
    residual: Callable[[Array], Array | None], edges: Array, step: float, *, settings: SearchSettings
) -> Array:
    """Edges (k,) moved by Gauss-Newton steps, a sample each at most, while what is left goes down.

    They have a prior of one sample about where they were: the area under the measured force has told them to about that.
    """
    origin, before = edges, residual(edges)
    for _ in range(settings.timed.moves):
        if before is None:
            break
        nearby = in_threads(residual, list(edges + settings.timed.difference * step * np.eye(len(edges))))
        if any(after is None for after in nearby):
            break
        slopes = (
            np.array([after - before for after in nearby if after is not None]).T / settings.timed.difference
        )
        right = slopes.T @ before + (edges - origin) / step
        move = -np.linalg.solve(slopes.T @ slopes + np.eye(len(edges)), right)
        longest = step * min(1.0, 1.0 / float(np.abs(move).max()))
        tried = [edges + share * longest * move for share in settings.timed.steps]
        ended = [(residual(moved), moved) for moved in tried]
        better = [
            (after, moved) for after, moved in ended if after is not None and after @ after < before @ before
        ]
        if not better:
            break
        before, edges = min(better, key=lambda one: float(one[0] @ one[0]))
    return edges


def _at(simulator: Simulator, place: Place) -> _Found | None:
    """Windows at a place in the records for identification and those for judging; None where the former have none."""
    windows: dict[str, TimeWindows] = {}
    power = left = 0.0
    for record in simulator.records:
        lacking = missing_force(simulator, record, place)
        power += float(np.sum(lacking**2))
        own = windows_of(record.time, lacking, settings=simulator.settings.search)
        if own is None:
            left += float(np.sum(lacking**2))
            continue
        if (
            follows_motion(
                own,
                record.time,
                simulator.motion_of(record),
                place.rows[0],
                settings=simulator.settings.search,
            )
            or len(own.start) > MAX_WINDOWS
        ):
            return None
        windows[record.name] = own
        left += float(np.sum((lacking - own.inside(record.time)) ** 2))
    if not windows:
        return None
    levels = np.concatenate([own.level for own in windows.values()])
    reference = float(np.median(np.abs(levels))) * (1.0 if np.median(levels) >= 0.0 else -1.0)
    for record in simulator.case.validation:
        own = windows_of(
            record.time, missing_force(simulator, record, place), settings=simulator.settings.search
        )
        if own is not None and len(own.start) <= MAX_WINDOWS:
            windows[record.name] = own
    return _Found(place, windows, reference, 1.0 - left / power)


def _start(placed: Placed, found: _Found, simulator: Simulator) -> Array:
    scales = simulator.scales_of(placed)
    told = [
        p.eta(v, scales)
        for p, v in zip(
            placed.effect.parameters[2:], _told(found, settings=simulator.settings.search), strict=True
        )
    ]
    return np.array([placed.effect.parameters[0].eta(found.reference, scales), 0.0, *told])


def _told(found: _Found, *, settings: SearchSettings) -> list[float]:
    """Start and duration of the first window, the number of windows, and their period (0 for none), of the first record that has any."""
    first = next(iter(found.windows.values()))
    between = np.diff(first.start)
    regular = len(between) > 1 and np.std(between) < settings.timed.regular * np.mean(between)
    return [
        float(first.start[0]), float(np.median(first.duration)), float(len(first.start)),
        float(np.mean(between)) if regular else 0.0,
    ]  # fmt: skip


def _effect(simulator: Simulator, found: _Found) -> Effect:
    """The effect with the windows that were found."""
    step = simulator.records[0].step
    tables = {
        name: _table(windows, found.reference, settings=simulator.settings.search)
        for name, windows in found.windows.items()
    }
    first = next(iter(tables.values()))
    count = sum(len(found.windows[r.name].start) for r in simulator.records if r.name in found.windows)

    def theta(values: Values, scales: Scales) -> Values:
        return _theta(values, step, first)

    def of_record(values: Values, record: str) -> Values:
        return _theta(values, step, tables.get(record, np.zeros((0, 3))))

    held = [FreeParameter(name, signed=True, fixed=True, unit=unit) for name, unit in TOLD]
    return Effect(
        TIMED, "external", "joint",
        (FORCE, SHIFT, *held),
        "f = -F in windows of time", law=timed_force_law(len(first)), theta=theta, of_record=of_record,
        log_prior=EFFECT_SETTINGS.rare - 2.0 * math.log(simulator.settings.search.timed.blocks) * count,
    )  # fmt: skip


TOLD = (("start", "s"), ("duration", "s"), ("windows", "1"), ("period", "s"))
"""What is told of the windows besides their force; the fits hold it."""


def _table(windows: TimeWindows, reference: float, *, settings: SearchSettings) -> Array:
    """Start, duration and relative force (k, 3); windows of like force have the same."""
    relative = windows.level / reference
    relative[np.abs(relative - 1.0) < settings.timed.alike] = 1.0
    return np.column_stack([windows.start, windows.duration, relative])


def _theta(values: Values, step: float, table: Array) -> Values:
    shifted = table + np.array([values[1], 0.0, 0.0])
    return np.concatenate([[float(len(table)), values[0], step], shifted.ravel()])
