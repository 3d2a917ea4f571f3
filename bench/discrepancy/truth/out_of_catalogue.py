"""Effects that stand in no catalogue: what the blind protocol withholds so that *unknown* can be put to the test.

Each is a force that engineers meet and that no law of `bench.laws` describes. None of them may ever enter the catalogue
as it stands (a hidden resonator is two of its effects at once, and counts as right by these names, too); they are laws all the
same, so that MuJoCo's callback integrates them like any other.

- `modulated_stiffness`: a stiffness that follows the clock (a gear mesh, a breathing crack); the force depends on time.
- `fractional_damping`: ``C d^alpha q / dt^alpha``, memory over decades of time, as rubber has; eight relaxations side by
  side, where the catalogue has one.
- `snap_through`: a force of negative slope within a window about rest, as a buckled leaf gives, and none outside.
- `switching_stiffness`: a spring that latches in beyond one amplitude and lets go below a smaller one: a state that
  remembers which threshold was passed last.
- `friction_cone`: friction in two directions with one limit for both together; axial slip lowers the torsional friction.
- `saturating_spring`: a stiffness about rest that fades with the displacement, as a magnet's or a slipping belt's does.
- `hertz_contact`: a contact whose force grows with the penetration to 3/2, on one side.
- `hidden_resonator`: a mass on a spring that nobody modelled or weighed: complex memory, where a relaxation's is real.
- `displacement_dependent_damping`: ``c q^2 v``, a product of two coordinates.
- `stress_softening`: a spring that gives way with the largest displacement it has ever seen, and never recovers.
- `position_dependent_friction`: friction that rises and falls along the stroke, as a lead screw's does.
- `unmeasured_load`: a blow from outside at one moment.
- `restitution_stop`: a rigid stop that throws back with a coefficient of restitution; an impulse, hence no law: the time
  stepping of `bench.discrepancy.truth.moreau_time_stepping` knows it.
"""

from __future__ import annotations

import math

from bench.discrepancy.truth.foreign_memory import (
    FRACTIONAL_DAMPING,
    FRICTION_CONE,
    HIDDEN_RESONATOR,
    STRESS_SOFTENING,
    SWITCHING_STIFFNESS,
)
from bench.discrepancy.truth.foreign_parameters import stiffness, width
from bench.laws.base import ForceLaw, Parameter, kernel


@kernel
def modulated_force(t, q, v, z, theta, f):
    """``f = k sin(2 pi frequency t + phase) q``."""
    f[0] += theta[0] * math.sin(2.0 * math.pi * theta[1] * t + theta[2]) * q[0]


MODULATED_STIFFNESS = ForceLaw(
    "modulated_stiffness",
    (
        stiffness("amplitude of the modulation"),
        Parameter("frequency", "Hz", 1.0, (0.0, math.inf), "frequency of the modulation"),
        Parameter("phase", "rad", 0.0, (-math.inf, math.inf), "phase at t = 0"),
    ),
    modulated_force,
    equation="f = k sin(2 pi frequency t + phase) q",
    reference="Nayfeh & Mook 1979, Nonlinear Oscillations, ch. 5 (parametric excitation)",
)


@kernel
def snap_force(t, q, v, z, theta, f):
    """``f = -k q (1 - (q/w)^2)^2`` within the window w, zero outside."""
    u = q[0] / theta[1]
    if abs(u) < 1.0:
        f[0] -= theta[0] * q[0] * (1.0 - u * u) * (1.0 - u * u)


SNAP_THROUGH = ForceLaw(
    "snap_through",
    (
        stiffness("magnitude of the negative slope"),
        width("window", "half-width of the window"),
    ),
    snap_force,
    equation="f = -k q (1 - (q/w)^2)^2 for |q| < w, else 0",
    reference="Harne & Wang 2013, Smart Mater. Struct. 22 (bistable elements)",
)


@kernel
def saturating_force(t, q, v, z, theta, f):
    """``f = k w tanh(q/w)``."""
    f[0] += theta[0] * theta[1] * math.tanh(q[0] / theta[1])


SATURATING_SPRING = ForceLaw(
    "saturating_spring",
    (
        stiffness("stiffness about rest"),
        width("width", "displacement about which it fades"),
    ),
    saturating_force,
    equation="f = k w tanh(q/w)",
    reference="Worden & Tomlinson 2001, Nonlinearity in Structural Dynamics, ch. 2 (saturation)",
)


