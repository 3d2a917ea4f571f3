"""What is wrong with a robot, beside what the fourth set has: each function here makes a fault, which gives a changed machine.

Names are those of the diagnosis, where it has one.
"""

from __future__ import annotations

import numpy as np
from fourth_robots_cases.faults import Fault, changed, changing
from fourth_robots_cases.robots import Vector

from bench.arrays import Array
from fifth_robots_cases.machine import Machine


def cogging(joint: str, *, amplitude: float, second: float, pitch: float, phase: float) -> Fault:
    """Ripple of a slide with a second harmonic, see `machine.Cogging`."""
    values = {"amplitude": amplitude, "second": second, "pitch": pitch, "phase": phase}
    return Fault("cogging", joint, values, changing("cogging", **values))


def stribeck_friction(joint: str, *, coulomb: float, peak: float, velocity: float) -> Fault:
    """Dry friction [N m] besides the background, and a peak [N m] that falls with the velocity [rad/s]; see `machine.Friction`."""

    def act(machine: Machine, j: int) -> Machine:
        sliding = machine.friction.coulomb[j] + coulomb
        friction = changed(machine.friction, j, coulomb=sliding, static=sliding + peak, velocity=velocity)
        return machine._replace(friction=friction)

    return Fault("stribeck_friction", joint, {"coulomb": coulomb, "peak": peak, "velocity": velocity}, act)


def actuator_deadband(actuator: str, joint: str, *, half: float) -> Fault:
    """An error of a position servo [rad] to each side within which it gives nothing."""
    return Fault("actuator_deadband", actuator, {"half": half}, changing("servos", deadband=half), at=joint)


def position_delay(joint: str, *, late: float) -> Fault:
    """A time [s] by which a position is logged late."""

    def act(machine: Machine, j: int) -> Machine:
        times = machine.late.copy()
        times[j] = late
        return machine._replace(late=times)

    return Fault("position_delay", joint, {"late": late}, act)


def mass_error(body: str, joint: str, *, mass: float, place: Vector) -> Fault:
    """A point mass [kg] at a place in the frame of a body [m]."""
    at = np.array(place, float)

    def act(machine: Machine, j: int) -> Machine:
        chain = machine.chain
        total = chain.mass[j] + mass
        com = (chain.mass[j] * chain.com[j] + mass * at) / total
        inertia = chain.inertia[j] + _steiner(chain.mass[j], chain.com[j] - com) + _steiner(mass, at - com)
        masses, coms, inertias = chain.mass.copy(), chain.com.copy(), chain.inertia.copy()
        masses[j], coms[j], inertias[j] = total, com, inertia
        return machine._replace(chain=chain._replace(mass=masses, com=coms, inertia=inertias))

    return Fault("mass_error", body, {"mass": mass, "place": list(place)}, act, at=joint)


def _steiner(mass: float, apart: Array) -> Array:
    """Inertia [kg m^2] (3, 3) of a mass [kg] about a point apart from it [m] (3)."""
    return mass * (apart @ apart * np.eye(3) - np.outer(apart, apart))


def base_tilt(joint: str, *, tilt: float, towards: float) -> Fault:
    """A base that leans by an angle [deg] towards a direction [deg] of the joint that it carries."""

    def act(machine: Machine, _: int) -> Machine:
        lean, side = np.radians(tilt), np.radians(towards)
        level = np.sin(lean)
        gravity = 9.81 * np.array([level * np.cos(side), level * np.sin(side), -np.cos(lean)])
        return machine._replace(chain=machine.chain._replace(gravity=gravity))

    return Fault("base_tilt", "base", {"tilt_deg": tilt, "towards_deg": towards}, act, at=joint)


def rotor(body: str, joint: str, *, momentum: Vector) -> Fault:
    """A rotor that runs in a body, of an angular momentum in its frame [N m s]: torques across the turning of the body."""

    def act(machine: Machine, j: int) -> Machine:
        momenta = machine.chain.rotor.copy()
        momenta[j] = momentum
        return machine._replace(chain=machine.chain._replace(rotor=momenta))

    return Fault("rotor", body, {"momentum": list(momentum)}, act, named=False, at=joint)
