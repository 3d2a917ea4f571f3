"""A harmonic force of a frequency of its own, found as a line in the spectrum of the force that the records lack.

No grid can hold its frequency, which has to be right to a part of the resolution of the record: it is read off the missing force along
the measured motion, and the effect that has it competes with those of the catalogue. Its phase is a property of a record, as an initial
state is, since nobody starts a record with the machine: fitted in the records for identification, read off the others. So is its
frequency where it differs between records, as the speed of a rotor does; its force is then that of an unbalance, which grows with the
square of the speed. Otherwise force and frequency are what the records for identification say.

Lines at multiples of the frequency of a harmonic load are left to the load: a nonlinear force makes them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from bench.arrays import Array
from bench.discrepancy.effects.catalogue import effect_named
from bench.discrepancy.effects.effect import Effect, Scales, Values
from bench.discrepancy.effects.read_off import AMPLITUDE, HARMONIC
from bench.discrepancy.fitting.fits import Search, converge
from bench.discrepancy.fitting.goodness_of_fit import consistent
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.model.structure import Place
from bench.discrepancy.unscreened.missing_force import free_lines, missing_force
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
from bench.laws.harmonic_force import HARMONIC_FORCE


def with_harmonic_force(search: Search, size: int = 1) -> None:
    """Fit a harmonic force, at the place where it takes most away, where there is one and nothing explains the records yet.

    Args:
        search: Fits so far; the new one is added.
        size: Number of effects: it stands alone, or beside the best that are one fewer.
    """
    problem = search.problem
    if consistent(search.ranked()[0]):
        return
    found = [
        (place, lines)
        for place in problem.structure.places
        if len(place.rows) == 1
        for lines in _lines_at(problem, place)
    ]
    if not found:
        return
    best = max(found, key=lambda one: sum(line.amplitude**2 for line in one[1].values()))[0]
    bases = [f for f in search.ranked(size - 1) if all(p.effect.name != HARMONIC for p in f.hypothesis)]
    for base in bases[:1]:
        still = base.vector if size > 1 else np.zeros(len(problem.nominal))
        for placed, eta in (_begun(problem, *one) for one in found if one[0] is best):
            converge(search, [((*base.hypothesis, placed), np.concatenate([still, eta]))])


def _begun(problem: Problem, place: Place, lines: Mapping[str, SpectralLine]) -> tuple[Placed, Array]:
    """The effect with the lines that were found, and its parameters to start from."""
    placed = Placed(_effect(problem, place, lines), place)
    force = next(iter(lines.values())).amplitude
    eta = [AMPLITUDE.eta(force, problem.scales_of(placed))]
    eta += [p.mean for p in placed.effect.parameters if p.name.startswith("frequency")]
    eta += [line.phase for line in lines.values()]
    return placed, np.array(eta)


def _lines_at(problem: Problem, place: Place) -> list[dict[str, SpectralLine]]:
    """Lines at a place, one for each record for identification: the largest that all have at one frequency, and the largest of each."""
    found = {r.name: free_lines(problem, r, missing_force(problem, r, place)) for r in problem.records}
    if not all(found.values()):
        return []
    common = common_lines(found, max(resolution_of(record) for record in problem.records))[:1]
    largest = {name: lines[0] for name, lines in found.items()}
    return [*common, largest] if largest not in common else common


def _effect(problem: Problem, place: Place, lines: Mapping[str, SpectralLine]) -> Effect:
    """The effect with the lines that were found, of one frequency where the records agree on it."""
    settings = problem.settings.search.harmonic
    records = {record.name: record for record in problem.records}
    resolution = {name: resolution_of(record) for name, record in records.items()}
    told = [line.frequency for line in lines.values()]
    one = max(told) - min(told) < max(resolution.values())
    own = ["frequency"] if one else [f"frequency_{name}" for name in lines]
    middles = [float(np.mean(told))] if one else told
    frequencies = [
        frequency_parameter(parameter, middle, resolution[name], settings)
        for parameter, middle, name in zip(own, middles, lines, strict=False)
    ]
    phases = phase_parameters(list(lines))
    judging = {}
    for record in problem.case.validation:
        lacking = missing_force(problem, record, place)
        judging[record.name] = (record.time, lacking, free_lines(problem, record, lacking))
    order, count, tried = list(lines), len(frequencies), frequencies_of(problem.records)

    def of_record(values: Values, record: str) -> Values:
        force, first = values[0], values[1]
        if record in lines:
            i = order.index(record)
            frequency, phase = values[1 + i % count], values[1 + count + i]
        elif record in judging:
            time, lacking, own_lines = judging[record]
            frequency = first if one or not own_lines else own_lines[0].frequency
            phase = part(time, lacking, frequency).phase
        else:
            frequency, phase = first, 0.0
        return np.array([force * (frequency / first) ** 2, frequency, phase])

    def theta(values: Values, scales: Scales) -> Values:
        return of_record(values, order[0])

    known = effect_named(HARMONIC)
    return replace(
        known, site="joint", parameters=(AMPLITUDE, *frequencies, *phases), law=HARMONIC_FORCE, theta=theta,
        of_record=of_record, rate_bound=lambda values, scales: 2.0 * math.pi * float(np.max(values[1 : 1 + count])),
        log_prior=known.log_prior + sum(frequency_prior(f, tried, settings) for f in middles),
    )  # fmt: skip
