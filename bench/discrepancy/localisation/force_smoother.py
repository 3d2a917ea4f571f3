"""The force that a nominal model lacks along a measured motion, with what noise alone would make of it.

At every place a force of unknown course acts; it is a further state of the structure, a slow random walk, and a
Rauch-Tung-Striebel smoother estimates it together with the motion from loads and all response channels. It uses
position and acceleration channels alike, whichever exist, and knows no law. The intensity of the walk is chosen by the
likelihood of the innovations. The smoother is linear in the data, so noise alone, sent through it, tells how large and
how coloured the error of the estimate is.

Differentiating the measured motion and inserting it into the equations was the alternative; its error grows with the
square of the frequency, and with two sensors at a coordinate it leaves open which one to trust at which frequency.

References:
    E. Lourens et al., An augmented Kalman filter for force identification in structural dynamics, Mechanical Systems and
    Signal Processing 27 (2012) 446-460.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.likelihood.problem import Array
from bench.discrepancy.localisation.augmented_filter import (
    AugmentedModel,
    exponential,
    gains_of,
    smoothed,
    tuned,
)
from bench.discrepancy.model.nominal_elements import own_force
from bench.discrepancy.model.structure import Place, Structure
from bench.discrepancy.response.simulator import Simulator
from bench.discrepancy.simulation.stick_slip import Motion, StructureMatrices


class ForceEstimate(NamedTuple):
    """Motion and missing force of a record.

    Attributes:
        position: (n, n_dof).
        velocity: (n, n_dof).
        force: (n, n_places), positive where it opposes a positive displacement.
        noise: (n_noise, n, n_places), what noise alone leaves of a force that is zero.
    """

    position: Array
    velocity: Array
    force: Array
    noise: Array


@dataclass
class ForceObserver:
    """Estimates missing forces on a set of degrees of freedom that the linear structure couples.

    Attributes:
        simulator: Records and nominal model.
        structure: The structure on these degrees of freedom.
        dofs: Their indices in the structure of the simulator.
        places: Places with one coordinate; a force is estimated at each.
    """

    simulator: Simulator
    structure: Structure
    dofs: tuple[int, ...]
    places: tuple[Place, ...] = field(init=False)
    _intensity: dict[str, Array] = field(init=False, default_factory=dict)
    _steps: dict[tuple, tuple[Array, Array, Array, Array]] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        self.places = tuple(p for p in self.structure.places if len(p.rows) == 1)

    def nominal(self, table: Mapping[str, float] | None = None) -> Array:
        """Values (n_parameters,) of the structure's parameters: those given by name, the nominal ones otherwise."""
        own = dict(zip(self.simulator.structure.parameters, self.simulator.nominal, strict=True)) | dict(
            table or {}
        )
        return np.array([own[name] for name in self.structure.parameters])

    def spread(self) -> Array:
        """Uncertainties (n_parameters,) of the structure's parameters."""
        own = dict(zip(self.simulator.structure.parameters, self.simulator.spread, strict=True))
        return np.array([own[name] for name in self.structure.parameters])

    def _noise(self) -> tuple[Array, Array]:
        channels = dict(zip(self.simulator.structure.channels, self.simulator.noise, strict=True))
        loads = dict(zip(self.simulator.structure.loads, self.simulator.load_noise, strict=True))
        own = np.zeros(len(self.dofs) if self.structure.has_own_forces else 0)
        return (
            np.array([channels[name] for name in self.structure.channels]),
            np.append([loads[name] for name in self.structure.loads], own),
        )

    def _loads(self, record: CaseRecord, values: Array, motion: Motion) -> Array:
        """Loads (n, n_inputs) of a record, and what the nominal model's own friction and bending springs exert along a motion."""
        loads = np.column_stack([record.values[name] for name in self.structure.loads])
        return (
            np.hstack([loads, -own_force(self.structure, values, motion, record.step)])
            if self.structure.has_own_forces
            else loads
        )

    def _inputs(self, linear: StructureMatrices) -> Array:
        """How these act (n_dof, n_inputs)."""
        return (
            np.hstack([linear.inputs, np.eye(len(self.dofs))])
            if self.structure.has_own_forces
            else linear.inputs
        )

    def estimate(self, record: CaseRecord, values: Array, *, noise: int = 0) -> ForceEstimate:
        """Estimate the missing forces of a record.

        Args:
            record: Any record with the channels of the case.
            values: Parameter values (n_parameters,).
            noise: Number of passes of noise alone.
        """
        if self.simulator.driven:
            return self._driven(record, values, noise)
        own = list(self.dofs)
        motion = Motion(*(samples[:, own] for samples in self.simulator.motion_of(record)))
        position, velocity = motion.position, motion.velocity
        reach = np.maximum(np.std(position, axis=0), 1e-12)
        model = self._model(values, record.step, reach)
        loads = self._loads(record, values, motion)
        samples = np.column_stack([record.values[name] for name in self.structure.channels])
        start = np.concatenate([position[0], velocity[0], np.zeros(len(self.places))]) / model.scale
        if record.name not in self._intensity:
            guess = self._guess(loads, position, velocity)
            self._intensity[record.name] = tuned(
                model, samples, loads, start, guess, settings=self.simulator.settings.localisation
            )
        gains = gains_of(model, self._intensity[record.name])
        states = smoothed(model, gains, samples, loads, start)
        passes = np.zeros((noise, len(record), len(self.places)))
        stds, load_stds = self._noise()
        n_dof = len(own)
        for k in range(noise):
            rng = np.random.default_rng(k)
            fake = rng.standard_normal(samples.shape) * stds
            fake_loads = rng.standard_normal(loads.shape) * load_stds
            passes[k] = smoothed(model, gains, fake, fake_loads, np.zeros(len(start)))[:, 2 * n_dof :]
        return ForceEstimate(states[:, :n_dof], states[:, n_dof : 2 * n_dof], states[:, 2 * n_dof :], passes)

    def _guess(self, loads: Array, position: Array, velocity: Array) -> Array:
        rows = np.vstack([p.rows for p in self.places])
        acting = np.abs(self.structure.inputs).sum(axis=0) > 0
        level = float(np.sqrt(np.mean(loads[:, : len(acting)][:, acting] ** 2))) if acting.any() else 1.0
        rate = np.std(velocity @ rows.T, axis=0) / np.maximum(np.std(position @ rows.T, axis=0), 1e-300)
        return (level or 1.0) * np.sqrt(np.maximum(rate, 1e-3))

    def _model(self, values: Array, step: float, reach: Array) -> AugmentedModel:
        settings = self.simulator.settings.localisation
        linear = self.structure.at(values)
        inputs = self._inputs(linear)
        n, p, u = len(linear.mass), len(self.places), inputs.shape[1]
        inverse = np.linalg.inv(linear.mass)
        rows = np.vstack([place.rows for place in self.places])
        spread = inverse @ rows.T
        stiffest = float(np.sqrt(np.abs(inverse @ linear.stiffness).max())) or 1.0 / (1000.0 * step)
        d = 2 * n + p
        rate = np.zeros((d, d))
        rate[:n, n : 2 * n] = np.eye(n)
        acceleration = np.hstack([-inverse @ linear.stiffness, -inverse @ linear.damping, -spread])
        rate[n : 2 * n] = acceleration
        rate[2 * n :, 2 * n :] = -settings.forgetting * stiffest * np.eye(p)
        drive = np.zeros((d, u))
        drive[n : 2 * n] = inverse @ inputs
        # In steps as the unit of time the states are alike in size; the Riccati equation is hopeless in SI units.
        apparent = np.abs(spread).max(axis=0)
        scale = np.concatenate([reach, reach / step, reach.max() / step**2 / apparent])
        transition, first, change, walks = self._discrete(rate, drive, step)
        stds, load_stds = self._noise()
        observe, feed, noise = [], [], []
        for c, observer in enumerate(self.structure.observers):
            row = np.zeros(d)
            direct = np.zeros(u)
            if observer.order == 2:
                row, direct = observer.row @ acceleration, observer.row @ inverse @ inputs
            else:
                row[observer.order * n : (observer.order + 1) * n] = observer.row
            observe.append(row)
            feed.append(direct)
            noise.append(stds[c] ** 2 + np.sum((direct * load_stds) ** 2))
        for i in range(n):
            if not any(o.order == 0 and o.row[i] != 0 for o in self.structure.observers):
                row = np.zeros(d)
                row[i] = 1.0
                observe.append(row)
                feed.append(np.zeros(u))
                noise.append((settings.loose * reach[i]) ** 2)
        measured = np.array(observe)
        # Channels in units of their noise, so that the innovations are of order one.
        size = np.sqrt(np.array(noise))
        loads_noise = first * load_stds
        return AugmentedModel(
            np.ascontiguousarray(transition * scale / scale[:, None]),
            (first / scale[:, None], change / scale[:, None]),
            loads_noise @ loads_noise.T / np.outer(scale, scale),
            walks / np.outer(scale, scale),
            np.ascontiguousarray(measured * scale / size[:, None]),
            np.array(feed) / size[:, None],
            size,
            scale,
        )

    def _discrete(self, rate: Array, drive: Array, step: float) -> tuple[Array, Array, Array, Array]:
        """Transition, effect of a load and of its change over a step, and noise of a unit walk at each place."""
        key = (rate.tobytes(), drive.tobytes(), step)
        if key in self._steps:
            return self._steps[key]
        d, u = drive.shape
        block = np.zeros((d + 2 * u, d + 2 * u))
        block[:d, :d] = rate * step
        block[:d, d : d + u] = drive * step
        block[d : d + u, d + u :] = np.eye(u)
        whole = exponential(block)
        walks = []
        for j in range(len(self.places)):
            joint = np.zeros((2 * d, 2 * d))
            joint[:d, :d], joint[d:, d:] = -rate, rate.T
            at = d - len(self.places) + j
            joint[at, d + at] = 1.0
            result = exponential(joint * step)
            walks.append(result[d:, d:].T @ result[:d, d:])
        change = whole[:d, d + u :]
        if self.simulator.case.load_interpolation == "zero_order_hold":
            change = np.zeros_like(change)
        self._steps[key] = whole[:d, :d], whole[:d, d : d + u], change, np.array(walks)
        return self._steps[key]

    def _driven(self, record: CaseRecord, values: Array, noise: int) -> ForceEstimate:
        linear = self.structure.at(values)
        motion = self.simulator.motion_of(record)
        model = motion.position @ linear.stiffness + motion.velocity @ linear.damping
        if self.structure.has_own_forces:
            model = model + own_force(self.structure, values, motion, record.step)
        measured = np.column_stack([record.values[name] for name in self.structure.channels])[:, :1]
        stds, _ = self._noise()
        passes = np.array(
            [np.random.default_rng(k).standard_normal(measured.shape) * stds[0] for k in range(noise)]
        ).reshape(noise, *measured.shape)
        return ForceEstimate(motion.position, motion.velocity, measured - model, passes)


def observers(simulator: Simulator) -> tuple[ForceObserver, ...]:
    """Return one observer for every group of coupled degrees of freedom that holds a place."""
    out = []
    for group in simulator.structure.groups():
        part = simulator.structure.restricted(group)
        observer = ForceObserver(simulator, part, tuple(group))
        if observer.places and part.observers:
            out.append(observer)
    return tuple(out)
