"""Effects that stand in no catalogue: what the blind protocol withholds so that *unknown* can be put to the test.

Each is a force that engineers meet and that no law of `bench.laws` describes. None of them may ever enter the catalogue
or the closures; they are laws all the same, so that MuJoCo's callback integrates them like any other.

- `modulated_stiffness`: a stiffness that follows the clock (a gear mesh, a breathing crack); the force depends on time.
- `fractional_damping`: ``C d^alpha q / dt^alpha``, memory over decades of time, as rubber has; eight relaxations side by
  side, where the catalogue has one.
- `snap_through`: a force of negative slope within a window about rest, as a buckled leaf gives, and none outside.
- `switching_stiffness`: a spring that latches in beyond one amplitude and lets go below a smaller one: a state that
  remembers which threshold was passed last.
- `friction_cone`: friction in two directions with one limit for both together; axial slip lowers the torsional friction.
- `restitution_stop`: a rigid stop that throws back with a coefficient of restitution; an impulse, hence no law: the time
  stepping of `bench.discrepancy.blind.time_stepping` knows it.
"""

from __future__ import annotations

import math

from bench.laws.base import ForceLaw, Parameter, kernel

BRANCHES = 8
"""Relaxations that stand for a fractional derivative: two a decade keep its storage and loss to 2 % over the middle ones."""


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
    tuple(f"z{i} [N]" for i in range(BRANCHES)),
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

RESTITUTION_STOP = "restitution_stop"

FOREIGN_LAWS: tuple[ForceLaw, ...] = (
    MODULATED_STIFFNESS,
    FRACTIONAL_DAMPING,
    SNAP_THROUGH,
    SWITCHING_STIFFNESS,
    FRICTION_CONE,
)
"""Foreign laws; `restitution_stop` is no law."""

FOREIGN_NAMES: tuple[str, ...] = (*(law.name for law in FOREIGN_LAWS), RESTITUTION_STOP)
"""Names of all foreign effects."""
