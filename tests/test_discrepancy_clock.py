"""Loads that were logged by another clock than the responses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planted_cases import SAMPLE_RATE, load, planted_case

from bench.discrepancy import Case, CaseRecord, diagnose
from bench.discrepancy.effects.channel_operators import skew


def test_a_load_is_read_at_the_times_of_the_other_clock():
    ramp = np.arange(100.0)
    assert skew(ramp, np.array([0.01]), 0.5)[:50] == pytest.approx(1.01 * ramp[:50])
    assert skew(ramp, np.array([0.5]), 0.5)[80:] == pytest.approx(99.0)  # nothing is known behind the end


def logged_fast(rate: float) -> Case:
    """A planted case with nothing missing, its load logged by a clock that runs fast by a part `rate`."""

    def logged(record: CaseRecord, seed: int) -> CaseRecord:
        n = len(record)
        later = np.interp(np.arange(n) * (1.0 + rate), np.arange(n + 200), np.pad(load(seed, n), (0, 200)))
        return replace(record, values={**record.values, "force": later})

    case = planted_case(n=4000)
    (identification,), (validation,) = case.identification, case.validation
    return replace(case, identification=(logged(identification, 0),), validation=(logged(validation, 1),))


@pytest.mark.slow
@pytest.mark.parametrize("rate", [6e-4, -6e-4])
def test_a_clock_that_runs_fast_or_slow_is_named_with_its_rate(rate: float):
    verdict = diagnose(logged_fast(rate)).verdict
    assert [(effect.name, effect.channel) for effect in verdict.named] == [("clock_skew", "force")]
    # the load is put back onto the clock of the responses; over 8 s that is a good two samples at the end
    assert len(logged_fast(rate).identification[0]) / SAMPLE_RATE == 8.0
    assert verdict.named[0].parameters["rate_error"].value == pytest.approx(-rate, rel=0.05)
    assert verdict.complete
