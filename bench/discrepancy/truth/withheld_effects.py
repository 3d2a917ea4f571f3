"""What sealed cases withhold: effects with parameters drawn over the ranges that test laboratories see.

Shapes (clearances, Stribeck velocities, orders, …) are drawn here from ranges of their own, stated as parts of what the
rig does without the effect: the largest displacement X and velocity V along the coordinate, the RMS load, the nominal
stiffness. They are not the priors of the diagnosis, so that a stated probability can turn out wrong. The
strength, one number for every effect, is left open: the maker of cases sets it by the wanted gap.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bench.discrepancy.effects import friction_limits as limits
from bench.discrepancy.truth import out_of_catalogue as foreign
from bench.errors import UnknownNameError
from bench.laws.base import ForceLaw, Kernel
from bench.laws.bouc_wen import BOUC_WEN
from bench.laws.constant_force import CONSTANT_FORCE
from bench.laws.coulomb import COULOMB
from bench.laws.coupling import CROSS_STIFFNESS, GAP_COUPLING
from bench.laws.damping import POWER_LAW_DAMPING, QUADRATIC_DAMPING
from bench.laws.gap import GAP, ONE_SIDED_STOP
from bench.laws.jenkins_backlash import JENKINS_BACKLASH
from bench.laws.lugre import LUGRE
from bench.laws.maxwell import MAXWELL
from bench.laws.normal_force_friction import LOAD_DEPENDENT_FRICTION, TIME_VARYING_FRICTION
from bench.laws.stiffness import CUBIC_STIFFNESS, QUADRATIC_STIFFNESS, STIFFNESS_DRIFT
from bench.laws.stribeck import STRIBECK


@dataclass(frozen=True)
class WithheldEffectsSettings:
    """Numbers of `bench.discrepancy.truth.withheld_effects`."""

    slow: float = 1e-4
    """Velocity that rounds a law at rest, as a part of V; friction proper is set-valued in sealed cases."""


SETTINGS = WithheldEffectsSettings()


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


class Drawn(NamedTuple):
    """An effect with all its numbers.

    Attributes:
        values: Parameters by the name of the catalogue (or of the foreign law), the amplitude first.
        theta: Parameters of the law; empty for effects that are none.
        region: Intervals of displacement within which the force acts; empty where it acts everywhere.
    """

    values: Mapping[str, float]
    theta: tuple[float, ...] = ()
    region: tuple[tuple[float, float], ...] = ()


Shape = Callable[[float], Drawn]
"""Strength, of order one, to the effect."""


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
    draw: Callable[[np.random.Generator, Reach], Shape]
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


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    """A number whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _one(name: str, scale: Callable[[Reach], float], *extra: Callable[[Reach], float], signed: bool = False):
    """An effect of one parameter; `extra` completes the theta of its law."""

    def draw(rng: np.random.Generator, r: Reach) -> Shape:
        side = _sign(rng) if signed else 1.0

        def shape(a: float) -> Drawn:
            value = side * a * scale(r)
            return Drawn({name: value}, (value, *(e(r) for e in extra)))

        return shape

    return draw


_relative = _one("relative_error", lambda r: 1.0, signed=True)
_delay = _one("delay", lambda r: 1.0 / r.omega)


def _stribeck(rng: np.random.Generator, r: Reach) -> Shape:
    excess, velocity = _between(rng, 0.3, 1.5), _between(rng, 0.05, 0.4) * r.velocity

    def shape(a: float) -> Drawn:
        values = {"friction_force": a * r.force, "static_excess": excess, "stribeck_velocity": velocity}
        return Drawn(values, (*values.values(), SETTINGS.slow * r.velocity))

    return shape


def _presliding(rng: np.random.Generator, r: Reach) -> Shape:
    slip, damping = _between(rng, 0.02, 0.25) * r.position, _between(rng, 0.05, 0.5) / r.velocity

    def shape(a: float) -> Drawn:
        level = a * r.force
        values = {
            "friction_force": level, "presliding_displacement": slip, "bristle_damping_per_force": damping,
        }  # fmt: skip
        return Drawn(values, (level, level / slip, level * damping, 0.0, r.velocity, 0.0))

    return shape


