"""Lack of fit: whether free models of a force find anything in what an explanation leaves.

Chi-squared over thousands of residuals tells little about one missing force: what it leaves drowns in the scatter of the sum.
A score test against models that promise no law has the power that the sum lacks: any force of the displacement, any
force of the velocity, their lowest products, any linear memory. All are linear in their coefficients, so the
test costs linear runs only, and the explanation's own parameters are projected out to first order.

References:
    C. R. Rao, Large sample tests of statistical hypotheses, Proc. Cambridge Phil. Soc. 44 (1948) 50-57 (score test).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter
from scipy.stats import chi2

from bench.discrepancy.closure import MEMORY
from bench.discrepancy.fit import Fit
from bench.discrepancy.problem import Array, Problem
from bench.discrepancy.screen import Ground, Screen
from bench.discrepancy.structure import Place

KNOTS = 12
"""Knots of a free force of one coordinate; between them it is straight."""
PRODUCTS = ((1, 1), (2, 1), (1, 2))
"""Powers of displacement and velocity that a sum of two forces of one coordinate lacks."""
NEGLIGIBLE = 3e-3
"""Part of a model's columns that has to be its own: less is nothing but the base's inaccuracy."""

SIGNIFICANCE, SEVERAL = 1e-3, 1e-2
"""Probability with which noise alone may call an explanation lacking: of one effect, and of several. What several laws together
imitate is as often one law that no catalogue holds, so it takes less to doubt them."""
INACCURACY = 0.0005
"""Part of chi-squared that is laid to the smoothing and integration of the diagnosis itself."""
EXACTNESS = 1e-4
"""Part of the chi-squared an explanation takes away that its laws may leave: a hundredth of the missing force."""
IMITATING, STRICTNESS = 3, 1e-5
"""Number of effects that together imitate nearly any force, and how exactly these have to: what they leave of it is small."""


class LackOfFit(NamedTuple):
    """What a free model gains on top of an explanation.

    Attributes:
        model: "displacement", "velocity", "product" or "memory": what the force is free in; "any" for all of them at once.
        gain: Decrease of chi-squared.
        freedom: Number of coefficients, which is what noise alone would gain on average.
        p_value: Probability of such a gain from noise alone, after correction for the number of models tried.
        n_residuals: Number of residuals.
    """

    model: str
    gain: float
    freedom: int
    p_value: float
    n_residuals: int

    def significant(self, explained: float, *, effects: int = 1) -> bool:
        """Whether something is left that is neither noise nor inaccuracy, of the diagnosis itself or of the laws it named.

        Args:
            explained: Chi-squared that the explanation takes away.
            effects: Number of effects that the explanation holds.
        """
        exactness = EXACTNESS if effects < IMITATING else STRICTNESS
        inexact = max(INACCURACY * self.n_residuals, exactness * explained)
        limit = SIGNIFICANCE if effects <= 1 else SEVERAL
        return self.p_value < limit and self.gain - self.freedom > inexact


def lack_of_fit(problem: Problem, fitted: Fit) -> LackOfFit:
    """Score tests of an explanation against free models of a force at all places of one coordinate; the most telling one.

    Args:
        problem: Records and nominal model.
        fitted: An explanation that is down to the noise by chi-squared.
    """
    screen = Screen(problem, ()).beside(fitted, simulated=True)
    ground = screen.ground(fitted, simulated=True)
    rest = ground.left[: len(ground.residual)]
    parts: dict[str, list[Array]] = {}
    for place in (p for p in problem.structure.places if len(p.rows) == 1):
        for model, columns in free_responses(screen, place).items():
            parts.setdefault(model, []).append(columns)
    models = {model: np.column_stack(columns) for model, columns in parts.items()}
    models["any"] = np.column_stack(list(models.values()))
    tests = [_tested(model, columns, ground, rest, len(models)) for model, columns in models.items()]
    return min(tests, key=lambda test: (test.p_value, -test.gain))


def _tested(model: str, columns: Array, ground: Ground, rest: Array, count: int) -> LackOfFit:
    """Score test of one free model out of `count`."""
    size = np.linalg.norm(columns, axis=0)
    columns = columns[:, size > 0.0] / size[size > 0.0]
    columns -= ground.head @ (ground.head.T @ columns)
    basis, singular, _ = np.linalg.svd(columns, full_matrices=False)
    basis = basis[:, singular > NEGLIGIBLE * np.sqrt(len(singular))]
    gain, freedom = float(np.sum((basis.T @ rest) ** 2)), basis.shape[1]
    return LackOfFit(model, gain, freedom, min(count * float(chi2.sf(gain, freedom)), 1.0), len(rest))


def free_responses(screen: Screen, place: Place) -> dict[str, Array]:
    """Whitened responses (n, k) to every coefficient of each free model at a place of one coordinate."""
    motions = [screen.problem.motion(i) for i in range(len(screen.problem.records))]
    row, problem = place.rows[0], screen.problem
    position = max(float(np.abs(m.position @ row).max()) for m in motions) or 1.0
    velocity = max(float(np.abs(m.velocity @ row).max()) for m in motions) or 1.0
    forces = [
        _free_forces(m.position @ row / position, m.velocity @ row / velocity, r.step * velocity / position)
        for m, r in zip(motions, problem.records, strict=True)
    ]

    def responses(model: str) -> Array:
        count = forces[0][model].shape[1]
        return np.column_stack(
            [
                screen.response(lambda i, k=k: np.asarray(-np.outer(forces[i][model][:, k], row), float))
                for k in range(count)
            ]
        )

    return {model: responses(model) for model in forces[0]}


def _free_forces(q: Array, v: Array, step: float) -> dict[str, Array]:
    """Forces (n, k) of unit coefficients of each free model along a motion scaled to one, time in radians of it."""
    knots = np.linspace(-1.0, 1.0, KNOTS)
    memories = []
    for time in MEMORY:
        fade = np.exp(-step / time)
        memories.append(lfilter([1.0 - fade], [1.0, -fade], v))
    return {
        "displacement": np.column_stack([np.interp(q, knots, unit) for unit in np.eye(KNOTS)]),
        "velocity": np.column_stack([np.interp(v, knots, unit) for unit in np.eye(KNOTS)]),
        "product": np.column_stack([q**a * v**b for a, b in PRODUCTS]),
        "memory": np.column_stack(memories),
    }
