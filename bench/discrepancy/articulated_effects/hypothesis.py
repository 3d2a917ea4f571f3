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
        scales: Scales of that joint; of an end of the tree those of its lowest point, against gravity and in forces.
        others: Indices of further joints whose runs it changes: the neighbour that shares it, or all that raise the end of the tree.
    """

    effect: ArticulatedEffect
    where: str
    joint: int
    scales: JointScales
    others: tuple[int, ...] = ()

    @property
    def joints(self) -> tuple[int, ...]:
        """The joint, and the others."""
        return (self.joint, *self.others)

    @property
    def partner(self) -> int | None:
        """Index of the neighbour that shares a drive with the joint, if any."""
        return self.others[0] if self.effect.site == "pair" else None

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
    """Where the zero of a coordinate is from what a parameter of an effect is counted from."""
    return placed.scales.middle if parameter == placed.effect.coordinate else 0.0
