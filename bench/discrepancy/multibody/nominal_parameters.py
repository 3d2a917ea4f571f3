"""The uncertain parameters of an articulated nominal model, and where they enter a joint's runs.

Parts of one type, five servos of a robot, say, have numbers that are off together: what is stated as alike has one common deviation,
and each part its own about it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.arrays import Array
from bench.discrepancy.case.case import Case
from bench.discrepancy.multibody.joint_forces import SLOTS, Slot
from bench.discrepancy.multibody.joints import Joint
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.errors import UnknownNameError
from bench.rig.actuators import DRIVES
from bench.rig.bodies import AXES, BODIES


@dataclass(frozen=True)
class NominalSettings:
    """Numbers of `bench.discrepancy.multibody.nominal_parameters`."""

    least: float = 0.05
    """Part of a positive number that is left of it, however far it is moved; of one that is known to within a factor any."""


SETTINGS = NominalSettings()
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
class Nominal:
    """A nominal parameter, or what those of parts of one type have in common.

    Attributes:
        name: Its name.
        kind: What it sets.
        target: The joint, drive or body that it belongs to; the type of the parts.
        joints: Indices of the joints whose runs it changes; none of a body, which all that carry it feel.
        value: Its value; of what is common, the least of the values over what they have in common, so that none changes its sign.
        std: Its standard uncertainty; of what is common one, and of a part of a type that about the common value.
        factor: What a unit of it is there: of a joint that another one moves, what the ratio of the two makes of it.
        common: Index of what it has in common with the other parts of its type; None where it is a part of none.
        together: Standard uncertainty of that.
        of_type: Whether it is what parts of one type have in common.
        logarithmic: Whether it is known to within a factor: the uncertainties are then those of its logarithm.
    """

    name: str
    kind: str
    target: str
    joints: tuple[int, ...]
    value: float
    std: float
    factor: float = 1.0
    common: int | None = None
    together: float = 0.0
    of_type: bool = False
    logarithmic: bool = False

    @property
    def of_body(self) -> bool:
        """Whether it belongs to a body."""
        return self.kind in BODIES

    @property
    def shared(self) -> bool:
        """Whether several joints may feel it: it belongs to a body, or to a type of parts."""
        return self.of_body or self.of_type

    @property
    def stated_std(self) -> float:
        """Standard uncertainty as stated, with what the parts of a type have in common; near its value where a factor is stated."""
        spread = float(np.hypot(self.std, self.together))
        return spread * self.value if self.logarithmic else spread

    @property
    def stated_factor(self) -> float:
        """Factor to within which it is known; 1 where a standard uncertainty is stated."""
        return float(np.exp(np.hypot(self.std, self.together))) if self.logarithmic else 1.0

    @property
    def lowest(self) -> float:
        """Least entry of a vector: a number that is positive stays so."""
        if self.logarithmic or self.value <= 0.0 or self.kind in AXES:
            return -np.inf
        return -(1.0 - SETTINGS.least) * self.value / self.std

    def deviation(self, vector: Array, i: int) -> float:
        """How far it is from its value where a vector has the nominal parameters, of which it is the one of index `i`.

        Parts of a type differ in proportion to their common value.
        """
        if self.logarithmic:
            return float(self.value * np.expm1(self._logarithm(vector, i)))
        own = self.std * float(vector[i])
        if self.common is None:
            return own
        common = self.together * float(vector[self.common])
        return common + own * (1.0 + common / self.value if self.value else 1.0)

    def slopes(self, vector: Array, i: int) -> dict[int, float]:
        """Derivatives of `deviation`, index by index of the vector."""
        if self.logarithmic:
            now = float(self.value * np.exp(self._logarithm(vector, i)))
            return {i: now * self.std} | ({} if self.common is None else {self.common: now * self.together})
        if self.common is None:
            return {i: self.std}
        share = self.together / self.value if self.value else 0.0
        own, common = float(vector[i]), float(vector[self.common])
        return {i: self.std * (1.0 + share * common), self.common: self.together + share * self.std * own}

    def sigmas(self, vector: Array, i: int) -> float:
        """How far that is in units of the stated uncertainty, of its logarithm where a factor is stated."""
        moved = self._logarithm(vector, i) * self.value if self.logarithmic else self.deviation(vector, i)
        return moved / self.stated_std

    def _logarithm(self, vector: Array, i: int) -> float:
        """The logarithm of what it is over its value."""
        common = 0.0 if self.common is None else self.together * float(vector[self.common])
        return self.std * float(vector[i]) + common


def nominal_parameters(case: Case, model: ArticulatedModel) -> tuple[Nominal, ...]:
    """The uncertain parameters of ``nominal.json``: those of bodies and of types of parts first, then joint by joint.

    Raises:
        UnknownNameError: A parameter names nothing in the model.
    """
    joints = {joint.name: j for j, joint in enumerate(model.joints)}
    tied = {tie.name: (joints[tie.to], tie.ratio) for tie in model.ties if tie.to in joints}
    drives = {joint.drive.name: j for j, joint in enumerate(model.joints) if joint.drive is not None}
    bodies = {body: i for i, body in enumerate(model.bodies)}
    shared, others = [], []
    types: dict[str, list[Nominal]] = {}
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
                parameter.name, kind, target, () if kind in BODIES else (known[target],), parameter.value,
                parameter.own_std, factor, together=parameter.common_std, logarithmic=parameter.factor > 1.0,
            )  # fmt: skip
            (shared if entry.of_body else others).append(entry)
            if parameter.alike:
                types.setdefault(f"{kind}:{parameter.alike}", []).append(entry)
    of_type = {}
    for name, parts in types.items():
        of_type |= {part.name: len(shared) for part in parts}
        shared.append(_common(name, parts))
    placed = [replace(p, common=of_type.get(p.name)) for p in sorted(others, key=lambda p: p.joints)]
    return (*shared, *placed)


def _common(name: str, parts: Sequence[Nominal]) -> Nominal:
    kind, _, label = name.partition(":")
    joints = tuple(sorted({part.joints[0] for part in parts}))
    least = min(part.value / part.together for part in parts)
    return Nominal(name, kind, label, joints, least, 1.0, of_type=True, logarithmic=parts[0].logarithmic)


def twins(nominal: Sequence[Nominal], j: int) -> set[int]:
    """The other joints whose parts are of one type with those of joint `j`."""
    return {other for p in nominal if p.of_type and j in p.joints for other in p.joints} - {j}


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
    p[Slot.MOTOR], p[Slot.ENCODER] = joint.armature, float(on_link)
    p[Slot.STRIBECK], p[Slot.RATIO] = 1.0, drive.gear
    return p


def move(p: Array, kind: str, by: float) -> None:
    """Move a nominal parameter in the parameter vector (SLOTS,) of a joint."""
    if kind == "forcerange" and p[Slot.STALL] > 0.0:
        p[Slot.STALL] += by
        return
    if kind == "forcerange":
        p[Slot.LOW] *= 1.0 + by / p[Slot.HIGH]
    if kind == "kv" and p[Slot.SERVO] < 0.5 and p[Slot.KP] == p[Slot.KV]:  # the two are one
        p[Slot.KP] += by
    for slot in LOCAL_SLOTS[kind]:
        p[slot] += by
