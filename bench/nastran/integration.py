"""Time integration of the expanded system: consistent, or as Nastran's direct transient response does it.

- "consistent": the classical Runge-Kutta method on the structure's equations; at each of its stages the virtual
  rows are solved for the state at that stage. Mathematically the same as evaluating the network inside the stage, so it
  equals the direct swap of the network in MuJoCo (RK4) up to rounding. Commands are held over a step as MuJoCo holds them,
  or drawn as straight lines (`hold="linear"`).
- "nastran": ``[M/h^2 + C/2h + K/3] u_(n+1) = (P_(n+1) + P_n + P_(n-1))/3 + N + [2M/h^2 - K/3] u_n + [-M/h^2 + C/2h - K/3]
  u_(n-1)``. The scheme is of second order and unconditionally stable for linear systems (Newmark with beta = 1/3), but the
  NOLIN1 loads N come from known steps and are never iterated: ``N = N_n``, or with DIAG 10, as the dissertation's deck has
  it, the mean of the last three, ``N = (N_n + N_(n-1) + N_(n-2))/3``.

What that does to the deck's virtual points, which have no mass: with the mean, the row of S2 reads ``S2_(n+1) =
tanh(S1_n)``, one step late, and the joint's force, a mean about step n - 1 applied at step n, is late by one step more.
The restoring force thus lags by two steps and the error is of first order in h; a lagging force feeds energy in like a
damper of ``-2 h k``, which sets the step (1e-5 s in the deck). Without the mean the row reads
``S2_(n+1) + S2_n + S2_(n-1) = 3 tanh(S1_n)``: its own solutions alternate with a period of three steps, undamped, and the
joint couples them back. With the published network that is unstable at every step tried, 1e-6 to 1e-3 s;
`averaged=False` shows it.

`start="consistent"` begins with the virtual points in equilibrium; a deck without TIC cards begins with them at zero.
The linear loads at the start are those that hold the initial state, as NASTRAN takes them. Computed from the published
algorithm; no Nastran was at hand to compare with, and versions that choose their own step or add numerical damping differ.

References:
    NASA, NASTRAN-95 source, routines TRD1C (stepping), TRD1D (nonlinear loads, DIAG 10) and FORM1 (start);
    MacNeal 1972, The NASTRAN Theoretical Manual, NASA SP-221, section 11; Tasbihgoo 2006, section 5.1.3 and appendix B.3.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, NamedTuple, get_args

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import ParameterError, SimulationError, UnknownNameError
from bench.nastran.expanded import ExpandedSystem, controls_matrix

Method = Literal["consistent", "nastran"]
Hold = Literal["zero", "linear"]
Start = Literal["zero", "consistent"]


class Response(NamedTuple):
    """Motion of an expanded system at the start of each step, as records of a rig have it."""

    time: NDArray[np.float64]
    """``(n,)`` [s]."""
    displacement: NDArray[np.float64]
    """Structure ``(n, n_freedoms)`` [m, rad]."""
    velocity: NDArray[np.float64]
    """Structure ``(n, n_freedoms)`` [m/s, rad/s]; of "nastran" by central differences."""
    relative: NDArray[np.float64]
    """Relative states x_p of the joint ``(n, n1)`` [m, rad]."""
    force: NDArray[np.float64]
    """Restoring forces S3 ``(n, n1)`` [N, N m]."""


def integrate(
    system: ExpandedSystem,
    controls: ArrayLike,
    *,
    timestep: float | None = None,
    method: Method = "consistent",
    hold: Hold = "zero",
    start: Start = "zero",
    averaged: bool = True,
    initial: Mapping[str, tuple[float, float]] | None = None,
) -> Response:
    """Integrate an expanded system.

    Args:
        system: The system; method "nastran" needs the form "deck".
        controls: Commands at the steps ``(n, n_actuators)``, in the order of `system.actuators`.
        timestep: Step h [s]; the rig's by default.
        method: See the module.
        hold: Commands between samples of method "consistent"; "nastran" averages three samples.
        start: Virtual points of method "nastran" at the start: "zero" (as a deck without TIC cards) or "consistent".
        averaged: Whether method "nastran" averages the nonlinear loads over three steps (DIAG 10).
        initial: (position, velocity) by joint at the start; at rest where not given.

    Returns:
        The motion at the start of each of the n steps.

    Raises:
        UnknownNameError: Unknown method, hold, start or joint.
        ParameterError: The commands do not fit, or the form does not fit the method.
        SimulationError: The integration diverged.
    """
    for kind, value, known in (("method", method, Method), ("hold", hold, Hold), ("start", start, Start)):
        if value not in get_args(known):
            raise UnknownNameError(f"{kind} of integration", value, get_args(known))
    commands = controls_matrix(system, np.asarray(controls, dtype=float))
    h = system.timestep if timestep is None else float(timestep)
    if not h > 0.0:
        raise ParameterError(f"timestep is {h} s; a positive number is expected")
    x0, v0 = _initial(system, initial or {})
    if method == "nastran":
        if system.form != "deck":
            raise ParameterError(
                "method 'nastran' needs the deck's equations; assemble the system with form='deck'"
            )
        x, v, force = _nastran(
            system, commands, h, x0, v0, consistent=start == "consistent", averaged=averaged
        )
    else:
        x, v, force = _consistent(system, commands, h, x0, v0, linear=hold == "linear")
    finite = np.isfinite(x).all(axis=1) & np.isfinite(force).all(axis=1)
    if not finite.all():
        last = max(int(np.argmin(finite)) - 1, 0)
        raise SimulationError(
            f"the {method} integration diverged after t = {last * h:.6g} s with a step of {h:g} s; try a smaller step",
            time=last * h,
        )
    time = h * np.arange(len(x), dtype=np.float64)
    return Response(time, x, v, x @ system.relation.T, force)


def _initial(system: ExpandedSystem, initial: Mapping[str, tuple[float, float]]) -> tuple[NDArray, NDArray]:
    x, v = np.zeros(len(system.freedoms)), np.zeros(len(system.freedoms))
    for name, (position, velocity) in initial.items():
        if name not in system.freedoms:
            raise UnknownNameError("joint of the expanded system", name, system.freedoms)
        x[system.freedoms.index(name)], v[system.freedoms.index(name)] = position, velocity
    return x, v


def _consistent(
    system: ExpandedSystem, commands: NDArray, h: float, x0: NDArray, v0: NDArray, *, linear: bool
) -> tuple[NDArray, NDArray, NDArray]:
    x, p, s1, s2, s3 = system.parts
    inner = slice(p.start, s1.stop)
    k_matrix, c_matrix = system.stiffness, system.damping
    mass_inverse = np.linalg.inv(system.mass[x, x])
    printed = system.form == "printed"
    if printed:
        # rows of (x_p, S1): C_bb b' = f - K_bx x - C_bx x' - K_bb b
        solve = np.linalg.inv(c_matrix[inner, inner])
        start = np.concatenate([system.relation @ x0, np.zeros(system.weights.b1.size)])
        on_x, on_v = solve @ k_matrix[inner, x], solve @ c_matrix[inner, x]
        on_b, constant = solve @ k_matrix[inner, inner], solve @ system.constant[inner]
    else:
        # static condensation: x_p = -K_pp^-1 K_px x and its rate, then S1 = K_ss^-1 (b1 - K_sp x_p - C_sp x_p')
        tie = -np.linalg.solve(k_matrix[p, p], k_matrix[p, x])
        solve = np.linalg.inv(k_matrix[s1, s1])
        start = np.zeros(0)
        on_x, on_v = solve @ k_matrix[s1, p] @ tie, solve @ c_matrix[s1, p] @ tie
        on_b, constant = np.zeros((0, 0)), solve @ system.constant[s1]
    hidden = np.linalg.solve(k_matrix[s3, s3], k_matrix[s3, s2]) @ np.linalg.inv(k_matrix[s2, s2])
    bias = np.linalg.solve(k_matrix[s3, s3], system.constant[s3])
    return _runge_kutta(
        printed,
        p.stop - p.start,
        np.ascontiguousarray(on_x),
        np.ascontiguousarray(on_v),
        np.ascontiguousarray(on_b),
        constant,
        np.ascontiguousarray(-hidden),
        bias,
        np.ascontiguousarray(mass_inverse @ system.relation.T),
        np.ascontiguousarray(mass_inverse @ k_matrix[x, x]),
        np.ascontiguousarray(mass_inverse @ c_matrix[x, x]),
        np.ascontiguousarray(commands @ (mass_inverse @ system.inputs[x]).T),
        h,
        np.concatenate([x0, v0, start]),
        linear,
    )


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _rate(printed, k, on_x, on_v, on_b, constant, hidden, bias, joint, stiff, damp, load, y, rate, force):
    """Write dy/dt for y = (x, v, b) and the restoring forces; b = (x_p, S1) in the printed form, else empty."""
    n = joint.shape[0]
    x, v, b = y[:n], y[n : 2 * n], y[2 * n :]
    virtual = constant - on_x @ x - on_v @ v
    if printed:
        virtual = virtual - on_b @ b
        rate[2 * n :] = virtual
        argument = b[k:] + virtual[k:]
    else:
        argument = virtual
    force[:] = hidden @ np.tanh(argument) + bias
    rate[:n] = v
    rate[n : 2 * n] = load - stiff @ x - damp @ v - joint @ force


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _runge_kutta(
    printed, k, on_x, on_v, on_b, constant, hidden, bias, joint, stiff, damp, loads, h, y, linear
):
    steps, n = loads.shape
    xs, vs, forces = np.empty((steps, n)), np.empty((steps, n)), np.empty((steps, k))
    slopes = np.empty((4, len(y)))
    force = np.empty(k)
    for i in range(steps):
        xs[i], vs[i] = y[:n], y[n : 2 * n]
        following = loads[min(i + 1, steps - 1)] if linear else loads[i]
        for stage in range(4):
            fraction = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
            at = y + fraction * h * slopes[stage - 1] if stage > 0 else y.copy()
            load = loads[i] + fraction * (following - loads[i])
            _rate(
                printed,
                k,
                on_x,
                on_v,
                on_b,
                constant,
                hidden,
                bias,
                joint,
                stiff,
                damp,
                load,
                at,
                slopes[stage],
                force,
            )
            if stage == 0:
                forces[i] = force
        y = y + h / 6.0 * (slopes[0] + 2.0 * (slopes[1] + slopes[2]) + slopes[3])
    return xs, vs, forces


def _nastran(
    system: ExpandedSystem,
    commands: NDArray,
    h: float,
    x0: NDArray,
    v0: NDArray,
    *,
    consistent: bool,
    averaged: bool,
) -> tuple[NDArray, NDArray, NDArray]:
    x, p, s1, s2, s3 = system.parts
    mass, damping, stiffness = system.mass / h**2, system.damping / (2.0 * h), system.stiffness / 3.0
    inverse = np.linalg.inv(mass + damping + stiffness)
    u, rate = np.zeros(system.order), np.zeros(system.order)
    u[x], rate[x] = x0, v0
    u[p], rate[p] = system.relation @ x0, system.relation @ v0
    if consistent:
        u[s1] = system.constant[s1] - system.stiffness[s1, p] @ u[p] - system.damping[s1, p] @ rate[p]
        u[s2] = np.tanh(u[s1])
        u[s3] = system.constant[s3] - system.stiffness[s3, s2] @ u[s2]
    loads = commands @ system.inputs.T + system.constant
    # as the manuals have it, the first load is the one that holds the initial state, so that u'' starts from zero
    first = system.stiffness @ u + system.damping @ rate
    before = system.stiffness @ (u - h * rate) + system.damping @ rate
    loads = np.concatenate([before[None], first[None], loads[1:]])
    xs, forces = _three_point(
        np.ascontiguousarray(inverse),
        np.ascontiguousarray(inverse @ (2.0 * mass - stiffness)),
        np.ascontiguousarray(inverse @ (damping - mass - stiffness)),
        np.ascontiguousarray(loads),
        np.ascontiguousarray(system.relation.T),
        s1.start,
        s2.start,
        s3.start,
        u,
        u - h * rate,
        system.nonlinear_load(u, rate) if consistent else np.zeros(system.order),
        averaged,
    )
    padded = np.concatenate([(x0 - h * v0)[None], xs])
    velocity = np.empty_like(xs)
    velocity[:-1] = (padded[2:] - padded[:-2]) / (2.0 * h)
    velocity[-1] = (padded[-1] - padded[-2]) / h
    return xs, velocity, forces


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _three_point(inverse, on_now, on_before, loads, spread, s1, s2, s3, u, before, earlier, averaged):
    """`loads` begins one step before the start; returns the structure's displacements and S3.

    `earlier` holds the nonlinear loads before the start.
    """
    steps = loads.shape[0] - 1
    n, k = spread.shape
    xs, forces = np.empty((steps, n)), np.empty((steps, k))
    older, old, now = earlier.copy(), earlier.copy(), np.zeros_like(earlier)
    for i in range(steps):
        xs[i], forces[i] = u[:n], u[s3 : s3 + k]
        now[:n] = -(spread @ u[s3 : s3 + k])
        for j in range(s3 - s2):
            now[s2 + j] = np.tanh(u[s1 + j])
        load = (loads[i] + loads[i + 1] + loads[min(i + 2, steps)]) / 3.0
        load += (now + old + older) / 3.0 if averaged else now
        u, before = inverse @ load + on_now @ u + on_before @ before, u
        older, old, now = old, now, older
    return xs, forces
