"""Friction whose limit differs from record to record, where no channel tells by what.

It is named with its limit in each record, which says that something has changed between them and not what: a pressure, a normal
force, a temperature, wear. The limit is a property of a record then, as its initial state is. That of a judging record is read off its
own missing force along its motion, in proportion to those of the others; no fit sees more of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.effects.catalogue import effect_named
from bench.discrepancy.effects.effect import EFFECT_SETTINGS, Effect, Values
from bench.discrepancy.effects.force_priors import FRICTION
from bench.discrepancy.effects.read_off import DIFFERS
from bench.discrepancy.fitting.map_fit import Fit
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.model.structure import Place
from bench.discrepancy.response.simulator import Simulator
from bench.discrepancy.search.fits import Search, Task, converge
from bench.discrepancy.search.soft_friction import IDEAL, RUBBING, frictional, nominal_level
from bench.discrepancy.search.timed_force import missing_force


def with_friction_by_record(search: Search, bases: Sequence[Fit]) -> None:
    """Fit Coulomb friction of another limit in every record, beside each of some hypotheses that have no friction yet.

    Args:
        search: Fits so far; the new ones are added.
        bases: Fitted hypotheses.
    """
    problem = search.problem
    if len(problem.records) < 2:
        return
    places = [place for place in problem.structure.places if len(place.rows) == 1]
    plain = [base for base in bases if not any(p.effect.family in RUBBING for p in base.hypothesis)]
    told = {place.name: levels_of(problem, place) for place in places} if plain else {}
    converge(search, [_beside(problem, base, place, told[place.name]) for base in plain for place in places])


def levels_of(simulator: Simulator, place: Place) -> dict[str, float]:
    """Limit of the friction along a coordinate in every record of a case, read off the missing force along its motion.

    Beside a constant force and a spring; what else resists the motion counts as friction. At least `faint` of the mean.
    """
    own = nominal_level(simulator, Placed(effect_named(IDEAL), place), simulator.nominal) or 0.0
    found = {}
    for record in (*simulator.records, *simulator.case.validation):
        motion = simulator.motion_of(record)
        position, velocity = motion.position @ place.rows[0], motion.velocity @ place.rows[0]
        shapes = np.column_stack([np.sign(velocity), np.ones_like(position), position])
        resisting = -missing_force(simulator, record, place)
        found[record.name] = own + float(np.linalg.lstsq(shapes, resisting, rcond=None)[0][0])
    mean = float(np.mean([found[record.name] for record in simulator.records]))
    least = simulator.settings.search.scheduled_faint * abs(mean)
    return {name: max(level, least) for name, level in found.items()}


def _beside(problem: Simulator, base: Fit, place: Place, levels: Mapping[str, float]) -> Task:
    """A fit of such friction beside a hypothesis, in the place of the friction that the nominal model has."""
    n, names = len(problem.nominal), [record.name for record in problem.records]
    placed = Placed(differing(names, levels), place)
    scales, nominal = problem.scales_of(placed), base.vector[:n]
    if nominal_level(problem, placed, problem.nominal) is not None:
        placed = replace(placed, effect=replace(placed.effect, in_place=True, variant="in place"))
        nominal = np.where(frictional(problem), 0.0, nominal)
    limits = [FRICTION.eta(levels[name], scales) for name in names]
    return (*base.hypothesis, placed), np.concatenate([nominal, base.vector[n:], limits])


def differing(records: Sequence[str], levels: Mapping[str, float]) -> Effect:
    """Coulomb friction of another limit in every record.

    Args:
        records: Names of those for identification, each with a limit that is fitted.
        levels: Limits that were read off all records: those of others are in proportion to them.
    """
    ideal = effect_named(IDEAL)
    theta = ideal.theta
    assert theta is not None
    mean = float(np.mean([levels[name] for name in records]))

    def schedule(values: Values, record: CaseRecord) -> Values:
        factor = levels.get(record.name, mean) / mean
        if record.name in records:
            factor = values[list(records).index(record.name)] / np.mean(values)
        return np.array([0.0, 1.0, 2.0, factor, factor])

    return replace(
        ideal, name=DIFFERS, equation="f = Fc_i sgn(v) in record i",
        parameters=tuple(replace(FRICTION, name=f"friction_force_{name}") for name in records),
        theta=lambda values, scales: theta(np.array([np.mean(values)]), scales), schedule=schedule, log_prior=EFFECT_SETTINGS.rare,
        n_linear=1,
    )  # fmt: skip
