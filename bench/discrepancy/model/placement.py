"""An effect at a place, and several of them: a hypothesis."""

from __future__ import annotations

from dataclasses import dataclass

from bench.discrepancy.effects.effect import Effect
from bench.discrepancy.model.structure import Place

FROM = " from "
"""Between the channel and the source of cross-talk."""


@dataclass(frozen=True)
class Placed:
    """An effect at a place.

    Attributes:
        effect: The effect.
        place: Where it sits.
        target: Nominal parameter, load channel or response channel of an inertia, actuator or sensor effect; for
            cross-talk "channel from source".
    """

    effect: Effect
    place: Place
    target: str = ""

    @property
    def key(self) -> tuple[str, str, str]:
        """Name with its variant, place and target: what tells two placed effects apart."""
        return (f"{self.effect.name} {self.effect.variant}".strip(), self.place.name, self.target)

    @property
    def channel(self) -> str:
        """Channel that a sensor effect acts on."""
        return self.target.partition(FROM)[0]

    @property
    def source(self) -> str:
        """Channel that cross-talk comes from; empty for other effects."""
        return self.target.partition(FROM)[2]


Hypothesis = tuple[Placed, ...]
