"""Damper: recovery of the design model, its refusal under random motion, campaign, polynomial experiment and order study."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from bench.errors import IdentificationError, ParameterError, RecordingError
from bench.identification.damper import design_force, fit_design_model, fit_design_model_online
from bench.identification.damper_study import (
    DAMPER_STUDY_SETTINGS,
    INCH,
    VISCOUS_DAMPER,
    harmonic_record,
    polynomial_experiment,
    random_record,
)
from bench.identification.damper_trust import check_design_model
from bench.identification.harmonic_tests import harmonic_campaign
from bench.identification.order_study import order_study
from bench.laws.evaluate import evaluate

IDEAL = {"series_stiffness": 5e8, "stiffness": 0.0, "friction": 0.0, "mass": 0.0}


def harmonic(frequency, amplitude, samples=4000, periods=10):
    time = np.linspace(0, periods / frequency, samples)
    omega = 2 * math.pi * frequency
    return time, amplitude * np.sin(omega * time), amplitude * omega * np.cos(omega * time)


@settings(max_examples=25, deadline=None)
@given(
    coefficient=st.floats(1e3, 2e5),
    exponent=st.floats(0.15, 1.8),
    speed=st.floats(1e-3, 2.0),
    seed=st.integers(0, 99),
)
def test_least_squares_recovers_the_design_model(coefficient, exponent, speed, seed):
    v = speed * np.random.default_rng(seed).standard_normal(500)
    fit = fit_design_model(v, design_force(v, coefficient, exponent))
    assert fit.exponent == pytest.approx(exponent, rel=1e-5)
    # C is the force at 1 m/s, for slow tests an extrapolation by the power of n
    assert fit.coefficient == pytest.approx(coefficient, rel=1e-3)
    assert fit.nmse < 1e-6


def test_standard_deviations_cover_the_truth():
    hits = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        v = 0.1 * rng.standard_normal(400)
        force = design_force(v, 5e4, 0.6) + 300.0 * rng.standard_normal(400)
        fit = fit_design_model(v, force)
        hits += (
            abs(fit.exponent - 0.6) < 2 * fit.exponent_std
            and abs(fit.coefficient - 5e4) < 2 * fit.coefficient_std
        )
    # 95 % each, strongly correlated: 36 of 40 is two standard deviations below the mean
    assert hits >= 34


def test_online_equals_least_squares_on_the_ideal_damper():
    time, _, v = harmonic(0.25, 0.051)
    force = design_force(v, 48e3, 0.64)
    online = fit_design_model_online(time, v, force, frequency=0.25)
    # 1e-3: what the start covariance leaves after ten periods, for a forgetting of three
    assert online.coefficient == pytest.approx(48e3, rel=1e-3)
    assert online.exponent == pytest.approx(0.64, rel=1e-3)
    assert online.settled < 1.0
    assert check_design_model(time, np.cumsum(v) * (time[1] - time[0]), v, force).trusted


def test_damper_law_against_an_independent_integrator():
    theta = VISCOUS_DAMPER.theta()
    time = np.linspace(0.0, 2.0, 2001)
    omega = 2 * math.pi * 1.5
    x, v = 0.02 * np.sin(omega * time), 0.02 * omega * np.cos(omega * time)

    def rate(t, z):
        slope = np.zeros(1)
        VISCOUS_DAMPER.rate(t, [0.0], [0.02 * omega * math.cos(omega * t)], z, theta, slope)
        return slope

    exact = solve_ivp(rate, (0.0, 2.0), [0.0], t_eval=time, rtol=1e-9, atol=1e-6, method="LSODA").y[0]
    ours = evaluate(VISCOUS_DAMPER, theta, time, x, v, substeps=4).states[:, 0]
    # the motion between samples is a cubic here, exact there: (omega h)^4 of 8 kN is 1e-4 N; the kink of |z|^(1/n) adds
    np.testing.assert_allclose(ours, exact, atol=0.05)


def test_stiff_damper_is_the_design_model(rng):
    record = harmonic_record(0.5, 0.05, rng=rng, noise=0.0, C=40e3, n=0.7, **IDEAL)
    expected = design_force(record.velocity, 40e3, 0.7)
    error = (record.force - expected)[50:]
    # k1 of 5e8 N/m lags by C n v^(n-1) / k1, some 1e-4 s, and by more only where v is nearly zero
    assert np.sqrt(np.mean(error**2)) < 0.005 * np.abs(expected).max()


def test_energy_is_dissipated(rng):
    record = harmonic_record(2.0, 0.02, rng=rng, noise=0.0)
    period = slice(1800, 2001)
    work = np.trapezoid(record.force[period], record.displacement[period])
    assert work > 0.0


class TestTrust:
    @pytest.mark.parametrize(("frequency", "amplitude"), [(0.25, 0.051), (0.1, 0.1), (0.2, 0.15)])
    def test_slow_harmonic_motion_is_trusted(self, rng, frequency, amplitude):
        record = harmonic_record(frequency, amplitude, rng=rng)
        report = check_design_model(record.time, record.displacement, record.velocity, record.force)
        assert report.trusted, report.reasons
        assert report.fit.exponent == pytest.approx(0.65, abs=0.15)

    @pytest.mark.parametrize("seed", range(6))
    def test_random_motion_is_refused(self, seed):
        record = random_record(np.random.default_rng(seed))
        report = check_design_model(record.time, record.displacement, record.velocity, record.force)
        assert not report.trusted
        assert any("displacement and acceleration" in reason for reason in report.reasons)
        assert report.p_value < 1e-6

    def test_random_motion_of_an_ideal_damper_is_trusted(self):
        """The refusal is of the loop, not of randomness."""
        record = random_record(np.random.default_rng(3), C=50e3, n=0.65, **IDEAL)
        report = check_design_model(record.time, record.displacement, record.velocity, record.force)
        assert report.trusted, report.reasons
        assert report.loop_width < 0.02

    def test_spring_beside_the_damper_is_named(self):
        record = random_record(np.random.default_rng(4), **(IDEAL | {"stiffness": 4e5}))
        report = check_design_model(record.time, record.displacement, record.velocity, record.force)
        assert not report.trusted
        assert report.memory_share > 10.0
        # opening and closing branch lie apart where the spring is loaded
        both = np.isfinite(report.accelerating) & np.isfinite(report.decelerating)
        assert np.any(both)

    def test_fast_harmonic_motion_is_refused(self, rng):
        record = harmonic_record(10.0, 0.013, rng=rng)
        report = check_design_model(record.time, record.displacement, record.velocity, record.force)
        assert not report.trusted
        assert report.loop_width > 0.3

    def test_noise_alone_is_no_loop(self):
        rng = np.random.default_rng(0)
        time, x, v = harmonic(0.5, 0.05)
        force = design_force(v, 5e4, 0.7)
        report = check_design_model(time, x, v, force + 0.05 * force.std() * rng.standard_normal(v.size))
        assert report.trusted
        assert report.p_value > 1e-4


@pytest.mark.slow
def test_campaign_of_202_tests():
    campaign = harmonic_campaign(np.random.default_rng(1))
    assert len(campaign.tests) == 202
    for row in campaign.table:
        # what must hold: within one printed standard deviation, means and spreads
        assert abs(row.deviation) < 1.0, row
        assert abs(row.std - row.printed_std) < row.printed_std, row
    means = {(row.method, row.parameter): row.mean for row in campaign.table}
    # as printed, the logarithmic on-line form gives the lower C and n
    assert means["on line", "C"] < means["least squares", "C"]
    assert means["on line", "n"] < means["least squares", "n"]
    assert campaign.settled < 1.0
    assert 0 < campaign.n_trusted < 202
    for test in campaign.tests:
        assert 2 * math.pi * test.frequency * test.amplitude <= DAMPER_STUDY_SETTINGS.rated_velocity * (
            1 + 1e-9
        )
        assert 0.1 <= test.frequency <= 30.0
        peak = test.true_coefficient * (2 * math.pi * test.frequency * test.amplitude) ** test.true_exponent
        assert peak <= DAMPER_STUDY_SETTINGS.actuator_force
    slow = [test.trusted for test in campaign.tests if test.frequency < 0.3]
    fast = [test.trusted for test in campaign.tests if test.frequency > 3.0]
    assert np.mean(slow) > np.mean(fast)


def test_campaign_is_reproducible():
    first, second = (harmonic_campaign(np.random.default_rng(5), n_tests=3) for _ in range(2))
    assert first == second


def test_polynomial_experiment():
    figures = []
    for seed in range(3):
        experiment = polynomial_experiment(np.random.default_rng(seed))
        figures.append((experiment.other_segment, experiment.online, experiment.half_amplitude))
        assert not experiment.design.trusted
        # ranges of Fig 3.5: x of 0.0254 m, v to 0.08 m/s, F to 15 kN
        assert np.abs(experiment.training.displacement).max() <= INCH * (1 + 1e-9)
        assert 0.05 < np.abs(experiment.training.velocity).max() < 0.15
        assert 8e3 < np.abs(experiment.training.force).max() < 20e3
        total = experiment.contributions.sum(axis=1)
        assert np.mean((total - experiment.measured) ** 2) < 0.03 * np.var(experiment.measured)
        assert len(experiment.names) == 37
    segment, online, half = np.array(figures).T
    # printed 1.40, 4.65 and 11.40 %: the same ordering in every draw, the same order of magnitude
    assert np.all((segment < online) & (online < half)), figures
    for values, printed in ((segment, 1.40), (online, 4.65), (half, 11.40)):
        # the tails of a record decide how far a polynomial errs: single draws scatter by a factor of three
        assert printed / 3 < np.median(values) < printed * 3, (values, printed)
    assert np.all(segment < 5.0)  # a good fit, by the criterion of the dissertation


@pytest.mark.slow
def test_order_study_finds_optimum_and_blow_up():
    rng = np.random.default_rng(0)
    whole = random_record(rng, seconds=90.0)
    study = order_study(whole.part(slice(0, 30_000)), whole.part(slice(30_000, None)), highest=20)
    error = np.diag(study.validation)
    assert study.blow_up is not None
    assert 2 <= study.sufficient <= study.optimum < study.blow_up <= 20
    assert error[study.blow_up] > 2 * error[study.optimum]
    # nested models: more terms never fit the training record worse, but for rounding of the normal equations
    assert np.all(np.diff(np.diag(study.training)) < 1e-6)
    # the order of v decides, that of x hardly matters (Fig 3.11)
    assert study.validation[5, 0] > 50 * study.validation[5, 5]
    assert study.validation[0, 5] < 5 * study.validation[5, 5]
    # the mass stays where it is while the model is not over-parameterised (Fig 3.12)
    low = np.diag(study.mass)[1 : study.optimum + 1]
    assert np.ptp(low) < 0.1 * abs(study.mass_plateau)


def test_order_study_equals_direct_least_squares(rng):
    record = random_record(rng, seconds=20.0)
    train, test = record.part(slice(0, 6000)), record.part(slice(6000, None))
    study = order_study(train, test, highest=4, every=1)
    spans = [(c.min(), c.max()) for c in (train.displacement, train.velocity)]

    def columns(r, i, j):
        x, v = (
            2 * (c - low) / (high - low) - 1
            for c, (low, high) in zip((r.displacement, r.velocity), spans, strict=True)
        )
        return np.column_stack([r.acceleration, *(x**p * v**q for p in range(i + 1) for q in range(j + 1))])

    for i, j in ((0, 0), (1, 3), (4, 4)):
        theta = np.linalg.lstsq(columns(train, i, j), train.force)[0]
        for r, table in ((train, study.training), (test, study.validation)):
            error = r.force - columns(r, i, j) @ theta
            # a ridge of 1e-12 and the square of the condition number leave six digits
            assert table[i, j] == pytest.approx(100 * np.mean(error**2) / np.var(r.force), rel=1e-4)
        assert study.mass[i, j] == pytest.approx(theta[0], rel=1e-3)


def test_over_parameterisation_by_a_short_record(rng):
    whole = random_record(rng, seconds=30.0)
    study = order_study(whole.part(slice(0, 2500)), whole.part(slice(2500, None)), highest=14)
    assert study.blow_up is not None
    assert study.blow_up < 12


def test_bad_input_is_named():
    time, x, v = harmonic(1.0, 0.1, samples=100)
    with pytest.raises(IdentificationError, match="sign"):
        fit_design_model(v, -v)
    with pytest.raises(RecordingError, match="velocity"):
        fit_design_model(np.zeros(20), np.ones(20))
    with pytest.raises(RecordingError, match="sample 3"):
        fit_design_model(np.where(np.arange(100) == 3, np.nan, v), v)
    with pytest.raises(IdentificationError, match="periods"):
        fit_design_model_online(time[:20], v[:20], v[:20], frequency=1.0)
    with pytest.raises(ParameterError, match="frequency"):
        fit_design_model_online(time, v, v, frequency=0.0)
    with pytest.raises(RecordingError, match="equal rows"):
        check_design_model(time[:-1], x, v, v)
    with pytest.raises(ParameterError, match="n_tests"):
        harmonic_campaign(np.random.default_rng(0), n_tests=1)
    record = random_record(np.random.default_rng(0), seconds=2.0)
    with pytest.raises(IdentificationError, match="coefficients"):
        order_study(record, record)
    with pytest.raises(ParameterError, match="highest"):
        order_study(record, record, highest=1)
