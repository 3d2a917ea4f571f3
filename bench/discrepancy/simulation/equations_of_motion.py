"""The right-hand side of structures with force laws, compiled: accelerations, and the friction forces that hold or creep.

The functions become part of the loops that call them (`simulation.stick_slip`, `simulation.prescribed_response`), the small ones inlined,
the right-hand side once: a copy of it for each stage of each step makes a loop take longer to compile and no less to run.
Numba keeps the machine code of a loop by the file that the loop stands in: after a change here, remove what is kept of those two.

Friction that creeps, as MuJoCo's does, is ``f = limit sat((v + tau a) / vc)``, saturated at one either way, with a
creep velocity vc and a lead time tau (`bench.laws.soft_friction`). The acceleration holds the force itself, so that with a0, the
acceleration without it, and the compliance A of its coordinate ``f = (v + tau a0) / (vc / limit + tau A)`` until it saturates.

References:
    E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 1993 (RK4, section II.1).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba

from bench.laws.calling import advance, call_kernel, load_int

FORCE, RATE, LIMIT, N_ROWS, ROW, THETA, STATE, N_STATES, SCALE = range(9)
"""Columns of the element table passed to the compiled loop."""

COLUMNS = 9
"""Their number."""

_jit = numba.njit(cache=True, error_model="numpy", nogil=True)
_inline = numba.njit(cache=True, error_model="numpy", nogil=True, forceinline=True)


class StickSlipLimits(NamedTuple):
    """Numbers that the compiled code holds; numba compiles a function anew for each number that stands in its arguments, for these once."""

    max_events: int = 12
    """Most friction events resolved within one step; beyond it the step is completed with the mode it has."""
    diverged: float = 1e12
    """Position beyond which a simulation counts as diverged."""
    max_rows: int = 16
    """Most coordinates of an element; `grips` further scratch entries hold what a friction limit writes."""
    grips: int = 3
    """A friction limit, its creep velocity and its lead time, see `friction_limits`."""
    state: int = 0
    """Offset of the state in the workspace."""
    unknown: bool = False
    """That the first slope of a step is not there yet."""
    soft: float = 2.0
    """Mode of friction that creeps rather than sticks; it has no events."""
    sweeps: int = 12
    """Gauss-Seidel sweeps over several friction forces that creep at once; one alone is solved exactly by the first."""


STICK_SLIP_LIMITS = StickSlipLimits()


class Workspace(NamedTuple):
    """What the compiled functions share: sizes, matrices, element table, and one workspace with its address.

    The workspace holds, one after the other: the state, a trial state, a stage state, four slopes, the coordinates,
    velocities and forces of the element at hand, and the loads at the start, middle and end of a step. One array
    with integer offsets instead of many small ones: creating array views and their pointers inside the
    derivative took two thirds of the time.
    """

    n_dof: int
    n: int
    n_inputs: int
    n_elements: int
    n_rows: int
    load_factor: int
    matrices: Any
    table: int
    rows: Any
    spread: Any
    mode: Any
    grip: Any
    theta: Any
    work: Any


@_inline
def entry(p, e, column):
    """Integer of the element table."""
    return load_int(p.table + 8 * (COLUMNS * e + column))


@_inline
def scale_at(schedule, t):
    """Factor of a force at a time: (time of the first sample, samples a second, their number, samples), linear between them."""
    x = (t - schedule[0]) * schedule[1]
    n = int(schedule[2])
    whole = min(max(int(x), 0), n - 2)
    share = min(max(x - whole, 0.0), 1.0)
    return schedule[3 + whole] + share * (schedule[4 + whole] - schedule[3 + whole])


@_jit
def derivative(p, t, y, slope, load):  # noqa: PLR0912, PLR0915  (one compiled loop)
    """Write dy/dt at workspace offset `slope` for the state at offset `y` and the loads at offset `load`.

    The holding force and the limit of every friction element go into `grip` (2, n_elements).
    """
    n_dof = p.n_dof
    work = p.work
    n_inputs = p.n_inputs
    width = 2 * n_dof + n_inputs
    for i in range(n_dof):
        work[slope + i] = work[y + n_dof + i]
        total = 0.0
        for j in range(n_inputs):
            total += p.matrices[i * width + 2 * n_dof + j] * work[load + j]
        for j in range(n_dof):
            total -= (
                p.matrices[i * width + j] * work[y + j]
                + p.matrices[i * width + n_dof + j] * work[y + n_dof + j]
            )
        work[slope + n_dof + i] = total
    q = 7 * p.n
    v = q + STICK_SLIP_LIMITS.max_rows
    f = v + STICK_SLIP_LIMITS.max_rows
    held = False
    creeping = 0
    for e in range(p.n_elements):
        first = entry(p, e, ROW)
        n_rows = entry(p, e, N_ROWS)
        for r in range(n_rows):
            coordinate = 0.0
            rate = 0.0
            for j in range(n_dof):
                coordinate += p.rows[(first + r) * p.n_dof + j] * work[y + j]
                rate += p.rows[(first + r) * p.n_dof + j] * work[y + n_dof + j]
            work[q + r] = coordinate
            work[v + r] = rate
            work[f + r] = 0.0
        z = advance(p.work, (y + 2 * n_dof + entry(p, e, STATE)))
        theta = advance(p.theta, entry(p, e, THETA))
        q_pointer = advance(p.work, q)
        v_pointer = advance(p.work, v)
        if entry(p, e, FORCE) != 0:
            call_kernel(entry(p, e, FORCE), t, q_pointer, v_pointer, z, theta, advance(p.work, f))
        scale = 1.0
        if entry(p, e, SCALE) != 0:
            scale = scale_at(advance(p.theta, entry(p, e, SCALE) - 1), t)
            for r in range(n_rows):
                work[f + r] *= scale
        if entry(p, e, LIMIT) != 0:
            for i in range(STICK_SLIP_LIMITS.grips):
                work[f + STICK_SLIP_LIMITS.max_rows + i] = 0.0
            call_kernel(
                entry(p, e, LIMIT),
                t,
                q_pointer,
                v_pointer,
                z,
                theta,
                advance(p.work, (f + STICK_SLIP_LIMITS.max_rows)),
            )
            p.grip[p.n_elements + e] = max(scale * work[f + STICK_SLIP_LIMITS.max_rows], 0.0)
            if p.mode[e] == STICK_SLIP_LIMITS.soft:
                p.grip[2 * p.n_elements + e] = work[f + STICK_SLIP_LIMITS.max_rows + 1]
                p.grip[3 * p.n_elements + e] = work[f + STICK_SLIP_LIMITS.max_rows + 2]
                creeping += 1
            else:
                work[f] += p.mode[e] * p.grip[p.n_elements + e]
            held = held or p.mode[e] == 0.0
        for r in range(n_rows):
            for i in range(n_dof):
                work[slope + n_dof + i] -= p.spread[i * p.n_rows + first + r] * work[f + r]
        if entry(p, e, RATE) != 0:
            zdot = advance(p.work, (slope + 2 * n_dof + entry(p, e, STATE)))
            call_kernel(entry(p, e, RATE), t, q_pointer, v_pointer, z, theta, zdot)
    if creeping > 0:
        _creep(p, y, slope, STICK_SLIP_LIMITS.sweeps if creeping > 1 else 1)
    if held:
        _hold(p, slope)


@_inline
def _creep(p, y, slope, sweeps):
    """Add the forces of the elements that creep: each the one that goes with the acceleration that it leaves."""
    for e in range(p.n_elements):
        p.grip[e] = p.grip[e] if p.mode[e] != STICK_SLIP_LIMITS.soft else 0.0
    for _ in range(sweeps):
        for e in range(p.n_elements):
            if entry(p, e, LIMIT) == 0 or p.mode[e] != STICK_SLIP_LIMITS.soft:
                continue
            row = entry(p, e, ROW)
            relative = 0.0
            rate = 0.0
            compliance = 0.0
            for i in range(p.n_dof):
                share = p.rows[row * p.n_dof + i]
                relative += share * p.work[slope + p.n_dof + i]
                rate += share * p.work[y + p.n_dof + i]
                compliance += share * p.spread[i * p.n_rows + row]
            limit = p.grip[p.n_elements + e]
            lead = p.grip[3 * p.n_elements + e]
            relative += compliance * p.grip[e]
            wanted = 0.0
            if limit > 0.0:
                wanted = (rate + lead * relative) / (p.grip[2 * p.n_elements + e] / limit + lead * compliance)
            wanted = min(max(wanted, -limit), limit)
            for i in range(p.n_dof):
                p.work[slope + p.n_dof + i] -= p.spread[i * p.n_rows + row] * (wanted - p.grip[e])
            p.grip[e] = wanted


@_inline
def _hold(p, slope):
    """Add the forces of the sticking elements, which make their relative acceleration zero."""
    for e in range(p.n_elements):
        if entry(p, e, LIMIT) != 0 and p.mode[e] == 0.0:
            row = entry(p, e, ROW)
            relative = 0.0
            compliance = 0.0
            for i in range(p.n_dof):
                relative += p.rows[row * p.n_dof + i] * p.work[slope + p.n_dof + i]
                compliance += p.rows[row * p.n_dof + i] * p.spread[i * p.n_rows + row]
            p.grip[e] = relative / compliance
            for i in range(p.n_dof):
                p.work[slope + p.n_dof + i] -= p.spread[i * p.n_rows + row] * p.grip[e]


@_inline
def rk4(p, t, dt, known):
    """One classical Runge-Kutta step from the state into the trial state; `known`: the first slope is there already."""
    n = p.n
    work = p.work
    load = 7 * n + 3 * STICK_SLIP_LIMITS.max_rows + STICK_SLIP_LIMITS.grips
    n_inputs = p.n_inputs
    if not known:
        derivative(p, t, STICK_SLIP_LIMITS.state, 3 * n, load)
    for i in range(n):
        work[2 * n + i] = work[i] + 0.5 * dt * work[3 * n + i]
    derivative(p, t + 0.5 * dt, 2 * n, 4 * n, load + n_inputs)
    for i in range(n):
        work[2 * n + i] = work[i] + 0.5 * dt * work[4 * n + i]
    derivative(p, t + 0.5 * dt, 2 * n, 5 * n, load + n_inputs)
    for i in range(n):
        work[2 * n + i] = work[i] + dt * work[5 * n + i]
    derivative(p, t + dt, 2 * n, 6 * n, load + 2 * n_inputs)
    for i in range(n):
        work[n + i] = work[i] + dt / 6.0 * (
            work[3 * n + i] + 2.0 * (work[4 * n + i] + work[5 * n + i]) + work[6 * n + i]
        )


@_inline
def relative_velocity(p, y, row):
    """Rate of a coordinate for the state at offset `y`."""
    total = 0.0
    for j in range(p.n_dof):
        total += p.rows[row * p.n_dof + j] * p.work[y + p.n_dof + j]
    return total
