"""Numbers of the model that are wrong: nominal parameters as re-estimated, and errors of masses, stiffness and damping."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import mujoco
import numpy as np

from bench.discrepancy.application.drives import set_delay, set_kp
from bench.discrepancy.application.forces import damping_error, values_of
from bench.discrepancy.application.target import Change, Target, with_first
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.verdict import NamedEffect, NominalEstimate
from bench.errors import UnknownNameError
from bench.rig.actuators import DRIVES, write_drive
from bench.rig.bodies import AXES, BODIES, scaled_inertia
from bench.rig.gravity import tilted


def nominal_parameter(target: Target, estimate: NominalEstimate) -> Change:
    """Write a nominal parameter as it was re-estimated.

    Raises:
        UnknownNameError: The model has nothing of its name.
    """
    kind, _, name = estimate.name.partition(":")
    anchor = _set(target, kind, name, estimate.value, estimate.name)
    text = f"{kind} {estimate.stated:.6g} -> {estimate.value:.6g} ± {estimate.std:.2g}: {estimate.shift_in_std:+.2f} stated sigmas"
    if estimate.stated_factor > 1.0:
        text += f" of a factor of {estimate.stated_factor:.3g}"
    return Change(estimate.name, name, "number", text, (anchor,))


def _set(target: Target, kind: str, name: str, value: float, label: str) -> tuple[str, str]:
    if kind in BODIES:
        body = target.body(name or _only_body(target))
        if kind == "mass":
            body.mass = value
        elif kind == "inertia":
            body.inertia = scaled_inertia(target.nominal, target.nominal.body(body.name).id, value)
        else:
            body.ipos = np.where(np.arange(3) == AXES.index(kind), value, body.ipos)
        return "body", body.name
    if kind in ("stiffness", "damping"):
        item: Any = target.joint_or_tendon(name)
        with_first(item, **{kind: value})
        return target.kind(name), item.name
    if kind in ("frictionloss", "armature"):
        item = target.joint_or_tendon(name)
        setattr(item, kind, value)
        return target.kind(name), item.name
    actuator = target.actuator(name)
    if kind == "kp":
        set_kp(target, actuator, value)
    elif kind == "delay":
        set_delay(target, actuator, value)
    elif kind in DRIVES:
        write_drive(actuator, kind, value)
    else:
        raise UnknownNameError(
            "parameter of the verdict", label, ["mass:BODY", "stiffness:JOINT", "kp:ACTUATOR"]
        )
    return "actuator", actuator.name


def _only_body(target: Target) -> str:
    return target.spec.joint(target.named("")).parent.name


def wrong_number(target: Target, effect: NamedEffect, nominal: Collection[str]) -> Change:
    """An error of a mass, a stiffness, a damping or the direction of gravity that a verdict names.

    Of a linear structure it is an error of the nominal parameter in `channel`, and the estimate of that holds it already.
    """
    v = values_of(effect)
    if "payload" in v or "shift_x" in v:
        return _inertial(target, effect)
    if "added" in v:
        return damping_error(target, effect)
    if "tilt_x" in v:
        return _base_tilt(target, effect)
    label = effect.channel or effect.where
    if label in nominal:
        return Change(
            effect.name,
            label,
            "number",
            f"the estimate of '{label}' holds it ({100 * v['relative_error']:+.3g} %)",
        )
    kind, _, name = label.partition(":")
    value = current(target.nominal, kind, name or target.named("")) * (1.0 + v["relative_error"])
    anchor = _set(target, kind, name, value, label)
    return Change(
        effect.name, label, "number", f"{kind} -> {value:.6g} ({100 * v['relative_error']:+.3g} %)", (anchor,)
    )


def current(model: mujoco.MjModel, kind: str, name: str) -> float:
    """A mass, stiffness or damping as a model has it.

    Raises:
        UnknownNameError: It is something else.
    """
    if kind == "mass":
        return float(model.body(name).mass[0])
    if kind in ("stiffness", "damping"):
        return float(np.ravel(getattr(model.joint(name), kind))[0])
    raise UnknownNameError(
        "parameter of the verdict", f"{kind}:{name}", ["mass:BODY", "stiffness:JOINT", "damping:JOINT"]
    )


def _inertial(target: Target, effect: NamedEffect) -> Change:
    """A payload at the tip of a body, or its centre of mass elsewhere: the composite as the diagnosis has it."""
    v, name = values_of(effect), effect.where
    body = target.body(name)
    now = target.spec.compile()
    model = ArticulatedModel.of(now)
    if "payload" in v:
        model = model.with_payload(name, v["payload"])
        text = f"{v['payload']:.6g} kg at {_point(model.tips[name])} m of the body, its tip"
    else:
        shift = np.array([v["shift_x"], v["shift_y"], v["shift_z"]])
        model = model.with_centre(name, shift)
        text = f"centre of mass moved by {_point(shift)} m"
    i = model.model.body(name).id
    body.mass = float(model.model.body_mass[i])
    body.ipos, body.iquat = model.model.body_ipos[i], model.model.body_iquat[i]
    body.inertia = model.model.body_inertia[i]
    return Change(effect.name, name, "native", text, (("body", name),))


def _base_tilt(target: Target, effect: NamedEffect) -> Change:
    """A base that leans: the vector of gravity in its frame."""
    v = values_of(effect)
    before = np.array(target.spec.option.gravity)
    after = tilted(before, v["tilt_x"], v["tilt_y"])
    target.spec.option.gravity = after
    text = f"gravity {_point(before)} -> {_point(after)} m/s^2 in the frame of the base"
    return Change(effect.name, effect.where, "native", text)


def _point(row: np.ndarray) -> str:
    return "(" + ", ".join(f"{x:.4g}" for x in row) + ")"
