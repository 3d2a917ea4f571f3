"""Laws that follow a channel: friction with the normal force, a seal's with the pressure, a damper's with its current.

A channel of the role "scheduling" is no load and no response; it tells a condition. Under it the force of a law is

    f(t) = (1 - kappa + kappa s(t) / s0) f_law,

with s0 the RMS of the channel in the records for identification: in proportion to the channel for a sensitivity kappa of one,
independent of it for zero. Limit and slopes of a law scale alike, as a contact's do with its normal force. A measured channel that
is no load of one of the bench's rigs counts as scheduling, too.

Where no channel tells, friction may differ from record to record all the same. It is then named with its limit in each, which says that
something has changed between the records and not what; on a record of its own it is the mean of those.
"""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace

import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import Case, CaseChannel, CaseRecord
from bench.discrepancy.case.schema import RIGS
from bench.discrepancy.effects.catalogue import effect_named
from bench.discrepancy.effects.effect import (
    EFFECT_SETTINGS,
    Effect,
    FreeParameter,
    Scales,
    Values,
)
from bench.discrepancy.effects.force_priors import FRICTION
from bench.discrepancy.effects.read_off import DIFFERS, FOLLOWED, SENSITIVITY, schedulable
from bench.discrepancy.fitting.goodness_of_fit import consistent, key_of
from bench.discrepancy.fitting.map_fit import Fit
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.model.structure import Place
from bench.discrepancy.response.simulator import Simulator
from bench.discrepancy.search.fits import Search, Task, converge
from bench.discrepancy.search.soft_friction import IDEAL, RUBBING, frictional, nominal_level

LOADS = ("force", "torque")
"""Load channels of the bench's own rigs."""


def scheduling(case: Case) -> list[CaseChannel]:
    """Channels that laws may follow."""
    own = case.rig in RIGS
    return [
        c for c in case.channels
        if c.role == "scheduling" or (own and c.role == "measured" and c.name not in LOADS)
    ]  # fmt: skip


def with_schedules(search: Search, asked: Collection[str]) -> None:
    """Fit the foremost effects with a schedule, or friction that differs between records where no channel tells.

    Args:
        search: Fits so far; the new ones are added.
        asked: Names of the effects of the catalogue.
    """
    problem = search.problem
    if consistent(search.ranked()[0]):
        return
    channels = scheduling(problem.case)
    tasks: list[Task] = []
    for channel in channels:
        for placed, start in (one for one in _seeds(search) if FOLLOWED + one[0].effect.name in asked):
            tasks += _followed(problem, placed, start, channel)
    if not channels and len(problem.records) > 1 and DIFFERS in asked:
        tasks = [
            t for place in problem.structure.places if len(place.rows) == 1 for t in _differing(search, place)
        ]
    converge(search, tasks)


def _seeds(search: Search) -> list[tuple[Placed, Array]]:
    """Effects that are tried with a schedule, and vectors to start from: those that come nearest alone, and Coulomb friction.

    Friction of the mean limit may be in the nominal model already, so that no fit has asked for any.
    """
    settings = search.problem.settings.search
    problem = search.problem
    seeds = [(f.hypothesis[0], f.vector) for f in search.ranked(1) if _schedulable(f)][: settings.scheduled]
    known = {placed.key for placed, _ in seeds}
    still, ideal = search.ranked(0)[0].vector, effect_named(IDEAL)
    for place in problem.structure.places:
        placed = Placed(ideal, place)
        if len(place.rows) == 1 and placed.key not in known:
            level = nominal_level(problem, placed, problem.split((), still)[0]) or 0.0
            faint = settings.scheduled_faint * level or FRICTION.value(
                FRICTION.mean, problem.scales_of(placed)
            )
            seeds.append((placed, np.append(still, FRICTION.eta(faint, problem.scales_of(placed)))))
    return seeds


def _schedulable(fitted: Fit) -> bool:
    (placed,) = fitted.hypothesis
    effect = placed.effect
    plain = effect.schedule is None and effect.of_record is None and not effect.variant
    return schedulable(effect) and plain and bool(np.isfinite(fitted.cost))


