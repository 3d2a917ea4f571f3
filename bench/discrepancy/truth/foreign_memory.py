"""Forces of no catalogue that remember: they have hidden states. What each is stands in `out_of_catalogue`."""

from __future__ import annotations

import math
from dataclasses import dataclass

from bench.discrepancy.truth.foreign_parameters import stiffness, width
from bench.laws.base import ForceLaw, Parameter, kernel


@dataclass(frozen=True)
class ForeignMemorySettings:
    """Numbers of `bench.discrepancy.truth.out_of_catalogue`."""

    branches: int = 8
    """Relaxations that stand for a fractional derivative: two a decade keep its storage and loss to 2 % over the middle ones."""


SETTINGS = ForeignMemorySettings()


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
        stiffness("of what holds the mass"),
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
        stiffness("before anything has moved"),
        width("width", "displacement that takes a factor of e"),
        Parameter("time", "s", 0.002, (1e-6, math.inf), "time the softening takes"),
    ),
    softening_force,
    softening_rate,
    ("largest displacement [m]",),
    equation="f = k q exp(-max|q|/w)",
    reference="Mullins 1969, Rubber Chem. Technol. 42(1)",
    smoothness="continuous",
)
