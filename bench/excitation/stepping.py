"""Compiled steps of many linear structures with elements: what `bench.excitation.ensemble` packs and runs.

The method is MuJoCo's own: classical Runge-Kutta, commands held over a step, sensors read at the start of a step. Forces are
the laws' own kernels. A member with one degree of freedom and one element, as most are, has a loop of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from bench.laws.base import MAX_COORDINATES
from bench.laws.calling import advance, call_kernel, load_int, pointer_at, stack_array


class SteppingLimits(NamedTuple):
    """Numbers of `bench.excitation.stepping` that compiled code holds."""

    motion: int = -1
    undriven: int = -2
    """Marks of a law's coordinate that is a motion, or an input that gets no command."""
    max_states: int = 16
    max_values: int = 32
    """Hidden states; states, force and commands together: the most that the loop of a single element has room for."""


STEPPING_LIMITS = SteppingLimits()
_STATES, _VALUES = (
    STEPPING_LIMITS.max_states,
    STEPPING_LIMITS.max_values,
)  # sizes on the stack have to be globals of the module


class Packed(NamedTuple):
    """Members as plain arrays for compiled code; d counts members, k elements, j coordinates of a law."""

    constants: NDArray[np.float64]  # (D, R) of the R = nv + nc affine rows: accelerations, then channels
    coefficients: NDArray[
        np.float64
    ]  # (D, n_terms) of all rows, one after the other; most are zero and left out
    rows: NDArray[np.int64]  # (R + 1,) first term of each row
    columns: NDArray[np.int64]  # (n_terms,) place in [states, generalised forces, commands]
    kernels: NDArray[np.int64]  # (D, K, 2) force and rate addresses, 0 for none
    sizes: NDArray[np.int64]  # (D, K, 3) coordinates, states, first state
    motion: NDArray[np.float64]  # (D, K, J, nv) coefficients of joints in a coordinate
    inputs: NDArray[np.int64]  # (D, K, J) command read by a coordinate, or MOTION, or UNDRIVEN
    theta: NDArray[np.float64]  # (D, K, n_theta)
    start: NDArray[np.float64]  # (D, 2 nv + nz)

    def alone(self, i: int) -> Packed:
        """One member."""
        rows = self._asdict().items()
        return self._replace(**{name: a[i : i + 1] for name, a in rows if name not in {"rows", "columns"}})


@numba.njit(error_model="numpy", inline="always")
def _affine(row, constants, coefficients, rows, columns, values):
    """An affine function of states, generalised forces and commands, by its terms."""
    total = constants[row]
    for k in range(load_int(rows + 8 * row), load_int(rows + 8 * row + 8)):
        total += coefficients[k] * values[load_int(columns + 8 * k)]
    return total


@numba.njit(error_model="numpy", inline="always")
def _derivative(t, x, nv, nx, n_elements, n_coordinates, n_theta, table, rows, columns, dx, scratch):
    """Write the derivative of the state at `x` into `dx`; behind the state stand generalised forces (written) and commands.

    Everything is a C pointer: arrays passed to a function are counted references, which cost more than the arithmetic here.
    """
    constants, coefficients, kernels, sizes, motion, inputs, theta = table
    tau = advance(x, nx)
    u = advance(tau, nv)
    lv = advance(scratch, MAX_COORDINATES)
    lf = advance(lv, MAX_COORDINATES)
    for i in range(nv):
        tau[i] = 0.0
    for k in range(n_elements):
        force = load_int(kernels + 16 * k)
        if force == 0:
            continue
        count = load_int(sizes + 24 * k)
        first = 2 * nv + load_int(sizes + 24 * k + 16)
        for j in range(count):
            source = load_int(inputs + 8 * (n_coordinates * k + j))
            row = advance(motion, nv * (n_coordinates * k + j))
            position = 0.0
            velocity = 0.0
            if source >= 0:
                position = u[source]
            elif source == STEPPING_LIMITS.motion:
                for i in range(nv):
                    position += row[i] * x[i]
                    velocity += row[i] * x[nv + i]
            scratch[j] = position
            lv[j] = velocity
            lf[j] = 0.0
        parameters = advance(theta, n_theta * k)
        states = advance(x, first)
        call_kernel(force, t, scratch, lv, states, parameters, lf)
        for j in range(count):
            if load_int(inputs + 8 * (n_coordinates * k + j)) == STEPPING_LIMITS.motion:
                row = advance(motion, nv * (n_coordinates * k + j))
                for i in range(nv):
                    tau[i] -= row[i] * lf[j]
        rate = load_int(kernels + 16 * k + 8)
        if rate != 0:
            call_kernel(rate, t, scratch, lv, states, parameters, advance(dx, first))
    for i in range(nv):
        dx[i] = x[nv + i]
        dx[nv + i] = _affine(i, constants, coefficients, rows, columns, x)


