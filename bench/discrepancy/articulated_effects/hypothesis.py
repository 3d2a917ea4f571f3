"""Effects at places."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from bench.arrays import Array
from bench.discrepancy.articulated_effects.effect import ArticulatedEffect, JointScales


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


def placed_values(placed: PlacedOnJoint, eta: Array) -> dict[str, float]:
    """Physical values of an effect at its place; a stop's position is counted from the zero of the joint."""
    return {name: x + _zero(placed, name) for name, x in placed.effect.values(eta, placed.scales).items()}


def placed_eta(placed: PlacedOnJoint, values: Mapping[str, float]) -> list[float]:
    """Free parameters of an effect from its physical values, the inverse of `placed_values`; the prior's mean where a value is not told."""
    return [
        float(p.eta(values[p.name] - _zero(placed, p.name), placed.scales)) if p.name in values else p.mean
        for p in placed.effect.parameters
    ]


def _zero(placed: PlacedOnJoint, parameter: str) -> float:
    """Where the joint's zero is from what a parameter of an effect is counted from."""
    at_stop = placed.effect.name == "one_sided_stop" and parameter == "position"
    return placed.scales.middle if at_stop else 0.0
