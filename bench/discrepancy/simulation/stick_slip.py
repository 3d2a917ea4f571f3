"""The fast simulator of the fits: linear structures with force laws, and friction that is truly set-valued.

A diagnosis asks for thousands of free runs. They are made here, by one compiled loop over the same law kernels that
the MuJoCo callback calls; the test suite holds the two equal. Two things differ from a general simulator and make it fast:
the structure is linear with a constant mass matrix, and its loads are known samples: piecewise linear between them, held,
or given on a finer grid by whoever knows better (`bench.discrepancy.case.acquisition`).

Dry friction is no smoothed sign function here. A friction element carries a mode: sliding (+1, -1) or sticking (0).
While it slides the force is ``mode * limit(t, q, v)``; while it sticks the force is whatever keeps the relative
acceleration zero; the instants of reversal and of breaking loose are found inside the step by the secant rule. The
fits therefore see a response that depends smoothly on the parameters as long as the order of events stays the same.

Friction that creeps rather than sticks, as MuJoCo's does, has a third mode and no events (`simulation.equations_of_motion`).

References:
    E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 1993 (event location on
    discontinuities, section II.6).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.simulation.equations_of_motion import (
    COLUMNS,
    LIMIT,
    ROW,
    STICK_SLIP_LIMITS,
    THETA,
    Workspace,
    derivative,
    entry,
    relative_velocity,
    rk4,
)
from bench.laws.calling import advance, call_kernel, pointer_at

_jit = numba.njit(cache=True, error_model="numpy", nogil=True)
_inline = numba.njit(cache=True, error_model="numpy", nogil=True, forceinline=True)


class StructureMatrices(NamedTuple):
    """Matrices of ``M q'' + C q' + K q = B u - (forces of the elements)``.

    Attributes:
        mass: (n_dof, n_dof) [kg or kg m^2].
        damping: (n_dof, n_dof).
        stiffness: (n_dof, n_dof).
        inputs: (n_dof, n_inputs), how the loads act.
    """

    mass: NDArray[np.float64]
    damping: NDArray[np.float64]
    stiffness: NDArray[np.float64]
    inputs: NDArray[np.float64]


class Elements(NamedTuple):
    """The force laws of one simulation, flattened for the compiled loop.

    Attributes:
        table: (n_elements, 8 or 9) integers: addresses of the force, rate and limit kernels (0: none), number of
            coordinates, first row in `rows`, first entry in `theta`, first hidden state, number of hidden states; and, where there is
            a ninth, one more than the entry in `theta` where the schedule of the force begins (0: none, see `scale_at`).
        rows: (n_rows, n_dof); row times q is a coordinate of an element.
        theta: (n_theta,) parameters of all elements one after the other.
        start: (n_states,) initial hidden states.
    """

    table: NDArray[np.int64]
    rows: NDArray[np.float64]
    theta: NDArray[np.float64]
    start: NDArray[np.float64]


class Motion(NamedTuple):
    """Motion on a uniform clock.

    Attributes:
        position: (n, n_dof).
        velocity: (n, n_dof).
        acceleration: (n, n_dof).
    """

    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    acceleration: NDArray[np.float64]


NO_ELEMENTS = Elements(np.zeros((0, 8), dtype=np.int64), np.zeros((0, 1)), np.zeros(1), np.zeros(0))
"""No force law: the linear structure alone."""


@_jit
def _settle(p, e, t, load):
    """Bring friction element `e` to relative rest and choose its mode: hold, or slide the way it is pushed."""
    row = entry(p, e, ROW)
    velocity = relative_velocity(p, STICK_SLIP_LIMITS.state, row)
    compliance = 0.0
    for i in range(p.n_dof):
        compliance += p.rows[row * p.n_dof + i] * p.spread[i * p.n_rows + row]
    for i in range(p.n_dof):
        p.work[p.n_dof + i] -= p.spread[i * p.n_rows + row] * velocity / compliance
    p.mode[e] = 0.0
    derivative(p, t, STICK_SLIP_LIMITS.state, 3 * p.n, load)
    if abs(p.grip[e]) > p.grip[p.n_elements + e]:
        p.mode[e] = 1.0 if p.grip[e] > 0.0 else -1.0


@_jit
def _creeps(p, e, t):
    """Whether friction element `e` creeps rather than sticks; that does not change with the motion."""
    limit = 7 * p.n + 3 * STICK_SLIP_LIMITS.max_rows
    for i in range(limit, limit + STICK_SLIP_LIMITS.grips):
        p.work[i] = 0.0
    first = 7 * p.n
    call_kernel(
        entry(p, e, LIMIT), t, advance(p.work, first), advance(p.work, first), advance(p.work, first),
        advance(p.theta, entry(p, e, THETA)), advance(p.work, limit),
    )  # fmt: skip
    return p.work[limit + 1] > 0.0 or p.work[limit + 2] > 0.0


@_inline
def _fill_loads(p, u, k, fraction, share):
    """Loads at the start, middle and end of a step that begins at `fraction` of sample `k` and is `share` of it long."""
    load = 7 * p.n + 3 * STICK_SLIP_LIMITS.max_rows + STICK_SLIP_LIMITS.grips
    n_inputs = u.shape[1]
    for i in range(3):
        at = (fraction + 0.5 * i * share) * p.load_factor
        # the instant of an event in a run that diverges is no number, and must not become an address
        whole = max(min(int(at), p.load_factor - 1), 0)
        first = k * max(p.load_factor, 1) + whole
        for j in range(n_inputs):
            low = u[first, j]
            if p.load_factor > 0:
                low += (u[first + 1, j] - low) * (at - whole)
            p.work[load + i * n_inputs + j] = low


@_jit
def _first_event(p, t, dt, rest):
    """Element whose mode ends first within the trial step of length `rest`, and the share of it until then."""
    event = -1
    first = rest
    load = 7 * p.n + 3 * STICK_SLIP_LIMITS.max_rows + STICK_SLIP_LIMITS.grips
    for e in range(p.n_elements):
        if entry(p, e, LIMIT) == 0 or p.mode[e] == STICK_SLIP_LIMITS.soft:
            continue
        if p.mode[e] == 0.0:
            # grip holds the values of the last stage, that is of the end of the step, until it is asked for the start
            excess = abs(p.grip[e]) - p.grip[p.n_elements + e]
            if excess <= 0.0:
                continue
            derivative(p, t, STICK_SLIP_LIMITS.state, 3 * p.n, load)
            before = min(abs(p.grip[e]) - p.grip[p.n_elements + e], 0.0)
            derivative(p, t + dt, p.n, 3 * p.n, load + 2 * p.n_inputs)
            crossing = rest * before / (before - excess)
        else:
            end = p.mode[e] * relative_velocity(p, p.n, entry(p, e, ROW))
            if end >= 0.0:
                continue
            before = max(p.mode[e] * relative_velocity(p, STICK_SLIP_LIMITS.state, entry(p, e, ROW)), 0.0)
            crossing = rest * before / (before - end)
        if crossing < first or event < 0:
            event = e
            first = crossing
    return event, first


@_jit
def _pass_event(p, u, k, t, dt, event, fraction, first, rest):
    """Step to the event, refine its instant once, and change the mode; return the share of the sample used."""
    sliding = p.mode[event] != 0.0
    row = entry(p, event, ROW)
    for _ in range(2 if sliding else 1):
        _fill_loads(p, u, k, fraction, first)
        rk4(p, t, first * dt, STICK_SLIP_LIMITS.unknown)
        if not sliding:
            break
        before = p.mode[event] * relative_velocity(p, STICK_SLIP_LIMITS.state, row)
        end = p.mode[event] * relative_velocity(p, p.n, row)
        if not (before > end and abs(end) > 1e-9 * before):
            break
        first = min(max(first * before / (before - end), 0.0), rest)
    for i in range(p.n):
        p.work[i] = p.work[p.n + i]
    if sliding:
        _settle(
            p,
            event,
            t + first * dt,
            7 * p.n + 3 * STICK_SLIP_LIMITS.max_rows + STICK_SLIP_LIMITS.grips + 2 * u.shape[1],
        )
    else:
        p.mode[event] = 1.0 if p.grip[event] > 0.0 else -1.0
    return first


@_jit
def _free_run(clock, u, start, scratch, n_dof, matrices, table, rows, spread, theta, out):  # noqa: PLR0912  (one compiled loop)
    """Integrate over all samples from `start`; write position, velocity, acceleration to `out`.

    `clock` is the time between samples, the time of the first, the steps of every sample and the rows of `u` a sample (zero: held).

    `scratch` belongs to the caller: memory reached only through pointers would be freed here after its last mention.
    """
    dt, t0, substeps, load_factor = clock
    n = start.shape[0]
    n_elements = table.shape[0]
    work = scratch[5 * n_elements :]
    mode = scratch[:n_elements]
    position, velocity, acceleration = out
    base = pointer_at(scratch.ctypes.data)
    p = Workspace(
        n_dof, n, u.shape[1], n_elements, rows.shape[0], load_factor, pointer_at(matrices.ctypes.data), table.ctypes.data,
        pointer_at(rows.ctypes.data), pointer_at(spread.ctypes.data), base, advance(base, n_elements),
        pointer_at(theta.ctypes.data), advance(base, 5 * n_elements),
    )  # fmt: skip
    for i in range(n):
        work[i] = start[i]
    load = 7 * n + 3 * STICK_SLIP_LIMITS.max_rows + STICK_SLIP_LIMITS.grips
    frictional = False
    for j in range(u.shape[1]):
        work[load + j] = u[0, j]
    for e in range(n_elements):
        if entry(p, e, LIMIT) != 0 and _creeps(p, e, t0):
            mode[e] = STICK_SLIP_LIMITS.soft
        elif entry(p, e, LIMIT) != 0:
            frictional = True
            rate = relative_velocity(p, STICK_SLIP_LIMITS.state, entry(p, e, ROW))
            if rate != 0.0:
                mode[e] = 1.0 if rate > 0.0 else -1.0
            else:
                _settle(p, e, t0, load)
    n_samples = position.shape[0]
    for k in range(n_samples):
        t = t0 + k * dt
        share = 1.0 / substeps[k]
        for j in range(u.shape[1]):
            work[load + j] = u[k * max(load_factor, 1), j]
        derivative(p, t, STICK_SLIP_LIMITS.state, 3 * n, load)
        for i in range(n_dof):
            position[k, i] = work[i]
            velocity[k, i] = work[n_dof + i]
            acceleration[k, i] = work[3 * n + n_dof + i]
        if not abs(work[0]) < STICK_SLIP_LIMITS.diverged:
            for later in range(k, n_samples):
                for i in range(n_dof):
                    position[later, i] = np.nan
            return
        if k == n_samples - 1:
            return
        for s in range(substeps[k]):
            fraction = s * share
            rest = share
            events = 0
            while True:
                _fill_loads(p, u, k, fraction, rest)
                rk4(p, t + fraction * dt, rest * dt, s == 0 and events == 0)
                event = -1
                first = rest
                if frictional and events < STICK_SLIP_LIMITS.max_events:
                    event, first = _first_event(p, t + fraction * dt, rest * dt, rest)
                if event < 0:
                    for i in range(n):
                        work[i] = work[n + i]
                    break
                events += 1
                used = _pass_event(p, u, k, t + fraction * dt, dt, event, fraction, first, rest)
                fraction += used
                rest -= used


def full(table: NDArray[np.int64]) -> NDArray[np.int64]:
    """An element table with all its columns."""
    missing = COLUMNS - table.shape[1]
    return plain(np.pad(table, ((0, 0), (0, missing))) if missing else table)


def plain(values: NDArray[Any]) -> NDArray[Any]:
    """The same array, contiguous and writable: numba compiles a loop once for each kind of array that comes."""
    return np.require(values, requirements=("C", "W"))


def steps_of_each(substeps: int | NDArray[np.int64], n: int) -> NDArray[np.int64]:
    """Steps of every sample (n,), where one number may stand for all."""
    return plain(np.broadcast_to(np.asarray(substeps, dtype=np.int64), n))


def free_run(
    structure: StructureMatrices,
    elements: Elements,
    *,
    loads: NDArray[np.float64],
    step: float,
    substeps: int | NDArray[np.int64] = 1,
    load_factor: int = 1,
    start: NDArray[np.float64] | None = None,
    start_time: float = 0.0,
) -> Motion:
    """Simulate the structure with its elements under sampled loads.

    Args:
        structure: Mass, damping, stiffness and input matrices.
        elements: Force laws.
        loads: ((n - 1) load_factor + 1, n_inputs) [N or N m], piecewise linear between its rows.
        step: Time between samples [s].
        substeps: Runge-Kutta steps a sample, or (n,) of each.
        load_factor: Rows of `loads` a sample; 0: one row a sample, held until the next.
        start: Positions and velocities at the first sample (2 n_dof,); at rest where None.
        start_time: Time of the first sample [s].

    Returns:
        The motion at every sample; positions are NaN from where it diverged.
    """
    n_dof = structure.mass.shape[0]
    inverse = np.linalg.inv(structure.mass)
    matrices = np.ascontiguousarray(
        np.hstack([inverse @ structure.stiffness, inverse @ structure.damping, inverse @ structure.inputs])
    )
    rows = plain(elements.rows if elements.rows.size else np.zeros((0, n_dof)))
    y = np.zeros(2 * n_dof + len(elements.start))
    if start is not None:
        y[: 2 * n_dof] = start
    y[2 * n_dof :] = elements.start
    n, n_inputs = (len(loads) - 1) // max(load_factor, 1) + 1, loads.shape[1]
    scratch = np.zeros(
        5 * len(elements.table)
        + 7 * len(y)
        + 3 * STICK_SLIP_LIMITS.max_rows
        + STICK_SLIP_LIMITS.grips
        + 3 * n_inputs
    )
    motion = Motion(np.zeros((n, n_dof)), np.zeros((n, n_dof)), np.zeros((n, n_dof)))
    _free_run(
        (step, start_time, steps_of_each(substeps, n), load_factor), plain(loads), y, scratch, n_dof, matrices,
        full(elements.table), rows,
        np.ascontiguousarray(inverse @ rows.T), plain(elements.theta), tuple(motion),
    )  # fmt: skip
    return motion
