"""Lack of fit: whether free models of a force find anything in what an explanation leaves.

Chi-squared over thousands of residuals tells little about one missing force: what it leaves drowns in the scatter of the sum.
A score test against models that promise no law has the power that the sum lacks: any force of the displacement, any
force of the velocity, their lowest products, any linear memory. All are linear in their coefficients, so the
test costs linear runs only, and the explanation's own parameters are projected out to first order.

The noise of measured loads passes the true laws on its way into the responses, not the linear model that whitens them: behind a
softening spring at full swing a resonance answers it several times as strongly. Before an explanation is doubted, noise is
drawn and sent through it, and what the free models find in that is no evidence.

References:
    C. R. Rao, Large sample tests of statistical hypotheses, Proc. Cambridge Phil. Soc. 44 (1948) 50-57 (score test).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter
from scipy.stats import chi2

from bench.discrepancy.closure import MEMORY
from bench.discrepancy.fit import Fit
from bench.discrepancy.prepared import whitened
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
DRAWS = 16
"""Draws of the noise that are sent through an explanation in doubt: what they gain is known to some 10 % then."""
IMITATING, STRICTNESS = 3, 1e-5
"""Number of effects that together imitate nearly any force, and how exactly these have to: what they leave of it is small."""


class LackOfFit(NamedTuple):
    """What a free model gains on top of an explanation.

    Attributes:
        model: "displacement", "velocity", "product" or "memory": what the force is free in; "any" for all of them at once.
        gain: Decrease of chi-squared.
        freedom: Number of coefficients.
        expected: What noise alone would gain on average: a unit for every coefficient, or more behind nonlinear laws.
        p_value: Probability of such a gain from noise alone, after correction for the number of models tried.
        n_residuals: Number of residuals.
    """

    model: str
    gain: float
    freedom: int
    expected: float
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
        return self.p_value < limit and self.gain - self.expected > inexact


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
    bases = {model: _basis(columns, ground) for model, columns in models.items()}

    def telling(expected: Mapping[str, float]) -> LackOfFit:
        tests = [_tested(model, basis, rest, expected[model], len(bases)) for model, basis in bases.items()]
        return min(tests, key=lambda test: (test.p_value, -test.gain))

    found = telling({model: basis.shape[1] for model, basis in bases.items()})
    if found.p_value < SEVERAL and np.any(problem.load_noise > 0.0):
        found = telling(_expected(problem, fitted, bases))
    return found


def _basis(columns: Array, ground: Ground) -> Array:
    """Orthonormal basis (n_residuals, freedom) of what a free model can change and the explanation's parameters cannot."""
    size = np.linalg.norm(columns, axis=0)
    columns = columns[:, size > 0.0] / size[size > 0.0]
    columns -= ground.head @ (ground.head.T @ columns)
    basis, singular, _ = np.linalg.svd(columns, full_matrices=False)
    return basis[:, singular > NEGLIGIBLE * np.sqrt(len(singular))]


def _tested(model: str, basis: Array, rest: Array, expected: float, count: int) -> LackOfFit:
    """Score test of one free model out of `count`, whose coefficients noise makes gain so much."""
    gain, freedom = float(np.sum((basis.T @ rest) ** 2)), basis.shape[1]
    scaled = gain * freedom / max(expected, 1e-300)
    return LackOfFit(
        model, gain, freedom, expected, min(count * float(chi2.sf(scaled, freedom)), 1.0), len(rest)
    )


def _expected(problem: Problem, fitted: Fit, bases: Mapping[str, Array]) -> dict[str, float]:
    """What each free model gains on average from noise that has passed an explanation; at least a unit for every coefficient.

    The same draws pass the linear model as well, from which it is known what they gain on average.
    """
    rng = np.random.default_rng(0)
    n = len(problem.nominal)
    gains = {model: np.zeros(2) for model in bases}
    clean = [
        (problem.simulate(fitted.hypothesis, fitted.vector, r), problem.simulate((), fitted.vector[:n], r))
        for r in problem.records
    ]
    for _ in range(DRAWS):
        drawn = problem.forgetful()
        passed: tuple[list[Array], list[Array]] = [], []
        for data, runs in zip(problem.data, clean, strict=True):
            values = {
                name: data.record.values[name] + level * rng.standard_normal(len(data.record))
                for name, level in zip(problem.structure.loads, problem.load_noise, strict=True)
            }
            record = replace(data.record, values={**data.record.values, **values})
            own = problem.noise * rng.standard_normal(data.responses.shape)
            noisy = (
                drawn.simulate(fitted.hypothesis, fitted.vector, record),
                drawn.simulate((), fitted.vector[:n], record),
            )
            for parts, run, without in zip(passed, noisy, runs, strict=True):
                parts.append(whitened(own + run - without, data))
        residuals = np.column_stack([np.concatenate(parts) for parts in passed])
        if not np.isfinite(residuals).all():
            continue
        for model, basis in bases.items():
            gains[model] += np.sum((basis.T @ residuals) ** 2, axis=0)
    return {
        model: basis.shape[1] * max(float(gains[model][0] / gains[model][1]), 1.0)
        for model, basis in bases.items()
    }


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
