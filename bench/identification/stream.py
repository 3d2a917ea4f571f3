"""Compiled core of the adaptive estimator: one step a sample, called alike by the stream and by whole records.

A step admits the sample (finite, in order, moving), forms ``z`` and ``phi`` of the model (`bench.identification.regressors`),
updates the estimate, and keeps the books of the persistence monitor.

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

import math

import numpy as np

from bench.identification.factors import bierman, gain_direction, square_sum, trace
from bench.identification.layout import (
    BACKWARDS,
    BETA,
    BOUND,
    CLOCK_RESET,
    COEF_STEP,
    CONDITION,
    CONSTANT,
    CONSTANT_RUN,
    COUNT,
    COUNT_BEFORE,
    DROPPED,
    EXCITATION_BACK,
    EXCITATION_LOST,
    EXCITED,
    FAST,
    FIRST_CHANNEL,
    GAIN,
    GAP,
    HALF_TIME,
    HALF_WINDOW,
    HALVES,
    HELD,
    JUMP,
    JUMP_TIME,
    LAST_VALUE,
    LEVEL_FLOOR,
    MAX_PULL,
    MIN_EIGENVALUE,
    MOVING,
    MU,
    NORMALISE,
    NOT_FINITE,
    P0,
    POWER,
    PRIOR,
    RATE,
    REJECTED,
    REPORTED,
    REPORTS,
    RESET,
    SEEN,
    SLOW,
    SMALLEST,
    STARTED,
    STEP,
    STUCK,
    T_LAST,
    T_REJECTED,
    T_RESET,
    T_START,
    TRACE,
    TRUSTED,
    UNEXCITED,
    UNUSED,
    USED,
    USES_A,
    USES_F,
    USES_V,
    USES_X,
    Z_HAT,
    Z_INVERSE,
    Z,
    fast,
    inlined,
    jit,
    views,
)
from bench.identification.stream_models import regress, set_step


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


@inlined
def admit(h, t, values_finite):
    """Judge time and finiteness; returns the flags, whether the filters restart, and the step since the last sample."""
    h[SEEN] += 1.0
    if not (values_finite and math.isfinite(t)):
        return NOT_FINITE, False, 0.0
    if h[STARTED] == 0.0:
        h[STARTED] = 1.0
        h[T_LAST] = t
        if h[T_RESET] == -math.inf:
            h[T_RESET] = t
        return 0, True, 0.0
    step = t - h[T_LAST]
    if step <= 0.0:
        # One late or doubled packet is dropped; two in a row that agree with each other are a clock that was set back.
        if t > h[T_REJECTED]:
            h[T_REJECTED] = math.inf
            h[T_LAST] = t
            return CLOCK_RESET, True, 0.0
        h[T_REJECTED] = t
        return BACKWARDS, False, 0.0
    h[T_REJECTED] = math.inf
    h[T_LAST] = t
    if h[STEP] == 0.0:
        h[STEP] = step
    if step > h[GAP] * h[STEP]:
        return DROPPED, True, step
    return 0, False, step


@inlined
def stands_still(h, channel, value):
    """Whether a channel has had the same value too often in a row."""
    if value == h[LAST_VALUE + channel]:
        h[CONSTANT_RUN + channel] += 1.0
        return h[CONSTANT_RUN + channel] >= h[STUCK]
    h[CONSTANT_RUN + channel] = 0.0
    h[LAST_VALUE + channel] = value
    return False


@inlined
def watch_channels(h, force, x, v, a):
    """Hold the estimate while a channel stands still; returns the flag of a change."""
    still = 0
    if h[USES_F] > 0.0 and stands_still(h, 0, force):
        still |= FIRST_CHANNEL
    if h[USES_X] > 0.0 and stands_still(h, 1, x):
        still |= FIRST_CHANNEL << 1
    if h[USES_V] > 0.0 and stands_still(h, 2, v):
        still |= FIRST_CHANNEL << 2
    if h[USES_A] > 0.0 and stands_still(h, 3, a):
        still |= FIRST_CHANNEL << 3
    before = h[HELD]
    h[HELD] = 1.0 if still else 0.0
    if still and before == 0.0:
        return CONSTANT | still
    if not still and before > 0.0:
        return MOVING
    return 0


@fast
def accumulate(gram, phi):
    """Add phi phi^T to the lower triangle."""
    for i in range(phi.size):
        for j in range(i + 1):
            gram[i, j] += phi[i] * phi[j]


@jit
def judge_prior(h, theta, d, u, level, start, pull):
    """Whether the data rule every parameter; renews `pull`, how far the start still pulls each.

    In information form the estimate solves ``(Q + S) theta = Q start + S theta_data``, with what is left of the start's
    information, ``Q = q I / P0``, and P the inverse of ``Q + S``. So ``W = P Q`` is the weight of the start, and without it the
    estimate would stand at ``theta + (I - W)^-1 W (theta - start)``. The start rules where W has an eigenvalue of a half and more:
    it then knows more of some direction than the data do. Else each parameter's way from there is compared with the parameter, or
    with what would make it a term of `LEVEL_FLOOR` of the largest, if it is less: a parameter may be zero.
    """
    n = d.size
    weight = np.zeros((n, n))
    largest = 0.0
    if h[PRIOR] < 1e-200:  # a few thousand memories later; products of it would be slow, then zero
        h[PRIOR] = 0.0
    for i in range(n):
        largest = max(largest, abs(theta[i]) * level[i])
        for k in range(i + 1):
            total = 0.0
            for j in range(i, n):  # column j of U lies in row j, a one on its end
                total += (u[j, i] if j > i else 1.0) * (u[j, k] if j > k else 1.0) * d[j]
            weight[i, k] = total * h[PRIOR] / h[P0]
            weight[k, i] = weight[i, k]
    if not np.linalg.eigvalsh(weight)[n - 1] < 0.5:
        pull[:] = math.inf
        return False
    way = np.linalg.solve(np.eye(n) - weight, np.dot(weight, theta - start))
    free = True
    for i in range(n):
        floor = h[LEVEL_FLOOR] * largest / level[i] if level[i] > 0.0 else 0.0
        scale = max(abs(theta[i]), floor)
        pull[i] = abs(way[i]) / scale if scale > 0.0 else 0.0
        free = free and pull[i] <= h[MAX_PULL]
    return free


@jit
def judge(h, theta, d, u, level, peak, gram, start, pull):
    """Smallest eigenvalue of the correlation of the regressor over the last two half windows; renews the report."""
    n = level.size
    count = h[COUNT] + h[COUNT_BEFORE]
    unexcited = 0
    matrix = np.zeros((n, n))
    for i in range(n):
        level[i] = math.sqrt(max(gram[0, i, i] + gram[1, i, i], 0.0) / max(count, 1.0))
        peak[i] = max(peak[i], level[i])
        if not level[i] > h[LEVEL_FLOOR] * peak[i]:
            unexcited += 1
    for i in range(n):
        for j in range(i + 1):
            scale = level[i] * level[j] * count
            value = (gram[0, i, j] + gram[1, i, j]) / scale if scale > 0.0 else 0.0
            matrix[i, j] = value
            matrix[j, i] = value
    values = np.linalg.eigvalsh(matrix)
    h[SMALLEST] = max(values[0], 0.0)
    h[CONDITION] = values[n - 1] / h[SMALLEST] if h[SMALLEST] > 0.0 else math.inf
    h[UNEXCITED] = unexcited
    excited = 1.0 if (unexcited == 0 and h[SMALLEST] >= h[MIN_EIGENVALUE] and count > n) else 0.0
    flag = REPORTED
    if excited == 0.0 and h[EXCITED] != 0.0:
        flag |= EXCITATION_LOST
    elif excited == 1.0 and h[EXCITED] == 0.0:
        flag |= EXCITATION_BACK
    h[EXCITED] = excited
    free = judge_prior(h, theta, d, u, level, start, pull)
    h[TRUSTED] = 1.0 if excited == 1.0 and free else 0.0
    h[REPORTS] += 1.0
    return flag


@inlined
def monitor(h, theta, d, u, level, peak, gram, start, pull, step):
    """Turn the half windows; a report comes with every half, the first when the window is full."""
    h[HALF_TIME] += step
    if h[HALF_TIME] < h[HALF_WINDOW]:
        return 0
    h[HALF_TIME] = 0.0
    h[HALVES] += 1.0
    flag = 0
    if h[HALVES] >= 2.0:
        flag = judge(h, theta, d, u, level, peak, gram, start, pull)
    h[COUNT_BEFORE] = h[COUNT]
    h[COUNT] = 0.0
    for i in range(level.size):
        for j in range(i + 1):
            gram[1, i, j] = gram[0, i, j]
            gram[0, i, j] = 0.0
    return flag


@inlined
def advance(h, theta, d, phi, b, level, peak, u, gram, start, pull, z, usable, step):
    """Learn from an admitted sample and turn the monitor."""
    flags = 0
    if usable and h[HELD] == 0.0:
        accumulate(gram[0], phi)
        h[COUNT] += 1.0
        flags |= learn(h, theta, d, u, phi, b, z, step)
        if flags & RESET:
            for i in range(theta.size):
                start[i] = theta[i]
    elif not usable:
        flags |= UNUSED
    return flags | monitor(h, theta, d, u, level, peak, gram, start, pull, step)


@inlined
def sample(h, theta, d, phi, b, work, inverse, level, peak, y, u, gram, start, pull, t, force, x, v, a):
    """One sample of the stream; returns the flags it raised."""
    good = not (
        (h[USES_F] > 0.0 and not math.isfinite(force))
        or (h[USES_X] > 0.0 and not math.isfinite(x))
        or (h[USES_V] > 0.0 and not math.isfinite(v))
        or (h[USES_A] > 0.0 and not math.isfinite(a))
    )
    flags, restart, step = admit(h, t, good)
    if flags & REJECTED:
        return flags
    flags |= watch_channels(h, force, x, v, a)
    if restart:
        h[T_START] = t
    else:
        set_step(h, step)
    usable, z = regress(h, theta, phi, work, inverse, y, force, x, v, a, restart)
    if restart:
        return flags
    if usable and not math.isfinite(z + square_sum(phi)):
        # Overflow in a power of the input has entered the filters: they begin anew with the next sample.
        h[STARTED] = 0.0
        return flags | NOT_FINITE
    flags |= advance(h, theta, d, phi, b, level, peak, u, gram, start, pull, z, usable, step)
    if flags & RESET and h[RATE] > 0.0:
        # The filters still hold the system of before the change; a new start knows the new one only.
        h[STARTED] = 0.0
    return flags


@inlined
def sample_given(h, theta, d, phi, b, level, peak, u, gram, start, pull, inverse, t, z, row):
    """One sample of a model whose regressor the caller forms."""
    good = math.isfinite(z)
    for i in range(phi.size):
        phi[i] = row[i] * inverse[i]
        good = good and math.isfinite(phi[i])
    flags, restart, step = admit(h, t, good)
    if flags & REJECTED:
        return flags
    if restart:
        h[T_START] = t
        step = h[STEP]
        if step == 0.0 or flags:
            return flags
    set_step(h, step)
    return flags | advance(
        h, theta, d, phi, b, level, peak, u, gram, start, pull, z * h[Z_INVERSE], True, step
    )


@jit
def update(s, t, force, x, v, a):
    """`sample` on the flat state."""
    h, theta, d, phi, b, work, inverse, level, peak, y, u, gram, start, pull = views(s)
    return sample(h, theta, d, phi, b, work, inverse, level, peak, y, u, gram, start, pull, t, force, x, v, a)


@jit
def update_given(s, t, z, row):
    """`sample_given` on the flat state."""
    h, theta, d, phi, b, _, inverse, level, peak, _, u, gram, start, pull = views(s)
    return sample_given(h, theta, d, phi, b, level, peak, u, gram, start, pull, inverse, t, z, row)


@inlined
def write(h, theta, phi, level, k, flag, every, out_theta, out_phi, out_z, flags, reports):
    """Keep what the history asks for after sample k."""
    flags[k] = flag
    if flag & REPORTED:
        m = int(h[REPORTS]) - 1
        if m < reports.shape[0]:
            reports[m, 0] = h[T_LAST]
            reports[m, 1] = h[SMALLEST]
            reports[m, 2] = h[CONDITION]
            reports[m, 3] = h[UNEXCITED]
            reports[m, 4] = h[TRUSTED]
            reports[m, 5:] = level
    if k % every == 0:
        row = k // every
        known = (
            h[COEF_STEP] > 0.0 and h[HELD] == 0.0 and not flag & (REJECTED | UNUSED | DROPPED | CLOCK_RESET)
        )
        out_z[row, 0] = h[Z] if known else math.nan
        out_z[row, 1] = h[Z_HAT] if known else math.nan
        for i in range(theta.size):
            out_theta[row, i] = theta[i]
        if out_phi.shape[0] > 0:
            for i in range(theta.size):
                out_phi[row, i] = phi[i]


@jit
def run(s, time, force, x, v, a, every, out_theta, out_phi, out_z, flags, reports):
    """A whole record through `sample`."""
    h, theta, d, phi, b, work, inverse, level, peak, y, u, gram, start, pull = views(s)
    h[REPORTS] = 0.0
    for k in range(time.size):
        flag = sample(
            h,
            theta,
            d,
            phi,
            b,
            work,
            inverse,
            level,
            peak,
            y,
            u,
            gram,
            start,
            pull,
            time[k],
            force[k],
            x[k],
            v[k],
            a[k],
        )
        write(h, theta, phi, level, k, flag, every, out_theta, out_phi, out_z, flags, reports)


@jit
def run_given(s, time, z, rows, every, out_theta, out_phi, out_z, flags, reports):
    """A whole record through `sample_given`."""
    h, theta, d, phi, b, _, inverse, level, peak, _, u, gram, start, pull = views(s)
    h[REPORTS] = 0.0
    for k in range(time.size):
        flag = sample_given(
            h, theta, d, phi, b, level, peak, u, gram, start, pull, inverse, time[k], z[k], rows[k]
        )
        write(h, theta, phi, level, k, flag, every, out_theta, out_phi, out_z, flags, reports)
