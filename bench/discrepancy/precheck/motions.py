"""Faults between channels of one motion, and of their size: channels that do not tell the same motion, responses far beyond the model's."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bench.discrepancy.checks.channel_comparison import compare_channels
from bench.discrepancy.checks.scales import parallel
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.precheck.settings import CheckSettings


def motion_doubts(problem: Problem, settings: CheckSettings) -> Iterator[str]:
    """What is wrong between channels, a sentence each.

    Args:
        problem: Records and nominal model.
        settings: When something counts.
    """
    observers = problem.structure.observers
    for i, first in enumerate(observers):
        for j in range(i + 1, len(observers)):
            second = observers[j]
            if first.order == second.order or not np.isclose(abs(parallel(first.row, second.row)), 1.0):
                continue
            for record in problem.records:
                pair = compare_channels(
                    record.values[first.channel],
                    record.values[second.channel],
                    orders=(first.order, second.order),
                    noise=(float(problem.noise[i]), float(problem.noise[j])),
                    step=record.step,
                )
                if pair is not None and abs(pair.correlation) < settings.one_motion:
                    yield (
                        f"'{first.channel}' and '{second.channel}' in '{record.name}' do not tell one motion (correlation "
                        f"{pair.correlation:.2f} where both are strong): clocks that run apart, samples that one of them lost, or another "
                        "column"
                    )
    if not problem.driven:
        yield from _far_off(problem, settings)


def _far_off(problem: Problem, settings: CheckSettings) -> Iterator[str]:
    """Responses that are all many times what the model predicts, or a small part of it."""
    for record in problem.records:
        predicted = problem.simulate((), np.zeros(len(problem.nominal)), record)
        measured = np.column_stack([record.values[name] for name in problem.structure.channels])
        sizes = measured.std(axis=0), predicted.std(axis=0)
        if min(sizes[1]) <= 0.0 or not np.isfinite(sizes[1]).all():
            continue
        ratios = sizes[0] / sizes[1]
        low, high = float(ratios.min()), float(ratios.max())
        if low > settings.far_off or (
            high < 1.0 / settings.far_off and np.any(sizes[0] > 2.0 * problem.noise)
        ):
            yield (
                f"all responses in '{record.name}' are {low:.3g} to {high:.3g} times what the model makes of the loads: the load is in "
                "another unit, or is something else (a current, a torque before the gear)"
            )
