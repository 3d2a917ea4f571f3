"""Time stepping with impulses: the truth of sealed cases with dry friction or impacts.

Moreau's scheme: the midpoint rule for what is smooth, and impulses for friction and stops, chosen at the end of each
step so that the law of dry friction (Coulomb's set-valued sign, with a limit that may depend on state and time) or of
impact (Newton's restitution) holds exactly there. No event is looked for; an event costs one step of accuracy, which
is why steps are short (`substeps` a sample).

This is a second integrator on purpose. The fits have one of their own (`bench.discrepancy.simulation.stick_slip`: Runge-Kutta between
events that are located); a case made with that would forgive its mistakes. Smooth laws go through MuJoCo instead, see
`bench.discrepancy.truth.ground_truth`; the tests hold all three equal.

References:
    J. J. Moreau, Unilateral contact and dry friction in finite freedom dynamics, CISM 302 (1988).
    V. Acary, B. Brogliato, Numerical Methods for Nonsmooth Dynamical Systems, Springer 2008, ch. 10.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.arrays import Array
from bench.discrepancy.truth.moreau_steps import follow_through, march_through
from bench.laws.base import ForceLaw, Kernel


@dataclass(frozen=True)
class MoreauTimeSteppingSettings:
    """Numbers of `bench.discrepancy.truth.moreau_time_stepping`."""

    substeps: int = 200
    """Steps a sample: at 500 Hz 10 µs, which leaves errors of 1e-4 of the motion after hundreds of reversals (tested)."""
    max_rows: int = 16


SETTINGS = MoreauTimeSteppingSettings()


class RigMatrices(NamedTuple):
    """``M q'' + C q' + K q = B u - forces``: (n_dof, n_dof) each, inputs (n_dof, n_loads)."""

    mass: Array
    damping: Array
    stiffness: Array
    inputs: Array


@dataclass(frozen=True)
class Acting:
    """A force law on coordinates of the structure.

    Attributes:
        law: The law; None where a limit alone is given.
        theta: Its parameters (n_theta,).
        rows: (n_coordinates, n_dof); a row times q is a coordinate.
        limit: Limit of set-valued friction, which then replaces the force of the law.
    """

    law: ForceLaw
    theta: Array
    rows: Array
    limit: Kernel | None = None


class Stop(NamedTuple):
    """A rigid stop on one side of a coordinate.

    Attributes:
        row: (n_dof,).
        position: Where it stands.
        side: +1: motion beyond `position` is barred; -1: below it.
        restitution: Velocity after over velocity before an impact.
    """

    row: Array
    position: float
    side: float
    restitution: float


class TrueMotion(NamedTuple):
    """Motion at the samples: position, velocity, acceleration (n, n_dof)."""

    position: Array
    velocity: Array
    acceleration: Array


def march(
    matrices: RigMatrices,
    acting: Sequence[Acting],
    *,
    loads: Array,
    step: float,
    substeps: int = SETTINGS.substeps,
    stop: Stop | None = None,
) -> TrueMotion:
    """Simulate a structure from rest under sampled loads, straight lines between the samples.

    Args:
        matrices: The linear structure.
        acting: Laws and friction limits.
        loads: (n, n_loads).
        step: Time between samples [s].
        substeps: Steps a sample.
        stop: A rigid stop, or None.

    Returns:
        The motion at the samples; positions are NaN from where it diverged.
    """
    n_dof = len(matrices.mass)
    h = step / substeps
    table, theta, z = tabulate(acting)
    rows = np.vstack([a.rows for a in acting]) if acting else np.zeros((0, n_dof))
    implicit = 0.25 * h * h * matrices.stiffness + 0.5 * h * matrices.damping
    effective = np.linalg.inv(matrices.mass + implicit)
    carry = np.zeros((4, n_dof, max(n_dof, loads.shape[1])))
    for i, matrix in enumerate((matrices.mass - implicit, h * matrices.stiffness, h * np.eye(n_dof))):
        carry[i, :, :n_dof] = effective @ matrix
    carry[3, :, : loads.shape[1]] = h * effective @ matrices.inputs
    row_stop = np.zeros(n_dof) if stop is None else np.asarray(stop.row, dtype=float)
    values = np.zeros(3) if stop is None else np.array([stop.position, stop.side, stop.restitution])
    spread = np.ascontiguousarray(effective @ np.vstack([rows, row_stop[None]]).T)
    out = TrueMotion(*(np.zeros((len(loads), n_dof)) for _ in range(3)))
    system = tuple(
        np.ascontiguousarray(m) for m in (np.linalg.inv(matrices.mass), *matrices[1:], carry, spread)
    )
    march_through(
        (0.0, step, substeps), np.ascontiguousarray(loads, dtype=float), system,
        (table, np.ascontiguousarray(rows), theta), (z, z.copy(), np.zeros(len(z))), (row_stop, values),
        (np.zeros((3, SETTINGS.max_rows)), np.zeros(max(len(table), 1))), tuple(out),
    )  # fmt: skip
    return out


def tabulate(acting: Sequence[Acting]) -> tuple[NDArray[np.int64], Array, Array]:
    """Addresses and offsets (n_elements, 8), all parameters one after the other, and initial hidden states."""
    table, theta, states = [], [], []
    row = offset = state = 0
    for a in acting:
        rate = a.law.rate.address if a.law.rate is not None else 0
        force = 0 if a.limit is not None else a.law.force.address
        limit = a.limit.address if a.limit is not None else 0
        table.append([force, rate, limit, len(a.rows), row, offset, state, len(a.law.states)])
        theta.append(np.asarray(a.theta, dtype=float))
        states.append(a.law.start())
        row, offset, state = row + len(a.rows), offset + len(a.theta), state + len(a.law.states)
    return (
        np.array(table, dtype=np.int64).reshape(-1, 8),
        np.concatenate([*theta, [0.0]]),
        np.concatenate([*states, []]),
    )


def follow(acting: Sequence[Acting], *, position: Array, velocity: Array, step: float) -> Array:
    """Force (n,) of laws and friction limits along a given motion (n,), sampled finely."""
    table, theta, z = tabulate(acting)
    rows = np.vstack([a.rows for a in acting]) if acting else np.zeros((0, 1))
    force = np.zeros(len(position))
    work = (np.zeros((3, SETTINGS.max_rows)), np.zeros(max(len(table), 1)))
    follow_through(
        0.0, step, np.ascontiguousarray(position.reshape(-1, 1)), np.ascontiguousarray(velocity.reshape(-1, 1)),
        (table, np.ascontiguousarray(rows), theta), (z, z.copy(), np.zeros(len(z))), work, force,
    )  # fmt: skip
    return force
