"""Effects that stand in no catalogue: what the blind protocol withholds so that *unknown* can be put to the test.

Each is a force that engineers meet and that no law of `bench.laws` describes. None of them may ever enter the catalogue;
they are laws all the same, so that MuJoCo's callback integrates them like any other.

- `modulated_stiffness`: a stiffness that follows the clock (a gear mesh, a breathing crack); the force depends on time.
- `fractional_damping`: ``C d^alpha q / dt^alpha``, memory over decades of time, as rubber has; eight relaxations side by
  side, where the catalogue has one.
- `snap_through`: a force of negative slope within a window about rest, as a buckled leaf gives, and none outside.
- `switching_stiffness`: a spring that latches in beyond one amplitude and lets go below a smaller one: a state that
  remembers which threshold was passed last.
- `friction_cone`: friction in two directions with one limit for both together; axial slip lowers the torsional friction.
- `saturating_spring`: a stiffness about rest that fades with the displacement, as a magnet's or a slipping belt's does.
- `hertz_contact`: a contact whose force grows with the penetration to 3/2, on one side.
- `hidden_resonator`: a mass on a spring that nobody modelled: complex memory, where a relaxation's is real.
- `displacement_dependent_damping`: ``c q^2 v``, a product of two coordinates.
- `stress_softening`: a spring that gives way with the largest displacement it has ever seen, and never recovers.
- `position_dependent_friction`: friction that rises and falls along the stroke, as a lead screw's does.
- `unmeasured_load`: a blow from outside at one moment.
- `restitution_stop`: a rigid stop that throws back with a coefficient of restitution; an impulse, hence no law: the time
  stepping of `bench.discrepancy.truth.moreau_time_stepping` knows it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from bench.laws.base import ForceLaw, Parameter, kernel


@dataclass(frozen=True)
class OutOfCatalogueSettings:
    """Numbers of `bench.discrepancy.truth.out_of_catalogue`."""

    branches: int = 8
    """Relaxations that stand for a fractional derivative: two a decade keep its storage and loss to 2 % over the middle ones."""


SETTINGS = OutOfCatalogueSettings()


@kernel
def modulated_force(t, q, v, z, theta, f):
    """``f = k sin(2 pi frequency t + phase) q``."""
    f[0] += theta[0] * math.sin(2.0 * math.pi * theta[1] * t + theta[2]) * q[0]


MODULATED_STIFFNESS = ForceLaw(
    "modulated_stiffness",
    (
        Parameter("stiffness", "N/m", 100.0, (0.0, math.inf), "amplitude of the modulation", "N m/rad"),
        Parameter("frequency", "Hz", 1.0, (0.0, math.inf), "frequency of the modulation"),
        Parameter("phase", "rad", 0.0, (-math.inf, math.inf), "phase at t = 0"),
    ),
    modulated_force,
    equation="f = k sin(2 pi frequency t + phase) q",
    reference="Nayfeh & Mook 1979, Nonlinear Oscillations, ch. 5 (parametric excitation)",
)


@kernel
def fractional_force(t, q, v, z, theta, f):
    """``f = sum of the branches' forces``."""
    f[0] += z[0] + z[1] + z[2] + z[3] + z[4] + z[5] + z[6] + z[7]


@kernel
def fractional_rate(t, q, v, z, theta, zdot):
    """``z_i' = k_i v - z_i / tau_i``, k_i and tau_i the nodes of the kernel ``t^-alpha`` over logarithmic time."""
    tau = theta[2]
    weight = theta[0] * math.log(theta[3]) * math.sin(math.pi * theta[1]) / math.pi
    for i in range(8):
        zdot[i] = weight * tau ** -theta[1] * v[0] - z[i] / tau
        tau *= theta[3]


