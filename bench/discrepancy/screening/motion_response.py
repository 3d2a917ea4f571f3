"""Whitened responses of a linear structure to forces along the motion of its records.

Along the true motion the equation ``M a + C v + K q + f = B u`` holds exactly, so the response is that of the *linear*
structure to ``B u - f(q, v)``. With the measured motion, smoothed, in place of the true one, the unknown force
becomes an input, and effect amplitudes and nominal deviations enter the response linearly.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.effects.channel_operators import quantise
from bench.discrepancy.fitting.map_fit import Fit
from bench.discrepancy.likelihood.problem import Array, Problem
from bench.discrepancy.likelihood.whitening import whitened
from bench.discrepancy.model.nominal_elements import own_change, own_force, own_friction
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.numerics.threads import in_threads
from bench.discrepancy.response.initial_states import in_motion
from bench.discrepancy.response.simulator import Simulator
from bench.discrepancy.response.windows import channels_of
from bench.discrepancy.simulation.linear_response import linear_run
from bench.discrepancy.simulation.prescribed_response import driven_force
from bench.discrepancy.simulation.step_size import steps
from bench.discrepancy.simulation.stick_slip import Elements, StructureMatrices


class About(NamedTuple):
    """What a screening is about, see `Screen.beside`."""

    base: Fit
    simulated: bool


class MotionResponse:
    """Whitened responses to forces along the measured motion, or along that of a fitted hypothesis.

    Args:
        problem: Records and nominal model.
        about: Where the linear structure, the sensors and perhaps the motion are taken from; the nominal model and the measured
            motion where None.
    """

    def __init__(self, problem: Problem, *, about: About | None = None) -> None:
        n = len(problem.nominal)
        values, self.sensors = problem.nominal, []
        if about is not None:
            values, etas = problem.split(about.base.hypothesis, about.base.vector)
            own = zip(about.base.hypothesis, etas, strict=True)
            self.sensors = [(p, eta) for p, eta in own if p.effect.site == "sensor"]
            self._unspoilt = [_unspoilt(problem, about.base, record) for record in problem.records]
            # windows restart from the measured motion, so that a free run of them has no motion of its own
            if not problem.driven and not problem.windowed and (self.sensors or about.simulated):
                problem = _moving(problem, about, self._unspoilt)
        self.problem = problem
        linear = problem.structure.at(values)
        self.linear = StructureMatrices(
            linear.mass, linear.damping, linear.stiffness, np.eye(len(linear.mass))
        )
        for i in range(len(problem.records)):
            problem.motion(i)
        spread = np.where(problem.spread > 0.0, problem.spread, 1.0)
        self.deviations = (values - problem.nominal) / spread
        self.zero = problem.residual((), self.deviations)
        if problem.structure.has_own_forces and not problem.driven:
            self.zero = self._without_own_forces() - self.response(
                lambda i: -own_force(problem.structure, values, problem.motion(i), problem.records[i].step)
            )
        self.nominal = np.column_stack(in_threads(self._nominal_response, range(n)))

    def _sensed(self, channels: Array, index: int) -> Array:
        """Change of the channels (n, n_channels) of a record behind the sensor effects that this screening is about."""
        if not self.sensors:
            return channels
        # steps pass changes on average, and their noise is in the residual already
        smooth = [(p, eta) for p, eta in self.sensors if p.effect.signal is not quantise]
        placed, etas = tuple(p for p, _ in smooth), [eta for _, eta in smooth]
        step, free = self.problem.records[index].step, self._unspoilt[index]
        # a unit of an effect may be many times the motion: a sensor that clips would clip all of it
        peaks, changes = np.abs(free).max(axis=0), np.abs(channels).max(axis=0)
        moved = changes > 0.0
        small = self.problem.settings.screening.small_change * np.min(
            peaks[moved] / changes[moved], initial=np.inf
        )
        if not np.isfinite(small) or small == 0.0:
            return channels
        with_change = self.problem.sensed(placed, etas, free + small * channels, step)
        return (with_change - self.problem.sensed(placed, etas, free.copy(), step)) / small

    def _nominal_response(self, parameter: int) -> Array:
        """Whitened response of all records to a deviation of one nominal parameter, or initial state, by its uncertainty."""
        if parameter >= self.problem.n_physical:
            return self._start_response(parameter)
        return self.response(lambda i: self._deviation(i, parameter))

    def _deviation(self, index: int, parameter: int) -> Array:
        """Force that a deviation of one nominal parameter by its uncertainty takes from the structure."""
        motion, s = self.problem.motion(index), self.problem.structure
        force = own_change(s, parameter, motion, self.problem.nominal, self.problem.records[index].step)
        force += motion.acceleration @ s.mass[parameter].T + motion.velocity @ s.damping[parameter].T
        return -self.problem.spread[parameter] * (force + motion.position @ s.stiffness[parameter].T)

    def _without_own_forces(self) -> Array:
        """Whitened residuals of the nominal model without its own dry friction and bending springs."""
        problem = self.problem
        parts = [
            whitened(d.responses - problem.simulate((), self.deviations, d.record, own_forces=False), d)
            for d in problem.data
        ]
        return np.concatenate(parts)

    def _start_response(self, parameter: int) -> Array:
        """Whitened response of all records to a deviation of one initial state by its uncertainty."""
        problem = self.problem
        values = np.zeros(len(problem.nominal))
        values[parameter] = problem.spread[parameter]
        parts = []
        for data in problem.data:
            record, n_dof = data.record, len(problem.structure.dofs)
            start = problem.starts_of(record, values)[0] if in_motion(record) else np.zeros(2 * n_dof)
            motion = linear_run(
                self.linear, loads=np.zeros((len(record), n_dof)), step=record.step, start=start
            )
            parts.append(whitened(problem.acquired(channels_of(problem.structure, motion), record), data))
        return np.concatenate(parts)

    def response(self, force_on_dofs: Callable[[int], Array]) -> Array:
        """Whitened response of all records to forces on the degrees of freedom, given by record index."""
        with np.errstate(over="ignore", invalid="ignore"):  # forces that diverge: their nodes are left out
            return np.concatenate(
                [self._responses(force_on_dofs(i), i) for i in range(len(self.problem.data))]
            )

    def _responses(self, force: Array, index: int) -> Array:
        data = self.problem.data[index]
        if self.problem.driven:
            return whitened(self._sensed(-force, index), data)
        lead = self.problem.lead_in(data.record)
        firsts = self.problem.firsts(data.record)[1:]
        loads = np.vstack([force] * (1 + lead // len(force)))
        motion = linear_run(self.linear, loads=loads, step=data.record.step, restarts=firsts)
        channels = self._sensed(channels_of(self.problem.structure, motion)[lead:], index)
        return whitened(self.problem.acquired(channels, data.record), data)

    def effect_response(self, placed: Placed, eta: Array) -> Array:
        """Whitened response to an effect along the measured motion."""
        return self.response(lambda i: -force_along_motion(self.problem, placed, eta, i))


def _unspoilt(simulator: Simulator, base: Fit, record: CaseRecord) -> Array:
    """Channels (n, n_channels) of the free run of a base without its sensor effects."""
    _, etas = simulator.split(base.hypothesis, base.vector)
    kept = [(p, eta) for p, eta in zip(base.hypothesis, etas, strict=True) if p.effect.site != "sensor"]
    vector = np.concatenate([base.vector[: len(simulator.nominal)], *(eta for _, eta in kept)])
    return simulator.simulate(tuple(p for p, _ in kept), vector, record)


def _moving(problem: Problem, about: About, unspoilt: Sequence[Array]) -> Problem:
    """A problem whose motion is that of a base's free run, or the measured one less what its sensor effects change."""
    hypothesis, vector = about.base.hypothesis, about.base.vector
    motions = {}
    for record, free in zip(problem.records, unspoilt, strict=True):
        if about.simulated:
            motions[record.name] = problem.free_motion(hypothesis, vector, record)
            continue
        measured = np.column_stack([record.values[name] for name in problem.structure.channels])
        channels = measured - problem.simulate(hypothesis, vector, record) + free
        values = dict(zip(problem.structure.channels, channels.T, strict=True))
        motions[record.name] = problem.smoothed(replace(record, values={**record.values, **values}))
    return problem.moving(motions)


def force_along_motion(simulator: Simulator, placed: Placed, eta: Array, index: int) -> Array:
    """Force of an effect on the degrees of freedom (n, n_dof) along the measured motion of record `index`."""
    motion = simulator.motion(index)
    record = simulator.records[index]
    rows = placed.place.rows
    elements, rates = simulator.elements((placed,), [eta], record)
    local = Elements(elements.table, rows, elements.theta, elements.start)
    force = driven_force(
        local,
        position=motion.position @ rows.T,
        velocity=motion.velocity @ rows.T,
        step=record.step,
        substeps=steps(record.step * rates, settings=simulator.settings.simulation),
        start_time=record.start,
    )
    if carried := simulator.carried(placed, eta):
        force[:, 0] -= carried * (motion.acceleration @ rows[0])
    if placed.effect.in_place:
        force[:, 0] -= own_friction(simulator.structure, simulator.nominal, motion, rows[0], record.step)
    return force @ rows
