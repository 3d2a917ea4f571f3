"""Polynomial-basis force law on any number of joints: full tensor or total degree, Chebyshev or power series.

The reduced-order joint of the dissertation's section 4.1.3: each restoring force is a linear combination of products
of polynomials in the relative states ``s = (q_1 … q_n, v_1 … v_n)``. The states enter scaled,
``u = (s - centre) / scale``, so that a Chebyshev basis is used on [-1, 1], where it is bounded by 1; outside it
continues as the polynomial it is, and grows as fast. `network_law` is the near-namesake that saturates instead, and so does a
*bounded* polynomial: outside the box of its scaled range it takes the states at the nearest point of the box and adds
``k (q - q_box) + c (v - v_box)`` with k, c >= 0 along each coordinate. Its force then grows linearly and towards the box, so
that no closed loop runs away, whatever work the polynomial does within.

Terms are stored as runs: all exponents of the last state from 0 up share one product of the other states, so that a
tensor of order 3 in four states costs 64 products instead of 256, without a scratch array. (A table of all one-state
polynomials would save little more and would need memory on the stack; a nested Horner scheme needs a full tensor.)
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import ParameterError, UnknownNameError
from bench.laws.base import MAX_COORDINATES, ForceLaw, Parameter, kernel

Kind = Literal["tensor", "total"]
Basis = Literal["chebyshev", "power"]

MAX_TERMS = 20_000
"""Most terms a force; beyond it a polynomial is no reduced-order model (a 12-state tensor of order 3 has 16.8 million)."""


@kernel
def force(t, q, v, z, theta, f):
    """``f_o = sum_t a_ot prod_i P_e(t,i)(u_i)``, with ``P_(k+1) = (1 + c) u P_k - c P_(k-1)``, c = 1 Chebyshev, 0 power."""
    bounded = theta[0] >= 2.0
    c = theta[0] - 2.0 if bounded else theta[0]
    n = int(theta[1])
    n_terms = int(theta[2])
    n_runs = int(theta[3])
    coefficient = int(theta[4])
    centre = 5
    inverse = 5 + 2 * n
    run = 5 + 4 * n
    last = (v[n - 1] - theta[centre + 2 * n - 1]) * theta[inverse + 2 * n - 1]
    if bounded:
        last = min(max(last, -1.0), 1.0)
    for _ in range(n_runs):
        n_factors = int(theta[run])
        length = int(theta[run + 1])
        run += 2
        product = 1.0
        for _ in range(n_factors):
            i = int(theta[run])
            exponent = int(theta[run + 1])
            run += 2
            s = q[i] if i < n else v[i - n]
            u = (s - theta[centre + i]) * theta[inverse + i]
            if bounded:
                u = min(max(u, -1.0), 1.0)
            previous = 1.0
            current = u
            for _ in range(1, exponent):
                following = (1.0 + c) * u * current - c * previous
                previous = current
                current = following
            product *= current
        for o in range(n):
            a = coefficient + o * n_terms
            total = theta[a]
            previous = 1.0
            current = last
            for k in range(1, length):
                total += theta[a + k] * current
                following = (1.0 + c) * last * current - c * previous
                previous = current
                current = following
            f[o] += product * total
        coefficient += length
    if bounded:
        coefficient += (n - 1) * n_terms
        for i in range(2 * n):
            s = (q[i] if i < n else v[i - n]) - theta[centre + i]
            width = 1.0 / theta[inverse + i]
            f[i if i < n else i - n] += theta[coefficient + i] * (s - min(max(s, -width), width))


def polynomial_exponents(
    orders: Sequence[int], kind: Kind = "tensor", *, degree: int | None = None
) -> NDArray[np.int64]:
    """Exponents of all terms, in the order of the coefficients (lexicographic, the last state fastest).

    Args:
        orders: Highest exponent of each state.
        kind: "tensor" keeps every combination, ``prod(order + 1)`` terms; "total" those whose exponents sum to at most
            `degree`.
        degree: Largest sum of exponents for "total"; the largest of `orders` if None.

    Returns:
        ``(n_terms, n_states)``.

    Raises:
        UnknownNameError: `kind` is neither "tensor" nor "total".
        ParameterError: An order is negative, a degree was given for a tensor, or there are more than `MAX_TERMS` terms.
    """
    if kind not in ("tensor", "total"):
        raise UnknownNameError("kind of polynomial", kind, ("tensor", "total"))
    orders = [int(order) for order in orders]
    if not orders or min(orders) < 0:
        raise ParameterError(
            f"polynomial orders are {tuple(orders)}; one order of 0 or more a state is expected"
        )
    if kind == "tensor" and degree is not None:
        raise ParameterError(
            f"degree {degree} came with kind='tensor'; give kind='total' to bound the sum of exponents"
        )
    limit = sum(orders) if kind == "tensor" else (max(orders) if degree is None else int(degree))
    prefixes: list[tuple[int, ...]] = [()]
    for order in orders:
        prefixes = [
            (*prefix, exponent)
            for prefix in prefixes
            for exponent in range(min(order, limit - sum(prefix)) + 1)
        ]
        if len(prefixes) > MAX_TERMS:
            raise ParameterError(
                f"a {kind} polynomial of orders {tuple(orders)} has more than {MAX_TERMS} terms; "
                "lower the orders or use kind='total' with a small degree"
            )
    return np.array(prefixes, dtype=np.int64)


def polynomial_law(
    orders: Sequence[int] = (3, 3, 3, 3),
    kind: Kind = "tensor",
    *,
    degree: int | None = None,
    basis: Basis = "chebyshev",
    centre: ArrayLike = 0.0,
    scale: ArrayLike = 1.0,
    bounded: bool = False,
) -> ForceLaw:
    """Build the polynomial law of one set of orders; the coefficients are its parameters.

    Args:
        orders: Highest exponent of each state ``(q_1 … q_n, v_1 … v_n)``; their number is twice that of the joints.
        kind: "tensor" (the dissertation's choice, 256 coefficients a force for order 3 in four states) or "total".
        degree: Largest sum of exponents for "total"; the largest of `orders` if None.
        basis: "chebyshev" (default: bounded by 1 on the scaled range) or "power".
        centre: Centre of each state's range (2 n,) or one number [m, rad, m/s, rad/s].
        scale: Half-width of each state's range, above 0, (2 n,) or one number [m, rad, m/s, rad/s].
        bounded: Whether the law is held at the edge of its range, with a spring and a damper beyond: two parameters more a
            coordinate, k_beyond and c_beyond.

    Returns:
        A law on n coordinates. A coefficient ``a<o>[e_1,…]`` multiplies scaled, dimensionless states and so has the unit
        of force o. The defaults are those of the linear element.

    Raises:
        ParameterError: An odd number of orders, too many joints or terms, a scale that is not positive.
        UnknownNameError: Unknown `kind` or `basis`.

    References:
        Masri and Caughey 1979; Tasbihgoo 2006, eqs. 4.10-4.13.
    """
    if basis not in ("chebyshev", "power"):
        raise UnknownNameError("polynomial basis", basis, ("chebyshev", "power"))
    n_states = len(orders)
    if n_states % 2 or not 1 <= n_states // 2 <= MAX_COORDINATES:
        raise ParameterError(
            f"{n_states} polynomial orders came; two a joint are expected (displacements, then velocities), "
            f"for 1 to {MAX_COORDINATES} joints"
        )
    n = n_states // 2
    exponents = polynomial_exponents(orders, kind, degree=degree)
    middle = np.broadcast_to(np.asarray(centre, dtype=float), (n_states,))
    width = np.broadcast_to(np.asarray(scale, dtype=float), (n_states,))
    if not (np.all(np.isfinite(middle)) and np.all(np.isfinite(width)) and np.all(width > 0)):
        raise ParameterError(f"centre {middle} and scale {width} must be finite, and the scale above 0")
    runs, n_runs = _runs(exponents)
    fixed = [float(basis == "chebyshev") + 2.0 * bounded, float(n), float(len(exponents)), float(n_runs)]
    header = [*fixed, float(len(fixed) + 1 + 2 * n_states + len(runs)), *middle, *(1.0 / width), *runs]
    return ForceLaw(
        name="polynomial",
        parameters=(*_coefficients(exponents, middle, width), *(beyond_parameters(n) if bounded else ())),
        force=force,
        equation="f_o = sum a_o[e] prod P_e_i(u_i), u = (s - centre) / scale, s = (q, v)",
        reference="Masri and Caughey 1979; Tasbihgoo 2006, eqs. 4.10-4.13",
        n_coordinates=n,
        header=tuple(float(entry) for entry in header),
    )


def polynomial_law_of(header: Sequence[float]) -> ForceLaw:
    """The polynomial law that has this header: orders, basis and scaling are read off it.

    Raises:
        ParameterError: No polynomial law has it.
    """
    entries = [float(entry) for entry in header]
    try:
        n = int(entries[1])
        position, exponents = 5 + 4 * n, []
        for _ in range(int(entries[3])):
            n_factors, length = int(entries[position]), int(entries[position + 1])
            row = [0] * (2 * n)
            for k in range(n_factors):
                row[int(entries[position + 2 + 2 * k])] = int(entries[position + 3 + 2 * k])
            exponents += [[*row[:-1], last] for last in range(length)]
            position += 2 + 2 * n_factors
        terms = np.array(exponents, dtype=np.int64)
        orders = [int(order) for order in terms.max(axis=0)]
        degree = int(terms.sum(axis=1).max())
        tensor = len(terms) == int(np.prod([order + 1 for order in orders]))
        law = polynomial_law(
            orders,
            "tensor" if tensor else "total",
            degree=None if tensor else degree,
            basis="chebyshev" if entries[0] % 2.0 else "power",
            centre=entries[5 : 5 + 2 * n],
            scale=1.0 / np.array(entries[5 + 2 * n : 5 + 4 * n]),
            bounded=entries[0] >= 2.0,
        )
    except (IndexError, ValueError, ZeroDivisionError) as error:
        raise ParameterError(
            f"a header of {len(entries)} numbers is that of no polynomial law: {error}"
        ) from error
    # The reciprocal of a reciprocal may be off by one bit; the header that came is the one that was fitted.
    if not np.allclose(law.header, entries, rtol=1e-15, atol=0.0):
        raise ParameterError(f"a header of {len(entries)} numbers is that of no polynomial law")
    return replace(law, header=tuple(entries))


def _runs(exponents: NDArray[np.int64]) -> tuple[list[float], int]:
    """The terms as runs over the last state: number of factors, length, then (state, exponent) of each factor."""
    encoded: list[float] = []
    n_runs = 0
    for prefix, members in itertools.groupby(exponents.tolist(), key=lambda row: tuple(row[:-1])):
        factors = [(i, exponent) for i, exponent in enumerate(prefix) if exponent]
        encoded += [len(factors), len(list(members)), *itertools.chain.from_iterable(factors)]
        n_runs += 1
    return encoded, n_runs


def beyond_parameters(n: int) -> list[Parameter]:
    """Stiffness, then damping, of every coordinate beyond the range of a bounded law."""
    kinds = (("k", "N/m", "N m/rad", 1000.0, "stiffness"), ("c", "N s/m", "N m s/rad", 1.0, "damping"))
    return [
        Parameter(
            f"{letter}_beyond{o + 1}", unit, default, (0.0, math.inf), f"{what} beyond the range", rotational
        )
        for letter, unit, rotational, default, what in kinds
        for o in range(n)
    ]


def _coefficients(
    exponents: NDArray[np.int64], centre: NDArray[np.float64], scale: NDArray[np.float64]
) -> tuple[Parameter, ...]:
    n = exponents.shape[1] // 2
    linear = [1000.0] * n + [1.0] * n
    parameters = []
    for o in range(n):
        own = (o, n + o)
        reachable = [i for i in own if exponents[:, i].max() >= 1]
        constant = sum(linear[i] * centre[i] for i in reachable)
        for row in exponents.tolist():
            default = 0.0
            if sum(row) == 0:
                default = constant
            elif sum(row) == 1 and row.index(1) in own:
                default = linear[row.index(1)] * scale[row.index(1)]
            name = f"a{o + 1}[{','.join(map(str, row))}]"
            parameters.append(
                Parameter(name, "N", float(default), description="coefficient", rotational="N m")
            )
    return tuple(parameters)
