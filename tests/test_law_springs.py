"""What analysis knows about springs, clearances, dampers and couplings."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from law_states import force_at, harmonic, last_cycle_work
from scipy.integrate import trapezoid

from bench.laws import LAWS
from bench.laws.coupling import INCH, POUND_FORCE
from bench.laws.evaluate import evaluate


@given(
    fraction=st.floats(-1, 1),
    beyond=st.floats(1e-6, 1.0),
    offset=st.floats(-0.01, 0.01),
    clearance=st.floats(0, 0.01),
)
def test_gap_is_zero_inside_and_linear_outside(fraction, beyond, offset, clearance):
    gap = LAWS["gap"]
    theta = {"stiffness": 3000.0, "clearance": clearance, "offset": offset}
    inside = offset + fraction * clearance * (1 - 1e-12)
    # (offset + x) - offset is rounded to about 1e-17 m, times the stiffness
    assert abs(force_at(gap, inside, **theta)[0]) < 1e-12
    for side in (1.0, -1.0):
        f = force_at(gap, offset + side * (clearance + beyond), **theta)[0]
        assert f == pytest.approx(side * 3000.0 * beyond, rel=1e-9, abs=1e-12)


def test_gap_contact_damps_and_never_pulls():
    gap, stop = LAWS["gap"], LAWS["one_sided_stop"]
    damped = {"stiffness": 1000.0, "clearance": 0.001, "damping": 50.0}
    assert force_at(gap, 0.002, 0.1, **damped)[0] == pytest.approx(1.0 + 5.0)
    assert force_at(gap, 0.002, -0.1, **damped)[0] == 0.0  # 1 N - 5 N would pull
    assert force_at(gap, -0.002, 0.1, **damped)[0] == 0.0
    assert force_at(gap, 0.0005, 10.0, **damped)[0] == 0.0
    assert last_cycle_work(gap, **damped)[0] > 0
    kwargs = {"stiffness": 1000.0, "position": -0.001, "damping": 50.0, "side": -1.0}
    assert force_at(stop, -0.002, -0.1, **kwargs)[0] == pytest.approx(-6.0)
    assert force_at(stop, -0.002, 0.1, **kwargs)[0] == 0.0
    assert force_at(stop, 5.0, 1.0, **kwargs)[0] == 0.0


def test_asymmetric_gap_and_its_symmetric_case():
    x = np.linspace(-0.01, 0.01, 201)
    asymmetric, gap = LAWS["asymmetric_gap"], LAWS["gap"]
    same = {"stiffness_positive": 2e3, "stiffness_negative": 2e3}
    same |= {"clearance_positive": 0.003, "clearance_negative": 0.003}
    for value in x:
        assert (
            force_at(asymmetric, value, **same)[0] == force_at(gap, value, stiffness=2e3, clearance=0.003)[0]
        )
    assert force_at(asymmetric, 0.004)[0] == pytest.approx(10000.0 * 0.002)
    assert force_at(asymmetric, -0.005)[0] == pytest.approx(-5000.0 * 0.002)


def test_polynomial_springs_and_cogging():
    assert force_at(LAWS["quadratic_stiffness"], -0.02, k2=100.0)[0] == pytest.approx(0.04)
    assert force_at(LAWS["cubic_stiffness"], -0.02, k3=1e6)[0] == pytest.approx(-8.0)
    assert force_at(LAWS["stiffness_drift"], 0.01, t=7.0, rate=20.0, onset=2.0)[0] == pytest.approx(1.0)
    assert force_at(LAWS["stiffness_drift"], 0.01, t=1.0, rate=20.0, onset=2.0)[0] == 0.0
    cogging = LAWS["cogging"]
    assert force_at(cogging, 0.005, period=0.02, amplitude=2.0)[0] == pytest.approx(2.0)
    assert force_at(cogging, 0.003)[0] == pytest.approx(force_at(cogging, 0.023)[0], rel=1e-12)


@given(n=st.floats(0.1, 1.0), v=st.floats(0.1, 10.0))
def test_power_law_exponent(n, v):
    law = LAWS["power_law_damping"]
    f1, f2 = (force_at(law, 0.0, s * v, C=30.0, n=n)[0] for s in (1.0, 2.0))
    # the regularisation changes the force by (1-n)/2 (v0/v)^2 <= 5e-5 at v = 100 v0; the quotient by twice that over ln 2
    assert math.log2(f2 / f1) == pytest.approx(n, abs=2e-4)
    assert f1 == pytest.approx(30.0 * v**n, rel=6e-5)


def test_equivalent_damping_of_the_quadratic_law():
    t, q, v = harmonic(0.02, 2.0, cycles=1)
    force = evaluate(LAWS["quadratic_damping"], [20.0], t, q, v).force[:, 0]
    w = 4 * math.pi
    equivalent = trapezoid(force * v, t) / (math.pi * w * 0.02**2)
    assert equivalent == pytest.approx(
        8 / (3 * math.pi) * 20.0 * w * 0.02, rel=1e-6
    )  # O(1/2000^2) of the trapezoid rule


def test_deck_joint_reproduces_the_deck():
    joint = LAWS["axial_torsional_joint"]
    for inches, pounds in (
        (-0.5, -640.0),
        (-0.3, -240.0),
        (0.0, 0.0),
        (0.1, 20.0),
        (0.3, 240.0),
        (0.5, 640.0),
    ):
        assert force_at(joint, [inches * INCH, 0.0])[0] / POUND_FORCE == pytest.approx(pounds)
        assert force_at(joint, [0.0, inches])[1] / (POUND_FORCE * INCH) == pytest.approx(pounds)
    moving = force_at(joint, [0.3 * INCH, 0.5], [2 * INCH, 3.0])
    assert moving[0] / POUND_FORCE == pytest.approx(240 + 6.32 * 2 + 500 * 2 * 0.3)
    assert moving[1] / (POUND_FORCE * INCH) == pytest.approx(640 + 6.32 * 3 + 500 * 3 * 0.1)


@given(x=st.floats(-0.02, 0.02), angle=st.floats(-0.6, 0.6), speed=st.floats(-1, 1), spin=st.floats(-10, 10))
def test_deck_joint_is_the_sum_of_its_parts(x, angle, speed, spin):
    joint = LAWS["axial_torsional_joint"]
    p = dict(zip(joint.parameter_names, joint.theta(), strict=True))
    parts = force_at(LAWS["gap_coupling"], [x, angle], [speed, spin])
    for i, (where, u, du) in enumerate((("axial", x, speed), ("torsional", angle, spin))):
        parts[i] += force_at(LAWS["linear"], u, du, stiffness=p[f"k_{where}"], damping=p[f"c_{where}"])[0]
        parts[i] += force_at(
            LAWS["gap"], u, du, stiffness=p[f"k_gap_{where}"], clearance=p[f"clearance_{where}"]
        )[0]
    np.testing.assert_allclose(force_at(joint, [x, angle], [speed, spin]), parts, rtol=1e-12, atol=1e-9)


def test_printed_coupling_follows_its_four_cases():
    law = LAWS["printed_coupling"]
    theta = {"k0_axial": 2.0, "k0_torsional": 3.0, "clearance_axial": 0.01, "clearance_torsional": 0.2}
    v = [0.5, 0.7]
    assert force_at(law, [0.02, 0.1], v, **theta) == pytest.approx([2.0 * 0.5 * 0.1, 0.0])
    assert force_at(law, [0.005, -0.3], v, **theta) == pytest.approx([0.0, 3.0 * 0.7 * 0.005])
    assert force_at(law, [0.02, -0.3], v, **theta) == pytest.approx([2.0 * 0.5 * -0.3, 3.0 * 0.7 * 0.02])
    assert force_at(law, [0.005, 0.1], v, **theta) == pytest.approx([0.0, 0.0])


def test_cross_stiffness_is_reciprocal():
    assert force_at(LAWS["cross_stiffness"], [0.01, 0.2], stiffness=50.0) == pytest.approx([10.0, 0.5])
