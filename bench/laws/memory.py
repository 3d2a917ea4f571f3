"""Joint with memory: elastic-slip elements with learned profiles, a convex potential and non-negative damping.

The reduced-order joint that remembers. It acts along directions ``s_d = c_d . q`` of the joint's coordinates, with the force
``f = sum_d c_d F_d``, and every term of ``F_d`` is passive by the sign of its parameters alone:

| term | force along s | stored energy | what holds |
|---|---|---|---|
| potential | ``int_0^s k(x) dx``, k constant in cells | ``int int k >= 0`` | ``k >= 0``: convex, least at 0 |
| damping, gated by place | ``c(s_g) s'``, c linear between knots over any direction g | none | ``c >= 0`` |
| damping by speed | ``c(abs(s')) s'`` | none | ``c >= 0`` |
| slip element | ``sigma(e) = int_-r^e k(x) dx - phi int_-r^r k(x) dx`` | ``int sigma de`` on ``[-r, r]`` | ``k >= 0, 0 <= phi <= 1`` |
| Maxwell element | ``k e`` | ``k e^2 / 2`` | ``k >= 0, tau > 0`` |

A slip element's hidden state is the elastic strain e of a spring behind a slider, within its range r::

    e' = s' (1 - h(abs(e) / r)) while e s' > 0 (loading), else s'

Slip needs ``sigma(e) s' h >= 0``: where ``phi != 1/2`` has moved the place of zero force, h is 0 until sigma has the sign of s'.
h(1) = 1 keeps e within the range, at whose ends ``0 <= phi <= 1`` gives sigma the right sign. So no weights, however learned,
make the joint give out more than it took in, and no motion makes a slip element's force exceed that at its ends. With n
coordinates the same holds along any direction, so also for axes that slip together.

Two families of slip profile h, and with them the two forms of the model:

- *sliders* (no profile knots): ``h = u^2, u = (abs(e)/r - 1 + w)/w``, the rounded yield of `jenkins`. Many of them in parallel
  with a learned distribution of ranges are Iwan's model, a Prandtl-Ishlinskii operator of stops; with k varying in cells over
  ``[-r, r]`` each is a function of a stop, which is how backlash that travels with the slider and unequal limits come in.
- *profiles* (G knots): h linear between 0 and learned values at ``abs(e)/r = 1/G, 2/G, …``, 1 at the end: a Duhem operator of which
  Bouc-Wen (for which ``1 - h`` is the ratio of the slopes of loading and unloading) and Dahl are special cases. A few suffice.

Differs from `iwan` (a given power law for the distribution, one axis, sliders only), from `jenkins_backlash` (one slider of a given
shape) and from the Bouc-Wen laws, which are passive for some of their parameters only.

References:
    Iwan 1966, J. Appl. Mech. 33(4), 893-900; Krejci 1996, Hysteresis, Convexity and Dissipation in Hyperbolic Equations (functions
    of play and stop); van der Schaft & Jeltsema 2014, Port-Hamiltonian Systems Theory, ch. 2; Ikhouane & Rodellar 2007, ch. 2
    (passivity of Bouc-Wen).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

from bench.laws.base import ForceLaw, Parameter, kernel
from bench.laws.memory_layout import FIRST, MemoryLayout


@kernel
def force(t, q, v, z, theta, f):  # noqa: PLR0912, PLR0915  (one C function: a kernel calls no other)
    """Sum of potential, damping, slip and Maxwell forces, one direction after the other: terms stand in the order of theirs."""
    n = int(theta[0])
    width = n + 3
    n_directions, n_maxwell = int(theta[1]), int(theta[11])
    cells, knots, speeds = int(theta[3]), int(theta[5]), int(theta[7])
    n_slips, parts = int(theta[8]), int(theta[9])
    # places of the directions of the next term of each kind, and of its parameters
    potential = FIRST + n_directions * width
    gated = potential + int(theta[2])
    speed = gated + 2 * int(theta[4])
    slip = speed + int(theta[6])
    maxwell = slip + n_slips
    at_cell = maxwell + n_maxwell
    at_gate = at_cell + (gated - potential) * cells
    at_speed = at_gate + int(theta[4]) * knots
    at_slip = at_speed + (slip - speed) * speeds
    stride = 2 + parts + max(int(theta[10]) - 1, 0)
    at_maxwell = at_slip + n_slips * stride
    share = 1.0 / cells
    gates, rates, slips, maxwells, end = gated, speed, slip, maxwell, at_cell
    state = 0
    for direction in range(n_directions):
        row = FIRST + direction * width
        s = 0.0
        rate = 0.0
        for o in range(n):
            s += theta[row + o] * q[o]
            rate += theta[row + o] * v[o]
        low = theta[row + n]
        span = theta[row + n + 1] - low
        density = 1.0 / span
        size = span * share
        total = 0.0
        while potential < gates and theta[potential] == direction:
            # cells that hold s and 0; the first and the last reach to infinity
            there = int(min(max((s - low) * density * cells, 0.0), cells - 1.0))
            here = int(min(max(-low * density * cells, 0.0), cells - 1.0))
            if there == here:
                total += theta[at_cell + here] * s
            elif there > here:
                total += theta[at_cell + here] * (low + (here + 1) * size)
                total += theta[at_cell + there] * (s - low - there * size)
                for b in range(here + 1, there):
                    total += theta[at_cell + b] * size
            else:
                total += theta[at_cell + here] * (low + here * size)
                total += theta[at_cell + there] * (s - low - (there + 1) * size)
                for b in range(there + 1, here):
                    total -= theta[at_cell + b] * size
            at_cell += cells
            potential += 1
        damping = 0.0
        while gated < rates and theta[gated] == direction:
            x = (s - low) * density
            if theta[gated + 1] != direction:
                gate = FIRST + int(theta[gated + 1]) * width
                x = -theta[gate + n]
                for o in range(n):
                    x += theta[gate + o] * q[o]
                x /= theta[gate + n + 1] - theta[gate + n]
            x = min(max(x * (knots - 1.0), 0.0), knots - 1.0)
            b = min(int(x), knots - 2)
            damping += theta[at_gate + b] + (x - b) * (theta[at_gate + b + 1] - theta[at_gate + b])
            at_gate += knots
            gated += 2
        while speed < slips and theta[speed] == direction:
            x = min(abs(rate) / theta[row + n + 2] * (speeds - 1.0), speeds - 1.0)
            b = min(int(x), speeds - 2)
            damping += theta[at_speed + b] + (x - b) * (theta[at_speed + b + 1] - theta[at_speed + b])
            at_speed += speeds
            speed += 1
        total += damping * rate
        while slip < maxwells and theta[slip] == direction:
            r = theta[at_slip]
            if parts == 1:  # most joints' sliders
                total += theta[at_slip + 2] * (min(max(z[state], -r), r) + r - 2.0 * r * theta[at_slip + 1])
            else:
                x = (min(max(z[state], -r), r) / r + 1.0) * 0.5 * parts
                whole = 0.0
                below = 0.0
                for b in range(parts):
                    whole += theta[at_slip + 2 + b]
                    below += theta[at_slip + 2 + b] * min(max(x - b, 0.0), 1.0)
                total += 2.0 * r / parts * (below - theta[at_slip + 1] * whole)
            at_slip += stride
            slip += 1
            state += 1
        while maxwell < end and theta[maxwell] == direction:
            total += theta[at_maxwell] * z[n_slips + maxwell - maxwells]
            at_maxwell += 2
            maxwell += 1
        for o in range(n):
            f[o] += theta[row + o] * total


@kernel
def rate(t, q, v, z, theta, zdot):  # noqa: PLR0912  (one C function: a kernel calls no other)
    """``e' = s' (1 - h)`` while loading, ``s'`` while unloading; ``e' = s' - e / tau`` of Maxwell elements."""
    n = int(theta[0])
    width = n + 3
    n_gated, n_slips, parts, profile = int(theta[4]), int(theta[8]), int(theta[9]), int(theta[10])
    n_maxwell = int(theta[11])
    first = FIRST + int(theta[1]) * width
    index = first + int(theta[2]) + 2 * n_gated + int(theta[6])
    at = index + n_slips + n_maxwell
    at += int(theta[2]) * int(theta[3]) + n_gated * int(theta[5]) + int(theta[6]) * int(theta[7])
    transition = theta[12]
    stride = 2 + parts + max(profile - 1, 0)
    rate = 0.0
    for i in range(n_slips):
        if i == 0 or theta[index + i] != theta[index + i - 1]:  # neighbours along one direction move together
            row = FIRST + int(theta[index + i]) * width
            rate = 0.0
            for o in range(n):
                rate += theta[row + o] * v[o]
        slip = 0.0
        if z[i] * rate > 0.0:
            e, r = abs(z[i]), theta[at]
            if profile == 0:
                u = e - (1.0 - transition) * r
                if u > 0.0:
                    u /= transition * r
                    slip = min(u * u, 2.0)  # beyond 1 it leads back into the range
            elif e >= r:
                slip = 1.0
            else:
                x = e / r * profile
                g = min(int(x), profile - 1)
                left = theta[at + 1 + parts + g] if g > 0 else 0.0
                right = theta[at + 2 + parts + g] if g < profile - 1 else 1.0
                slip = left + (x - g) * (right - left)
            if slip > 0.0 and e < r:
                # where zero force is not at e = 0, slip begins only once the force resists: it must not give out energy
                y = (z[i] / r + 1.0) * 0.5 * parts
                sigma = 0.0
                for b in range(parts):
                    sigma += theta[at + 2 + b] * (min(max(y - b, 0.0), 1.0) - theta[at + 1])
                if sigma * rate < 0.0:
                    slip = 0.0
        zdot[i] = rate * (1.0 - slip)
        at += stride
    index += n_slips
    for i in range(n_maxwell):
        row = FIRST + int(theta[index + i]) * width
        rate = 0.0
        for o in range(n):
            rate += theta[row + o] * v[o]
        zdot[n_slips + i] = rate - z[n_slips + i] / theta[at + 1]
        at += 2