class Run(NamedTuple):
    """Cases to be advanced; `states` and `outputs` are written."""

    timestep: float
    clock: NDArray[np.float64]  # (n_cases,) time at the first command
    controls: NDArray[np.float64]  # (n_cases, n, n_actuators)
    members: NDArray[np.int64]  # (n_cases, n_members)
    counts: NDArray[np.int64]  # (n_cases,) how many of them are real
    packed: Packed
    states: NDArray[np.float64]  # (n_cases, n_members, n_states)
    outputs: NDArray[np.float64]  # (n_cases, n_members, n, n_channels)


class _Work(NamedTuple):
    """Room for one member of `_advance_any`, as C pointers."""

    state: Any  # states, behind them generalised forces and commands
    commands: Any  # the same commands
    rates: Any  # four rates of the states
    scratch: Any  # coordinates, velocities and forces of a law


@numba.njit(error_model="numpy", nogil=True, inline="always")
def _advance_any(case, m, d, run, work, nv):
    """Advance one member of a case, whatever it is; `nv` is its number of degrees of freedom."""
    h, clock, controls, _, _, p, states, outputs = run
    x_now, u, rates, scratch = work
    nx, nu, n_steps = states.shape[2], controls.shape[2], controls.shape[1]
    nr, n_terms = p.constants.shape[1], p.coefficients.shape[1]
    n_elements, n_coordinates, n_theta = p.kernels.shape[1], p.motion.shape[2], p.theta.shape[2]
    nc = nr - nv
    rows, columns = p.rows.ctypes.data, p.columns.ctypes.data
    x = pointer_at(states.ctypes.data + 8 * nx * (m + states.shape[1] * case))
    y = pointer_at(outputs.ctypes.data + 8 * nc * n_steps * (m + outputs.shape[1] * case))
    table = (
        pointer_at(p.constants.ctypes.data + 8 * nr * d),
        pointer_at(p.coefficients.ctypes.data + 8 * n_terms * d),
        p.kernels.ctypes.data + 16 * n_elements * d,
        p.sizes.ctypes.data + 24 * n_elements * d,
        pointer_at(p.motion.ctypes.data + 8 * nv * n_coordinates * n_elements * d),
        p.inputs.ctypes.data + 8 * n_coordinates * n_elements * d,
        pointer_at(p.theta.ctypes.data + 8 * n_theta * n_elements * d),
    )
    for i in range(4 * nx):
        rates[i] = 0.0  # among them rates of states that this member does not have
    for step in range(n_steps):
        for i in range(nu):
            u[i] = controls[case, step, i]
        for stage in range(4):
            fraction = 0.0 if stage == 0 else (h if stage == 3 else 0.5 * h)
            dx = advance(rates, stage * nx)
            before = advance(rates, (stage - 1) * nx)
            for i in range(nx):
                x_now[i] = x[i] + (fraction * before[i] if stage > 0 else 0.0)
            t = clock[case] + h * step + fraction
            _derivative(
                t, x_now, nv, nx, n_elements, n_coordinates, n_theta, table, rows, columns, dx, scratch
            )  # fmt: skip
            if stage == 0:
                for c in range(nc):
                    y[nc * step + c] = _affine(nv + c, table[0], table[1], rows, columns, x_now)
        for i in range(nx):
            x[i] += (h / 6.0) * (rates[i] + 2.0 * (rates[nx + i] + rates[2 * nx + i]) + rates[3 * nx + i])


@numba.njit(error_model="numpy", nogil=True)
def _coefficient(p, d, column):
    """What the first row of a member takes of a column."""
    total = 0.0
    for k in range(p.rows[0], p.rows[1]):
        if p.columns[k] == column:
            total += p.coefficients[d, k]
    return total


