"""`mujoco.sysid` as a diagnosis: fitted to every candidate effect in turn, the best chosen by its BIC.

It gets every help: the diagnosis's catalogue with its priors, bounds and starting grids; the laws as native callbacks in the
MuJoCo model, MuJoCo's own friction constraint where it has one; the residuals whitened against the noise of a measured
force too (a plain weighting would take that for an effect); loads centred over each step; a model builder that writes
into a compiled model; the scaling by the Jacobian, with which it is quickest.
"""

from __future__ import annotations

import contextlib
import copy
import io
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import mujoco
import numpy as np
from mujoco import sysid
from numpy.typing import NDArray

from bench import Element, Rig
from bench.discrepancy.case import Case, CaseRecord
from bench.discrepancy.catalogue import CATALOGUE
from bench.discrepancy.effect import Effect
from bench.discrepancy.placed import Placed
from bench.discrepancy.placements import placements
from bench.discrepancy.prepared import whitened
from bench.discrepancy.problem import Problem
from bench.discrepancy.structure import Structure, structure_of
from bench.discrepancy.system import Motion
from benchmarks.peer_model import Compiled

Array = NDArray[np.float64]
FIRST = 6
"""Iterations of the first fit of a candidate, from the best point of its grid."""
CARRIED = 4
"""Candidates that are carried on, by the BIC of their first fits."""
LAST = 20
"""Further iterations of those."""
REACH = 20.0
"""Bound, in units of the prior's standard deviation, of what has none: the optimiser wants finite ones."""
DIVERGED = 1e6
"""Residual that stands for a simulation that is not finite."""


class _Coordinates:
    """A structure as an MJCF model: a slide joint a degree of freedom, a fixed tendon a relative coordinate."""

    def __init__(self, structure: Structure) -> None:
        self.structure = structure
        self.names: dict[tuple[float, ...], str] = {}
        for i, dof in enumerate(structure.dofs):
            self.names[tuple(float(i == j) for j in range(len(structure.dofs)))] = dof
        for place in structure.places:
            for row in place.rows:
                self.names.setdefault(tuple(row), f"relative_{len(self.names)}")

    def of(self, matrix: Array) -> str:
        """Coordinate whose square a rank-one matrix is."""
        return next(name for row, name in self.names.items() if np.array_equal(np.outer(row, row), matrix))

    def mjcf(self) -> str:
        """The model, with unit masses and neither springs nor dampers."""
        dofs = self.structure.dofs
        bodies = "".join(
            f'<body name="{dof}" pos="0 {i} 0"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
            f'<joint name="{dof}" type="slide" axis="1 0 0"/></body>'
            for i, dof in enumerate(dofs)
        )
        tendons = "".join(
            f'<fixed name="{name}" springlength="0">'
            + "".join(
                f'<joint joint="{dof}" coef="{c}"/>' for dof, c in zip(dofs, row, strict=True) if c != 0.0
            )
            + "</fixed>"
            for row, name in self.names.items()
            if name not in dofs
        )
        motors = "".join(
            f'<motor name="{load}" joint="{dofs[int(np.flatnonzero(self.structure.inputs[:, j])[0])]}"/>'
            for j, load in enumerate(self.structure.loads)
        )
        sensors = "".join(
            f'<jointpos name="{dof}_position" joint="{dof}"/><jointvel name="{dof}_velocity" joint="{dof}"/>'
            f'<framelinacc name="{dof}_acceleration" objtype="body" objname="{dof}"/>'
            for dof in dofs
        )
        return (
            '<mujoco><option gravity="0 0 0"><flag contact="disable"/></option>'
            f"<worldbody>{bodies}</worldbody>"
            + (f"<tendon>{tendons}</tendon>" if tendons else "")
            + f"<actuator>{motors}</actuator><sensor>{sensors}</sensor></mujoco>"
        )


