"""Loads that were logged late or by another clock than the responses, and drives that follow commands while these are held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planted_cases import SAMPLE_RATE, linear_motion, load, planted_case

from bench.discrepancy import Case, CaseRecord, diagnose
from bench.discrepancy.effects.catalogue import CATALOGUE
from bench.discrepancy.effects.channel_operators import advance, analogue_lag, held_lag, lag, skew
from bench.discrepancy.fitting.fits import Search
from bench.discrepancy.fitting.map_fit import fit
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placements import placements
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.settings import DEFAULT


def test_a_load_is_read_at_the_times_of_the_other_clock():
    ramp = np.arange(100.0)
    assert skew(ramp, np.array([0.01]), 0.5)[:50] == pytest.approx(1.01 * ramp[:50])
    assert skew(ramp, np.array([0.5]), 0.5)[80:] == pytest.approx(99.0)  # nothing is known behind the end


def test_a_load_that_was_logged_late_is_put_back():
    ramp = np.arange(100.0)
    assert advance(ramp, np.array([1.2]), 0.5)[:90] == pytest.approx(ramp[:90] + 2.4)
    assert advance(ramp, np.array([1.2]), 0.5)[98:] == pytest.approx(99.0)


def test_a_lag_of_held_samples_is_the_mean_of_a_finer_one():
    step, fine, tau = 0.01, 200, 0.013
    x = np.random.default_rng(2).standard_normal(30)
    y, means = 0.0, []
    for held in x:
        t = (np.arange(fine) + 0.5) * step / fine
        means.append(np.mean(held + (y - held) * np.exp(-t / tau)))
        y = held + (y - held) * np.exp(-step / tau)
    assert held_lag(x, np.array([tau]), step) == pytest.approx(means, abs=1e-5)


def test_a_lag_of_an_amplifier_is_exact_along_lines():
    step, tau = 0.01, 0.013
    ramp = np.arange(40.0)
    # of a ramp from zero: t - tau (1 - exp(-t / tau)), and one sample more for the line from before the record
    t = np.arange(40.0) * step
    assert analogue_lag(ramp, np.array([tau]), step) == pytest.approx((t - tau * -np.expm1(-t / tau)) / step)


@pytest.mark.parametrize(
    ("lagged", "variant"), [(analogue_lag, "analogue"), (lag, "")], ids=["analogue", "digital"]
)
def test_a_lag_is_named_alone_and_as_what_it_is(lagged, variant):
    case = planted_case(
        lambda f: linear_motion(lagged(f, np.array([0.02]), 1.0 / SAMPLE_RATE)), role="command"
    )
    (found,) = diagnose(case).verdict.named
    assert (found.name, found.variant) == ("actuator_lag", variant)
    assert found.parameters["time_constant"].value == pytest.approx(0.02, rel=3e-3)


@pytest.mark.parametrize("name", ["actuator_delay", "actuator_lag", "displacement_delay", "displacement_lag"])
def test_what_a_log_is_uncertain_of_anyway_is_no_finding(name):
    case = planted_case(n=400, role="command")
    structure, effects = structure_of(case), [effect for effect in CATALOGUE if effect.name == name]
    (placed,) = placements(case, structure, effects)
    scales = Problem(case, structure, case.identification).scales_of(placed)
    assert not placed.effect.tells(np.array([0.09 / SAMPLE_RATE]), scales)
    assert placed.effect.tells(np.array([0.11 / SAMPLE_RATE]), scales)


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("clock_skew", 4e-5, True),  # over ten seconds a fifth of a sample of 2 ms
        ("clock_skew", -4e-5, True),
        ("clock_skew", 1e-5, False),
        ("force_delay", 4e-4, True),
        ("force_delay", 1e-4, False),
    ],
)
def test_times_are_told_from_a_tenth_of_a_sample_on(name: str, value: float, told: bool):
    case = planted_case(n=5000)
    structure = structure_of(case, settings=DEFAULT)
    problem = Problem(case, structure, case.identification, settings=DEFAULT)
    (placed,) = placements(case, structure, [effect for effect in CATALOGUE if effect.name == name])
    eta = placed.effect.parameters[0].eta(value, problem.scales_of(placed))
    start = np.append(np.zeros(len(problem.nominal)), eta)
    search = Search(problem)
    search.add(fit(problem, (placed,), start=start, iterations=0))
    assert bool(search.fits) == told


def logged_otherwise(rate: float, late: float) -> Case:
    """A planted case with nothing missing, its load logged by a clock that runs fast by a part `rate`, `late` seconds late."""

    def logged(record: CaseRecord, seed: int) -> CaseRecord:
        n = len(record)
        times = np.arange(n) * (1.0 + rate) - late * SAMPLE_RATE
        return replace(
            record,
            values={
                **record.values,
                "force": np.interp(times, np.arange(n + 200), np.pad(load(seed, n), (0, 200))),
            },
        )

    case = planted_case(n=4000)
    (identification,), (validation,) = case.identification, case.validation
    return replace(case, identification=(logged(identification, 0),), validation=(logged(validation, 1),))


@pytest.mark.slow
@pytest.mark.parametrize("rate", [6e-4, -6e-4])
def test_a_clock_that_runs_fast_or_slow_is_named_with_its_rate(rate: float):
    verdict = diagnose(logged_otherwise(rate, 0.0)).verdict
    assert [(effect.name, effect.channel) for effect in verdict.named] == [("clock_skew", "force")]
    # the load is put back onto the clock of the responses; over 8 s that is a good two samples at the end
    assert verdict.named[0].parameters["rate_error"].value == pytest.approx(-rate, rel=0.05)
    assert verdict.complete


@pytest.mark.slow
def test_a_load_that_was_logged_late_is_named_with_its_delay():
    verdict = diagnose(logged_otherwise(0.0, 0.0041)).verdict
    assert [(effect.name, effect.channel) for effect in verdict.named] == [("force_delay", "force")]
    assert verdict.named[0].parameters["delay"].value == pytest.approx(0.0041, rel=0.02)
    assert verdict.complete
