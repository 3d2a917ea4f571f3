"""One joint of an articulated model free, all others moving as measured: a prediction-error run, compiled.

Along the measured motion the equation of joint *j* is that of one degree of freedom with time-varying coefficients,

    M_jj(t) q'' + b_j(t) + K_j(t) (q - q_m(t)) + f(q, q', z) = tau(t, q, q'),

with ``b_j`` what the inverse dynamics of the nominal model asks of the joint besides its own acceleration, and ``K_j`` its derivative by
the angle: both are read off MuJoCo once a record. At every sample the prediction is held against the encoder, and the state is moved by a
constant gain times the innovation; without noise of the torque that gain is zero and the run is a free one (output error).

The step is a leapfrog one: half a drift, a kick, half a drift. Damping, bristles and a servo's velocity gain are implicit in the kick, and dry
friction is its proximal map (it truly sticks), so that no stiffness of the friction limits the step.

References:
    L. Ljung, *System Identification*, 2nd ed. 1999, section 4.3 and chapter 7 (innovations form, prediction errors);
    J. J. Moreau, *Unilateral contact and dry friction in finite freedom dynamics*, 1988 (implicit dry friction);
    C. Canudas de Wit et al., IEEE Trans. Autom. Control 40 (1995) 419-425 (bristles).
"""

from __future__ import annotations

import math
from enum import IntEnum

import numba
import numpy as np
from numpy.typing import NDArray


class Slot(IntEnum):
    """Entries of the parameter vector of a run; zero switches an effect off, except where noted."""

    GEAR = 0  # factor of the actuator's force
    SERVO = 1  # 1: the input is a position target, 0: it is a force
    KP = 2
    KV = 3
    LOW = 4  # limits of the actuator's force
    HIGH = 5
    DAMPING = 6
    STIFFNESS = 7
    REFERENCE = 8  # angle without spring force
    INERTIA = 9  # inertia besides that of the coefficients, on the motor's side
    LIMIT = 10  # dry friction: limit, relative rise at rest, Stribeck velocity, part of the torque carried
    RISE = 11
    STRIBECK = 12
    CARRIED = 13
    QUADRATIC = 14
    OFFSET = 15
    BRISTLE_LIMIT = 16
    BRISTLE_STIFFNESS = 17
    BRISTLE_DAMPING = 18
    COGGING = 19  # amplitude, periods a turn, phase
    PERIODS = 20
    PHASE = 21
    STOP = 22  # stiffness, position, damping, side (+1, -1)
    STOP_AT = 23
    STOP_DAMPING = 24
    STOP_SIDE = 25
    DEADBAND = 26  # half width, of the servo's position error or of the force
    LAG = 27  # time constant [s]
    DELAY = 28  # of the input [s]
    TRAIN = 29  # 1: an elastic drive train between motor and link
    TRAIN_STIFFNESS = 30
    TRAIN_DAMPING = 31
    CLEARANCE = 32  # half of the play
    MOTOR = 33  # inertia of the motor, at the joint
    ENCODER = 34  # 0: on the motor, 1: on the link
    SPEED_LIMIT = 35  # speed at which the force available has fallen to zero; 0: no such limit
    RATIO = 36  # reading of the encoder that a servo acts on over the true position; one where nothing is wrong

    ON_LINK = 37  # 1: damping acts on the link's side of a train


SLOTS = len(Slot)


@numba.njit(cache=True, error_model="numpy", nogil=True, inline="always")
def _input(u, k, shift):
    """Input at the middle of step `k`, delayed by `shift` steps."""
    at = k - shift
    if at <= 0.0:
        return u[0]
    low = int(at)
    if low >= u.shape[0] - 1:
        return u[u.shape[0] - 1]
    part = at - low
    return u[low] + part * (u[low + 1] - u[low])


@numba.njit(cache=True, error_model="numpy", nogil=True, inline="always")
def _beyond(x, width):
    """What of `x` lies beyond a dead band of half width `width`."""
    if x > width:
        return x - width
    if x < -width:
        return x + width
    return 0.0


