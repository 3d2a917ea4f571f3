"""Maximum a posteriori fits of hypotheses about an articulated model.

The joints share nothing but the bodies (masses, inertias, centres of mass) and what parts of one type have in common. So a hypothesis
about one joint is fitted with that joint's runs alone; what the others know of these enters as a quadratic form, once their own
parameters are eliminated (`Others`). The
residuals of a joint are divided by the scale that the last fit left on it, at least one: the fit of one joint is then not ruled by
another at which something else is missing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array
from bench.discrepancy.articulated_effects.hypothesis import JointHypothesis
from bench.discrepancy.articulated_search.misfit import Octaves
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.numerics.least_squares import Prior, minimise
from bench.discrepancy.numerics.made_once import MadeOnce
from bench.discrepancy.numerics.threads import THREADS, in_threads


@dataclass(frozen=True, eq=False)
class ArticulatedFit:
    """A fitted hypothesis.

    Attributes:
        hypothesis: Its effects.
        vector: Estimates.
        covariance: Of the vector; the residuals' scales are those which they leave, at least one.
        chi2: (n_joints, n_octaves) sums of squared whitened innovations.
        octaves: In which they are weighed.
        log_posterior: Laplace approximation of the log posterior of the hypothesis, up to a constant.
    """

    hypothesis: JointHypothesis
    vector: Array
    covariance: Array
    chi2: Array
    octaves: Octaves
    log_posterior: float

    @classmethod
    def at(cls, problem: ArticulatedProblem, hypothesis: JointHypothesis, vector: Array) -> ArticulatedFit:
        """A hypothesis as it stands at a vector (whose further entries are left out), not fitted and without a posterior."""
        size = problem.size(hypothesis)
        residuals = [problem.residual(j, hypothesis, vector[:size]) for j in range(len(problem.joints))]
        chi2 = np.array([problem.octaves.power(j, r) for j, r in enumerate(residuals)])
        _, std, _, _ = problem.prior(hypothesis)
        return cls(hypothesis, vector[:size], np.diag(std**2), chi2, problem.octaves, -np.inf)

    @property
    def reduced(self) -> Array:
        """Mean squared whitened innovation (n_joints,) of every joint; one where nothing is missing."""
        return np.asarray(self.chi2.sum(axis=1) / self.octaves.count.sum(axis=1))

    @property
    def misfit(self) -> Array:
        """Twice the negative log likelihood (n_joints,) of every joint, its scales profiled out."""
        return np.array([self.octaves.misfit(j, power) for j, power in enumerate(self.chi2)])

    @property
    def beyond_noise(self) -> Array:
        """What of that (n_joints,) noise alone does not make; octaves in which less is left than was stated make up for no other."""
        return self.misfit - np.minimum(self.chi2, self.octaves.count).sum(axis=1)

    @property
    def scale(self) -> Array:
        """Scale (n_joints, n_octaves) of the residuals, at least one."""
        return self.octaves.scale(self.chi2)


@dataclass(frozen=True, eq=False)
class Others:
    """What a fit says of every joint, for fits of hypotheses about a few of them.

    Attributes:
        base: The fit.
        factors: (n_joints,) of triangular (n_shared, n_shared) factors of the information on the deviations of what they share.
        targets: (n_joints,) of what factor times deviation should be (n_shared,).
    """

    base: ArticulatedFit
    factors: tuple[Array, ...]
    targets: tuple[Array, ...]

    @classmethod
    def of(cls, problem: ArticulatedProblem, base: ArticulatedFit) -> Others:
        """Linearise every joint about a fit and eliminate its own parameters."""
        shared = list(problem.shared)

        def eliminated(j: int) -> tuple[Array, Array]:
            own = own_entries(problem, base.hypothesis, j)
            columns = own + shared
            jacobian, residual = linearised(
                problem, base, j, columns, base.scale[j][problem.octaves.index[j]]
            )
            _, std, _, _ = problem.prior(base.hypothesis)
            mean, _, _, _ = problem.prior(base.hypothesis)
            rows = np.zeros((len(own), len(columns)))
            rows[np.arange(len(own)), np.arange(len(own))] = 1.0 / std[own]
            deviation = (base.vector[own] - mean[own]) / std[own]
            stacked = np.column_stack([np.vstack([jacobian, rows]), np.concatenate([residual, deviation])])
            r = np.asarray(np.linalg.qr(stacked, mode="r"))
            k, m = len(own), len(shared)
            factor, left = r[k : k + m, k : k + m], r[k : k + m, -1]
            return factor, factor @ base.vector[shared] - left

        found = in_threads(eliminated, range(len(problem.joints)))
        return cls(base, tuple(f for f, _ in found), tuple(t for _, t in found))


def own_entries(problem: ArticulatedProblem, hypothesis: JointHypothesis, j: int) -> list[int]:
    """Entries of a vector that belong to joint `j` alone: its nominal parameters, and the free ones of effects there."""
    out, at = list(problem.locals(j)), len(problem.nominal)
    for placed in hypothesis:
        for p in placed.effect.parameters:
            if problem.reached((placed,)) == (j,) and not p.fixed:
                out.append(at)
            at += 1
    return out


class _Runs:
    """Residuals of joints at vectors of a hypothesis, the last few of every joint kept.

    What one joint has of its own moves no other: most columns of a Jacobian take one run. A joint's records are run in parts, so that no
    thread waits while a step is tried.
    """

    def __init__(self, problem: ArticulatedProblem, hypothesis: JointHypothesis) -> None:
        self.problem, self.hypothesis = problem, hypothesis
        self.entries = [problem.entries(j, hypothesis) for j in range(len(problem.joints))]
        n = len(problem.records)
        ends = np.linspace(0, n, min(n, THREADS) + 1).astype(int).tolist()
        self.parts = [slice(*ends_of) for ends_of in pairwise(ends)]
        kept = problem.settings.articulated.kept_runs * len(self.parts)
        self.kept = [MadeOnce[Array](kept) for _ in problem.joints]

    def residuals(self, joints: Sequence[int], vector: Array) -> list[Array]:
        """Residuals of the records of joints, in parts, one joint after the other; not to be written to."""

        def residual(j: int, part: slice) -> Array:
            key = part.start, vector[self.entries[j]].tobytes()
            return self.kept[j].get(key, lambda: self.problem.residual(j, self.hypothesis, vector, part))

        return in_threads(lambda at: residual(*at), [(j, part) for j in joints for part in self.parts])


def linearised(
    problem: ArticulatedProblem, base: ArticulatedFit, j: int, columns: Sequence[int], scale: Array | float
) -> tuple[Array, Array]:
    """Jacobian (n, n_columns) and residual (n,) of joint `j` at a fit, over a scale (n,)."""
    settings = problem.settings.articulated
    _, std, _, high = problem.prior(base.hypothesis)
    residual = problem.residual(j, base.hypothesis, base.vector) / scale
    felt = set(problem.entries(j, base.hypothesis).tolist())

    def column(i: int) -> Array:
        if i not in felt:
            return np.zeros_like(residual)
        step = (
            settings.difference * std[i]
            if base.vector[i] + settings.difference * std[i] <= high[i]
            else -settings.difference * std[i]
        )
        moved = base.vector.copy()
        moved[i] += step
        return (problem.residual(j, base.hypothesis, moved) / scale - residual) / step

    return np.column_stack([column(i) for i in columns]) if len(columns) else np.zeros(
        (len(residual), 0)
    ), residual


class _Fitting:
    """Fits of one hypothesis with one scale after the other, each of which begins with what the last one knows.

    Args:
        problem: As of `fit`.
        hypothesis: As of `fit`.
        others: As of `fit`.
    """

    def __init__(
        self, problem: ArticulatedProblem, hypothesis: JointHypothesis, others: Others | None
    ) -> None:
        self.problem, self.hypothesis, self.others = problem, hypothesis, others
        n_joints = len(problem.joints)
        new = hypothesis[len(others.base.hypothesis) :] if others else hypothesis
        self.active = problem.reached(new) if others and new else tuple(range(n_joints))
        self.passive = [j for j in range(n_joints) if j not in self.active]
        self.free = free_entries(problem, hypothesis, self.active if self.passive else None)
        self.runs = _Runs(problem, hypothesis)
        self.jacobian: Array | None = None

    def fit(self, start: Array, scale: Array, iterations: int, limit: float = np.inf) -> ArticulatedFit:
        """Fit with a scale (n_joints, n_octaves); the first fit from any start or several, the next from where the last one ended."""
        problem, others, shared = self.problem, self.others, list(self.problem.shared)
        settings = problem.settings.articulated
        units = [scale[j][problem.octaves.index[j]] for j in self.active]
        every = np.concatenate([*units, np.ones(len(shared) * len(self.passive))])

        def residual_at(vector: Array) -> Array:
            parts = self.runs.residuals(self.active, vector)
            for j in self.passive:
                assert others is not None
                parts.append(others.factors[j] @ vector[shared] - others.targets[j])
            found = np.concatenate(parts)
            found /= every
            return found

        mean, std, low, high = problem.prior(self.hypothesis)
        reach = np.where(self.free < len(problem.nominal), settings.nominal_reach, settings.effect_reach)
        known = None if self.jacobian is None else self.jacobian / every[:, None]
        chosen = problem.settings.numerics
        if any(placed.effect.play and problem.joints[placed.joint].held for placed in self.hypothesis):
            chosen = replace(chosen, differences=chosen.rough)
        found = minimise(
            residual_at, start, prior=Prior(mean, std, low, high), free=self.free, reach=reach, iterations=iterations, limit=limit,
            deadline=problem.deadline, settings=chosen, known=known)  # fmt: skip
        self.jacobian = None if found.jacobian is None else found.jacobian * every[:, None]
        return _summary(self, found.vector, found.curvature)


def fit(
    problem: ArticulatedProblem,
    hypothesis: JointHypothesis,
    start: Array,
    *,
    scale: Array,
    iterations: int,
    others: Others | None = None,
    limit: float = np.inf,
) -> ArticulatedFit:
    """Fit a hypothesis.

    Args:
        problem: Records and priors.
        hypothesis: Effects.
        start: Vector to start from, or several (k, n).
        scale: (n_joints, n_octaves) of the residuals.
        iterations: Most steps.
        others: What is known of the joints that the hypothesis does not change beyond its base's; they are all run where None.
        limit: Cost that has to be within sight.
    """
    return _Fitting(problem, hypothesis, others).fit(start, scale, iterations, limit)


def refitted(
    problem: ArticulatedProblem,
    hypothesis: JointHypothesis,
    start: Array,
    *,
    scale: Array,
    others: Others | None = None,
    least: float = -np.inf,
) -> ArticulatedFit:
    """Fit a hypothesis again and again, each time with the scale that the last fit left, until it leaves the scale that it was given.

    The log-likelihood with its scales profiled out is concave in the squares, so that every such fit is a step of a majorisation and
    none loses. One fit alone may stop where a joint that it has spoilt is believed no more, and what its parameters are known to, which
    weighs it against others, is that of the scale at the start.

    Args:
        problem: Records and priors.
        hypothesis: Effects.
        start: Vector to start from, or several (k, n).
        scale: (n_joints, n_octaves) of the residuals at the start.
        others: As of `fit`.
        least: Log posterior short of which it is fitted once.

    References:
        D. R. Hunter and K. Lange, A tutorial on MM algorithms, The American Statistician 58 (2004) 30-37.
    """
    settings = problem.settings.articulated.search
    fitting = _Fitting(problem, hypothesis, others)
    found = fitting.fit(start, scale, settings.iterations)
    for _ in range(settings.refits - 1):
        if found.log_posterior < least or np.allclose(found.scale, scale, rtol=settings.rescaled):
            break
        scale = found.scale
        found = fitting.fit(found.vector, scale, settings.iterations)
    return found


def free_entries(
    problem: ArticulatedProblem, hypothesis: JointHypothesis, active: Sequence[int] | None = None
) -> NDArray[np.int64]:
    """Entries that a fit moves: all that are free, or those of the active joints and what joints share."""
    out = [
        i
        for i, p in enumerate(problem.nominal)
        if active is None or p.shared or any(j in active for j in p.joints)
    ]
    at = len(problem.nominal)
    for placed in hypothesis:
        for p in placed.effect.parameters:
            mine = active is None or any(j in active for j in problem.reached((placed,)))
            if not p.fixed and mine:
                out.append(at)
            at += 1
    return np.array(out, dtype=np.int64)


def _summary(fitting: _Fitting, vector: Array, curvature: Array) -> ArticulatedFit:
    problem, hypothesis, others, free = fitting.problem, fitting.hypothesis, fitting.others, fitting.free
    octaves = problem.octaves
    chi2 = np.zeros_like(octaves.count)
    for j in range(len(problem.joints)):
        if j in fitting.active or others is None:
            chi2[j] = octaves.power(j, np.concatenate(fitting.runs.residuals([j], vector)))
        else:
            # what the other joints lose by bodies that suit this one
            shared = list(problem.shared)
            base = others.base
            now = others.factors[j] @ vector[shared] - others.targets[j]
            then = others.factors[j] @ base.vector[shared] - others.targets[j]
            whole = float(np.sum(base.chi2[j] / base.scale[j] ** 2))
            chi2[j] = base.chi2[j] * max(1.0 + float(now @ now - then @ then) / whole, 0.0)
    total = sum(octaves.misfit(j, chi2[j]) for j in range(len(chi2)))
    mean, std, _, _ = problem.prior(hypothesis)
    covariance = np.zeros((len(vector), len(vector)))
    inverse = np.linalg.pinv(curvature)
    covariance[np.ix_(free, free)] = inverse * np.outer(std[free], std[free])
    every = free_entries(problem, hypothesis, None)
    deviation = ((vector - mean) / std)[every]
    sign, logdet = np.linalg.slogdet(curvature)
    occam = -0.5 * float(logdet) if sign > 0 else 0.0
    if others is not None and len(free) < len(every):
        occam += _occam_of_rest(others, set(free.tolist()), std)
    log_posterior = -0.5 * total - 0.5 * float(deviation @ deviation) + occam
    return ArticulatedFit(hypothesis, vector, covariance, chi2, octaves, log_posterior)


def _occam_of_rest(others: Others, moved: set[int], std: Array) -> float:
    """Occam factor of the parameters that a fit did not move, as its base had it: the same in all that are compared."""
    covariance = others.base.covariance / np.outer(
        std[: len(others.base.vector)], std[: len(others.base.vector)]
    )
    rest = [i for i in range(len(covariance)) if i not in moved and covariance[i, i] > 0.0]
    return 0.0 if not rest else 0.5 * float(np.linalg.slogdet(covariance[np.ix_(rest, rest)])[1])
