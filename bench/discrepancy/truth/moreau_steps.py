"""The compiled steps of Moreau's time stepping, see `moreau_time_stepping`."""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from bench.laws.calling import advance, call_kernel, pointer_at

FORCE, RATE, LIMIT, N_ROWS, ROW, THETA, STATE, N_STATES = range(8)


class MoreauLimits(NamedTuple):
    """Numbers of `bench.discrepancy.truth.moreau_time_stepping` that compiled code holds."""

    diverged: float = 1e12


MOREAU_LIMITS = MoreauLimits()

_jit = numba.njit(cache=True, error_model="numpy", nogil=True)


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
def march_through(clock, loads, system, elements, hidden, stop, work, out):  # noqa: PLR0912  (one compiled loop)
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
        if k == loads.shape[0] - 1 or not abs(q[0]) < MOREAU_LIMITS.diverged:
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


@_jit
def follow_through(start, step, q, v, elements, hidden, work, force):
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
