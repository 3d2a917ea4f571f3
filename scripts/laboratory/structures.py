"""More carriages as a laboratory has them: structures and instruments, of which half hold what no law of the bench says."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bench.arrays import Array
from laboratory.made import STEP, Made, multisines, with_rates
from laboratory.oscillator import Oscillator


def wandering(x: Array) -> Array:
    """Displacements (n_samples, n_records) of a laser whose zero wanders away."""
    part = np.linspace(0.0, 1.0, len(x))[:, None]
    return x + 2e-3 * part * np.sqrt(part)


def with_mains(a: Array) -> Array:
    """Accelerations with hum of the mains and its third harmonic."""
    time = STEP * np.arange(len(a))[:, None]
    return a + 0.6 * np.cos(2.0 * np.pi * 50.0 * time + 0.4) + 0.2 * np.cos(2.0 * np.pi * 150.0 * time)


def yielding(v: Array, z: Array) -> Array:
    """Rate of a hidden state: one relaxation, whose strength falls off with its deflection."""
    return v - z / 0.06 / (1.0 + np.abs(z) / 0.004)


STRUCTURES = (
    Oscillator(
        "closing_crack", [["one_sided_stop"], ["asymmetric_gap"]], "a crack that closes on one side: stiffer there by a quarter",
        extra=lambda x, v, z: 450.0 * np.minimum(x, 0.0),
    ),
    Oscillator(
        "free_play", [["gap"]], "a third of the stiffness comes by way of a clevis with play", also=("stiffness_error",),
        extra=lambda x, v, z: -600.0 * np.clip(x, -1.5e-3, 1.5e-3),
    ),
    Oscillator(
        "bumper", [["one_sided_stop"]], "an elastomer bumper, which stiffens exponentially",
        extra=lambda x, v, z: 4.0 * np.expm1(np.maximum(x - 2e-3, 0.0) / 2.5e-3), also=("quadratic_stiffness", "cubic_stiffness"),
    ),
    Oscillator(
        "shock_absorber", [["asymmetric_damping"]], "a shock absorber: rebound is damped more than compression, and a gas spring pushes",
        extra=lambda x, v, z: np.where(v > 0.0, 6.0, 2.0) * v - 1.5, also=("force_offset", "damping_error"),
    ),
    Oscillator(
        "pole_pitch", [["cogging"]], "cogging of a linear motor, with its second harmonic",
        extra=lambda x, v, z: 2.0 * np.sin(2.0 * np.pi * x / 0.012) + 0.5 * np.sin(4.0 * np.pi * x / 0.012 + 0.7),
    ),
    Oscillator(
        "back_emf", [["damping_error"]], "a motor on a voltage: its own speed takes from the force that the log says",
        extra=lambda x, v, z: 5.0 * v,
    ),
    Oscillator(
        "relaxing_mount", [["viscoelastic_relaxation"]], "a mount that relaxes the slower the further it is deflected: it yields",
        extra=lambda x, v, z: 600.0 * z, memory=yielding, also=("stiffness_error", "damping_error", "coulomb_friction"),
    ),
    Oscillator(
        "loose_guide", [["record_dependent_friction"]], "a guide whose preload was changed between the records",
        friction=(0.6, 1.4, 2.2),
    ),
    Oscillator(
        "wandering_laser", [["displacement_drift"]], "nothing is missing from the mechanics: the zero of the laser wanders",
        read=lambda x, a: (wandering(x), a),
    ),
    Oscillator(
        "coarse_encoder", [["displacement_quantisation"]], "nothing is missing from the mechanics: an encoder of 0.2 mm a count",
        count=2e-4,
    ),
    Oscillator(
        "mains", [["acceleration_hum"]], "nothing is missing from the mechanics: hum on the accelerometer",
        read=lambda x, a: (x, with_mains(a)),
    ),
    Oscillator(
        "machine_next_door", [["harmonic_force"]], "the unbalance of a machine next door, of no fixed phase", rotating=(1.5, 7.3),
    ),
)  # fmt: skip


def tank(rng: np.random.Generator) -> Made:
    """A fifth of the stated mass is liquid that sloshes, a pendulum of large swing."""
    loads = multisines(rng, 20.0, 0.5, 15.0, (1.0, 2.0, 1.5))
    part, omega, length = 0.4, 2.0 * np.pi * 2.4, 0.0431

    def rate(s: Array, u: Array) -> Array:
        x, v, r, p = s
        pull = omega**2 * length * np.sin(r / length) + 2.0 * 0.015 * omega * p
        a = (u[0] - 2.4 * v - 1800.0 * x + part * pull) / (2.0 - part)
        return np.array([v, a, p, -pull - a])

    states, rates = with_rates(rate, np.zeros((4, 3)), loads[:, None, :])
    why = "a fifth of the mass is liquid that sloshes at 2.4 Hz"
    return Oscillator("tank", [["carried_mass"]], why).recorded(rng, loads, states[:, 0], rates[:, 1])


def beam(rng: np.random.Generator) -> Made:
    """A cantilever driven at its tip: two modes, of which the nominal model has the first, and geometric stiffening of that."""
    loads = multisines(rng, 20.0, 0.5, 60.0, (8.0, 16.0, 12.0))
    masses, ratios = np.array([2.0, 2.0]), np.array([0.02, 0.01])
    rates = 2.0 * np.pi * np.array([4.775, 29.92])

    def rate(s: Array, u: Array) -> Array:
        q, v = s[:2], s[2:]
        tip = q[0] + q[1]
        force = u[0] - 2e6 * tip**3
        own = rates[:, None] ** 2 * q + 2.0 * (ratios * rates)[:, None] * v
        return np.vstack([v, force / masses[:, None] - own])

    states, moved = with_rates(rate, np.zeros((4, 3)), loads[:, None, :])
    right = [["cubic_stiffness"], ["cubic_stiffness", "carried_mass"]]
    why = "a cantilever of two modes that stiffens with its deflection"
    made = Oscillator("beam", right, why, also=("mass_error", "stiffness_error", "damping_error"))
    return made.recorded(rng, loads, states[:, :2].sum(axis=1), moved[:, 2:].sum(axis=1))


def second_mode(
    rng: np.random.Generator, name: str, cubic: float, right: Sequence[Sequence[str]], why: str
) -> Made:
    """A quarter of the mass stands on a spring of its own; the nominal model has one mode."""
    loads = multisines(rng, 20.0, 0.5, 40.0, (8.0, 16.0, 12.0))

    def rate(s: Array, u: Array) -> Array:
        between = 9000.0 * (s[2] - s[0]) + (s[3] - s[1])
        force = u[0] - 1800.0 * s[0] - 2.4 * s[1] - cubic * s[0] ** 3
        return np.array([s[1], (force + between) / 1.5, s[3], -between / 0.5])

    states, rates = with_rates(rate, np.zeros((4, 3)), loads[:, None, :])
    return Oscillator(name, right, why).recorded(rng, loads, states[:, 0], rates[:, 1])


def structures(rng: np.random.Generator) -> list[Made]:
    """All of them."""
    return [*(oscillator.made(rng) for oscillator in STRUCTURES), tank(rng), beam(rng)]
