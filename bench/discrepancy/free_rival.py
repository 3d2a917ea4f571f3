"""A free rival: one force with a linear memory of any shape in place of the laws that an explanation names.

Rubber remembers over decades of time. Within the band of a record one or two relaxations of the catalogue imitate that, with a
flexible base or a wrong gain making up for the rest, and what they leave is lost in the noise. But they are more laws, or more
finely tuned ones, than what they imitate: the evidence of a single memory that promises no law is higher then, while a
relaxation that is one has the better evidence itself.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from threadpoolctl import threadpool_limits

from bench.discrepancy.closure import FREE_MEMORY
from bench.discrepancy.explain import Explanation
from bench.discrepancy.fit import Fit, fit
from bench.discrepancy.placements import placements
from bench.discrepancy.problem import Problem
from bench.discrepancy.screen import Screen
from bench.discrepancy.search import THOROUGH, THREADS, posterior

IN_SIGHT = 1.2
"""Chi-squared that the screening must promise a memory to reach, over that of the explanation: a linear force keeps its promise."""


def likelier_memory(best: Explanation) -> Explanation | None:
    """The explanation with a free linear memory in place of all effects of a group of degrees of freedom, where that is likelier.

    Args:
        best: An explanation that leaves nothing but noise.

    Returns:
        The likelier explanation; None where the laws are, in every group.
    """
    if any(problem.windowed or not problem.noise_stated for problem, _ in best.parts):
        return None
    rivals = [_rival(problem, fitted) for problem, fitted in best.parts]
    if all(rival is None for rival in rivals):
        return None
    return Explanation(
        tuple((p, rival or fitted) for (p, fitted), rival in zip(best.parts, rivals, strict=True))
    )


def _rival(problem: Problem, fitted: Fit) -> Fit | None:
    """The fit of a free memory alone, where it is likelier than a hypothesis."""
    candidates = placements(problem.case, problem.structure, [FREE_MEMORY]) if fitted.hypothesis else []
    if not candidates:
        return None
    with ThreadPoolExecutor(THREADS) as pool, threadpool_limits(1, user_api="blas"):
        zero = np.zeros(len(problem.nominal))
        nothing = fit(problem, (), start=zero, iterations=THOROUGH, each=pool.map)
        points = Screen(problem, candidates, pool.map).ranked(nothing)[:1]
        promised = nothing.chi2 - sum(point.gain for point in points)
        if not points or promised > IN_SIGHT * fitted.chi2:
            return None
        start = np.concatenate([nothing.vector, points[0].eta])
        rival = fit(problem, (points[0].placed,), start=start, iterations=THOROUGH, each=pool.map)
    return rival if posterior(rival) > posterior(fitted) else None
