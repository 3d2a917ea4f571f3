"""Lack of fit: whether free models of a force find anything in what an explanation leaves.

Chi-squared over thousands of residuals tells little about one missing force: what it leaves drowns in the scatter of the sum.
A score test against models that promise no law has the power that the sum lacks: any force of the displacement, any
force of the velocity, their lowest products, any linear memory. All are linear in their coefficients, so the
test costs linear runs only, and the explanation's own parameters are projected out to first order.

The noise of measured loads passes the true laws on its way into the responses, not the linear model that whitens them: behind a
softening spring at full swing free models find a sixth more in it. Before an explanation is doubted, noise is drawn and sent
through it, and what they find in that is no evidence.

References:
    C. R. Rao, Large sample tests of statistical hypotheses, Proc. Cambridge Phil. Soc. 44 (1948) 50-57 (score test).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.stats import chi2

from bench.discrepancy.effects.nonparametric import MEMORY
from bench.discrepancy.fitting.map_fit import Fit
from bench.discrepancy.likelihood.problem import Array, Problem
from bench.discrepancy.likelihood.whitening import whitened
from bench.discrepancy.model.structure import Place
from bench.discrepancy.numerics.threads import in_threads
from bench.discrepancy.screening.projection import Ground
from bench.discrepancy.screening.screen import Screen
from bench.discrepancy.settings import DEFAULT, ScreeningSettings

PRODUCTS = ((1, 1), (2, 1), (1, 2))
"""Powers of displacement and velocity that a sum of two forces of one coordinate lacks."""


class LackOfFit(NamedTuple):
    """What a free model gains on top of an explanation.

    Attributes:
        model: "displacement", "velocity", "product" or "memory": what the force is free in; "any" for all of them at once.
        gain: Decrease of chi-squared.
        freedom: Number of coefficients.
        expected: What noise alone would gain on average: a unit for every coefficient, or more behind nonlinear laws.
        p_value: Probability of such a gain from noise alone, after correction for the number of models tried.
        n_residuals: Number of residuals.
        settings: When it is significant.
    """

    model: str
    gain: float
    freedom: int
    expected: float
    p_value: float
    n_residuals: int
    settings: ScreeningSettings = DEFAULT.screening

    def significant(self, explained: float, *, effects: int = 1) -> bool:
        """Whether something is left that is neither noise nor inaccuracy, of the diagnosis itself or of the laws it named.

        Args:
            explained: Chi-squared that the explanation takes away.
            effects: Number of effects that the explanation holds.
        """
        exactness = self.settings.exactness if effects < self.settings.imitating else self.settings.strictness
        inexact = max(self.settings.inaccuracy * self.n_residuals, exactness * explained)
        limit = self.settings.significance if effects <= 1 else self.settings.significance_of_several
        return self.p_value < limit and self.gain - self.expected > inexact


def lack_of_fit(problem: Problem, fitted: Fit) -> LackOfFit:
    """Score tests of an explanation against free models of a force at all places of one coordinate; the most telling one.

    Args:
        problem: Records and nominal model.
        fitted: An explanation that is down to the noise by chi-squared.
    """
    screen = Screen(problem, ()).beside(fitted, simulated=True)
    ground = screen.ground(fitted, simulated=True)
    free = _free(screen, ground)
    seen = free.columns.T @ ground.left[: len(ground.residual)]
    own = problem.settings.screening

    def telling(expected: Mapping[str, float]) -> LackOfFit:
        tests = []
        for model, gain in free.gains(seen).items():
            freedom, mean = free.freedom(model), expected[model]
            if freedom == 0:
                continue
            p_value = len(free.bases) * float(chi2.sf(gain * freedom / mean, freedom))
            tests.append(LackOfFit(model, gain, freedom, mean, min(p_value, 1.0), len(ground.residual), own))
        nothing = LackOfFit("any", 0.0, 0, 0.0, 1.0, len(ground.residual), own)
        return min(tests, key=lambda test: (test.p_value, -test.gain), default=nothing)

    found = telling({model: free.freedom(model) for model in free.bases})
    if found.p_value < problem.settings.screening.significance_of_several and np.any(
        problem.load_noise > 0.0
    ):
        found = telling(_expected(problem, fitted, free))
    return found


class _Free(NamedTuple):
    """Free models of a force, as what they can change and an explanation's parameters cannot.

    Attributes:
        columns: (n_residuals, k) responses to the coefficients of all models.
        bases: Model to the indices of its columns, and the matrix (k_model, freedom) that makes an orthogonal basis of them, whose
            products with clean residuals have unit deviation.
    """

    columns: Array
    bases: dict[str, tuple[NDArray[np.int64], Array]]

    def freedom(self, model: str) -> int:
        """Number of coefficients of a model that records can tell."""
        return self.bases[model][1].shape[1]

    def gains(self, seen: Array) -> dict[str, float]:
        """Decrease of chi-squared with each model, from the products (k,) of the columns and the residuals."""
        return {m: float(np.sum((basis.T @ seen[own]) ** 2)) for m, (own, basis) in self.bases.items()}


def _free(screen: Screen, ground: Ground) -> _Free:
    """Free models at all places of one coordinate, and all of them at once, beside what an explanation leaves."""
    settings = screen.problem.settings.screening
    models: list[str] = []
    parts: list[Array] = []
    for place in (p for p in screen.problem.structure.places if len(p.rows) == 1):
        for model, responses in free_responses(screen, place).items():
            models += [model] * responses.shape[1]
            parts.append(responses)
    columns = np.column_stack(parts)
    columns /= np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    columns -= ground.head @ (ground.head.T @ columns)
    products = columns.T @ columns
    bases = {}
    for model in (*dict.fromkeys(models), "any"):
        own = np.flatnonzero([model in (m, "any") for m in models])
        squares, vectors = np.linalg.eigh(products[np.ix_(own, own)])
        kept = squares > settings.own**2 * len(own)
        scatter = np.where(squares[kept] < settings.faint**2 * len(own), settings.scatter, 1.0)
        bases[model] = own, vectors[:, kept] / np.sqrt(squares[kept]) / scatter
    return _Free(columns, bases)


def _expected(problem: Problem, fitted: Fit, free: _Free) -> dict[str, float]:
    """What each free model gains on average from noise that has passed an explanation; at least a unit for every coefficient.

    The same draws pass the linear model as well, from which it is known what they gain on average.
    """
    rng = np.random.default_rng(0)
    n = len(problem.nominal)
    gains = dict.fromkeys(free.bases, 0.0), dict.fromkeys(free.bases, 0.0)
    clean = [
        (problem.simulate(fitted.hypothesis, fitted.vector, r), problem.simulate((), fitted.vector[:n], r))
        for r in problem.records
    ]
    for _ in range(problem.settings.screening.draws):
        drawn = problem.forgetful()
        passed: tuple[list[Array], list[Array]] = [], []
        for data, runs in zip(problem.data, clean, strict=True):
            record = problem.with_load_noise(data.record, rng)
            own = problem.noise * rng.standard_normal(data.responses.shape)
            noisy = (
                drawn.simulate(fitted.hypothesis, fitted.vector, record),
                drawn.simulate((), fitted.vector[:n], record),
            )
            for parts, run, without in zip(passed, noisy, runs, strict=True):
                parts.append(whitened(own + run - without, data))
        residuals = [np.concatenate(parts) for parts in passed]
        if not all(np.isfinite(residual).all() for residual in residuals):
            continue
        for total, residual in zip(gains, residuals, strict=True):
            for model, gain in free.gains(free.columns.T @ residual).items():
                total[model] += gain
    behind, linear = gains
    return {
        model: free.freedom(model) * max(behind[model] / max(linear[model], 1e-300), 1.0)
        for model in free.bases
    }


def free_responses(screen: Screen, place: Place) -> dict[str, Array]:
    """Whitened responses (n, k) to every coefficient of each free model at a place of one coordinate."""
    motions = [screen.problem.motion(i) for i in range(len(screen.problem.records))]
    row, problem = place.rows[0], screen.problem
    position = max(float(np.abs(m.position @ row).max()) for m in motions) or 1.0
    velocity = max(float(np.abs(m.velocity @ row).max()) for m in motions) or 1.0
    forces = [
        _free_forces(
            m.position @ row / position,
            m.velocity @ row / velocity,
            r.step * velocity / position,
            settings=screen.problem.settings.screening,
        )
        for m, r in zip(motions, problem.records, strict=True)
    ]

    def responses(model: str) -> Array:
        count = forces[0][model].shape[1]
        return np.column_stack(
            in_threads(
                lambda k: screen.response(
                    lambda i: np.asarray(-np.outer(forces[i][model][:, k], row), float)
                ),
                range(count),
            )
        )

    return {model: responses(model) for model in forces[0]}


def _free_forces(q: Array, v: Array, step: float, *, settings: ScreeningSettings) -> dict[str, Array]:
    """Forces (n, k) of unit coefficients of each free model along a motion scaled to one, time in radians of it."""
    knots = np.linspace(-1.0, 1.0, settings.knots)
    memories = []
    for time in MEMORY:
        fade = np.exp(-step / time)
        memories.append(lfilter([1.0 - fade], [1.0, -fade], v))
    return {
        "displacement": np.column_stack([np.interp(q, knots, unit) for unit in np.eye(settings.knots)]),
        "velocity": np.column_stack([np.interp(v, knots, unit) for unit in np.eye(settings.knots)]),
        "product": np.column_stack([q**a * v**b for a, b in PRODUCTS]),
        "memory": np.column_stack(memories),
    }
