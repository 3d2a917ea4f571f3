"""What analysis knows about the friction laws, and their regularisation against exact stick and slip."""

from __future__ import annotations

import math

import numpy as np
import pytest
from law_states import force_at, harmonic, last_cycle_work
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from bench.laws import LAWS
from bench.laws.evaluate import evaluate


def test_coulomb_limits_creep_and_loop():
    coulomb = LAWS["coulomb"]
    assert force_at(coulomb, 0.0, 1.0)[0] == pytest.approx(5.0)
    creep = 1e-3 * math.atanh(0.5)
    assert force_at(coulomb, 0.0, creep)[0] == pytest.approx(
        2.5
    )  # the documented creep balances half the limit
    work, _ = last_cycle_work(coulomb, regularisation_velocity=1e-5)
    assert work == pytest.approx(4 * 5.0 * 0.01, rel=1e-5)  # 4 Fc X, the trapezoid rule at the two reversals
    uneven = LAWS["asymmetric_coulomb"]
    assert force_at(uneven, 0.0, 1.0)[0] == pytest.approx(5.0)
    assert force_at(uneven, 0.0, -1.0)[0] == pytest.approx(-3.0)


def stick_slip(mass, stiffness, limit, drive, end):
    """Exact Coulomb oscillator by events: pieces ``(start, end, solution or position)``, starting at rest."""
    t, x, mode, pieces = 0.0, 0.0, 0, []
    while t < end:
        if mode == 0:
            grid = np.append(np.arange(t, end, 1e-3), end)
            excess = np.abs(drive(grid) - stiffness * x) - limit
            out = np.flatnonzero(excess > 0)
            if out.size == 0:
                pieces.append((t, end, x))
                return pieces
            start = t
            if out[0] > 0:
                t = brentq(
                    lambda s, x=x: abs(drive(s) - stiffness * x) - limit,
                    *grid[out[0] - 1 : out[0] + 1],
                    xtol=1e-14,
                )
                pieces.append((start, t, x))
            mode = int(np.sign(drive(t) - stiffness * x))
            continue

        def stopped(s, y, t=t, mode=mode):
            return mode * y[1] if s > t + 1e-9 else 1.0

        stopped.terminal, stopped.direction = True, -1
        slip = solve_ivp(
            lambda s, y, mode=mode: [y[1], (drive(s) - stiffness * y[0] - mode * limit) / mass],
            (t, end),
            [x, 0.0],
            method="DOP853",
            rtol=1e-11,
            atol=1e-13,
            max_step=0.02,
            events=stopped,
            dense_output=True,
        )
        pieces.append((t, slip.t[-1], slip.sol))
        t, x = slip.t[-1], slip.y[0, -1]
        pull = drive(t) - stiffness * x
        mode = 0 if abs(pull) <= limit else int(np.sign(pull))
    return pieces


@pytest.mark.parametrize(("ratio", "expected"), [(1e-2, 1.58e-2), (1e-3, 1.98e-3), (1e-4, 2.36e-4)])
def test_regularisation_error_against_exact_stick_slip(ratio, expected):
    """The errors stated in the docstring of `bench.laws.coulomb`, measured on a motion that rests 45 % of the time."""
    mass, stiffness, limit = 1.0, (6 * math.pi) ** 2, 5.0

    def drive(t):
        return 2 * limit * np.sin(2 * math.pi * t)

    pieces = stick_slip(mass, stiffness, limit, drive, 4.0)
    t = np.linspace(0, 4, 4001)
    exact = np.empty_like(t)
    for start, end, piece in pieces:
        inside = (t >= start) & (t <= end)
        exact[inside] = piece(t[inside])[0] if callable(piece) else piece
    resting = sum(end - start for start, end, piece in pieces if not callable(piece)) / 4.0
    assert resting == pytest.approx(0.45, abs=0.005)
    vr = ratio * 0.3437  # peak velocity of the exact motion
    force, theta, out = LAWS["coulomb"].force, LAWS["coulomb"].theta(regularisation_velocity=vr), np.zeros(1)

    def motion(s, y):
        out[0] = 0.0
        force(s, y[:1], y[1:], None, theta, out)
        return [y[1], (drive(s) - stiffness * y[0] - out[0]) / mass]

    smooth = solve_ivp(
        motion, (0, 4), [0.0, 0.0], method="LSODA", rtol=1e-8, atol=1e-10, t_eval=t, max_step=0.01
    )
    error = math.sqrt(np.mean((smooth.y[0] - exact) ** 2) / np.mean(exact**2))
    assert error == pytest.approx(
        expected, rel=0.05
    )  # the documented digits, and a little for other BLAS and step choices