class Candidate:
    """A nominal model with one effect, or none, as `mujoco.sysid` fits it.

    The vector is that of `Problem.simulate`: nominal deviations in units of their uncertainty, then the effect's etas.
    """

    def __init__(self, problem: Problem, placed: Placed | None) -> None:
        self.problem, self.placed = problem, placed
        self.hypothesis = () if placed is None else (placed,)
        structure = problem.structure
        coordinates = _Coordinates(structure)
        self.mean, self.std, low, high = problem.prior(self.hypothesis)
        self.low = np.maximum(low, self.mean - REACH * self.std)
        self.high = np.minimum(high, self.mean + REACH * self.std)
        parameters = () if placed is None else placed.effect.parameters
        held = np.concatenate([problem.spread == 0.0, [p.fixed for p in parameters]]).astype(bool)
        self.free = np.flatnonzero(~held)
        step = problem.records[0].step
        self.rig = Rig("peer", coordinates.mjcf(), self._elements(coordinates), timestep=step)
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

    def _elements(self, coordinates: _Coordinates) -> tuple[Element, ...]:
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

    def _place(self, coordinates: _Coordinates, i: int) -> tuple[str, int]:
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
        misfit = ((vector - self.mean) / self.std)[self.free] / np.sqrt(len(self.problem.data))
        error = data.responses - self.observe(vector, data.record, predicted.data)
        residual = whitened(error, data) if np.isfinite(error).all() else np.full(self._size(index), DIVERGED)
        return np.concatenate([residual, misfit]), predicted, predicted

    def _size(self, index: int) -> int:
        return 2 * self.problem.data[index].n_bins * len(self.problem.noise)

    def residual(self, x: Array, parameters: Any) -> tuple[list[Array], list, list]:
        """The residuals as `mujoco.sysid.optimize` wants them, by its own machinery, a record at a time."""
        parts = []
        for index, (record, sequence) in enumerate(zip(self.problem.records, self.sequences, strict=True)):
            run = sysid.build_residual_fn(
                models_sequences=[sequence],
                build_model=lambda p, _spec: self.build(self.full(p.as_vector())),
                modify_residual=self._residual,
                custom_rollout=partial(self._rollout, record),
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

    def best_start(self) -> Array:
        """The point of the catalogue's grid with the least cost, the nominal parameters at their values."""
        head = np.zeros(len(self.problem.nominal))
        grid = [()] if self.placed is None else self.placed.effect.grid()
        starts = [np.concatenate([head, eta]) for eta in grid]
        return starts[0] if len(starts) == 1 else min(starts, key=self.cost)

    def cost(self, vector: Array) -> float:
        """Chi-squared and the misfit of the priors."""
        parameters = self.parameters(vector)
        residual = np.concatenate(self.residual(parameters.as_vector(), parameters)[0])
        return float(residual @ residual)

    def fit(self, start: Array, iterations: int) -> tuple[Array, float]:
        """Fit from a start; the vector reached and its cost."""
        parameters = self.parameters(start)
        # its table cannot be turned off from here
        with contextlib.redirect_stdout(io.StringIO()):
            _, result = sysid.optimize(
                parameters, self.residual, verbose=False, max_iters=iterations, x_scale="jac"
            )
        vector = self.full(np.asarray(result.x).ravel())
        return vector, self.cost(vector)

    def bic(self, cost: float) -> float:
        """Bayesian information criterion; the nominal parameters are in every candidate."""
        effect = int(np.sum(self.free >= len(self.problem.nominal)))
        return cost + effect * float(np.log(self.problem.n_residuals))

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


def diagnose(case: Case, *, catalogue: Sequence[Effect] = CATALOGUE) -> tuple[Placed | None, Any]:
    """The candidate with the best BIC, None for the nominal model, and its free run of a record."""
    from absl import logging

    logging.set_verbosity(logging.ERROR)  # it warns of every start at a bound
    mujoco.set_mju_user_warning(lambda text: None)  # and MuJoCo of every candidate that diverges
    try:
        return _best(case, catalogue)
    finally:
        mujoco.set_mju_user_warning(None)


def _best(case: Case, catalogue: Sequence[Effect]) -> tuple[Placed | None, Any]:
    structure = structure_of(case)
    problem = Problem(case, structure, case.identification)
    candidates = [Candidate(problem, None)]
    candidates += [Candidate(problem, placed) for placed in placements(case, structure, catalogue)]
    fitted = [(c, *c.fit(c.best_start(), FIRST)) for c in candidates]
    fitted.sort(key=lambda entry: entry[0].bic(entry[2]))
    carried = [(c, *c.fit(vector, LAST)) for c, vector, _ in fitted[:CARRIED]]
    best, vector, _ = min([*carried, *fitted[CARRIED:]], key=lambda entry: entry[0].bic(entry[2]))
    return best.placed, lambda record: best.predict(vector, record)
