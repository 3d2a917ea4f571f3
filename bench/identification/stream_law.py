"""The adaptive law on a stream: one step of least squares with forgetting, and its reset after a jump.

The update is the exact solution over one step, with ``phi`` and ``m_s`` held, of the least-squares law with forgetting
and normalisation (Ioannou & Sun 1996, section 4.3; printed without the error in Tasbihgoo 2006, eq. 2.8)::

    theta' = P phi eps,  eps = (z - theta^T phi) / m_s^2,  m_s^2 = 1 + phi^T phi
    P' = beta P - P phi phi^T P / m_s^2   while |P| <= R0, else 0

In information form, ``(P^-1)' = -beta P^-1 + phi phi^T / m_s^2``, this is linear and integrates to a recursive least-squares
step of forgetting factor ``mu = exp(-beta h)`` and weight ``g / m_s^2``, ``g = (1 - mu) / beta``: stable for any step, where
an Euler step of the law is not. The printed bound, read literally, never leaves ``P' = 0`` again; here a step that would
carry ``trace(P)`` (an upper bound of the spectral norm) beyond R0 is refused, the next is tried again.

References:
    Ioannou, P. A. and Sun, J. 1996, Robust Adaptive Control, sections 4.3.6-4.3.7.
"""

from __future__ import annotations

from bench.identification.factors import bierman, gain_direction, square_sum, trace
from bench.identification.layout import (
    BETA,
    BOUND,
    FAST,
    GAIN,
    JUMP,
    JUMP_TIME,
    MU,
    NORMALISE,
    P0,
    POWER,
    PRIOR,
    RESET,
    SLOW,
    T_LAST,
    T_RESET,
    TRACE,
    USED,
    Z_HAT,
    Z,
    inlined,
    jit,
)


@jit
def reset_covariance(h, d, u):
    """P = P0 I: the estimate of now is the start from here on, see `advance`."""
    h[PRIOR] = 1.0
    for j in range(d.size):
        d[j] = h[P0]
        for i in range(j):
            u[j, i] = 0.0
    h[TRACE] = h[P0] * d.size


@inlined
def learn(h, theta, d, u, phi, b, z, step):
    """One step of the law; returns the flags raised. b is work space."""
    n = d.size
    z_hat = 0.0
    for i in range(n):
        z_hat += theta[i] * phi[i]
    h[Z] = z
    h[Z_HAT] = z_hat
    rho = 1.0 / h[GAIN]
    if h[NORMALISE] > 0.0:
        rho *= 1.0 + square_sum(phi)
    growth = 1.0
    if h[BETA] > 0.0:
        growth = 1.0 / h[MU]
        before = h[PRIOR]
        h[PRIOR] = before * h[MU]
        # The trace is followed from above, and worked out only when it may be too large.
        if h[TRACE] * growth > h[BOUND]:
            for i in range(n):
                b[i] = 0.0
            now = trace(d, u)
            alpha = rho + growth * gain_direction(d, u, phi, b)
            removed = 0.0
            for i in range(n):
                removed += b[i] * b[i]
            after = growth * now - growth * growth * removed / alpha
            h[TRACE] = now
            if after > h[BOUND]:
                h[PRIOR] = before
                alpha = rho + (alpha - rho) / growth
                error = z - z_hat
                for i in range(n):
                    theta[i] += b[i] * (error / alpha)
                return watch_jump(h, d, u, error * error * rho / alpha, z, step)
    h[TRACE] *= growth
    for i in range(n):
        b[i] = 0.0
    alpha = bierman(d, u, phi, b, rho, growth)
    error = z - z_hat
    correction = error / alpha
    for i in range(n):
        theta[i] += b[i] * correction
    return watch_jump(h, d, u, error * error * rho / alpha, z, step)


@inlined
def watch_jump(h, d, u, innovation, z, step):
    """Reset the covariance when the recent normalised innovation stands far above its long average."""
    h[USED] += 1.0
    if h[JUMP] <= 0.0:
        return 0
    quick = min(step / h[JUMP_TIME], 1.0)
    slow = min(step / (20.0 * h[JUMP_TIME]), 1.0)
    # The averages start as plain means, else the first error would count for twenty time constants.
    slow = max(slow, 1.0 / h[USED])
    h[POWER] += slow * (z * z - h[POWER])
    h[FAST] += max(quick, 1.0 / h[USED]) * (innovation - h[FAST])
    since = h[T_LAST] - h[T_RESET]
    # 1e-6: errors of a thousandth of the signal are discretisation, not a change of the system.
    if since > 10.0 * h[JUMP_TIME] and h[FAST] > h[JUMP] * (h[SLOW] + 1e-6 * h[POWER]):
        reset_covariance(h, d, u)
        h[T_RESET] = h[T_LAST]
        return RESET
    if since > 3.0 * h[JUMP_TIME] or h[SLOW] == 0.0:
        h[SLOW] += slow * (innovation - h[SLOW])
    return 0
