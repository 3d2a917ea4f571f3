"""What a base hypothesis leaves to be explained, its parameters free to first order, and the projection of responses onto it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bench.arrays import Array


class Ground(NamedTuple):
    """What the effects of a base and the nominal parameters leave to be explained, and what they can imitate.

    Attributes:
        residual: (n,) whitened residual of the base.
        prior: (k_prior,) residual of the nominal parameters' priors where the base has them.
        head: (n, k) orthonormal basis of the base's columns, together with `tail`.
        tail: (k_prior, k) the same basis in the rows of the priors.
        nominal: (n, n_nominal) the base's columns of the nominal parameters.
        triangle: (k, k) what makes the base's columns of their basis.
    """

    residual: Array
    prior: Array
    head: Array
    tail: Array
    nominal: Array
    triangle: Array

    def moves(self, response: Array) -> Array:
        """Changes of the base's parameters (k,) that go with a response (n,) being explained by something else."""
        seen = self.head.T @ (self.residual - response) + self.tail.T @ self.prior
        return np.asarray(np.linalg.lstsq(self.triangle, seen, rcond=1e-12)[0], dtype=np.float64)

    @property
    def left(self) -> Array:
        """What the base leaves (n + k_prior,), its parameters free to first order."""
        imitated = self.head.T @ self.residual + self.tail.T @ self.prior
        return np.concatenate([self.residual - self.head @ imitated, self.prior - self.tail @ imitated])

    def project(self, response: Array) -> Array:
        """Part of a response (n,) that the base cannot imitate, the price of its priors appended."""
        imitated = self.head.T @ response
        return np.concatenate([response - self.head @ imitated, -self.tail @ imitated])
