"""What a simulated robot consists of, and what its controller is asked for, in the form that the compiled steps take."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array

TORQUE, POSITION, VELOCITY = 0, 1, 2
"""Kinds of drives: the command is a torque, a goal, or a speed."""


class Machine(NamedTuple):
    """Numbers of a robot, a row for each joint with the body that it moves."""

    slide: NDArray[np.bool_]
    """Whether the joint is a slide (n)."""
    axis: Array
    """Axis of the joint in the body before it (n, 3)."""
    pos: Array
    """Origin of the body in the body before it [m] (n, 3)."""
    mass: Array
    """Of the body [kg] (n)."""
    com: Array
    """Its centre of mass in its frame [m] (n, 3)."""
    inertia: Array
    """Moments about its centre of mass along its own axes [kg m^2] (n, 3)."""
    armature: Array
    """Of the drive, on the motor's side of an elastic train [kg m^2 or kg] (n)."""
    damping: Array
    """Viscous friction likewise [N m s/rad or N s/m] (n)."""
    friction: Array
    """Dry friction likewise [N m or N] (n)."""
    link_friction: Array
    """Dry friction on the link's side [N m or N] (n)."""
    gravity: Array
    """In the frame of the base [m/s^2] (3)."""
    spin: Array
    """Angular momentum of a wheel that spins in the last body, in its frame [N m s] (3)."""
    kind: NDArray[np.int64]
    """TORQUE, POSITION or VELOCITY (n)."""
    kp: Array
    """Gain of a servo on its position [N m/rad or N/m] (n)."""
    kv: Array
    """Gain of a servo on its speed [N m s/rad or N s/m] (n)."""
    limit: Array
    """Largest torque of the drive [N m or N] (n)."""
    delay: Array
    """Time by which it gets its command late [s] (n)."""
    cogging: Array
    """Amplitude [N m or N], pitch [rad or m] and phase [rad] of a force that repeats along the joint (n, 3)."""
    train: Array
    """Stiffness, damping and clearance between motor and link; rigid where the stiffness is zero (n, 3)."""


class Command(NamedTuple):
    """What the controller is asked for at every sample."""

    times: Array
    """Instants of the samples, the last one the end [s] (n_samples + 1)."""
    position: Array
    """Reference [rad or m] (n_samples, n)."""
    speed: Array
    """Its rate [rad/s or m/s] (n_samples, n)."""
    torque: Array
    """Torque that is fed forward [N m or N] (n_samples, n)."""
    gains: Array
    """Of the controller, on position and speed (n, 2)."""
    commands: Array
    """Commands that are played where `closed` is false (n_samples, n)."""
    closed: bool
    """Whether the controller makes the commands."""
    restart: NDArray[np.bool_]
    """Samples at which the state is set (n_samples)."""
    states: Array
    """Positions, speeds, motor positions and motor speeds to set, a row a sample (n_samples, 4 n)."""
    step: float
    """Longest step of the integration [s]."""
