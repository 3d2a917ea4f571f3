"""How effects at joints and drives enter the parameter vector of a joint's runs."""

from __future__ import annotations

import math
from collections.abc import Callable

from bench.arrays import Array
from bench.discrepancy.multibody.joint_forces import Slot

SlotValues = dict[str, float]


def written(**entries: str) -> Callable[[SlotValues, Array], None]:
    """Setter of slots from values of the same names."""

    def change(values: SlotValues, p: Array) -> None:
        for slot, name in entries.items():
            p[Slot[slot]] = values[name]

    return change


def added(**entries: str) -> Callable[[SlotValues, Array], None]:
    """Setter that adds values to slots."""

    def change(values: SlotValues, p: Array) -> None:
        for slot, name in entries.items():
            p[Slot[slot]] += values[name]

    return change


def scaled(*slots: Slot) -> Callable[[SlotValues, Array], None]:
    """Setter of slots that are off by a ``relative_error``."""

    def change(values: SlotValues, p: Array) -> None:
        for slot in slots:
            p[slot] *= 1.0 + values["relative_error"]

    return change


def saturated(values: SlotValues, p: Array) -> None:
    """Limit the force of the actuator to ``limit``."""
    p[Slot.LOW] = max(p[Slot.LOW], -values["limit"])
    p[Slot.HIGH] = min(p[Slot.HIGH], values["limit"])


in_gear = written(
    LIMIT="limit_0",
    DRIVEN="mu_drive",
    WEIGHED="mu_weight",
    WEIGHED_RISE="mu_rest",
    STRIBECK="velocity",
    DRIVEN_SQUARE="growth",
)
"""Let dry friction grow with what drives a gear and with what hangs on it."""


def carried(values: SlotValues, p: Array) -> None:
    """Let dry friction grow with the torque of the link, or with that of the actuator."""
    p[Slot.LIMIT] = values["limit_0"]
    p[Slot.DRIVEN if values["of_actuator"] > 0.5 else Slot.CARRIED] = values["mu"]


def train(values: SlotValues, p: Array) -> None:
    """Put an elastic train with play between motor and link."""
    p[Slot.TRAIN] = 1.0
    p[Slot.TRAIN_STIFFNESS] = values["stiffness"]
    p[Slot.TRAIN_DAMPING] = values["damping"]
    p[Slot.CLEARANCE] = values.get("half_clearance", 0.0)
    p[Slot.MOTOR] *= values["motor_share"]
    p[Slot.ENCODER] = values["encoder_on_link"]


def stop(values: SlotValues, p: Array) -> None:
    """Put a stop on one side of the joint."""
    p[Slot.STOP] = values["stiffness"]
    p[Slot.STOP_AT] = values["position"]
    p[Slot.STOP_DAMPING] = values["damping"]
    p[Slot.STOP_SIDE] = values["side"]


def periods(values: SlotValues) -> float:
    """Angular frequency along the coordinate of something periodic: periods in a turn, or 2 pi over the pitch along a slide."""
    return 2.0 * math.pi / values["pitch"] if "pitch" in values else values["periods_per_turn"]


def cogging(values: SlotValues, p: Array) -> None:
    """Put a torque that is periodic in the angle, or a force along a slide."""
    sine, cosine = values["sine"], values["cosine"]
    p[Slot.COGGING] = math.hypot(sine, cosine)
    p[Slot.PERIODS] = periods(values)
    p[Slot.PHASE] = math.atan2(cosine, sine)
