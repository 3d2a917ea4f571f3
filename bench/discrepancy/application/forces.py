"""Effects at a joint in MuJoCo's own terms: springs, dampers, stops, trains; else as a law or as Python before the step."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from bench.discrepancy.application.target import (
    PREFIX,
    TARGET_SETTINGS,
    Change,
    Target,
    as_mujoco,
    with_first,
)
from bench.discrepancy.articulated_effects.slot_setters import periods
from bench.discrepancy.verdict import NamedEffect
from bench.laws.carried_mass import spring_and_damper
from bench.rig.bodies import moved_by


@dataclass(frozen=True)
class ForcesSettings:
    """Numbers of `bench.discrepancy.application.forces`."""

    lever: float = 1e6
    """Length over the force of a spring that stands for a constant force: a motion of one unit changes it by a millionth."""


SETTINGS = ForcesSettings()


def values_of(effect: NamedEffect) -> dict[str, float]:
    """Values of the parameters by name."""
    return {name: float(estimate.value) for name, estimate in effect.parameters.items()}


def _polynomial(attribute: str, power: int) -> Callable[[Target, NamedEffect], Change]:
    """A higher coefficient of MuJoCo's stiffness or damping."""

    def change(target: Target, effect: NamedEffect) -> Change:
        coefficient = next(iter(values_of(effect).values()))
        item: Any = target.joint_or_tendon(effect.where)
        kind, name = target.kind(effect.where), item.name
        if attribute == "stiffness" and kind == "joint":
            zero = float(item.springref) / target.angle(name)
            if abs(zero - target.at_rest(name)) > 1e-9:
                item = target.tendon_on(effect.where, effect.name)
                item.springlength = (target.at_rest(name),) * 2
                kind = "fixed"
        coefficients = np.array(getattr(item, attribute), dtype=float)
        before = coefficients.copy()
        coefficients[power] += coefficient
        setattr(item, attribute, coefficients)
        text = f"{attribute} {_numbers(before)} -> {_numbers(coefficients)}: {effect.equation}"
        return Change(effect.name, name, "native", text, ((kind, item.name),))

    return change


def _numbers(row: Sequence[float] | np.ndarray) -> str:
    return " ".join(f"{x:.6g}" for x in row)


def damping_error(target: Target, effect: NamedEffect) -> Change:
    """Viscous damping of a joint that a drive model lacks."""
    item = target.joint_or_tendon(effect.where)
    before = float(item.damping[0])
    after = before + values_of(effect)["added"]
    with_first(item, damping=after)
    text = f"damping {before:.6g} -> {after:.6g}"
    return Change(effect.name, item.name, "native", text, (("joint", item.name),))


def armature_error(target: Target, effect: NamedEffect) -> Change:
    """Inertia of the motor behind the gear."""
    item = target.joint_or_tendon(effect.where)
    before = float(item.armature)
    item.armature = before + values_of(effect)["added"]
    text = f"armature {before:.6g} -> {item.armature:.6g}"
    return Change(effect.name, item.name, "native", text, (("joint", item.name),))


def gravity_compensation(target: Target, effect: NamedEffect) -> Change:
    """``gravcomp``: the part of a body's weight that does not act."""
    body = target.body(effect.where)
    before = float(body.gravcomp)
    body.gravcomp = before + values_of(effect)["share"]
    text = f"gravcomp {before:.6g} -> {body.gravcomp:.6g}"
    return Change(effect.name, effect.where, "native", text, (("body", effect.where),))


def force_offset(target: Target, effect: NamedEffect) -> Change:
    """A constant force: a spring so long that its force is one."""
    v = values_of(effect)
    force = v["force"] if "force" in v else -v["offset"]
    name = target.named(effect.where)
    tendon = target.tendon_on(effect.where, effect.name)
    with_first(tendon, stiffness=abs(force) / SETTINGS.lever)
    tendon.springlength = (math.copysign(SETTINGS.lever, force),) * 2
    text = f"a constant force of {force:.6g} on '{name}', of a spring whose end is {SETTINGS.lever:.0e} away"
    return Change(effect.name, name, "native", text, (("fixed", tendon.name),))


