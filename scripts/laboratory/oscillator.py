"""A carriage on a spring under random loads, and what else is there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bench.arrays import Array
from laboratory.made import STEP, Made, case_of, multisines, noisy, with_rates


@dataclass(frozen=True)
class Oscillator:
    """A carriage on a spring, of 2 kg, 2.4 N s/m and 1800 N/m, under three random loads, and what else is there.

    Attributes:
        name: Of the case.
        right, also, why: See `Made`.
        extra: A further force [N] from displacement, velocity and a hidden state.
        memory: Rate of the hidden state from velocity and itself; none where None.
        shaking: RMS of a force [N] that nobody measures, from 3 to 6 Hz.
        softer: Stiffness [N/m] that is gone in each record.
        friction: Level [N] of dry friction in each record.
        rotating: Amplitude [N] and frequency [Hz] of a harmonic force, of another phase in each record.
        read: What the sensors make of displacement and acceleration.
        channels: Responses that were recorded.
        mass: Stated mass [kg].
        count: Step of the displacement [m] as it is logged; none where zero.
    """

    name: str
    right: Sequence[Sequence[str]]
    why: str
    also: Sequence[str] = ()
    extra: Callable[[Array, Array, Array], Array] = lambda x, v, z: np.zeros_like(x)
    memory: Callable[[Array, Array], Array] | None = None
    shaking: float = 0.0
    softer: Sequence[float] = (0.0, 0.0, 0.0)
    friction: Sequence[float] = (0.0, 0.0, 0.0)
    rotating: tuple[float, float] = (0.0, 1.0)
    read: Callable[[Array, Array], tuple[Array, Array]] = lambda x, a: (x, a)
    channels: Sequence[str] = ("displacement", "acceleration")
    mass: float = 2.0
    count: float = 0.0

    def made(self, rng: np.random.Generator) -> Made:
        """Its case."""
        loads = multisines(rng, 20.0, 0.5, 15.0, (6.0, 12.0, 9.0))
        unseen = self.shaking * multisines(rng, 20.0, 3.0, 6.0, (1.0, 1.0, 1.0))
        amplitude, frequency = self.rotating
        turned = 2.0 * np.pi * frequency * STEP * np.arange(len(loads))[:, None] + 2.0 * np.arange(3)
        own = [np.broadcast_to(np.array(each), loads.shape) for each in (self.softer, self.friction)]
        inputs = np.stack([loads + unseen + amplitude * np.cos(turned), *own], axis=1)

        def rate(s: Array, u: Array) -> Array:
            x, v, z = s
            force = u[0] - 2.4 * v - (1800.0 - u[1]) * x - self.extra(x, v, z)
            force = force - u[2] * np.tanh(v / 2e-4)
            return np.array([v, force / 2.0, self.memory(v, z) if self.memory else np.zeros_like(z)])

        states, rates = with_rates(rate, np.zeros((3, 3)), inputs)
        return self.recorded(rng, loads, *self.read(states[:, 0], rates[:, 1]))

    def recorded(self, rng: np.random.Generator, load: Array, x: Array, a: Array) -> Made:
        """The case of loads, displacements and accelerations (n_samples, 3)."""
        noise = {"force": 0.02, "displacement": 1e-5, "acceleration": 0.03}
        units = {"force": "N", "displacement": "m", "acceleration": "m/s^2"}
        records = [
            noisy(rng, {"force": load[:, i], "displacement": x[:, i], "acceleration": a[:, i]}, noise)
            for i in range(3)
        ]
        for record in records if self.count else ():
            record["displacement"] = self.count * np.round(record["displacement"] / self.count)
        channels = {
            c: (units[c], "measured" if c == "force" else "response", noise[c])
            for c in ("force", *self.channels)
        }
        stated = {
            "mass": (self.mass, 0.02, "kg"), "damping": (2.4, 0.5, "N s/m"), "stiffness": (1800.0, 40.0, "N/m"),
        }  # fmt: skip
        case = case_of(self.name, "sdof", stated, channels, records)
        return Made(f"lab_{self.name}", case, self.right, self.also, self.why)
