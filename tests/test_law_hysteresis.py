"""What analysis knows about hysteresis, relaxation and elastic sliders."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from law_states import call, harmonic, last_cycle_work
from scipy.integrate import trapezoid

from bench.laws import LAWS, generalised_bouc_wen_law, iwan_law
from bench.laws.evaluate import evaluate


@settings(max_examples=20, deadline=None)
@given(n=st.floats(1, 6), beta=st.floats(20, 200), skew=st.floats(-0.5, 1.0))
def test_bouc_wen_ultimate_strength(n, beta, skew):
    gamma = skew * beta
    theta = [1000.0, beta, gamma, n]
    strength = (1000.0 / (beta + gamma)) ** (1 / n)
    t = np.linspace(0, 1, 4001)
    travel = 40 * strength / 1000.0
    force = evaluate(LAWS["bouc_wen"], theta, t, travel * t, np.full_like(t, travel)).force[:, 0]
    assert force[-1] == pytest.approx(
        strength, rel=1e-6
    )  # 40 yield displacements: e^-40 for n = 1, quicker above
    assert force.max() <= strength * (1 + 1e-9)


def test_bouc_wen_variants_fall_back_to_bouc_wen():
    motion = harmonic(0.02)
    plain = evaluate(LAWS["bouc_wen"], LAWS["bouc_wen"].theta(n=2.0), *motion).force
    degrading, pinching = LAWS["bouc_wen_degrading"], LAWS["bouc_wen_pinching"]
    same = evaluate(degrading, degrading.theta(n=2.0, delta_nu=0, delta_eta=0), *motion)
    np.testing.assert_allclose(same.force, plain, atol=1e-12)
    same = evaluate(pinching, pinching.theta(n=2.0, delta_nu=0, delta_eta=0, zeta_10=0), *motion)
    np.testing.assert_allclose(same.force, plain, atol=1e-12)
    general = generalised_bouc_wen_law(3)
    quadratic = general.theta(k=1000.0, beta_1=0, gamma_1=0, beta_2=100.0, gamma_2=50.0)
    # the elastic part is exact here and integrated there: RK4's error, small against the force of some newtons
    np.testing.assert_allclose(evaluate(general, quadratic, *motion).force, plain, atol=1e-6)


def test_degradation_weakens_and_counts_the_work():
    law = LAWS["bouc_wen_degrading"]
    t, q, v = harmonic(0.02, cycles=6)
    force, states = evaluate(law, law.theta(), t, q, v)
    peaks = np.abs(force[:, 0]).reshape(-1)[:-1].reshape(6, -1).max(axis=1)
    assert np.all(np.diff(peaks) < 0)
    assert states[-1, 1] == pytest.approx(trapezoid(force[:, 0] * v, t), rel=1e-4)  # trapezoid against RK4
    strength = 1000.0 / (150.0 * (1 + 0.1 * states[-1, 1]))
    assert peaks[-1] == pytest.approx(strength, rel=0.03)  # the loop saturates at the weakened strength


def test_pinching_narrows_the_loop_at_the_centre():
    law = LAWS["bouc_wen_pinching"]
    t, q, v = harmonic(0.02, cycles=4)
    fresh = evaluate(law, law.theta(zeta_10=0.0), t, q, v).force[-2001:, 0]
    pinched = evaluate(law, law.theta(p=10.0), t, q, v).force[-2001:, 0]
    assert trapezoid(pinched * v[-2001:], t[-2001:]) < 0.9 * trapezoid(fresh * v[-2001:], t[-2001:])
    slope = np.diff(pinched) / np.diff(q[-2001:])
    level = pinched[:-1] * np.sign(v[-2001:-1]) / np.abs(pinched).max()
    assert np.median(slope[np.abs(level - 0.1) < 0.05]) < 0.5 * np.median(slope[np.abs(level + 0.6) < 0.1])


def test_maxwell_storage_and_loss():
    law = LAWS["maxwell"]
    for omega_tau in (0.1, 1.0, 10.0):
        frequency = omega_tau / (2 * math.pi * 0.02)
        t, q, v = harmonic(0.01, frequency, cycles=12)
        force = evaluate(law, law.theta(), t, q, v).force[-2001:-1, 0]
        w = 2 * math.pi * frequency
        storage = 2 * np.mean(force * np.sin(w * t[-2001:-1])) / 0.01
        loss = 2 * np.mean(force * np.cos(w * t[-2001:-1])) / 0.01
        scale = 1000.0 * omega_tau / (1 + omega_tau**2)
        # 11 cycles of transient: e^(-11 2 pi / 10) = 1e-3 of the start at omega tau = 10, and its mean over a cycle
        assert storage == pytest.approx(scale * omega_tau, rel=1e-3)
        assert loss == pytest.approx(scale, rel=2e-3)


@pytest.mark.parametrize("transition", [0.02, 0.1, 0.5])
def test_jenkins_loop_and_rise(transition):
    law = LAWS["jenkins"]
    k, limit, amplitude = 2000.0, 5.0, 0.02
    work, _ = last_cycle_work(law, samples=20000, transition=transition)
    t, q, v = harmonic(amplitude, samples=20000, cycles=2)
    theta = law.theta(transition=transition)
    force = evaluate(law, theta, t, q, v).force[:, 0]
    area = trapezoid(force[-20001:] * v[-20001:], t[-20001:])
    corner = (2 * math.log(2) - 1) * transition**2 * limit**2 / k
    assert area == pytest.approx(
        4 * limit * (amplitude - limit / k) - corner, rel=2e-6
    )  # trapezoid rule at kinks
    rise = t < 0.2
    u = (k * q[rise] / limit - 1 + transition) / transition
    exact = np.where(u < 0, k * q[rise], limit * (1 - transition + transition * np.tanh(u)))
    # RK4 at a step of 3e-6 m against a corner of 5e-5 m at least
    np.testing.assert_allclose(force[rise], exact, atol=1e-5 * limit)
    assert np.abs(force).max() <= limit
    assert work < area  # the smaller amplitude of the common motion


def test_jenkins_stays_bounded_on_a_coarse_record():
    law = LAWS["jenkins"]
    t, q, v = harmonic(0.05, samples=40, cycles=20)
    force, states = evaluate(law, law.theta(transition=0.01), t, q, v)
    assert np.abs(force).max() <= 5.0
    step = 2000.0 * np.abs(v).max() * (t[1] - t[0])
    assert np.abs(states).max() <= 5.0 + step
    assert np.abs(force[t > 1, 0]).max() == pytest.approx(5.0, rel=0.05)


@settings(max_examples=25, deadline=None)
@given(n=st.integers(1, 40), chi=st.floats(-0.8, 1.0), beta=st.floats(0, 3), width=st.floats(0.05, 0.2))
def test_iwan_limit_and_initial_stiffness(n, chi, beta, width):
    law = iwan_law(n)
    theta = law.theta(chi=chi, beta=beta, transition=width)
    largest = 5.0 * (1 + beta) / (2000.0 * (beta + (chi + 1) / (chi + 2)))
    t = np.linspace(0, 1, 10001)
    force = evaluate(law, theta, t, 3 * largest * t, np.full_like(t, 3 * largest)).force[:, 0]
    # groups that yield within a step of 3e-4 of the largest strength's travel hover within a step of their limit
    assert force[-1] == pytest.approx(5.0, rel=2e-3)
    assert force.max() <= 5.0 * (1 + 1e-12)
    zdot = call(law.rate, 0.0, np.zeros(1), np.array([0.3]), np.zeros(n + 1), theta, np.zeros(n + 1))
    assert zdot.sum() == pytest.approx(2000.0 * 0.3, rel=1e-12)


def test_iwan_backbone_and_masing_rule():
    law = iwan_law(50)
    theta = law.theta(transition=0.05)
    t = np.linspace(0, 2, 20001)
    amplitude = 0.004
    q = amplitude * np.where(t < 1, t, 2 - t)
    v = amplitude * np.where(t < 1, 1.0, -1.0)
    force = evaluate(law, theta, t, q, v, substeps=2).force[:, 0]
    backbone = lambda x: 2000.0 * x - 2000.0**2 * x**2 / (4 * 5.0)  # noqa: E731  (the formula of the docstring)
    up, down = t <= 1, t >= 1.01
    # 5 N/(4 50^2) of the polygon, and the rounded corners' 0.24 w of one slider's 0.1 N
    np.testing.assert_allclose(force[up], backbone(q[up]), atol=5e-3)
    masing = backbone(amplitude) - 2 * backbone((amplitude - q[down]) / 2)
    np.testing.assert_allclose(force[down], masing, atol=1e-2)


def test_iwan_dissipation_grows_with_the_stated_power():
    law = iwan_law(60)
    losses = []
    for amplitude in (0.0005, 0.001):
        t, q, v = harmonic(amplitude, cycles=2, samples=4000)
        force = evaluate(law, law.theta(chi=-0.5, beta=1.0, transition=0.1), t, q, v).force[-4001:, 0]
        losses.append(trapezoid(force * v[-4001:], t[-4001:]))
    # 60 groups: a handful yield at the smaller amplitude, so the exponent 3 + chi is met within a few per cent
    assert math.log2(losses[1] / losses[0]) == pytest.approx(2.5, abs=0.05)
    assert losses[1] > 0