def _followed(simulator: Simulator, placed: Placed, start: Array, channel: CaseChannel) -> list[Task]:
    """Fits of an effect whose force follows a channel: added to the nominal model, and in the place of its friction."""
    values, (eta,) = simulator.split((placed,), start)
    n = len(simulator.nominal)
    effect = scheduled_by(placed.effect, channel, simulator)
    reference = _reference(simulator, channel)
    shapes = [np.append(eta, [kappa, reference]) for kappa in (0.5, 1.0)]
    new = Placed(effect, placed.place, channel.name)
    tasks: list[Task] = [((new,), np.array([np.append(start[:n], shape) for shape in shapes]))]
    loss = nominal_level(simulator, placed, values)
    if loss is not None and placed.effect.family in RUBBING:
        scales = simulator.scales_of(placed)
        first = placed.effect.parameters[0]
        whole = eta.copy()
        if first.name == FRICTION.name:
            whole[0] = first.eta(first.value(eta[0], scales) + loss, scales)
        still = np.where(frictional(simulator), 0.0, start[:n])
        starts = [
            np.concatenate([still, own, [kappa, reference]]) for kappa in (0.5, 1.0) for own in (whole, eta)
        ]
        tasks.append(
            (
                (Placed(replace(effect, in_place=True, variant="in place"), placed.place, channel.name),),
                np.array(starts),
            )
        )
    return tasks


def scheduled_by(effect: Effect, channel: CaseChannel, simulator: Simulator) -> Effect:
    """An effect whose force follows a channel."""
    count = len(effect.parameters)
    theta, bound, name = effect.theta, effect.rate_bound, channel.name

    def schedule(values: Values, record: CaseRecord) -> Values:
        samples = record.values.get(name)
        if samples is None:
            return np.array([0.0, 1.0, 2.0, 1.0, 1.0])
        kappa, reference = values[count:]
        factor = 1.0 - kappa + kappa * samples / reference
        return np.concatenate([[record.start, 1.0 / record.step, float(len(samples))], factor])

    def own_theta(values: Values, scales: Scales) -> Values:
        return values[:count] if theta is None else theta(values[:count], scales)

    return replace(
        effect, name=FOLLOWED + effect.name, equation=f"(1 - kappa + kappa s/s0) f, s = {name}; {effect.equation}",
        parameters=(*effect.parameters, SENSITIVITY, FreeParameter("reference", signed=True, fixed=True, unit=channel.unit or "1")),
        theta=own_theta, schedule=schedule, log_prior=effect.log_prior + 0.5 * EFFECT_SETTINGS.rare,
        rate_bound=None if bound is None else lambda values, scales: bound(values[:count], scales),
    )  # fmt: skip


def _reference(simulator: Simulator, channel: CaseChannel) -> float:
    power = [float(np.mean(record.values[channel.name] ** 2)) for record in simulator.records]
    return math.sqrt(float(np.mean(power))) or 1.0


def _differing(search: Search, place: Place) -> list[Task]:
    """Coulomb friction of another limit in every record, added to the nominal model or in the place of its friction."""
    problem, names = search.problem, [record.name for record in search.problem.records]
    effect = differing(names)
    ideal = search.fits.get(key_of((Placed(effect_named(IDEAL), place),)))
    vector = search.ranked(0)[0].vector if ideal is None else ideal.vector
    n = len(problem.nominal)
    scales = problem.scales_of(Placed(effect, place))
    level = 0.0 if ideal is None else FRICTION.value(ideal.vector[n], scales)
    tasks: list[Task] = []
    loss = nominal_level(problem, Placed(effect, place), problem.split((), vector[:n])[0])
    replacing = replace(effect, in_place=True, variant="in place")
    for own, limit in ((effect, level), (replacing, level + (loss or 0.0))):
        if limit > 0.0 and (loss is not None or not own.in_place):
            still = np.where(frictional(problem), 0.0, vector[:n]) if own.in_place else vector[:n]
            start = np.append(still, np.full(len(names), FRICTION.eta(limit, scales)))
            tasks.append(((Placed(own, place),), start))
    return tasks


def differing(records: list[str]) -> Effect:
    """Coulomb friction of another limit in every record for identification, and of their mean in any other."""
    ideal = effect_named(IDEAL)
    theta = ideal.theta
    assert theta is not None

    def schedule(values: Values, record: CaseRecord) -> Values:
        factor = values[records.index(record.name)] / np.mean(values) if record.name in records else 1.0
        return np.array([0.0, 1.0, 2.0, factor, factor])

    return replace(
        ideal, name=DIFFERS, equation="f = Fc_i sgn(v) in record i",
        parameters=tuple(replace(FRICTION, name=f"friction_force_{name}") for name in records),
        theta=lambda values, scales: theta(np.array([values.mean()]), scales), schedule=schedule, log_prior=EFFECT_SETTINGS.rare,
        n_linear=1,
    )  # fmt: skip
