"""What the channels and parameters of a case are measured in, as the user's own MJCF says.

A joint that slides is measured in metres, one that turns in radians; sensors and actuators follow from what they are attached to.
MuJoCo itself has no units: an actuator whose gear or gain is not one may be driven by a torque before the gear, a current or a
voltage, and all of these are accepted there.
"""

from __future__ import annotations

import mujoco

from bench.discrepancy.case.case import ORDERS, Case, CaseChannel
from bench.discrepancy.case.unit_conversion import Expectation
from bench.rig import Rig
from bench.rig.actuators import commanded
from bench.rig.bodies import AXES

TURNS = {
    "position": ("rad",), "velocity": ("rad/s",), "acceleration": ("rad/s^2",), "load": ("N m",),
    "inertia": ("kg m^2", "kg m^2/rad", "kg m^2/rad^2"), "stiffness": ("N m/rad", "N m"), "damping": ("N m s/rad", "N m s"),
}  # fmt: skip
SLIDES = {
    "position": ("m",), "velocity": ("m/s",), "acceleration": ("m/s^2",), "load": ("N",),
    "inertia": ("kg",), "stiffness": ("N/m",), "damping": ("N s/m",),
}  # fmt: skip
DRIVES = ("A", "V", "1", "Pa", "rad", "m", "rad/s", "m/s")
"""Units of what may drive an actuator whose gear or gain turns it into a force: the target of a servo, too, written as a motor beside a
spring or a damper of the joint."""
PARAMETERS = {"stiffness": "stiffness", "damping": "damping", "armature": "inertia", "frictionloss": "load"}

SERVO = {"kp": "stiffness", "kv": "damping"}
"""Gains of a servo, which are a stiffness and a damping of its joint; a gear, and the gain of anything else, may be in any unit."""


def expected_units(case: Case, rig: Rig) -> tuple[dict[str, Expectation], dict[str, Expectation]]:
    """What the channels and the parameters of a case are measured in, where the model tells.

    Args:
        case: The case; what names nothing in the model is left to `mjcf_structure` to refuse.
        rig: The user's model.
    """
    channels = {c.name: found for c in case.channels if (found := _channel(c, rig)) is not None}
    parameters = {
        p.name: found for p in case.parameters if (found := _parameter(p.name, rig.model)) is not None
    }
    return channels, parameters


def _parameter(name: str, model: mujoco.MjModel) -> Expectation | None:
    kind, _, target = name.partition(":")
    if kind == "mass":
        return Expectation(("kg",), "it is a mass")
    if kind == "inertia":
        return Expectation(("kg m^2",), "it is a moment of inertia")
    if kind in AXES:
        return Expectation(("m",), "it is a coordinate of a centre of mass")
    if kind in SERVO:
        return _gain(name, model, SERVO[kind])
    if kind not in PARAMETERS:
        return None
    return _of_coordinate(model, target, PARAMETERS[kind])


def _gain(name: str, model: mujoco.MjModel, quantity: str) -> Expectation | None:
    """A gain of a servo without a gear."""
    actuator = name.partition(":")[2]
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, actuator)
    if index < 0 or commanded(model, index) != "position":
        return None
    return _at_actuator(model, actuator, quantity)


def _of_coordinate(model: mujoco.MjModel, name: str, quantity: str) -> Expectation | None:
    """A quantity along a joint or a tendon."""
    joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
    if joint >= 0:
        kinds = {_turns(model, joint)}
        label = f"joint '{name}'"
    else:
        tendon = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TENDON, name)
        if tendon < 0:
            return None
        kinds = _of_tendon(model, tendon)
        label = f"tendon '{name}'"
    if None in kinds:
        return None
    if len(kinds) > 1:  # a lever between joints that slide and joints that turn: its coefficients decide
        return Expectation(
            SLIDES[quantity] + TURNS[quantity], f"{label} joins joints that slide and that turn"
        )
    return _along(label, bool(next(iter(kinds))), quantity)


def _along(label: str, turns: bool, quantity: str) -> Expectation:
    return Expectation((TURNS if turns else SLIDES)[quantity], f"{label} {'turns' if turns else 'slides'}")


def _turns(model: mujoco.MjModel, joint: int) -> bool | None:
    kind = int(model.jnt_type[joint])
    if kind == int(mujoco.mjtJoint.mjJNT_HINGE):
        return True
    return False if kind == int(mujoco.mjtJoint.mjJNT_SLIDE) else None


