"""Forces from outside in windows of time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planted_cases import NOISE, SAMPLE_RATE, linear_motion, load, planted_case

from bench.discrepancy import diagnose, record_from_arrays
from bench.discrepancy.report.model_update import recipes
from bench.discrepancy.unscreened.time_windows import windows_of
from bench.laws import find_law

N = 4000


def pushed(windows, level: float, n: int = N) -> np.ndarray:
    time = np.arange(n) / SAMPLE_RATE
    return level * np.sum([(time >= s) & (time < s + d) for s, d in windows], axis=0)


def case_with(*pushes: np.ndarray):
    """A planted case on whose records forces act that no channel tells, one a record."""
    case, rng = planted_case(n=N), np.random.default_rng(5)
    records = []
    for seed, push in enumerate(pushes):
        record = (*case.identification, *case.validation)[seed]
        x, a = linear_motion(load(seed, N) + push)
        values = {
            **record.values,
            "displacement": x + NOISE["displacement"] * rng.standard_normal(N),
            "acceleration": a + NOISE["acceleration"] * rng.standard_normal(N),
        }
        records.append(record_from_arrays(record.name, record.time, values))
    return replace(case, identification=(records[0],), validation=(records[1],))


def test_the_kernel_pushes_inside_its_windows():
    law = find_law("timed_force", (2.0,))
    theta = law.theta([3.0, 1e-3, 1.0, 0.5, 1.0, 2.0, 0.25, -2.0])
    for time, expected in (
        (0.9, 0.0),
        (1.2, -3.0),
        (1.6, 0.0),
        (2.1, 6.0),
        (2.3, 0.0),
        (1.0, -1.5),
        (0.9995, -0.375),
    ):
        f = np.zeros(1)
        law.force(time, np.zeros(1), np.zeros(1), np.zeros(1), theta, f)
        assert f[0] == pytest.approx(expected)


def test_windows_are_found_to_a_fraction_of_a_sample_and_a_force_that_swells_has_none():
    rng = np.random.default_rng(0)
    time = np.arange(N) / SAMPLE_RATE
    noise = 0.15 * rng.standard_normal(N)
    truth = ((1.0, 0.5), (3.4, 0.25), (6.0, 1.1))
    found = windows_of(time, pushed(truth, 2.0) + noise)
    assert found is not None
    np.testing.assert_allclose(found.start, [s for s, _ in truth], atol=2.0 / SAMPLE_RATE)
    np.testing.assert_allclose(found.duration, [d for _, d in truth], atol=3.0 / SAMPLE_RATE)
    np.testing.assert_allclose(found.level, 2.0, rtol=0.02)
    assert windows_of(time, 2.0 * np.sin(2 * np.pi * 0.7 * time) + noise) is None
    assert windows_of(time, noise) is None


@pytest.mark.slow
def test_a_push_that_no_channel_tells_is_named_with_its_time_and_size():
    first, second = ((2.0, 0.6), (5.0, 0.6)), ((1.2, 0.6), (4.1, 0.6))
    diagnosis = diagnose(case_with(pushed(first, 9.0), pushed(second, 9.0)))
    verdict = diagnosis.verdict
    assert [effect.name for effect in verdict.named] == ["timed_force"]
    found = verdict.named[0].parameters
    assert abs(found["force"].value - 9.0) < 5 * found["force"].std + 0.01 * 9.0
    assert found["windows"].value == 2
    assert found["start"].value + found["shift"].value == pytest.approx(2.0, abs=1.0 / SAMPLE_RATE)
    assert found["duration"].value == pytest.approx(0.6, abs=1.0 / SAMPLE_RATE)
    # the windows of the judging record are its own; their force is that of the other record
    assert verdict.gap.after < 1.3 * verdict.gap.noise_floor < 0.3 * verdict.gap.before
    code: dict = {}
    exec(recipes(diagnosis)[0].code.partition("\nrig =")[0], code)
    assert code["element"].theta[0] == 2.0