def _bouc_wen(rng: np.random.Generator, r: Reach) -> Shape:
    yielding, skew, n = _between(rng, 0.08, 0.6), rng.uniform(-0.3, 0.9), float(rng.choice([1.0, 1.5, 2.0]))

    def shape(a: float) -> Drawn:
        stiffness = a * r.stiffness
        strength = stiffness * yielding * r.position
        beta = stiffness / strength**n / (1.0 + skew)
        values = {"A": stiffness, "beta": beta, "gamma": skew * beta, "n": n}
        return Drawn(values, tuple(values.values()))

    return shape


def _backlash(rng: np.random.Generator, r: Reach) -> Shape:
    slip, clearance = _between(rng, 0.05, 0.3) * r.position, _between(rng, 0.05, 0.3) * r.position

    def shape(a: float) -> Drawn:
        level = a * r.force
        values = {"friction_force": level, "slip_displacement": slip, "clearance": clearance}
        stiffness = level / slip
        return Drawn(values, (stiffness, 0.1 * stiffness, clearance, level, level, 3.0, 0.0))

    return shape


def _gap(rng: np.random.Generator, r: Reach) -> Shape:
    clearance = rng.uniform(0.25, 0.85) * r.position

    def shape(a: float) -> Drawn:
        values = {"stiffness": a * r.stiffness, "clearance": clearance}
        region = ((-math.inf, -clearance), (clearance, math.inf))
        return Drawn(values, (values["stiffness"], clearance, 0.0, 0.0), region)

    return shape


def _one_sided(rng: np.random.Generator, r: Reach) -> Shape:
    side, position = _sign(rng), rng.uniform(-0.3, 0.8) * r.position

    def shape(a: float) -> Drawn:
        values = {"stiffness": a * r.stiffness, "position": side * position, "side": side}
        region = (side * position, math.inf) if side > 0 else (-math.inf, side * position)
        return Drawn(values, (values["stiffness"], side * position, 0.0, side), (region,))

    return shape


def _power_law(rng: np.random.Generator, r: Reach) -> Shape:
    n = rng.uniform(0.3, 0.8)

    def shape(a: float) -> Drawn:
        values = {"C": a * r.force * r.velocity**-n, "n": n}
        return Drawn(values, (*values.values(), SETTINGS.slow * r.velocity))

    return shape


def _relaxation(rng: np.random.Generator, r: Reach) -> Shape:
    time = _between(rng, 0.2, 5.0) / r.omega

    def shape(a: float) -> Drawn:
        values = {"stiffness": a * r.stiffness, "relaxation_time": time}
        return Drawn(values, tuple(values.values()))

    return shape


def _time_varying(rng: np.random.Generator, r: Reach) -> Shape:
    depth, frequency = rng.uniform(0.3, 0.9), rng.uniform(1.5, 6.0) / r.duration
    phase = rng.uniform(0.0, 2.0 * np.pi)

    def shape(a: float) -> Drawn:
        values = {"friction_force": a * r.force, "depth": depth, "frequency": frequency, "phase": phase}
        return Drawn(values, (*values.values(), SETTINGS.slow * r.velocity))

    return shape


def _gap_coupling(rng: np.random.Generator, r: Reach) -> Shape:
    across, along = rng.uniform(0.15, 0.6) * r.position2, rng.uniform(0.15, 0.6) * r.position
    balance = _between(rng, 0.5, 2.0)

    def shape(a: float) -> Drawn:
        values = {
            "axial_damping": a * r.force / (r.velocity * r.position2),
            "torsional_damping": a * balance * r.force2 / (r.velocity2 * r.position),
            "torsional_clearance": across,
            "axial_clearance": along,
        }
        return Drawn(values, tuple(values.values()))

    return shape


