"""Time stepping with impulses: the truth of sealed cases with dry friction or impacts.

Moreau's scheme: the midpoint rule for what is smooth, and impulses for friction and stops, chosen at the end of each
step so that the law of dry friction (Coulomb's set-valued sign, with a limit that may depend on state and time) or of
impact (Newton's restitution) holds exactly there. No event is looked for; an event costs one step of accuracy, which
is why steps are short (`substeps` a sample).

This is a second integrator on purpose. The fits have one of their own (`bench.discrepancy.simulation.stick_slip`: Runge-Kutta between
events that are located); a case made with that would forgive its mistakes. Smooth laws go through MuJoCo instead, see
`bench.discrepancy.truth.ground_truth`; the tests hold all three equal.

References:
    J. J. Moreau, Unilateral contact and dry friction in finite freedom dynamics, CISM 302 (1988).
    V. Acary, B. Brogliato, Numerical Methods for Nonsmooth Dynamical Systems, Springer 2008, ch. 10.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from bench.laws.base import ForceLaw, Kernel
from bench.laws.calling import advance, call_kernel, pointer_at

Array = NDArray[np.float64]


FORCE, RATE, LIMIT, N_ROWS, ROW, THETA, STATE, N_STATES = range(8)


@dataclass(frozen=True)
class MoreauTimeSteppingSettings:
    """Numbers of `bench.discrepancy.truth.moreau_time_stepping`."""

    substeps: int = 200
    """Steps a sample: at 500 Hz 10 µs, which leaves errors of 1e-4 of the motion after hundreds of reversals (tested)."""
    max_rows: int = 16


SETTINGS = MoreauTimeSteppingSettings()


class MoreauTimeSteppingLimits(NamedTuple):
    """Numbers of `bench.discrepancy.truth.moreau_time_stepping` that compiled code holds."""

    diverged: float = 1e12


MOREAU_TIME_STEPPING_LIMITS = MoreauTimeSteppingLimits()
_jit = numba.njit(cache=True, error_model="numpy", nogil=True)


class Matrices(NamedTuple):
    """``M q'' + C q' + K q = B u - forces``: (n_dof, n_dof) each, inputs (n_dof, n_loads)."""

    mass: Array
    damping: Array
    stiffness: Array
    inputs: Array


@dataclass(frozen=True)
class Acting:
    """A force law on coordinates of the structure.

    Attributes:
        law: The law; None where a limit alone is given.
        theta: Its parameters (n_theta,).
        rows: (n_coordinates, n_dof); a row times q is a coordinate.
        limit: Limit of set-valued friction, which then replaces the force of the law.
    """

    law: ForceLaw
    theta: Array
    rows: Array
    limit: Kernel | None = None


class Stop(NamedTuple):
    """A rigid stop on one side of a coordinate.

    Attributes:
        row: (n_dof,).
        position: Where it stands.
        side: +1: motion beyond `position` is barred; -1: below it.
        restitution: Velocity after over velocity before an impact.
    """

    row: Array
    position: float
    side: float
    restitution: float


class TrueMotion(NamedTuple):
    """Motion at the samples: position, velocity, acceleration (n, n_dof)."""

    position: Array
    velocity: Array
    acceleration: Array


@_jit
def _stage(at, q, v, z, elements, work, out, zdot):
    """Add the elements' generalised forces at a state into `out` (n_dof,); write friction limits and hidden rates."""
    table, rows, theta = elements
    coordinates, limits = work
    n_dof = q.shape[0]
    wq = pointer_at(coordinates[0].ctypes.data)
    wv = pointer_at(coordinates[1].ctypes.data)
    wf = pointer_at(coordinates[2].ctypes.data)
    theta_at = pointer_at(theta.ctypes.data)
    z_at = pointer_at(z.ctypes.data)
    zdot_at = pointer_at(zdot.ctypes.data)
    for e in range(table.shape[0]):
        first = table[e, ROW]
        for r in range(table[e, N_ROWS]):
            coordinates[0, r] = 0.0
            coordinates[1, r] = 0.0
            coordinates[2, r] = 0.0
            for j in range(n_dof):
                coordinates[0, r] += rows[first + r, j] * q[j]
                coordinates[1, r] += rows[first + r, j] * v[j]
        own_theta = advance(theta_at, table[e, THETA])
        own_z = advance(z_at, table[e, STATE])
        if table[e, FORCE] != 0:
            call_kernel(table[e, FORCE], at, wq, wv, own_z, own_theta, wf)
            for r in range(table[e, N_ROWS]):
                for j in range(n_dof):
                    out[j] += rows[first + r, j] * coordinates[2, r]
        if table[e, LIMIT] != 0:
            coordinates[2, 0] = 0.0
            call_kernel(table[e, LIMIT], at, wq, wv, own_z, own_theta, wf)
            limits[e] = max(coordinates[2, 0], 0.0)
        if table[e, RATE] != 0:
            call_kernel(table[e, RATE], at, wq, wv, own_z, own_theta, advance(zdot_at, table[e, STATE]))


