"""How an effect is drawn: what the rig does without it, the shape drawn over that, and the strength that is left open."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bench.discrepancy.truth import out_of_catalogue as foreign
from bench.laws.base import ForceLaw, Kernel


@dataclass(frozen=True)
class RecipeSettings:
    """Numbers of the recipes."""

    slow: float = 1e-4
    """Velocity that rounds a law at rest, as a part of V; friction proper is set-valued in sealed cases."""


SETTINGS = RecipeSettings()


class Reach(NamedTuple):
    """What a rig does at a place without the effect.

    Attributes:
        force: RMS load.
        position: Largest displacement X.
        velocity: Largest velocity V.
        stiffness: Nominal stiffness along the coordinate.
        omega: Angular frequency of the motion, V / X [rad/s].
        duration: Length of a record [s].
        force2, position2, velocity2, stiffness2: The same for the last coordinate of the place.
        inertia: Mass or inertia of the body that the coordinate moves; 0 where its motion is prescribed.
    """

    force: float
    position: float
    velocity: float
    stiffness: float
    omega: float
    duration: float
    force2: float
    position2: float
    velocity2: float
    stiffness2: float
    inertia: float = 0.0


class Drawn(NamedTuple):
    """An effect with all its numbers.

    Attributes:
        values: Parameters by the name of the catalogue (or of the foreign law), the amplitude first.
        theta: Parameters of the law; empty for effects that are none.
        region: Intervals of displacement within which the force acts; empty where it acts everywhere.
        carried: Part of the body's inertia that its law moves instead of the body.
    """

    values: Mapping[str, float]
    theta: tuple[float, ...] = ()
    region: tuple[tuple[float, float], ...] = ()
    carried: float = 0.0


Shape = Callable[[float], Drawn]
"""Strength, of order one, to the effect."""

DrawShape = Callable[[np.random.Generator, Reach], Shape]
"""Source of randomness and reach to the shape."""


@dataclass(frozen=True)
class Recipe:
    """How an effect is drawn.

    Attributes:
        name: Name in the catalogue, or of the foreign effect.
        site: "joint", "inertia", "actuator", "sensor", or "stop" for a rigid stop.
        draw: Source of randomness and reach to the shape.
        rigs: Rigs it can sit in.
        law: Force law of a joint effect.
        limit: Limit of set-valued friction, which replaces the force of the law.
        target: Quantity a sensor effect acts on.
        weight: How often it is drawn.
        sensors: Sensor sets in which it means something; all where empty.
        holds: Effects that it makes part of itself: both at one place are this effect again, with other parameters.
    """

    name: str
    site: str
    draw: DrawShape
    rigs: tuple[str, ...] = ("sdof", "damper", "joint")
    law: ForceLaw | None = None
    limit: Kernel | None = None
    target: str = ""
    weight: float = 1.0
    sensors: tuple[str, ...] = ()
    holds: tuple[str, ...] = ()

    @property
    def n_coordinates(self) -> int:
        """Number of coordinates it acts on."""
        return self.law.n_coordinates if self.law is not None else 1

    @property
    def foreign(self) -> bool:
        """Whether no catalogue may hold it."""
        return self.name in foreign.FOREIGN_NAMES


def between(rng: np.random.Generator, low: float, high: float) -> float:
    """A number whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def sign(rng: np.random.Generator) -> float:
    """Either sign, as likely."""
    return float(rng.choice([-1.0, 1.0]))
