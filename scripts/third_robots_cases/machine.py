"""What a simulated robot consists of, and what its drives follow, in the form that the compiled steps take.

A rotor, its drive and the friction of its joint are on the motor side of the gear. The equations stand in `stepping`.
"""

from __future__ import annotations

from typing import NamedTuple

from bench.arrays import Array
from third_robots_cases.dynamics import Chain


class Drives(NamedTuple):
    """The drive of every joint, and the friction beside it."""

    servo: bool
    """Whether the drives are position servos; otherwise they follow a feedforward torque with a feedback."""
    gain: Array
    """Proportional gain of the servo or the feedback [N m/rad or N/m] (n)."""
    kv: Array
    """Velocity gain likewise [N m s/rad or N s/m] (n)."""
    limit: Array
    """Largest torque or force [N m or N] (n)."""
    delay: Array
    """Delay of the target of a servo [s] (n)."""
    armature: Array
    """Rotor inertia, reflected to the joint [kg m^2 or kg] (n)."""
    damping: Array
    """Viscous friction [N m s/rad or N s/m] (n)."""
    coulomb: Array
    """Dry friction [N m or N] (n)."""
    load_friction: Array
    """Dry friction per unit of the force or torque that the links exert on the joint [-] (n)."""


class Gear(NamedTuple):
    """A gear that is elastic or loose; rotor, drive and friction of its joint are on the motor side of it."""

    joint: int
    """Index of its joint; -1 where all gears are rigid."""
    stiffness: float
    """Stiffness of the gear or of the tooth faces [N m/rad]."""
    damping: float
    """Damping in parallel with it [N m s/rad]."""
    gap: float
    """Full width of the gap [rad]; zero where the gear is elastic only. Faces push, they never pull."""


class Belt(NamedTuple):
    """One belt over the first two slides; its eccentric pulley sees the sum of their positions."""

    amplitude: float
    """Force A in A sin(2 pi (x + y) / pitch + phase), on the first slide [N]; zero where there is no belt."""
    pitch: float
    """Travel a turn [m]."""
    phase: float
    """Phase [rad]."""
    ratio: float
    """Force on the second slide over that on the first."""


class Machine(NamedTuple):
    """All that moves."""

    chain: Chain
    drives: Drives
    gear: Gear
    belt: Belt


class Command(NamedTuple):
    """What the drives follow: targets a sample where they are servos, else torque and reference at the midpoints of the steps."""

    rate: float
    """Samples a second [Hz]."""
    target: Array
    """Positions, each held over a sample [rad or m] (n_samples, n)."""
    feedforward: Array
    """Torques or forces [N m or N] (n_steps, n)."""
    position: Array
    """Reference positions [rad or m] (n_steps, n)."""
    velocity: Array
    """Reference velocities [rad/s or m/s] (n_steps, n)."""