@lru_cache(maxsize=64)
def memory_law(layout: MemoryLayout) -> ForceLaw:
    """The law of one layout; all its parameters keep it passive within their bounds.

    The default of the parameters is a weak spring and damper with sliders of a tenth of each direction's range.
    """
    slips = [f"e{i + 1} [m]" for i in range(len(layout.slips))]
    maxwells = [f"u{i + 1} [m]" for i in range(len(layout.maxwells))]
    return ForceLaw(
        name="memory",
        parameters=tuple(_parameters(layout)),
        force=force,
        rate=rate if slips or maxwells else None,
        states=tuple(slips + maxwells),
        equation="f = sum_d c_d (int k ds + c(s_g) s' + c(|s'|) s' + sum sigma(e) + sum k u), e' = s' (1 - h(|e|/r)) loading, s' else",
        reference="Iwan 1966; Krejci 1996; van der Schaft & Jeltsema 2014",
        n_coordinates=layout.n_joints,
        smoothness="continuous",
        header=layout.header(),
    )


def memory_law_of(header: Sequence[float]) -> ForceLaw:
    """The law that has this header.

    Raises:
        ParameterError: No joint with memory has it.
    """
    return memory_law(MemoryLayout.of_header(tuple(float(entry) for entry in header)))


def _parameters(layout: MemoryLayout) -> list[Parameter]:
    positive = (0.0, math.inf)
    found = [
        Parameter(f"k{i + 1}[{b + 1}]", "N/m", 100.0, positive, "stiffness of a cell", "N m/rad")
        for i in range(len(layout.potentials))
        for b in range(layout.cells)
    ]
    for letter, count, knots in (
        ("c", len(layout.gated), layout.knots),
        ("d", len(layout.speeds), layout.speed_knots),
    ):
        found += [
            Parameter(f"{letter}{i + 1}[{b + 1}]", "N s/m", 1.0, positive, "damping at a knot", "N m s/rad")
            for i in range(count)
            for b in range(knots)
        ]
    for i, place in enumerate(layout.slips):
        span = layout.directions[place].high - layout.directions[place].low
        found += [
            Parameter(f"r{i + 1}", "m", 0.1 * span, (1e-12, math.inf), "range of the elastic strain", "rad"),
            Parameter(f"phi{i + 1}", "1", 0.5, (0.0, 1.0), "place of zero force: 1/2 for equal limits"),
        ]
        found += [
            Parameter(
                f"s{i + 1}[{b + 1}]", "N/m", 100.0, positive, "stiffness of a part of the range", "N m/rad"
            )
            for b in range(layout.parts)
        ]
        found += [
            Parameter(f"h{i + 1}[{g}]", "1", g / layout.profile, (0.0, 1.0), "slip at a knot")
            for g in range(1, layout.profile)
        ]
    for i in range(len(layout.maxwells)):
        found += [
            Parameter(f"km{i + 1}", "N/m", 100.0, positive, "stiffness of the branch", "N m/rad"),
            Parameter(f"tau{i + 1}", "s", 0.1, (1e-6, math.inf), "relaxation time"),
        ]
    return found
