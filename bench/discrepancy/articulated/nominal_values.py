"""Values of ``nominal.json`` in the place of those of a model."""

from __future__ import annotations

import copy
from collections.abc import Iterable

import mujoco

from bench.discrepancy.case.case import NominalParameter
from bench.discrepancy.multibody.joints import body_name
from bench.errors import UnknownNameError
from bench.rig import Rig
from bench.rig.actuators import DRIVES, set_drive
from bench.rig.bodies import BODIES, set_body

LOCAL = ("damping", "frictionloss", "armature", "stiffness")
"""Parameters of joints."""


def with_nominal_values(rig: Rig, parameters: Iterable[NominalParameter]) -> mujoco.MjModel:
    """The compiled model of a rig, shapes of bodies included, with the values of nominal parameters in the place of its own.

    Args:
        rig: The user's model.
        parameters: ``mass:BODY``, ``damping:JOINT``, ``kp:ACTUATOR``, …; in the units of the model.

    Raises:
        UnknownNameError: A parameter is of no kind that a model has, or names nothing in it.
        ModelError: A body has no moment of inertia that could be scaled.
    """
    structure: dict[str, dict[str, float]] = {}
    drives: list[tuple[str, str, float]] = []
    bodies: list[tuple[str, str, float]] = []
    for parameter in parameters:
        kind, _, target = parameter.name.partition(":")
        if kind in DRIVES:
            drives.append((kind, target, parameter.value))
        elif kind in BODIES:
            bodies.append((kind, target, parameter.value))
        elif kind in LOCAL:
            structure.setdefault(kind, {})[target] = parameter.value
        else:
            raise UnknownNameError(
                "parameter", parameter.name, [f"{k}:NAME" for k in (*BODIES, *LOCAL, *DRIVES)]
            )
    model = copy.copy(rig.with_structure(**structure).shaped)
    known = [body_name(model, i) for i in range(1, model.nbody)]
    for kind, name, value in bodies:
        if name not in known:
            raise UnknownNameError(f"target of parameter '{kind}:{name}'", name, known)
        set_body(model, known.index(name) + 1, kind, value)
    if bodies:
        mujoco.mj_setConst(model, mujoco.MjData(model))
    actuators = [model.actuator(u).name for u in range(model.nu)]
    for kind, name, value in drives:
        if name not in actuators:
            raise UnknownNameError(f"target of parameter '{kind}:{name}'", name, actuators)
        set_drive(model, actuators.index(name), kind, value)
    return model
