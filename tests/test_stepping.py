"""Integration steps of slow logs, what ends a search, and readings between the steps of a run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_articulated import LIMIT, problem_of, write_case
from test_articulated_rounds import rubbing

from bench.discrepancy.articulated.stepping import accurate, stepped
from bench.discrepancy.articulated_effects.catalogue import CATALOGUE
from bench.discrepancy.articulated_search.placements import placements
from bench.discrepancy.articulated_search.search import nominal_fit, search
from bench.discrepancy.numerics.deadline import NEVER
from bench.discrepancy.replay.running import coordinate_at
from bench.discrepancy.settings import DEFAULT


def test_a_slow_log_takes_few_steps_a_sample_where_these_tell_the_same(tmp_path):
    problem = problem_of(write_case(tmp_path, rubbing(LIMIT), servo=True))
    fine = problem.records[0].joints[0].n_sub
    # of a model that misses friction, steps of 2.5 ms tell what those of 1 ms do
    found = stepped(problem.case, problem.model, DEFAULT, NEVER)
    few = found.records[0].joints[0].n_sub
    assert (few, fine) == (DEFAULT.articulated.steps_a_sample, 10)
    fits = nominal_fit(found), nominal_fit(problem)
    worth = DEFAULT.articulated.search.worth
    assert abs(fits[0].log_posterior - fits[1].log_posterior) < 0.01 * np.sum(fits[1].beyond_noise) + worth
    assert accurate(found, fits[0], fits[0], DEFAULT)
    # where nothing is left, steps have to keep within what evidence asks for
    complete = replace(fits[0], chi2=fits[0].octaves.count)
    own = DEFAULT.articulated
    stern = replace(DEFAULT, articulated=replace(own, search=replace(own.search, worth=1e-9)))
    assert accurate(found, fits[0], fits[0], stern)
    assert not accurate(found, complete, fits[0], stern)
    assert accurate(problem, complete, fits[1], stern)


def test_no_round_follows_one_that_misleads_but_the_first(tmp_path):
    """One effect of two alone may predict worse than none."""
    stiff = rubbing(LIMIT).replace('damping="0.1"', 'damping="0.9"').replace('damping="0.2"', 'damping="1.2"')
    problem = problem_of(write_case(tmp_path, stiff, servo=True))
    names = ("damping_error", "coulomb_friction", "force_offset")  # the last is not there
    kinds = [effect for effect in CATALOGUE if effect.name in names]

    def rounds(misleads):
        asked, told = [], []

        def misled(of, before, after):
            asked.append((len(before.hypothesis), len(after.hypothesis)))
            return misleads

        search(problem, placements(problem, kinds), misled=misled, progress=told.append)
        return asked, max(int(text.split()[1].rstrip(":")) for text in told if text.startswith("round"))

    # one effect at each joint, then two: of the first nothing is asked
    assert rounds(misleads=True) == ([(2, 4)], 2)
    assert rounds(misleads=False) == ([(2, 4)], 3)


@pytest.mark.parametrize("step", [1e-2, 3e-3])
def test_between_steps_a_run_is_read_by_its_own_cubic(step):
    clock = step * np.arange(400)
    times = np.linspace(0.0, clock[-1], 333)
    read = coordinate_at(np.sin(3.0 * clock), 3.0 * np.cos(3.0 * clock), step, times)
    # the cubic of Hermite: h^4 / 384 times the fourth derivative
    np.testing.assert_allclose(read, np.sin(3.0 * times), atol=(3.0 * step) ** 4 / 384.0 + 1e-12)
    np.testing.assert_allclose(coordinate_at(clock, np.ones(400), step, clock), clock, rtol=1e-14)
