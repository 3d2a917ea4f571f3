"""Forces on a joint of an articulated model at an instant, compiled: drive, friction, bristles, stops, from a vector of parameters.

Both engines call them, the run of a joint (`joint_run`) and the torque that its motion misses (`joint_torque`). The drive is an actuator
of MuJoCo whose force is limited by ``forcerange`` and by what is left of the voltage over that which the motor induces.

References:
    MuJoCo documentation, *DC Motor Model* (limits by voltage);
    M. Duclusaud, G. Passault, V. Padois, O. Ly, *Extended Friction Models for the Physics Simulation of Servo Actuators*, ICRA 2025
    (friction by what drives a gear and by what hangs on it).
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Any

import numba
from numba.np.unsafe.ndarray import to_fixed_tuple


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
    LIMIT = 10  # dry friction: limit, relative rise at rest, Stribeck velocity, part of the load
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
    LAG = 27  # time constant of the force [s]
    DELAY = 28  # of the input [s]
    TRAIN = 29  # 1: an elastic drive train between motor and link
    TRAIN_STIFFNESS = 30
    TRAIN_DAMPING = 31
    CLEARANCE = 32  # half of the play
    MOTOR = 33  # inertia of the motor, at the joint
    ENCODER = 34  # 0: on the motor, 1: on the link
    BACK_EMF = 35  # force that the motor's voltage takes over its speed, and force at standstill of the full voltage; 0: no such limit
    RATIO = 36  # reading of the actuator's own encoder over the position of the joint; the gear where nothing is wrong
    ON_LINK = 37  # 1: damping acts on the link's side of a train
    DRIVEN = 38  # dry friction in a gear: part of the actuator's torque and of what the link weighs, as they add up
    INPUT_LAG = 39  # time constant of a filter of the input [s], of a servo that of its target
    PAIR_LIMIT = 40  # dry friction and damping in what this joint and a neighbour turn together: limit, damping, sense of the neighbour
    PAIR_DAMPING = 41
    PAIR_SENSE = 42
    WEIGHED = 43
    WEIGHED_RISE = 44  # part of what the link weighs at rest, and of the square of the actuator's torque
    DRIVEN_SQUARE = 45
    STALL = 46
    SURFACE = 47  # a level surface that the end of the tree touches: stiffness, height, damping
    SURFACE_AT = 48
    SURFACE_DAMPING = 49


SLOTS = len(Slot)

entries: Any = to_fixed_tuple
"""Entries of an array as a tuple: for all that the compiler knows, an array is written to in a loop, and it is read anew at every step."""

inlined = numba.njit(cache=True, error_model="numpy", nogil=True, inline="always")


@inlined
def delayed_input(u, k, shift):
    """Input at the middle of step `k`, delayed by `shift` steps."""
    at = k - shift
    if at <= 0.0:
        return u[0]
    low = int(at)
    if low >= u.shape[0] - 1:
        return u[u.shape[0] - 1]
    return u[low] + (at - low) * (u[low + 1] - u[low])


@inlined
def beyond_band(x, width):
    """What of `x` lies beyond a dead band of half width `width`."""
    if x > width:
        return x - width
    if x < -width:
        return x + width
    return 0.0


@inlined
def actuator_force(p, command, q, v, lagged, keep):
    """Force of the actuator at the joint, the part of its velocity gain that the step may take implicitly, and the state of its lag."""
    target = command - p[36] * q if p[1] > 0.5 else command
    wanted = p[2] * beyond_band(target, p[26]) - p[3] * p[36] * v
    implicit = p[3] * p[36]
    if p[27] > 0.0:
        lagged = wanted if math.isnan(lagged) else wanted + (lagged - wanted) * keep
        wanted = lagged
        implicit = 0.0
    if p[46] > 0.0:
        taken = p[35] * v
        if abs(wanted + taken) > p[46]:
            wanted = math.copysign(p[46], wanted + taken) - taken
            implicit = p[35]
    low, high = p[4], p[5]
    if wanted > high or wanted < low:
        wanted = min(max(wanted, low), high)
        implicit = 0.0
    return p[0] * wanted, p[0] * implicit, lagged


@inlined
def stop_force(p, x, w):
    """Force of the one-sided stop on the joint; it only pushes."""
    depth = p[25] * (x - p[23])
    if p[22] > 0.0 and depth > 0.0:
        return -p[25] * max(p[22] * depth + p[24] * p[25] * w, 0.0)
    return 0.0


@inlined
def surface_force(p, touch, k, away, v):
    """Force on the joint of a level surface that the end of the tree touches, and the stiffness and damping that it has; it only pushes.

    `touch` is the lowest point of the end along the motion as measured, `away` what the joint is off that motion, `v` its velocity.
    """
    if p[47] <= 0.0:
        return 0.0, 0.0, 0.0
    lever = touch[1, k]
    depth = p[48] - touch[0, k] - lever * away
    force = p[47] * depth - p[49] * (touch[2, k] + lever * v)
    if depth <= 0.0 or force <= 0.0:
        return 0.0, 0.0, 0.0
    return force * lever, p[47] * lever * lever, p[49] * lever * lever


@inlined
def friction_limit(p, v, load, force, weight):
    """Limit of the dry friction in a gear that carries a load, between a force of the actuator and what the link weighs."""
    limit = p[10] + p[13] * load + abs(p[38] * force + p[43] * weight) + p[45] * force * force
    if p[11] != 0.0 or p[44] != 0.0:
        ratio = v / p[12]
        limit += (p[10] * p[11] + p[44] * abs(weight)) * math.exp(-ratio * ratio)
    return limit


@inlined
def cogging_force(p, q):
    """Force of the cogging at position `q`."""
    return -p[19] * math.sin(p[20] * q + p[21]) if p[19] != 0.0 else 0.0


@inlined
def pair_friction(p, w):
    """Friction on what two joints turn together at velocity `w`."""
    return p[41] * w + (math.copysign(p[40], w) if w != 0.0 else 0.0)


@inlined
def bristle_force_of(p, v, z):
    """Force of the bristles at velocity `v`, and the damping that the step may take implicitly."""
    if p[16] <= 0.0:
        return 0.0, 0.0
    damping = p[18] * (1.0 - p[17] / p[16] * z * math.copysign(1.0, v))
    implicit = 0.5 * max(damping, 0.0)
    return -p[17] * z - (damping - implicit) * v, implicit


@inlined
def bristles_slid(p, z, v, step):
    """The bristles after a step of sliding at velocity `v`; exact where that is constant."""
    if p[16] <= 0.0:
        return z
    steady = math.copysign(p[16] / p[17], v)
    return steady + (z - steady) * math.exp(-p[17] * abs(v) * step / p[16])
