"""Laws that follow a channel: friction with the normal force, a seal's with the pressure, a damper's with its current.

A channel of the role "scheduling" is no load and no response; it tells a condition. Under it the force of a law is

    f(t) = (1 - kappa + kappa s(t) / s0) f_law,

with s0 the RMS of the channel in the records for identification: in proportion to the channel for a sensitivity kappa of one,
independent of it for zero. Limit and slopes of a law scale alike, as a contact's do with its normal force. The stiffness and the viscous
damping of the nominal model follow a channel about its mean, by so much a standard deviation of it: their mean is the nominal
parameter's own. A measured channel that is no load of one of the bench's rigs counts as scheduling, too.

Where no channel tells, what dissipates may differ from record to record all the same: friction with the normal force, a
magnetorheological damper with its current. It is then named with its size in each, which says that something has changed between the
records and not what; on a record of its own it is the mean of those.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Sequence
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
from bench.discrepancy.effects.read_off import (
    CHANGES,
    DIFFERS,
    FOLLOWED,
    SENSITIVITY,
    differing_name,
    differs,
    schedulable,
)
from bench.discrepancy.fitting.fits import Search, Task, converge
from bench.discrepancy.fitting.goodness_of_fit import consistent
from bench.discrepancy.fitting.map_fit import Fit
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.response.simulator import Simulator
from bench.discrepancy.unscreened.soft_friction import IDEAL, RUBBING, frictional, nominal_level

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
    """Fit the foremost effects with a schedule, or with a size that differs between records where no channel tells.

    Args:
        search: Fits so far; the new ones are added.
        asked: Names of the effects of the catalogue.
    """
    problem = search.problem
    if consistent(search.ranked()[0]):
        return
    channels = scheduling(problem.case)
    tasks: list[Task] = []
    for placed, start in _seeds(search):
        effect = placed.effect
        if FOLLOWED + effect.name in asked:
            for channel in channels:
                tasks += _followed(problem, placed, start, channel)
        if not channels and len(problem.records) > 1 and differs(effect) and differing_name(effect) in asked:
            tasks += _differing(problem, placed, start)
    if not channels and len(problem.records) > 1:
        tasks += _changing(search, asked)
    for channel in channels:
        tasks += _following(search, asked, channel)
    converge(search, tasks)
    converge(search, list(_of_one_size(search)))


def _of_one_size(search: Search) -> Iterator[Task]:
    """Fits of effects of one size from where those ended whose size differs between records: alone they may have ended elsewhere."""
    for fitted in search.ranked(1):
        (placed,) = fitted.hypothesis
        effect = placed.effect
        if not effect.name.startswith(DIFFERS) or effect.parameters[0].signed or not np.isfinite(fitted.cost):
            continue
        plain = replace(effect_named(effect.varies), in_place=effect.in_place, variant=effect.variant)
        first, count = len(search.problem.nominal), len(search.problem.records)
        size = float(np.mean(fitted.vector[first : first + count]))
        yield (
            (Placed(plain, placed.place),),
            np.concatenate([fitted.vector[:first], [size], fitted.vector[first + count :]]),
        )


def _changing(search: Search, asked: Collection[str]) -> list[Task]:
    """Fits of a spring and of a damper that differ from record to record, from the same change of all."""
    problem, still = search.problem, search.ranked(0)[0].vector
    return [
        task
        for place in problem.structure.places
        for effect in CHANGES
        if len(place.rows) == 1 and differing_name(effect) in asked
        for task in _differing(problem, Placed(effect, place), np.append(still, effect.parameters[0].std))
    ]


def _following(search: Search, asked: Collection[str], channel: CaseChannel) -> list[Task]:
    """Fits of a spring and of a damper that follow a channel about its mean, up with it and down."""
    problem, still = search.problem, search.ranked(0)[0].vector
    values = np.concatenate([record.values[channel.name] for record in problem.records])
    mean, deviation = float(np.mean(values)), float(np.std(values))
    if deviation <= np.finfo(float).eps * abs(mean):
        return []
    return [
        (
            (Placed(following(effect, channel), place, channel.name),),
            np.array(
                [np.append(still, [way * effect.parameters[0].std, mean, deviation]) for way in (1.0, -1.0)]
            ),
        )
        for place in problem.structure.places
        for effect in CHANGES
        if len(place.rows) == 1 and FOLLOWED + effect.name in asked
    ]


def _seeds(search: Search) -> list[tuple[Placed, Array]]:
    """Effects that are tried so, and vectors to start from: those that come nearest alone, and Coulomb friction.

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
    """Fits of an effect whose force follows a channel."""
    effect, reference = scheduled_by(placed.effect, channel, simulator), _reference(simulator, channel)

    def shapes(eta: Array) -> list[Array]:
        return [np.append(eta, [kappa, reference]) for kappa in (0.5, 1.0)]

    return _tasks(simulator, placed, start, Placed(effect, placed.place, channel.name), shapes)


