"""The real friction damper: identified at 0.5 Hz, predicted at 1 Hz from its motion alone."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bench.data import friction_damper
from bench.errors import RangeWarning
from bench.identification.network import fit_network
from bench.identification.parametric import ComponentRecord, fit_law
from bench.identification.polynomial import fit_polynomial
from bench.laws import find_law
from bench.recording import Recording, nrmse
from bench.reduction import element_from
from bench.rig import Element, simulate
from bench.rig.library import damper_rig, prescribe, starting


@dataclass(frozen=True)
class DamperSetup:
    """Numbers of `bench.demo.damper`."""

    tensions: tuple[int, ...] = (20, 35, 70, 80)
    """Band tensions of the shipped friction-damper tests [lbf]."""


DAMPER_SETUP = DamperSetup()


class DamperTest(NamedTuple):
    """An unseen damper test: identified at half its frequency, at the same band tension."""

    tension: int  # [lbf]
    measured: Recording
    simulated: dict[str, Recording]  # by model
    nrmse: dict[str, float]  # by model, force, settling time left out
    outside: dict[str, float]  # by model, share of samples outside the range of its data


def damper_motion(recording: Recording) -> ComponentRecord:
    """A damper record in SI units as motion and force."""
    return ComponentRecord(
        recording.time,
        recording["displacement"][:, None],
        np.gradient(recording["displacement"], 1.0 / recording.sample_rate)[:, None],
        recording["force"][:, None],
    )


def damper_record(frequency: str, tension: int) -> Recording:
    """A shipped friction-damper test in SI units."""
    return friction_damper(f"{frequency}Hz_{tension}lb").to_si()


def identify_damper(record: Recording, rng: np.random.Generator) -> dict[str, Element]:
    """Parametric, polynomial and network models of the damper, from one test, as elements on "piston"."""
    motion = damper_motion(record)
    peak, stroke = float(np.percentile(np.abs(motion.force), 90)), float(np.ptp(motion.displacement))
    law = find_law("jenkins_backlash")
    limits = {"limit_positive": (0.5 * peak, 1.5 * peak), "limit_negative": (0.5 * peak, 1.5 * peak)}
    parametric = fit_law(
        law,
        [ComponentRecord(*(column[::4] for column in motion))],
        start={
            "stiffness": 20.0 * peak / stroke,
            "soft_stiffness": 2.0 * peak / stroke,
            "clearance": 0.04 * stroke,
            "limit_positive": peak,
            "limit_negative": peak,
        },
        search={
            "stiffness": (5.0 * peak / stroke, 50.0 * peak / stroke),
            "clearance": (0.01 * stroke, 0.1 * stroke),
            "offset": (-0.1 * peak, 0.1 * peak),
            **limits,
        },
        starts=4,
        rng=rng,
    )
    states = np.concatenate([motion.displacement, motion.velocity], axis=1)[::4]
    force = motion.force[::4]
    polynomial = fit_polynomial(states, force, orders=(5, 5))
    network = fit_network(states, force, n_hidden=15, rng=rng)
    return {
        "parametric": Element(parametric.law, ("piston",), parametric.theta, name="damper"),
        "polynomial": element_from(polynomial, ("piston",), name="damper"),
        "network": element_from(network, ("piston",), name="damper"),
    }


def damper_test(tension: int, rng: np.random.Generator) -> DamperTest:
    """Identify on the 0.5 Hz test, predict the 1 Hz test of the same tension from its motion alone."""
    elements = identify_damper(damper_record("0.5", tension), rng)
    unseen = damper_record("1", tension)
    x = unseen["displacement"]
    scored = unseen.scored
    simulated, errors, outside = {}, {}, {}
    for label, element in elements.items():
        rig = damper_rig(element, timestep=1.0 / unseen.sample_rate)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RangeWarning)  # told with the figures, in `outside`
            record = simulate(rig, prescribe(rig, x), initial=starting(rig, x))
        states = np.stack([record["damper/displacement"], record["damper/velocity"]], axis=1)
        outside[label] = 0.0 if element.validity is None else float(np.mean(element.validity.outside(states)))
        simulated[label] = record
        errors[label] = nrmse(unseen["force"][scored], record["damper/force"][scored])
    return DamperTest(tension, unseen, simulated, errors, outside)