def _saturation(rng: np.random.Generator, r: Reach) -> Shape:
    return lambda a: Drawn({"level": 3.0 * r.force / (1.0 + a)})


def _clipping(rng: np.random.Generator, r: Reach) -> Shape:
    return lambda a: Drawn({"level": r.position / (1.0 + a)})


def _modulated(rng: np.random.Generator, r: Reach) -> Shape:
    frequency = rng.uniform(0.15, 0.9) * r.omega / (2.0 * np.pi)
    phase = rng.uniform(0.0, 2.0 * np.pi)

    def shape(a: float) -> Drawn:
        values = {"stiffness": a * r.stiffness, "frequency": frequency, "phase": phase}
        return Drawn(values, tuple(values.values()))

    return shape


def _fractional(rng: np.random.Generator, r: Reach) -> Shape:
    alpha = rng.uniform(0.35, 0.65)
    shortest, ratio = 0.03 / r.omega, math.sqrt(10.0)

    def shape(a: float) -> Drawn:
        values = {"C": a * r.stiffness * r.omega**-alpha, "alpha": alpha}
        return Drawn(values, (*values.values(), shortest, ratio))

    return shape


def _snap(rng: np.random.Generator, r: Reach) -> Shape:
    window = rng.uniform(0.3, 0.6) * r.position

    def shape(a: float) -> Drawn:
        values = {"stiffness": a * r.stiffness, "window": window}
        return Drawn(values, tuple(values.values()), ((-window, window),))

    return shape


def _switching(rng: np.random.Generator, r: Reach) -> Shape:
    upper, lower = rng.uniform(0.45, 0.7) * r.position, rng.uniform(0.1, 0.35) * r.position
    side = _sign(rng)

    def shape(a: float) -> Drawn:
        # a spring taken away may take at most half of the rig's own, or the rig would fall over
        stiffness = a * r.stiffness if side > 0 else -0.5 * r.stiffness * a / (1.0 + a)
        values = {"stiffness": stiffness, "upper": upper, "lower": lower}
        return Drawn(values, (*values.values(), 0.3 / r.omega, r.omega))

    return shape


def _cone(rng: np.random.Generator, r: Reach) -> Shape:
    slip = _between(rng, 0.03, 0.15) * r.position
    radius = _between(rng, 0.6, 1.6) * r.velocity / r.velocity2

    def shape(a: float) -> Drawn:
        values = {"limit": a * r.force, "bristle_stiffness": a * r.force / slip, "radius": radius}
        return Drawn(values, tuple(values.values()))

    return shape


def _saturating(rng: np.random.Generator, r: Reach) -> Shape:
    width = rng.uniform(0.1, 0.5) * r.position

    def shape(a: float) -> Drawn:
        values = {"stiffness": a * r.stiffness, "width": width}
        return Drawn(values, tuple(values.values()))

    return shape


def _hertz(rng: np.random.Generator, r: Reach) -> Shape:
    side, position = _sign(rng), rng.uniform(-0.3, 0.7) * r.position

    def shape(a: float) -> Drawn:
        values = {
            "stiffness": a * r.stiffness / math.sqrt(r.position),
            "position": side * position,
            "side": side,
        }
        region = (side * position, math.inf) if side > 0 else (-math.inf, side * position)
        return Drawn(values, tuple(values.values()), (region,))

    return shape


def _resonator(rng: np.random.Generator, r: Reach) -> Shape:
    omega, damping_ratio = _between(rng, 0.5, 2.0) * r.omega, _between(rng, 0.01, 0.1)

    def shape(a: float) -> Drawn:
        stiffness = a * r.stiffness
        mass = stiffness / omega**2
        values = {"stiffness": stiffness, "mass": mass, "damping": 2.0 * damping_ratio * mass * omega}
        return Drawn(values, tuple(values.values()))

    return shape


def _stress_softening(rng: np.random.Generator, r: Reach) -> Shape:
    width = rng.uniform(0.3, 0.8) * r.position

    def shape(a: float) -> Drawn:
        values = {"stiffness": a * r.stiffness, "width": width}
        return Drawn(values, (*values.values(), 0.05 / r.omega))

    return shape


