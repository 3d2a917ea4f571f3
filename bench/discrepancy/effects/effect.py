"""What an effect of the catalogue is: a law or a channel operation with parameters of order one.

Every effect is described in coordinates of order one: a parameter is ``scale * exp(eta)`` (positive ones) or
``scale * eta`` (signed ones), the scale coming from the motion and the loads of the records. A Gaussian prior on
``eta`` then says, for every rig alike, what strength is plausible; it carries the Occam factor of the evidence.

The force of every law is proportional to its first parameter. The screening uses this: along the measured motion,
with the other parameters on a grid, an effect is one column (or a few) of a linear least-squares problem.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from bench.laws.base import ForceLaw, Kernel

if TYPE_CHECKING:
    from bench.discrepancy.case.case import CaseRecord

Site = Literal["joint", "inertia", "actuator", "sensor", "record", "read off"]
Values = NDArray[np.float64]


@dataclass(frozen=True)
class EffectSettings:
    """Numbers of `bench.discrepancy.effects.effect`."""

    rare: float = -2.0
    """Log prior odds of a rare effect against a common one."""


EFFECT_SETTINGS = EffectSettings()


class Scales(NamedTuple):
    """Magnitudes that make parameters dimensionless.

    Attributes:
        force: RMS load, over the identification records.
        position: Largest displacement along the coordinate.
        velocity: Largest velocity along the coordinate.
        stiffness: Nominal stiffness, or force / position where there is none; the larger of both along a prescribed motion.
        duration: Length of the record [s].
        step: Time between samples [s].
        force2, position2, velocity2: The same for the last coordinate of the place; equal to the first on one coordinate.
        acceleration: Largest acceleration along the coordinate.
        damping: Nominal damping, zero where there is none.
        source: Largest value of the channel that a sensor picks up, for cross-talk.
        mobility: Acceleration along the coordinate that a unit force gives the nominal model; zero where the motion is prescribed.
    """

    force: float
    position: float
    velocity: float
    stiffness: float
    duration: float
    step: float
    force2: float
    position2: float
    velocity2: float
    acceleration: float = 1.0
    damping: float = 0.0
    source: float = 1.0
    mobility: float = 0.0


class Magnitudes(Protocol):
    """Named magnitudes that make parameters dimensionless: `Scales`, or those of another kind of model."""

    def _asdict(self) -> dict[str, float]: ...


def log_grid(*values: float) -> tuple[float, ...]:
    """Grid of eta for a positive parameter, given as multiples of its scale."""
    return tuple(math.log(v) for v in values)


@dataclass(frozen=True)
class FreeParameter:
    """A parameter of an effect that a fit may move.

    Attributes:
        name: Field-standard name.
        scale: Key of the scale: an attribute of `Scales` or a product such as "force/velocity"; "1" for none.
        signed: ``scale * eta`` rather than ``scale * exp(eta)``.
        mean: Prior mean of eta.
        std: Prior standard deviation of eta.
        bounds: Bounds of eta.
        grid: Values of eta for the screening and as starts; the prior mean where empty.
        fixed: A discrete choice, held at its grid value by the fits.
        unit: Unit, where the scale does not tell it.
        share: A part between none and all of the scale: ``scale / (1 + exp(-eta))``.
    """

    name: str
    scale: str = "1"
    signed: bool = False
    mean: float = 0.0
    std: float = 1.0
    bounds: tuple[float, float] = (-math.inf, math.inf)
    grid: tuple[float, ...] = ()
    fixed: bool = False
    unit: str = ""
    share: bool = False

    def value(self, eta: float, scales: Magnitudes) -> float:
        """Physical value at `eta`."""
        return scale_of(self.scale, scales) * self._form(eta)[0]

    def slope(self, eta: float, scales: Magnitudes) -> float:
        """Derivative of the physical value by `eta`."""
        return scale_of(self.scale, scales) * self._form(eta)[1]

    def _form(self, eta: float) -> tuple[float, float]:
        """Value over the scale, and its derivative."""
        if self.signed:
            return eta, 1.0
        if self.share:
            part = 1.0 / (1.0 + math.exp(-eta))
            return part, part * (1.0 - part)
        return math.exp(eta), math.exp(eta)

    def eta(self, value: float, scales: Magnitudes) -> float:
        """Inverse of `value`, clipped to the bounds."""
        ratio = value / scale_of(self.scale, scales)
        raw = ratio if self.signed else math.log(max(ratio, 1e-12))
        if self.share:
            raw -= math.log(max(1.0 - ratio, 1e-12))
        return float(np.clip(raw, *self.bounds))


def scale_of(key: str, scales: Magnitudes) -> float:
    """Evaluate a scale such as "force/position/position" or "1/velocity"."""
    head, *divisors = key.split("/")
    total = 1.0 if head == "1" else getattr(scales, head)
    for divisor in divisors:
        total /= getattr(scales, divisor)
    return total


def unit_of(key: str, position: str, force: str) -> str:
    """Unit of a scale key, for a coordinate of unit `position` and a force of unit `force`."""
    names = {
        "force": force, "position": position, "velocity": f"{position}/s", "stiffness": f"({force}/{position})",
        "duration": "s", "step": "s", "1": "1", "force2": "N m", "position2": "rad", "velocity2": "rad/s",
        "acceleration": f"{position}/s^2", "damping": f"({force} s/{position})", "source": "source",
    }  # fmt: skip
    head, *divisors = key.split("/")
    if not divisors:
        return names[head].strip("()")
    return names[head] + "".join(
        f"/({names[d]})" if set("/ ") & set(names[d]) else f"/{names[d]}" for d in divisors
    )


@dataclass(frozen=True)
class Effect:
    """Something that may be missing from a nominal model.

    Attributes:
        name: Name in verdicts.
        family: Family in the scoring.
        site: "joint" (a force), "inertia" (a nominal parameter beyond its uncertainty), "actuator", "sensor", or
            "record": it shows in the samples themselves, is read off them (`bench.discrepancy.checks.data_quality`), and needs no fit; or
            "read off": what it is in a record is read off that first, and then fitted (`effects.read_off`).
        parameters: Free parameters, the amplitude first.
        equation: One line for reports.
        law: Law of a joint effect, as it goes back into a rig.
        limit: Limit of set-valued friction; it replaces the regularised force of `law` in the simulator of the fits.
        theta: Parameter values and scales to the theta of `law`; the values themselves where None.
        n_coordinates: Number of coordinates (2: couples the axes of the joint rig).
        n_linear: Number of leading parameters the force is linear in; one a coordinate where zero.
        modulated: Parameters 1 to 3 are depth, frequency and phase of a modulation of the amplitude.
        affine: The force is affine in parameter 1.
        signal: For actuator and sensor effects, the operation on a channel.
        between_samples: That operation moves samples in time, and needs what the channel does between them.
        held_as: What it is on samples that are held until the next, whose operation gives the means over these; itself where None.
        later: Of a delay where a motion is prescribed, whether the force that responds is logged later (1) or earlier (-1) by it.
        logged: For actuator effects, what was logged is wrong rather than what follows a command: a measured load has it, too.
        tells: Parameter values and scales to whether they are more than the clocks of any log are uncertain by; of other effects None.
        exact: A free run with it is as exact as one of the nominal model: a number is wrong, and nothing is smoothed, switched or
            interpolated.
        factor: It scales the response to a load, as others of these do: a wrong inertia, the gain of a load or of a sensor.
        quantity: For sensor effects the kind of channel ("position", "acceleration"); for inertia the parameter kind.
        pickup: The sensor adds a share of another measured channel: a load, or the response of the other axis.
        added: Parameter values, the name of a record and its times (n,) to what the sensor adds to its channel; nothing where None.
        log_prior: Log prior odds against an effect of the README's list.
        rate_bound: Parameter values and scales to the fastest rate of the law [1/s]; the structure's own where None.
        variant: What tells it from the effect of the same name in the catalogue; empty for that one.
        creeps: Its friction creeps at rest, so that `limit` writes how (`friction_limits`).
        of_record: Parameter values and the name of a record to the theta of `law` in that record; the same in all where None.
        schedule: Parameter values and a record to the schedule of its force there (`equations_of_motion.scale_at`); none where None.
        varies: Name of the effect that this one is with a size that follows something; empty for others.
        carried: Parameter values and scales to the inertia that its law moves instead of the nominal model's own; None where it moves
            none.
        in_place: It takes the place of the nominal model's own dry friction along its coordinate.
        contains: Names of the plainer laws that it is for some values of its parameters.
    """

    name: str
    family: str
    site: Site
    parameters: tuple[FreeParameter, ...]
    equation: str = ""
    law: ForceLaw | None = None
    limit: Kernel | None = None
    theta: Callable[[Values, Scales], Values] | None = None
    n_coordinates: int = 1
    n_linear: int = 0
    modulated: bool = False
    affine: bool = False
    signal: Callable[[Values, Values, float], Values] | None = None
    held_as: Effect | None = None
    later: float = 0.0
    between_samples: bool = False
    logged: bool = False
    tells: Callable[[Values, Scales], bool] | None = None
    exact: bool = False
    factor: bool = False
    quantity: str = ""
    pickup: bool = False
    added: Callable[[Values, str, Values], Values] | None = None
    log_prior: float = 0.0
    rate_bound: Callable[[Values, Scales], float] | None = None
    variant: str = ""
    creeps: bool = False
    varies: str = ""
    in_place: bool = False
    contains: tuple[str, ...] = ()
    carried: Callable[[Values, Scales], float] | None = None
    of_record: Callable[[Values, str], Values] | None = None
    schedule: Callable[[Values, CaseRecord], Values] | None = None

    def on(self, interpolation: str) -> Effect:
        """What it is on loads that run so between samples, see `Case.load_interpolation`."""
        return (self.held_as if interpolation == "zero_order_hold" else None) or self

    @property
    def kind(self) -> str:
        """What kind of thing it is: its family, but one kind for all factors, which may be told apart by priors alone."""
        return "factor" if self.factor else self.family

    @property
    def sticks(self) -> bool:
        """Whether it is friction that is set-valued at rest."""
        return self.limit is not None and not self.creeps

    @property
    def rare(self) -> bool:
        """Whether it is tried only where no commoner effect alone explains the records."""
        return self.log_prior <= EFFECT_SETTINGS.rare and self.site != "inertia"

    @property
    def addresses(self) -> tuple[int, int, int]:
        """Addresses of the force, rate and limit kernels, zero where there is none."""
        if self.law is None:
            return 0, 0, 0
        if self.limit is not None:
            return 0, 0, self.limit.address
        return self.law.force.address, self.law.rate.address if self.law.rate else 0, 0

    def values(self, eta: Values, scales: Scales) -> Values:
        """Physical parameter values (n_parameters,)."""
        return np.array([p.value(e, scales) for p, e in zip(self.parameters, eta, strict=True)])

    def kernel_theta(self, eta: Values, scales: Scales) -> Values:
        """Parameters as the kernels take them."""
        values = self.values(eta, scales)
        return values if self.theta is None else self.theta(values, scales)

    def fastest(self, values: Values, scales: Scales) -> float:
        """Fastest rate of the law, for the choice of the step [1/s]."""
        return self.rate_bound(values, scales) if self.rate_bound is not None else 0.0

    def grid(self) -> list[Values]:
        """All combinations of the grid values, amplitude at its prior mean."""
        axes = [p.grid if p.grid else (p.mean,) for p in self.parameters]
        return [np.array(point) for point in product(*axes)]
