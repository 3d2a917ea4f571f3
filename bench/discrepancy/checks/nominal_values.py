"""Nominal values of a case beside those that stand in the user's MJCF."""

from __future__ import annotations

import mujoco
import numpy as np

from bench.discrepancy.case.case import Case, NominalParameter
from bench.discrepancy.settings import ModelSettings
from bench.errors import ModelError
from bench.identification.linear_rig import current
from bench.rig import Rig
from bench.rig.actuators import DRIVES, drive_value
from bench.rig.bodies import BODIES, body_value
from bench.rig.building import parse


def value_notes(case: Case, rig: Rig, *, settings: ModelSettings) -> tuple[str, ...]:
    """Nominal values that the model contradicts, a sentence each.

    Args:
        case: For the nominal values, in the units of the model.
        rig: The user's model.
        settings: `ModelSettings` of the diagnosis.
    """
    return tuple(note for parameter in case.parameters if (note := _note(parameter, rig, settings=settings)))


def _note(parameter: NominalParameter, rig: Rig, *, settings: ModelSettings) -> str:
    own = _own_value(parameter.name, rig)
    if own is None:
        return ""
    # what is stated as certain still has the digits that it is written with
    apart = abs(parameter.value - own)
    if apart <= settings.contradicts * parameter.std or apart <= 1e-3 * max(abs(own), abs(parameter.value)):
        return ""
    by = f"{apart / parameter.std:.3g} sigma" if parameter.std > 0.0 else "although it is stated as certain"
    factor = f", {parameter.value / own:.4g} times as much" if own else ""
    return (
        f"'{parameter.name}' is {parameter.value:.5g} {parameter.unit} in nominal.json and {own:.5g} in the model"
        f"{_sum(parameter.name, rig)}: {by} apart{factor}; the value of nominal.json is taken"
    )


def _own_value(name: str, rig: Rig) -> float | None:
    kind, _, target = name.partition(":")
    model = rig.model
    if kind in DRIVES:
        return _of_drive(model, kind, target)
    if kind in BODIES:
        body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, target)
        return body_value(model, body, kind) if body > 0 else None
    if kind == "frictionloss":
        joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, target)
        if joint >= 0:
            return float(model.dof_frictionloss[model.jnt_dofadr[joint]])
        tendon = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TENDON, target)
        return float(model.tendon_frictionloss[tendon]) if tendon >= 0 else None
    try:
        return current(rig, f"structure/{kind}/{target}")
    except (KeyError, ValueError):
        return None  # a name that the model lacks is refused with the known ones elsewhere


def _of_drive(model: mujoco.MjModel, kind: str, name: str) -> float | None:
    """Gain of the input, velocity gain, gear or largest force of an actuator."""
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name)
    try:
        return drive_value(model, index, kind) if index >= 0 else None
    except ModelError:
        return None  # refused with reasons where the model is taken apart


def _sum(name: str, rig: Rig) -> str:
    """The bodies that a mass is the sum of: MuJoCo's static bodies are welded to the one that carries them."""
    kind, _, target = name.partition(":")
    if kind not in {"mass", "inertia"}:
        return ""
    model = parse(rig.mjcf, rig.folder, rig.name).compile()
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, target)
    welded = np.flatnonzero(model.body_weldid == body)
    if body < 0 or len(welded) < 2:
        return ""
    parts = ", ".join(f"'{model.body(i).name or f'body {i}'}' {model.body_mass[i]:.4g} kg" for i in welded)
    return f" (the sum of what is welded together: {parts})"
