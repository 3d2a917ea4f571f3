"""Where the channels of a rig come from, and where the numbers of its model stand."""

from __future__ import annotations

from typing import NamedTuple

import mujoco

from bench.errors import UnknownNameError
from bench.rig import Rig
from bench.rig.building import STRUCTURE


class Source(NamedTuple):
    """Where a channel comes from: a column of the controls or of the sensors, or an element's motion, force or state."""

    kind: str  # "command", "sensor", "displacement", "velocity", "force", "state"
    index: int
    item: int = -1


class Address(NamedTuple):
    """A number of a model that a batch can hold one of for each simulation."""

    field: str
    index: int


def structure_address(model: mujoco.MjModel, kind: str, name: str) -> Address:
    """Where a structural quantity stands, as `Rig.with_structure` writes it.

    Raises:
        UnknownNameError: No such quantity, body, joint or tendon.
    """
    if kind not in STRUCTURE:
        raise UnknownNameError("structural quantity", kind, STRUCTURE)
    if kind in {"mass", "inertia"}:
        body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
        if body < 0:
            raise UnknownNameError("body", name, [model.body(i).name for i in range(1, model.nbody)])
        return Address(f"body_{kind}", body)
    joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
    if joint >= 0:
        return (
            Address("jnt_stiffness", joint)
            if kind == "stiffness"
            else Address(f"dof_{kind}", int(model.jnt_dofadr[joint]))
        )
    tendon = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TENDON, name)
    if tendon < 0:
        known = [model.joint(i).name for i in range(model.njnt)] + [
            model.tendon(i).name for i in range(model.ntendon)
        ]
        raise UnknownNameError("joint or tendon", name, known)
    return Address(f"tendon_{kind}", tendon)


def sources_of(rig: Rig) -> dict[str, Source]:
    """Source of every channel of the rig, in the order of `rig.channels`."""
    built = rig.built
    sources = [Source("command", i) for i in range(len(built.actuators))]
    sources += [Source("sensor", i) for i in range(built.model.nsensordata)]
    for place, item in enumerate(built.placed):
        moving = range(len(item.element.joints))
        sources += [Source(kind, i, place) for kind in ("displacement", "velocity", "force") for i in moving]
        sources += [Source("state", i, place) for i in range(len(item.element.law.states))]
    return {channel.name: source for channel, source in zip(rig.channels, sources, strict=True)}
