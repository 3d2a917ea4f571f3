"""Coulomb friction with a softness: variants of `coulomb_friction` that are fitted where the set-valued law misses the noise.

Friction of simulators and of many a real contact does not stick, it creeps. How much is a question of one or two further
parameters, not of another cause, so the variants bear the name of their ideal. They are no part of the screening: along the measured
motion they differ from it by little, and a fit of the ideal is the start they need.

A nominal model that has dry friction itself may have the wrong kind of it, above all MuJoCo's default one. A variant "in place" takes
the place of the nominal friction of its coordinate, with a limit of its own.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array
from bench.discrepancy.effects import friction_limits as limits
from bench.discrepancy.effects.catalogue import effect_named
from bench.discrepancy.effects.effect import Effect, FreeParameter, Scales, Values
from bench.discrepancy.effects.force_priors import FRICTION
from bench.discrepancy.fitting.fits import Search, Task, converge
from bench.discrepancy.fitting.goodness_of_fit import consistent
from bench.discrepancy.fitting.map_fit import Fit
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.response.simulator import Simulator
from bench.laws.coulomb import COULOMB
from bench.laws.soft_friction import SOFT_COULOMB

IDEAL = "coulomb_friction"
"""The effect that the others are variants of."""
RUBBING = ("friction", "hysteresis")
"""Families that may take the place of the nominal model's own friction."""
CREEP = FreeParameter(
    "creep_velocity", "velocity", mean=math.log(0.01), std=2.3, bounds=(math.log(1e-5), math.log(1.0))
)
LEAD = FreeParameter(
    "lead_time", mean=math.log(0.005), std=1.2, bounds=(math.log(5e-5), math.log(0.5)), unit="s"
)


def _settling(values: Values, scales: Scales) -> float:
    """Rate [1/s] at which the motion settles to the creep of rounded friction."""
    return values[0] * scales.mobility / values[1]


def _soft_settling(values: Values, scales: Scales) -> float:
    return 1.0 / (values[1] / max(values[0] * scales.mobility, 1e-300) + values[2])


ROUNDED = Effect(
    IDEAL,
    "friction",
    "joint",
    (FRICTION, CREEP),
    "f = Fc tanh(v / vc)",
    law=COULOMB,
    rate_bound=_settling,
    variant="rounded",
)
SOFT = Effect(
    IDEAL,
    "friction",
    "joint",
    (FRICTION, CREEP, LEAD),
    "f = Fc sat((v + tau a) / vc)",
    law=SOFT_COULOMB,
    limit=limits.soft_coulomb_limit,
    creeps=True,
    rate_bound=_soft_settling,
    variant="soft",
)


def soften(search: Search, size: int) -> None:
    """Fit the variants of Coulomb friction in the foremost hypotheses of a size that hold it, unless the first is one that leaves
    no more than the noise does on average.

    Args:
        search: Fits so far; the new ones are added.
        size: Number of effects of the hypotheses.
    """
    ranked = search.ranked(size)
    tasks: list[Task] = []
    for fitted in [f for f in ranked if _ideal_at(f) is not None and np.isfinite(f.cost)][
        : search.problem.settings.search.soft.softened
    ]:
        own_friction = bool(frictional(search.problem).any())
        within = fitted.chi2 - fitted.n_residuals < np.sqrt(2.0 * fitted.n_residuals)
        if own_friction or fitted is not ranked[0] or not within:
            tasks += _softened(search.problem, fitted)
    converge(search, tasks)