FRACTIONAL_DAMPING = ForceLaw(
    "fractional_damping",
    (
        Parameter("C", "N s/m", 10.0, (0.0, math.inf), "coefficient, in N s^alpha/m", "N m s/rad"),
        Parameter("alpha", "1", 0.5, (0.05, 0.95), "order of the derivative"),
        Parameter("shortest_time", "s", 0.002, (1e-9, math.inf), "relaxation time of the first branch"),
        Parameter("ratio", "1", 3.16, (1.01, 100.0), "ratio of successive relaxation times"),
    ),
    fractional_force,
    fractional_rate,
    tuple(f"z{i} [N]" for i in range(SETTINGS.branches)),
    equation="f = C d^alpha q / dt^alpha",
    reference="Bagley & Torvik 1983, J. Rheology 27(3); Papoulia et al. 2010, Rheol. Acta 49 (sums of exponentials)",
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
        Parameter("stiffness", "N/m", 100.0, (0.0, math.inf), "magnitude of the negative slope", "N m/rad"),
        Parameter("window", "m", 0.002, (1e-12, math.inf), "half-width of the window", "rad"),
    ),
    snap_force,
    equation="f = -k q (1 - (q/w)^2)^2 for |q| < w, else 0",
    reference="Harne & Wang 2013, Smart Mater. Struct. 22 (bistable elements)",
)


@kernel
def switching_force(t, q, v, z, theta, f):
    """``f = k z q``, z the state of the latch from 0 to 1."""
    f[0] += theta[0] * z[0] * q[0]


@kernel
def switching_rate(t, q, v, z, theta, zdot):
    """``z' = (1 - z)/tau`` above the upper amplitude, ``-z/tau`` below the lower one, 0 in between."""
    amplitude = math.sqrt(q[0] * q[0] + v[0] * v[0] / (theta[4] * theta[4]))
    if amplitude > theta[1]:
        zdot[0] = (1.0 - z[0]) / theta[3]
    elif amplitude < theta[2]:
        zdot[0] = -z[0] / theta[3]
    else:
        zdot[0] = 0.0


SWITCHING_STIFFNESS = ForceLaw(
    "switching_stiffness",
    (
        Parameter("stiffness", "N/m", 100.0, (-math.inf, math.inf), "spring that latches in", "N m/rad"),
        Parameter("upper", "m", 0.004, (0.0, math.inf), "amplitude at which it latches in", "rad"),
        Parameter("lower", "m", 0.002, (0.0, math.inf), "amplitude at which it lets go", "rad"),
        Parameter("time", "s", 0.01, (1e-6, math.inf), "time the latch takes"),
        Parameter("omega", "rad/s", 20.0, (1e-6, math.inf), "makes a velocity an amplitude"),
    ),
    switching_force,
    switching_rate,
    ("latch [1]",),
    equation="f = k z q; z goes to 1 where sqrt(q^2 + (v/omega)^2) > upper, to 0 where it is < lower",
    reference="Visintin 1994, Differential Models of Hysteresis, ch. VI (relays with delay)",
    smoothness="continuous",
)


@kernel
def cone_force(t, q, v, z, theta, f):
    """``f1 = s z1``, ``f2 = r s z2``: bristles of stiffness s, the torsional ones at the radius r."""
    f[0] += theta[1] * z[0]
    f[1] += theta[2] * theta[1] * z[1]


@kernel
def cone_rate(t, q, v, z, theta, zdot):
    """``z' = u - s |u| z / Fc`` with the slip velocity ``u = (v, r w)`` of both directions."""
    across = theta[2] * v[1]
    speed = math.sqrt(v[0] * v[0] + across * across)
    zdot[0] = v[0] - theta[1] * speed * z[0] / theta[0]
    zdot[1] = across - theta[1] * speed * z[1] / theta[0]


FRICTION_CONE = ForceLaw(
    "friction_cone",
    (
        Parameter("limit", "N", 5.0, (1e-12, math.inf), "friction force, whatever the direction of slip"),
        Parameter("bristle_stiffness", "N/m", 1e4, (1e-9, math.inf), "stiffness before slip"),
        Parameter("radius", "m", 0.05, (1e-9, math.inf), "radius at which the torsional slip takes place"),
    ),
    cone_force,
    cone_rate,
    ("z1 [m]", "z2 [m]"),
    equation="f = s z, z' = u - s |u| z / Fc, u = (x', r theta')",
    reference="Goyal, Ruina & Papadopoulos 1991, Wear 143 (limit surface); Dahl's bristles in the plane",
    n_coordinates=2,
    smoothness="continuous",
)