@numba.njit(error_model="numpy", nogil=True)
def _advance_single(case, m, d, run):  # noqa: PLR0912  (one compiled loop)
    """`_advance_any` of a member with one degree of freedom and one element on its motion, quicker: it stays in registers."""
    h, clock, controls, _, _, p, states, outputs = run
    nx, nu, n_steps = states.shape[2], controls.shape[2], controls.shape[1]
    nc, nz = p.constants.shape[1] - 1, nx - 2
    force, slope = p.kernels[d, 0, 0], p.kernels[d, 0, 1]
    arm = p.motion[d, 0, 0, 0]
    theta = pointer_at(p.theta.ctypes.data + 8 * p.theta.shape[2] * d)
    constants = pointer_at(p.constants.ctypes.data + 8 * p.constants.shape[1] * d)
    coefficients = pointer_at(p.coefficients.ctypes.data + 8 * p.coefficients.shape[1] * d)
    rows, columns = p.rows.ctypes.data, p.columns.ctypes.data
    q, v, f = stack_array(1), stack_array(1), stack_array(1)
    z, rate, total = (
        stack_array(_STATES),
        stack_array(_STATES),
        stack_array(_STATES),
    )
    values = stack_array(_VALUES)
    u = advance(values, nx + 1)
    hidden = pointer_at(states.ctypes.data + 8 * (nx * (m + states.shape[1] * case) + 2))
    y = pointer_at(outputs.ctypes.data + 8 * nc * n_steps * (m + outputs.shape[1] * case))
    position, velocity = states[case, m, 0], states[case, m, 1]
    per_position = _coefficient(p, d, 0)
    per_velocity = _coefficient(p, d, 1)
    per_force = _coefficient(p, d, nx)
    for i in range(nz):
        rate[i] = 0.0
    for step in range(n_steps):
        for i in range(nu):
            u[i] = controls[case, step, i]
        push = p.constants[d, 0]
        for k in range(p.rows[0], p.rows[1]):
            if p.columns[k] > nx:
                push += p.coefficients[d, k] * values[p.columns[k]]
        for i in range(nz):
            total[i] = 0.0
        gone = gained = speed = acceleration = 0.0
        for stage in range(4):
            fraction = 0.0 if stage == 0 else (h if stage == 3 else 0.5 * h)
            weight = 1.0 if stage % 3 == 0 else 2.0
            now, speed = position + fraction * speed, velocity + fraction * acceleration
            for i in range(nz):
                z[i] = hidden[i] + fraction * rate[i]
            q[0], v[0], f[0] = arm * now, arm * speed, 0.0
            t = clock[case] + h * step + fraction
            if force != 0:
                call_kernel(force, t, q, v, z, theta, f)
            if slope != 0:
                call_kernel(slope, t, q, v, z, theta, rate)
            tau = -arm * f[0]
            acceleration = push + per_position * now + per_velocity * speed + per_force * tau
            gone += weight * speed
            gained += weight * acceleration
            for i in range(nz):
                total[i] += weight * rate[i]
            if stage == 0:
                values[0], values[1], values[nx] = now, speed, tau
                for i in range(nz):
                    values[2 + i] = z[i]
                for c in range(nc):
                    y[nc * step + c] = _affine(1 + c, constants, coefficients, rows, columns, values)
        position += h / 6.0 * gone
        velocity += h / 6.0 * gained
        for i in range(nz):
            hidden[i] += h / 6.0 * total[i]
    states[case, m, 0], states[case, m, 1] = position, velocity


@numba.njit(cache=True, error_model="numpy", nogil=True)
def advance_cases(first, last, run):
    """Advance the cases ``first … last − 1`` of a `Run`."""
    p, nx, nu = run.packed, run.states.shape[2], run.controls.shape[2]
    nv = p.motion.shape[3]
    room = np.zeros(5 * nx + nv + nu + 3 * MAX_COORDINATES)
    state = pointer_at(room.ctypes.data)
    commands = advance(state, nx + nv)
    rates = advance(commands, nu)
    work = _Work(state, commands, rates, advance(rates, 4 * nx))
    single = (
        p.motion.shape[1:] == (1, 1, 1)
        and nx <= 2 + STEPPING_LIMITS.max_states
        and nx + 1 + nu <= STEPPING_LIMITS.max_values
    )
    for case in range(first, last):
        for m in range(run.counts[case]):
            d = run.members[case, m]
            if single and p.inputs[d, 0, 0] == STEPPING_LIMITS.motion:
                _advance_single(case, m, d, run)
            elif nv == 4:  # known to the compiler: its loops are unrolled
                _advance_any(case, m, d, run, work, 4)
            else:
                _advance_any(case, m, d, run, work, nv)
    room[0] = 0.0  # an array of which only the address is in use would be freed before


def integrate_cases(
    packed: Packed,
    controls: NDArray[np.float64],
    states: NDArray[np.float64],
    *,
    members: NDArray[np.int64],
    counts: NDArray[np.int64],
    timestep: float,
    clock: NDArray[np.float64] | None = None,
    spread: Callable[[Callable[[int, int], None], int], None] | None = None,
) -> NDArray[np.float64]:
    """Advance cases of packed members; as `Ensemble.integrate`, which calls it.

    Args:
        packed: The members.
        controls: Commands by case ``(n_cases, n, n_actuators)``.
        states: States ``(n_cases, n_members, n_states)``, advanced in place.
        members: Members of each case ``(n_cases, n_members)``.
        counts: How many of them are real ``(n_cases,)``.
        timestep: Integration step [s].
        clock: Time at the first command [s] ``(n_cases,)``; zero by default.
        spread: Called with a task and the number of cases, to spread shares of them over threads; one thread by default.
    """
    run = run_of(packed, controls, states, members=members, counts=counts, timestep=timestep, clock=clock)
    if spread is None:
        advance_cases(0, len(controls), run)
    else:
        spread(lambda first, last: advance_cases(first, last, run), len(controls))
    return run.outputs


def run_of(
    packed: Packed,
    controls: NDArray[np.float64],
    states: NDArray[np.float64],
    *,
    members: NDArray[np.int64],
    counts: NDArray[np.int64],
    timestep: float,
    clock: NDArray[np.float64] | None = None,
) -> Run:
    """Cases of packed members ready to be advanced, the outputs zero; the arguments are those of `integrate_cases`."""
    n_cases, n_steps, _ = controls.shape
    n_channels = packed.constants.shape[1] - packed.motion.shape[3]
    return Run(
        timestep,
        np.zeros(n_cases) if clock is None else np.ascontiguousarray(clock, dtype=float),
        np.ascontiguousarray(controls, dtype=float),
        members,
        counts,
        packed,
        states,
        np.zeros((n_cases, members.shape[1], n_steps, n_channels)),
    )
