"""`mujoco.sysid` on an articulated model: one class of parameters for every joint, fitted to the records at once.

That is how it is used on robots: damping, dry friction and armature of every joint, the gain of every drive, the mass of every body that
moves. It gets what helps it: sequences that start as the smoothed encoders say and are as long as the diagnosis's own free runs where
no servo holds a joint, the encoders weighed by their noise, rollouts in threads, and the scaling by the Jacobian. It names nothing;
what it fits is judged by the free runs that judge the diagnosis.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
from mujoco import sysid
from robot_records.free_run_errors import errors_of, over_travel

from bench.arrays import Array
from bench.discrepancy.articulated.nominal_values import with_nominal_values
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.model.mjcf_file import rig_of
from bench.discrepancy.multibody.channels import bound
from bench.discrepancy.multibody.inputs import input_of
from bench.discrepancy.multibody.joint_record import JOINT_RECORD_SETTINGS
from bench.discrepancy.multibody.joints import Joint, body_name
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.multibody.motion import JointMotion, motion_of
from bench.discrepancy.replay.running import controls
from bench.discrepancy.settings import DEFAULT
from bench.rig.actuators import set_drive
from bench.rig.building import parse
from benchmarks.peer_model import optimised

FAR = 1e3
"""Residual of a run that is not finite, in units of the noise."""
WIDE = 3.0
"""Bounds of gains and masses: a factor of this to either side."""
MOST = 20.0
"""Bounds of damping and armature, over what is stated, and of dry friction over a tenth of the drive's RMS torque."""
ITERATIONS = 50
OFF = 0.01
"""Of the range between its bounds, how far above the lower one a parameter starts at least."""


