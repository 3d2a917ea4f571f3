"""What a free run changes by: the nominal parameters, the parameters of its effects, and effects of actuators and sensors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bench.discrepancy.likelihood.problem import Array, Problem
from bench.discrepancy.model.placement import Hypothesis, Placed
from bench.discrepancy.numerics.threads import in_threads
from bench.discrepancy.screening.linear_amplitudes import (
    GridPoint,
)


def simulated_columns(problem: Problem, hypothesis: Hypothesis, vector: Array, residual: Array) -> Array:
    """Responses (n, k) of a free run to the nominal parameters and to the free ones of its effects.

    Args:
        problem: Records and nominal model.
        hypothesis: Effects.
        vector: See `Simulator.simulate`.
        residual: (n,) whitened, of that run.
    """
    _, std, _, high = problem.prior(hypothesis)
    shapes = [p.fixed for placed in hypothesis for p in placed.effect.parameters]
    held = [False] * len(problem.nominal) + shapes
    near = problem.residual_near(hypothesis, vector)

    def column(entry: int) -> Array:
        """Response (n,) to one entry; zero where a step either way lets the run diverge."""
        step = problem.settings.screening.run_step * std[entry]
        for change in (step, -step):
            moved = vector.copy()
            moved[entry] += change
            if moved[entry] > high[entry]:
                continue
            away = near(moved)
            if away.shape == residual.shape:
                return np.asarray((residual - away) / change, dtype=np.float64)
        return np.zeros_like(residual)

    return np.column_stack(in_threads(column, np.flatnonzero(~np.array(held)).tolist()))


def signal_nodes(
    problem: Problem, signals: Sequence[Placed], hypothesis: Hypothesis, vector: Array
) -> list[GridPoint]:
    """Changes that actuator and sensor effects make to the simulated channels of a base.

    Args:
        problem: Records and nominal model.
        signals: The effects.
        hypothesis: Effects of the base.
        vector: See `Simulator.simulate`.
    """
    own = {placed.key for placed in hypothesis}
    base, near = problem.residual(hypothesis, vector), problem.residual_near(hypothesis, vector)

    def node(task: tuple[Placed, Array]) -> GridPoint | None:
        placed, eta = task
        point = eta.copy()
        if placed.effect.parameters[0].signed:
            point[0] = problem.settings.screening.signal_step
        changed = near(np.concatenate([vector, point]), placed)
        if changed.shape != base.shape or not np.any(changed != base):
            return None
        column = (base - changed)[:, None]
        return GridPoint(placed, point, column, column.T @ column)

    tasks = [(p, eta) for p in signals if p.key not in own for eta in p.effect.grid()]
    return [found for found in in_threads(node, tasks) if found is not None]
