"""An articulated nominal model: an MJCF tree of hinges and slides on a fixed base, its drives, and its uncertain parameters.

What the equation of one joint needs is read off MuJoCo along a motion: the torque of the inverse dynamics, the joint's own inertia, and
the derivatives of that torque by the posture and by the inertial parameters. Damping, friction, springs, armature and drives are kept
apart, since runs of single joints carry them themselves.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from bench.arrays import Array
from bench.discrepancy.multibody.joints import MOVING, Joint, Tie, body_name, joint_of, ties_of, with_moved
from bench.errors import ModelError, UnknownNameError
from bench.native.inverse import along
from bench.rig import Rig
from bench.rig.bodies import body_value, set_body, without_shortcuts
from bench.rig.gravity import tilted
from bench.rig.held_joints import MOTION


@dataclass(frozen=True)
class MultibodySettings:
    """Numbers of `bench.discrepancy.multibody.model`."""

    difference: float = 1e-6
    """Step of central differences of the inverse dynamics [rad or m], a cube root of rounding."""


SETTINGS = MultibodySettings()


class Dynamics(NamedTuple):
    """Inverse dynamics along a motion.

    Attributes:
        torque: (n, n_moving) torque that the bodies ask of every joint, armature, damping, springs and friction not counted.
        inertia: (n, n_moving) of the bodies about every joint, the diagonal of the mass matrix.
    """

    torque: Array
    inertia: Array


@dataclass(frozen=True, eq=False)
class ArticulatedModel:
    """The model with its bodies' parameters at given values.

    Attributes:
        model: The compiled model without damping, friction, springs, armature, limits and contacts.
        joints: Its joints in the order of its degrees of freedom, those that are followed left out.
        followed: Joints that move as measured, whatever moves them: those with a motor that stands for a motion.
        bodies: Names of the bodies that move, by joints of their own or with another one, see `body_name`.
        tips: Body to the position of its tip in its own frame, where a payload would sit: a site called ``…tip``, else the joint of
            its only child, else its own centre of mass.
        ties: Joints that those move by equalities.
    """

    model: mujoco.MjModel
    joints: tuple[Joint, ...]
    followed: tuple[Joint, ...]
    bodies: tuple[str, ...]
    tips: Mapping[str, Array]
    ties: tuple[Tie, ...] = ()

    @classmethod
    def from_file(cls, path: str | Path) -> ArticulatedModel:
        """Read an MJCF.

        Raises:
            ModelError: It cannot be read, or something in it is no hinge or slide on a fixed base.
        """
        return cls.of(compiled_model(path), str(path))

    @classmethod
    def of(cls, model: mujoco.MjModel, name: str = "model") -> ArticulatedModel:
        """Take a compiled model apart; it is copied."""
        _refuse(model, name)
        every, ties = [joint_of(model, i) for i in range(model.njnt)], ties_of(model)
        for tie in ties:
            moved = next(j for j in every if j.name == tie.name)
            every = [
                with_moved(j, moved, tie) if j.name == tie.to else j for j in every if j.name != tie.name
            ]
        followed = tuple(j for j in every if j.drive is not None and j.drive.name.startswith(MOTION))
        joints = tuple(j for j in every if j not in followed)
        bare = _bare(model)
        bodies = tuple(body_name(model, i) for i in range(1, model.nbody) if _moves(model, i))
        return cls(bare, joints, followed, bodies, {body: _tip(model, body) for body in bodies}, ties)

    def joint(self, name: str) -> Joint:
        """Return a joint by name.

        Raises:
            UnknownNameError: There is none.
        """
        for joint in self.joints:
            if joint.name == name:
                return joint
        raise UnknownNameError("joint", name, [j.name for j in self.joints])

    def neighbours(self, j: int) -> tuple[str, ...]:
        """Joints next to joint `j` in the tree: that which carries it, and those that it carries."""
        bodies = [body_index(self.model, joint.body) for joint in self.joints]
        carriers = [self._carrier(body, bodies) for body in bodies]
        return tuple(
            other.name
            for i, other in enumerate(self.joints)
            if i != j and (carriers[i] == bodies[j] or carriers[j] == bodies[i])
        )

    def _carrier(self, body: int, bodies: Sequence[int]) -> int:
        """The next body with a joint towards the base; zero where there is none."""
        body = int(self.model.body_parentid[body])
        while body and body not in bodies:
            body = int(self.model.body_parentid[body])
        return body

    @property
    def moving(self) -> tuple[Joint, ...]:
        """All joints in the order of the columns of a motion: the model's, then those that are followed."""
        return (*self.joints, *self.followed)

    def mass(self, body: str) -> float:
        """Mass of a body [kg]."""
        return float(self.model.body_mass[body_index(self.model, body)])

    def with_mass(self, body: str, mass: float) -> ArticulatedModel:
        """The model with another mass of a body, its centre of mass and inertia about it as they are."""
        return self.with_body("mass", body, mass)

    def body_value(self, kind: str, body: str) -> float:
        """A number of a body, see `bodies.body_value`."""
        return body_value(self.model, body_index(self.model, body), kind)

    def with_body(self, kind: str, body: str, value: float) -> ArticulatedModel:
        """The model with another number of a body, see `bodies.set_body`, which also says what it raises."""
        out = self._copied()
        set_body(out.model, body_index(out.model, body), kind, value)
        return out

    def with_payload(self, body: str, mass: float, at: Array | None = None) -> ArticulatedModel:
        """The model with a point mass fixed to a body, at its tip where no position (3,) [m] in its frame is given."""
        out = self._copied()
        i = body_index(out.model, body)
        _add_point(out.model, i, mass, self.tips[body] if at is None else at)
        return out

    def weight(self, body: str, q: Array) -> Array:
        """Torque (n, n_joints) that the weight of a body asks of every joint at positions (n, n_joints)."""
        still = np.zeros_like(q)
        return (
            self.dynamics(q, still, still).torque - self.with_mass(body, 0.0).dynamics(q, still, still).torque
        )

    def with_centre(self, body: str, shift: Array) -> ArticulatedModel:
        """The model with the centre of mass of a body moved by `shift` (3,) [m] in the body's frame, the inertia about it kept."""
        out = self._copied()
        out.model.body_ipos[body_index(out.model, body)] += shift
        return out

    @property
    def gravity(self) -> Array:
        """Vector of gravity (3,) [m/s^2]."""
        return np.array(self.model.opt.gravity)

    def with_gravity(self, gravity: Array) -> ArticulatedModel:
        """The model with another vector of gravity (3,) [m/s^2]."""
        out = self._copied()
        out.model.opt.gravity[:] = gravity
        return out

    def with_tilt(self, x: float, y: float) -> ArticulatedModel:
        """The model on a base that leans by a rotation about two horizontal axes [rad], see `tilted`."""
        return self.with_gravity(tilted(self.gravity, x, y))

    def _copied(self) -> ArticulatedModel:
        return replace(self, model=copy.copy(self.model))

    def dynamics(self, q: Array, v: Array, a: Array) -> Dynamics:
        """Inverse dynamics along positions, velocities and accelerations (n, n_moving)."""
        if not self.followed and not self.ties:
            return Dynamics(*along(self.model, q, v, a))
        dofs = [joint.dof for joint in self.moving]
        torque, inertia = along(self.model, *(self.whole(part, k) for k, part in enumerate((q, v, a))))
        out, own = torque[:, dofs], inertia[:, dofs]
        for tie in self.ties:
            out[:, dofs.index(tie.to_dof)] += tie.ratio * torque[:, tie.dof]
        for j in sorted({dofs.index(tie.to_dof) for tie in self.ties}):
            own[:, j] = self._inertia(q, j)
        return Dynamics(out, own)

    def whole(self, motion: Array, order: int) -> Array:
        """Columns (n, n_dofs) of all degrees of freedom from those of the joints (n, n_moving): positions (order 0) or derivatives."""
        out = np.empty((len(motion), self.model.nv))
        for j, joint in enumerate(self.moving):
            out[:, joint.dof] = motion[:, j]
        for tie in self.ties:
            out[:, tie.dof] = tie.ratio * out[:, tie.to_dof] + (tie.offset if order == 0 else 0.0)
        return out

    def on_joints(self, force: Array) -> Array:
        """Forces (n_joints,) on the joints from those on all degrees of freedom (n_dofs,)."""
        out = np.array(force)
        for tie in self.ties:
            out[tie.to_dof] += tie.ratio * force[tie.dof]
        return out[[joint.dof for joint in self.joints]]

    def _inertia(self, q: Array, j: int) -> Array:
        """Inertia (n,) about joint `j` with all that it moves: what a unit acceleration of it asks for."""
        at, still = self.whole(q, 0), np.zeros((len(q), self.model.nv))
        along_joint = self.whole(np.eye(len(self.moving))[[j]], 1)
        unit = np.repeat(along_joint, len(q), axis=0)
        asked = along(self.model, at, still, unit)[0] - along(self.model, at, still, still)[0]
        return np.asarray(asked @ along_joint[0])

    def slopes(self, q: Array, v: Array, a: Array) -> Array:
        """Derivative (n, n_moving) of the torque on every joint by its own position; zero of what is followed."""
        out = np.zeros_like(q)
        for j in range(len(self.joints)):
            step = np.zeros(q.shape[1])
            step[j] = SETTINGS.difference
            ahead = self.dynamics(q + step, v, a).torque[:, j]
            behind = self.dynamics(q - step, v, a).torque[:, j]
            out[:, j] = (ahead - behind) / (2.0 * SETTINGS.difference)
        return out


