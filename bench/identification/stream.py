"""Compiled core of the adaptive estimator: one step a sample, called alike by the stream and by whole records.

A step admits the sample (finite, in order, moving), forms ``z`` and ``phi`` of the model (`bench.identification.regressors`),
updates the estimate (`bench.identification.stream_law`), and keeps the books of the persistence monitor
(`bench.identification.stream_monitor`).
"""

from __future__ import annotations

import math

from bench.identification.factors import square_sum
from bench.identification.layout import (
    BACKWARDS,
    CLOCK_RESET,
    COEF_STEP,
    CONDITION,
    CONSTANT,
    CONSTANT_RUN,
    COUNT,
    DROPPED,
    FIRST_CHANNEL,
    GAP,
    HALF_IS_OVER,
    HELD,
    LAST_VALUE,
    MOVING,
    NOT_FINITE,
    RATE,
    REJECTED,
    REPORTED,
    REPORTS,
    RESET,
    SEEN,
    SMALLEST,
    STARTED,
    STEP,
    STUCK,
    T_LAST,
    T_REJECTED,
    T_RESET,
    T_START,
    TRUSTED,
    UNEXCITED,
    UNUSED,
    USES_A,
    USES_F,
    USES_V,
    USES_X,
    Z_HAT,
    Z_INVERSE,
    Z,
    inlined,
    jit,
    views,
)
from bench.identification.stream_law import learn
from bench.identification.stream_models import regress, set_step
from bench.identification.stream_monitor import add_to_gram, turn, watch_half


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


@inlined
def take_admitted(h, theta, d, phi, b, u, gram, start, z, usable, step):
    """Learn from an admitted sample."""
    flags = 0
    if usable and h[HELD] == 0.0:
        add_to_gram(gram[0], phi)
        h[COUNT] += 1.0
        flags |= learn(h, theta, d, u, phi, b, z, step)
        if flags & RESET:
            for i in range(theta.size):
                start[i] = theta[i]
    elif not usable:
        flags |= UNUSED
    return flags | watch_half(h, step)


@inlined
def sample(h, theta, d, phi, b, work, inverse, y, u, gram, start, t, force, x, v, a):
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
    flags |= take_admitted(h, theta, d, phi, b, u, gram, start, z, usable, step)
    if flags & RESET and h[RATE] > 0.0:
        # The filters still hold the system of before the change; a new start knows the new one only.
        h[STARTED] = 0.0
    return flags


@inlined
def sample_given(h, theta, d, phi, b, u, gram, start, inverse, t, z, row):
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
    return flags | take_admitted(h, theta, d, phi, b, u, gram, start, z * h[Z_INVERSE], True, step)


@jit
def update(s, t, force, x, v, a):
    """`sample` on the flat state."""
    h, theta, d, phi, b, work, inverse, level, peak, y, u, gram, start, pull = views(s)
    flag = sample(h, theta, d, phi, b, work, inverse, y, u, gram, start, t, force, x, v, a)
    if flag & HALF_IS_OVER:
        flag = flag & ~HALF_IS_OVER | turn(h, theta, d, u, level, peak, gram, start, pull)
    return flag


@jit
def update_given(s, t, z, row):
    """`sample_given` on the flat state."""
    h, theta, d, phi, b, _, inverse, level, peak, _, u, gram, start, pull = views(s)
    flag = sample_given(h, theta, d, phi, b, u, gram, start, inverse, t, z, row)
    if flag & HALF_IS_OVER:
        flag = flag & ~HALF_IS_OVER | turn(h, theta, d, u, level, peak, gram, start, pull)
    return flag


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
            for i in range(level.size):
                reports[m, 5 + i] = level[i]
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
            h, theta, d, phi, b, work, inverse, y, u, gram, start, time[k], force[k], x[k], v[k], a[k]
        )
        if flag & HALF_IS_OVER:
            flag = flag & ~HALF_IS_OVER | turn(h, theta, d, u, level, peak, gram, start, pull)
        write(h, theta, phi, level, k, flag, every, out_theta, out_phi, out_z, flags, reports)


@jit
def run_given(s, time, z, rows, every, out_theta, out_phi, out_z, flags, reports):
    """A whole record through `sample_given`."""
    h, theta, d, phi, b, _, inverse, level, peak, _, u, gram, start, pull = views(s)
    h[REPORTS] = 0.0
    for k in range(time.size):
        flag = sample_given(h, theta, d, phi, b, u, gram, start, inverse, time[k], z[k], rows[k])
        if flag & HALF_IS_OVER:
            flag = flag & ~HALF_IS_OVER | turn(h, theta, d, u, level, peak, gram, start, pull)
        write(h, theta, phi, level, k, flag, every, out_theta, out_phi, out_z, flags, reports)
