"""An explanation as a Gaussian belief: what it predicts of a test, and how sure it is of that."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.likelihood.problem import Array
from bench.discrepancy.likelihood.whitening import RecordData, whitened
from bench.discrepancy.response.simulator import Simulator
from bench.discrepancy.search.explanation import Explanation


class Belief(NamedTuple):
    """An explanation as a Gaussian belief.

    Attributes:
        explanation: The explanation.
        vector: (n,) parameters of all its parts.
        root: (n, n) square root of their posterior covariance.
    """

    explanation: Explanation
    vector: Array
    root: Array

    @classmethod
    def of(cls, explanation: Explanation) -> Belief:
        """The posterior of an explanation."""
        precision = np.asarray(block_diag(*(fitted.precision for _, fitted in explanation.parts)), np.float64)
        values, vectors = np.linalg.eigh(0.5 * (precision + precision.T))
        # a direction that not even the prior holds would be no direction of the fit
        root = vectors / np.sqrt(np.maximum(values, 1e-8 * values.max()))
        return cls(explanation, np.concatenate([f.vector for _, f in explanation.parts]), root)

    def respond(self, simulator: Simulator, record: CaseRecord, vector: Array | None = None) -> Array:
        """Responses (n, n_channels) to a record's loads, in the order of the channels of `problem`."""
        chosen = self.vector if vector is None else vector
        out = np.zeros((len(record), len(simulator.structure.channels)))
        at = 0
        for part, fitted in self.explanation.parts:
            own = chosen[at : at + len(fitted.vector)]
            at += len(fitted.vector)
            samples = part.simulate(fitted.hypothesis, own, record)
            for c, name in enumerate(part.structure.channels):
                out[:, simulator.structure.channels.index(name)] = samples[:, c]
        return out

    def within(self, vector: Array) -> Array:
        """A vector clipped to the bounds of the priors."""
        low, high = [], []
        for part, fitted in self.explanation.parts:
            _, _, lower, upper = part.prior(fitted.hypothesis)
            low.append(lower)
            high.append(upper)
        return np.clip(vector, np.concatenate(low), np.concatenate(high))

    def sensitivity(self, simulator: Simulator, data: RecordData, base: Array) -> Array:
        """Derivative (n_residuals, n) of the whitened response along the columns of `root`."""
        columns = []
        for column in self.root.T:
            moved = self.within(self.vector + 0.2 * column)
            share = float((moved - self.vector) @ column / max(column @ column, 1e-300))
            if share < 0.1:
                moved = self.within(self.vector - 0.2 * column)
                share = float((moved - self.vector) @ column / max(column @ column, 1e-300))
            if abs(share) < 1e-6:
                columns.append(np.zeros(len(base)))
                continue
            changed = whitened(self.respond(simulator, data.record, moved), data)
            columns.append((changed - base) / share if np.isfinite(changed).all() else np.zeros(len(base)))
        return np.column_stack(columns)