def body_index(model: mujoco.MjModel, body: str) -> int:
    """Index of a body by its name, see `body_name`."""
    return next(i for i in range(1, model.nbody) if body_name(model, i) == body)


def compiled_model(path: str | Path) -> mujoco.MjModel:
    """Compile an MJCF, with the limits that hold for every model that is read.

    Raises:
        ModelError: It cannot be read or compiled.
    """
    return Rig.from_file(path).model


def _refuse(model: mujoco.MjModel, name: str) -> None:
    for i in range(model.njnt):
        if int(model.jnt_type[i]) not in MOVING:
            kind = mujoco.mjtJoint(int(model.jnt_type[i])).name.removeprefix("mjJNT_").lower()
            raise ModelError(
                f"joint '{model.joint(i).name}' of '{name}' is a {kind} joint; hinges and slides on a fixed base are expected: hang the "
                "robot up (remove the free joint), lock a ball joint, or cut out the limb that was tested"
            )


def _moves(model: mujoco.MjModel, i: int) -> bool:
    """Whether body `i` has a joint, or a mass that moves with another body, to which it is fixed or behind a joint that is held."""
    return model.body_dofnum[i] > 0 or (model.body_weldid[i] > 0 and model.body_mass[i] > 0.0)


def _bare(model: mujoco.MjModel) -> mujoco.MjModel:
    """The bodies alone: nothing but inertia and gravity."""
    bare = copy.copy(model)
    bare.dof_damping[:] = 0.0
    bare.dof_frictionloss[:] = 0.0
    bare.dof_armature[:] = 0.0
    bare.actuator_armature[:] = 0.0
    bare.actuator_damping[:] = 0.0
    bare.jnt_stiffness[:] = 0.0
    without_shortcuts(bare)  # masses, centres of mass and armatures change here
    disabled = (
        mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        | mujoco.mjtDisableBit.mjDSBL_ACTUATION
        | mujoco.mjtDisableBit.mjDSBL_SENSOR
    )
    bare.opt.disableflags |= int(disabled)
    return bare