def test_stribeck_curve():
    law = LAWS["stribeck"]
    for v in (0.02, 0.05, 0.2):
        assert force_at(law, 0.0, v, boost=0.5)[0] == pytest.approx(
            5.0 * (1 + 0.5 * math.exp(-((v / 0.05) ** 2)))
        )
    v = np.linspace(0, 0.05, 2001)
    for vr, lost in ((0.005, 0.097), (0.0005, 0.0027)):  # shares of the boost stated in the docstring
        peak = max(force_at(law, 0.0, s, regularisation_velocity=vr)[0] for s in v)
        assert 1 - (peak / 5.0 - 1) / 0.5 == pytest.approx(lost, rel=0.02)


def test_changing_limits():
    bow_tie = LAWS["load_dependent_friction"]
    t, q, v = harmonic(0.01)
    force = evaluate(bow_tie, bow_tie.theta(slope=200.0, regularisation_velocity=1e-5), t, q, v).force[:, 0]
    sliding = np.abs(v) > 2e-4  # at 20 vr and above tanh is 1 in floating point
    expected = 200.0 * np.abs(q[sliding]) * np.sign(v[sliding])
    np.testing.assert_allclose(force[sliding], expected, rtol=1e-14, atol=1e-300)
    varying = LAWS["time_varying_friction"]
    values = [
        force_at(varying, 0.0, 1.0, t=s, limit=4.0, depth=0.5, frequency=0.25)[0] for s in (0.0, 1.0, 3.0)
    ]
    assert values == pytest.approx([4.0, 6.0, 2.0])
    assert force_at(varying, 0.0, 1.0, t=3.0, limit=4.0, depth=2.0, frequency=0.25)[0] == 0.0
    controlled = LAWS["controlled_friction"]
    assert force_at(controlled, [0.0, 20.0], [1.0, 0.0], mu=0.3)[0] == pytest.approx(6.0)
    assert force_at(controlled, [0.0, -20.0], [1.0, 0.0])[0] == 0.0


@pytest.mark.parametrize("name", ["lugre", "elastoplastic_friction"])
def test_bristle_friction_in_steady_sliding(name):
    law = LAWS[name]
    t = np.linspace(0, 2, 20001)
    for v in (0.01, -0.05, 0.2):
        force = evaluate(law, law.theta(), t, v * t, np.full_like(t, v)).force[-1, 0]
        expected = math.copysign(5.0 * (1 + 0.2 * math.exp(-((v / 0.05) ** 2))), v) + 2.0 * v
        assert force == pytest.approx(expected, rel=1e-9)  # relaxation over 20 deflections and more: e^-20


def test_presliding_spring_and_drift():
    lugre, elastic = LAWS["lugre"], LAWS["elastoplastic_friction"]
    t, q, v = harmonic(1e-7, 1.0)
    force = evaluate(lugre, lugre.theta(bristle_damping=0.0, viscous=0.0), t, q, v).force[:, 0]
    # deflection over steady deflection is 2e-4: that is how far from elastic the bristles may be
    np.testing.assert_allclose(force, 1e4 * q, atol=4e-4 * 1e4 * 1e-7)

    def slip(law, mean, amplitude):
        """Travel of a massless block under an oscillating load below breakaway, with its bristles' own z and q."""
        theta = law.theta(bristle_damping=0.0, viscous=0.1, boost=0.0)
        out, f = np.zeros(1), np.zeros(1)

        def motion(s, y):
            load = mean + amplitude * math.sin(2 * math.pi * s)
            f[0] = 0.0
            law.force(s, y, np.zeros(1), y[1:], theta, f)
            speed = np.array([(load - f[0]) / 0.1])
            law.rate(s, y, speed, y[1:], theta, out)
            return [speed[0], out[0]]

        run = solve_ivp(
            motion,
            (0, 6),
            [0.0, 0.0],
            method="LSODA",
            rtol=1e-9,
            atol=1e-12,
            t_eval=[2.0, 6.0],
            max_step=0.01,
        )
        return run.y[0, 1] - run.y[0, 0]

    # loads between 1 N and 3 N of 5 N: below the elastic range's end of 3.5 N
    assert slip(lugre, 2.0, 1.0) > 1e-5
    assert abs(slip(elastic, 2.0, 1.0)) < 1e-9


def test_dahl_monotonic_curve_and_its_bouc_wen_twin():
    t = np.linspace(0, 1, 5001)
    q = 0.005 * t
    v = np.full_like(t, 0.005)
    dahl = evaluate(LAWS["dahl"], LAWS["dahl"].theta(), t, q, v).force[:, 0]
    np.testing.assert_allclose(
        dahl, 5.0 * (1 - np.exp(-5000.0 * q / 5.0)), rtol=1e-9, atol=1e-12
    )  # RK4 at h = 1e-3 of the scale
    motion = harmonic(0.003)
    twin = evaluate(LAWS["bouc_wen"], [5000.0, 1000.0, 0.0, 1.0], *motion).force
    np.testing.assert_allclose(evaluate(LAWS["dahl"], LAWS["dahl"].theta(), *motion).force, twin, atol=1e-9)