def _differing(simulator: Simulator, placed: Placed, start: Array) -> list[Task]:
    """Fits of an effect whose force differs from record to record, the same in all at the start."""
    names = [record.name for record in simulator.records]

    def shapes(eta: Array) -> list[Array]:
        return [np.append(np.full(len(names), eta[0]), eta[1:])]

    return _tasks(simulator, placed, start, Placed(differing(placed.effect, names), placed.place), shapes)


def _tasks(
    simulator: Simulator,
    placed: Placed,
    start: Array,
    varied: Placed,
    shapes: Callable[[Array], list[Array]],
) -> list[Task]:
    """Fits of a varied effect: added to the nominal model, and in the place of its friction.

    Args:
        simulator: Records and nominal model.
        placed: The effect as it is.
        start: Vector of a fit with it.
        varied: The effect as it is varied.
        shapes: Parameters of the effect to starts of the varied one.
    """
    values, (eta,) = simulator.split((placed,), start)
    n = len(simulator.nominal)
    tasks: list[Task] = [((varied,), np.array([np.append(start[:n], shape) for shape in shapes(eta)]))]
    loss = nominal_level(simulator, placed, values)
    if loss is not None and placed.effect.family in RUBBING:
        scales = simulator.scales_of(placed)
        first = placed.effect.parameters[0]
        whole = eta.copy()
        if first.name == FRICTION.name:
            whole[0] = first.eta(first.value(eta[0], scales) + loss, scales)
        still = np.where(frictional(simulator), 0.0, start[:n])
        instead = replace(varied, effect=replace(varied.effect, in_place=True, variant="in place"))
        starts = [np.append(still, shape) for own in (whole, eta) for shape in shapes(own)]
        tasks.append(((instead,), np.array(starts)))
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
        effect, name=FOLLOWED + effect.name, varies=effect.name, equation=f"(1 - kappa + kappa s/s0) f, s = {name}; {effect.equation}",
        parameters=(*effect.parameters, SENSITIVITY, FreeParameter("reference", signed=True, fixed=True, unit=channel.unit or "1")),
        theta=own_theta, schedule=schedule, log_prior=effect.log_prior + 0.5 * EFFECT_SETTINGS.rare,
        rate_bound=None if bound is None else lambda values, scales: bound(values[:count], scales),
    )  # fmt: skip


def following(change: Effect, channel: CaseChannel) -> Effect:
    """A change of a spring or of a damper that follows a channel about its mean in the records for identification."""
    fixed = (
        FreeParameter(name, signed=True, fixed=True, unit=channel.unit or "1")
        for name in ("mean", "deviation")
    )
    theta = change.theta
    assert theta is not None

    def schedule(values: Values, record: CaseRecord) -> Values:
        samples = record.values.get(channel.name)
        if samples is None:
            return np.array([0.0, 1.0, 2.0, 0.0, 0.0])
        factor = (samples - values[1]) / values[2]
        return np.concatenate([[record.start, 1.0 / record.step, float(len(samples))], factor])

    return replace(
        change, name=FOLLOWED + change.name, varies=change.name, parameters=(*change.parameters, *fixed),
        equation=f"(s - mean)/deviation f, s = {channel.name}; {change.equation}", schedule=schedule,
        theta=lambda values, scales: theta(values[:1], scales), log_prior=0.5 * EFFECT_SETTINGS.rare,
    )  # fmt: skip


def _reference(simulator: Simulator, channel: CaseChannel) -> float:
    power = [float(np.mean(record.values[channel.name] ** 2)) for record in simulator.records]
    return math.sqrt(float(np.mean(power))) or 1.0


def differing(effect: Effect, records: Sequence[str]) -> Effect:
    """An effect whose force is of another size in every record for identification, and of their mean in any other.

    Args:
        effect: The effect, of the same size in all.
        records: Names of the records for identification.
    """
    count, first, bound = len(records), effect.parameters[0], effect.rate_bound

    def typical(values: Values) -> Values:
        mean, size = float(values[:count].mean()), float(np.abs(values[:count]).max())
        # changes of both signs may have a mean of nothing, which nothing is a multiple of
        return np.append(mean if abs(mean) > 1e-6 * size else max(size, np.finfo(float).tiny), values[count:])

    def schedule(values: Values, record: CaseRecord) -> Values:
        own = values[records.index(record.name)] if record.name in records else values[:count].mean()
        factor = own / typical(values)[0]
        return np.array([0.0, 1.0, 2.0, factor, factor])

    def own_theta(values: Values, scales: Scales) -> Values:
        return typical(values) if effect.theta is None else effect.theta(typical(values), scales)

    return replace(
        effect, name=differing_name(effect), varies=effect.name, equation=f"c_i f in record i; {effect.equation}",
        parameters=(*(replace(first, name=f"{first.name}_{name}") for name in records), *effect.parameters[1:]),
        theta=own_theta, schedule=schedule, log_prior=effect.log_prior + EFFECT_SETTINGS.rare,
        rate_bound=None if bound is None else lambda values, scales: bound(typical(values), scales), n_linear=1,
    )  # fmt: skip
