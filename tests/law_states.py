"""States and motions that the tests of the force laws share, and the call of a compiled kernel."""

from __future__ import annotations

import ctypes
import math

import numpy as np
from scipy.integrate import trapezoid

from bench.laws.evaluate import evaluate

DOUBLES = ctypes.POINTER(ctypes.c_double)


def call(compiled_kernel, t, q, v, z, theta, out):
    """Call the compiled C function of a kernel."""
    arrays = [np.ascontiguousarray(a, dtype=float) for a in (q, v, z, theta)]
    compiled_kernel.compiled.ctypes(
        t, *(a.ctypes.data_as(DOUBLES) for a in arrays), out.ctypes.data_as(DOUBLES)
    )
    return out


def force_at(law, q, v=0.0, z=None, t=0.0, **parameters):
    """Force vector of the compiled kernel at one state."""
    q = np.broadcast_to(np.asarray(q, dtype=float), law.n_coordinates)
    v = np.broadcast_to(np.asarray(v, dtype=float), law.n_coordinates)
    z = law.start() if z is None else np.atleast_1d(np.asarray(z, dtype=float))
    return call(law.force, t, q, v, z, law.theta(**parameters), np.zeros(law.n_coordinates))


def random_state(law, rng):
    """A state of ordinary size for a rig of some newtons, millimetres and tenths of a metre a second."""
    scale_q = [0.01, 0.4] if law.n_coordinates == 2 else [0.01]
    q = rng.uniform(-1, 1, law.n_coordinates) * scale_q
    v = rng.uniform(-1, 1, law.n_coordinates) * 0.3
    if law.n_inputs:
        q[-1] = rng.uniform(-5, 20)
    z = np.array(
        [
            rng.uniform(0, 3) if "[J]" in s else rng.uniform(-1, 1) * (5 if "[N]" in s else 5e-4)
            for s in law.states
        ]
    )
    return rng.uniform(0, 10), q, v, z


def harmonic(amplitude, frequency=1.0, cycles=3, samples=2000):
    """Time, position and velocity of whole cycles, `samples` a cycle."""
    t = np.arange(cycles * samples + 1) / (samples * frequency)
    w = 2 * math.pi * frequency
    return t, amplitude * np.sin(w * t), amplitude * w * np.cos(w * t)


def motion_of(law, sign=1.0, samples=2000):
    """Elliptic harmonic motion that reaches yield, stops and clearances of every law at its defaults."""
    t, q, v = harmonic(sign * 0.01, samples=samples)
    if law.n_inputs:
        return t, np.column_stack([q, np.full_like(t, 10.0)]), np.column_stack([v, np.zeros_like(t)])
    if law.n_coordinates == 2:
        w = 2 * math.pi
        other = sign * 0.4 * np.sin(w * t + 1.0)
        return t, np.column_stack([q, other]), np.column_stack([v, sign * 0.4 * w * np.cos(w * t + 1.0)])
    return t, q, v


def last_cycle_work(law, samples=2000, **parameters):
    """Work done on the law in the last of three cycles, and the largest power times the period as its scale."""
    t, q, v = motion_of(law, samples=samples)
    force = evaluate(law, law.theta(**parameters), t, q, v).force[-samples - 1 :]
    moving = law.n_coordinates - law.n_inputs
    power = np.sum(force[:, :moving] * np.reshape(v, (t.size, -1))[-samples - 1 :, :moving], axis=1)
    return trapezoid(power, t[-samples - 1 :]), np.abs(power).max()
