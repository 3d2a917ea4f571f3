"""Fits over growing beginnings of records: motions that a free run over the whole is too sensitive for."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from planted_cases import linear_motion, motion_with, planted_case

from bench.discrepancy import Case
from bench.discrepancy.effects.catalogue import effect_named
from bench.discrepancy.fitting.fits import Search
from bench.discrepancy.fitting.goodness_of_fit import names, near
from bench.discrepancy.fitting.map_fit import fit
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.response.windows import channels_of
from bench.discrepancy.search.horizons import lengthen
from bench.discrepancy.simulation.stick_slip import Motion

STIFFNESS, CLEARANCE, FRICTION, HARD = 5000.0, 0.004, 1.0, 4.0
"""Stops three times as stiff as the spring, reached at a fifth of the stroke; and the load, in that of other planted cases."""


def bouncing(x, v, z):
    """Stops on both sides, and a little friction."""
    beyond = max(x - CLEARANCE, 0.0) + min(x + CLEARANCE, 0.0)
    return STIFFNESS * beyond + FRICTION * math.tanh(v / 1e-3), []


def driven_hard(moved) -> Case:
    """A planted case under a load so many times as large."""
    case = planted_case(lambda force: moved(HARD * force))

    def louder(records):
        return tuple(replace(r, values={**r.values, "force": HARD * r.values["force"]}) for r in records)

    return replace(case, identification=louder(case.identification), validation=louder(case.validation))


def searched(case: Case, *effects: str) -> tuple[Search, list[Placed]]:
    """Single effects fitted to whole records, from the whole grid of each."""
    problem = Problem(case, structure_of(case), case.identification)
    candidates = [Placed(effect_named(name), problem.structure.places[0]) for name in effects]
    search, still = Search(problem), np.zeros(len(problem.nominal))
    search.add(fit(problem, (), start=still))
    for placed in candidates:
        starts = np.array([np.append(still, eta) for eta in placed.effect.grid()])
        search.add(fit(problem, (placed,), start=starts, iterations=60))
    return search, candidates


def test_stops_and_friction_that_no_descent_over_whole_records_finds_are_found_over_their_beginnings():
    search, candidates = searched(
        driven_hard(lambda force: motion_with(force, bouncing)), "gap", "coulomb_friction", "cubic_stiffness"
    )
    stuck = min(f.reduced for f in search.ranked(1))
    for size in (1, 2):
        lengthen(search, size, candidates)
    best = search.ranked()[0]
    assert names(best.hypothesis) == "gap + coulomb_friction"
    assert near(best)
    assert stuck > 1e4  # the same effects, over whole records
    (stops, friction) = search.problem.split(best.hypothesis, best.vector)[1]
    scales = search.problem.scales_of(best.hypothesis[0])
    # a regularised sign in the truth, one that sticks in the fit, and chi-squared of two: a part in fifty
    assert best.hypothesis[0].effect.values(stops, scales) == pytest.approx([STIFFNESS, CLEARANCE], rel=0.02)
    assert best.hypothesis[1].effect.values(friction, scales)[0] == pytest.approx(FRICTION, rel=0.1)


def test_what_is_explained_over_whole_records_is_left_as_it_is():
    search, candidates = searched(driven_hard(linear_motion), "gap", "coulomb_friction")
    before = dict(search.fits)
    lengthen(search, 1, candidates)
    assert search.fits == before


@pytest.mark.filterwarnings("error")
def test_channels_of_a_run_that_diverges_are_not_finite_and_nothing_is_said_of_it():
    structure = structure_of(driven_hard(linear_motion))
    # behind a sensor that does not see the coordinate that ran away
    blind = replace(structure, observers=tuple(replace(o, row=0.0 * o.row) for o in structure.observers))
    gone = Motion(*(np.full((3, len(structure.observers[0].row)), np.inf) for _ in range(3)))
    assert not np.isfinite(channels_of(blind, gone)).any()