def _of_tendon(model: mujoco.MjModel, tendon: int) -> set[bool | None]:
    """Whether the joints of a fixed tendon turn; a spatial tendon has a length."""
    first, count = int(model.tendon_adr[tendon]), int(model.tendon_num[tendon])
    wraps = range(first, first + count)
    if any(int(model.wrap_type[w]) != int(mujoco.mjtWrap.mjWRAP_JOINT) for w in wraps):
        return {False}
    return {_turns(model, int(model.wrap_objid[w])) for w in wraps}


def _channel(channel: CaseChannel, rig: Rig) -> Expectation | None:
    kind, _, name = channel.target.rpartition(":")
    name = name or channel.name
    if kind == "joint":
        return _of_coordinate(rig.model, name, channel.quantity) if channel.quantity in ORDERS else None
    actuators = rig.actuators
    sensor = mujoco.mj_name2id(rig.model, mujoco.mjtObj.mjOBJ_SENSOR, name)
    if kind != "actuator" and (sensor >= 0 or kind == "sensor" or name not in actuators):
        return _sensor(name, rig)
    return _command(rig.model, name) if name in actuators else None


def _sensor(name: str, rig: Rig) -> Expectation | None:
    """A sensor by its name or by that of one of its components."""
    model = rig.model
    plain = name if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SENSOR, name) >= 0 else name[:-2]
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SENSOR, plain)
    if index < 0:
        return None
    kind = mujoco.mjtSensor(int(model.sensor_type[index])).name.removeprefix("mjSENS_")
    if kind in {"ACTUATORPOS", "ACTUATORVEL", "ACTUATORFRC"}:
        actuator = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_ACTUATOR, int(model.sensor_objid[index]))
        quantity = {"POS": "position", "VEL": "velocity", "FRC": "load"}[kind[-3:]]
        return _at_actuator(model, actuator, quantity)
    found = next((c for c in rig.channels if c.name in {plain, f"{plain}_x"} and c.role == "measured"), None)
    if found is None or found.unit in {"", "1"}:
        return None
    if kind in {"TENDONPOS", "TENDONVEL"}:
        tendon = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_TENDON, int(model.sensor_objid[index]))
        return _of_coordinate(model, tendon, "position" if kind == "TENDONPOS" else "velocity")
    return Expectation((found.unit,), f"sensor '{plain}' of the model reads {_article(found.quantity)}")


def _article(quantity: str) -> str:
    return f"{'an' if quantity[:1] in 'aeiou' else 'a'} {quantity}"


def _command(model: mujoco.MjModel, name: str) -> Expectation | None:
    """What drives an actuator: a force, or the position or velocity that a servo follows."""
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name)
    asked = commanded(model, index)
    if asked in {"position", "velocity"}:
        return _at_actuator(model, name, asked)
    if asked == "voltage":
        return Expectation(("V",), f"actuator '{name}' of the model takes a voltage")
    return _at_actuator(model, name, "load", gain=float(model.actuator_gainprm[index, 0]))


def _at_actuator(model: mujoco.MjModel, name: str, quantity: str, *, gain: float = 1.0) -> Expectation | None:
    """A quantity on the side of an actuator: that of its joint where nothing is in between, else in any unit that its gear may have."""
    index = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name)
    kind = mujoco.mjtTrn(int(model.actuator_trntype[index]))
    target = int(model.actuator_trnid[index, 0])
    if kind in {mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT}:
        named = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, target)
        found = _of_coordinate(model, named, quantity)
    elif kind == mujoco.mjtTrn.mjTRN_TENDON:
        found = _of_coordinate(model, mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_TENDON, target), quantity)
    else:
        return None
    if found is None:
        return None
    gear = float(model.actuator_gear[index, 0])
    reason = f"actuator '{name}' acts where {found.reason}"
    if abs(gear) == 1.0 and abs(gain) == 1.0:
        return Expectation(found.units, reason)
    units = (*found.units, *SLIDES[quantity], *TURNS[quantity], *(DRIVES if quantity == "load" else ()))
    return Expectation(
        tuple(dict.fromkeys(units)), f"{reason} through a gear of {gear:g} and a gain of {gain:g}"
    )
