"""What a simulated robot consists of, and what its drives follow, in the form that the compiled steps take.

A motor behind an elastic or loose transmission is a coordinate of its own; rotor, drive, viscous and dry friction act on it. Everywhere
else motor and link are one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array
from fourth_robots_cases.dynamics import Chain

POSITION, VELOCITY, CONTROLLER = 0, 1, 2
"""Kinds of commands: goals of positions, goals of rates, and a controller that gives torques."""


class Passive(NamedTuple):
    """What every joint has besides its links."""

    armature: Array
    """Rotor inertia [kg m^2 or kg] (n)."""
    damping: Array
    """Viscous friction [N m s/rad or N s/m] (n)."""
    stiffness: Array
    """Spring between link and base of the joint [N m/rad or N/m] (n)."""
    rest: Array
    """Position at which it is free [rad or m] (n)."""


class Servos(NamedTuple):
    """Servos of the joints; a controller uses their limits only."""

    kp: Array
    """Proportional gain [N m/rad or N/m] (n)."""
    kv: Array
    """Velocity gain [N m s/rad or N s/m] (n)."""
    limit: Array
    """Largest torque or force [N m or N] (n)."""


class Friction(NamedTuple):
    """Dry friction of a limit coulomb + (static - coulomb) exp(-(v / velocity)^2)."""

    coulomb: Array
    """When sliding [N m or N] (n)."""
    static: Array
    """At rest [N m or N] (n)."""
    velocity: Array
    """Stribeck velocity [rad/s or m/s] (n)."""


class Transmission(NamedTuple):
    """Elastic and loose transmissions between motor and link."""

    present: NDArray[np.bool_]
    """Whether a joint has one; otherwise it is rigid (n)."""
    stiffness: Array
    """Of the elastic transmission or of the faces of a gap [N m/rad] (n)."""
    damping: Array
    """In parallel with it [N m s/rad] (n)."""
    half_gap: Array
    """Half the play [rad]; zero where it is elastic only. Faces push, they never pull (n)."""


class Cogging(NamedTuple):
    """Ripple of the motors, -amplitude sin(periods q + phase)."""

    amplitude: Array
    """[N m] (n)."""
    periods: Array
    """Periods a turn (n)."""
    phase: Array
    """[rad] (n)."""


class Stop(NamedTuple):
    """One-sided rubber stops of the links."""

    place: Array
    """Position at which the stop begins [rad or m] (n)."""
    stiffness: Array
    """[N m/rad or N/m]; zero where there is none (n)."""
    damping: Array
    """[N m s/rad or N s/m] (n)."""
    side: Array
    """1 where it resists beyond its place, -1 where it does so before (n)."""


class Hose(NamedTuple):
    """A hose over the first three joints, of a length L = g0 q0 cos(q1) + g1 sin(q1 + 0.3) + g2 q2 (1 + 0.6 sin(q1)) besides a constant."""

    levers: Array
    """g0, g1 and g2 [m] (3)."""
    stiffness: float
    """Of its elastic part [N/m]; zero where there is no hose."""
    slip: float
    """Tension of the elastic part at which it slips [N]."""
    pretension: float
    """Constant tension besides [N]."""


class Machine(NamedTuple):
    """All that moves."""

    chain: Chain
    passive: Passive
    servos: Servos
    friction: Friction
    transmission: Transmission
    cogging: Cogging
    stop: Stop
    hose: Hose


class Command(NamedTuple):
    """What the drives follow. Goals are set at ticks and held; a controller gives torques by the step."""

    kind: int
    """POSITION, VELOCITY or CONTROLLER."""
    start: Array
    """Position at which the machine rests at first [rad or m] (n)."""
    position: Array
    """Reference positions [rad or m] (n_ticks or n_steps, n)."""
    velocity: Array
    """Reference velocities [rad/s or m/s]; one row of zeros where goals are positions (n_ticks or n_steps, n)."""
    outer_gain: float
    """Goal of the rate per distance from the reference position [1/s]; goals are rates only."""
    feedforward: Array
    """Torques of the controller along the reference [N m or N] (n_steps, n)."""
    gain: Array
    """Its feedback of positions [N m/rad or N/m] (n_steps, n)."""
    rate_gain: Array
    """Its feedback of velocities [N m s/rad or N s/m] (n_steps, n)."""