def stand_in(search: Search) -> None:
    """Fit friction and hysteresis alone in the place of the nominal model's own friction, where that is of the wrong kind.

    Added to it, a law that springs back or has play can only undo what is there, with the nominal limit at its bound.

    Args:
        search: Fits so far; the new ones are added.
    """
    problem = search.problem
    if not frictional(problem).any() or consistent(search.ranked()[0]):
        return
    tasks: list[Task] = []
    for fitted in [f for f in search.ranked(1) if _rubs(f)][
        : search.problem.settings.search.soft.standing_in
    ]:
        (placed,), n = fitted.hypothesis, len(problem.nominal)
        values, (eta,) = problem.split(fitted.hypothesis, fitted.vector)
        loss = nominal_level(problem, placed, values)
        if loss is None:
            continue
        scales, first = problem.scales_of(placed), placed.effect.parameters[0]
        still = np.where(frictional(problem), 0.0, fitted.vector[:n])
        starts = [np.append(still, eta)]
        for grid in placed.effect.grid():
            whole = grid.copy()
            if first.name == FRICTION.name:
                whole[0] = first.eta(first.value(eta[0], scales) + loss, scales)
            starts.append(np.append(still, whole))
        tasks.append(((Placed(_in_place(placed.effect), placed.place),), np.array(starts)))
    converge(search, tasks)


def _rubs(fitted: Fit) -> bool:
    """Whether a hypothesis of one effect is friction or hysteresis of the catalogue."""
    effect = fitted.hypothesis[0].effect
    return effect.site == "joint" and effect.family in RUBBING and not effect.variant and not effect.modulated


def _ideal_at(fitted: Fit) -> int | None:
    """Which effect of a hypothesis is ideal Coulomb friction."""
    for i, placed in enumerate(fitted.hypothesis):
        if placed.effect.name == IDEAL and not placed.effect.variant:
            return i
    return None


def _softened(simulator: Simulator, fitted: Fit) -> Iterator[Task]:
    """A fit of every variant that can take the place of the friction in a hypothesis."""
    settings = simulator.settings.search
    i = _ideal_at(fitted)
    assert i is not None
    placed = fitted.hypothesis[i]
    values, etas = simulator.split(fitted.hypothesis, fitted.vector)
    scales, ideal = simulator.scales_of(placed), effect_named(IDEAL)
    level = float(ideal.values(etas[i], scales)[0])
    loss = nominal_level(simulator, placed, values)
    variants = [(ROUNDED, level), (SOFT, level)]
    n = len(simulator.nominal)
    still = fitted.vector[:n].copy()
    if loss is not None:
        variants = [(_in_place(effect), level + loss) for effect in (ideal, ROUNDED, SOFT)]
        still = np.where(frictional(simulator), 0.0, still)
    for effect, limit in variants:
        head = [FRICTION.eta(limit, scales)]
        if effect.law is COULOMB and not effect.limit:
            shapes = [[math.log(creep)] for creep in settings.soft.creeps]
        else:
            shapes = (
                [[math.log(c), math.log(t)] for c, t in product(settings.soft.creeps, settings.soft.leads)]
                if effect.creeps
                else [[]]
            )
        hypothesis = (*fitted.hypothesis[:i], Placed(effect, placed.place), *fitted.hypothesis[i + 1 :])
        starts = [
            np.concatenate([still, *etas[:i], np.array(head + shape), *etas[i + 1 :]]) for shape in shapes
        ]
        yield hypothesis, np.array(starts)


def nominal_level(simulator: Simulator, placed: Placed, values: Array) -> float | None:
    """Limit of the nominal model's own friction along a place; None where it has none."""
    names = simulator.structure.parameters
    own = [*simulator.structure.frictions, *(e for e in simulator.structure.elements if e.rubs)]
    levels = [f.level(names, values) for f in own if f.acts_along(placed.place.rows[0])]
    return sum(levels) if levels else None


def frictional(simulator: Simulator) -> NDArray[np.bool_]:
    """Which entries (n_nominal,) of a vector are limits of the nominal model's own friction."""
    names = {friction.parameter for friction in simulator.structure.frictions}
    names |= {name for e in simulator.structure.elements if e.rubs for name in e.parameters}
    names.discard("")
    out = np.zeros(len(simulator.nominal), dtype=bool)
    out[: simulator.n_physical] = [
        name in names for name in simulator.structure.parameters[: simulator.n_physical]
    ]
    return out


def _in_place(effect: Effect) -> Effect:
    """A variant that stands in the place of the nominal model's own friction."""
    return replace(effect, variant=f"{effect.variant} in place".strip(), in_place=True)