def gap(target: Target, effect: NamedEffect) -> Change:
    """Stops on either side."""
    v, name = values_of(effect), target.named(effect.where)
    middle = target.at_rest(name)
    if "clearance" in v:
        limits = (middle - v["clearance"], middle + v["clearance"])
        anchor = target.stop(effect.where, limits, v["stiffness"], 0.0, own=True)
        anchors = (anchor,)
        text = (
            f"range with limits that are springs of {v['stiffness']:.6g}, {v['clearance']:.6g} to either side"
        )
    else:
        up, down = v["clearance_positive"], v["clearance_negative"]
        anchors = (
            target.stop(
                effect.where, (-TARGET_SETTINGS.far, middle + up), v["stiffness_positive"], 0.0, own=True
            ),
            target.stop(
                effect.where, (middle - down, TARGET_SETTINGS.far), v["stiffness_negative"], 0.0, own=False
            ),
        )
        text = f"limits that are springs: {v['stiffness_positive']:.6g} beyond {up:.6g}, {v['stiffness_negative']:.6g} below {-down:.6g}"
    return Change(effect.name, name, "native", text, tuple(_anchor(a) for a in anchors))


def one_sided_stop(target: Target, effect: NamedEffect) -> Change:
    """A stop on one side."""
    v, name = values_of(effect), target.named(effect.where)
    at = v["position"] + target.at_rest(name)
    limits = (-TARGET_SETTINGS.far, at) if v["side"] > 0.0 else (at, TARGET_SETTINGS.far)
    anchor = target.stop(effect.where, limits, v["stiffness"], v.get("damping", 0.0), own=True)
    text = f"range with a limit at {at:.6g} that is a spring of {v['stiffness']:.6g} and a damper of {v.get('damping', 0.0):.6g}"
    return Change(effect.name, name, "native", text, (_anchor(anchor),))


def _anchor(text: str) -> tuple[str, str]:
    kind, _, name = text.partition(":")
    return kind, name


def elastic_train(target: Target, effect: NamedEffect) -> Change:
    """Backlash or compliance of a drive: the joint becomes the motor's, and a second joint on the same axis is its train."""
    v, name = values_of(effect), target.named(effect.where)
    joint = target.spec.joint(name)
    train = joint.parent.add_joint(
        name=f"{PREFIX}{name}_train", type=joint.type, axis=joint.axis, pos=joint.pos
    )
    as_mujoco(train)
    width = v.get("half_clearance", 0.0)
    if width > 0.0:
        target.stop(train.name, (-width, width), v["stiffness"], v["damping"], own=True)
    else:
        with_first(train, stiffness=v["stiffness"], damping=v["damping"])
    whole = float(joint.armature)
    joint.armature = v["motor_share"] * whole
    link = target.tendon_on(name, "link")
    link.wrap_joint(train.name, 1.0)
    link.armature = (1.0 - v["motor_share"]) * whole
    if np.any(np.asarray(joint.stiffness)):
        link.stiffness = joint.stiffness
        link.springlength = (float(joint.springref) / target.angle(name),) * 2
        joint.stiffness = np.zeros_like(np.asarray(joint.stiffness))
    side = "motor"
    if v.get("encoder_on_link", 0.0) > 0.5:
        target.outputs[name], side = link.name, "link"
        _read_link(target, name, link.name)
    text = (
        f"'{name}' is the motor's joint now (armature {whole:.6g} -> {joint.armature:.6g}), '{train.name}' the train behind it; "
        f"the link's angle is the length of the tendon '{link.name}'; the encoder sits on the {side}"
    )
    return Change(
        effect.name, name, "native", text, (("joint", name), ("joint", train.name), ("fixed", link.name))
    )


def _read_link(target: Target, joint: str, link: str) -> None:
    """Have the sensors of a joint read its link."""
    kinds = {
        mujoco.mjtSensor.mjSENS_JOINTPOS: mujoco.mjtSensor.mjSENS_TENDONPOS,
        mujoco.mjtSensor.mjSENS_JOINTVEL: mujoco.mjtSensor.mjSENS_TENDONVEL,
    }
    for sensor in target.spec.sensors:
        if sensor.type in kinds and sensor.objname == joint:
            sensor.type, sensor.objtype, sensor.objname = kinds[sensor.type], mujoco.mjtObj.mjOBJ_TENDON, link