def _wavy(rng: np.random.Generator, r: Reach) -> Shape:
    depth, width, phase = (
        rng.uniform(0.5, 1.0),
        rng.uniform(0.1, 0.4) * r.position,
        rng.uniform(0.0, 2.0 * np.pi),
    )

    def shape(a: float) -> Drawn:
        values = {"friction_force": a * r.force, "depth": depth, "width": width, "phase": phase}
        return Drawn(values, (*values.values(), 0.02 * r.velocity))

    return shape


def _blow(rng: np.random.Generator, r: Reach) -> Shape:
    moment, width = rng.uniform(0.2, 0.8) * r.duration, _between(rng, 0.1, 1.0) / r.omega

    def shape(a: float) -> Drawn:
        values = {"force": a * r.force, "moment": moment, "width": width}
        return Drawn(values, tuple(values.values()))

    return shape


def _restitution(rng: np.random.Generator, r: Reach) -> Shape:
    side, restitution = _sign(rng), rng.uniform(0.3, 0.8)

    def shape(a: float) -> Drawn:
        position = side * r.position / (1.0 + a)
        region = (position, math.inf) if side > 0 else (-math.inf, position)
        return Drawn({"position": position, "side": side, "restitution": restitution}, (), (region,))

    return shape


def _force(r: Reach) -> float:
    return r.force


def _slow(r: Reach) -> float:
    return SETTINGS.slow * r.velocity


FREE = ("sdof", "joint")
BOTH = ("both",)
SHAKEN = ("sdof",)

