"""From a sample to ``z`` and ``phi``: filters exact for inputs linear over a step, and the regressors of each model.

A filter that starts at rest on its first input (`high_pass`) or at zero (`low_pass`) makes ``z = theta^T phi`` hold from the
first sample on, whatever the start values: both sides then are the same convolution from that sample. This is why the filters
may simply begin anew after a gap in the record.
"""

from __future__ import annotations

import math

from bench.identification.layout import (
    B0,
    B1,
    BETA,
    C_B0,
    C_B1,
    C_DECAY,
    COEF_RATE,
    COEF_STEP,
    CROSSOVER,
    DAMPER_LOG,
    DECAY,
    DENOISE_AFTER,
    F_FLOOR,
    GAIN,
    KIND,
    MASS,
    MU,
    ORDER_1,
    ORDER_2,
    OUT_OF_PHASE,
    POLYNOMIAL,
    RATE,
    SDOF,
    T_LAST,
    T_RESET,
    T_START,
    V_FLOOR,
    Z_INVERSE,
    inlined,
    jit,
)


@jit
def low_pass_weights(rate, step):
    """Decay and weights of the last and the present input of 1/(s + rate), exact for inputs linear over the step."""
    x = rate * step
    decay = math.exp(-x)
    if x < 1e-3:  # the closed form loses digits by cancellation, the series is good to 1e-13 here
        whole = step * (1.0 - x / 2.0 + x * x / 6.0 - x * x * x / 24.0)
        present = step * (0.5 - x / 6.0 + x * x / 24.0 - x * x * x / 120.0)
    else:
        whole = (1.0 - decay) / rate
        present = (1.0 - whole / step) / rate
    return decay, present, whole - present


@inlined
def set_step(h, step):
    """Renew what depends on the step and on the filter rate; both stay as they are on a steady clock."""
    rate = h[RATE]
    if rate > 0.0 and h[DENOISE_AFTER] > 0.0:
        # The start value of the filters is one noisy sample: a filter that starts quick and slows down forgets it.
        rate = max(rate, 2.0 / (h[T_LAST] - h[T_START] + 2.0 * step))
    # Time stamps carry rounding of some 1e-9 of a step; less than 1e-6 is no news.
    same = abs(step - h[COEF_STEP]) <= 1e-6 * step
    if same and rate == h[COEF_RATE]:
        return
    if rate > 0.0:
        h[DECAY], h[B0], h[B1] = low_pass_weights(rate, step)
    if not same:
        if h[CROSSOVER] > 0.0:
            h[C_DECAY], h[C_B0], h[C_B1] = low_pass_weights(h[CROSSOVER], step)
        if h[BETA] > 0.0:
            h[MU] = math.exp(-h[BETA] * step)
            h[GAIN] = (1.0 - h[MU]) / h[BETA]
        else:
            h[GAIN] = step
    h[COEF_STEP] = step
    h[COEF_RATE] = rate


@inlined
def low_pass(h, y, i, u, restart):
    """Output of filter i of 1/(s + rate) for input u; y[0] holds outputs, y[1] the last inputs."""
    if restart:
        y[0, i] = 0.0
    else:
        y[0, i] = h[DECAY] * y[0, i] + h[B1] * y[1, i] + h[B0] * u
    y[1, i] = u
    return y[0, i]


@inlined
def high_pass(h, y, i, u, restart):
    """Output of s/(s + rate); starts at rest on u, so that no transient of the start value enters."""
    if restart:
        y[0, i] = u
    else:
        y[0, i] = h[DECAY] * y[0, i] + h[COEF_RATE] * (h[B1] * y[1, i] + h[B0] * u)
    y[1, i] = u
    return u - y[0, i]


