"""Harmonic tests of a damper: drawn, and their results by class."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bench.errors import ParameterError
from bench.identification.damper import fit_design_model, fit_design_model_online
from bench.identification.damper_study import DAMPER_STUDY_SETTINGS, harmonic_record
from bench.identification.damper_trust import check_design_model
from bench.laws.coupling import INCH


class HarmonicTest(NamedTuple):
    """One harmonic test of the campaign and what was identified from it; C in N (s/m)^n."""

    frequency: float
    amplitude: float
    true_coefficient: float
    true_exponent: float
    fitted_coefficient: float
    fitted_exponent: float
    online_coefficient: float
    online_exponent: float
    settled: float
    trusted: bool


class TableRow(NamedTuple):
    """One parameter of Tables 3.1 and 3.2: ours beside the printed one; C in kN (s/m)^n."""

    method: str
    parameter: str
    mean: float
    std: float
    printed_mean: float
    printed_std: float

    @property
    def deviation(self) -> float:
        """Distance of the means in printed standard deviations."""
        return (self.mean - self.printed_mean) / self.printed_std


class HarmonicCampaign(NamedTuple):
    """The harmonic campaign.

    Attributes:
        tests: The tests.
        table: Statistics beside the printed ones.
        settled: Median number of periods until the on-line estimates have settled.
        n_trusted: Tests in which the design model stood the check.
    """

    tests: tuple[HarmonicTest, ...]
    table: tuple[TableRow, ...]
    settled: float
    n_trusted: int


def _draw(rng: np.random.Generator, mean: float, std: float, low: float, high: float) -> float:
    while True:
        value = mean + std * rng.standard_normal()
        if low <= value <= high:
            return value


def _draw_test(rng: np.random.Generator) -> tuple[float, float, float, float]:
    """C, n, frequency and amplitude of one test."""
    while True:
        coefficient = 1e3 * _draw(rng, *DAMPER_STUDY_SETTINGS.tables["least squares", "C"], 5.0, 150.0)
        exponent = _draw(rng, *DAMPER_STUDY_SETTINGS.tables["least squares", "n"], 0.15, 1.5)
        fastest = min(
            DAMPER_STUDY_SETTINGS.rated_velocity,
            (0.9 * DAMPER_STUDY_SETTINGS.actuator_force / coefficient) ** (1.0 / exponent),
        )
        if fastest >= 0.2:
            break
    amplitude = 0.5 * INCH * int(rng.integers(1, 13))
    # 2.5 Hz at 0.15 m and 30 Hz at 0.013 m are both 2.4 m/s of the servo valve, which the rated velocity forestalls.
    per_velocity = 1.0 / (2.0 * math.pi * amplitude)
    highest = min(30.0, fastest * per_velocity)
    lowest = min(max(0.1, 0.05 * per_velocity), highest)
    return coefficient, exponent, math.exp(rng.uniform(math.log(lowest), math.log(highest))), amplitude


def harmonic_campaign(rng: np.random.Generator, *, n_tests: int = 202) -> HarmonicCampaign:
    """Run the harmonic campaign and identify the design model from every test, off line and on line.

    Args:
        rng: Draws dampers, tests and noise.
        n_tests: Number of tests.

    Returns:
        Tests and statistics.

    Raises:
        ParameterError: Fewer than two tests.
    """
    if n_tests < 2:
        raise ParameterError(f"n_tests = {n_tests} came; statistics need at least two")
    tests = []
    for _ in range(n_tests):
        coefficient, exponent, frequency, amplitude = _draw_test(rng)
        record = harmonic_record(
            frequency,
            amplitude,
            rng=rng,
            C=coefficient,
            n=exponent,
            series_stiffness=DAMPER_STUDY_SETTINGS.series_stiffness * coefficient,
        )
        fit = fit_design_model(record.velocity, record.force)
        online = fit_design_model_online(record.time, record.velocity, record.force, frequency=frequency)
        trust = check_design_model(record.time, record.displacement, record.velocity, record.force)
        tests.append(
            HarmonicTest(
                frequency,
                amplitude,
                coefficient,
                exponent,
                fit.coefficient,
                fit.exponent,
                online.coefficient,
                online.exponent,
                online.settled,
                trust.trusted,
            )
        )
    columns = {
        ("on line", "C"): [1e-3 * test.online_coefficient for test in tests],
        ("on line", "n"): [test.online_exponent for test in tests],
        ("least squares", "C"): [1e-3 * test.fitted_coefficient for test in tests],
        ("least squares", "n"): [test.fitted_exponent for test in tests],
    }
    table = tuple(
        TableRow(
            *key, float(np.mean(values)), float(np.std(values, ddof=1)), *DAMPER_STUDY_SETTINGS.tables[key]
        )
        for key, values in columns.items()
    )
    return HarmonicCampaign(
        tuple(tests),
        table,
        float(np.median([test.settled for test in tests])),
        sum(test.trusted for test in tests),
    )
