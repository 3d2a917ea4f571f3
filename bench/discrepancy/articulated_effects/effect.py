"""An effect of articulated models: where it may sit, its parameters, and how it enters the runs of a joint.

An effect at a joint or a drive sets entries of the parameter vector of that joint's runs (`joint_forces.Slot`); one of a body or the base
changes the torque of the inverse dynamics of all joints; one of an encoder corrects the log. Parameters are of order one, as in the
catalogue of linear structures (`bench.discrepancy.effects.effect`), with the scales of the joint's own records.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple

from bench.arrays import Array
from bench.discrepancy.articulated_effects.slot_setters import SlotValues, train
from bench.discrepancy.effects.effect import FreeParameter
from bench.discrepancy.multibody.encoders import Encoder

JointSite = Literal["joint", "pair", "body", "base", "end", "actuator", "sensor"]

NUMBERS = frozenset({
    "mass_error", "com_error", "armature_error", "damping_error", "force_gain_error", "servo_gain_error", "position_gain_error",
    "force_offset", "position_offset", "base_tilt",
})  # fmt: skip
"""Effects that are a wrong number."""


@dataclass(frozen=True)
class EffectsSettings:
    """Numbers of `bench.discrepancy.articulated_effects.effect`."""

    positive: Mapping[str, Any] = field(
        default_factory=lambda: {"mean": math.log(0.2), "std": 1.5, "bounds": (-9.0, 4.0)}
    )
    """Prior of a positive amplitude: a fifth of its scale, within a factor of twenty with 95 %."""
    signed: Mapping[str, Any] = field(
        default_factory=lambda: {"signed": True, "mean": 0.0, "std": 0.5, "bounds": (-30.0, 30.0)}
    )
    """Prior of an amplitude of either sign."""


SETTINGS = EffectsSettings()


class JointScales(NamedTuple):
    """Magnitudes of a joint's records that make parameters dimensionless.

    Attributes:
        force: RMS torque of the drive.
        peak: Largest force of the actuator.
        position: Largest excursion from the mean angle.
        velocity: Largest velocity.
        inertia: Mean inertia about the joint.
        input: RMS of the actuator's input, of a servo its position error.
        mass: Mass of the body.
        reach: Distance of the body's tip from its joint.
        middle: Mean angle; of an end of the tree its lowest height.
        limit: Largest torque that the drive can give, or gave where nothing limits it.
    """

    force: float
    peak: float
    position: float
    velocity: float
    inertia: float
    input: float
    mass: float
    reach: float
    middle: float
    limit: float


@dataclass(frozen=True)
class ArticulatedEffect:
    """Something that may be missing from an articulated model.

    Attributes:
        name: Name in verdicts.
        family: Family.
        site: Where it sits.
        parameters: Free parameters, the amplitude first.
        equation: One line for reports.
        slots: For joints and actuators: values and the parameter vector (SLOTS,) to be changed in place.
        encoder: For sensors: values to what is wrong.
        servo: Only for servos (True), only for forces (False), or both (None).
        hinge: Only at hinges (True), only at slides (False), or both (None).
        needs: Quantity that has to be measured ("velocity"), if any.
        coordinate: Name of the parameter that is a coordinate of its place, free about `JointScales.middle`, if any.
        contains: Names of simpler effects that it is for some values of its parameters, and how their values are then its own.
    """

    name: str
    family: str
    site: JointSite
    parameters: tuple[FreeParameter, ...]
    equation: str
    slots: Callable[[SlotValues, Array], None] | None = None
    encoder: Callable[[SlotValues], Encoder] | None = None
    servo: bool | None = None
    hinge: bool | None = None
    needs: str = ""
    coordinate: str = ""
    contains: Mapping[str, Callable[[SlotValues], SlotValues]] = field(default_factory=dict)

    @property
    def number(self) -> bool:
        """Whether a number of the model or of the log is wrong, rather than a force missing."""
        return self.name in NUMBERS

    @property
    def free(self) -> int:
        """Number of parameters that a fit moves."""
        return sum(not p.fixed for p in self.parameters)

    @property
    def bodily(self) -> bool:
        """Whether it changes what the bodies ask of all joints."""
        return self.site in ("body", "base")

    @property
    def train(self) -> bool:
        """Whether it is an elastic drive train between motor and link."""
        return self.slots is train

    @property
    def weakens(self) -> bool:
        """Whether it takes away of what its drive gives: neither a wrong number nor an input that acts late."""
        return self.site == "actuator" and not self.number and self.parameters[0].name != "delay_s"

    @property
    def play(self) -> bool:
        """Whether motor and link part and meet again."""
        return any(p.name == "half_clearance" for p in self.parameters)

    def unit(self, parameter: FreeParameter, position: str, given: str) -> str:
        """Unit of a parameter on a joint whose coordinate has the unit `position` and whose input has the unit `given`."""
        force, inertia = ("N m", "kg m^2") if position == "rad" else ("N", "kg")
        return parameter.unit or {
            "force": force, "peak": force, "input": given or "input", "position": position,
            "velocity": f"{position}/s", "inertia": inertia, "mass": "kg", "reach": "m", "1": "1",
            "force/position": f"{force}/{position}", "force/velocity": f"{force} s/{position}",
            "force/velocity/velocity": f"{force} s^2/{position}^2", "1/force": f"1/({force})",
        }[parameter.scale]  # fmt: skip

    def works(self, eta: Array, scales: JointScales) -> bool:
        """Whether it does within the travel of the joint what it is called for, and nothing that no such thing does.

        Bristles that never let go, and a stop that is never left, are springs. Out of a gear comes more the harder its drive pulls, at
        every torque that the drive can give: friction that takes more than what is added holds a joint for good wherever a record
        reaches further than those that it was fitted to.
        """
        values = self.values(eta, scales)
        if "side" in values:
            return values["side"] * values["position"] > -scales.position
        if "growth" in values:
            return values["mu_drive"] + 2.0 * values["growth"] * scales.limit < 1.0
        if self.family == "friction" and "stiffness" in values:
            return values["limit"] < values["stiffness"] * scales.position
        return True

    def values(self, eta: Array, scales: JointScales) -> SlotValues:
        """Physical values by name."""
        return {p.name: p.value(float(e), scales) for p, e in zip(self.parameters, eta, strict=True)}