@_jit
def _resist(velocity, elements, limits, stop, beyond, spread, before, reaction):
    """Apply the impulses of friction and of the stop to the velocity after a step."""
    table, rows, _ = elements
    n_dof = velocity.shape[0]
    row_stop, stop_values = stop
    for e in range(table.shape[0]):
        if table[e, LIMIT] == 0:
            continue
        first = table[e, ROW]
        relative = 0.0
        give = 0.0
        for j in range(n_dof):
            relative += rows[first, j] * velocity[j]
            give += rows[first, j] * spread[j, first]
        impulse = min(max(relative / give, -limits[e]), limits[e])
        reaction[e] = impulse / limits[e] if limits[e] > 0.0 else 0.0
        for j in range(n_dof):
            velocity[j] -= spread[j, first] * impulse
    if beyond:
        last = spread.shape[1] - 1
        after = 0.0
        came = 0.0
        give = 0.0
        for j in range(n_dof):
            after += row_stop[j] * velocity[j]
            came += row_stop[j] * before[j]
            give += row_stop[j] * spread[j, last]
        excess = stop_values[1] * (after + stop_values[2] * max(stop_values[1] * came, 0.0) * stop_values[1])
        if excess > 0.0:
            for j in range(n_dof):
                velocity[j] -= spread[j, last] * stop_values[1] * excess / give


@_jit
def _accelerate(at, q, v, load, z, system, elements, work, scratch, reaction):
    """Acceleration (n_dof,) at a sample, friction of the mode the last step ended in, holding forces where it sticks."""
    inverse, damping, stiffness, inputs = system
    table, rows, theta = elements
    force, zdot = scratch
    n_dof = q.shape[0]
    force[:] = 0.0
    _stage(at, q, v, z, (table, rows, theta), work, force, zdot)
    total = inputs @ load - damping @ v - stiffness @ q - force
    for e in range(table.shape[0]):
        if table[e, LIMIT] == 0:
            continue
        row = rows[table[e, ROW]]
        mobile = inverse @ row
        if abs(reaction[e]) >= 1.0:
            held = reaction[e] * work[1][e]
        else:
            relative = 0.0
            give = 0.0
            free = inverse @ total
            for j in range(n_dof):
                relative += row[j] * free[j]
                give += row[j] * mobile[j]
            held = min(max(relative / give, -work[1][e]), work[1][e])
        total = total - row * held
    return inverse @ total


@_jit
def _march(clock, loads, system, elements, hidden, stop, work, out):  # noqa: PLR0912  (one compiled loop)
    """Step through all samples of `loads` (n, n_loads); write position, velocity and acceleration."""
    start, step, substeps = clock
    inverse, damping, stiffness, inputs, carry, spread = system
    table = elements[0]
    z, z_middle, zdot = hidden
    row_stop, stop_values = stop
    position, velocity, acceleration = out
    n_dof = inverse.shape[0]
    h = step / substeps
    q, v, before = np.zeros(n_dof), np.zeros(n_dof), np.zeros(n_dof)
    middle_q, middle_v, force = np.zeros(n_dof), np.zeros(n_dof), np.zeros(n_dof)
    reaction = np.zeros(table.shape[0])
    limits = work[1]
    for k in range(loads.shape[0]):
        at = start + k * step
        position[k] = q
        velocity[k] = v
        acceleration[k] = _accelerate(
            at,
            q,
            v,
            loads[k],
            z,
            (inverse, damping, stiffness, inputs),
            elements,
            work,
            (force, zdot),
            reaction,
        )
        if k == loads.shape[0] - 1 or not abs(q[0]) < MOREAU_TIME_STEPPING_LIMITS.diverged:
            position[k + 1 :] = np.nan
            return
        for s in range(substeps):
            share = (s + 0.5) / substeps
            for j in range(n_dof):
                middle_q[j] = q[j] + 0.5 * h * v[j]
                middle_v[j] = v[j] + 0.5 * (v[j] - before[j])
                force[j] = 0.0
            if table.shape[0] > 0:
                if z.shape[0] > 0:
                    _stage(at + s * h, q, v, z, elements, work, force, zdot)
                    for j in range(z.shape[0]):
                        z_middle[j] = z[j] + 0.5 * h * zdot[j]
                    force[:] = 0.0
                _stage(at + (s + 0.5) * h, middle_q, middle_v, z_middle, elements, work, force, zdot)
                for e in range(table.shape[0]):
                    limits[e] *= h
            reach = 0.0
            for i in range(n_dof):
                before[i] = v[i]
                reach += row_stop[i] * middle_q[i]
            for i in range(n_dof):
                total = 0.0
                for j in range(n_dof):
                    total += carry[0, i, j] * before[j] - carry[1, i, j] * q[j] - carry[2, i, j] * force[j]
                for j in range(loads.shape[1]):
                    total += carry[3, i, j] * ((1.0 - share) * loads[k, j] + share * loads[k + 1, j])
                v[i] = total
            beyond = stop_values[1] * (reach - stop_values[0]) > 0.0
            _resist(v, elements, limits, stop, beyond, spread, before, reaction)
            for j in range(n_dof):
                q[j] += 0.5 * h * (before[j] + v[j])
            for j in range(z.shape[0]):
                z[j] += h * zdot[j]


