"""Hum in the reading of a sensor, found as a line in the spectrum of what a fit leaves of its channel.

A sensor picks it up on its way to the logger, from the mains most often: no force makes it, and no other channel tells of it. A force of
the same frequency moves the rig, and all channels say so in the same way; where one channel is all there is, both explain it, and what
each takes of amplitude decides between them. Its phase is a property of a record, read off the judging ones; its amplitude is what the
others say.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.effects.catalogue import effect_named
from bench.discrepancy.effects.effect import Effect, Values
from bench.discrepancy.effects.read_off import HARMONIC, HUM
from bench.discrepancy.fitting.fits import Search, converge
from bench.discrepancy.fitting.goodness_of_fit import consistent
from bench.discrepancy.fitting.map_fit import Fit
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.model.structure import Place
from bench.discrepancy.unscreened.missing_force import free_lines
from bench.discrepancy.unscreened.spectral_lines import (
    SpectralLine,
    common_lines,
    frequencies_of,
    frequency_parameter,
    frequency_prior,
    part,
    phase_parameters,
    resolution_of,
)


def with_hum(search: Search, names: set[str], size: int = 1) -> None:
    """Fit hum in the channel where it takes most away, where a channel has any and nothing but a force explains the records yet.

    Args:
        search: Fits so far; the new one is added.
        names: Effects that are asked for.
        size: Number of effects: it stands alone, or beside the best that are one fewer.
    """
    problem = search.problem
    if _explained(search):
        return
    base = next(f for f in search.ranked(size - 1) if all(p.effect.name != HARMONIC for p in f.hypothesis))
    humming = {p.target for p in base.hypothesis if p.effect.added is not None}
    found = []
    for c, channel in enumerate(problem.structure.channels):
        if channel in humming or _name_in(problem, channel) not in names:
            continue
        left = {r.name: _left(problem, base, r)[:, c] for r in (*problem.records, *problem.case.validation)}
        if not all(np.isfinite(samples).all() for samples in left.values()):
            continue
        own = _lines_in(problem, left)
        if own:
            power = sum(float(np.sum(left[r.name] ** 2)) for r in problem.records)
            taken = sum(0.5 * own[r.name].amplitude ** 2 * len(r) for r in problem.records)
            found.append((taken / max(power, 1e-300), channel, own, left))
    if not found:
        return
    _, channel, own, left = max(found, key=lambda one: one[0])
    placed = Placed(_effect(problem, channel, own, left), _place_of(problem, channel), channel)
    scales, line = problem.scales_of(placed), next(iter(own.values()))
    eta = [placed.effect.parameters[0].eta(line.amplitude, scales), placed.effect.parameters[1].mean]
    eta += [each.phase for each in own.values()]
    converge(search, [((*base.hypothesis, placed), np.concatenate([base.vector, eta]))])


def _explained(search: Search) -> bool:
    """Whether the best hypothesis explains the records, no line of their spectra among what it explains.

    What is weighed by what is left of it is consistent by construction, lines and all; and where a force explains a line, a sensor may.
    """
    best = search.ranked()[0]
    forced = any(placed.effect.name == HARMONIC for placed in best.hypothesis)
    return consistent(best) and search.problem.error is None and not forced


def _left(problem: Problem, base: Fit, record: CaseRecord) -> Array:
    """What a fit leaves (n, n_channels) of a record."""
    return problem.responses_of(record) - problem.simulate(base.hypothesis, base.vector, record)


def _lines_in(problem: Problem, left: Mapping[str, Array]) -> dict[str, SpectralLine]:
    """The strongest line that all records for identification have, by record; none where they share none."""
    found = {record.name: free_lines(problem, record, left[record.name]) for record in problem.records}
    common = common_lines(found, max(resolution_of(record) for record in problem.records))
    return common[0] if common else {}


def _name_in(problem: Problem, channel: str) -> str:
    """Name of hum in a channel."""
    if problem.driven:
        return f"force_{HUM}"
    order = next(o.order for o in problem.structure.observers if o.channel == channel)
    return f"{('displacement', 'velocity', 'acceleration')[order]}_{HUM}"


def _place_of(problem: Problem, channel: str) -> Place:
    """A place that a channel moves with."""
    single = [place for place in problem.structure.places if len(place.rows) == 1]
    rows = [o.row for o in problem.structure.observers if o.channel == channel]
    return next((p for p in single if rows and np.any(p.rows[0] * rows[0])), single[0])


def _effect(
    problem: Problem, channel: str, lines: Mapping[str, SpectralLine], left: Mapping[str, Array]
) -> Effect:
    """The effect with the lines that were found."""
    settings, known = problem.settings.search.harmonic, effect_named(_name_in(problem, channel))
    middle = float(np.mean([line.frequency for line in lines.values()]))
    resolution = max(resolution_of(record) for record in problem.records)
    order, records = list(lines), {r.name: r for r in problem.case.validation}

    def added(values: Values, name: str, time: Array) -> Array:
        if name in lines:
            phase = values[2 + order.index(name)]
        elif name in records:
            phase = part(records[name].time, left[name], values[1]).phase
        else:
            phase = 0.0
        return np.asarray(values[0] * np.cos(2.0 * math.pi * values[1] * time + phase))

    return replace(
        known,
        site="sensor",
        parameters=(
            known.parameters[0],
            frequency_parameter("frequency", middle, resolution, settings),
            *phase_parameters(order),
        ),
        added=added,
        log_prior=known.log_prior + frequency_prior(middle, frequencies_of(problem.records), settings),
    )
