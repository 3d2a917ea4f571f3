"""Held-out blocks: how well an explanation predicts parts of the records that its fit did not see.

Each record is cut into blocks of time. What a fit without one block would predict there follows to first order from the fit to all of
them: the block's own pull on the parameters is taken back (an infinitesimal jackknife; exact where the response is linear in the
parameters). Blocks are the unit of evidence: differences of two explanations have a standard error over them, and the pulls of the
blocks on the parameters tell how far these are known if the model is wrong (the sandwich of the jackknife).

Blocks that repeat one motion repeat the error of a model as well, and differ too little. The weighed residuals tell another standard
error: if they are of unit variance, as they were weighed to be, that of the difference of two sums of squares is twice the norm of
the difference of the residuals. The larger one counts.

References:
    R. Giordano, R. Liu, M. I. Jordan, T. Broderick, A Swiss army infinitesimal jackknife, AISTATS 2019.
    H. White, Maximum likelihood estimation of misspecified models, Econometrica 50 (1982) 1-25 (the sandwich).
    Y. Yao, A. Vehtari, D. Simpson, A. Gelman, Using stacking to average Bayesian predictive distributions, Bayesian Analysis 13 (2018)
        (weights averaged over a bootstrap of what was held out).
    Q. H. Vuong, Likelihood ratio tests for model selection and non-nested hypotheses, Econometrica 57 (1989) 307-333.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bench.arrays import Array
from bench.discrepancy.fitting.map_fit import Fit, free_entries
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.likelihood.whitening import fast_length
from bench.discrepancy.numerics.least_squares import (
    differences,
)
from bench.discrepancy.search.explanation import Explanation
from bench.discrepancy.settings import DEFAULT


@dataclass(frozen=True, eq=False)
class HeldOut:
    """An explanation on blocks that its fit did not see.

    Attributes:
        explanation: It, the precision of its parameters lowered to what the blocks bear out.
        scores: (n_blocks,) weighed squared residuals of each block, from the fit without it.
        left: (n,) those residuals, in an order that all explanations of the same groups of degrees of freedom share.
    """

    explanation: Explanation
    scores: Array
    left: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def total(self) -> float:
        """Sum of the scores."""
        return float(np.sum(self.scores))

    def worse_than(self, other: HeldOut) -> tuple[float, float]:
        """By how much the scores exceed those of another explanation, and the standard error of that."""
        by_block = self.scores - other.scores
        over_blocks = float(np.sqrt(len(by_block)) * np.std(by_block, ddof=1))
        return float(by_block.sum()), max(over_blocks, 2.0 * self._apart(other))

    def _apart(self, other: HeldOut) -> float:
        """Norm of the difference of the residuals; zero where they are not those of the same groups of degrees of freedom."""
        same = self.left.shape == other.left.shape
        return float(np.linalg.norm(self.left - other.left)) if same else 0.0


def held_out(explanation: Explanation) -> HeldOut:
    """Predict blocks of the records from fits without them.

    Args:
        explanation: Fitted.
    """
    parts, scores, rows = [], [], []
    for problem, fitted in explanation.parts:
        residual = problem.residual(fitted.hypothesis, fitted.vector)
        changes = _changes(problem, fitted, residual)
        blocks = list(
            _blocks(
                problem, np.column_stack([residual, changes]), explanation.settings.judgement.held_out.blocks
            )
        )
        cost = np.eye(changes.shape[1]) + changes.T @ changes
        pulls, own = [], []
        for block in blocks:
            left, columns = block[:, 0], block[:, 1:]
            pull = columns.T @ left
            # a block may hold all that is known of a parameter: the prior keeps the rest invertible
            without = cost - columns.T @ columns
            moved = left + columns @ np.linalg.solve(without, pull)
            pulls.append(pull)
            own.append(float(moved @ moved))
            rows.append(moved)
        scores.append(own)
        parts.append((problem, _sandwiched(problem, fitted, cost, np.array(pulls))))
    return HeldOut(Explanation(tuple(parts)), np.sum(np.array(scores), axis=0), np.concatenate(rows))


def _changes(problem: Problem, fitted: Fit, residual: Array) -> Array:
    """Changes (n, n_free) of the residuals by one prior standard deviation of each free entry; none where a run diverges."""
    _, std, _, high = problem.prior(fitted.hypothesis)
    free = free_entries(problem, fitted.hypothesis)
    near = problem.residual_near(fitted.hypothesis, fitted.vector)
    for step in problem.settings.numerics.differences:
        found = differences(
            near,
            fitted.vector,
            residual,
            free=free,
            steps=step * std[free],
            high=high[free],
        )
        if found is not None:
            return found / step
    return np.zeros((len(residual), len(free)))


def _blocks(problem: Problem, columns: Array, count: int) -> Iterator[Array]:
    """Rows of whitened residuals and of their changes, block by block; records are joined block by block.

    Args:
        problem: Records.
        columns: (n, k) as `Problem.residual` orders the rows.
        count: Blocks of each record.
    """
    at, pieces = 0, []
    for data in problem.data:
        n_channels, k = len(problem.noise), columns.shape[1]
        if data.windows is not None:
            rows = len(data.windows.firsts) * len(data.windows.weights)
            windows = columns[at : at + rows].reshape(len(data.windows.firsts), -1, k)
            parts = [part.reshape(-1, k) for part in np.array_split(windows, count)]
        else:
            rows = 2 * data.n_bins * n_channels
            white = columns[at : at + rows].reshape(2, data.n_bins, n_channels * k)
            length = fast_length(len(data.responses))
            # Parseval: the sum of squares over time is that over the bins
            in_time = np.fft.irfft(white[0] + 1j * white[1], length, axis=0) * np.sqrt(length / 2.0)
            in_time = in_time[: len(data.responses)].reshape(-1, n_channels, k)
            parts = [part.reshape(-1, k) for part in np.array_split(in_time, count)]
        at += rows
        pieces.append(parts)
    for parts in pieces:
        yield from parts


def _sandwiched(problem: Problem, fitted: Fit, cost: Array, pulls: Array) -> Fit:
    """A fit whose covariance is the larger one of the posterior's and of the sandwich's, entry by entry of the diagonal."""
    _, std, _, _ = problem.prior(fitted.hypothesis)
    free = free_entries(problem, fitted.hypothesis)
    inverse = np.linalg.inv(cost)
    count = len(pulls)
    centred = pulls - pulls.mean(axis=0)
    sandwich = inverse @ (centred.T @ centred) @ inverse * (count / max(count - 1, 1))
    wider = np.sqrt(np.maximum(np.diag(sandwich) / np.diag(inverse), 1.0))
    covariance = inverse * np.outer(wider, wider)
    precision = fitted.precision.copy()
    precision[np.ix_(free, free)] = np.linalg.inv(covariance) / np.outer(std[free], std[free])
    return replace(fitted, precision=precision)


def shares(
    found: Sequence[HeldOut],
    priors: Array,
    rng: np.random.Generator,
    draws: int = DEFAULT.judgement.held_out.draws,
) -> Array:
    """Weights (n,) of explanations by what they predict, averaged over a Bayesian bootstrap of the blocks.

    Args:
        found: Explanations on the same blocks.
        priors: (n,) log prior of each.
        rng: For the bootstrap.
        draws: How many.
    """
    table = np.array([entry.scores for entry in found])
    times = rng.dirichlet(np.ones(table.shape[1]), size=draws) * table.shape[1]
    logs = -0.5 * times @ table.T + priors
    weights = np.exp(logs - logs.max(axis=1, keepdims=True))
    return np.asarray((weights / weights.sum(axis=1, keepdims=True)).mean(axis=0), dtype=np.float64)
