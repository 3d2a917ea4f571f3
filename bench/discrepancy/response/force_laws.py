"""The force laws of a hypothesis as the integrator takes them: one table, their parameters end to end, and the fastest rate."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.effects.effect import Scales
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.settings import SimulationSettings
from bench.discrepancy.simulation.equations_of_motion import COLUMNS
from bench.discrepancy.simulation.step_size import rates
from bench.discrepancy.simulation.stick_slip import Elements


class ActingLaw(NamedTuple):
    """A joint effect in a record.

    Attributes:
        placed: The effect.
        eta: Its parameters.
        scales: Magnitudes along its coordinates.
        speeds: Speeds (n,) along its first coordinate, or (1,).
    """

    placed: Placed
    eta: Array
    scales: Scales
    speeds: Array


def assembled(
    acting: Sequence[ActingLaw], record: CaseRecord, n_dof: int, *, settings: SimulationSettings
) -> tuple[Elements, Array]:
    """Force laws as elements, and the fastest rate among them [1/s] at every sample (n,), or (1,) for all samples.

    Args:
        acting: Joint effects.
        record: Record that they act in.
        n_dof: Number of degrees of freedom.
        settings: `SimulationSettings` of the diagnosis.
    """
    rows, theta, table = [], [], []
    n_rows = n_theta = n_states = 0
    fastest = np.zeros(1)
    for placed, eta, scales, speeds in acting:
        effect = placed.effect
        values = effect.values(eta, scales)
        parameters = effect.kernel_theta(eta, scales)
        if effect.of_record is not None:
            parameters = effect.of_record(values, record.name)
        schedule = effect.schedule(values, record) if effect.schedule else np.zeros(0)
        states = len(effect.law.states) if effect.law is not None else 0
        table.append(
            [
                *effect.addresses, effect.n_coordinates, n_rows, n_theta, n_states, states,
                1 + n_theta + len(parameters) if effect.schedule else 0,
            ]
        )  # fmt: skip
        fastest = np.maximum(fastest, rates(effect, values, scales, speeds, settings=settings))
        rows.append(placed.place.rows)
        theta += [parameters, schedule]
        n_rows += effect.n_coordinates
        n_theta += len(parameters) + len(schedule)
        n_states += states
    return (
        Elements(
            np.array(table, dtype=np.int64).reshape(-1, COLUMNS),
            np.vstack(rows) if rows else np.zeros((0, n_dof)),
            np.concatenate([*theta, [0.0]]),
            np.zeros(n_states),
        ),
        fastest,
    )
