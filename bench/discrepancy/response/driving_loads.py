"""What drives a free run: the loads of a record as the integrator takes them.

Loads are read between their samples as the case says (`acquisition.upsampled`), behind the actuator effects of a hypothesis, and
a periodic record is run in from rest over whole periods first.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.case.acquisition import upsampled
from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.settings import ResponseSettings
from bench.discrepancy.simulation.stick_slip import LinearStructure

if TYPE_CHECKING:
    from bench.discrepancy.likelihood.problem import Problem
    from bench.discrepancy.model.placement import Hypothesis

Array = NDArray[np.float64]


def run_in(linear: LinearStructure, length: int, step: float, *, settings: ResponseSettings) -> int:
    """Samples of run-in from rest, in whole periods, after which a linear structure is in its steady state.

    Args:
        linear: The structure.
        length: Samples of a period, or of several.
        step: Time between samples [s].
        settings: `ResponseSettings` of the diagnosis.
    """
    n_dof = len(linear.mass)
    lower = -np.linalg.solve(linear.mass, np.hstack([linear.stiffness, linear.damping]))
    companion = np.vstack([np.hstack([np.zeros((n_dof, n_dof)), np.eye(n_dof)]), lower])
    decay = max(-float(np.linalg.eigvals(companion).real.max()), 1e-12)
    return length * int(
        np.clip(np.ceil(settings.forgotten / (decay * step * length)), 1, settings.max_periods)
    )


def driving_loads(
    problem: Problem, effects: tuple[Hypothesis, list[Array]], record: CaseRecord, substeps: int
) -> tuple[Array, int]:
    """Loads as `stick_slip.free_run` takes them, and their rows a sample; run-in and actuator effects included.

    Args:
        problem: Structure and case; loads without actuator effects are kept in it.
        effects: Hypothesis and the etas of its effects.
        record: Record whose loads they are.
        substeps: Integration steps a sample; band-limited loads are given at the start, middle and end of each.
    """
    settings = problem.settings.response
    acting = [
        (placed, placed.effect.signal, eta)
        for placed, eta in sorted(
            zip(*effects, strict=True), key=lambda entry: entry[0].effect.between_samples
        )
        if placed.effect.site == "actuator" and placed.effect.signal is not None
    ]
    lead = problem.lead_in(record)
    # a proposed test may bear the name of a record, but be no period of anything
    cache, key = problem.__dict__.setdefault("_loads", {}), (record.name, len(record), lead, substeps)
    if not acting and key in cache:
        return cache[key]
    loads = np.column_stack([record.values[name] for name in problem.structure.loads])
    loads = np.vstack([loads] * (1 + lead // len(record)))
    interpolation = problem.case.load_interpolation
    rows = 0 if interpolation == "zero_order_hold" else 1
    for placed, signal, eta in acting:
        j = problem.structure.loads.index(placed.target)
        values = placed.effect.values(eta, problem.scales_of(placed))
        if placed.effect.between_samples and interpolation == "linear" and rows == 1:
            loads, rows = upsampled(loads, settings.corners), settings.corners
        loads[:, j] = signal(loads[:, j], values, record.step / max(rows, 1))
    driving = (loads, rows)
    if interpolation == "band_limited":
        fine = upsampled(loads, 2 * substeps, interpolation=interpolation, periodic=record.periodic)
        driving = (fine, 2 * substeps)
    if not acting:
        cache[key] = driving
    return driving


def with_load_noise(problem: Problem, record: CaseRecord, rng: np.random.Generator) -> CaseRecord:
    """A record with one more draw of the stated noise on its loads."""
    noisy = {
        name: record.values[name] + level * rng.standard_normal(len(record))
        for name, level in zip(problem.structure.loads, problem.load_noise_of(record), strict=True)
    }
    return replace(record, values={**record.values, **noisy})


def fewest_steps(problem: Problem) -> int:
    """Fewest steps a sample at which the integration stays below the noise; one where loads are read as straight lines.

    Straight lines between samples are themselves only as good as the step rule; a load that is known between its samples
    deserves an integration that is not worse.

    Args:
        problem: Records and nominal model, whose response to the first record is tried.
    """
    settings = problem.settings
    if problem.case.load_interpolation == "linear" or problem.driven:
        return 1
    zero, steps = np.zeros(len(problem.nominal)), 1
    coarse = replace(problem, substeps=steps).simulate((), zero, problem.records[0])
    while steps < settings.simulation.max_substeps:
        fine = replace(problem, substeps=2 * steps).simulate((), zero, problem.records[0])
        error = np.sqrt(np.mean((fine - coarse) ** 2, axis=0))
        enough = np.maximum(
            settings.response.integration * problem.noise, settings.response.exact * np.std(fine, axis=0)
        )
        if not np.isfinite(error).all() or np.all(error < enough):
            break
        steps, coarse = 2 * steps, fine
    return steps
