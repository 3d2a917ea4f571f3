"""Where a free parameter of a rig stands in its compiled model."""

from __future__ import annotations

from typing import NamedTuple

import mujoco

from bench.errors import ParameterError, UnknownNameError
from bench.rig import Rig
from bench.rig.building import STRUCTURE


class ParameterAddress(NamedTuple):
    """Where a free parameter stands in a compiled model: ``getattr(model, field)[index]``."""

    field: str
    index: int


def address(rig: Rig, name: str) -> ParameterAddress:
    """Find a free parameter in the compiled model.

    Args:
        rig: The rig.
        name: "structure/<quantity>/<body, joint or tendon>" or "<element>/<parameter>".

    Raises:
        UnknownNameError: The rig has no such quantity, body, joint, element or parameter.
        ParameterError: The element is exact friction, which has no smooth response.
    """
    first, _, rest = name.partition("/")
    if first == "structure" and "/" in rest:
        return _structural(rig.model, *rest.split("/", 1))
    label, _, parameter = name.rpartition("/")
    element = rig.element(label)
    if element.exact:
        raise ParameterError(f"element '{label}' is exact friction; make it with exact=False to fit it")
    if parameter not in element.law.parameter_names:
        raise UnknownNameError(f"parameter of element '{label}'", parameter, element.law.parameter_names)
    item = next(item for item in rig.built.placed if item.element.name == label)
    place = len(element.law.header) + element.law.parameter_names.index(parameter)
    return ParameterAddress("numeric_data", item.theta + place)


def _structural(model: mujoco.MjModel, kind: str, name: str) -> ParameterAddress:
    kinds = mujoco.mjtObj
    if kind not in STRUCTURE or kind == "frictionloss":
        raise UnknownNameError(
            "structural quantity", kind, [entry for entry in STRUCTURE if entry != "frictionloss"]
        )
    if kind in {"mass", "inertia"}:
        body = mujoco.mj_name2id(model, kinds.mjOBJ_BODY, name)
        if body < 0:
            raise UnknownNameError("body", name, [model.body(i).name for i in range(1, model.nbody)])
        return ParameterAddress(f"body_{kind}", body)
    joint = mujoco.mj_name2id(model, kinds.mjOBJ_JOINT, name)
    if joint >= 0:
        if kind == "stiffness":
            return ParameterAddress("jnt_stiffness", joint)
        return ParameterAddress(f"dof_{kind}", int(model.jnt_dofadr[joint]))
    tendon = mujoco.mj_name2id(model, kinds.mjOBJ_TENDON, name)
    if tendon < 0:
        joints = [model.joint(i).name for i in range(model.njnt)]
        raise UnknownNameError(
            "joint or tendon", name, joints + [model.tendon(i).name for i in range(model.ntendon)]
        )
    return ParameterAddress(f"tendon_{kind}", tendon)
