"""The force of a law along a measured motion: hidden states integrated from sample to sample.

Equation-error fits, restoring-force plots and damper tests (prescribed motion) all need a law's force for a
motion that is known. One compiled loop serves every law: it calls the kernels by their address.

Between two samples the positions follow the cubic Hermite polynomial through the measured positions and
velocities and the velocities its derivative, so that their integral is exactly the measured travel; inputs
(an actuator's control) follow a straight line. The states are integrated with the classical Runge-Kutta
method, `substeps` steps an interval. With noisy positions at a high sample rate the derivative of the Hermite
polynomial amplifies the noise between samples; smooth the record first, or integrate a measured velocity.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import ParameterError, RecordingError
from bench.laws.base import ForceLaw
from bench.laws.calling import advance, call_kernel, pointer_at


class Evaluation(NamedTuple):
    """Force and hidden states of a law along a motion.

    Attributes:
        force: Restoring forces ``(n, n_coordinates)`` [N or N m]; columns of inputs are zero.
        states: Hidden states ``(n, n_states)``.
    """

    force: NDArray[np.float64]
    states: NDArray[np.float64]


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _interpolate(i, s, n_inputs, time, q, v, q_now, v_now):
    h = time[i + 1] - time[i]
    n_moving = q.shape[1] - n_inputs
    for j in range(n_moving):
        a = q[i, j]
        rise = q[i + 1, j] - a
        va = h * v[i, j]
        vb = h * v[i + 1, j]
        quadratic = 3.0 * rise - 2.0 * va - vb
        cubic = va + vb - 2.0 * rise
        q_now[j] = a + s * (va + s * (quadratic + s * cubic))
        v_now[j] = (va + s * (2.0 * quadratic + 3.0 * s * cubic)) / h
    for j in range(n_moving, q.shape[1]):
        q_now[j] = q[i, j] + s * (q[i + 1, j] - q[i, j])
        v_now[j] = 0.0
    return time[i] + s * h


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _along_motion(force_address, rate_address, theta, time, q, v, n_inputs, substeps, states, force, work):
    """Fill `force` and `states` (its first row is the start); `work` is ``(7, max(n_states, n_coordinates))`` of scratch.

    Every array is the caller's: an array made here could be freed while only its address is still in use.
    """
    n, n_coordinates = q.shape
    n_states = states.shape[1]
    q_now, v_now, z_now = work[0], work[1], work[2]
    theta_at = pointer_at(theta.ctypes.data)
    time_q = pointer_at(q.ctypes.data)
    time_v = pointer_at(v.ctypes.data)
    force_at = pointer_at(force.ctypes.data)
    states_at = pointer_at(states.ctypes.data)
    work_at = pointer_at(work.ctypes.data)
    width = work.shape[1]
    q_at = work_at
    v_at = advance(work_at, width)
    z_at = advance(work_at, 2 * width)
    for i in range(n):
        call_kernel(
            force_address,
            time[i],
            advance(time_q, i * n_coordinates),
            advance(time_v, i * n_coordinates),
            advance(states_at, i * n_states),
            theta_at,
            advance(force_at, i * n_coordinates),
        )
        if n_states == 0 or i == n - 1:
            continue
        h = (time[i + 1] - time[i]) / substeps
        for k in range(n_states):
            states[i + 1, k] = states[i, k]
        for step in range(substeps):
            for stage in range(4):
                fraction = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
                if stage != 2:
                    now = _interpolate(i, (step + fraction) / substeps, n_inputs, time, q, v, q_now, v_now)
                for k in range(n_states):
                    z_now[k] = states[i + 1, k] + (fraction * h * work[2 + stage, k] if stage > 0 else 0.0)
                rate_at = advance(work_at, (3 + stage) * width)
                call_kernel(rate_address, now, q_at, v_at, z_at, theta_at, rate_at)  # pyrefly: ignore[unbound-name]
            for k in range(n_states):
                states[i + 1, k] += h / 6.0 * (work[3, k] + 2.0 * (work[4, k] + work[5, k]) + work[6, k])


def evaluate(
    law: ForceLaw,
    theta: ArrayLike,
    time: ArrayLike,
    q: ArrayLike,
    v: ArrayLike,
    z0: ArrayLike | None = None,
    *,
    substeps: int = 1,
) -> Evaluation:
    """Return the force and the hidden states of a law along a given motion.

    Args:
        law: The law.
        theta: Its parameters, with or without the header; checked against the bounds.
        time: Sample times ``(n,)`` [s], increasing, not necessarily equidistant.
        q: Positions, then inputs ``(n, n_coordinates)``, or ``(n,)`` for one coordinate [m or rad].
        v: Velocities in the same shape [m/s or rad/s]; the columns of inputs are not used between samples.
        z0: Hidden states at the first sample ``(n_states,)``; the law's own start by default.
        substeps: Runge-Kutta steps a sample interval.

    Returns:
        Force and states, new arrays. A motion far outside the law's range may give values that are not finite; they are
        returned, not raised, so that a fit can reject them.

    Raises:
        ParameterError: `theta`, `z0` or `substeps` do not fit the law.
        RecordingError: The record's shapes do not fit, are not finite, or time does not increase.
    """
    t = np.ascontiguousarray(time, dtype=float)
    positions = _columns("q", q, t, law)
    velocities = _columns("v", v, t, law)
    if not np.all(np.diff(t) > 0):
        raise RecordingError(
            "time must increase from sample to sample; sort the record or remove repeated samples"
        )
    if substeps < 1:
        raise ParameterError(f"substeps is {substeps}; at least 1 is expected")
    n_states = len(law.states)
    start = law.start() if z0 is None else np.array(z0, dtype=float)
    if start.shape != (n_states,):
        raise ParameterError(f"z0 has shape {start.shape}; law '{law.name}' has the states {law.states}")
    states = np.empty((t.size, n_states))
    states[0] = start
    force = np.zeros((t.size, law.n_coordinates))
    work = np.zeros((7, max(n_states, law.n_coordinates)))
    _along_motion(
        law.force.address,
        0 if law.rate is None else law.rate.address,
        law.theta(theta),
        t,
        positions,
        velocities,
        law.n_inputs,
        substeps,
        states,
        force,
        work,
    )
    return Evaluation(force, states)


def _columns(name: str, values: ArrayLike, time: NDArray[np.float64], law: ForceLaw) -> NDArray[np.float64]:
    array = np.ascontiguousarray(values, dtype=float)
    if array.ndim == 1 and law.n_coordinates == 1:
        array = array[:, np.newaxis]
    if time.ndim != 1 or time.size == 0 or array.shape != (time.size, law.n_coordinates):
        raise RecordingError(
            f"{name} has shape {np.shape(values)} and time {time.shape}; law '{law.name}' expects "
            f"(n, {law.n_coordinates}) and (n,) with n >= 1"
        )
    if not (np.all(np.isfinite(array)) and np.all(np.isfinite(time))):
        raise RecordingError(
            f"{name} or time holds values that are not finite; cut the record or fill its gaps first"
        )
    return array
