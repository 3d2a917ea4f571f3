"""One joint of an articulated model free, all others moving as measured: a prediction-error run, compiled.

Along the measured motion the equation of joint *j* is that of one degree of freedom with time-varying coefficients,

    M_jj(t) q'' + b_j(t) + K_j(t) (q - q_m(t)) + f(q, q', z) = tau(t, q, q'),

with ``b_j`` what the inverse dynamics of the nominal model asks of the joint besides its own acceleration, and ``K_j`` its derivative by
the angle: both are read off MuJoCo once a record. At every sample the prediction is held against the encoder, and the state is moved by a
constant gain times the innovation; without noise of the torque that gain is zero and the run is a free one (output error). Motor and link
of an elastic train are moved alike while they touch; while a play between them is open, only the side that is measured.

The step is a leapfrog one: half a drift, a kick, half a drift. Damping, bristles and a servo's velocity gain are implicit in the kick,
and dry friction is its proximal map (it truly sticks), so that no stiffness of the friction limits the step.

References:
    L. Ljung, *System Identification*, 2nd ed. 1999, section 4.3 and chapter 7 (innovations form, prediction errors);
    J. J. Moreau, *Unilateral contact and dry friction in finite freedom dynamics*, 1988 (implicit dry friction);
    C. Canudas de Wit et al., IEEE Trans. Autom. Control 40 (1995) 419-425 (bristles).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.multibody.joint_forces import (
    SLOTS,
    actuator_force,
    beyond_band,
    bristle_force_of,
    bristles_slid,
    cogging_force,
    delayed_input,
    entries,
    friction_limit,
    inlined,
    pair_friction,
    stop_force,
    surface_force,
)


class JointRunLimits(NamedTuple):
    """Numbers of `bench.discrepancy.multibody.joint_run` that compiled code holds."""

    far: float = 1e6
    """Error from which a run counts as diverged [rad, m, or these per second]."""


JOINT_RUN_LIMITS = JointRunLimits()


@inlined
def _kick(inertia, force, damping, implicit, bristle, limit, v):
    """New velocity of a joint of this inertia over the step: implicit in what damps it, dry friction by its proximal map."""
    a = inertia + 0.5 * (damping + implicit) + bristle
    free = (inertia * v + force - 0.5 * (damping - implicit) * v) / a
    return math.copysign(max(abs(free) - limit / a, 0.0), free)


@inlined
def _kick_shared(p, inertia, force, damping, implicit, bristle, limit, v, shared):
    """The same with friction shared with a neighbour, which moves by `shared`; its proximal map follows that of the joint's own."""
    new = _kick(inertia, force - p[41] * shared, damping + p[41], implicit, bristle, limit, v)
    held = p[40] / (inertia + 0.5 * (damping + p[41] + implicit) + bristle)
    return math.copysign(max(abs(new + shared) - held, 0.0), new + shared) - shared


@inlined
def _kick_train(p, mass, step, motor_force, link_force, damping, implicit, bristle, limit, q, v, ql, vl):
    """New velocities of motor and link: implicit in the damping of the train, dry friction on the motor by its proximal map."""
    motor, link = p[33] + p[9], mass - p[33]
    on_motor, on_link = (0.0, damping) if p[37] > 0.5 else (damping, 0.0)
    beyond = beyond_band(q - ql, p[32])
    torque = p[30] * beyond
    grip = p[31] if beyond != 0.0 else 0.0
    a11 = motor / step + 0.5 * (on_motor + implicit) + grip + bristle
    a22 = link / step + 0.5 * on_link + grip
    b1 = motor / step * v + motor_force - torque - 0.5 * (on_motor - implicit) * v
    b2 = link / step * vl + link_force + torque - 0.5 * on_link * vl
    det = a11 - grip * grip / a22
    free = (b1 + grip * b2 / a22) / det
    new = math.copysign(max(abs(free) - limit / det, 0.0), free)
    return new, (b2 + grip * new) / a22


@inlined
def _set_anew(p, bias, start, on_link):
    """Positions and velocities of motor and link at the start of a window, see `run`."""
    q, v, wound, whirl = start[0], start[1], 0.0, 0.0
    if p[29] > 0.5:
        wound, whirl = start[2], start[3]
        if math.isnan(wound):
            weight = bias + p[7] * (q - p[8])
            wound, whirl = -(weight / p[30] + math.copysign(p[32], weight)), 0.0
    if on_link:
        return q - wound, v - whirl, q, v
    return q, v, q + wound, v + whirl


