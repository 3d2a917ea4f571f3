"""Time stepping of a joint rig: two bodies on mounts, coupled by a joint, which shift and turn along one axis.

A step drifts for half of it, changes the velocities at once (springs and dashpots explicitly, then dry friction of the joint as an
impulse that at most stops the relative motion), and drifts for the other half. Machine code of the Bouc-Wen element is kept until this
file changes: after a change of `hysteresis`, delete ``__pycache__`` beside it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from third_laboratory_cases.hysteresis import Loop, deflected
from third_laboratory_cases.oscillator import compiled, inlined


class Axis(NamedTuple):
    """Properties along the axis; about it, read rad for m, N m for N and kg m^2 for kg.

    Those from `friction` on are what a nominal model may miss, or background.
    """

    mass_1: float
    """Mass of body 1 [kg], a small resonator on it included."""
    mass_2: float
    """The same of body 2."""
    mount_stiffness_1: float
    """Stiffness [N/m] between body 1 and the ground."""
    mount_stiffness_2: float
    """The same of body 2."""
    mount_damping_1: float
    """Viscous damping [N s/m] between body 1 and the ground."""
    mount_damping_2: float
    """The same of body 2."""
    joint_stiffness: float
    """Stiffness of the joint [N/m]."""
    joint_damping: float
    """Viscous damping of the joint [N s/m]."""
    friction: float = 0.0
    """Coulomb friction of the joint [N]."""
    play_stiffness: float = 0.0
    """Stiffness [N/m] that the joint has besides, beyond a play."""
    play: float = 0.0
    """Half of that play [m]."""
    rope_force: float = 0.0
    """Yield force of a Bouc-Wen element beside the joint [N]."""
    rope_yielding: float = 1.0
    """Displacement [m] after which that element yields."""
    rope_beta: float = 0.5
    """Weight of its term whose sign follows that of the motion, see `Loop`."""
    rope_exponent: float = 1.0
    """Its exponent n."""
    resonator_1: float = 0.0
    """Part of the mass of body 1 [kg] that is mounted on the rest by a spring and a dashpot."""
    resonator_2: float = 0.0
    """The same of body 2."""
    resonator_frequency: float = 1.0
    """Natural frequency of either part on the blocked rest [Hz]."""


class Swing(NamedTuple):
    """A slow swing of the mounts of body 1."""

    share: float = 0.0
    """Its amplitude, as a fraction of their stiffness."""
    frequency: float = 0.0
    """Its frequency [Hz]."""


class State(NamedTuple):
    """State along one axis: of the bodies, of the Bouc-Wen element and of the small resonator."""

    x_1: float
    x_2: float
    v_1: float
    v_2: float
    rope: float
    small_x: float
    small_v: float


RATIO = 0.03
"""Damping ratio of the small resonators."""


@inlined
def between(s: State, h: float) -> float:
    """Displacement [m] of body 2 relative to body 1, half a step [s] later."""
    return s.x_2 + 0.5 * h * s.v_2 - (s.x_1 + 0.5 * h * s.v_1)


@inlined
def play_force(p: Axis, r: float) -> float:
    """Force [N] beyond the play at a relative displacement [m]."""
    if r > p.play:
        return p.play_stiffness * (r - p.play)
    if r < -p.play:
        return p.play_stiffness * (r + p.play)
    return 0.0


@inlined
def advance(p: Axis, s: State, load: float, joint: float, mount: float, h: float) -> State:
    """The state a step [s] later.

    Args:
        p: Properties of the axis.
        s: The state.
        load: Load on body 1 in the middle of the step [N].
        joint: Force of the joint by its motion along the other axis [N].
        mount: Stiffness of the mount of body 1, relative to its mean.
        h: The step.
    """
    x_1, x_2, v_1, v_2 = s.x_1 + 0.5 * h * s.v_1, s.x_2 + 0.5 * h * s.v_2, s.v_1, s.v_2
    r, dr = x_2 - x_1, v_2 - v_1
    rope = deflected(Loop(p.rope_yielding, p.rope_beta, p.rope_exponent), s.rope, h * dr)
    joint += p.joint_stiffness * r + p.joint_damping * dr + play_force(p, r)
    joint += p.rope_force * rope / p.rope_yielding
    force_1 = load - mount * p.mount_stiffness_1 * x_1 - p.mount_damping_1 * v_1 + joint
    force_2 = -p.mount_stiffness_2 * x_2 - p.mount_damping_2 * v_2 - joint
    small = p.resonator_1 + p.resonator_2
    small_x, small_v = s.small_x, s.small_v
    if small > 0.0:
        omega = 2.0 * np.pi * p.resonator_frequency
        base_x, base_v = (x_1, v_1) if p.resonator_1 > 0.0 else (x_2, v_2)
        small_x += 0.5 * h * small_v
        pull = small * omega**2 * (small_x - base_x) + 2.0 * RATIO * small * omega * (small_v - base_v)
        if p.resonator_1 > 0.0:
            force_1 += pull
        else:
            force_2 += pull
        small_v -= h * pull / small
        small_x += 0.5 * h * small_v
    mass_1, mass_2 = p.mass_1 - p.resonator_1, p.mass_2 - p.resonator_2
    v_1 += h * force_1 / mass_1
    v_2 += h * force_2 / mass_2
    stopping = (v_2 - v_1) * mass_1 * mass_2 / (mass_1 + mass_2)
    impulse = min(max(stopping, -h * p.friction), h * p.friction)
    v_1 += impulse / mass_1
    v_2 -= impulse / mass_2
    return State(x_1 + 0.5 * h * v_1, x_2 + 0.5 * h * v_2, v_1, v_2, rope, small_x, small_v)


@compiled
def march(
    axial: Axis, torsional: Axis, cross: float, swing: Swing, force: Array, torque: Array, h: float
) -> tuple[Array, Array]:
    """Motion of a joint rig from rest.

    Args:
        axial: Properties along the axis.
        torsional: Properties about it.
        cross: Force for a twist of the joint and torque for its extension [N/rad].
        swing: Of the mounts of body 1.
        force: Force on body 1 [N] at each step, linear between them (n,).
        torque: Torque on it [N m], shaped alike.
        h: Step [s].

    Returns:
        Displacements of body 1 and 2 [m], then their rotations [rad], and the velocities alike, each (n, 4).
    """
    n = len(force)
    x, v = np.zeros((n, 4)), np.zeros((n, 4))
    a = b = State(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for i in range(n - 1):
        mount = 1.0 + swing.share * np.sin(2.0 * np.pi * swing.frequency * (i + 0.5) * h)
        extension, twist = between(a, h), between(b, h)
        a = advance(axial, a, 0.5 * (force[i] + force[i + 1]), cross * twist, mount, h)
        b = advance(torsional, b, 0.5 * (torque[i] + torque[i + 1]), cross * extension, mount, h)
        x[i + 1, 0], x[i + 1, 1], x[i + 1, 2], x[i + 1, 3] = a.x_1, a.x_2, b.x_1, b.x_2
        v[i + 1, 0], v[i + 1, 1], v[i + 1, 2], v[i + 1, 3] = a.v_1, a.v_2, b.v_1, b.v_2
    return x, v
