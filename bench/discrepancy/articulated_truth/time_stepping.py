"""Articulated bodies by Moreau's time stepping: dry friction that really sticks, coupled over the joints by the whole mass matrix.

A step goes half a drift, a kick, half a drift. At its middle MuJoCo tells mass matrix and bias of the bodies; friction is the set-valued
impulse that solves

    v+ = v_free + M^-1 p,   |p_i| <= h F_i,   p_i = -h F_i sgn(v+_i) where v+_i is not zero,

by projected Gauss and Seidel sweeps over all joints at once. The fits free one joint at a time along a measured motion and take
their coefficients once a record; nothing of that is shared here but MuJoCo's rigid bodies.

References:
    J. J. Moreau, *Unilateral contact and dry friction in finite freedom dynamics*, 1988;
    M. Jean, Comput. Methods Appl. Mech. Eng. 177 (1999) 235-257 (sweeps over the impulses).
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

import mujoco
import numba
import numpy as np
from numpy.typing import NDArray

from bench import native
from bench.arrays import Array
from bench.native.inverse import address, call


class Cell(IntEnum):
    """Columns of the table of joints (n_joints, CELLS); zero switches an effect off."""

    DAMPING = 0
    ARMATURE = 1
    FRICTION = (
        2  # limit of the dry friction, rise at rest over it, Stribeck velocity, part of the torque carried
    )
    RISE = 3
    STRIBECK = 4
    CARRIED = 5
    QUADRATIC = 6
    OFFSET = 7
    BRISTLE_LIMIT = 8
    BRISTLE_STIFFNESS = 9
    COGGING = 10  # amplitude, periods a turn, phase
    PERIODS = 11
    PHASE = 12
    STOP = 13  # stiffness, angle, side
    STOP_AT = 14
    STOP_SIDE = 15
    TRAIN = 16  # stiffness, damping and half play of an elastic train, and the motor's part of the armature
    TRAIN_DAMPING = 17
    PLAY = 18
    SHARE = 19
    GEAR = 20  # factor of the actuator's force, its limit (0: none), half dead band of its input, lag [s], delay [s]
    LIMIT = 21
    DEADBAND = 22
    LAG = 23
    DELAY = 24
    KP = 25  # of the servo, or of the loop that follows the reference
    KV = 26
    READ_OFFSET = 27  # of the encoder that the loop reads
    READ_GAIN = 28
    WAVINESS = (
        29  # foreign: friction that varies with the angle, part and periods; a spring to another joint, which
    )
    WAVES = 30
    TIE = 31
    TIED_TO = 32
    MAXWELL = 33  # foreign: a spring in series with a damper to the base, stiffness and relaxation time
    RELAXATION = 34


CELLS = len(Cell)


class TimeStepping(NamedTuple):
    """Numbers of `bench.discrepancy.articulated_truth.time_stepping` that compiled code holds."""

    sweeps: int = 400
    """Most sweeps over the impulses of a step; two or three do where joints hardly feel each other."""
    converged: float = 1e-12
    """Change of a velocity over the largest one at which they end."""
    longest: float = 2.5e-4
    """Longest step [s]: the stiffest train that is withheld has some 60 Hz, of which this is a hundredth of a period."""


TIME_STEPPING = TimeStepping()
_jit = numba.njit(cache=True, error_model="numpy", nogil=True)


class ArmMotion(NamedTuple):
    """What a robot did, at the samples: inputs, positions and velocities of the links and of the motors, each (n, n_joints)."""

    command: Array
    position: Array
    velocity: Array
    motor_position: Array
    motor_velocity: Array


@_jit
def _dead(x, width):
    return math.copysign(max(abs(x) - width, 0.0), x)


@_jit
def _forces(t, q, v, drive, carried, bristle, slack, force, limit):
    """Forces on links (n), on motors behind a train (n, in `force[1]`), and limits of friction."""
    n = q.shape[1]
    for i in range(n):
        row = t[i]
        train = row[16] > 0.0
        own = drive[i] - row[0] * v[1, i] - row[6] * abs(v[1, i]) * v[1, i]
        own -= row[10] * math.sin(row[11] * q[1, i] + row[12])
        if row[8] > 0.0:
            own -= row[9] * bristle[i]
        link = row[7]
        depth = row[15] * (q[0, i] - row[14])
        if row[13] > 0.0 and depth > 0.0:
            link -= row[15] * row[13] * depth
        if row[31] > 0.0:
            other = int(row[32])
            pull = row[31] * (q[0, i] - q[0, other])
            link -= pull
            force[0, other] += pull
        link -= row[33] * (q[0, i] - slack[i])
        if train:
            beyond = _dead(q[1, i] - q[0, i], row[18])
            torque = row[16] * beyond
            if beyond != 0.0:
                torque += row[17] * (v[1, i] - v[0, i])
            force[0, i] += link + torque
            force[1, i] = own - torque
        else:
            force[0, i] += link + own
            force[1, i] = 0.0
        dry = row[2]
        if row[3] > 0.0:
            dry *= 1.0 + row[3] * math.exp(-((v[1, i] / row[4]) ** 2))
        dry *= 1.0 + row[29] * math.sin(row[30] * q[1, i])
        limit[i] = dry + row[5] * abs(carried[i])


@_jit
def _actuators(t, servo, command, q, v, lagged, step, drive):
    for i in range(t.shape[0]):
        row = t[i]
        if servo:
            reading = (1.0 + row[28]) * q[1, i] + row[27]
            wanted = row[25] * _dead(command[i] - reading, row[22]) - row[26] * (1.0 + row[28]) * v[1, i]
        else:
            wanted = _dead(command[i], row[22])
        if row[23] > 0.0:
            keep = math.exp(-step / row[23])
            lagged[i] = wanted + (lagged[i] - wanted) * keep if not math.isnan(lagged[i]) else wanted
            wanted = lagged[i]
        if row[21] > 0.0:
            wanted = min(max(wanted, -row[21]), row[21])
        drive[i] = row[20] * wanted


@_jit
def _held(inverse, limit, free, step, impulse):
    """Velocities after dry friction, `free` those before it; `impulse` is overwritten."""
    n = free.shape[0]
    out = np.empty(n)
    largest = 0.0
    for i in range(n):
        out[i], impulse[i] = free[i], 0.0
        largest = max(largest, abs(free[i]))
    largest += 1e-12
    for _ in range(TIME_STEPPING.sweeps):
        moved = 0.0
        for i in range(n):
            if limit[i] <= 0.0:
                continue
            most = step * limit[i]
            new = min(max(impulse[i] - out[i] / inverse[i, i], -most), most)
            change = new - impulse[i]
            if change != 0.0:
                impulse[i] = new
                for k in range(n):
                    out[k] += inverse[k, i] * change
                moved = max(moved, abs(change) * inverse[i, i])
        if moved < TIME_STEPPING.converged * largest:
            break
    return out


@_jit
def _drift(q, v, step):
    for i in range(q.shape[1]):
        q[0, i] += step * v[0, i]
        q[1, i] += step * v[1, i]


@_jit
def _march(function, model, data, views, rows, t, servo, clock, plan, start, out):  # noqa: PLR0912, PLR0915  (one compiled loop)
    # loops rather than expressions of arrays, which take as long to compile as all the rest
    qpos, qvel, qacc, bias, matrix = views
    adr, ids, ends = rows
    step, n_sub = clock
    reference, speed, forward = plan
    n = qpos.shape[0]
    q, v = np.empty((2, n)), np.zeros((2, n))
    lagged, drive, carried = np.empty(n), np.zeros(n), np.zeros(n)
    bristle, slack = np.zeros(n), np.empty(n)
    for i in range(n):
        q[0, i], q[1, i], slack[i], lagged[i] = start[i], start[i], start[i], math.nan
    force, limit, impulse = np.zeros((2, n)), np.zeros(n), np.zeros(n)
    mass, command, delayed = np.zeros((n, n)), np.zeros(n), np.zeros(n)
    net, unheld, on_link, acceleration = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    history = np.zeros((reference.shape[0] * n_sub + 1, n))
    for k in range(reference.shape[0]):
        for i in range(n):
            row = t[i]
            if servo:
                command[i] = reference[k, i]
            else:
                reading = (1.0 + row[28]) * q[1, i] + row[27]
                command[i] = (
                    forward[k, i] + row[25] * (reference[k, i] - reading) + row[26] * (speed[k, i] - v[1, i])
                )
            out[0, k, i], out[1, k, i], out[2, k, i], out[3, k, i], out[4, k, i] = (
                command[i],
                q[0, i],
                v[0, i],
                q[1, i],
                v[1, i],
            )
        for s in range(n_sub):
            now = k * n_sub + s
            for i in range(n):
                history[now, i] = command[i]
                delayed[i] = history[max(now - round(t[i, 24] / step), 0), i]
            _drift(q, v, 0.5 * step)
            for i in range(n):
                qpos[i], qvel[i], qacc[i] = q[0, i], v[0, i], 0.0
            call(function, model, data)
            for i in range(n):
                for at in range(adr[i], ends[i]):
                    mass[i, ids[at]] = mass[ids[at], i] = matrix[at]
            for i in range(n):
                mass[i, i] += t[i, 1] * (1.0 - t[i, 19] if t[i, 16] > 0.0 else 1.0)
            _actuators(t, servo, delayed, q, v, lagged, step, drive)
            for i in range(n):
                force[0, i], force[1, i] = 0.0, 0.0
            _forces(t, q, v, drive, carried, bristle, slack, force, limit)
            inverse = np.linalg.inv(mass)
            for i in range(n):
                net[i] = force[0, i] - bias[i]
                on_link[i] = 0.0 if t[i, 16] > 0.0 else limit[i]
            gained = inverse @ net
            for i in range(n):
                unheld[i] = v[0, i] + step * gained[i]
            after = _held(inverse, on_link, unheld, step, impulse)
            for i in range(n):
                # what the gear carries is the bodies' torque without the armature's
                acceleration[i] = (after[i] - v[0, i]) / step
                v[0, i] = after[i]
            torque = mass @ acceleration
            for i in range(n):
                carried[i] = bias[i] + torque[i] - t[i, 1] * acceleration[i]
                if t[i, 16] > 0.0:
                    inertia = t[i, 1] * t[i, 19]
                    free = v[1, i] + step * force[1, i] / inertia
                    v[1, i] = math.copysign(max(abs(free) - step * limit[i] / inertia, 0.0), free)
                else:
                    v[1, i] = v[0, i]
                if t[i, 8] > 0.0:
                    bristle[i] += step * (v[1, i] - t[i, 9] * abs(v[1, i]) * bristle[i] / t[i, 8])
                if t[i, 33] > 0.0:
                    slack[i] += step * (q[0, i] - slack[i]) / t[i, 34]
            _drift(q, v, 0.5 * step)


def _rows(model: mujoco.MjModel) -> tuple[NDArray[np.int64], ...]:
    """Beginnings, columns and ends of the rows of the mass matrix as MuJoCo stores it, the lower triangle."""
    begin = np.array(model.M_rowadr, dtype=np.int64)
    return begin, np.array(model.M_colind, dtype=np.int64), begin + np.array(model.M_rownnz)


@native.quiet()
def march_bodies(
    model: mujoco.MjModel,
    table: Array,
    *,
    servo: bool,
    reference: Array,
    speed: Array,
    forward: Array,
    sample: float,
) -> ArmMotion:
    """Motion of a robot that follows a reference, from rest at its first sample.

    Args:
        model: Bodies alone: no damping, friction, springs, armature, actuators (`ArticulatedModel.model`).
        table: (n_joints, CELLS) of everything else.
        servo: Whether the reference is the target of position servos; else a loop makes torques, held between samples.
        reference: (n, n_joints) [rad or m].
        speed: (n, n_joints) its derivative, of the loop.
        forward: (n, n_joints) torques that the loop adds.
        sample: Time between samples [s].
    """
    data = mujoco.MjData(model)
    n, joints = reference.shape
    n_sub = max(1, math.ceil(sample / TIME_STEPPING.longest))
    out = np.zeros((5, n, joints))
    _march(
        address("mj_inverse"), model._address, data._address,
        (data.qpos, data.qvel, data.qacc, data.qfrc_inverse, data.M), _rows(model),
        np.ascontiguousarray(table), servo, (sample / n_sub, n_sub),
        tuple(np.ascontiguousarray(part, dtype=np.float64) for part in (reference, speed, forward)), reference[0].copy(), out,
    )  # fmt: skip
    return ArmMotion(*out)
