"""Samples that a logger made up: found, bridged, told, and held against no model."""

from __future__ import annotations

import numpy as np
import pytest
from planted_cases import SAMPLE_RATE, planted_case

from bench.discrepancy import record_from_arrays
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.rigs import structure_of
from bench.recording.outliers import OutlierRun, bridged, outliers

N = 3000
TIME = np.arange(N) / SAMPLE_RATE


def motion(seed: int = 0) -> np.ndarray:
    """Two channels of a vibration with noise."""
    rng = np.random.default_rng(seed)
    x = np.sin(30.0 * TIME) * (1.0 + 0.3 * np.sin(2.0 * TIME))
    return np.column_stack([x, -900.0 * x]) + rng.standard_normal((N, 2)) * [0.003, 3.0]


def test_spikes_zeros_and_holds_are_found_where_they_are():
    values = motion()
    values[700, 0] += 0.8
    values[1500, 0] = 0.0
    values[2199:2205, 0] = values[2198, 0]
    found, other = outliers(values)
    assert other == []
    assert [run.first for run in found] == [700, 1500, pytest.approx(2198, abs=1)]
    assert found[2].last == pytest.approx(2204, abs=1)
    healed = bridged(values[:, 0], found)
    # cubics over some samples of a vibration at 30 rad/s and its noise
    assert np.max(np.abs(healed - motion()[:, 0])) < 0.05


def test_dropouts_are_found_however_many_there_are_and_a_pause_of_what_was_asked_for_is_none():
    values, lengths = motion(), [9, 20, 14, 25, 24, 8, 12]
    firsts = [130 + 400 * k for k in range(len(lengths))]
    for first, length in zip(firsts, lengths, strict=True):
        values[first : first + length, 0] = 0.0
    found, other = outliers(values)
    assert other == []
    assert found == [OutlierRun(f, f + n - 1) for f, n in zip(firsts, lengths, strict=True)]
    healed = bridged(values[:, 0], found)
    assert np.max(np.abs(healed - motion()[:, 0])) < 0.05
    assert all(run.last - run.first < 10 for run in outliers(values, asked=(0,))[0])
    # what friction stops stands still as well, and comes to rest by changes that get smaller
    stick = np.maximum(np.sin(30.0 * TIME) - 0.3, 0.0) * np.cos(2.0 * TIME) ** 2
    assert outliers(stick[:, None]) == [[]]


@pytest.mark.parametrize(
    "change",
    [
        lambda v: v,
        lambda v: np.round(v / [0.02, 20.0]) * [0.02, 20.0],  # a coarse converter
        lambda v: v + np.where(TIME > 3.0, 1.0, 0.0)[:, None],  # a step
        lambda v: np.where((TIME > 3.0)[:, None], v, 0.0),  # a start
        np.sign,  # switching
        lambda v: np.clip(v, -0.4, 0.4),  # saturated
    ],
    ids=["clean", "coarse", "step", "start", "switching", "saturated"],
)
def test_what_belongs_to_a_record_is_left_alone(change):
    assert outliers(change(motion())) == [[], []]


def test_the_last_sample_before_a_reversal_of_friction_was_measured():
    rng = np.random.default_rng(4)
    x = np.sin(3.0 * TIME)
    force = 900.0 * x + 60.0 * np.sign(np.cos(3.0 * TIME)) + 2.0 * rng.standard_normal(N)
    assert outliers(np.column_stack([x, force])) == [[], []]
    force[1003] += 500.0
    assert outliers(np.column_stack([x, force])) == [[], [OutlierRun(1003, 1003)]]


def test_what_two_channels_show_at_once_or_one_over_and_over_belongs_to_the_record():
    blow = motion()
    blow[900] += [0.8, -700.0]
    assert outliers(blow) == [[], []]
    impacts = motion()
    impacts[100:2900:60, 1] += 900.0
    assert outliers(impacts) == [[], []]


def test_a_dropout_in_all_channels_at_once_is_one():
    values = motion()
    values[1200:1203] = 0.0
    assert outliers(values) == [[OutlierRun(1200, 1202)], [OutlierRun(1200, 1202)]]


def test_made_up_samples_are_told_and_held_against_no_model():
    case = planted_case(n=2000)
    record = case.identification[0]
    values = {name: samples.copy() for name, samples in record.values.items()}
    values["displacement"][1000] += 5.0 * np.std(values["displacement"])
    values["acceleration"][1400] = np.nan
    spoiled = record_from_arrays("identification", record.time, values)
    assert spoiled.bridged == (1000, 1400)
    assert any("leaves its neighbours at" in note for note in spoiled.notes)
    problem = Problem(case, structure_of(case), (spoiled,))
    still = np.zeros(len(problem.nominal))
    before = float(np.sum(problem.residual((), still) ** 2))
    assert before == pytest.approx(
        float(np.sum(Problem(case, structure_of(case), (record,)).residual((), still) ** 2)), rel=0.05
    )
    # whatever stands there, nothing changes
    (data,) = problem.data
    assert data.compared is not None
    assert np.flatnonzero(data.compared == 0.0).tolist() == [1000, 1400]