@kernel
def saturating_force(t, q, v, z, theta, f):
    """``f = k w tanh(q/w)``."""
    f[0] += theta[0] * theta[1] * math.tanh(q[0] / theta[1])


SATURATING_SPRING = ForceLaw(
    "saturating_spring",
    (
        Parameter("stiffness", "N/m", 100.0, (0.0, math.inf), "stiffness about rest", "N m/rad"),
        Parameter("width", "m", 0.002, (1e-12, math.inf), "displacement about which it fades", "rad"),
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
        Parameter("stiffness", "N/m", 100.0, (0.0, math.inf), "in N/m^1.5", "N m/rad"),
        Parameter("position", "m", 0.0, (-math.inf, math.inf), "where the contact begins", "rad"),
        Parameter("side", "1", 1.0, (-1.0, 1.0), "1 for larger displacements, -1 for smaller ones"),
    ),
    hertz_force,
    equation="f = s k max(s (q - p), 0)^1.5",
    reference="Johnson 1985, Contact Mechanics, ch. 4",
)


@kernel
def resonator_force(t, q, v, z, theta, f):
    """``f = k (q - y) + c (v - y')``."""
    f[0] += theta[0] * (q[0] - z[0]) + theta[2] * (v[0] - z[1])


@kernel
def resonator_rate(t, q, v, z, theta, zdot):
    """``m y'' = k (q - y) + c (v - y')``."""
    zdot[0] = z[1]
    zdot[1] = (theta[0] * (q[0] - z[0]) + theta[2] * (v[0] - z[1])) / theta[1]


HIDDEN_RESONATOR = ForceLaw(
    "hidden_resonator",
    (
        Parameter("stiffness", "N/m", 100.0, (0.0, math.inf), "of what holds the mass", "N m/rad"),
        Parameter("mass", "kg", 1.0, (1e-12, math.inf), "hidden mass", "kg m^2"),
        Parameter("damping", "N s/m", 0.1, (0.0, math.inf), "of what holds the mass", "N m s/rad"),
    ),
    resonator_force,
    resonator_rate,
    ("y [m]", "y' [m/s]"),
    equation="f = k (q - y) + c (v - y') = m y''",
    reference="Den Hartog 1956, Mechanical Vibrations, sec. 3.2 (auxiliary mass)",
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
def softening_force(t, q, v, z, theta, f):
    """``f = k q exp(-z/w)``, z the largest displacement so far."""
    f[0] += theta[0] * q[0] * math.exp(-z[0] / theta[1])


@kernel
def softening_rate(t, q, v, z, theta, zdot):
    """``z' = (|q| - z)/tau`` beyond the largest displacement so far, else 0."""
    beyond = abs(q[0]) - z[0]
    zdot[0] = beyond / theta[2] if beyond > 0.0 else 0.0


STRESS_SOFTENING = ForceLaw(
    "stress_softening",
    (
        Parameter("stiffness", "N/m", 100.0, (0.0, math.inf), "before anything has moved", "N m/rad"),
        Parameter("width", "m", 0.002, (1e-12, math.inf), "displacement that takes a factor of e", "rad"),
        Parameter("time", "s", 0.002, (1e-6, math.inf), "time the softening takes"),
    ),
    softening_force,
    softening_rate,
    ("largest displacement [m]",),
    equation="f = k q exp(-max|q|/w)",
    reference="Mullins 1969, Rubber Chem. Technol. 42(1)",
    smoothness="continuous",
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
        Parameter("width", "m", 0.002, (1e-12, math.inf), "displacement of one radian of that", "rad"),
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