def carried_mass(target: Target, effect: NamedEffect) -> Change:
    """A part of a body on a spring of its own: a second body at the same place, which moves along the axis of the joint."""
    name = target.named(effect.where)
    joint = target.spec.joint(name)
    if joint is None:
        return element(target, effect)
    body, carried = target.body(joint.parent.name), effect.theta[0]
    whole = moved_by(target.spec.compile(), name)
    part = carried / whole
    if part >= 1.0:
        text = f"it carries {carried:.6g} of the {whole:.6g} that '{body.name}' has itself: divide the bodies behind it"
        return Change(effect.name, name, "none", text)
    rest = np.array(body.inertia)
    second = body.add_body(name=f"{PREFIX}{name}_mass", explicitinertial=True)
    second.ipos, second.iquat = body.ipos, body.iquat
    second.mass, second.inertia = part * body.mass, part * rest
    body.mass, body.inertia = (1.0 - part) * body.mass, (1.0 - part) * rest
    spring = second.add_joint(name=f"{PREFIX}{name}_spring", type=joint.type, axis=joint.axis, pos=joint.pos)
    as_mujoco(spring)
    stiffness, damping = spring_and_damper(*effect.theta)
    with_first(spring, stiffness=stiffness, damping=damping)
    text = (
        f"{100.0 * part:.3g} % of '{body.name}' is the body '{second.name}' now, on the joint '{spring.name}' of stiffness "
        f"{stiffness:.6g} and damping {damping:.6g}"
    )
    return Change(effect.name, name, "native", text, (("body", second.name), ("joint", spring.name)))


OF_A_RECORD = {
    "timed_force": "its windows are those of the first record, others have their own",
    "harmonic_force": "its phase is that of the first record, others have their own",
    "record_dependent_": "its size is the mean of that in the records",
    "scheduled_": "it stands in the model at the reference s0, or the mean, alone; to follow the channel is left to your loop",
}
"""What of an effect the corrected model does not hold, since it is a record's own or follows a channel, by the beginning of its name."""


def not_in_model(effects: Sequence[NamedEffect]) -> str:
    """What of some effects the corrected model does not hold, in words; empty where it holds all."""
    pairs = (
        (e.name, text) for e in effects for start, text in OF_A_RECORD.items() if e.name.startswith(start)
    )
    return "; ".join(f"of {name}, {text}" for name, text in pairs)


def element(target: Target, effect: NamedEffect) -> Change:
    """A law of the bench as a native callback, for what MuJoCo has no form of that is exact enough."""
    v, name = values_of(effect), target.named(effect.where)
    law, theta = effect.law, effect.theta
    if not law and effect.name == "presliding_friction":
        law, theta = "lugre", (v["limit"], v["stiffness"], v["damping"], 0.0, 1.0, 0.0)
    elif not law and effect.name == "cogging":
        amplitude, phase = math.hypot(v["sine"], v["cosine"]), math.atan2(v["cosine"], v["sine"])
        law, theta = "cogging", (amplitude, 2.0 * math.pi / periods(v), phase)
    if not law:
        return Change(
            effect.name, name, "none", "neither MuJoCo nor the bench has a form of it; correct it where it is"
        )
    note = (
        f"; it counts from the rest of the model, {target.at_rest(name):.4g}: shift the joint's ref"
        if target.at_rest(name)
        else ""
    )
    own = (text for beginning, text in OF_A_RECORD.items() if effect.name.startswith(beginning))
    note += next((f"; {text}" for text in own), "")
    return Change(
        effect.name, name, "callback", f"the law '{law}' as a native callback, in the snippet: {effect.equation}{note}",
        (("joint", name),), (law, (name,), tuple(theta)),
    )  # fmt: skip


def follows_channel(target: Target, effect: NamedEffect) -> Change:
    """A stiffness or damping that follows a channel about its mean, where the nominal parameter is what it is."""
    text = "the nominal parameter is its mean over the records; to follow the channel is left to your loop"
    return Change(effect.name, target.named(effect.where), "none", text)


FORCES: dict[str, Callable[[Target, NamedEffect], Change]] = {
    "cubic_stiffness": _polynomial("stiffness", 2),
    "quadratic_stiffness": _polynomial("stiffness", 1),
    "quadratic_damping": _polynomial("damping", 1),
    "force_offset": force_offset,
    "armature_error": armature_error,
    "gravity_compensation": gravity_compensation,
    "carried_mass": carried_mass,
    "gap": gap,
    "asymmetric_gap": gap,
    "one_sided_stop": one_sided_stop,
    "joint_compliance": elastic_train,
    "backlash": elastic_train,
    "scheduled_stiffness": follows_channel,
    "scheduled_damping": follows_channel,
}
"""Effects at a joint that have a form other than a law; those that are a wrong number are told apart in `numbers`."""
