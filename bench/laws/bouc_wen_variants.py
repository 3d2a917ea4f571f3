"""Bouc-Wen hysteresis that degrades, that pinches, and with several powers at once.

- `bouc_wen_degrading`: strength (nu) and stiffness (eta) and the initial slope (A) change with the work done
  on the hysteretic force, ``e' = z v`` [J], which grows by the loop's area a cycle. ``nu = 1 + delta_nu e``,
  ``eta = 1 + delta_eta e``, ``A = A0 - delta_A e``, not below zero. With all delta zero it is `bouc_wen`.
- `bouc_wen_pinching`: the rate is multiplied by ``h = 1 - zeta1 exp(-(z sgn(v)/zu - q)^2/zeta2^2)``, so that
  the loop is slack near a force of q times the ultimate strength zu (slip-lock: bolts in worn holes, nails in
  timber, cracked concrete). ``zeta1 = zeta10 (1 - exp(-p e))`` (severity) and
  ``zeta2 = (psi0 + delta_psi e)(lambda + zeta1)`` (spread) grow with e. The exponent is written with z/zu
  rather than z, so that q, zeta2 and psi0 have no unit. Degradation of strength and stiffness included. A
  `gap` in series is the sharp, undamaged form of slip. Below zeta10 = 1 the rate keeps its sign; zeta10 = 0
  gives `bouc_wen_degrading`.
- `generalised_bouc_wen`: N powers with their own weights, plus elastic, viscous and cubic terms, all linear
  in the parameters: the model that the dissertation identifies on line (N = 2: 7 parameters). The powers act
  on the *total* force ``r = k q + c v + d q^3 + w``, and the state is w. With c = d = 0 and one power it is
  `bouc_wen` with A = k.

The energies must be positive for the damage to be: for a motion that gives work back the state e decreases,
as in the sources.

References:
    Baber & Wen 1981, J. Eng. Mech. Div. 107(6); Baber & Noori 1985, J. Eng. Mech. 111(8); Foliente 1995, J.
    Struct. Eng. 121(6); Tasbihgoo 2006, eqs. 2.5, 2.16 and section 2.4.1.
"""

from __future__ import annotations

import math
from functools import lru_cache

from bench.errors import ParameterError
from bench.laws.base import ForceLaw, Parameter, kernel
from bench.laws.bouc_wen import BOUC_WEN

MAX_POWERS = 12
"""Most powers of a generalised Bouc-Wen law; the terms are nearly collinear long before."""


@kernel
def force(t, q, v, z, theta, f):
    """``f = z``."""
    f[0] += z[0]


@kernel
def rate_degrading(t, q, v, z, theta, zdot):
    """``eta z' = A v - nu (beta |v| |z|^(n-1) z + gamma v |z|^n)``, ``e' = z v``."""
    r = z[0]
    magnitude = abs(r)
    n = theta[3]
    power_less = 1.0 if n == 1.0 else magnitude ** (n - 1.0)
    slope = max(theta[0] - theta[4] * z[1], 0.0)
    nu = 1.0 + theta[5] * z[1]
    eta = 1.0 + theta[6] * z[1]
    hysteretic = theta[1] * abs(v[0]) * power_less * r + theta[2] * v[0] * power_less * magnitude
    zdot[0] = (slope * v[0] - nu * hysteretic) / eta
    zdot[1] = r * v[0]


@kernel
def rate_pinching(t, q, v, z, theta, zdot):
    """``eta z' = h(z, e) (A v - nu (beta |v| |z|^(n-1) z + gamma v |z|^n))``, ``e' = z v``."""
    r = z[0]
    magnitude = abs(r)
    n = theta[3]
    power_less = 1.0 if n == 1.0 else magnitude ** (n - 1.0)
    nu = 1.0 + theta[4] * z[1]
    eta = 1.0 + theta[5] * z[1]
    softening = nu * (theta[1] + theta[2])
    pinch = 1.0
    severity = theta[7] * (1.0 - math.exp(-theta[8] * max(z[1], 0.0)))
    if softening > 0.0 and severity > 0.0:  # without ultimate strength there is no level to pinch at
        strength = (theta[0] / softening) ** (1.0 / n)
        spread = (theta[9] + theta[10] * max(z[1], 0.0)) * (theta[11] + severity)
        along = r if v[0] >= 0.0 else -r
        distance = (along / strength - theta[6]) / spread
        pinch = 1.0 - severity * math.exp(-distance * distance)
    hysteretic = theta[1] * abs(v[0]) * power_less * r + theta[2] * v[0] * power_less * magnitude
    zdot[0] = pinch * (theta[0] * v[0] - nu * hysteretic) / eta
    zdot[1] = r * v[0]


@kernel
def force_generalised(t, q, v, z, theta, f):
    """``f = k q + c v + d q^3 + w``."""
    f[0] += theta[1] * q[0] + theta[2] * v[0] + theta[3] * q[0] * q[0] * q[0] + z[0]


