"""The covariance as ``P = U D U^T``: Bierman's measurement update, compiled.

U is unit upper triangular and D positive by construction, so P cannot lose symmetry or definiteness by rounding, however
long the stream. Column j of U lies in row j of the array, which makes the inner loops contiguous. The same update by
P itself is shorter and fails in single precision or after some 1e7 ill-conditioned samples.

References:
    Bierman, G. J. 1977, Factorization Methods for Discrete Sequential Estimation, section V.3.
"""

from __future__ import annotations

from bench.identification.layout import fast


@fast
def square_sum(phi):
    """phi^T phi."""
    total = 0.0
    for i in range(phi.size):
        total += phi[i] * phi[i]
    return total


@fast
def trace(d, u):
    """Trace of U D U^T."""
    total = 0.0
    for j in range(d.size):
        column = 1.0
        for i in range(j):
            column += u[j, i] * u[j, i]
        total += d[j] * column
    return total


@fast
def gain_direction(d, u, phi, b):
    """b = P phi; returns phi^T P phi."""
    n = d.size
    variance = 0.0
    for j in range(n):
        f = phi[j]
        for i in range(j):
            f += u[j, i] * phi[i]
        v = d[j] * f
        variance += f * v
        for i in range(j):
            b[i] += u[j, i] * v
        b[j] = v
    return variance


@fast
def bierman(d, u, phi, b, rho, growth):
    """Update the factors of ``growth * P`` by one measurement of variance rho; b becomes P phi, returns its variance."""
    alpha = rho
    inverse = 1.0 / rho
    for j in range(d.size):
        f = phi[j]
        for i in range(j):
            f += u[j, i] * phi[i]
        d_j = d[j] * growth
        v = d_j * f
        before = alpha
        alpha += f * v
        ratio = -f * inverse
        inverse = 1.0 / alpha
        d[j] = d_j * (before * inverse)
        for i in range(j):
            u_ij = u[j, i]
            u[j, i] = u_ij + b[i] * ratio
            b[i] += u_ij * v
        b[j] = v
    return alpha
