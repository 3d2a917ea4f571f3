"""Residuals of a network with one hidden layer, with their normal equations in blocks over threads."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from bench.identification.levenberg_marquardt import SETTINGS, NormalEquations


class HiddenLayerProblem:
    """Residuals of a network on normalised data, as `minimise_regularised` takes them.

    Weights are laid out as ``A`` (n_inputs + 1, n_hidden) with the biases as last row, then ``B`` (n_outputs,
    n_hidden + 1) with the biases as last column.

    Args:
        inputs: Normalised inputs (n, n_inputs).
        outputs: Normalised outputs (n, n_outputs).
        n_hidden: Number of hidden units.
        run: Maps a function over the parts of the data, in order; the built-in `map` or an executor's.
    """

    def __init__(
        self,
        inputs: NDArray[np.float64],
        outputs: NDArray[np.float64],
        n_hidden: int,
        *,
        run: Callable[..., Iterable] = map,
    ) -> None:
        self.inputs = np.ascontiguousarray(np.column_stack([inputs, np.ones(len(inputs))]).T)
        self.outputs = np.ascontiguousarray(outputs.T)
        self.n_hidden = n_hidden
        edges = np.linspace(0, len(inputs), SETTINGS.parts + 1).astype(int)
        self._parts = [slice(int(a), int(b)) for a, b in itertools.pairwise(edges) if b > a]
        self._run = run

    @property
    def n_residuals(self) -> int:
        """Number of residuals: samples times outputs."""
        return self.outputs.size

    @property
    def n_weights(self) -> int:
        """Number of weights and biases."""
        return self.n_hidden * len(self.inputs) + (self.n_hidden + 1) * len(self.outputs)

    def unpack(self, weights: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Views of the weights as A (n_inputs + 1, n_hidden) and B (n_outputs, n_hidden + 1)."""
        hidden = len(self.inputs) * self.n_hidden
        return weights[:hidden].reshape(-1, self.n_hidden), weights[hidden:].reshape(-1, self.n_hidden + 1)

    def residuals(self, weights: NDArray[np.float64]) -> NDArray[np.float64]:
        """Network less data (n_outputs, n)."""
        return self._residuals(weights, slice(None))

    def sum_of_squares(self, weights: NDArray[np.float64]) -> float:
        """Sum of the squared residuals."""
        parts = self._run(lambda part: self._residuals(weights, part), self._parts)
        return float(sum(np.vdot(residual, residual) for residual in parts))

    def normal_equations(self, weights: NDArray[np.float64]) -> NormalEquations:
        """``J'J``, ``J'r`` and ``r'r`` from the Gram matrix of ``[g_j x_i, h_j, 1]``."""
        grams, correlations, squares = zip(
            *self._run(lambda part: self._gram(weights, part), self._parts), strict=True
        )
        gram, correlation = np.add.reduce(grams), np.add.reduce(correlations)
        width, count = self.n_hidden, len(self.inputs) * self.n_hidden
        gains = np.tile(self.unpack(weights)[1][:, :-1], (1, len(self.inputs)))
        matrix = np.zeros((self.n_weights, self.n_weights))
        gradient = np.empty(self.n_weights)
        matrix[:count, :count] = gram[:count, :count] * (gains.T @ gains)
        gradient[:count] = np.sum(correlation[:count] * gains.T, axis=1)
        for o, gain in enumerate(gains):
            own = slice(count + o * (width + 1), count + (o + 1) * (width + 1))
            matrix[own, own] = gram[count:, count:]
            matrix[own, :count] = gram[count:, :count] * gain
            matrix[:count, own] = matrix[own, :count].T
            gradient[own] = correlation[count:, o]
        return NormalEquations(matrix, gradient, float(sum(squares)))

    def curvature_gradient(
        self, weights: NDArray[np.float64], step: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """``J'`` times the second derivative of the residuals along `step`."""
        return np.add.reduce(list(self._run(lambda part: self._curvature(weights, step, part), self._parts)))

    def _residuals(self, weights: NDArray[np.float64], part: slice) -> NDArray[np.float64]:
        A, B = self.unpack(weights)
        return B[:, :-1] @ np.tanh(A.T @ self.inputs[:, part]) + B[:, -1:] - self.outputs[:, part]

    def _gram(self, weights: NDArray[np.float64], part: slice) -> tuple[NDArray, NDArray, float]:
        A, B = self.unpack(weights)
        count = A.size
        inputs, outputs = self.inputs[:, part], self.outputs[:, part]
        wide = np.ones((count + self.n_hidden + 1, SETTINGS.block))
        gram = np.zeros((len(wide), len(wide)))
        correlation = np.zeros((len(wide), len(outputs)))
        squares = 0.0
        for first in range(0, inputs.shape[1], SETTINGS.block):
            x, y = inputs[:, first : first + SETTINGS.block], outputs[:, first : first + SETTINGS.block]
            k = wide[:, : x.shape[1]]
            hidden = np.tanh(A.T @ x)
            k[:count] = ((1.0 - hidden * hidden)[None] * x[:, None]).reshape(count, -1)
            k[count:-1] = hidden
            residual = B[:, :-1] @ hidden + B[:, -1:] - y
            gram += k @ k.T
            correlation += k @ residual.T
            squares += float(np.vdot(residual, residual))
        return gram, correlation, squares

    def _curvature(
        self, weights: NDArray[np.float64], step: NDArray[np.float64], part: slice
    ) -> NDArray[np.float64]:
        (A, B), (dA, dB) = self.unpack(weights), self.unpack(step)
        x = self.inputs[:, part]
        hidden = np.tanh(A.T @ x)
        slope = 1.0 - hidden * hidden
        along = dA.T @ x
        first = slope * along
        second = 2.0 * dB[:, :-1] @ first - 2.0 * B[:, :-1] @ (hidden * first * along)
        back_hidden = x @ ((B[:, :-1].T @ second) * slope).T
        back_output = np.hstack([second @ hidden.T, second.sum(axis=1, keepdims=True)])
        return np.concatenate([back_hidden.ravel(), back_output.ravel()])

    def random_weights(self, rng: np.random.Generator) -> NDArray[np.float64]:
        """A random start: hidden units spread over the inputs (Nguyen and Widrow 1990), outputs by least squares."""
        n_inputs = len(self.inputs) - 1
        direction = rng.standard_normal((n_inputs, self.n_hidden))
        direction /= np.linalg.norm(direction, axis=0)
        size = 0.7 * self.n_hidden ** (1.0 / n_inputs)
        A = np.vstack([size * direction, size * rng.uniform(-1.0, 1.0, self.n_hidden)])
        hidden = np.vstack([np.tanh(A.T @ self.inputs), np.ones(self.inputs.shape[1])])
        # A little ridge: units that saturate alike over the data leave the output weights undetermined.
        normal = hidden @ hidden.T + 1e-3 * np.eye(len(hidden))
        B = np.linalg.solve(normal, hidden @ self.outputs.T).T
        return np.concatenate([A.ravel(), B.ravel()]).astype(np.float64)
