"""What a rig's records hold: names, quantities and units of the channels, read off the compiled model."""

from __future__ import annotations

import mujoco

from bench.recording import Channel
from bench.rig.actuators import commanded
from bench.rig.building import Built, PlacedElement

_VECTOR_UNITS = {
    mujoco.mjtSensor.mjSENS_ACCELEROMETER: ("acceleration", "m/s^2"),
    mujoco.mjtSensor.mjSENS_VELOCIMETER: ("velocity", "m/s"),
    mujoco.mjtSensor.mjSENS_GYRO: ("angular velocity", "rad/s"),
    mujoco.mjtSensor.mjSENS_FORCE: ("force", "N"),
    mujoco.mjtSensor.mjSENS_TORQUE: ("torque", "N m"),
    mujoco.mjtSensor.mjSENS_FRAMEPOS: ("displacement", "m"),
    mujoco.mjtSensor.mjSENS_FRAMELINVEL: ("velocity", "m/s"),
    mujoco.mjtSensor.mjSENS_FRAMELINACC: ("acceleration", "m/s^2"),
    mujoco.mjtSensor.mjSENS_FRAMEANGVEL: ("angular velocity", "rad/s"),
    mujoco.mjtSensor.mjSENS_FRAMEANGACC: ("angular acceleration", "rad/s^2"),
}
_TRANSLATION = {"displacement": "m", "velocity": "m/s", "force": "N"}
_ROTATION = {"rotation": "rad", "angular velocity": "rad/s", "torque": "N m"}


def _rotational(model: mujoco.MjModel, dof: int) -> bool:
    return int(model.jnt_type[model.dof_jntid[dof]]) == int(mujoco.mjtJoint.mjJNT_HINGE)


def _motion(model: mujoco.MjModel, dof: int) -> list[tuple[str, str]]:
    """(quantity, unit) of position, velocity and force along a degree of freedom."""
    return list((_ROTATION if _rotational(model, dof) else _TRANSLATION).items())


def _first_dof(model: mujoco.MjModel, kind: int, index: int) -> int:
    if kind == int(mujoco.mjtObj.mjOBJ_JOINT):
        return int(model.jnt_dofadr[index])
    if kind == int(mujoco.mjtObj.mjOBJ_TENDON):
        wrap = int(model.tendon_adr[index])
        if int(model.wrap_type[wrap]) == int(mujoco.mjtWrap.mjWRAP_JOINT):
            return int(model.jnt_dofadr[model.wrap_objid[wrap]])
        return -1
    if kind == int(mujoco.mjtObj.mjOBJ_ACTUATOR):
        transmission = mujoco.mjtTrn(int(model.actuator_trntype[index]))
        target = int(model.actuator_trnid[index, 0])
        if transmission == mujoco.mjtTrn.mjTRN_JOINT:
            return int(model.jnt_dofadr[target])
        if transmission == mujoco.mjtTrn.mjTRN_TENDON:
            return _first_dof(model, int(mujoco.mjtObj.mjOBJ_TENDON), target)
    return -1


def _sensor_quantity(model: mujoco.MjModel, sensor: int) -> tuple[str, str]:
    kind = mujoco.mjtSensor(int(model.sensor_type[sensor]))
    if kind in _VECTOR_UNITS:
        return _VECTOR_UNITS[kind]
    dof = _first_dof(model, int(model.sensor_objtype[sensor]), int(model.sensor_objid[sensor]))
    if dof < 0:
        return "", "1"
    position, velocity, force = _motion(model, dof)
    short = kind.name.removeprefix("mjSENS_")
    if short.endswith("POS"):
        return position
    if short.endswith("VEL"):
        return velocity
    return force if short.endswith("FRC") else ("", "1")


def _command_quantity(model: mujoco.MjModel, actuator: int) -> tuple[str, str]:
    """A motor's command is a force or a voltage; a servo's is the position or velocity it tracks."""
    dof = _first_dof(model, int(mujoco.mjtObj.mjOBJ_ACTUATOR), actuator)
    if dof < 0:
        return "", "1"
    position, velocity, force = _motion(model, dof)
    known = {"position": position, "velocity": velocity, "voltage": ("voltage", "V")}
    return known.get(commanded(model, actuator), force)


def rig_channels(built: Built) -> list[Channel]:
    """The channels of a rig's records: commands, sensors, then each element's."""
    model = built.model
    channels = []
    for name in built.actuators:
        quantity, unit = _command_quantity(
            model, mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name)
        )
        channels.append(Channel(name, unit, quantity=quantity, role="command"))
    for sensor in range(model.nsensor):
        name = model.sensor(sensor).name or f"sensor_{sensor}"
        quantity, unit = _sensor_quantity(model, sensor)
        size = int(model.sensor_dim[sensor])
        suffixes = (
            [""]
            if size == 1
            else ["_x", "_y", "_z", "_w"][:size]
            if size <= 4
            else [f"_{i}" for i in range(size)]
        )
        channels += [Channel(name + suffix, unit, quantity=quantity, role="measured") for suffix in suffixes]
    for item in built.placed:
        channels += _element_channels(model, item)
    return channels


def _element_channels(model: mujoco.MjModel, item: PlacedElement) -> list[Channel]:
    element = item.element
    moving = [coordinate for coordinate in item.coordinates if not coordinate.is_input]
    suffixes = [""] if len(moving) == 1 else [f"_{i + 1}" for i in range(len(moving))]
    channels = []
    for label, which in (("displacement", 0), ("velocity", 1), ("force", 2)):
        for coordinate, suffix in zip(moving, suffixes, strict=True):
            quantity, unit = _motion(model, coordinate.terms[0][1])[which]
            channels.append(Channel(f"{element.name}/{label}{suffix}", unit, quantity=quantity))
    for state in element.law.states:
        symbol, _, unit = state.partition(" [")
        channels.append(Channel(f"{element.name}/{symbol}", unit.rstrip("]") or "1"))
    return channels
