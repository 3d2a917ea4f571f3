"""When a joint touches and when it slips: the states of gaps and sliders, read off a record.

The clearances and limits are those of the *true* element; the motions and forces are those of the record at hand. So
a reduced-order joint, which knows neither, is judged by when it would have touched and slipped.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.recording import Recording
from bench.rig import Element


@dataclass(frozen=True)
class BandsSettings:
    """Numbers of `bench.rerun_log.bands`."""

    slip_share: float = 0.9
    """Share of the slip force at which a slider that yields gradually counts as slipping. The exact value is a convention: Bouc-Wen
    and Iwan joints have no sharp transition."""


BANDS_SETTINGS = BandsSettings()

CONTACT = ("contact −", "free", "contact +")
SLIDER = ("stick", "slip")
GAP = ("within noise", "gap")
"""Where a simulation agrees with the measurement, and where it does not."""

REGION = ("outside", "region −", "region +")
"""Where the motion is outside the regions of a missing force, and where in one with a negative or a positive force."""


@dataclass(frozen=True)
class Band:
    """One state machine of an element.

    Attributes:
        name: Element and what it is about, "joint.axial_gap".
        states: Names of the states.
        channels: Channels that the classification reads, in its order.
        classify: Samples of these channels ``(n,)`` each to state numbers ``(n,)``.
        variants: Records it is drawn for; all that hold the channels where empty.
    """

    name: str
    states: tuple[str, ...]
    channels: tuple[str, ...]
    classify: Callable[..., NDArray[np.int64]]
    variants: tuple[str, ...] = ()

    def drawn_for(self, variant: str) -> bool:
        """Whether it is drawn for a record of that name."""
        return not self.variants or variant in self.variants

    def of(self, recording: Recording) -> NDArray[np.int64] | None:
        """State numbers ``(n,)`` over a record; None where it lacks a channel."""
        if any(channel not in recording.names for channel in self.channels):
            return None
        return self.classify(*(recording[channel] for channel in self.channels))


def _contact(low: float, high: float) -> Callable[..., NDArray[np.int64]]:
    return lambda x: np.where(x > high, 2, np.where(x < low, 0, 1))


def _stick(velocity: float) -> Callable[..., NDArray[np.int64]]:
    return lambda v: np.where(np.abs(v) < velocity, 0, 1)


def _yield(low: float, high: float) -> Callable[..., NDArray[np.int64]]:
    """Slip where the force has reached its limit on the side it is moving to."""
    return lambda r, v: np.where(
        ((r > BANDS_SETTINGS.slip_share * high) & (v > 0.0))
        | ((r < BANDS_SETTINGS.slip_share * low) & (v < 0.0)),
        1,
        0,
    )


def _slip_limits(element: Element) -> tuple[float, float] | None:
    """Smallest and largest force of a slider with presliding displacement; None for other laws."""
    p = element.parameters
    if not element.law.states:
        return None
    if "limit_positive" in p and "limit_negative" in p:
        offset = p.get("offset", 0.0)
        return offset - p["limit_negative"], offset + p["limit_positive"]
    if "limit" in p:
        return -p["limit"], p["limit"]
    if {"A", "beta", "gamma", "n"} <= set(p) and p["beta"] + p["gamma"] > 0.0:
        strength = (p["A"] / (p["beta"] + p["gamma"])) ** (1.0 / p["n"])
        return -strength, strength
    return None


def _clearances(element: Element) -> list[tuple[str, str, float, float]]:
    """(label, channel, lower and upper end of free travel) of each gap of an element."""
    p = element.parameters
    name = element.name
    if element.law.name == "one_sided_stop":
        open_side = (-np.inf, p["position"]) if p["side"] >= 0.0 else (p["position"], np.inf)
        return [("gap", f"{name}/displacement", *open_side)]
    if element.law.name == "jenkins_backlash":  # its play travels with the slider
        return [("backlash", f"{name}/u", -p["clearance"], p["clearance"])]
    if "clearance_axial" in p and "clearance_torsional" in p:
        axial, torsional = p["clearance_axial"], p["clearance_torsional"]
        return [
            ("axial_gap", f"{name}/displacement_1", -axial, axial),
            ("torsional_gap", f"{name}/displacement_2", -torsional, torsional),
        ]
    if "clearance_positive" in p and "clearance_negative" in p:
        return [("gap", f"{name}/displacement", -p["clearance_negative"], p["clearance_positive"])]
    if "clearance" in p:
        offset = p.get("offset", 0.0)
        return [("gap", f"{name}/displacement", offset - p["clearance"], offset + p["clearance"])]
    return []


def element_bands(element: Element) -> tuple[Band, ...]:
    """The gaps and sliders of an element; empty for laws that have neither.

    A friction law without presliding sticks below its regularisation velocity. One with presliding (Dahl, LuGre,
    Jenkins, Iwan, Bouc-Wen) slips from `slip_share` of its limit on, in the direction of motion.
    """
    name = element.name
    found = [
        Band(f"{name}.{label}", CONTACT, (channel,), _contact(low, high))
        for label, channel, low, high in _clearances(element)
    ]
    velocity = element.parameters.get("regularisation_velocity")
    if velocity is not None and element.law.name != "power_law_damping":  # a smoothed damper never sticks
        found.append(Band(f"{name}.slider", SLIDER, (f"{name}/velocity",), _stick(velocity)))
    limits = _slip_limits(element)
    if limits is not None:
        channels = (f"{name}/force", f"{name}/velocity")
        found.append(Band(f"{name}.slider", SLIDER, channels, _yield(*limits)))
    return tuple(found)


def changes(states: NDArray[np.int64]) -> NDArray[np.int64]:
    """Samples at which a new state begins, the first sample included ``(n_changes,)``."""
    return np.concatenate([[0], np.flatnonzero(np.diff(states)) + 1])
