"""Motions of the joint rig, with their solutions, and how an error in one is measured."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property, partial
from typing import Any

import mujoco
import numba
import numpy as np
from mujoco.batch import Batch
from scipy.integrate import solve_ivp

from bench import joint_rig
from bench.arrays import Array
from bench.identification.linear_rig import LinearRig
from bench.laws.coupling import AXIAL_TORSIONAL_JOINT, INCH, POUND_FORCE

CHANNELS = tuple(
    f"{kind}_{body}"
    for pair in (("displacement", "rotation"), ("velocity", "rotation_rate"))
    for body in (1, 2)
    for kind in pair
)

JOINTS = ("axial_1", "torsional_1", "axial_2", "torsional_2")

_joint_force = numba.njit(error_model="numpy")(AXIAL_TORSIONAL_JOINT.force.function)


@numba.njit(error_model="numpy")
def field_of(t, y, commands, mass, stiffness, damping, theta):
    """Right-hand side of the joint rig: four positions, four velocities."""
    q = np.array([y[2] - y[0], y[3] - y[1]])
    v = np.array([y[6] - y[4], y[7] - y[5]])
    f = np.zeros(2)
    _joint_force(t, q, v, f, theta, f)
    out = np.empty(8)
    for i in range(4):
        out[i] = y[4 + i]
        sign = 1.0 if i < 2 else -1.0
        load = commands[i] + sign * f[i % 2] if i < 2 else sign * f[i % 2]
        out[4 + i] = (load - stiffness[i] * y[i] - damping[i] * y[4 + i]) / mass[i]
    return out


@numba.njit(error_model="numpy")
def _field_across(t, y, commands, rate, mass, stiffness, damping, theta):
    """The same under commands ``(n, 2)`` held over each sample."""
    k = min(int(t * rate), commands.shape[0] - 1)
    return field_of(t, y, commands[k], mass, stiffness, damping, theta)


@dataclass(frozen=True)
class JointProblem:
    """A motion of the joint rig, and how an error in it is measured.

    Attributes:
        name: Name.
        commands: Force and torque, held over each millisecond ``(n, 2)``; zeros for a free decay.
        speeds: Velocities of the joints at the start ``(4,)``.
        every: Milliseconds between the samples of the result.
    """

    name: str
    commands: Array
    speeds: tuple[float, float, float, float]
    every: int

    @property
    def start(self) -> Array:
        """State at the start ``(8,)``."""
        return np.concatenate([np.zeros(4), self.speeds])

    @property
    def driven(self) -> bool:
        """Whether there are commands."""
        return bool(np.any(self.commands))

    @cached_property
    def reference(self) -> Array:
        """The motion to the last digits of double precision that integration leaves ``(n_samples, 8)``."""
        return self.scipy("DOP853", 1e-12, np.full(8, 1e-6), restart=True)

    @cached_property
    def scale(self) -> Array:
        """Largest value of each state."""
        return np.max(np.abs(self.reference), axis=0)

    def error(self, result: Array) -> float:
        """Largest error of any state at any sample, relative to that state's largest value."""
        return float(np.max(np.abs(result - self.reference) / self.scale))

    def scipy(
        self, method: str, rtol: float, scale: Array, *, restart: bool, speeds: Sequence[float] | None = None
    ) -> Array:
        """The motion by `solve_ivp`."""
        numbers = _numbers()
        options: dict[str, Any] = {"method": method, "rtol": rtol, "atol": rtol * scale}
        state = self.start if speeds is None else np.concatenate([np.zeros(4), speeds])
        duration = 1e-3 * len(self.commands)
        samples = 1e-3 * np.arange(0, len(self.commands), self.every)
        if not self.driven:
            field = partial(_field_tail, commands=np.zeros(2), numbers=numbers)
            return solve_ivp(field, (0.0, duration), state, t_eval=samples, **options).y.T
        if not restart:
            rate = 1000.0 * (1.0 + 1e-12)
            arguments = (self.commands, rate, *numbers)
            return solve_ivp(
                _field_across,
                (0.0, duration),
                state,
                t_eval=samples,
                max_step=1e-3,
                args=arguments,
                **options,
            ).y.T
        out = np.empty((len(samples), 8))
        for k, command in enumerate(self.commands):
            if k % self.every == 0:
                out[k // self.every] = state
            field = partial(_field_tail, commands=command, numbers=numbers)
            state = solve_ivp(field, (0.0, 1e-3), state, first_step=1e-3, **options).y[:, -1]
        return out

    def mujoco(self, substeps: int, *, speeds: Array | None = None, threads: int = 1) -> Array:
        """The motions by `mujoco.batch` with native callbacks ``(n_motions, n_samples, 8)``."""
        count = 1 if speeds is None else len(speeds)
        batch = Batch(_model(substeps), count, threads)
        qpos, qvel, ctrl = (batch.bind(name) for name in ("qpos", "qvel", "ctrl"))
        qvel[:] = self.speeds if speeds is None else speeds
        out = np.empty((count, -(-len(self.commands) // self.every), 8))
        stride = 1 if self.driven else self.every
        for k in range(0, len(self.commands), stride):
            if k % self.every == 0:
                out[:, k // self.every, :4], out[:, k // self.every, 4:] = qpos, qvel
            ctrl[:] = self.commands[k]
            batch.step(nstep=stride * substeps)
        return out

    def compiled(self, rig: LinearRig, tolerance: float) -> Array:
        """The motion by the compiled loop with controlled error."""
        hold = round(rig.rig.timestep / 1e-3)
        return rig.simulate(
            self.commands[::hold],
            initial=_moving(self.speeds),
            stride=self.every // hold,
            tolerance=tolerance,
            sizes=self.sizes,
        )

    def many(self, rig: LinearRig, tolerance: float, speeds: Array) -> Array:
        """The motions from several starts by the compiled loop, over two threads ``(n_motions, n_samples, 8)``."""
        hold = round(rig.rig.timestep / 1e-3)
        return rig.simulate_batch(
            self.commands[::hold],
            initials=[_moving(row) for row in speeds.tolist()],
            stride=self.every // hold,
            tolerance=tolerance,
            sizes=self.sizes,
            threads=2,
        )

    @cached_property
    def sizes(self) -> dict[str, tuple[float, float]]:
        """Largest position and velocity by joint: what the peer's absolute tolerances tell it."""
        half = len(self.scale) // 2
        return dict(
            zip(JOINTS, zip(self.scale[:half].tolist(), self.scale[half:].tolist(), strict=True), strict=True)
        )


def _moving(speeds: Sequence[float]) -> dict[str, tuple[float, float]]:
    """Initial states of the joints."""
    return {joint: (0.0, speed) for joint, speed in zip(JOINTS, speeds, strict=True)}


@cache
def _model(substeps: int) -> mujoco.MjModel:
    return joint_rig(timestep=1e-3 / substeps).model


@cache
def _numbers() -> tuple[Array, ...]:
    """Masses, stiffnesses and dampings of the joint rig, and its joint's parameters."""
    model = _model(1)
    return (
        model.dof_M0.copy(),
        model.jnt_stiffness.copy(),
        model.dof_damping.copy(),
        AXIAL_TORSIONAL_JOINT.theta(),
    )


def _field_tail(t: float, y: Array, commands: Array, numbers: tuple[Array, ...]) -> Array:
    return field_of(t, y, commands, *numbers)


def problems() -> tuple[JointProblem, JointProblem]:
    """A free decay through all gaps, and the deck's noise held over each millisecond."""
    rng = np.random.default_rng(46)
    noise = np.fft.irfft(
        np.where(
            np.arange(501)[:, None] <= 12,
            rng.standard_normal((501, 2)) + 1j * rng.standard_normal((501, 2)),
            0.0,
        ),
        axis=0,
    )
    noise *= np.array([1000.0 * POUND_FORCE, 1000.0 * POUND_FORCE * INCH]) / np.max(np.abs(noise), axis=0)
    return (
        JointProblem("free decay, 2 s", np.zeros((2000, 2)), (1.0, 40.0, 0.0, 0.0), every=10),
        JointProblem("held noise, 1 s", noise, (0.0, 0.0, 0.0, 0.0), every=10),
    )
