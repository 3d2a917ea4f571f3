"""Force laws along a prescribed motion: hidden states are integrated, nothing moves back.

This is how a component on a test machine is simulated, and how the screening finds the force of an effect along the measured
motion of a structure. Coordinates and their rates are linear between samples; dry friction takes the sign of the rate.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.simulation.equations_of_motion import (
    FORCE,
    LIMIT,
    N_ROWS,
    N_STATES,
    RATE,
    ROW,
    SCALE,
    STATE,
    STICK_SLIP_LIMITS,
    THETA,
    scale_at,
)
from bench.discrepancy.simulation.stick_slip import Elements, full, plain, steps_of_each
from bench.laws.calling import advance, call_kernel, pointer_at


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _driven(dt, t0, substeps, q, v, table, theta, z, force):  # noqa: PLR0912, PLR0915  (one compiled loop)
    """Force (n, n_rows) and hidden states of elements whose coordinates follow the samples `q`, `v` (n, n_rows)."""
    n_states = z.shape[0]
    work = np.zeros((3, STICK_SLIP_LIMITS.max_rows + STICK_SLIP_LIMITS.grips))
    slopes = np.zeros((4, max(n_states, 1)))
    stage = np.zeros(max(n_states, 1))
    wq = pointer_at(work[0].ctypes.data)
    wv = pointer_at(work[1].ctypes.data)
    wf = pointer_at(work[2].ctypes.data)
    theta_pointer = pointer_at(theta.ctypes.data)
    z_pointer = pointer_at(z.ctypes.data)
    stage_pointer = pointer_at(stage.ctypes.data)
    for k in range(q.shape[0]):
        t = t0 + k * dt
        share = 1.0 / substeps[k]
        for e in range(table.shape[0]):
            first = table[e, ROW]
            rows = table[e, N_ROWS]
            parameters = advance(theta_pointer, table[e, THETA])
            for r in range(rows):
                work[0, r] = q[k, first + r]
                work[1, r] = v[k, first + r]
                work[2, r] = 0.0
            work[2, STICK_SLIP_LIMITS.max_rows :] = 0.0
            zp = advance(z_pointer, table[e, STATE])
            if table[e, FORCE] != 0:
                call_kernel(table[e, FORCE], t, wq, wv, zp, parameters, wf)
            scale = 1.0
            if table[e, SCALE] != 0:
                scale = scale_at(advance(theta_pointer, table[e, SCALE] - 1), t)
                for r in range(rows):
                    work[2, r] *= scale
            if table[e, LIMIT] != 0:
                call_kernel(
                    table[e, LIMIT], t, wq, wv, zp, parameters, advance(wf, STICK_SLIP_LIMITS.max_rows)
                )
                limit = max(scale * work[2, STICK_SLIP_LIMITS.max_rows], 0.0)
                creep = work[2, STICK_SLIP_LIMITS.max_rows + 1]
                lead = work[2, STICK_SLIP_LIMITS.max_rows + 2]
                if creep > 0.0 or lead > 0.0:
                    # the velocity a lead time on; what creeps not at all but only in time turns round early
                    after = min(k + 1, q.shape[0] - 1)
                    rise = v[after, first] - v[after - 1, first] if after > 0 else 0.0
                    ahead = work[1, 0] + lead * rise / dt
                    ratio = ahead / creep if creep > 0.0 else np.sign(ahead)
                    work[2, 0] += limit * min(max(ratio, -1.0), 1.0)
                else:
                    work[2, 0] += np.sign(work[1, 0]) * limit
            for r in range(rows):
                force[k, first + r] = work[2, r]
            if table[e, RATE] == 0 or k == q.shape[0] - 1:
                continue
            first_state = table[e, STATE]
            for s in range(substeps[k]):
                for i in range(4):
                    at = (s + (0.0 if i == 0 else (1.0 if i == 3 else 0.5))) * share
                    ahead = 0.0 if i == 0 else (dt * share if i == 3 else 0.5 * dt * share)
                    for r in range(rows):
                        work[0, r] = q[k, first + r] + at * (q[k + 1, first + r] - q[k, first + r])
                        work[1, r] = v[k, first + r] + at * (v[k + 1, first + r] - v[k, first + r])
                    for j in range(first_state, first_state + table[e, N_STATES]):
                        stage[j] = z[j] + (ahead * slopes[i - 1, j] if i > 0 else 0.0)
                    call_kernel(
                        table[e, RATE], t + at * dt, wq, wv, advance(stage_pointer, first_state), parameters,
                        advance(pointer_at(slopes[i].ctypes.data), first_state),
                    )  # fmt: skip
                for j in range(first_state, first_state + table[e, N_STATES]):
                    z[j] += (
                        dt * share / 6.0 * (slopes[0, j] + 2.0 * (slopes[1, j] + slopes[2, j]) + slopes[3, j])
                    )


def driven_force(
    elements: Elements,
    *,
    position: NDArray[np.float64],
    velocity: NDArray[np.float64],
    step: float,
    substeps: int | NDArray[np.int64] = 1,
    start_time: float = 0.0,
) -> NDArray[np.float64]:
    """Force of elements whose coordinates follow a given motion (n, n_rows); friction takes the sign of the velocity."""
    force = np.zeros_like(position)
    counts = steps_of_each(substeps, len(position))
    q, v = plain(position), plain(velocity)
    theta, z = plain(elements.theta), elements.start.copy()
    _driven(step, start_time, counts, q, v, full(elements.table), theta, z, force)
    return force


def driven_states(
    elements: Elements,
    *,
    position: NDArray[np.float64],
    velocity: NDArray[np.float64],
    step: float,
    at: NDArray[np.int64],
    substeps: int | NDArray[np.int64] = 1,
    start_time: float = 0.0,
) -> NDArray[np.float64]:
    """Hidden states (n_at, n_states) at increasing samples `at`, of elements whose coordinates follow a given motion."""
    z = elements.start.copy()
    out = np.zeros((len(at), len(z)))
    before = 0
    counts = steps_of_each(substeps, len(position))
    for i, sample in enumerate(at):
        q = plain(position[before : sample + 1])
        v = plain(velocity[before : sample + 1])
        time = start_time + before * step
        own = counts[before : sample + 1]
        _driven(step, time, own, q, v, full(elements.table), plain(elements.theta), z, np.zeros_like(q))
        out[i] = z
        before = int(sample)
    return out
