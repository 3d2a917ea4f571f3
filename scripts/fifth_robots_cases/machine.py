"""What a simulated robot consists of, and what its drives follow, in the form that the compiled steps take.

Joints, friction, stops and transmissions are of the form of the fourth set; drives and ripple are this one's own.
"""

from __future__ import annotations

from typing import NamedTuple

from fourth_robots_cases.machine import Friction, Passive, Stop, Transmission

from bench.arrays import Array
from fifth_robots_cases.dynamics import Chain

MOTOR, POSITION, VELOCITY, VOLTAGE = 0, 1, 2, 3
"""Kinds of drives: torques, servos of positions, servos of rates, and DC motors on a voltage that follows a position."""
GOALS, TORQUES, RATES = 0, 1, 2
"""Kinds of commands: goals as they are, what a controller gives, and goals of rates that an outer loop gives."""


class Servos(NamedTuple):
    """Drives of the joints."""

    kind: int
    """MOTOR, POSITION, VELOCITY or VOLTAGE."""
    gear: Array
    """Torque or force per unit of what a motor gets [N m/A, N/A or 1] (n)."""
    kp: Array
    """Proportional gain of a servo [N m/rad] (n)."""
    kv: Array
    """Its velocity gain [N m s/rad] (n)."""
    limit: Array
    """Its largest torque [N m] (n)."""
    deadband: Array
    """Error of a position servo within which it gives nothing, to each side [rad] (n)."""
    constant: float
    """Of a DC motor [N m/A]."""
    resistance: float
    """Of its winding [ohm]."""
    voltage: float
    """Its largest voltage [V]."""


class Cogging(NamedTuple):
    """Ripple of the joints, -amplitude sin(a) - second sin(2 a + 0.4) with a = 2 pi q / pitch + phase."""

    amplitude: Array
    """[N m or N] (n)."""
    second: Array
    """Amplitude of the second harmonic [N m or N] (n)."""
    pitch: Array
    """Length of a period [rad or m] (n)."""
    phase: Array
    """[rad] (n)."""


class Machine(NamedTuple):
    """All that moves, and how late it is logged."""

    chain: Chain
    servos: Servos
    transmission: Transmission
    passive: Passive
    friction: Friction
    cogging: Cogging
    stop: Stop
    late: Array
    """Time by which each position is logged late [s] (n)."""


class Command(NamedTuple):
    """What the drives follow. Goals are set at ticks and held."""

    kind: int
    """GOALS, TORQUES or RATES."""
    start: Array
    """Position at which the machine rests at first [rad or m] (n)."""
    position: Array
    """Goals, or reference positions [rad or m] (n_ticks, n)."""
    velocity: Array
    """Reference velocities [rad/s or m/s] (n_ticks, n)."""
    gain: Array
    """What a controller or an outer loop gives per distance from the reference, in units of the goal (n)."""
    rate_gain: Array
    """What a controller gives per error of the velocity (n)."""
