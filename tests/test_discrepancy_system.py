"""The fast simulator: against exact solutions, an independent integrator, and energy."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import cont2discrete, dlsim

from bench.discrepancy.effects import friction_limits
from bench.discrepancy.motion.kalman_smoother import smooth_motion
from bench.discrepancy.simulation.prescribed_response import driven_force
from bench.discrepancy.simulation.stick_slip import NO_ELEMENTS, Elements, StructureMatrices, free_run
from bench.laws.bouc_wen import BOUC_WEN
from bench.laws.gap import GAP

MASS, DAMPING, STIFFNESS = 2.0, 5.0, 900.0


def structure() -> StructureMatrices:
    return StructureMatrices(*(np.array([[x]]) for x in (MASS, DAMPING, STIFFNESS, 1.0)))


def element(law=None, theta=(), limit=None) -> Elements:
    addresses = (
        [0, 0, limit.address] if limit else [law.force.address, law.rate.address if law.rate else 0, 0]
    )
    states = 0 if limit else len(law.states)
    table = np.array([[*addresses, 1, 0, 0, 0, states]], dtype=np.int64)
    return Elements(table, np.ones((1, 1)), np.append(np.asarray(theta, dtype=float), 0.0), np.zeros(states))


def load(n: int, step: float) -> np.ndarray:
    t = step * np.arange(n)
    return 20.0 * np.sin(2 * np.pi * 1.3 * t) + 15.0 * np.sin(2 * np.pi * 3.1 * t)


def test_linear_response_is_the_exact_first_order_hold_solution():
    step, u = 1e-3, load(4000, 1e-3)
    a = np.array([[0.0, 1.0], [-STIFFNESS / MASS, -DAMPING / MASS]])
    b = np.array([[0.0], [1.0 / MASS]])
    system = cont2discrete((a, b, np.eye(2), np.zeros((2, 1))), step, "foh")
    # the first-order-hold realisation is not the physical state; outputs are compared, from a load that starts at zero
    _, exact, _ = dlsim(system, u)
    motion = free_run(structure(), NO_ELEMENTS, loads=u[:, None], step=step)
    # RK4 at omega h = 0.02: global error about (omega h)^4 / 120 a radian, 1e-9, over the 80 radians of the record
    np.testing.assert_allclose(
        motion.position[:, 0], exact[:, 0], rtol=0, atol=1e-7 * np.abs(exact[:, 0]).max()
    )


@pytest.mark.parametrize(
    ("law", "theta"),
    [(BOUC_WEN, (500.0, 40.0, 20.0, 1.0)), (GAP, (2000.0, 0.01, 0.0, 0.0))],
    ids=["bouc_wen", "gap"],
)
def test_nonlinear_response_agrees_with_an_independent_integrator(law, theta):
    step, n = 1e-3, 1500
    u = load(n, step)
    t = step * np.arange(n)

    def rhs(time, y):
        f, zdot = np.zeros(1), np.zeros(max(len(law.states), 1))
        z = y[2:] if law.states else np.zeros(1)
        law.force(time, y[:1], y[1:2], z, theta, f)
        if law.rate:
            law.rate(time, y[:1], y[1:2], z, theta, zdot)
        a = (np.interp(time, t, u) - DAMPING * y[1] - STIFFNESS * y[0] - f[0]) / MASS
        return [y[1], a, *zdot[: len(law.states)]]

    y0 = np.zeros(2 + len(law.states))
    reference = solve_ivp(rhs, (0.0, t[-1]), y0, t_eval=t, rtol=1e-8, atol=1e-10, max_step=step)
    motion = free_run(structure(), element(law, theta), loads=u[:, None], step=step)
    # kinks of the force inside a step cost RK4 an error of order h^2 times the jump of the slope
    np.testing.assert_allclose(
        motion.position[:, 0], reference.y[0], atol=2e-5 * np.abs(reference.y[0]).max()
    )


def test_friction_holds_until_the_load_exceeds_it_and_then_stops_in_finite_time():
    """A free block under a ramp: it does not move before F = Fc, then moves as the ramp integrated twice."""
    step, slope, limit = 1e-3, 4.0, 6.0
    t = step * np.arange(3000)
    block = StructureMatrices(np.array([[MASS]]), np.zeros((1, 1)), np.zeros((1, 1)), np.ones((1, 1)))
    motion = free_run(
        block,
        element(theta=(limit,), limit=friction_limits.coulomb_limit),
        loads=slope * t[:, None],
        step=step,
    )
    start = limit / slope
    assert np.all(motion.position[t < start, 0] == 0.0)
    late = t > start
    exact = slope * (t[late] - start) ** 3 / (6.0 * MASS)
    # the instant of breaking loose is found by the secant rule, exact for a ramp
    np.testing.assert_allclose(motion.position[late, 0], exact, atol=1e-9)


def test_friction_stops_a_sliding_block_where_energy_says():
    step, limit, speed = 1e-3, 6.0, 1.5
    block = StructureMatrices(np.array([[MASS]]), np.zeros((1, 1)), np.zeros((1, 1)), np.ones((1, 1)))
    motion = free_run(
        block,
        element(theta=(limit,), limit=friction_limits.coulomb_limit),
        loads=np.zeros((2000, 1)),
        step=step,
        start=np.array([0.0, speed]),
    )
    assert motion.velocity[-1, 0] == 0.0
    assert motion.position[-1, 0] == pytest.approx(
        0.5 * MASS * speed**2 / limit, rel=1e-9
    )  # exact: constant force


def test_substeps_do_not_change_stick_slip():
    u = load(4000, 1e-3)[:, None]
    friction = element(theta=(6.0,), limit=friction_limits.coulomb_limit)
    coarse, fine = (free_run(structure(), friction, loads=u, step=1e-3, substeps=s).position for s in (1, 20))
    # events are located inside the step, so one step a sample already resolves them to the order of RK4
    np.testing.assert_allclose(coarse, fine, atol=1e-6 * np.abs(fine).max())


def test_driven_force_of_hysteresis_closes_a_dissipative_loop():
    t = 1e-3 * np.arange(4000)
    q = 0.05 * np.sin(2 * np.pi * t)
    v = 0.05 * 2 * np.pi * np.cos(2 * np.pi * t)
    force = driven_force(
        element(BOUC_WEN, (500.0, 40.0, 20.0, 1.0)), position=q[:, None], velocity=v[:, None], step=1e-3
    )
    last = slice(3000, 4000)
    assert np.sum(force[last, 0] * v[last]) * 1e-3 > 0.0
    assert np.ptp(force[2000:3000, 0] - force[3000:, 0]) < 1e-3 * np.ptp(force)  # steady after two periods


def test_smoothing_recovers_the_velocity_that_was_not_measured():
    rng = np.random.default_rng(3)
    t = 1e-3 * np.arange(8000)
    q = 0.01 * np.sin(2 * np.pi * 2.0 * t) + 0.004 * np.sin(2 * np.pi * 5.0 * t)
    v = np.gradient(q, 1e-3)
    a = np.gradient(v, 1e-3)
    noise = np.array([1e-4, 0.05])
    samples = np.column_stack([q, a]) + noise * rng.standard_normal((len(t), 2))
    smooth = smooth_motion(samples, (0, 2), noise, 1e-3)
    inside = slice(200, -200)
    # about a hundred independent samples a corner period of 20 Hz: errors fall well below a percent of the signal
    assert np.std(smooth[inside, 1] - v[inside]) < 0.01 * np.std(v)
    assert np.std(smooth[inside, 0] - q[inside]) < 0.3 * noise[0]


GUARDED = """
import ctypes, mmap
import numpy as np
from bench.discrepancy.effects.friction_limits import coulomb_limit
from bench.discrepancy.simulation.stick_slip import Elements, StructureMatrices, free_run