@kernel
def rate_generalised(t, q, v, z, theta, zdot):
    """``w' = -sum_n (beta_n |v| |r|^(n-1) r + gamma_n v |r|^n)``, r the total force."""
    r = theta[1] * q[0] + theta[2] * v[0] + theta[3] * q[0] * q[0] * q[0] + z[0]
    magnitude = abs(r)
    power_less = 1.0
    total = 0.0
    for i in range(int(theta[0])):
        beta = theta[4 + 2 * i]
        gamma = theta[5 + 2 * i]
        total += power_less * (beta * abs(v[0]) * r + gamma * v[0] * magnitude)
        power_less *= magnitude
    zdot[0] = -total


BOUC_WEN_DEGRADING = ForceLaw(
    name="bouc_wen_degrading",
    parameters=(
        *BOUC_WEN.parameters,
        Parameter("delta_A", "N/(m J)", 0.0, (0.0, math.inf), "loss of initial slope a joule", "N m/(rad J)"),
        Parameter("delta_nu", "1/J", 0.1, (0.0, math.inf), "strength degradation a joule"),
        Parameter("delta_eta", "1/J", 0.1, (0.0, math.inf), "stiffness degradation a joule"),
    ),
    force=force,
    rate=rate_degrading,
    states=("z [N]", "e [J]"),
    equation="f = z, eta z' = A v - nu (beta |v| |z|^(n-1) z + gamma v |z|^n), e' = z v; A, nu, eta linear in e",
    reference="Baber & Wen 1981; Tasbihgoo 2006, eq. 2.3 with varying eta, nu",
    smoothness="continuous",
)

BOUC_WEN_PINCHING = ForceLaw(
    name="bouc_wen_pinching",
    parameters=(
        Parameter("A", "N/m", 1000.0, (0.0, math.inf), "initial stiffness", "N m/rad"),
        *BOUC_WEN.parameters[1:],
        Parameter("delta_nu", "1/J", 0.05, (0.0, math.inf), "strength degradation a joule"),
        Parameter("delta_eta", "1/J", 0.05, (0.0, math.inf), "stiffness degradation a joule"),
        Parameter("q", "1", 0.1, (-1.0, 1.0), "force level of the pinch over the ultimate strength"),
        Parameter("zeta_10", "1", 0.8, (0.0, 1.0), "largest severity of pinching"),
        Parameter("p", "1/J", 1.0, (0.0, math.inf), "how fast pinching sets in"),
        Parameter("psi_0", "1", 0.2, (1e-6, math.inf), "spread of the pinched region"),
        Parameter("delta_psi", "1/J", 0.01, (0.0, math.inf), "growth of the spread a joule"),
        Parameter("lambda_", "1", 0.5, (1e-6, math.inf), "coupling of spread and severity"),
    ),
    force=force,
    rate=rate_pinching,
    states=("z [N]", "e [J]"),
    equation="f = z, eta z' = h (A v - nu (beta |v| |z|^(n-1) z + gamma v |z|^n)), "
    "h = 1 - zeta1 exp(-(z sgn(v)/zu - q)^2/zeta2^2)",
    reference="Baber & Noori 1985; Foliente 1995, J. Struct. Eng. 121(6)",
    smoothness="continuous",
)


@lru_cache(maxsize=16)
def generalised_bouc_wen_law(n_powers: int = 2) -> ForceLaw:
    """Bouc-Wen law with powers 1 to `n_powers` and elastic, viscous and cubic terms.

    Args:
        n_powers: Number of powers N, 1 to `MAX_POWERS`; the law has ``3 + 2 N`` parameters.

    Raises:
        ParameterError: `n_powers` is outside its range.
    """
    if not 1 <= n_powers <= MAX_POWERS:
        raise ParameterError(f"a generalised Bouc-Wen law takes 1 to {MAX_POWERS} powers; {n_powers} came")
    free = (-math.inf, math.inf)
    weights: list[Parameter] = []
    for n in range(1, n_powers + 1):
        force_part = "" if n == 1 else f" N^{n - 1}" if n > 2 else " N"
        torque_part = "" if n == 1 else f" (N m)^{n - 1}"
        unit = f"1/(m{force_part})" if n > 1 else "1/m"
        rotational = f"1/(rad{torque_part})" if n > 1 else "1/rad"
        default = 100.0 if n == 1 else 0.0
        weights.append(Parameter(f"beta_{n}", unit, default, free, f"loop width, power {n}", rotational))
        weights.append(
            Parameter(f"gamma_{n}", unit, 0.5 * default, free, f"loop skew, power {n}", rotational)
        )
    return ForceLaw(
        name="generalised_bouc_wen",
        parameters=(
            Parameter("k", "N/m", 1000.0, free, "elastic (initial) stiffness", "N m/rad"),
            Parameter("c", "N s/m", 0.0, free, "viscous constant", "N m s/rad"),
            Parameter("d", "N/m^3", 0.0, free, "cubic stiffness", "N m/rad^3"),
            *weights,
        ),
        force=force_generalised,
        rate=rate_generalised,
        states=("w [N]",),
        equation="f = r = k q + c v + d q^3 + w, w' = -sum_n (beta_n |v| |r|^(n-1) r + gamma_n v |r|^n)",
        reference="Tasbihgoo 2006, eqs. 2.5, 2.16 and section 2.4.1",
        smoothness="continuous",
        header=(float(n_powers),),
    )


GENERALISED_BOUC_WEN = generalised_bouc_wen_law()
