"""What is assumed of a model of which nobody said how sure he is: the parameters that may be wrong, and by how much."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import NamedTuple

import mujoco
import numpy as np

from bench.discrepancy.case.case import NominalParameter
from bench.errors import ParameterError, UnknownNameError
from bench.rig.actuators import DRIVES, JointDrive, commanded, drive_of

_TURNING = int(mujoco.mjtJoint.mjJNT_HINGE)


@dataclass(frozen=True)
class Assumptions:
    """One-sigma uncertainties of nominal parameters: shares of their values, or factors, above one, to within which they are known.

    They are those of a model that somebody made with care from drawings and data sheets: masses from CAD are right within some
    percent (cables, screws and tolerances are not drawn), stiffnesses within ten (10 % is what spring makers tolerate, DIN EN 15800),
    while damping, friction and rotor inertia are usually guessed. The gains of a position servo in newton metres are a number of its
    firmware times what nobody has measured: public models of one arm, the SO-101, have 17.8 and 998 N m/rad. State your own in the
    nominal.json that `jointbench init` writes, or by `--assume`.

    Attributes:
        mass: Of the mass of a body.
        stiffness: Of the spring of a joint.
        damping: Of the damping of a joint.
        frictionloss: Of its dry friction.
        armature: Of the inertia of a rotor.
        kp: Of the position gain of a servo.
        kv: Of its velocity gain.
        forcerange: Of the force of a DC motor at full voltage.
        twins: Scatter of drives with equal numbers, which are taken for ones of one type; small DC motors of one type differ by some ten
            percent.
        judging: Share at the end of a single log that judges.
    """

    mass: float = 0.05
    stiffness: float = 0.1
    damping: float = 0.3
    frictionloss: float = 0.3
    armature: float = 0.3
    kp: float = 10.0
    kv: float = 10.0
    forcerange: float = 0.1
    twins: float = 0.1
    judging: float = 1.0 / 3.0

    def changed(self, spreads: Mapping[str, str]) -> Assumptions:
        """Others, by name and number.

        Raises:
            UnknownNameError: A name is none of these.
            ParameterError: A number is none, or not positive.

        Examples:
            >>> Assumptions().changed({"kp": "0.1"}).kp
            0.1
        """
        known = [field.name for field in fields(self) if field.name != "judging"]
        found = {}
        for name, text in spreads.items():
            if name not in known:
                raise UnknownNameError("assumption", name, known)
            try:
                found[name] = float(text)
            except ValueError:
                found[name] = float("nan")
            if not 0.0 < found[name] < np.inf or found[name] == 1.0:
                raise ParameterError(
                    f"{name} = {text} came; a share below 1 is expected, such as 0.1 of a number known to 10 %, or a factor above 1, such "
                    "as 10 of one of which the order of magnitude is known"
                )
        return replace(self, **found)


class Assumed(NamedTuple):
    """A nominal parameter with what is assumed of it, see `NominalParameter`."""

    name: str
    value: float
    spread: float
    unit: str
    alike: str = ""
    twins: float = 0.0

    @property
    def entry(self) -> dict[str, float | str]:
        """Its entry in ``nominal.json``."""
        if self.spread > 1.0:
            return NominalParameter.within_factor(
                self.name, self.value, self.spread, self.unit, self.alike, 1.0 + self.twins
            ).entry
        std, each = self.spread * self.value, self.twins * self.value
        return NominalParameter(self.name, self.value, std, self.unit, self.alike, each).entry

    @property
    def told(self) -> str:
        """In words."""
        known = (
            f"{self.unit} to within a factor of {self.spread:g}"
            if self.spread > 1.0
            else f"± {self.spread * self.value:.2g} {self.unit}"
        )
        same = f", of one type ({self.alike})" if self.alike else ""
        return f"{self.name} = {self.value:.6g} {known}{same}"


def assumed_parameters(
    model: mujoco.MjModel, assumptions: Assumptions, *, articulated: bool
) -> list[Assumed]:
    """The parameters of a model that are not zero, with uncertainties.

    Args:
        model: The model.
        assumptions: How sure one is.
        articulated: Whether rotor inertias and gains may be among them; on a linear structure nothing tells them from masses and
            stiffnesses.
    """
    out = [_mass(model, body, assumptions) for body in moving_bodies(model)]
    for i in range(model.njnt):
        name, turning = model.joint(i).name, int(model.jnt_type[i]) == _TURNING
        dof = int(model.jnt_dofadr[i])
        values = {
            "stiffness": float(np.ravel(model.jnt_stiffness[i])[0]),
            "damping": float(np.ravel(model.dof_damping[dof])[0]),
            "frictionloss": float(model.dof_frictionloss[dof]),
        }
        units = {"stiffness": "N/m", "damping": "N s/m", "frictionloss": "N", "armature": "kg"}
        if turning:
            units = {
                "stiffness": "N m/rad", "damping": "N m s/rad", "frictionloss": "N m", "armature": "kg m^2"
            }  # fmt: skip
        if articulated:
            values["armature"] = float(model.dof_armature[dof])
        out += [
            Assumed(f"{kind}:{name}", value, getattr(assumptions, kind), units[kind])
            for kind, value in values.items()
            if value > 0.0 and name
        ]
    return _typed(model, [*out, *_gains(model, assumptions)], assumptions) if articulated else out


def _typed(model: mujoco.MjModel, parameters: list[Assumed], assumptions: Assumptions) -> list[Assumed]:
    """The same with those of drives of equal numbers, and of the joints that they drive, as ones of a type."""
    alike: dict[JointDrive, list[tuple[str, str]]] = defaultdict(list)
    for u in range(model.nu):
        if is_servo(model, u):
            drive, joint = drive_of(model, u), model.joint(int(model.actuator_trnid[u, 0]))
            alike[replace(drive, name="", lowest=0.0, highest=0.0)].append((drive.name, joint.name))
    types: dict[tuple[str, str], str] = {}
    for several in (group for group in alike.values() if len(group) > 1):
        label = f"drives like {several[0][0]}"
        types |= {
            (part, name): label
            for pair in several
            for part, name in zip(("drive", "joint"), pair, strict=True)
        }

    def label_of(one: Assumed) -> str:
        kind, _, name = one.name.partition(":")
        part = "drive" if kind in DRIVES else "joint" if kind in OF_MOTORS else ""
        return types.get((part, name), "")

    def counted(one: Assumed) -> tuple[str, str, float]:
        return one.name.partition(":")[0], label_of(one), one.value

    # what parts of a type scatter by has to be less than what is known of them all, and equal numbers show that they are of one
    many = Counter(counted(one) for one in parameters if label_of(one) and one.spread > assumptions.twins)
    return [
        one._replace(alike=label_of(one), twins=assumptions.twins) if many[counted(one)] > 1 else one
        for one in parameters
    ]


OF_MOTORS = ("armature", "damping", "frictionloss")
"""Numbers of a joint that are mostly those of its motor and gear."""


def _gains(model: mujoco.MjModel, assumptions: Assumptions) -> list[Assumed]:
    out = []
    for u in range(model.nu):
        if not is_servo(model, u):
            continue
        name = model.actuator(u).name
        turning = int(model.jnt_type[int(model.actuator_trnid[u, 0])]) == _TURNING
        units = {"kp": "N m/rad", "kv": "N m s/rad", "forcerange": "N m"}
        if not turning:
            units = {"kp": "N/m", "kv": "N s/m", "forcerange": "N"}
        drive = drive_of(model, u)
        values = {
            "kp": drive.kp,
            "kv": drive.kv,
            "forcerange": drive.stall if np.isfinite(drive.stall) else 0.0,
        }
        out += [
            Assumed(f"{kind}:{name}", value, getattr(assumptions, kind), units[kind])
            for kind, value in values.items()
            if value > 0.0
        ]
    return out


def is_servo(model: mujoco.MjModel, actuator: int) -> bool:
    """Whether an actuator follows a position."""
    return commanded(model, actuator) == "position"


def moving_bodies(model: mujoco.MjModel) -> list[int]:
    """The heaviest body of each group that moves as one: no record tells the masses of its members apart."""
    groups: dict[int, int] = {}
    for body in range(1, model.nbody):
        weld = int(model.body_weldid[body])
        if weld == 0 or float(model.body_mass[body]) <= 0.0 or not model.body(body).name:
            continue
        if weld not in groups or model.body_mass[body] > model.body_mass[groups[weld]]:
            groups[weld] = body
    return list(groups.values())


def _mass(model: mujoco.MjModel, body: int, assumptions: Assumptions) -> Assumed:
    value = float(model.body_mass[body])
    return Assumed(f"mass:{model.body(body).name}", value, assumptions.mass, "kg")
