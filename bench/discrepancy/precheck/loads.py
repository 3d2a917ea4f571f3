"""Faults of loads that show against the motion: a shift in time, a magnitude in the place of a force."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.precheck.information import parameter_columns
from bench.discrepancy.precheck.settings import CheckSettings


@dataclass(frozen=True)
class LoadsSettings:
    """Numbers of `bench.discrepancy.precheck.loads`."""

    shifts: int = 60
    """Largest shift that is looked for, in samples."""


SETTINGS = LoadsSettings()


def load_doubts(problem: Problem, settings: CheckSettings) -> Iterator[str]:
    """What is wrong with the loads, a sentence each.

    Args:
        problem: Records and nominal model.
        settings: When something counts.
    """
    if problem.driven:
        return
    for record in problem.records:
        yield from _unsigned(problem, record, settings)
        yield from _late(problem, record, settings)


def _unsigned(problem: Problem, record: CaseRecord, settings: CheckSettings) -> Iterator[str]:
    """A load of one sign, where the motion asks for one of both: an unsigned current, a magnitude."""
    linear = problem.structure.at(problem.nominal)
    motion = problem.motion_of(record)
    implied = (
        motion.acceleration @ linear.mass.T
        + motion.velocity @ linear.damping.T
        + motion.position @ linear.stiffness.T
    )
    for j, name in enumerate(problem.structure.loads):
        load = np.asarray(record.values[name])
        need = (
            implied @ problem.structure.inputs[:, j] if problem.structure.inputs.ndim == 2 else implied[:, 0]
        )
        if is_magnitude(load, np.asarray(need, dtype=np.float64), settings):
            yield (
                f"'{name}' in '{record.name}' never changes its sign, while the motion asks for a load of both: it looks like a magnitude "
                "(an unsigned current?); give it the sign of its command"
            )


def is_magnitude(load: Array, need: Array, settings: CheckSettings) -> bool:
    """Whether an input (n,) of one sign goes with the magnitude of what the motion asks for (n,), and not with that itself."""
    acting = load[np.abs(load) > 1e-3 * np.abs(load).max(initial=0.0)]
    if (
        len(acting) < 0.2 * len(load)
        or max(np.mean(acting > 0.0), np.mean(acting < 0.0)) < settings.one_sided
        or min(np.std(need), np.std(load)) == 0.0
    ):
        return False
    plain, folded = (float(np.corrcoef(load, x)[0, 1]) ** 2 for x in (need, np.abs(need)))
    return 1.0 - plain > settings.unsigned and 1.0 - folded < settings.magnitude * (1.0 - plain)


def _late(problem: Problem, record: CaseRecord, settings: CheckSettings) -> Iterator[str]:
    """A shift in time between loads and all responses that explains most of what the nominal parameters leave."""
    if not record.at_rest or problem.windowed:
        return
    names = problem.structure.channels
    measured = np.column_stack([record.values[name] for name in names])
    predicted = problem.simulate((), np.zeros(len(problem.nominal)), record)
    scale = np.maximum(measured.std(axis=0), 1e-300)
    columns = [column / scale for column in parameter_columns(problem, record, predicted)]
    basis = None
    if columns:
        basis, _ = np.linalg.qr(np.column_stack([column.ravel() for column in columns]))
    powers = {}
    for shift in range(-SETTINGS.shifts, SETTINGS.shifts + 1):
        left = (np.roll(measured, -shift, axis=0) - predicted) / scale
        left[: SETTINGS.shifts + 1] = left[-SETTINGS.shifts - 1 :] = 0.0
        flat = left.ravel()
        powers[shift] = float(flat @ flat - (np.sum((basis.T @ flat) ** 2) if basis is not None else 0.0))
    best = min(powers, key=lambda s: powers[s])
    if abs(best) > 1 and powers[best] < settings.shift * powers[0] and powers[0] > 1e-4 * measured.size:
        verb = "lag" if best > 0 else "lead"
        role = problem.case.channel(problem.structure.loads[0]).role
        advice = (
            "a command acts late, which the diagnosis can name (actuator_delay)"
            if role == "command"
            else "align it, or give the load the role command if it was only asked for"
        )
        yield (
            f"all responses {verb} the load by {1e3 * abs(best) * record.step:.3g} ms in '{record.name}': {advice}"
        )
