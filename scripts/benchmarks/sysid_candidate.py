"""A nominal model with one effect, as `mujoco.sysid` fits it."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import mujoco
import numpy as np
from mujoco import sysid

from bench import Element, Rig
from bench.arrays import Array
from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.likelihood.whitening import whitened
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.simulation.stick_slip import Motion
from benchmarks.peer_model import Compiled, optimised
from benchmarks.structure_mjcf import StructureMjcf

REACH = 20.0
"""Bound, in units of the prior's standard deviation, of what has none: the optimiser wants finite ones."""
DIVERGED = 1e6
"""Residual that stands for a simulation that is not finite."""


class Candidate:
    """A nominal model with one effect, or none, as `mujoco.sysid` fits it.

    The vector is that of `Simulator.simulate`: nominal deviations in units of their uncertainty, then the effect's etas.
    """

    def __init__(self, problem: Problem, placed: Placed | None) -> None:
        self.problem, self.placed = problem, placed
        self.hypothesis = () if placed is None else (placed,)
        structure = problem.structure
        coordinates = StructureMjcf(structure)
        self.mean, self.std, low, high = problem.prior(self.hypothesis)
        self.low = np.maximum(low, self.mean - REACH * self.std)
        self.high = np.minimum(high, self.mean + REACH * self.std)
        parameters = () if placed is None else placed.effect.parameters
        held = np.concatenate([problem.spread == 0.0, [p.fixed for p in parameters]]).astype(bool)
        self.free = self.all_free = np.flatnonzero(~held)
        self.own = self.free[self.free >= len(problem.nominal)]
        self.heard: Sequence[int] = range(len(problem.records))
        step = problem.records[0].step
        elements = self._elements(coordinates)
        mjcf = coordinates.mjcf(solver=any(element.exact for element in elements))
        self.rig = Rig("peer", mjcf, elements, timestep=step)
        self.model, self.scratch = self.rig.model, mujoco.MjData(self.rig.model)
        self.places = [self._place(coordinates, i) for i in range(len(structure.parameters))]
        self.columns = [
            [int(self.model.sensor(f"{dof}_{kind}").adr[0]) for dof in structure.dofs]
            for kind in Motion._fields
        ]
        self.motors = [self.rig.actuators.index(name) for name in structure.loads]
        spec = Compiled(self.model)
        self.sequences = [
            sysid.ModelSequences("peer", spec, r.name, *self._sequence(i))
            for i, r in enumerate(problem.records)
        ]

    def _elements(self, coordinates: StructureMjcf) -> tuple[Element, ...]:
        law = None if self.placed is None else self.placed.effect.law
        if self.placed is None or law is None:
            return ()
        effect, rows = self.placed.effect, self.placed.place.rows
        theta = effect.kernel_theta(
            np.array([p.grid[0] if p.grid else p.mean for p in effect.parameters]),
            self.problem.scales_of(self.placed),
        )
        joints = tuple(coordinates.names[tuple(row)] for row in rows)
        exact = effect.name == "coulomb_friction"
        return (Element(law, joints, theta, name="effect", exact=exact),)

    def _place(self, coordinates: StructureMjcf, i: int) -> tuple[str, int]:
        """Field and index of the model that a nominal parameter stands in."""
        structure = self.problem.structure
        if np.any(structure.mass[i]):
            return "body_mass", int(self.model.body(coordinates.of(structure.mass[i])).id)
        kind = "stiffness" if np.any(structure.stiffness[i]) else "damping"
        name = coordinates.of(getattr(structure, kind)[i])
        if name not in structure.dofs:
            return f"tendon_{kind}", int(self.model.tendon(name).id)
        joint = self.model.joint(name)
        return (
            ("jnt_stiffness", int(joint.id)) if kind == "stiffness" else ("dof_damping", int(joint.dofadr[0]))
        )

    def _sequence(self, index: int) -> tuple[Array, Any, Any]:
        record = self.problem.records[index]
        rest = mujoco.MjData(self.model)
        times = np.arange(len(record) + 1) * record.step
        # the measured samples stand in the problem; the series tells which record it is
        which = np.full((len(record), self.model.nsensordata), float(index))
        return (
            sysid.create_initial_state(self.model, rest.qpos, rest.qvel, rest.act),
            sysid.TimeSeries(times, np.zeros((len(times), self.model.nu))),
            sysid.TimeSeries.from_names(times[:-1], which, self.model),
        )

    def full(self, x: Array) -> Array:
        """Vector with the free entries `x`, the others at their start."""
        vector = self.start.copy()
        vector[self.free] = x
        return vector

    def build(self, vector: Array) -> mujoco.MjModel:
        """The model at a vector."""
        values, etas = self.problem.split(self.hypothesis, vector)
        model = copy.copy(self.model)
        for (field, index), value in zip(self.places, values, strict=True):
            getattr(model, field)[index] = value
        if self.rig.elements:
            self._write(model, etas[0])
        mujoco.mj_setConst(model, self.scratch)  # the mass matrix of simple bodies is a constant of the model
        return model

    def _write(self, model: mujoco.MjModel, eta: Array) -> None:
        assert self.placed is not None
        record, item = self.problem.records[0], self.rig.built.placed[0]
        scales = self.problem.scales_of(self.placed)._replace(duration=len(record) * record.step)
        theta = self.placed.effect.kernel_theta(eta, scales)
        if item.element.exact:
            name = item.element.joints[0]
            if name in self.problem.structure.dofs:
                model.dof_frictionloss[model.joint(name).dofadr[0]] = theta[0]
            else:
                model.tendon_frictionloss[model.tendon(name).id] = theta[0]
            return
        if self.placed.effect.limit is not None:
            theta[-1] = max(theta[-1], self._softest(theta, scales, record))
        model.numeric_data[item.theta : item.theta + len(theta)] = theta

    def _softest(self, theta: Array, scales: Any, record: CaseRecord) -> float:
        """Velocity over which the Runge-Kutta step can just resolve the change of sign of a friction force."""
        assert self.placed is not None
        assert self.placed.effect.limit is not None
        limit, largest = np.zeros(1), 0.0
        for t in np.linspace(0.0, len(record) * record.step, 50):
            limit[0] = 0.0
            self.placed.effect.limit(t, [scales.position], [0.0], [], theta, limit)
            largest = max(largest, float(limit[0]))
        linear = self.problem.structure.at(self.problem.nominal)
        row = self.placed.place.rows[0]
        return largest * record.step * float(row @ np.linalg.solve(linear.mass, row))

    def loads(self, vector: Array, record: CaseRecord) -> tuple[Array, Array]:
        """Loads at the samples (n, n_loads), and their means over the steps, which hold a straight line's impulse."""
        loads = np.column_stack([record.values[name] for name in self.problem.structure.loads])
        if self.placed is not None and self.placed.effect.site == "actuator" and self.placed.effect.signal:
            eta = self.problem.split(self.hypothesis, vector)[1][0]
            values = self.placed.effect.values(eta, self.problem.scales_of(self.placed))
            j = self.problem.structure.loads.index(self.placed.target)
            loads[:, j] = self.placed.effect.signal(loads[:, j], values, record.step)
        return loads, 0.5 * (loads + np.concatenate([loads[1:], loads[-1:]]))

    def controls(self, vector: Array, record: CaseRecord) -> Any:
        """The load series of a rollout."""
        controls = np.zeros((len(record) + 1, self.model.nu))
        controls[:-1, self.motors] = self.loads(vector, record)[1]
        return sysid.TimeSeries(np.arange(len(record) + 1) * record.step, controls)

    def observe(self, vector: Array, record: CaseRecord, sensordata: Array) -> Array:
        """Channels (n, n_channels) of a rollout, sensor effects included."""
        problem, (loads, held) = self.problem, self.loads(vector, record)
        values, etas = problem.split(self.hypothesis, vector)
        motion = Motion(*(sensordata[:, columns].copy() for columns in self.columns))
        # an accelerometer feels the load of the instant, not that held over the step
        mass, inputs = problem.structure.at(values).mass, problem.structure.inputs
        motion.acceleration[:] += (loads - held) @ np.linalg.solve(mass, inputs).T
        channels = problem.observe(self.hypothesis, etas, motion, record.step)
        return problem.acquired(problem.picked_up(self.hypothesis, etas, channels, record), record)

    def _rollout(self, record: CaseRecord, **arguments: Any) -> Any:
        vectors = [self.full(parameters.as_vector()) for parameters in arguments.pop("param_dicts")]
        arguments["control_signal"] = [self.controls(vector, record) for vector in vectors]
        return sysid.sysid_rollout(**arguments)

    def _residual(self, parameters: Any, predicted: Any, measured: Any, *_rest: Any, **_more: Any) -> Any:
        vector = self.full(parameters.as_vector())
        index = int(measured.data[0, 0])
        data = self.problem.data[index]
        misfit = ((vector - self.mean) / self.std)[self.free] / np.sqrt(len(self.heard))
        error = data.responses - self.observe(vector, data.record, predicted.data)
        residual = whitened(error, data) if np.isfinite(error).all() else np.full(self._size(index), DIVERGED)
        return np.concatenate([residual, misfit]), predicted, predicted

    def _size(self, index: int) -> int:
        return 2 * self.problem.data[index].n_bins * len(self.problem.noise)

    def residual(self, x: Array, parameters: Any) -> tuple[list[Array], list, list]:
        """The residuals as `mujoco.sysid.optimize` wants them, by its own machinery, a record at a time."""
        parts = []
        for index in self.heard:
            run = sysid.build_residual_fn(
                models_sequences=[self.sequences[index]],
                build_model=lambda p, _spec: self.build(self.full(p.as_vector())),
                modify_residual=self._residual,
                custom_rollout=partial(self._rollout, self.problem.records[index]),
                resample_true=False,
            )
            try:
                parts += run(x, parameters)[0]
            except (
                ValueError
            ):  # the clock of a simulation that MuJoCo gave up on stands still, which it refuses
                parts.append(np.full((self._size(index) + len(self.free), *x.shape[1:]), DIVERGED))
        return parts, [], []

    def parameters(self, start: Array) -> Any:
        """The free entries for `mujoco.sysid`, at a start."""
        self.start = np.clip(start, self.low, self.high)
        out = sysid.ParameterDict()
        for i in self.free:
            out.add(sysid.Parameter(f"p{i:02d}", self.start[i], self.low[i], self.high[i]))
        return out

    def best_start(self, head: Array) -> Array:
        """The point of the catalogue's grid with the least cost, the nominal deviations at `head`."""
        grid = [np.zeros(0)] if self.placed is None else self.placed.effect.grid()
        starts = np.array([np.concatenate([head, eta]) for eta in grid])
        return starts[int(np.argmin(self.costs(starts)))] if len(starts) > 1 else starts[0]

    def costs(self, vectors: Array) -> Array:
        """Chi-squared and the misfit of the priors (k,) at vectors (k, n) that differ in what is free."""
        parameters = self.parameters(vectors[0])
        parts, _, _ = self.residual(np.clip(vectors, self.low, self.high)[:, self.free].T, parameters)
        return np.sum(np.concatenate(parts) ** 2, axis=0)

    def cost(self, vector: Array) -> float:
        """The cost at one vector."""
        return float(self.costs(vector[None])[0])

    def misfit(self, vector: Array, index: int) -> float:
        """The cost of one record, by its number of residuals."""
        everything, self.heard = self.heard, [index]
        cost = self.cost(vector)
        self.heard = everything
        return cost / self._size(index)

    def fit(self, start: Array, iterations: int, deadline: float = np.inf) -> tuple[Array, float]:
        """Fit from a start; the vector reached and its cost, at a deadline those of the best vector so far."""
        parameters = self.parameters(start)
        best = (np.inf, parameters.as_vector())
        if len(self.free):
            best = optimised(parameters, self.residual, iterations=iterations, deadline=deadline)
        vector = self.full(best[1])
        return vector, best[0] if np.isfinite(best[0]) else self.cost(vector)

    def bic(self, cost: float) -> float:
        """Bayesian information criterion; the nominal parameters are in every candidate."""
        residuals = sum(self._size(index) for index in self.heard)
        return cost + len(self.own) * float(np.log(residuals))

    def enter(self, *, held: bool, heard: Sequence[int]) -> None:
        """Enter a heat: on some records, the nominal parameters held or free, coarsely integrated where held."""
        self.heard, self.free = heard, self.own if held else self.all_free
        euler = mujoco.mjtIntegrator.mjINT_EULER
        self.model.opt.integrator = euler if held else mujoco.mjtIntegrator.mjINT_RK4

    def predict(self, vector: Array, record: CaseRecord) -> Mapping[str, Array]:
        """Free run of a record; NaN where it diverged."""
        rest = mujoco.MjData(self.model)
        channels = self.problem.structure.channels
        try:
            run = sysid.sysid_rollout(
                models=[self.build(vector)],
                datas=[rest],
                control_signal=[self.controls(vector, record)],
                initial_states=[sysid.create_initial_state(self.model, rest.qpos, rest.qvel, rest.act)],
            )[0]
        except ValueError:  # as in `residual`
            return {name: np.full(len(record), np.nan) for name in channels}
        return dict(zip(channels, self.observe(vector, record, run.sensordata.data).T, strict=True))