@numba.njit(cache=True, error_model="numpy", nogil=True)
def run(
    p, mass, bias, slope, reference, load, beside, touch, u, step, n_sub, y, v_measured, gain, starts, every, out, states
):  # fmt: skip
    """Predict the encoder of one joint sample by sample.

    Args:
        p: (SLOTS,) parameters, see `Slot`.
        mass: (n_steps,) inertia about the joint at the middle of every step, as the next three.
        bias: (n_steps,) torque of gravity and of the other joints at the reference position.
        slope: (n_steps,) its derivative by the position.
        reference: (n_steps,) the position at which it was taken.
        load: (n_steps,) torque that the gear carries (magnitude), for friction that grows with it.
        beside: (n_steps,) velocity of the neighbour with which the joint shares a drive.
        touch: (3, n_steps) end of the tree that touches a surface, see `JointRecord.touches`; read where there is a surface alone.
        u: (n_steps,) input.
        step: Length of a step [s].
        n_sub: Steps a sample.
        y: (n,) measured positions.
        v_measured: (n,) measured velocities, or (0,).
        gain: (2, 2) of the innovations of position and velocity into position and velocity.
        starts: (n_windows, 4) at the first sample of every window: position and velocity on the encoder's side, then those of the link
            less those of the motor where there is a train; NaN there: wound up by what the link weighs.
        every: Samples a window; at its end the state is set anew.
        out: (n, 2) innovations; overwritten.
        states: (n, 4) predicted position and velocity of the motor, then of the link, which are the same without a train; overwritten.
    """
    n, p = y.shape[0], entries(p, SLOTS)
    train = p[29] > 0.5
    on_link, alone = train and p[34] > 0.5, p[40] == 0.0 and p[41] == 0.0
    q, v, ql, vl, z = 0.0, 0.0, 0.0, 0.0, 0.0
    lagged, target = math.nan, u[0]
    keep = math.exp(-step / p[27]) if p[27] > 0.0 else 0.0
    half = math.exp(-0.5 * step / p[39]) if p[39] > 0.0 else 0.0
    for i in range(n):
        if i % every == 0:
            q, v, ql, vl = _set_anew(p, bias[min(i * n_sub, bias.shape[0] - 1)], starts[i // every], on_link)
        states[i, 0], states[i, 1], states[i, 2], states[i, 3] = q, v, ql, vl
        out[i, 0] = y[i] - (ql if on_link else q)
        out[i, 1] = v_measured[i] - (vl if on_link else v) if v_measured.shape[0] > 0 else 0.0
        if not (abs(out[i, 0]) < JOINT_RUN_LIMITS.far and abs(out[i, 1]) < JOINT_RUN_LIMITS.far):
            out[i:], states[i + 1 :] = math.nan, 0.0
            return
        if i == n - 1:
            break
        dq = gain[0, 0] * out[i, 0] + gain[0, 1] * out[i, 1]
        dv = gain[1, 0] * out[i, 0] + gain[1, 1] * out[i, 1]
        # across an open play the encoder tells nothing of the other side
        apart = train and abs(q - ql) < p[32]
        if not (apart and on_link):
            q += dq
            v += dv
        if not apart or on_link:
            ql += dq
            vl += dv
        for k in range(i * n_sub, (i + 1) * n_sub):
            q, ql = q + 0.5 * step * v, ql + 0.5 * step * vl
            command = delayed_input(u, k, p[28] / step)
            target = command + (target - command) * half  # in the middle of the step, where the force acts
            force, implicit, lagged = actuator_force(p, target, q, v, lagged, keep)
            target = command + (target - command) * half
            bristle_force, bristle = bristle_force_of(p, v, z)
            own = force + bristle_force + cogging_force(p, q)
            x, w = (ql, vl) if train else (q, v)
            weight = bias[k] + slope[k] * (x - reference[k])
            pushed, stiff, damped = surface_force(p, touch, k, x - reference[k], w)
            rest = p[15] - weight - p[7] * (x - p[8]) + stop_force(p, x, w) + pushed
            limit = friction_limit(p, v, load[k], force, weight)
            # what a surface is stiff and damps by counts as the inertia with which no step is too long for it
            heavy = mass[k] + (0.25 * stiff * step + 0.5 * damped) * step
            before, inertia, damping = v, (heavy + p[9]) / step, p[6] + p[14] * abs(v)
            if train:
                rest -= pair_friction(p, w + p[42] * beside[k])
                v, vl = _kick_train(p, heavy, step, own, rest, damping, implicit, bristle, limit, q, v, ql, vl)  # fmt: skip
            elif alone:
                v = vl = _kick(inertia, own + rest, damping, implicit, bristle, limit, v)
            else:
                shared = p[42] * beside[k]
                v = vl = _kick_shared(p, inertia, own + rest, damping, implicit, bristle, limit, v, shared)
            z = bristles_slid(p, z, 0.5 * (before + v), step)
            q, ql = q + 0.5 * step * v, ql + 0.5 * step * vl


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
    beside: NDArray[np.float64] | None = None,
    touch: NDArray[np.float64] | None = None,
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
        starts: (n_windows, 2) states at the beginning of every window, or (n_windows, 4), see `run`.
        every: Samples a window; one window where None.
        beside: Velocity (n_steps,) of the neighbour with which the joint shares a drive; at rest where None.
        touch: End of the tree (3, n_steps) that touches a surface, where one does.
    """
    n = len(measured[0])
    out, states = np.empty((n, 2)), np.empty((n, 4))
    beside = np.zeros(len(u)) if beside is None else beside
    touch = np.zeros((3, 0)) if touch is None else touch
    at = np.full((len(np.atleast_2d(starts)), 4), np.nan)
    at[:, : np.shape(starts)[-1]] = starts
    mass, bias, slope, reference, load = arrays
    run(
        p, mass, bias, slope, reference, load, beside, touch, u, step, n_sub, *measured, gain, at, every or n, out, states
    )  # fmt: skip
    return out, states
