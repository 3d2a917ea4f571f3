"""What the environments are about: rigs, distributions of unknown joints, sensors, limits.

The figures are those of a weak shaker on a lightly damped rig: the force alone moves it by a few millimetres, and dead-space or
yield is reached only by pumping the resonance, whose frequency is not known in advance. What to do next then depends on what
has been measured.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType

import numpy as np

from bench.errors import UnknownNameError
from bench.excitation import Experiment, Limits, RigHypothesis, RigPrior, Rivals, Uncertain, paired_experiment
from bench.laws import find_law
from bench.rig import Element, Rig
from bench.rig.library import joint_rig, sdof_rig

from .places import StationSetup


@dataclass(frozen=True)
class SetupsSettings:
    """Numbers of `envs.setups`."""

    draws_seed: int = 2006
    """Seed of the fixed prior draws that rewards are averaged over; hidden rigs are drawn anew in every episode."""
    reference_seconds: float = 3.0


SETTINGS = SetupsSettings()


@dataclass(frozen=True, eq=False)
class Setup(StationSetup):
    """A laboratory and the questions asked in it.

    Attributes:
        experiments: The questions on their fixed draws, in the same order.
        recipe: Function of this module and its arguments that make this setup; it travels in place of the setup.
        place: What rigs are made of there.
    """

    experiments: tuple[Experiment, ...]
    recipe: tuple[str, tuple]
    place: Laboratory

    def __reduce__(self) -> tuple:
        return (made, self.recipe)

    @property
    def rig(self) -> Rig:
        """A rig of the laboratory, for its MJCF."""
        return self.experiments[0].rigs_drawn[0].hypothesis.rig


def made(name: str, arguments: tuple) -> Setup:
    """The setup of a recipe."""
    return {"sdof": sdof_setup, "joint": joint_setup, "discrimination": discrimination_setup}[name](
        *arguments
    )


class Laboratory:
    """A laboratory: its rig, its sensors, where a joint's effects act, and each joint's actuator, stroke and velocity (`driven`)."""

    def __init__(self, name: str) -> None:
        self.name = name
        if name == "sdof":
            self.noise = {"displacement": 5e-4, "velocity": 1e-2, "acceleration_x": 0.2}
            self.limits = Limits({"shaker": 2.0}, {"shaker": 10.0}, {"displacement": 0.04}, {"velocity": 0.6})
            self.scale = {"displacement": 0.04, "velocity": 0.6, "acceleration_x": 10.0}
            self.band, self.window, self.duration = (0.5, 5.0), 0.04, 8.0
            self.joint = "carriage"
            self.driven = {"carriage": ("shaker", "displacement", "velocity")}
        else:
            self.noise = {
                "axial": 2e-4, "torsional": 8e-3, "axial_velocity": 8e-3, "torsional_velocity": 0.3,
                "displacement_1": 2e-4, "rotation_1": 8e-3,
            }  # fmt: skip
            self.limits = Limits(
                {"force": 800.0, "torque": 16.0},
                {"force": 8e5, "torque": 3.2e2},
                {"axial": 0.015, "torsional": 0.6},
                {"axial_velocity": 0.6, "torsional_velocity": 24.0},
            )
            self.scale = {**self.limits.watched, "displacement_1": 0.015, "rotation_1": 0.6}
            self.band, self.window, self.duration = (1.5, 12.0), 0.02, 4.0
            self.joint = "axial"
            self.driven = {
                "axial": ("force", "axial", "axial_velocity"),
                "torsional": ("torque", "torsional", "torsional_velocity"),
            }

    def rig(self, *elements: Element) -> Rig:
        """The rig with some elements."""
        if self.name == "sdof":
            return sdof_rig(*elements, mass=2.0, stiffness=300.0, damping=1.5, timestep=1e-2)
        soft = {"axial_1": 300.0, "axial_2": 300.0, "torsional_1": 0.2, "torsional_2": 0.2}
        return joint_rig(*elements, timestep=5e-3).with_structure(damping=soft)

    def element(self, law: str, *joints: str, **parameters: float) -> Element:
        """An element at the joint, or at others, with some parameters."""
        found = find_law(law)
        return Element(found, joints or (self.joint,), found.theta(**parameters), name=law)


def _sdof_structure() -> tuple[Uncertain, ...]:
    return Uncertain("stiffness:carriage", 200.0, 400.0), Uncertain("damping:carriage", 0.8, 3.0)


SDOF_LAWS = ("gap", "bouc_wen", "coulomb")
"""Joints that `JointBench/SDOFExcitation-v0` may hide."""

PAIRS = ("gap_cubic", "presliding_bouc_wen", "coulomb_stribeck", "axial_gap_coupling")
"""Questions that `JointBench/Discrimination-v0` may ask; the last needs two loads."""

RIGS = ("sdof", "joint")


def _sdof_hypothesis(place: Laboratory, law: str) -> RigHypothesis:
    own = {
        "gap": (
            Uncertain("gap.stiffness", 300.0, 1500.0),
            Uncertain("gap.clearance", 5e-3, 30e-3),
        ),
        "bouc_wen": (
            Uncertain("bouc_wen.A", 15.0, 80.0),
            Uncertain("bouc_wen.beta", 20.0, 70.0),
            Uncertain("bouc_wen.gamma", 5.0, 30.0),
        ),
        "coulomb": (Uncertain("coulomb.limit", 0.1, 1.0),),
    }[law]
    fixed = {"coulomb": {"regularisation_velocity": 2e-2}}.get(law, {})
    return RigHypothesis(law, place.rig(place.element(law, **fixed)), (*_sdof_structure(), *own))


@lru_cache(maxsize=16)
def sdof_setup(laws: tuple[str, ...] = SDOF_LAWS, n_draws: int = 6) -> Setup:
    """One load on the SDOF rig; stiffness, damping, the kind of joint and its parameters are unknown.

    Args:
        laws: Kinds of joint, from `SDOF_LAWS`.
        n_draws: Prior draws that rewards are averaged over.
    """
    for law in laws:
        if law not in SDOF_LAWS:
            raise UnknownNameError("joint of the SDOF environment", law, SDOF_LAWS)
    place = Laboratory("sdof")
    prior = RigPrior(tuple(_sdof_hypothesis(place, law) for law in laws))
    return _identification(place, prior, n_draws, ("sdof", (laws, n_draws)))


@lru_cache(maxsize=4)
def joint_setup(n_draws: int = 4) -> Setup:
    """Two loads on the axial-torsional joint; clearances, contact stiffnesses and coupling damping are unknown.

    Its springs and dampers at rest are taken as known, from a linear test at a low level.
    """
    place = Laboratory("joint")
    law = "axial_torsional_joint"
    parameters = (
        Uncertain(f"{law}.k_gap_axial", 5e4, 3e5),
        Uncertain(f"{law}.clearance_axial", 2e-3, 8e-3),
        Uncertain(f"{law}.c_coupling_axial", 3e3, 5e4),
        Uncertain(f"{law}.k_gap_torsional", 35.0, 200.0),
        Uncertain(f"{law}.clearance_torsional", 0.08, 0.32),
        Uncertain(f"{law}.c_coupling_torsional", 50.0, 1000.0),
    )
    rig = place.rig(place.element(law, "axial", "torsional"))
    return _identification(
        place, RigPrior((RigHypothesis(law, rig, parameters),)), n_draws, ("joint", (n_draws,))
    )


def _identification(place: Laboratory, prior: RigPrior, n_draws: int, recipe: tuple[str, tuple]) -> Setup:
    draws = prior.draws(n_draws, np.random.default_rng(SETTINGS.draws_seed))
    return _setup(place, (prior,), (Experiment(prior, place.noise, place.limits, draws),), recipe)


def _setup(
    place: Laboratory,
    questions: tuple[RigPrior, ...] | tuple[Rivals, ...],
    experiments: tuple[Experiment, ...],
    recipe: tuple[str, tuple],
) -> Setup:
    return Setup(
        questions,
        MappingProxyType(dict(place.noise)),
        place.limits,
        MappingProxyType(dict(place.scale)),
        place.band,
        place.window,
        place.duration,
        experiments,
        recipe,
        place,
    )


@lru_cache(maxsize=16)
def discrimination_setup(rig: str = "joint", pairs: tuple[str, ...] = PAIRS, n_draws: int = 4) -> Setup:
    """Two rival effects a question.

    Args:
        rig: "sdof" (one load) or "joint" (two loads).
        pairs: Questions, from `PAIRS`; each episode asks one of them.
        n_draws: Pairs of prior draws a question.
    """
    if rig not in RIGS:
        raise UnknownNameError("rig of the discrimination environment", rig, RIGS)
    known = PAIRS if rig == "joint" else PAIRS[:-1]
    for pair in pairs:
        if pair not in known:
            raise UnknownNameError(f"pair of effects on rig '{rig}'", pair, known)
    place = Laboratory(rig)
    questions = tuple(_rivals(place, pair) for pair in pairs)
    experiments = tuple(rival_experiment(place, item, n_draws) for item in questions)
    return _setup(place, questions, experiments, ("discrimination", (rig, pairs, n_draws)))


def rival_experiment(place: Laboratory, rivals: Rivals, n_draws: int) -> Experiment:
    """A question on pairs of draws that imitate each other, always the same."""
    return paired_experiment(
        rivals,
        place.noise,
        place.limits,
        pairs=n_draws,
        duration=SETTINGS.reference_seconds,
        band=place.band,
        rng=np.random.default_rng(SETTINGS.draws_seed),
    )


_RIVALS = {
    "gap_cubic": ("gap", "cubic_stiffness"),
    "presliding_bouc_wen": ("jenkins", "bouc_wen"),
    "coulomb_stribeck": ("coulomb", "stribeck"),
    "axial_gap_coupling": ("gap", "gap_coupling"),
}


def _rivals(place: Laboratory, pair: str) -> Rivals:
    first, second = (_effect(place, law) for law in _RIVALS[pair])
    return Rivals(pair, first, second)


def _effect(place: Laboratory, law: str) -> RigHypothesis:
    """One effect beside the spring and damper of a rig."""
    # Forces and lengths of the joint rig stand to those of the SDOF rig as its axial contact to the other's.
    force, length = (1.0, 1.0) if place.name == "sdof" else (250.0, 0.25)
    stiffness = force / length
    contact = stiffness if place.name == "sdof" else 0.2 * stiffness  # stiffer ones outrun the time step
    slow = {"regularisation_velocity": 2e-2 * length}
    fixed, ranges = {
        "gap": ({}, {"stiffness": (300.0, 1500.0, contact), "clearance": (5e-3, 20e-3, length)}),
        "cubic_stiffness": ({}, {"k3": (5e4, 2e6, stiffness / length**2)}),
        "jenkins": (
            {"transition": 0.5},
            {"stiffness": (20.0, 60.0, stiffness), "limit": (0.4, 1.5, force)},
        ),
        "bouc_wen": (
            {},
            {
                "A": (20.0, 100.0, stiffness),
                "beta": (20.0, 70.0, 1.0 / length),
                "gamma": (5.0, 30.0, 1.0 / length),
            },
        ),
        "coulomb": (slow, {"limit": (0.1, 1.0, force)}),
        "stribeck": (
            slow,
            {
                "limit": (0.1, 0.8, force),
                "boost": (0.1, 0.8, 1.0),
                "stribeck_velocity": (0.03, 0.2, length),
            },
        ),
        "gap_coupling": (
            {},
            {
                "c_axial": (3e3, 5e4, 1.0),
                "c_torsional": (50.0, 1000.0, 1.0),
                "clearance_axial": (1e-3, 5e-3, 1.0),
                "clearance_torsional": (0.05, 0.25, 1.0),
            },
        ),
    }[law]
    own = tuple(
        Uncertain(f"{law}.{name}", low * unit, high * unit) for name, (low, high, unit) in ranges.items()
    )
    joints = ("axial", "torsional") if law == "gap_coupling" else ()
    element = place.element(law, *joints, **fixed)
    if place.name == "sdof":
        return RigHypothesis(law, place.rig(element), (*_sdof_structure(), *own))
    return RigHypothesis(
        law, place.rig(place.element("linear", stiffness=3.5e4, damping=300.0), element), own
    )