def _tip(model: mujoco.MjModel, body: str) -> Array:
    i = body_index(model, body)
    for s in range(model.nsite):
        if int(model.site_bodyid[s]) == i and model.site(s).name.endswith("tip"):
            return np.array(model.site_pos[s])
    children = [c for c in range(1, model.nbody) if int(model.body_parentid[c]) == i]
    return np.array(model.body_pos[children[0]] if len(children) == 1 else model.body_ipos[i])


def _add_point(model: mujoco.MjModel, i: int, mass: float, at: Array) -> None:
    """Add a point mass to body `i`: the exact composite of the two."""
    old_mass, old_at = float(model.body_mass[i]), np.array(model.body_ipos[i])
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.body_iquat[i])
    turn = turn.reshape(3, 3)
    inertia = turn @ np.diag(model.body_inertia[i]) @ turn.T
    total = old_mass + mass
    centre = (old_mass * old_at + mass * at) / total
    for part, position in ((old_mass, old_at), (mass, at)):
        d = position - centre
        inertia += part * (d @ d * np.eye(3) - np.outer(d, d))
    values, vectors = np.linalg.eigh(inertia)
    if np.linalg.det(vectors) < 0:
        vectors[:, 0] = -vectors[:, 0]
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(vectors).ravel())
    model.body_mass[i], model.body_ipos[i] = total, centre
    model.body_inertia[i], model.body_iquat[i] = values, quaternion