RECIPES: tuple[Recipe, ...] = (
    Recipe("coulomb_friction", "joint", _one("friction_force", _force, _slow), law=COULOMB, limit=limits.coulomb_limit),
    Recipe(
        "stribeck_friction", "joint", _stribeck, law=STRIBECK, limit=limits.stribeck_limit, holds=("coulomb_friction",),
    ),
    Recipe("presliding_friction", "joint", _presliding, law=LUGRE),
    Recipe("bouc_wen_hysteresis", "joint", _bouc_wen, law=BOUC_WEN),
    Recipe("gap", "joint", _gap, law=GAP),
    Recipe("one_sided_stop", "joint", _one_sided, law=ONE_SIDED_STOP),
    Recipe("cubic_stiffness", "joint", _one("k3", lambda r: r.stiffness / r.position**2, signed=True), law=CUBIC_STIFFNESS),
    Recipe("quadratic_stiffness", "joint", _one("k2", lambda r: r.stiffness / r.position, signed=True), law=QUADRATIC_STIFFNESS),
    Recipe("quadratic_damping", "joint", _one("c2", lambda r: r.force / r.velocity**2), law=QUADRATIC_DAMPING),
    Recipe("power_law_damping", "joint", _power_law, law=POWER_LAW_DAMPING),
    Recipe("viscoelastic_relaxation", "joint", _relaxation, law=MAXWELL),
    Recipe(
        "load_dependent_friction", "joint",
        _one("friction_per_displacement", lambda r: r.force / r.position, lambda r: 0.0, _slow),
        law=LOAD_DEPENDENT_FRICTION, limit=limits.load_dependent_limit,
    ),
    Recipe(
        "time_varying_friction", "joint", _time_varying, law=TIME_VARYING_FRICTION, limit=limits.time_varying_limit,
        holds=("coulomb_friction",),
    ),
    Recipe(
        "stiffness_drift", "joint",
        _one("rate", lambda r: r.stiffness / r.duration, lambda r: 0.0, signed=True), law=STIFFNESS_DRIFT,
    ),
    Recipe("mass_error", "inertia", _relative, rigs=FREE),
    Recipe("actuator_delay", "actuator", _delay, rigs=SHAKEN),
    Recipe("actuator_lag", "actuator", _one("time_constant", lambda r: 1.0 / r.omega), rigs=SHAKEN),
    Recipe("force_gain_error", "actuator", _relative, rigs=SHAKEN),
    Recipe(
        "displacement_drift", "sensor", _one("drift", lambda r: r.position, signed=True), rigs=SHAKEN, target="displacement", sensors=BOTH,
    ),
    Recipe("displacement_delay", "sensor", _delay, rigs=SHAKEN, target="displacement", sensors=BOTH),
    Recipe("displacement_gain_error", "sensor", _relative, rigs=SHAKEN, target="displacement", sensors=BOTH),
    Recipe("gap_coupling", "joint", _gap_coupling, rigs=("joint",), law=GAP_COUPLING, weight=3.0),
    Recipe(
        "cross_stiffness", "joint", _one("k_cross", lambda r: math.sqrt(r.stiffness * r.stiffness2), signed=True),
        rigs=("joint",), law=CROSS_STIFFNESS, weight=3.0,
    ),
    Recipe("backlash_friction", "joint", _backlash, law=JENKINS_BACKLASH, weight=0.4),
    Recipe("force_offset", "joint", _one("offset", _force, signed=True), law=CONSTANT_FORCE, weight=0.4),
    Recipe("actuator_saturation", "actuator", _saturation, rigs=SHAKEN, weight=0.4),
    Recipe(
        "displacement_bias", "sensor", _one("bias", lambda r: r.position, signed=True), rigs=SHAKEN, target="displacement", weight=0.4,
        sensors=BOTH,
    ),
    Recipe("displacement_clipping", "sensor", _clipping, rigs=SHAKEN, target="displacement", weight=0.4, sensors=BOTH),
    Recipe("acceleration_gain_error", "sensor", _relative, rigs=SHAKEN, target="acceleration", weight=0.4, sensors=BOTH),
    Recipe("acceleration_delay", "sensor", _delay, rigs=SHAKEN, target="acceleration", weight=0.4, sensors=BOTH),
    Recipe("modulated_stiffness", "joint", _modulated, law=foreign.MODULATED_STIFFNESS),
    Recipe("fractional_damping", "joint", _fractional, law=foreign.FRACTIONAL_DAMPING),
    Recipe("snap_through", "joint", _snap, law=foreign.SNAP_THROUGH),
    Recipe("switching_stiffness", "joint", _switching, rigs=FREE, law=foreign.SWITCHING_STIFFNESS),
    Recipe("friction_cone", "joint", _cone, rigs=("joint",), law=foreign.FRICTION_CONE, weight=3.0),
    Recipe("saturating_spring", "joint", _saturating, law=foreign.SATURATING_SPRING),
    Recipe("hertz_contact", "joint", _hertz, law=foreign.HERTZ_CONTACT),
    Recipe("hidden_resonator", "joint", _resonator, rigs=FREE, law=foreign.HIDDEN_RESONATOR),
    Recipe(
        "displacement_dependent_damping", "joint",
        _one("c", lambda r: r.force / (r.velocity * r.position**2)), law=foreign.DISPLACEMENT_DEPENDENT_DAMPING,
    ),
    Recipe("stress_softening", "joint", _stress_softening, law=foreign.STRESS_SOFTENING),
    Recipe("position_dependent_friction", "joint", _wavy, law=foreign.POSITION_DEPENDENT_FRICTION),
    Recipe("unmeasured_load", "joint", _blow, rigs=FREE, law=foreign.UNMEASURED_LOAD),
    # the impulse of an impact falls between the samples of an accelerometer: positions only
    Recipe("restitution_stop", "stop", _restitution, rigs=SHAKEN, sensors=("position",)),
)  # fmt: skip
"""Effects of the catalogue, the trials' list first, the usual suspects less often; then the foreign ones."""


def recipe_named(name: str) -> Recipe:
    """Return the recipe of an effect.

    Raises:
        UnknownNameError: No such recipe.
    """
    for recipe in RECIPES:
        if recipe.name == name:
            return recipe
    raise UnknownNameError("effect of sealed cases", name, (recipe.name for recipe in RECIPES))
