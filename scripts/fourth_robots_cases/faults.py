"""What is wrong with a robot: each function here makes a fault, which tells its name and gives a changed machine.

The equations by which a fault acts stand in `drives` and `friction`. Names are those of the diagnosis, where it has one.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from fourth_robots_cases.machine import Hose, Machine
from fourth_robots_cases.robots import Robot

_Group = TypeVar("_Group", bound=tuple)
_Machine = TypeVar("_Machine", bound=tuple)


@dataclass(frozen=True)
class Fault:
    """A fault that is planted.

    Attributes:
        name: Of the effect.
        where: Joint or servo; joints with a plus between them where there are several.
        parameters: True values, in SI units.
        act: Gives a machine of the set that is changed at the joint of an index.
        named: Whether `name` is one of the diagnosis; otherwise the fault is foreign to it.
        at: Name of its joint, where `where` does not tell it.
    """

    name: str
    where: str
    parameters: Mapping[str, Any]
    act: Callable[[Any, int], Any] = field(repr=False)
    named: bool = True
    at: str | None = None

    def joint(self, robot: Robot) -> int:
        """Index of its joint, of the first where there are several."""
        return robot.joints.index(self.at or self.where.split("+")[0].removesuffix("_servo"))


def kind_of(faults: Collection[Fault]) -> Literal["single", "double", "foreign", "none"]:
    """One effect, two, one that the catalogue of the diagnosis lacks (foreign), or none."""
    if not faults:
        return "none"
    if not all(fault.named for fault in faults):
        return "foreign"
    return "double" if len(faults) > 1 else "single"


def with_faults(machine: _Machine, robot: Robot, faults: Iterable[Fault]) -> _Machine:
    """A machine with faults; the one that is given stays as it is."""
    for fault in faults:
        machine = fault.act(machine, fault.joint(robot))
    return machine


def _at(values: NDArray[Any], j: int, value: float | bool) -> NDArray[Any]:
    """A copy of values (n) with another one at an index."""
    copy = values.copy()
    copy[j] = value
    return copy


def changed(group: _Group, j: int, **values: float | bool) -> _Group:
    """A copy of a group of arrays (n) with other values at an index."""
    return group._replace(**{name: _at(getattr(group, name), j, value) for name, value in values.items()})


def changing(group: str, **values: float | bool) -> Callable[[Any, int], Any]:
    """What changes values of a group of a machine at an index."""

    def act(machine: _Machine, j: int) -> _Machine:
        return machine._replace(**{group: changed(getattr(machine, group), j, **values)})

    return act


def one_sided_stop(
    joint: str, *, place: float, stiffness: float, damping: float, side: Literal[1, -1]
) -> Fault:
    """A rubber stop [N m/rad, N m s/rad] beyond a place [rad] (side 1) or before it (side -1)."""
    values = {"place": place, "stiffness": stiffness, "damping": damping, "side": side}
    return Fault("one_sided_stop", joint, values, changing("stop", **values))


def backlash(joint: str, *, gap: float, stiffness: float, damping: float) -> Fault:
    """Play of a full width [rad] between motor and link, with faces of a stiffness [N m/rad] and damping [N m s/rad]."""
    act = changing("transmission", present=True, stiffness=stiffness, damping=damping, half_gap=gap / 2)
    return Fault("backlash", joint, {"gap": gap, "stiffness": stiffness, "damping": damping}, act)


def joint_compliance(joint: str, *, stiffness: float, damping: float) -> Fault:
    """An elastic transmission [N m/rad, N m s/rad] between motor and link."""
    act = changing("transmission", present=True, stiffness=stiffness, damping=damping)
    return Fault("joint_compliance", joint, {"stiffness": stiffness, "damping": damping}, act)


def servo_gain_error(servo: str, *, gain: float) -> Fault:
    """A proportional gain that is a factor of what was drawn for it; the velocity gain is as drawn."""

    def act(machine: Machine, j: int) -> Machine:
        return machine._replace(servos=changed(machine.servos, j, kp=machine.servos.kp[j] * gain))

    return Fault("servo_gain_error", servo, {"gain": gain}, act)


def damping_error(joint: str, *, more: float) -> Fault:
    """Viscous friction besides what was drawn [N m s/rad]."""

    def act(machine: Machine, j: int) -> Machine:
        passive = machine.passive
        return machine._replace(passive=changed(passive, j, damping=passive.damping[j] + more))

    return Fault("damping_error", joint, {"more": more}, act)


def cogging(joint: str, *, amplitude: float, periods: float, phase: float) -> Fault:
    """Ripple of an amplitude [N m], with periods a turn and a phase [rad]."""
    values = {"amplitude": amplitude, "periods": periods, "phase": phase}
    return Fault("cogging", joint, values, changing("cogging", **values))


def stribeck_friction(joint: str, *, static: float, coulomb: float, velocity: float) -> Fault:
    """Dry friction at rest and when sliding [N m], in the place of the background; see `machine.Friction`."""
    values = {"static": static, "coulomb": coulomb, "velocity": velocity}
    return Fault("stribeck_friction", joint, values, changing("friction", **values))


def coulomb_friction(joint: str, *, limit: float) -> Fault:
    """Dry friction of a limit [N m], in the place of the background."""
    act = changing("friction", static=limit, coulomb=limit)
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
