"""What is wrong with a robot: each function here makes a fault, which tells its name and gives a changed machine.

The equations by which a fault acts stand in `drives` and `friction`. Names are those of the diagnosis, where it has one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from fourth_robots_cases.machine import Hose, Machine
from fourth_robots_cases.robots import Robot

_Group = TypeVar("_Group", bound=tuple)


@dataclass(frozen=True)
class Fault:
    """A fault that is planted.

    Attributes:
        name: Of the effect.
        where: Joint or servo; joints with a plus between them where there are several.
        parameters: True values, in SI units.
        act: Gives a machine that is changed at the joint of an index.
        named: Whether `name` is one of the diagnosis; otherwise the fault is foreign to it.
    """

    name: str
    where: str
    parameters: Mapping[str, Any]
    act: Callable[[Machine, int], Machine] = field(repr=False)
    named: bool = True

    def joint(self, robot: Robot) -> int:
        """Index of its joint, of the first where there are several."""
        return robot.joints.index(self.where.split("+")[0].removesuffix("_servo"))


def with_faults(machine: Machine, robot: Robot, faults: Iterable[Fault]) -> Machine:
    """A machine with faults; the one that is given stays as it is."""
    for fault in faults:
        machine = fault.act(machine, fault.joint(robot))
    return machine


def _at(values: NDArray[Any], j: int, value: float | bool) -> NDArray[Any]:
    """A copy of values (n) with another one at an index."""
    copy = values.copy()
    copy[j] = value
    return copy


def _changed(group: _Group, j: int, **values: float | bool) -> _Group:
    """A copy of a group of arrays (n) with other values at an index."""
    return group._replace(**{name: _at(getattr(group, name), j, value) for name, value in values.items()})


def one_sided_stop(
    joint: str, *, place: float, stiffness: float, damping: float, side: Literal[1, -1]
) -> Fault:
    """A rubber stop [N m/rad, N m s/rad] beyond a place [rad] (side 1) or before it (side -1)."""
    values = {"place": place, "stiffness": stiffness, "damping": damping, "side": side}

    def act(machine: Machine, j: int) -> Machine:
        return machine._replace(stop=_changed(machine.stop, j, **values))

    return Fault("one_sided_stop", joint, values, act)


def backlash(joint: str, *, gap: float, stiffness: float, damping: float) -> Fault:
    """Play of a full width [rad] between motor and link, with faces of a stiffness [N m/rad] and damping [N m s/rad]."""

    def act(machine: Machine, j: int) -> Machine:
        loose = _changed(
            machine.transmission, j, present=True, stiffness=stiffness, damping=damping, half_gap=gap / 2
        )
        return machine._replace(transmission=loose)

    return Fault("backlash", joint, {"gap": gap, "stiffness": stiffness, "damping": damping}, act)


def joint_compliance(joint: str, *, stiffness: float, damping: float) -> Fault:
    """An elastic transmission [N m/rad, N m s/rad] between motor and link."""

    def act(machine: Machine, j: int) -> Machine:
        elastic = _changed(machine.transmission, j, present=True, stiffness=stiffness, damping=damping)
        return machine._replace(transmission=elastic)

    return Fault("joint_compliance", joint, {"stiffness": stiffness, "damping": damping}, act)


def servo_gain_error(servo: str, *, gain: float) -> Fault:
    """A proportional gain that is a factor of what was drawn for it; the velocity gain is as drawn."""

    def act(machine: Machine, j: int) -> Machine:
        return machine._replace(servos=_changed(machine.servos, j, kp=machine.servos.kp[j] * gain))

    return Fault("servo_gain_error", servo, {"gain": gain}, act)


def damping_error(joint: str, *, more: float) -> Fault:
    """Viscous friction besides what was drawn [N m s/rad]."""

    def act(machine: Machine, j: int) -> Machine:
        passive = machine.passive
        return machine._replace(passive=_changed(passive, j, damping=passive.damping[j] + more))

    return Fault("damping_error", joint, {"more": more}, act)


def cogging(joint: str, *, amplitude: float, periods: float, phase: float) -> Fault:
    """Ripple of an amplitude [N m], with periods a turn and a phase [rad]."""
    values = {"amplitude": amplitude, "periods": periods, "phase": phase}

    def act(machine: Machine, j: int) -> Machine:
        return machine._replace(cogging=_changed(machine.cogging, j, **values))

    return Fault("cogging", joint, values, act)


def stribeck_friction(joint: str, *, static: float, coulomb: float, velocity: float) -> Fault:
    """Dry friction at rest and when sliding [N m], in the place of the background; see `machine.Friction`."""
    values = {"static": static, "coulomb": coulomb, "velocity": velocity}

    def act(machine: Machine, j: int) -> Machine:
        return machine._replace(friction=_changed(machine.friction, j, **values))

    return Fault("stribeck_friction", joint, values, act)


def coulomb_friction(joint: str, *, limit: float) -> Fault:
    """Dry friction of a limit [N m], in the place of the background."""

    def act(machine: Machine, j: int) -> Machine:
        return machine._replace(friction=_changed(machine.friction, j, static=limit, coulomb=limit))

    return Fault("coulomb_friction", joint, {"limit": limit}, act)


def hose(
    joints: tuple[str, str, str], *, levers: tuple[float, float, float], stiffness: float, slip: float, pretension: float
) -> Fault:  # fmt: skip
    """A hose over three joints, which are the first of the robot; see `machine.Hose` for its numbers."""
    laid = Hose(np.array(levers), stiffness, slip, pretension)

    def act(machine: Machine, j: int) -> Machine:
        return machine._replace(hose=laid)

    numbers = {"g": list(levers), "stiffness": stiffness, "slip": slip, "pretension": pretension}
    return Fault("hose", "+".join(joints), numbers, act, named=False)
