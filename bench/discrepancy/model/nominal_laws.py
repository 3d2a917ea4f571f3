"""Laws of the bench as parts of a nominal model, with parameters that may be uncertain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.arrays import Array
from bench.discrepancy.simulation.prescribed_response import driven_force, driven_states
from bench.discrepancy.simulation.stick_slip import Elements, Motion
from bench.laws import ForceLaw


@dataclass(frozen=True)
class NominalLawsSettings:
    """Numbers of `bench.discrepancy.model.nominal_laws`."""

    steps: int = 16
    """Integration steps a sample of a motion that hidden states follow."""
    probes: int = 40
    nudge: float = 1e-4
    """Samples at which the rate of a law is asked for, and the change of a hidden state, over its largest, that it is told by."""
    change: float = 1e-3
    """Relative change of a parameter by which the change of a force is told."""


SETTINGS = NominalLawsSettings()


FRICTION = {
    "coulomb": "limit", "stribeck": "limit", "soft_coulomb": "limit", "dahl": "limit", "lugre": "coulomb", "jenkins": "limit",
    "jenkins_backlash": "limit_positive", "bouc_wen": "", "iwan": "limit",
}  # fmt: skip
"""Laws that are friction, which another friction may stand in the place of, with their parameter that is its limit."""


@dataclass(frozen=True)
class NominalElement:
    """A law of the nominal model.

    Attributes:
        law: The law, of one coordinate.
        row: (n_dof,) coordinate that it acts on.
        parameters: Names of the nominal parameters that are its parameters, one each; empty where one is exact.
        values: (n,) its parameters where they are exact.
    """

    law: ForceLaw
    row: Array
    parameters: tuple[str, ...]
    values: Array

    def theta(self, parameters: Sequence[str], values: Array) -> Array:
        """Theta of the law at the values (n_parameters,) of nominal parameters of such names, kept within the law's bounds."""
        own = self.values.copy()
        for i, name in enumerate(self.parameters):
            if name:
                own[i] = values[parameters.index(name)]
        low, high = np.array([p.bounds for p in self.law.parameters]).T
        return np.concatenate([self.law.header, np.clip(own, low, high)])

    @property
    def rubs(self) -> bool:
        """Whether it is friction."""
        return self.law.name in FRICTION

    def level(self, parameters: Sequence[str], values: Array) -> float:
        """Limit of its friction at the values (n_parameters,) of nominal parameters of such names; zero where the law names none."""
        name = FRICTION.get(self.law.name, "")
        if name not in self.law.parameter_names:
            return 0.0
        return float(
            self.theta(parameters, values)[len(self.law.header) + self.law.parameter_names.index(name)]
        )

    def acts_along(self, row: Array) -> bool:
        """Whether it acts on a coordinate (n_dof,), and on it alone."""
        return bool(np.array_equal(self.row, row))

    def entry(self, row: int, theta: int, state: int) -> list[int]:
        """Its row of an element table."""
        rate = self.law.rate.address if self.law.rate else 0
        return [self.law.force.address, rate, 0, 1, row, theta, state, len(self.law.states), 0]

    def alone(self, theta: Array) -> Elements:
        """The law on its own coordinate."""
        table = np.array([self.entry(0, 0, 0)], dtype=np.int64)
        return Elements(table, np.ones((1, 1)), np.append(theta, 0.0), self.law.start())

    def along(self, theta: Array, motion: Motion, step: float) -> Array:
        """Force (n,) along a motion."""
        q, v = (samples @ self.row[:, None] for samples in motion[:2])
        substeps = SETTINGS.steps if self.law.rate else 1
        return driven_force(self.alone(theta), position=q, velocity=v, step=step, substeps=substeps)[:, 0]

    def change(
        self, parameters: Sequence[str], values: Array, parameter: int, motion: Motion, step: float
    ) -> Array:
        """Change (n,) of the force along a motion with a unit of a nominal parameter."""
        size = SETTINGS.change * abs(values[parameter]) or SETTINGS.change
        moved = values.copy()
        moved[parameter] += size
        ends = [self.along(self.theta(parameters, v), motion, step) for v in (values, moved)]
        return (ends[1] - ends[0]) / size

    def rate(self, theta: Array, motion: Motion, step: float) -> float:
        """Fastest rate of the hidden states along a motion [1/s]; zero where there are none."""
        if self.law.rate is None:
            return 0.0
        q, v = (samples @ self.row[:, None] for samples in motion[:2])
        at = np.unique(np.linspace(0, len(q) - 1, SETTINGS.probes).astype(np.int64))
        states = driven_states(
            self.alone(theta), position=q, velocity=v, step=step, substeps=SETTINGS.steps, at=at
        )
        size = SETTINGS.nudge * (np.abs(states).max(axis=0) + 1e-300)
        fastest = 0.0
        for k, z in zip(at, states, strict=True):
            before, after = np.zeros(len(z)), np.zeros(len(z))
            self.law.rate(0.0, q[k], v[k], z, theta, before)
            for i in range(len(z)):
                self.law.rate(0.0, q[k], v[k], z + size * (np.arange(len(z)) == i), theta, after)
                fastest = max(fastest, float(np.abs(after - before).max() / size[i]))
        return fastest

    def restricted(self, keep: Sequence[int]) -> NominalElement:
        """The same on some degrees of freedom."""
        return replace(self, row=self.row[list(keep)])
