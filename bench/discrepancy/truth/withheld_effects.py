"""What sealed cases withhold: effects with parameters drawn over the ranges that test laboratories see.

Shapes (clearances, Stribeck velocities, orders, …) are drawn here from ranges of their own, stated as parts of what the
rig does without the effect: the largest displacement X and velocity V along the coordinate, the RMS load, the nominal
stiffness. They are not the priors of the diagnosis, so that a stated probability can turn out wrong. The
strength, one number for every effect, is left open: the maker of cases sets it by the wanted gap.
"""

from __future__ import annotations

import math

import numpy as np

from bench.discrepancy.effects import friction_limits as limits
from bench.discrepancy.truth import catalogued_shapes as shapes
from bench.discrepancy.truth import foreign_memory, foreign_shapes
from bench.discrepancy.truth import out_of_catalogue as foreign
from bench.discrepancy.truth.recipe import Recipe
from bench.errors import UnknownNameError
from bench.laws.bouc_wen import BOUC_WEN
from bench.laws.carried_mass import CARRIED_MASS
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

FREE = ("sdof", "joint")
BOTH = ("both",)
DRIVEN_BY_FORCE = ("sdof",)

RECIPES: tuple[Recipe, ...] = (
    Recipe("coulomb_friction", "joint", shapes.one("friction_force", shapes.force, shapes.slow), law=COULOMB, limit=limits.coulomb_limit),
    Recipe(
        "stribeck_friction", "joint", shapes.stribeck, law=STRIBECK, limit=limits.stribeck_limit, holds=("coulomb_friction",),
    ),
    Recipe("presliding_friction", "joint", shapes.presliding, law=LUGRE),
    Recipe("bouc_wen_hysteresis", "joint", shapes.bouc_wen, law=BOUC_WEN),
    Recipe("gap", "joint", shapes.gap, law=GAP),
    Recipe("one_sided_stop", "joint", shapes.one_sided, law=ONE_SIDED_STOP),
    Recipe("cubic_stiffness", "joint", shapes.one("k3", lambda r: r.stiffness / r.position**2, signed=True), law=CUBIC_STIFFNESS),
    Recipe("quadratic_stiffness", "joint", shapes.one("k2", lambda r: r.stiffness / r.position, signed=True), law=QUADRATIC_STIFFNESS),
    Recipe("quadratic_damping", "joint", shapes.one("c2", lambda r: r.force / r.velocity**2), law=QUADRATIC_DAMPING),
    Recipe("power_law_damping", "joint", shapes.power_law, law=POWER_LAW_DAMPING),
    Recipe("viscoelastic_relaxation", "joint", shapes.relaxation, law=MAXWELL),
    Recipe(
        "load_dependent_friction", "joint",
        shapes.one("friction_per_displacement", lambda r: r.force / r.position, lambda r: 0.0, shapes.slow),
        law=LOAD_DEPENDENT_FRICTION, limit=limits.load_dependent_limit,
    ),
    Recipe(
        "time_varying_friction", "joint", shapes.time_varying, law=TIME_VARYING_FRICTION, limit=limits.time_varying_limit,
        holds=("coulomb_friction",),
    ),
    Recipe(
        "stiffness_drift", "joint",
        shapes.one("rate", lambda r: r.stiffness / r.duration, lambda r: 0.0, signed=True), law=STIFFNESS_DRIFT,
    ),
    Recipe("mass_error", "inertia", shapes.relative, rigs=FREE),
    Recipe("carried_mass", "joint", shapes.carried, rigs=DRIVEN_BY_FORCE, law=CARRIED_MASS),
    Recipe("actuator_delay", "actuator", shapes.delay, rigs=DRIVEN_BY_FORCE),
    Recipe("actuator_lag", "actuator", shapes.one("time_constant", lambda r: 1.0 / r.omega), rigs=DRIVEN_BY_FORCE),
    Recipe("force_gain_error", "actuator", shapes.relative, rigs=DRIVEN_BY_FORCE),
    Recipe(
        "displacement_drift", "sensor", shapes.one("drift", lambda r: r.position, signed=True), rigs=DRIVEN_BY_FORCE,
        target="displacement", sensors=BOTH,
    ),
    Recipe("displacement_delay", "sensor", shapes.delay, rigs=DRIVEN_BY_FORCE, target="displacement", sensors=BOTH),
    Recipe("displacement_gain_error", "sensor", shapes.relative, rigs=DRIVEN_BY_FORCE, target="displacement", sensors=BOTH),
    Recipe("gap_coupling", "joint", shapes.gap_coupling, rigs=("joint",), law=GAP_COUPLING, weight=3.0),
    Recipe(
        "cross_stiffness", "joint", shapes.one("k_cross", lambda r: math.sqrt(r.stiffness * r.stiffness2), signed=True),
        rigs=("joint",), law=CROSS_STIFFNESS, weight=3.0,
    ),
    Recipe("backlash_friction", "joint", shapes.backlash, law=JENKINS_BACKLASH, weight=0.4),
    Recipe("force_offset", "joint", shapes.one("offset", shapes.force, signed=True), law=CONSTANT_FORCE, weight=0.4),
    Recipe("actuator_saturation", "actuator", shapes.saturation, rigs=DRIVEN_BY_FORCE, weight=0.4),
    Recipe(
        "displacement_bias", "sensor", shapes.one("bias", lambda r: r.position, signed=True), rigs=DRIVEN_BY_FORCE,
        target="displacement", weight=0.4, sensors=BOTH,
    ),
    Recipe("displacement_clipping", "sensor", shapes.clipping, rigs=DRIVEN_BY_FORCE, target="displacement", weight=0.4, sensors=BOTH),
    Recipe("acceleration_gain_error", "sensor", shapes.relative, rigs=DRIVEN_BY_FORCE, target="acceleration", weight=0.4, sensors=BOTH),
    Recipe("acceleration_delay", "sensor", shapes.delay, rigs=DRIVEN_BY_FORCE, target="acceleration", weight=0.4, sensors=BOTH),
    Recipe(
        "modulated_stiffness", "joint",
        foreign_shapes.modulated(lambda rng, r: rng.uniform(0.15, 0.9) * r.omega / (2.0 * np.pi)), law=foreign.MODULATED_STIFFNESS,
    ),
    Recipe("fractional_damping", "joint", foreign_shapes.fractional, law=foreign_memory.FRACTIONAL_DAMPING),
    Recipe("snap_through", "joint", foreign_shapes.snap, law=foreign.SNAP_THROUGH),
    Recipe("switching_stiffness", "joint", foreign_shapes.switching, rigs=FREE, law=foreign_memory.SWITCHING_STIFFNESS),
    Recipe("friction_cone", "joint", foreign_shapes.cone, rigs=("joint",), law=foreign_memory.FRICTION_CONE, weight=3.0),
    Recipe("saturating_spring", "joint", foreign_shapes.saturating, law=foreign.SATURATING_SPRING),
    Recipe("hertz_contact", "joint", foreign_shapes.hertz, law=foreign.HERTZ_CONTACT),
    Recipe("hidden_resonator", "joint", foreign_shapes.resonator((0.5, 2.0), (0.01, 0.1)), rigs=FREE, law=foreign_memory.HIDDEN_RESONATOR),
    Recipe(
        "displacement_dependent_damping", "joint",
        shapes.one("c", lambda r: r.force / (r.velocity * r.position**2)), law=foreign.DISPLACEMENT_DEPENDENT_DAMPING,
    ),
    Recipe("stress_softening", "joint", foreign_shapes.stress_softening, law=foreign_memory.STRESS_SOFTENING),
    Recipe("position_dependent_friction", "joint", foreign_shapes.wavy(0.5), law=foreign.POSITION_DEPENDENT_FRICTION),
    Recipe("unmeasured_load", "joint", foreign_shapes.blow, rigs=FREE, law=foreign.UNMEASURED_LOAD),
    # the impulse of an impact falls between the samples of an accelerometer: positions only
    Recipe("restitution_stop", "stop", foreign_shapes.restitution, rigs=DRIVEN_BY_FORCE, sensors=("position",)),
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
