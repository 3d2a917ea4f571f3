"""A robot run along a reference: by its position servos, or by a computed-torque controller where torques are commanded.

The controller knows the nominal model only. It adds to the inverse dynamics along the reference a feedback of the measured position
(noisy and quantised) and of a filtered difference of it, scaled by the diagonal of the mass matrix, and holds its command over a sample.

References:
    B. Siciliano, L. Sciavicco, L. Villani and G. Oriolo, *Robotics: Modelling, Planning and Control*, 2009, sec. 8.5.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bench.arrays import Array
from second_robots_cases.dynamics import bias_force, mass_matrix, pose_of
from second_robots_cases.plant import Plant
from second_robots_cases.robots import Robot
from second_robots_cases.stepping import State, advance

SETTLING = 2.0
"""Time for which a robot holds its first reference position before the record begins [s]."""
PAST = 16
"""Samples for which past commands are kept."""
VELOCITY_FILTER = 18.0
"""Corner frequency of the filter of the differenced position [Hz]."""
DAMPING = 1.6
"""Velocity feedback over the bandwidth: twice the damping ratio."""


class Run(NamedTuple):
    """What a robot was commanded and did, without errors of the log; each array (n_samples, n_joints)."""

    command: Array
    """Position targets, or torques or currents, held from each sample on."""
    position: Array
    """Positions as the encoders would read them without noise or quantisation."""


class Controller:
    """A computed-torque controller of a bandwidth [Hz] along a reference (n_samples, n_joints)."""

    def __init__(
        self, robot: Robot, bandwidth: float, nominal: Plant, reference: Array, rng: np.random.Generator
    ) -> None:
        n, self.rate = len(robot.links), robot.rate
        self.nominal, self.reference, self.rng = nominal, reference, rng
        self.noise, self.resolution = np.array(robot.noise), np.array(robot.resolution)
        self.velocity = np.gradient(reference, 1 / robot.rate, axis=0)
        self.acceleration = np.gradient(self.velocity, 1 / robot.rate, axis=0)
        at_start = mass_matrix(nominal.chain, pose_of(reference[0], nominal.chain))
        self.inertia = np.diag(at_start) + nominal.drives.armature
        self.filter = 1 - np.exp(-2 * np.pi * VELOCITY_FILTER / robot.rate)
        self.bandwidth = 2 * np.pi * bandwidth
        self.last: Array | None = None
        self.estimate = self.rest = np.zeros(n)

    def command(self, k: int, position: Array) -> Array:
        """Command (n) at sample k, at a position (n) of the encoders; before sample 0 the first reference position is held."""
        n = len(position)
        noisy = position + self.noise * self.rng.standard_normal(n)
        measured = np.round(noisy / self.resolution) * self.resolution
        if self.last is not None:
            self.estimate = self.estimate + self.filter * ((measured - self.last) * self.rate - self.estimate)
        self.last = measured
        q, v, a = self.reference[max(k, 0)], self.rest, self.rest
        if k >= 0:
            v, a = self.velocity[k], self.acceleration[k]
        chain, drives = self.nominal.chain, self.nominal.drives
        pose = pose_of(q, chain)
        feedforward = (
            mass_matrix(chain, pose) @ a
            + drives.armature * a
            + bias_force(v, chain, pose)
            + drives.damping * v
        )
        feedback = self.bandwidth**2 * (q - measured) + DAMPING * self.bandwidth * (v - self.estimate)
        torque = feedforward + self.inertia * feedback
        largest = drives.limit / drives.gain
        return np.clip(torque / drives.gain, -largest, largest)


def run(
    plant: Plant, robot: Robot, nominal: Plant, reference: Array, step: float, rng: np.random.Generator
) -> Run:
    """Simulate a plant along a reference.

    Args:
        plant: What is simulated.
        robot: Its description.
        nominal: What the controller knows of it.
        reference: Positions (n_samples, n).
        step: Time step of the integration [s].
        rng: Source of the noise that the controller sees.
    """
    n, substeps, settling = len(robot.links), round(1 / robot.rate / step), round(SETTLING * robot.rate)
    state = State(reference[0].copy(), np.zeros(n), reference[0].copy(), np.zeros(n), np.zeros(n))
    history = np.tile(reference[0], (PAST, 1))
    late = np.round(plant.drives.delay / step).astype(np.int64)
    controller = None
    if robot.torque is not None:
        controller = Controller(robot, robot.torque.bandwidth, nominal, reference, rng)
    done = Run(np.zeros_like(reference), np.zeros_like(reference))
    for k in range(-settling, len(reference)):
        position = np.where(plant.transmission.elastic, state.motor_q, state.q) + plant.offset
        if controller is None:
            command = reference[max(k, 0)]
        else:
            command = controller.command(k, position)
            if k == -settling:
                history[:] = command
        history[1:] = history[:-1].copy()
        history[0] = command
        if k >= 0:
            done.command[k], done.position[k] = command, position
        advance(
            state, history, late, substeps, step, plant.chain, plant.drives, plant.transmission, plant.hose
        )
    return done
