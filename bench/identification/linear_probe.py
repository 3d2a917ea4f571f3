"""What a compiled MuJoCo model is made of, where it is linear: matrices and sensor maps, read off by asking for accelerations.

The model is asked under unit positions, velocities and commands; whether it is linear at all is tried at random states.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from bench import native
from bench.arrays import Array
from bench.errors import ModelError
from bench.rig import Rig
from bench.rig.structure import Address


@dataclass(frozen=True)
class LinearProbeSettings:
    """Numbers of `bench.identification.linear_probe`."""

    agreement: float = 1e-9


SETTINGS = LinearProbeSettings()


class Matrices(NamedTuple):
    """``mass q'' + damping q' + stiffness q = inputs [u, 1]``."""

    mass: Array  # (n_dof, n_dof)
    stiffness: Array  # (n_dof, n_dof)
    damping: Array  # (n_dof, n_dof)
    inputs: Array  # (n_dof, n_inputs + 1), the last column constant

    def plus(self, other: Matrices, factor: float) -> Matrices:
        """The sum of these matrices and a multiple of others."""
        return Matrices(*(a + factor * b for a, b in zip(self, other, strict=True)))


class Probe:
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

    def matrices(self) -> Matrices:
        """The matrices at rest."""
        with native.running(self.model):
            return self._matrices()

    def _matrices(self) -> Matrices:
        nv, nu = self.model.nv, self.model.nu
        zero, still, eye = np.zeros(nv), np.zeros(nu), np.eye(nv)
        rest, mass, _ = self.force(zero, zero, still)
        stiffness = np.stack([rest - self.force(row, zero, still)[0] for row in eye], axis=1)
        damping = np.stack([rest - self.force(zero, row, still)[0] for row in eye], axis=1)
        columns = [self.force(zero, zero, row)[0] - rest for row in np.eye(nu)]
        return Matrices(mass, stiffness, damping, np.stack([*columns, rest], axis=1))

    def sensors(self, at: Matrices) -> Array:
        """Sensors as a map of position, velocity, acceleration, commands and 1: ``(n, 3 nv + nu + 1)``."""
        with native.running(self.model):
            return self._sensors(at)

    def _sensors(self, at: Matrices) -> Array:
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
        self, at: Matrices, sensors: Array, columns: Sequence[int], rng: np.random.Generator
    ) -> str:
        """What of the model the matrices, and the map of some sensors, miss at random states; empty for nothing."""
        nv, nu = self.model.nv, self.model.nu
        for scale in (1.0, 1e-2):  # a stop or a backlash shows at one of them
            q, v, u = (scale * rng.standard_normal(size) for size in (nv, nv, nu))
            force, mass, measured = self.force(q, v, u)
            one = np.append(u, 1.0)
            terms = (at.inputs @ one, -at.stiffness @ q, -at.damping @ v)
            size = max(float(np.max(np.abs(term), initial=1e-12)) for term in terms)
            if np.max(np.abs(mass - at.mass)) > SETTINGS.agreement * np.max(np.abs(at.mass)):
                return "its mass matrix depends on the position"
            if np.max(np.abs(sum(terms) - force)) > SETTINGS.agreement * size:
                return "its forces are not linear in position, velocity and command"
            acceleration = np.linalg.solve(mass, force)
            parts = sensors * np.concatenate([q, v, acceleration, one])
            sizes = np.max(np.abs(parts), axis=1, initial=1e-12)
            if np.any(np.abs(parts.sum(axis=1) - measured[columns]) > SETTINGS.agreement * sizes):
                return "a channel is not linear in the motion"
        return ""


def refuse_nonlinear(rig: Rig, model: mujoco.MjModel) -> None:
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


def moved(model: mujoco.MjModel, entries: Sequence[Address], values: Sequence[float]) -> mujoco.MjModel:
    """A copy of a model with other values of some parameters."""
    changed = copy.copy(model)
    for entry, value in zip(entries, values, strict=True):
        entry.write(changed, value)
    mujoco.mj_setConst(changed, mujoco.MjData(changed))
    return changed


def slope_of(model: mujoco.MjModel, base: Matrices, entry: Address, value: float) -> Matrices:
    """Change of the matrices with a unit of a structural quantity, which they are affine in."""
    change = value if value != 0.0 else 1.0
    away = Probe(moved(model, [entry], [value + change])).matrices()
    return Matrices(*((a - b) / change for a, b in zip(away, base, strict=True)))


def matrices_at(
    model: mujoco.MjModel,
    base: Matrices,
    addresses: Sequence[Address],
    start: Array,
    slopes: Sequence[Matrices | None],
    factor: float,
) -> tuple[Matrices, mujoco.MjModel]:
    """Matrices and model with all free structural quantities times `factor`."""
    at, entries, values = base, [], []
    for entry, value, slope in zip(addresses, start, slopes, strict=True):
        if slope is not None:
            at = at.plus(slope, (factor - 1.0) * value)
            entries.append(entry)
            values.append(factor * value)
    return at, moved(model, entries, values)


def rows_and_columns(matrices: Matrices, kept: NDArray[np.int64]) -> Matrices:
    """The rows and columns of some degrees of freedom."""
    square = np.ix_(kept, kept)
    return Matrices(
        matrices.mass[square], matrices.stiffness[square], matrices.damping[square], matrices.inputs[kept]
    )
