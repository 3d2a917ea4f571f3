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

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.errors import ModelError, ParameterError, UnknownNameError
from bench.identification.parameter_address import Address, address
from bench.identification.record_loop import COLUMNS, Sparse, run, work_size
from bench.rig import Rig

Array = NDArray[np.float64]

_AGREEMENT = (
    1e-9  # of the largest term: unit probing is exact to some 1e-15, a nonlinearity worth the name far above
)


def current(rig: Rig, name: str) -> float:
    """Value of a free parameter in a rig; raises as `address`."""
    return _value(rig.model, address(rig, name))


class _Matrices(NamedTuple):
    mass: Array  # (n_dof, n_dof)
    stiffness: Array  # (n_dof, n_dof)
    damping: Array  # (n_dof, n_dof)
    inputs: Array  # (n_dof, n_inputs + 1), the last column constant

    def plus(self, other: _Matrices, factor: float) -> _Matrices:
        return _Matrices(*(a + factor * b for a, b in zip(self, other, strict=True)))


class _Probe:
    """A MuJoCo model without elements, asked for its matrices."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self.model = model
        self.data = mujoco.MjData(model)

    def force(self, q: Array, v: Array, u: Array, applied: Array | None = None) -> tuple[Array, Array, Array]:
        """``M q''`` without the applied force, the mass matrix, and the sensors."""
        model, data = self.model, self.data
        mujoco.mj_resetData(model, data)
        data.qpos[:], data.qvel[:], data.ctrl[:] = q, v, u
        if applied is not None:
            data.qfrc_applied[:] = applied
        mujoco.mj_forward(model, data)
        mass = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, mass)
        return mass @ data.qacc - (0.0 if applied is None else applied), mass, data.sensordata.copy()

    def matrices(self) -> _Matrices:
        nv, nu = self.model.nv, self.model.nu
        zero, still, eye = np.zeros(nv), np.zeros(nu), np.eye(nv)
        rest, mass, _ = self.force(zero, zero, still)
        stiffness = np.stack([rest - self.force(row, zero, still)[0] for row in eye], axis=1)
        damping = np.stack([rest - self.force(zero, row, still)[0] for row in eye], axis=1)
        columns = [self.force(zero, zero, row)[0] - rest for row in np.eye(nu)]
        return _Matrices(mass, stiffness, damping, np.stack([*columns, rest], axis=1))

    def sensors(self, at: _Matrices) -> Array:
        """Sensors as a map of position, velocity, acceleration, commands and 1: ``(n, 3 nv + nu + 1)``."""
        nv, nu = self.model.nv, self.model.nu
        zero, still = np.zeros(nv), np.zeros(nu)

        def held(q: Array, v: Array, u: Array, a: Array) -> Array:
            needed = at.mass @ a + at.stiffness @ q + at.damping @ v - at.inputs @ np.append(u, 1.0)
            return self.force(q, v, u, needed)[2]

        rest = held(zero, zero, still, zero)
        columns = [held(row, zero, still, zero) - rest for row in np.eye(nv)]
        columns += [held(zero, row, still, zero) - rest for row in np.eye(nv)]
        columns += [held(zero, zero, still, row) - rest for row in np.eye(nv)]
        columns += [held(zero, zero, row, zero) - rest for row in np.eye(nu)]
        found = np.stack([*columns, rest], axis=1)
        largest = np.max(np.abs(found), axis=1, initial=0.0, keepdims=True)
        return np.where(np.abs(found) > 1e-12 * largest, found, 0.0)

    def difference(
        self, at: _Matrices, sensors: Array, columns: Sequence[int], rng: np.random.Generator
    ) -> str:
        """What of the model the matrices, and the map of some sensors, miss at random states; empty for nothing."""
        nv, nu = self.model.nv, self.model.nu
        for scale in (1.0, 1e-2):  # a stop or a backlash shows at one of them
            q, v, u = (scale * rng.standard_normal(size) for size in (nv, nv, nu))
            force, mass, measured = self.force(q, v, u)
            one = np.append(u, 1.0)
            terms = (at.inputs @ one, -at.stiffness @ q, -at.damping @ v)
            size = max(float(np.max(np.abs(term), initial=1e-12)) for term in terms)
            if np.max(np.abs(mass - at.mass)) > _AGREEMENT * np.max(np.abs(at.mass)):
                return "its mass matrix depends on the position"
            if np.max(np.abs(sum(terms) - force)) > _AGREEMENT * size:
                return "its forces are not linear in position, velocity and command"
            acceleration = np.linalg.solve(mass, force)
            parts = sensors * np.concatenate([q, v, acceleration, one])
            sizes = np.max(np.abs(parts), axis=1, initial=1e-12)
            if np.any(np.abs(parts.sum(axis=1) - measured[columns]) > _AGREEMENT * sizes):
                return "a channel is not linear in the motion"
        return ""


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
    _base: _Matrices
    _slopes: tuple[_Matrices | None, ...]  # by a unit of each parameter; None where it belongs to an element
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
        columns = sensor_columns(rig, channels)
        bare = rig.with_(elements=()).model
        _refuse(rig, bare)
        structural = [entry.field != "numeric_data" for entry in addresses]
        start = np.array([_value(rig.model, entry) for entry in addresses])
        base = _Probe(bare).matrices()
        slopes = tuple(
            _slope(bare, base, entry, value) if free else None
            for entry, value, free in zip(addresses, start, structural, strict=True)
        )
        sensors = _Probe(bare).sensors(base)[columns]
        for factor in (1.0, 1.3):
            at, moved = _at(bare, base, addresses, start, slopes, factor)
            # of the places probed only: the verdict must not vary from call to call
            difference = _Probe(moved).difference(at, sensors, columns, np.random.default_rng(0))
            if difference:
                raise ModelError(
                    f"rig '{rig.name}' is not of linear structure: {difference}; simulate it with MuJoCo"
                )
        rows, row_inputs, table, theta, states, offsets = _elements(rig)
        kept = _reached(base, slopes, (rows, table), sensors, rig.model.nv)
        nv = rig.model.nv
        observed = np.concatenate([kept, nv + kept, 2 * nv + kept, np.arange(3 * nv, sensors.shape[1])])
        return cls(
            rig,
            tuple(channels),
            tuple(parameters),
            _cut(base, kept),
            tuple(None if slope is None else _cut(slope, kept) for slope in slopes),
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
        n_dof = len(self._kept)
        columns = np.empty((len(commands), commands.shape[1] + 1))
        columns[:, :-1], columns[:, -1] = commands, 1.0
        n = 2 * n_dof + len(self._states)
        state, least = np.zeros(n + 3), np.zeros(n)  # the loop takes four states at a time
        state[: 2 * n_dof] = self._motion(initial, self.rig.model.qpos0[self._kept])
        state[2 * n_dof : n] = self._states
        least[: 2 * n_dof] = self._motion(sizes, np.zeros(n_dof))
        out = np.empty((-(-len(commands) // stride), len(self.channels)))
        run(
            n_dof, n, self.rig.timestep, start_time, tolerance, stride, columns, *solved[:2], self._table,
            self._rows, self._row_inputs, solved[2], theta, self._observed, state, least,
            np.zeros(work_size(n, n_dof)), out,
        )  # fmt: skip
        return out

    @cached_property
    def _observed(self) -> Sparse:
        return Sparse.of(self._observe)

    @cached_property
    def _own(self) -> tuple[Sparse, Array, Sparse]:
        return self._solved(self._base)

    def _solved(self, at: _Matrices) -> tuple[Sparse, Array, Sparse]:
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


def sensor_columns(rig: Rig, channels: Sequence[str]) -> list[int]:
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


def _value(model: mujoco.MjModel, entry: Address) -> float:
    return float(np.ravel(getattr(model, entry.field)[entry.index])[0])


def _refuse(rig: Rig, model: mujoco.MjModel) -> None:
    """Raise `ModelError` where a probe at a few states could miss that the rig is not linear."""
    slides = (int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_HINGE))
    collides = not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CONTACT and np.any(
        (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    )
    reasons = {
        f"its integrator is {rig.integrator}, and only RK4 is compiled": rig.integrator != "RK4",
        "it has joints other than slides and hinges": bool(np.any(~np.isin(model.jnt_type, slides))),
        "its actuators have states or delays of their own": model.na > 0 or model.nhistory > 0,
        "its actuators or joints are limited": any(
            np.any(getattr(model, name))
            for name in ("actuator_ctrllimited", "actuator_forcelimited", "jnt_limited", "tendon_limited")
        ),
        "it has dry friction of MuJoCo's own": bool(
            np.any(model.dof_frictionloss) or np.any(model.tendon_frictionloss)
        )
        or any(element.exact for element in rig.elements),
        "it has constraints or contacts": bool(model.neq or collides),
    }
    for reason, present in reasons.items():
        if present:
            raise ModelError(
                f"rig '{rig.name}' is not of linear structure: {reason}; simulate it with MuJoCo"
            )


def _moved(model: mujoco.MjModel, entries: Sequence[Address], values: Sequence[float]) -> mujoco.MjModel:
    changed = copy.copy(model)
    for entry, value in zip(entries, values, strict=True):
        getattr(changed, entry.field)[entry.index] = value
    mujoco.mj_setConst(changed, mujoco.MjData(changed))
    return changed


def _slope(model: mujoco.MjModel, base: _Matrices, entry: Address, value: float) -> _Matrices:
    """Change of the matrices with a unit of a structural quantity, which they are affine in."""
    change = value if value != 0.0 else 1.0
    moved = _Probe(_moved(model, [entry], [value + change])).matrices()
    return _Matrices(*((a - b) / change for a, b in zip(moved, base, strict=True)))


def _at(
    model: mujoco.MjModel,
    base: _Matrices,
    addresses: Sequence[Address],
    start: Array,
    slopes: Sequence[_Matrices | None],
    factor: float,
) -> tuple[_Matrices, mujoco.MjModel]:
    """Matrices and model with all free structural quantities times `factor`."""
    at, entries, values = base, [], []
    for entry, value, slope in zip(addresses, start, slopes, strict=True):
        if slope is not None:
            at = at.plus(slope, (factor - 1.0) * value)
            entries.append(entry)
            values.append(factor * value)
    return at, _moved(model, entries, values)


def _elements(
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


def _reached(
    base: _Matrices,
    slopes: Sequence[_Matrices | None],
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


def _cut(matrices: _Matrices, kept: NDArray[np.int64]) -> _Matrices:
    square = np.ix_(kept, kept)
    return _Matrices(
        matrices.mass[square], matrices.stiffness[square], matrices.damping[square], matrices.inputs[kept]
    )
