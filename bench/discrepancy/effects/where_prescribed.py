"""Effects where a machine prescribes a motion and a force responds: what delays, sensors and actuators are there."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

from bench.discrepancy.effects.effect import Effect, log_grid


@dataclass(frozen=True)
class WherePrescribedSettings:
    """Numbers of `bench.discrepancy.effects.where_prescribed`."""

    delays: tuple[float, ...] = (0.001, 0.003, 0.01)
    """Delays that are screened [s]: what filters, converters and multiplexers of two transducers differ by."""
    delay_odds: float = -1.0
    """Log prior odds of a delay, those of any sensor but a displacement's."""


SETTINGS = WherePrescribedSettings()
LATE, EARLY = "force_delay", "displacement_delay"
"""Delays of the force, and of the motion."""


def where_prescribed(catalogue: Iterable[Effect]) -> list[Effect]:
    """What effects are where a motion is prescribed; those that are nothing there are left out."""
    return [known for effect in catalogue if (known := _known(effect)) is not None]


def _known(effect: Effect) -> Effect | None:
    """What an effect is where a motion is prescribed; None where it is nothing.

    A delay between the transducers of motion and force moves the motion along which the laws are asked, not their force: dry friction
    turns within a sample, and no interpolation of a force between samples tells when. What moves the machine is of no account, and
    what a force picks up from the motion is a stiffness. What is read is a force: effects of a displacement's sensor have that name.
    """
    if effect.name in {LATE, EARLY}:
        late = effect.name == LATE
        (delay,) = effect.parameters
        return replace(
            effect,
            family="sensor",
            site="sensor",
            parameters=(replace(delay, grid=log_grid(*SETTINGS.delays)),),
            equation="f(t - tau)" if late else "f(t + tau)",
            signal=None,
            between_samples=False,
            logged=False,
            quantity="",
            log_prior=SETTINGS.delay_odds,
            later=1.0 if late else -1.0,
        )
    if effect.site == "actuator" or effect.pickup:
        return None
    if effect.site == "sensor" and effect.quantity == "position":
        name = effect.name.replace("displacement", "force")
        return replace(effect, name=name, equation=re.sub(r"\bx\b", "f", effect.equation))
    return effect