@inlined
def fused_acceleration(h, y, i, v, a, restart):
    """Below the crossover the derivative of the velocity, above it the accelerometer (complementary filter)."""
    p = h[CROSSOVER]
    if restart:
        # The state for which the output is a itself: both routes then obey the same equation from the start.
        y[0, i] = v
        y[0, i + 1] = 0.0
    else:
        y[0, i] = h[C_DECAY] * y[0, i] + p * (h[C_B1] * y[1, i] + h[C_B0] * v)
        y[0, i + 1] = h[C_DECAY] * y[0, i + 1] + p * (h[C_B1] * y[1, i + 1] + h[C_B0] * a)
    y[1, i] = v
    y[1, i + 1] = a
    return p * (v - y[0, i]) + a - y[0, i + 1]


@inlined
def hysteretic_inputs(h, v, r, first, y_in):
    """Write |v||r|^(n-1) r and v|r|^n, n = 1 ... N, of eq. 2.16 from index `first` on."""
    power = 1.0
    magnitude = abs(r)
    speed = abs(v)
    for k in range(int(h[ORDER_1])):
        y_in[first + 2 * k] = speed * power * r
        power *= magnitude
        y_in[first + 2 * k + 1] = v * power


@inlined
def hysteretic(h, theta, phi, work, inverse, y, force, x, v, a, restart):
    """z and phi of the Bouc-Wen (2.16) and the general single-degree-of-freedom model (section 2.4.1)."""
    n = phi.size
    head = 1
    if h[CROSSOVER] > 0.0:
        a = fused_acceleration(h, y, n + 1, v, a, restart)
    r = force - h[MASS] * a
    z = high_pass(h, y, n, r, restart)
    if h[KIND] == SDOF:
        head = 3
        phi[0] = high_pass(h, y, 0, x, restart) * inverse[0]
        phi[1] = high_pass(h, y, 1, v, restart) * inverse[1]
        phi[2] = high_pass(h, y, 2, x * x * x, restart) * inverse[2]
    else:
        phi[0] = low_pass(h, y, 0, v, restart) * inverse[0]
    since = h[T_LAST] - max(h[T_START], h[T_RESET])
    if h[DENOISE_AFTER] > 0.0 and since > h[DENOISE_AFTER] and not restart:
        # The estimator is an observer of r: low-passed r plus theta^T phi follows r with its noise cut to the filter's
        # band. The raw r enters here with half a step of weight only.
        hysteretic_inputs(h, v, r, head, work)
        model = 0.0
        for i in range(head):
            model += theta[i] * phi[i]
        for i in range(head, n):
            model += theta[i] * inverse[i] * (h[DECAY] * y[0, i] + h[B1] * y[1, i] + h[B0] * work[i])
        r = y[0, n] + model / h[Z_INVERSE]
    hysteretic_inputs(h, v, r, head, work)
    for i in range(head, n):
        phi[i] = low_pass(h, y, i, work[i], restart) * inverse[i]
    return z * h[Z_INVERSE]


@inlined
def polynomial(h, phi, inverse, x, v, a):
    """phi = [a, x^i v^j], i = 0 ... k, j = 0 ... l (3.12)."""
    phi[0] = a * inverse[0]
    column = 1
    x_power = 1.0
    for _ in range(int(h[ORDER_1]) + 1):
        power = x_power
        for _ in range(int(h[ORDER_2]) + 1):
            phi[column] = power * inverse[column]
            power *= v
            column += 1
        x_power *= x


@inlined
def regress(h, theta, phi, work, inverse, y, force, x, v, a, restart):
    """Write phi; returns whether the sample can be used, and z."""
    if h[KIND] == POLYNOMIAL:
        polynomial(h, phi, inverse, x, v, a)
        return True, force * h[Z_INVERSE]
    if h[KIND] == DAMPER_LOG:
        if abs(v) < h[V_FLOOR] or abs(force) < h[F_FLOOR]:
            return False, 0.0
        if force * v < 0.0:
            h[OUT_OF_PHASE] += 1.0
            return False, 0.0
        phi[0] = 1.0
        phi[1] = math.log(abs(v))
        return True, math.log(abs(force))
    return True, hysteretic(h, theta, phi, work, inverse, y, force, x, v, a, restart)