@numba.njit(cache=True, error_model="numpy", nogil=True)
def run(p, mass, bias, slope, reference, load, u, step, n_sub, y, v_measured, gain, starts, every, out, states):  # noqa: PLR0912, PLR0915
    """Predict the encoder of one joint sample by sample.

    Args:
        p: (SLOTS,) parameters, see `Slot`.
        mass, bias, slope, reference: (n_steps,) coefficients of the equation at the middle of every step.
        load: (n_steps,) torque that the gear carries (magnitude), for friction that grows with it.
        u: (n_steps,) input.
        step: Length of a step [s].
        n_sub: Steps a sample.
        y: (n,) measured positions.
        v_measured: (n,) measured velocities, or (0,).
        gain: (2, 2) of the innovations of position and velocity into position and velocity.
        starts: (n_windows, 2) position and velocity at the first sample of every window.
        every: Samples a window; at its end the state is set anew.
        out: (n, 2) innovations; overwritten.
        states: (n, 4) predicted position and velocity on the encoder's side, then of the link where there is a train; overwritten.
    """
    n = y.shape[0]
    has_velocity = v_measured.shape[0] > 0
    servo = p[1] > 0.5
    train = p[29] > 0.5
    encoder_on_link = p[34] > 0.5
    q, v = 0.0, 0.0  # motor, and everything where there is no train
    ql, vl = 0.0, 0.0
    z = 0.0
    shift = p[28] / step
    lagged = 0.0
    lagging = p[27] > 0.0
    keep = math.exp(-step / p[27]) if lagging else 0.0
    first = True
    bristles = p[16] > 0.0
    for i in range(n):
        if i % every == 0:
            q, v = starts[i // every, 0], starts[i // every, 1]
            ql, vl = q, v
            if train:  # the train is wound up by what the link weighs
                weight = bias[min(i * n_sub, bias.shape[0] - 1)] + p[7] * (q - p[8])
                wound = weight / p[30] + math.copysign(p[32], weight)
                if encoder_on_link:
                    q += wound
                else:
                    ql -= wound
        at_q, at_v = (ql, vl) if (train and encoder_on_link) else (q, v)
        states[i, 0], states[i, 1] = at_q, at_v
        states[i, 2], states[i, 3] = ql, vl
        r0 = y[i] - at_q
        r1 = v_measured[i] - at_v if has_velocity else 0.0
        out[i, 0], out[i, 1] = r0, r1
        dq = gain[0, 0] * r0 + gain[0, 1] * r1
        dv = gain[1, 0] * r0 + gain[1, 1] * r1
        q += dq
        v += dv
        ql += dq
        vl += dv
        if i == n - 1:
            break
        for s in range(n_sub):
            k = i * n_sub + s
            q += 0.5 * step * v
            if train:
                ql += 0.5 * step * vl
            # the actuator
            command = _input(u, float(k), shift)
            implicit = 0.0
            if servo:
                wanted = p[2] * _beyond(command - p[36] * q, p[26]) - p[3] * p[36] * v
                implicit = p[3] * p[36]
            else:
                wanted = _beyond(command, p[26])
            if lagging:
                if first:
                    lagged = wanted
                    first = False
                lagged = wanted + (lagged - wanted) * keep
                wanted = lagged
                implicit = 0.0
            low, high = p[4], p[5]
            if p[35] > 0.0:  # the force available falls with the speed
                high = min(high, high * max(0.0, 1.0 - v / p[35]))
                low = max(low, low * max(0.0, 1.0 + v / p[35]))
            if wanted > high:
                wanted = high
                implicit = 0.0
            elif wanted < low:
                wanted = low
                implicit = 0.0
            force = p[0] * wanted
            implicit *= p[0]
            # forces of the joint
            if train:
                x, w = ql, vl
            else:
                x, w = q, v
            rest = -bias[k] - slope[k] * (x - reference[k]) + p[15]
            rest -= p[7] * (x - p[8])
            own = 0.0  # on the motor's side
            if p[19] != 0.0:
                own -= p[19] * math.sin(p[20] * q + p[21])
            if p[22] > 0.0:
                depth = p[25] * (x - p[23])
                if depth > 0.0:
                    push = p[22] * depth + p[24] * p[25] * w
                    if push > 0.0:
                        rest -= p[25] * push
            # friction acts where the motor is
            limit = p[10]
            if limit > 0.0 or p[13] > 0.0:
                if p[11] != 0.0:
                    ratio = v / p[12]
                    limit *= 1.0 + p[11] * math.exp(-ratio * ratio)
                limit += p[13] * load[k]
            damping = p[6] + p[14] * abs(v) + 0.0
            if bristles:
                fall = p[17] / p[16]
                rate = 1.0 - fall * z * math.copysign(1.0, v)
                own -= p[17] * z
                bristle = p[18] * rate
                if bristle > 0.0:
                    own -= bristle * 0.5 * v
                    implicit_bristle = 0.5 * bristle
                else:
                    own -= bristle * v
                    implicit_bristle = 0.0
            else:
                implicit_bristle = 0.0
            if train:
                motor = p[33] + p[9]
                link = mass[k] - p[33]
                wind = q - ql
                beyond = _beyond(wind, p[32])
                torque = 0.0
                grip = 0.0
                if beyond != 0.0:
                    torque = p[30] * beyond
                    grip = p[31]
                # implicit in the damping of the train, solved for both velocities
                on_motor, on_link = (0.0, damping) if p[37] > 0.5 else (damping, 0.0)
                a11 = motor / step + 0.5 * (on_motor + implicit) + grip + implicit_bristle
                a22 = link / step + 0.5 * on_link + grip
                b1 = motor / step * v + force + own - torque - 0.5 * (on_motor - implicit) * v
                b2 = link / step * vl + rest + torque - 0.5 * on_link * vl
                # friction on the motor: eliminate the link, then the proximal map
                det = a11 - grip * grip / a22
                free = (b1 + grip * b2 / a22) / det
                stuck = limit / det
                v_new = math.copysign(max(abs(free) - stuck, 0.0), free)
                vl = (b2 + grip * v_new) / a22
                v_mid = v_new
                v = v_new
            else:
                inertia = (mass[k] + p[9]) / step
                total = inertia * v + force + rest + own - 0.5 * (damping - implicit) * v
                a = inertia + 0.5 * (damping + implicit) + implicit_bristle
                free = total / a
                v_new = math.copysign(max(abs(free) - limit / a, 0.0), free)
                v_mid = 0.5 * (v + v_new)
                v = v_new
            if bristles:
                steady = math.copysign(p[16] / p[17], v_mid)
                z = steady + (z - steady) * math.exp(-p[17] * abs(v_mid) * step / p[16])
            q += 0.5 * step * v
            if train:
                ql += 0.5 * step * vl
            if not (abs(q) < 1e6 and abs(v) < 1e9):
                for j in range(i, n):
                    out[j, 0] = math.nan
                    out[j, 1] = math.nan
                return


def predict(
    p: NDArray[np.float64],
    arrays: tuple[NDArray[np.float64], ...],
    u: NDArray[np.float64],
    step: float,
    n_sub: int,
    measured: tuple[NDArray[np.float64], NDArray[np.float64]],
    gain: NDArray[np.float64],
    starts: NDArray[np.float64],
    every: int | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Run `run`; return innovations (n, 2) and states (n, 4). NaN where it diverged.

    Args:
        p: (SLOTS,).
        arrays: mass, bias, slope, reference, load, each (n_steps,).
        u: (n_steps,) input.
        step: Length of a step [s].
        n_sub: Steps a sample.
        measured: Positions (n,) and velocities (n,) or (0,).
        gain: (2, 2).
        starts: (n_windows, 2) states at the beginning of every window.
        every: Samples a window; one window where None.
    """
    n = len(measured[0])
    out, states = np.zeros((n, 2)), np.zeros((n, 4))
    run(p, *arrays, u, step, n_sub, *measured, gain, np.atleast_2d(starts), every or n, out, states)
    return out, states
