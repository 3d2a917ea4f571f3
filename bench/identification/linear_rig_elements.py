"""What the compiled loop takes from a rig: its elements as a table, and the columns of its sensors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array
from bench.errors import UnknownNameError
from bench.identification.linear_probe import Matrices
from bench.identification.record_equations import COLUMNS
from bench.rig import Rig


def channel_columns(rig: Rig, channels: Sequence[str]) -> list[int]:
    """Columns of MuJoCo's `sensordata` behind channels of a rig's records.

    Raises:
        UnknownNameError: No sensor of the rig has that name.
    """
    first = len(rig.actuators)
    names = [channel.name for channel in rig.channels[first : first + rig.model.nsensordata]]
    for name in channels:
        if name not in names:
            raise UnknownNameError(f"sensor of rig '{rig.name}'", name, names)
    return [names.index(name) for name in channels]


def element_table(
    rig: Rig,
) -> tuple[Array, NDArray[np.int64], NDArray[np.int64], Array, Array, dict[int, int]]:
    """Coordinates, table, parameters and hidden states of all elements; place of each theta by address in the model."""
    nv = rig.model.nv
    rows: list[Array] = []
    row_inputs: list[int] = []
    table: list[list[int]] = []
    theta: list[float] = []
    states: list[float] = []
    offsets: dict[int, int] = {}
    for item in rig.built.placed:
        law = item.element.law
        rate = law.rate.address if law.rate is not None else 0
        table.append([law.force.address, rate, law.n_coordinates, len(rows), len(theta), len(states)])
        for coordinate in item.coordinates:
            row = np.zeros(nv)
            if not coordinate.is_input:
                for _, dof, coefficient in coordinate.terms:
                    row[dof] += coefficient
            rows.append(row)
            row_inputs.append(coordinate.terms[0][0] if coordinate.is_input else -1)
        offsets |= {item.theta + i: len(theta) + i for i in range(len(item.element.theta))}
        theta += item.element.theta.tolist()
        states += law.start().tolist()
    return (
        np.array(rows).reshape(len(rows), nv),
        np.array(row_inputs, dtype=np.int64),
        np.array(table, dtype=np.int64).reshape(len(table), COLUMNS),
        np.array([*theta, 0.0]),
        np.array(states),
        offsets,
    )


def reached_coordinates(
    base: Matrices,
    slopes: Sequence[Matrices | None],
    elements: tuple[Array, NDArray[np.int64]],
    sensors: Array,
    nv: int,
) -> NDArray[np.int64]:
    """Degrees of freedom that the channels depend on, directly or through couplings."""
    coupled = np.zeros((nv, nv), dtype=bool)
    for part in (base, *(slope for slope in slopes if slope is not None)):
        for matrix in part[:3]:
            coupled |= np.abs(matrix) > 1e-13 * np.max(np.abs(matrix), initial=0.0)
    rows, table = elements
    for _, _, count, first, _, _ in table.tolist():  # a law couples all of its coordinates
        touched = np.any(rows[first : first + count] != 0.0, axis=0)
        coupled |= np.outer(touched, touched)
    reached = np.any(sensors[:, : 3 * nv].reshape(len(sensors), 3, nv) != 0.0, axis=(0, 1))
    while True:
        wider = reached | coupled[:, reached].any(axis=1)
        if np.array_equal(wider, reached):
            return np.flatnonzero(reached)
        reached = wider