def march(
    matrices: Matrices,
    acting: Sequence[Acting],
    *,
    loads: Array,
    step: float,
    substeps: int = SETTINGS.substeps,
    stop: Stop | None = None,
) -> TrueMotion:
    """Simulate a structure from rest under sampled loads, straight lines between the samples.

    Args:
        matrices: The linear structure.
        acting: Laws and friction limits.
        loads: (n, n_loads).
        step: Time between samples [s].
        substeps: Steps a sample.
        stop: A rigid stop, or None.

    Returns:
        The motion at the samples; positions are NaN from where it diverged.
    """
    n_dof = len(matrices.mass)
    h = step / substeps
    table, theta, z = tabulate(acting)
    rows = np.vstack([a.rows for a in acting]) if acting else np.zeros((0, n_dof))
    implicit = 0.25 * h * h * matrices.stiffness + 0.5 * h * matrices.damping
    effective = np.linalg.inv(matrices.mass + implicit)
    carry = np.zeros((4, n_dof, max(n_dof, loads.shape[1])))
    for i, matrix in enumerate((matrices.mass - implicit, h * matrices.stiffness, h * np.eye(n_dof))):
        carry[i, :, :n_dof] = effective @ matrix
    carry[3, :, : loads.shape[1]] = h * effective @ matrices.inputs
    row_stop = np.zeros(n_dof) if stop is None else np.asarray(stop.row, dtype=float)
    values = np.zeros(3) if stop is None else np.array([stop.position, stop.side, stop.restitution])
    spread = np.ascontiguousarray(effective @ np.vstack([rows, row_stop[None]]).T)
    out = TrueMotion(*(np.zeros((len(loads), n_dof)) for _ in range(3)))
    system = tuple(
        np.ascontiguousarray(m) for m in (np.linalg.inv(matrices.mass), *matrices[1:], carry, spread)
    )
    _march(
        (0.0, step, substeps), np.ascontiguousarray(loads, dtype=float), system,
        (table, np.ascontiguousarray(rows), theta), (z, z.copy(), np.zeros(len(z))), (row_stop, values),
        (np.zeros((3, SETTINGS.max_rows)), np.zeros(max(len(table), 1))), tuple(out),
    )  # fmt: skip
    return out


def tabulate(acting: Sequence[Acting]) -> tuple[NDArray[np.int64], Array, Array]:
    """Addresses and offsets (n_elements, 8), all parameters one after the other, and initial hidden states."""
    table, theta, states = [], [], []
    row = offset = state = 0
    for a in acting:
        rate = a.law.rate.address if a.law.rate is not None else 0
        force = 0 if a.limit is not None else a.law.force.address
        limit = a.limit.address if a.limit is not None else 0
        table.append([force, rate, limit, len(a.rows), row, offset, state, len(a.law.states)])
        theta.append(np.asarray(a.theta, dtype=float))
        states.append(a.law.start())
        row, offset, state = row + len(a.rows), offset + len(a.theta), state + len(a.law.states)
    return (
        np.array(table, dtype=np.int64).reshape(-1, 8),
        np.concatenate([*theta, [0.0]]),
        np.concatenate([*states, []]),
    )


@_jit
def _follow(start, step, q, v, elements, hidden, work, force):
    """Force (n, 1) of elements along a given fine motion (n, 1): hidden states by the midpoint rule, friction by its sign."""
    table = elements[0]
    z, z_middle, zdot = hidden
    total = np.zeros(1)
    for k in range(q.shape[0]):
        total[0] = 0.0
        _stage(start + k * step, q[k], v[k], z, elements, work, total, zdot)
        for e in range(table.shape[0]):
            if table[e, LIMIT] != 0:
                total[0] += np.sign(v[k, 0]) * work[1][e]
        force[k] = total[0]
        if z.shape[0] == 0 or k == q.shape[0] - 1:
            continue
        z_middle[:] = z + 0.5 * step * zdot
        middle_q = 0.5 * (q[k] + q[k + 1])
        middle_v = 0.5 * (v[k] + v[k + 1])
        _stage(start + (k + 0.5) * step, middle_q, middle_v, z_middle, elements, work, total, zdot)
        z += step * zdot


def follow(acting: Sequence[Acting], *, position: Array, velocity: Array, step: float) -> Array:
    """Force (n,) of laws and friction limits along a given motion (n,), sampled finely."""
    table, theta, z = tabulate(acting)
    rows = np.vstack([a.rows for a in acting]) if acting else np.zeros((0, 1))
    force = np.zeros(len(position))
    work = (np.zeros((3, SETTINGS.max_rows)), np.zeros(max(len(table), 1)))
    _follow(
        0.0, step, np.ascontiguousarray(position.reshape(-1, 1)), np.ascontiguousarray(velocity.reshape(-1, 1)),
        (table, np.ascontiguousarray(rows), theta), (z, z.copy(), np.zeros(len(z))), work, force,
    )  # fmt: skip
    return force
