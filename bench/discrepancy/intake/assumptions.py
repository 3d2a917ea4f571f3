"""What is assumed of a model of which nobody said how sure he is: the parameters that may be wrong, and by how much."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np

from bench.rig.actuators import commanded, drive_of

_TURNING = int(mujoco.mjtJoint.mjJNT_HINGE)


@dataclass(frozen=True)
class Assumptions:
    """One-sigma uncertainties of nominal parameters, relative to their values.

    They are those of a model that somebody made with care from drawings and data sheets: masses from CAD are right within some
    percent (cables, screws and tolerances are not drawn), stiffnesses within ten (10 % is what spring makers tolerate, DIN EN 15800),
    a gain that was set in software is what it says, while damping, friction and rotor inertia are usually guessed. State your own
    in the nominal.json that `jointbench init` writes.

    Attributes:
        mass: Of the mass of a body.
        stiffness: Of the spring of a joint.
        damping: Of the damping of a joint.
        frictionloss: Of its dry friction.
        armature: Of the inertia of a rotor.
        kp: Of the position gain of a servo.
        kv: Of its velocity gain.
        forcerange: Of the force of a DC motor at full voltage.
        judging: Share at the end of a single log that judges.
    """

    mass: float = 0.05
    stiffness: float = 0.1
    damping: float = 0.3
    frictionloss: float = 0.3
    armature: float = 0.3
    kp: float = 0.1
    kv: float = 0.3
    forcerange: float = 0.1
    judging: float = 1.0 / 3.0


class Assumed(NamedTuple):
    """A nominal parameter with its assumed uncertainty."""

    name: str
    value: float
    std: float
    unit: str


def assumed_parameters(
    model: mujoco.MjModel, assumptions: Assumptions, *, articulated: bool
) -> list[Assumed]:
    """The parameters of a model that are not zero, with uncertainties.

    Args:
        model: The model.
        assumptions: How sure one is.
        articulated: Whether rotor inertias and gains may be among them; on a linear structure nothing tells them from masses and
            stiffnesses.
    """
    out = [_mass(model, body, assumptions) for body in moving_bodies(model)]
    for i in range(model.njnt):
        name, turning = model.joint(i).name, int(model.jnt_type[i]) == _TURNING
        dof = int(model.jnt_dofadr[i])
        values = {
            "stiffness": float(np.ravel(model.jnt_stiffness[i])[0]),
            "damping": float(np.ravel(model.dof_damping[dof])[0]),
            "frictionloss": float(model.dof_frictionloss[dof]),
        }
        units = {"stiffness": "N/m", "damping": "N s/m", "frictionloss": "N", "armature": "kg"}
        if turning:
            units = {
                "stiffness": "N m/rad", "damping": "N m s/rad", "frictionloss": "N m", "armature": "kg m^2"
            }  # fmt: skip
        if articulated:
            values["armature"] = float(model.dof_armature[dof])
        out += [
            Assumed(f"{kind}:{name}", value, getattr(assumptions, kind) * value, units[kind])
            for kind, value in values.items()
            if value > 0.0 and name
        ]
    return [*out, *(_gains(model, assumptions) if articulated else [])]


def _gains(model: mujoco.MjModel, assumptions: Assumptions) -> list[Assumed]:
    out = []
    for u in range(model.nu):
        if not is_servo(model, u):
            continue
        name = model.actuator(u).name
        turning = int(model.jnt_type[int(model.actuator_trnid[u, 0])]) == _TURNING
        units = {"kp": "N m/rad", "kv": "N m s/rad", "forcerange": "N m"}
        if not turning:
            units = {"kp": "N/m", "kv": "N s/m", "forcerange": "N"}
        drive = drive_of(model, u)
        values = {
            "kp": drive.kp,
            "kv": drive.kv,
            "forcerange": drive.stall if np.isfinite(drive.stall) else 0.0,
        }
        out += [
            Assumed(f"{kind}:{name}", value, getattr(assumptions, kind) * value, units[kind])
            for kind, value in values.items()
            if value > 0.0
        ]
    return out


def is_servo(model: mujoco.MjModel, actuator: int) -> bool:
    """Whether an actuator follows a position."""
    return commanded(model, actuator) == "position"


def moving_bodies(model: mujoco.MjModel) -> list[int]:
    """The heaviest body of each group that moves as one: no record tells the masses of its members apart."""
    groups: dict[int, int] = {}
    for body in range(1, model.nbody):
        weld = int(model.body_weldid[body])
        if weld == 0 or float(model.body_mass[body]) <= 0.0 or not model.body(body).name:
            continue
        if weld not in groups or model.body_mass[body] > model.body_mass[groups[weld]]:
            groups[weld] = body
    return list(groups.values())


def _mass(model: mujoco.MjModel, body: int, assumptions: Assumptions) -> Assumed:
    value = float(model.body_mass[body])
    return Assumed(f"mass:{model.body(body).name}", value, assumptions.mass * value, "kg")