n, factor = 16384, 32
size = n * factor * 8
memory = mmap.mmap(-1, 2 * size)
address = ctypes.addressof(ctypes.c_char.from_buffer(memory))
ctypes.CDLL(None).mprotect(ctypes.c_void_p(address + size), ctypes.c_size_t(size), 0)
loads = np.frombuffer(memory, count=n * factor)[factor - 1:][:, None]  # they end where nobody may read
loads[-len(loads) // 50:] = 20.0  # held until late: an address made of no number then lies far beyond them
wild = StructureMatrices(*(np.array([[x]]) for x in (2.0, -1e160, 900.0, 1.0)))
table = np.array([[0, 0, coulomb_limit.address, 1, 0, 0, 0, 0]], dtype=np.int64)
friction = Elements(table, np.ones((1, 1)), np.array([6.0, 0.0]), np.zeros(0))
motion = free_run(wild, friction, loads=loads, step=1e-3, substeps=4, load_factor=factor)
assert motion.position[n // 2, 0] == 0.0
assert np.isnan(motion.position[-1, 0])
"""


def test_a_run_with_friction_that_overflows_reads_no_load_beyond_the_last():
    """Within one step it may leave all numbers behind; the instant at which friction would end is none then either."""
    done = subprocess.run([sys.executable, "-c", GUARDED], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
