"""Rigs of linear structure as one compiled loop, twenty to fifty times faster than MuJoCo and equal to it up to rounding.

Many rigs, all of the bench's own among them, are nonlinear in their elements only: constant mass matrix, linear mounts,
sensors that are linear in the motion. For these a record needs no multibody engine. `LinearRig` reads the matrices off
the compiled MuJoCo model, by asking it for the acceleration under unit positions, velocities and commands, and holds them
against the model at random states; a rig that is not linear is refused, never approximated. Its masses, stiffnesses and
dampings may be free: the matrices are affine in them.

MuJoCo stays the reference and does everything else. Output-error fits, which want thousands of records of the same
rig, and records to a stated accuracy are what this is for.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.arrays import Array
from bench.errors import ModelError, ParameterError, UnknownNameError
from bench.identification.linear_probe import (
    Matrices,
    Probe,
    matrices_at,
    refuse_nonlinear,
    rows_and_columns,
    slope_of,
)
from bench.identification.linear_rig_elements import channel_columns, element_table, reached_coordinates
from bench.identification.parameter_address import address
from bench.identification.record_batch import run_records
from bench.identification.record_loop import Sparse, run, work_size
from bench.rig import Rig


def current(rig: Rig, name: str) -> float:
    """Value of a free parameter in a rig; raises as `address`."""
    return address(rig, name).value(rig.model)


@dataclass(frozen=True, eq=False)
class LinearRig:
    """A rig of linear structure with its elements, compiled to a loop over whole records.

    Attributes:
        rig: The rig.
        channels: Sensors simulated, in order.
        parameters: Free parameters, in order (see `address` for the names).
    """

    rig: Rig
    channels: tuple[str, ...]
    parameters: tuple[str, ...]
    _base: Matrices
    _slopes: tuple[Matrices | None, ...]  # by a unit of each parameter; None where it belongs to an element
    _places: tuple[int, ...]  # of each parameter in the vector of all thetas; -1 for structure
    _start: Array
    _observe: Array
    _kept: NDArray[np.int64]  # degrees of freedom that channels depend on
    _coordinates: Array  # coordinates of the elements (n_rows, n_dof), and the same sparse
    _rows: Sparse
    _row_inputs: NDArray[np.int64]
    _table: NDArray[np.int64]
    _theta: Array
    _states: Array

    @classmethod
    def of(cls, rig: Rig, channels: Sequence[str], parameters: Sequence[str] = ()) -> LinearRig:
        """Compile a rig.

        Args:
            rig: The rig.
            channels: Names of sensor channels.
            parameters: Names of free parameters, see `address`.

        Raises:
            ModelError: The rig is not of linear structure, or does not use RK4; the message says why.
            UnknownNameError: No such channel or parameter.
        """
        addresses = [address(rig, name) for name in parameters]
        columns = channel_columns(rig, channels)
        bare = rig.with_(elements=()).model
        refuse_nonlinear(rig, bare)
        structural = [entry.field != "numeric_data" for entry in addresses]
        start = np.array([entry.value(rig.model) for entry in addresses])
        base = Probe(bare).matrices()
        slopes = tuple(
            slope_of(bare, base, entry, value) if free else None
            for entry, value, free in zip(addresses, start, structural, strict=True)
        )
        sensors = Probe(bare).sensors(base)[columns]
        for factor in (1.0, 1.3):
            at, moved = matrices_at(bare, base, addresses, start, slopes, factor)
            # of the places probed only: the verdict must not vary from call to call
            difference = Probe(moved).difference(at, sensors, columns, np.random.default_rng(0))
            if difference:
                raise ModelError(
                    f"rig '{rig.name}' is not of linear structure: {difference}; simulate it with MuJoCo"
                )
        rows, row_inputs, table, theta, states, offsets = element_table(rig)
        kept = reached_coordinates(base, slopes, (rows, table), sensors, rig.model.nv)
        nv = rig.model.nv
        observed = np.concatenate([kept, nv + kept, 2 * nv + kept, np.arange(3 * nv, sensors.shape[1])])
        return cls(
            rig,
            tuple(channels),
            tuple(parameters),
            rows_and_columns(base, kept),
            tuple(None if slope is None else rows_and_columns(slope, kept) for slope in slopes),
            tuple(
                -1 if free else offsets[entry.index]
                for entry, free in zip(addresses, structural, strict=True)
            ),
            start,
            np.ascontiguousarray(sensors[:, observed]),
            kept,
            rows[:, kept],
            Sparse.of(rows[:, kept]),
            row_inputs,
            table,
            theta,
            states,
        )

    @property
    def dofs(self) -> NDArray[np.int64]:
        """Degrees of freedom of the model that the channels depend on (n_dof,)."""
        return self._kept

    @property
    def observation(self) -> Array:
        """Channels as a map of position, velocity and acceleration of `dofs`, commands and 1: (n_channels, 3 n_dof + n_u + 1)."""
        return self._observe

    @property
    def matrices(self) -> tuple[Array, Array, Array, Array]:
        """Mass, damping, stiffness (n_dof, n_dof) and input (n_dof, n_u + 1; the last column constant) at the rig's own values."""
        return self._base.mass, self._base.damping, self._base.stiffness, self._base.inputs

    def slope(self, parameter: str) -> tuple[Array, Array, Array]:
        """Change of mass, damping and stiffness with a unit of a structural parameter, in which they are affine."""
        change = self._slopes[self.parameters.index(parameter)]
        if change is None:
            raise ParameterError(f"'{parameter}' belongs to an element; a structural parameter is expected")
        return change.mass, change.damping, change.stiffness

    def simulate(
        self,
        controls: ArrayLike,
        values: ArrayLike | None = None,
        *,
        initial: Mapping[str, tuple[float, float]] | None = None,
        stride: int = 1,
        tolerance: float = 0.0,
        sizes: Mapping[str, tuple[float, float]] | None = None,
        start_time: float = 0.0,
    ) -> Array:
        """Simulate one record; releases the GIL, so that threads run records in parallel.

        Args:
            controls: Commands of the rig's actuators, one row a step ``(n_steps, n_actuators)``
                (`bench.rig.controls_of`), each held over the step.
            values: Free parameters ``(n_parameters,)``; those of the rig where None.
            initial: (position, velocity) by joint at the start; at rest where not given.
            stride: Steps a sample.
            tolerance: Local error relative to the peak of each state so far, by Dormand-Prince steps; 0 for MuJoCo's own
                Runge-Kutta step.
            sizes: (position, velocity) by joint that these peaks are taken to be at least, where they are known about: a
                state that is still at rest is else followed to a part in 1 / `tolerance` of next to nothing.
            start_time: Time of the first sample [s].

        Returns:
            The channels at the start of each sample ``(n_samples, n_channels)``; not finite from where it diverged.

        Raises:
            ParameterError: Shapes do not fit, or a setting is out of range.
            UnknownNameError: No such joint.
        """
        commands, theta, solved = self._prepared(controls, values, stride, tolerance)
        state, least = self._from(initial), self._least(sizes)
        n_dof, n = len(self._kept), len(least)
        out = np.empty((-(-len(commands) // stride), len(self.channels)))
        run(
            n_dof, n, self.rig.timestep, start_time, tolerance, stride, commands, *solved[:2], self._table,
            self._rows, self._row_inputs, solved[2], theta, self._observed, state, least,
            np.zeros(work_size(n, n_dof)), out,
        )  # fmt: skip
        return out

    def simulate_batch(
        self,
        controls: ArrayLike,
        values: ArrayLike | None = None,
        *,
        initials: Sequence[Mapping[str, tuple[float, float]]],
        stride: int = 1,
        tolerance: float = 0.0,
        sizes: Mapping[str, tuple[float, float]] | None = None,
        start_time: float = 0.0,
        threads: int | None = None,
    ) -> Array:
        """Simulate records of the same commands from many starts, over threads; to the last bit those of `simulate`.

        Args:
            controls: As for `simulate`, as all that follows is but for `initials`.
            values: Free parameters.
            initials: (position, velocity) by joint at the start, one mapping a record.
            stride: Steps a sample.
            tolerance: Local error.
            sizes: Least peaks.
            start_time: Time of the first sample [s].
            threads: Threads; all cores by default.

        Returns:
            ``(n_records, n_samples, n_channels)``.

        Raises:
            ParameterError: Shapes do not fit, or a setting is out of range.
            UnknownNameError: No such joint.
        """
        commands, theta, solved = self._prepared(controls, values, stride, tolerance)
        count, least = len(initials), self._least(sizes)
        if not count:
            raise ParameterError("no initial states came; one a record is expected ({} for rest)")
        states = np.stack([self._from(initial) for initial in initials])
        constants = (len(self._kept), len(least), self.rig.timestep, start_time, float(tolerance), stride)
        elements = (self._table, self._rows, self._row_inputs, theta)
        out = np.empty((count, -(-len(commands) // stride), len(self.channels)))

        def share(first: int, last: int) -> None:
            run_records(
                first, last, constants, commands, solved, elements, self._observed, states, least,
                work_size(len(least), len(self._kept)), out,
            )  # fmt: skip

        workers = min(threads or os.cpu_count() or 1, count)
        # records differ in effort: some shares a thread, so that none waits long for the last one
        edges = np.linspace(0, count, min(4 * workers, count) + 1).astype(int)
        with ThreadPoolExecutor(workers) as pool:
            list(pool.map(share, edges[:-1], edges[1:]))
        return out

    def _prepared(
        self, controls: ArrayLike, values: ArrayLike | None, stride: int, tolerance: float
    ) -> tuple[Array, Array, tuple[Sparse, Array, Sparse]]:
        """Commands with the constant 1, parameters of the elements, and the structure solved for accelerations."""
        commands = np.asarray(controls, dtype=float)
        vector = self._start if values is None else np.asarray(values, dtype=float)
        if commands.ndim != 2 or commands.shape[1] != len(self.rig.actuators):
            raise ParameterError(
                f"controls have shape {commands.shape}; (n_steps, {len(self.rig.actuators)}) is expected"
            )
        if vector.shape != self._start.shape or stride < 1 or not 0.0 <= tolerance < 1.0:
            raise ParameterError(
                f"values of shape {vector.shape}, stride {stride} and tolerance {tolerance} came; shape {self._start.shape}, "
                "a stride of at least 1 and a tolerance in [0, 1) are expected"
            )
        at, theta, solved = self._base, self._theta, self._own
        if values is not None:
            theta = theta.copy()
            for value, start, slope, place in zip(
                vector, self._start, self._slopes, self._places, strict=True
            ):
                if slope is not None:
                    at = at.plus(slope, value - start)
                else:
                    theta[place] = value
            solved = self._own if at is self._base else self._solved(at)
        columns = np.empty((len(commands), commands.shape[1] + 1))
        columns[:, :-1], columns[:, -1] = commands, 1.0
        return columns, theta, solved

    def _from(self, initial: Mapping[str, tuple[float, float]] | None) -> Array:
        """State at the start, zeros behind it: the loop takes four states at a time."""
        motion, n = 2 * len(self._kept), len(self._states)
        state = np.zeros(motion + n + 3)
        state[:motion] = self._motion(initial, self._rest)
        state[motion : motion + n] = self._states
        return state

    def _least(self, sizes: Mapping[str, tuple[float, float]] | None) -> Array:
        """Least peaks of all states."""
        motion = self._motion(sizes, np.zeros(len(self._kept)))
        return np.concatenate([motion, np.zeros(len(self._states))])

    @cached_property
    def _rest(self) -> Array:
        return self.rig.model.qpos0[self._kept]

    @cached_property
    def _observed(self) -> Sparse:
        return Sparse.of(self._observe)

    @cached_property
    def _own(self) -> tuple[Sparse, Array, Sparse]:
        return self._solved(self._base)

    def _solved(self, at: Matrices) -> tuple[Sparse, Array, Sparse]:
        """``M^-1 [K, C]``, ``M^-1 B`` and ``(M^-1 R')'``."""
        solved = np.linalg.solve(
            at.mass, np.hstack([at.stiffness, at.damping, at.inputs, self._coordinates.T])
        )
        split = np.cumsum([2 * len(self._kept), at.inputs.shape[1]])
        system, inputs, spread = np.split(solved, split, axis=1)
        return (
            Sparse.of(np.asarray(system, np.float64)),
            np.ascontiguousarray(inputs, np.float64),
            Sparse.of(np.asarray(spread.T, np.float64)),
        )

    @cached_property
    def _joints(self) -> dict[str, int]:
        """Place among `dofs` of every joint; -1 of those that no channel depends on."""
        model, kept = self.rig.model, self._kept.tolist()
        dofs = {model.joint(i).name: int(model.jnt_dofadr[i]) for i in range(model.njnt)}
        return {name: kept.index(dof) if dof in kept else -1 for name, dof in dofs.items()}

    def _motion(self, given: Mapping[str, tuple[float, float]] | None, positions: Array) -> Array:
        """Positions and velocities (2 n_dof,), those of joints that are not given at `positions` and at rest."""
        n_dof = len(self._kept)
        # a list: writing single numbers into an array takes longer
        motion = [*positions.tolist(), *[0.0] * n_dof]
        for name, (position, velocity) in (given or {}).items():
            if name not in self._joints:
                raise UnknownNameError("joint", name, list(self._joints))
            place = self._joints[name]
            if place >= 0:
                motion[place], motion[n_dof + place] = position, velocity
        return np.array(motion)