@kernel
def hertz_force(t, q, v, z, theta, f):
    """``f = s k max(s (q - p), 0)^1.5``."""
    penetration = theta[2] * (q[0] - theta[1])
    if penetration > 0.0:
        f[0] += theta[2] * theta[0] * penetration * math.sqrt(penetration)


HERTZ_CONTACT = ForceLaw(
    "hertz_contact",
    (
        stiffness("in N/m^1.5"),
        Parameter("position", "m", 0.0, (-math.inf, math.inf), "where the contact begins", "rad"),
        Parameter("side", "1", 1.0, (-1.0, 1.0), "1 for larger displacements, -1 for smaller ones"),
    ),
    hertz_force,
    equation="f = s k max(s (q - p), 0)^1.5",
    reference="Johnson 1985, Contact Mechanics, ch. 4",
)


@kernel
def product_force(t, q, v, z, theta, f):
    """``f = c q^2 v``."""
    f[0] += theta[0] * q[0] * q[0] * v[0]


DISPLACEMENT_DEPENDENT_DAMPING = ForceLaw(
    "displacement_dependent_damping",
    (Parameter("c", "N s/m^3", 100.0, (0.0, math.inf), "coefficient", "N m s/rad^3"),),
    product_force,
    equation="f = c q^2 v",
    reference="Nayfeh & Mook 1979, Nonlinear Oscillations, sec. 3.1",
)


@kernel
def wavy_force(t, q, v, z, theta, f):
    """``f = Fc (1 + d cos(q/w + phase)) tanh(v/v0)``."""
    f[0] += theta[0] * (1.0 + theta[1] * math.cos(q[0] / theta[2] + theta[3])) * math.tanh(v[0] / theta[4])


POSITION_DEPENDENT_FRICTION = ForceLaw(
    "position_dependent_friction",
    (
        Parameter("friction_force", "N", 1.0, (0.0, math.inf), "its mean along the stroke", "N m"),
        Parameter("depth", "1", 0.5, (0.0, 1.0), "part of it that comes and goes"),
        width("width", "displacement of one radian of that"),
        Parameter("phase", "rad", 0.0, (-math.inf, math.inf), "phase at rest"),
        Parameter("slow", "m/s", 1e-3, (1e-12, math.inf), "velocity that rounds the reversal", "rad/s"),
    ),
    wavy_force,
    equation="f = Fc (1 + d cos(q/w + phase)) tanh(v/v0)",
    reference="Armstrong-Helouvry 1991, Control of Machines with Friction, ch. 4 (position dependence)",
)


@kernel
def blow_force(t, q, v, z, theta, f):
    """``f = F exp(-((t - t0)/w)^2 / 2)``."""
    u = (t - theta[1]) / theta[2]
    f[0] += theta[0] * math.exp(-0.5 * u * u)


UNMEASURED_LOAD = ForceLaw(
    "unmeasured_load",
    (
        Parameter("force", "N", 1.0, (0.0, math.inf), "largest", "N m"),
        Parameter("moment", "s", 1.0, (0.0, math.inf), "when it is largest"),
        Parameter("width", "s", 0.1, (1e-9, math.inf), "how long it takes"),
    ),
    blow_force,
    equation="f = F exp(-((t - t0)/w)^2 / 2)",
    reference="Ewins 2000, Modal Testing, ch. 3 (unmeasured excitation)",
)

RESTITUTION_STOP = "restitution_stop"

FOREIGN_LAWS: tuple[ForceLaw, ...] = (
    MODULATED_STIFFNESS,
    FRACTIONAL_DAMPING,
    SNAP_THROUGH,
    SWITCHING_STIFFNESS,
    FRICTION_CONE,
    SATURATING_SPRING,
    HERTZ_CONTACT,
    HIDDEN_RESONATOR,
    DISPLACEMENT_DEPENDENT_DAMPING,
    STRESS_SOFTENING,
    POSITION_DEPENDENT_FRICTION,
    UNMEASURED_LOAD,
)
"""Foreign laws; `restitution_stop` is no law."""

FOREIGN_NAMES: tuple[str, ...] = (*(law.name for law in FOREIGN_LAWS), RESTITUTION_STOP)
"""Names of all foreign effects."""