class Fit:
    """Parameters of an articulated case as `mujoco.sysid` fits them."""

    def __init__(self, case: Case) -> None:
        rig = rig_of(case)
        spec = parse(rig.mjcf, rig.folder, rig.name)
        self.compiled = with_nominal_values(rig, case.parameters)
        self.case, self.model = bound(case, self.compiled), ArticulatedModel.of(self.compiled, case.rig)
        for joint in self.model.joints:
            spec.add_sensor(
                name=f"{joint.name}_read", type=mujoco.mjtSensor.mjSENS_JOINTPOS,
                objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=joint.name,
            )  # fmt: skip
        self.plain = spec.compile()
        self.columns = [int(self.plain.sensor(f"{joint.name}_read").adr[0]) for joint in self.model.joints]
        motions = [
            motion_of(self.case, self.model, r, {}, settings=DEFAULT.motion) for r in case.identification
        ]
        self.noise = np.array([max(float(m.noise[j][0]) for m in motions) for j in range(len(self.columns))])
        self.settings = self._parameters(motions)
        self.sequences = [
            s for r, m in zip(case.identification, motions, strict=True) for s in self._windows(r, m)
        ]

    def _parameters(
        self, motions: list[JointMotion]
    ) -> list[tuple[str, Callable[[Any, float], None], float, float, float]]:
        """Name, how it is set in a compiled model, start and bounds of every parameter."""
        out: list[tuple[str, Callable[[Any, float], None], float, float, float]] = []
        for joint in self.model.joints:
            torque = 0.1 * self._torque(joint, motions)
            for field, stated in (
                ("damping", joint.damping),
                ("armature", joint.armature),
                ("frictionloss", joint.friction),
            ):
                least = {"damping": torque, "armature": 0.01, "frictionloss": torque}[field]
                out.append(
                    (
                        f"{field}:{joint.name}",
                        _dof(f"dof_{field}", joint.dof),
                        stated,
                        0.0,
                        MOST * max(stated, least),
                    )
                )
            if joint.drive is not None and joint.drive.kp:
                kp, u = joint.drive.kp, self.plain.actuator(joint.drive.name).id
                out.append((f"kp:{joint.drive.name}", _drive(u), kp, kp / WIDE, kp * WIDE))
        for body in self.model.bodies:
            mass, i = (
                self.model.mass(body),
                next(k for k in range(1, self.plain.nbody) if body_name(self.plain, k) == body),
            )
            out.append(
                (
                    f"mass:{body}",
                    _body(i, mass, np.array(self.plain.body_inertia[i])),
                    mass,
                    mass / WIDE,
                    mass * WIDE,
                )
            )
        return out

    def _torque(self, joint: Joint, motions: list[JointMotion]) -> float:
        """RMS torque of a drive along the motion as measured."""
        assert joint.drive is not None
        j, total = self.model.joints.index(joint), []
        for record, motion in zip(self.case.identification, motions, strict=True):
            command = np.asarray(record.values[input_of(self.case, joint).name])
            total.append(joint.drive.torque(command, motion.position[:, j], motion.velocity[:, j]))
        return float(np.sqrt(np.mean(np.concatenate(total) ** 2)))

    def _windows(self, record: CaseRecord, motion: JointMotion) -> list[Any]:
        step = float(self.plain.opt.timestep)
        servos = all(joint.drive is not None and joint.drive.servo for joint in self.model.joints)
        every = len(record) if servos else max(2, round(JOINT_RECORD_SETTINGS.window / record.step))
        per = record.step / step
        columns = {
            joint.drive.name: np.asarray(record.values[input_of(self.case, joint).name])
            for joint in self.model.joints if joint.drive is not None
        }  # fmt: skip
        steps = int(np.ceil((len(record) - 1) * per)) + 1
        control = controls(record, columns, self.plain, steps, self.case.load_interpolation)
        out = []
        for first in range(0, len(record) - 1, every):
            count = min(every, len(record) - first)
            begin, length = round(first * per), int(np.ceil((count - 1) * per)) + 1
            data = mujoco.MjData(self.plain)
            for j, joint in enumerate(self.model.joints):
                data.qpos[self.plain.joint(joint.name).qposadr[0]] = motion.position[first, j]
                data.qvel[joint.dof] = motion.velocity[first, j]
            measured = np.column_stack(
                [motion.samples[j][first : first + count, 0] for j in range(len(self.columns))]
            )
            rows = control[np.minimum(begin + np.arange(length), len(control) - 1)]
            out.append((np.array(data.qpos), np.array(data.qvel), rows, measured, per))
        return out

    def build(self, vector: Array) -> mujoco.MjModel:
        """The compiled model at a vector."""
        model = mujoco.MjModel.__copy__(self.plain)
        for (_, change, *_), value in zip(self.settings, vector, strict=True):
            change(model, float(value))
        mujoco.mj_setConst(model, mujoco.MjData(model))
        return model

    def residual(self, x: Array, parameters: Any) -> tuple[list[Array], list, list]:
        """Residuals in units of the noise (n, n_vectors), through the rollouts of `mujoco.sysid`."""
        vectors = np.atleast_2d(x.T)
        models = [self.build(vector) for vector in vectors]
        step, parts = float(self.plain.opt.timestep), []
        jobs = [(model, one) for one in self.sequences for model in models]
        found = sysid.sysid_rollout(
            models=[model for model, _ in jobs], datas=[mujoco.MjData(self.plain) for _ in range(2)],
            control_signal=[sysid.TimeSeries(np.arange(len(one[2])) * step, one[2]) for _, one in jobs],
            initial_states=[sysid.create_initial_state(self.plain, one[0], one[1], np.zeros(self.plain.na)) for _, one in jobs],
        )  # fmt: skip
        for k, (_, _, _, measured, per) in enumerate(self.sequences):
            rows = np.minimum(
                np.round(np.arange(1, len(measured)) * per).astype(int) - 1,
                len(found[k * len(models)].sensordata.data) - 1,
            )
            mine = [
                run.sensordata.data[rows][:, self.columns]
                for run in found[k * len(models) : (k + 1) * len(models)]
            ]
            parts += [
                np.stack(
                    [
                        np.clip(np.nan_to_num((p - measured[1:]) / self.noise, nan=FAR), -FAR, FAR).ravel()
                        for p in mine
                    ],
                    axis=1,
                )
            ]
        whole = np.concatenate(parts)
        return [whole if x.ndim > 1 else whole[:, 0]], [], []

    def fitted(self, seconds: float) -> mujoco.MjModel:
        """The model as fitted within a time."""
        deadline = time.perf_counter() + seconds
        parameters = sysid.ParameterDict()
        for name, _, start, low, high in self.settings:
            # a start at a bound stalls it
            parameters.add(
                sysid.Parameter(name, float(np.clip(start, low + OFF * (high - low), high)), low, high)
            )
        _, vector = optimised(parameters, self.residual, iterations=ITERATIONS, deadline=deadline)
        return self.build(vector)

    def errors(self, fitted: mujoco.MjModel, case: Case) -> Array:
        """RMS errors (n_records, n_joints) of free runs of a case's judging records, one joint at a time, over its travel there."""
        problem = ArticulatedProblem.of(
            bound(case, self.compiled), ArticulatedModel.of(fitted), case.validation
        )
        return over_travel(problem, errors_of(problem, (), np.zeros(len(problem.nominal))))


def _dof(field: str, index: int) -> Callable[[Any, float], None]:
    def change(model: Any, value: float) -> None:
        values = getattr(model, field)
        if np.ndim(values) > 1:
            values[index, 0] = value
        else:
            values[index] = value

    return change


def _drive(u: int) -> Callable[[Any, float], None]:
    return lambda model, value: set_drive(model, u, "kp", value)


def _body(i: int, mass: float, inertia: Array) -> Callable[[Any, float], None]:
    def change(model: Any, value: float) -> None:
        model.body_mass[i], model.body_inertia[i] = value, inertia * (value / mass)

    return change
