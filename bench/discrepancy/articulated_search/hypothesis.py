"""Effects at places, and the uncertain parameters of the nominal model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bench.arrays import Array
from bench.discrepancy.articulated_search.effect import ArticulatedEffect, JointScales
from bench.discrepancy.case.case import Case
from bench.discrepancy.multibody.joint_forces import SLOTS, Slot
from bench.discrepancy.multibody.joints import Joint
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.errors import UnknownNameError
from bench.rig.actuators import DRIVES
from bench.rig.bodies import BODIES

LOCAL_SLOTS = {
    "damping": (Slot.DAMPING,),
    "armature": (Slot.INERTIA,),
    "frictionloss": (Slot.LIMIT,),
    "stiffness": (Slot.STIFFNESS,),
    "kp": (Slot.KP,),
    "kv": (Slot.KV,),
    "gear": (Slot.GEAR, Slot.RATIO),
    "forcerange": (Slot.HIGH,),
    "delay": (Slot.DELAY,),
}
"""Entries of a joint's parameter vector that nominal parameters set."""
BY_RATIO = ("damping", "armature", "frictionloss")
"""Those that are counted by the ratio where another joint moves theirs by an equality: a friction by it, the others by its square."""


@dataclass(frozen=True)
class PlacedOnJoint:
    """An effect at a place: a joint, a body or an actuator.

    Attributes:
        effect: The effect.
        where: Name of the joint, body or actuator.
        joint: Index of the joint whose runs it changes, or whose encoder it is; of the joint that carries the body.
        scales: Scales of that joint.
        partner: Index of the neighbour that shares it, if any.
    """

    effect: ArticulatedEffect
    where: str
    joint: int
    scales: JointScales
    partner: int | None = None

    @property
    def joints(self) -> tuple[int, ...]:
        """The joint, and the neighbour that shares it."""
        return (self.joint,) if self.partner is None else (self.joint, self.partner)

    @property
    def key(self) -> tuple[str, str]:
        """Name and place."""
        return self.effect.name, self.where

    def __str__(self) -> str:
        return f"{self.effect.name} ({self.where})"


JointHypothesis = tuple[PlacedOnJoint, ...]


@dataclass(frozen=True)
class Nominal:
    """A nominal parameter.

    Attributes:
        name: Its name.
        kind: What it sets.
        target: The joint, drive or body that it belongs to.
        joint: Index of the joint whose runs it changes; of a body, of the body.
        value: Its value.
        std: Its standard uncertainty.
        factor: What a unit of it is there: of a joint that another one moves, what the ratio of the two makes of it.
    """

    name: str
    kind: str
    target: str
    joint: int
    value: float
    std: float
    factor: float = 1.0

    @property
    def shared(self) -> bool:
        """Whether it belongs to a body, which all joints feel."""
        return self.kind in BODIES


def nominal_parameters(case: Case, model: ArticulatedModel) -> tuple[Nominal, ...]:
    """The uncertain parameters of ``nominal.json``: those of bodies first, then joint by joint.

    Raises:
        UnknownNameError: A parameter names nothing in the model.
    """
    joints = {joint.name: j for j, joint in enumerate(model.joints)}
    tied = {tie.name: (joints[tie.to], tie.ratio) for tie in model.ties if tie.to in joints}
    drives = {joint.drive.name: j for j, joint in enumerate(model.joints) if joint.drive is not None}
    bodies = {body: i for i, body in enumerate(model.bodies)}
    shared, others = [], []
    for parameter in case.parameters:
        kind, _, target = parameter.name.partition(":")
        factor = 1.0
        if kind in BODIES:
            known: Mapping[str, int] = bodies
        elif kind in DRIVES:
            known = drives
        elif kind in BY_RATIO and target in tied:
            joint, ratio = tied[target]
            known, factor = {target: joint}, abs(ratio) if kind == "frictionloss" else ratio**2
        elif kind in LOCAL_SLOTS:
            known = joints
        else:
            raise UnknownNameError(
                "parameter", parameter.name, [f"{k}:NAME" for k in (*BODIES, *LOCAL_SLOTS)]
            )
        if target not in known:
            raise UnknownNameError(f"target of parameter '{parameter.name}'", target, list(known))
        if parameter.std > 0.0:
            entry = Nominal(
                parameter.name, kind, target, known[target], parameter.value, parameter.std, factor
            )
            (shared if entry.shared else others).append(entry)
    return (*shared, *sorted(others, key=lambda p: p.joint))


def base_slots(joint: Joint, on_link: bool) -> Array:
    """Parameter vector (SLOTS,) of a joint's nominal model."""
    p = np.zeros(SLOTS)
    drive = joint.drive
    assert drive is not None
    p[Slot.GEAR], p[Slot.SERVO] = drive.gear, float(drive.servo)
    p[Slot.KP], p[Slot.KV] = drive.kp, drive.kv
    p[Slot.LOW], p[Slot.HIGH] = drive.low, drive.high
    if np.isfinite(drive.stall):
        p[Slot.STALL], p[Slot.BACK_EMF] = drive.stall, drive.gear * drive.back_emf
    # MuJoCo's activation stands for the control, that of a servo for its target
    p[Slot.INPUT_LAG], p[Slot.DELAY] = drive.lag, drive.delay
    p[Slot.DAMPING], p[Slot.LIMIT] = joint.damping, joint.friction
    p[Slot.STIFFNESS], p[Slot.REFERENCE] = joint.stiffness, joint.reference
    p[Slot.MOTOR], p[Slot.ENCODER], p[Slot.STRIBECK], p[Slot.RATIO] = (
        joint.armature,
        float(on_link),
        1.0,
        drive.gear,
    )
    return p


def move(p: Array, kind: str, by: float) -> None:
    """Move a nominal parameter in the parameter vector (SLOTS,) of a joint."""
    if kind == "forcerange" and p[Slot.STALL] > 0.0:
        p[Slot.STALL] += by
        return
    if kind == "forcerange":
        p[Slot.LOW] *= 1.0 + by / p[Slot.HIGH]
    if (
        kind == "kv" and p[Slot.SERVO] < 0.5 and p[Slot.KP] == p[Slot.KV]
    ):  # of a velocity servo the two are one
        p[Slot.KP] += by
    for slot in LOCAL_SLOTS[kind]:
        p[slot] += by


def placed_values(placed: PlacedOnJoint, eta: Array) -> dict[str, float]:
    """Physical values of an effect at its place; a stop's position is counted from the zero of the joint."""
    values = placed.effect.values(eta, placed.scales)
    if placed.effect.name == "one_sided_stop":
        values["position"] += placed.scales.middle
    return values
