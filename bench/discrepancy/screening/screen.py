"""Screening: every effect on a grid of its shape parameters, by one linear least-squares problem a grid point.

Along the true motion the equation ``M a + C v + K q + f = B u`` holds exactly, so the response is that of the *linear*
structure to ``B u - f(q, v)``. With the measured motion, smoothed, in place of the true one, the unknown force
becomes an input, and effect amplitudes and nominal deviations enter the response linearly. Residuals are those of the
free run, whitened as in the fits: screened improvements of chi-squared are nearly those that a fit would find, at the
price of one linear simulation a grid point, and there is no start from which it could fail to converge.

Effects of actuators and sensors spoil the measured motion itself. They are screened by what they change in the
simulated channels instead.
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
from bench.discrepancy.model.placement import Hypothesis, Placed
from bench.discrepancy.numerics.least_squares import Prior, minimise
from bench.discrepancy.numerics.threads import in_threads
from bench.discrepancy.response.initial_states import in_motion
from bench.discrepancy.response.windows import channels_of
from bench.discrepancy.screening.linear_amplitudes import (
    Node,
    Point,
    products,
    read,
    spanning,
)
from bench.discrepancy.simulation.linear_response import linear_run
from bench.discrepancy.simulation.prescribed_response import driven_force
from bench.discrepancy.simulation.step_size import steps
from bench.discrepancy.simulation.stick_slip import Elements, LinearStructure


class Ground(NamedTuple):
    """What the effects of a base and the nominal parameters leave to be explained, and what they can imitate.

    Attributes:
        residual: (n,) whitened residual of the base.
        prior: (k_prior,) residual of the nominal parameters' priors where the base has them.
        head: (n, k) orthonormal basis of the base's columns, together with `tail`.
        tail: (k_prior, k) the same basis in the rows of the priors.
        nominal: (n, n_nominal) the base's columns of the nominal parameters.
        triangle: (k, k) what makes the base's columns of their basis.
    """

    residual: Array
    prior: Array
    head: Array
    tail: Array
    nominal: Array
    triangle: Array

    def moves(self, response: Array) -> Array:
        """Changes of the base's parameters (k,) that go with a response (n,) being explained by something else."""
        seen = self.head.T @ (self.residual - response) + self.tail.T @ self.prior
        return np.asarray(np.linalg.lstsq(self.triangle, seen, rcond=1e-12)[0], dtype=np.float64)

    @property
    def left(self) -> Array:
        """What the base leaves (n + k_prior,), its parameters free to first order."""
        imitated = self.head.T @ self.residual + self.tail.T @ self.prior
        return np.concatenate([self.residual - self.head @ imitated, self.prior - self.tail @ imitated])

    def project(self, response: Array) -> Array:
        """Part of a response (n,) that the base cannot imitate, the price of its priors appended."""
        imitated = self.head.T @ response
        return np.concatenate([response - self.head @ imitated, -self.tail @ imitated])


class About(NamedTuple):
    """What a screening is about, see `Screen.beside`."""

    base: Fit
    simulated: bool


class Screen:
    """Whitened responses to all joint effects along the measured motion, ready to be conditioned on a base.

    Args:
        problem: Records and nominal model.
        candidates: Effects; actuator, sensor and inertia effects are kept for `ranked`.
        about: Where the linear structure, the sensors and perhaps the motion are taken from; see `beside`.
    """

    def __init__(
        self,
        problem: Problem,
        candidates: Sequence[Placed],
        *,
        about: About | None = None,
    ) -> None:
        self.candidates: list[Placed] = []
        self._beside: tuple[bytes, Screen] | None = None
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
        self.linear = LinearStructure(linear.mass, linear.damping, linear.stiffness, np.eye(len(linear.mass)))
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
        self.inertia: list[Placed] = []
        self.signals: list[Placed] = []
        self.nodes: list[Node] = []
        self.add(candidates)

    def add(self, candidates: Sequence[Placed]) -> None:
        """Screen further effects.

        Args:
            candidates: Effects that are not screened yet.
        """
        self.candidates += candidates
        self.inertia += [p for p in candidates if p.effect.site == "inertia"]
        self.signals += [p for p in candidates if p.effect.site in {"actuator", "sensor"}]
        tasks = [(p, eta) for p in candidates if p.effect.site == "joint" for eta in p.effect.grid()]
        self.nodes += [node for node in in_threads(lambda task: self._node(*task), tasks) if node is not None]

    def beside(self, base: Fit, *, simulated: bool) -> Screen:
        """This screening about a base: for the structure it found, and seen through its sensor effects.

        A small second effect is told from the nominal parameters by little, and a wrong gain of an accelerometer bends the fused
        motion by more than such an effect leaves in the records.

        Args:
            base: Fitted hypothesis.
            simulated: Take the motion from its free run, where it explains the records: the noise of the measured
                motion is that of the residual, and what is small would be found in it.
        """
        key = repr((simulated, [placed.key for placed in base.hypothesis])).encode() + base.vector.tobytes()
        if self._beside is None or self._beside[0] != key:
            about = About(base, simulated)
            self._beside = None  # a screening is large
            self._beside = key, Screen(self.problem, self.candidates, about=about)
        return self._beside[1]

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
        return self.response(lambda i: -force_along(self.problem, placed, eta, i))

    def _node(self, placed: Placed, eta: Array) -> Node | None:
        # hundreds of grid points are kept, and a free force has dozens of columns: seven digits are enough
        first, *further = spanning(placed, eta)
        offset = self.effect_response(placed, first)
        columns = np.empty((len(offset), 1 + len(further)), dtype=np.float32)

        def write(k: int) -> None:
            response = self.effect_response(placed, further[k])
            with np.errstate(over="ignore", invalid="ignore"):
                columns[:, 1 + k] = response - offset if relative else response

        relative = placed.effect.modulated or placed.effect.affine
        with np.errstate(over="ignore", invalid="ignore"):
            columns[:, 0] = offset
        in_threads(write, range(len(further)))
        # a hidden resonance can make more of a record than rounding leaves of anything else
        largest = max(columns.max(), -columns.min())
        if not 0.0 < largest < self.problem.settings.screening.largest:
            return None
        return Node(placed, eta, columns, products(columns, columns))

    def ground(self, base: Fit | None = None, *, simulated: bool = False) -> Ground:
        """What a base hypothesis leaves.

        Args:
            base: Fitted hypothesis that stays in the model, its parameters free to first order; None for none.
            simulated: Take the residual and the columns of the base from its free run rather than from the measured motion.
                Right for a base that already explains the records, whose residual then is noise; with much still
                missing, only the measured motion tells what the base's own force is.
        """
        hypothesis: Hypothesis = () if base is None else base.hypothesis
        vector = np.zeros(len(self.problem.nominal)) if base is None else base.vector
        residual, columns, deviations = self._base(hypothesis, vector, simulated)
        n = len(self.problem.nominal)
        basis, triangle = np.linalg.qr(np.vstack([columns, np.eye(n, columns.shape[1])]))
        head, tail = basis[: len(residual)], basis[len(residual) :]
        return Ground(residual, -deviations, head, tail, columns[:, :n], triangle)

    def starts(self, point: Point, ground: Ground, base: Fit | None = None) -> Array:
        """Starts of a fit of one more effect.

        Args:
            point: The effect and its parameters.
            ground: What the base leaves.
            base: Fitted hypothesis that stays in the model; None for the nominal model alone.

        Returns:
            (k, n): the base's parameters that go with the effect along the motion, and beside a fitted base those it has.
        """
        if point.placed.effect.site != "joint":
            return np.append(self.deviations if base is None else base.vector, point.eta)[None]
        hypothesis: Hypothesis = () if base is None else base.hypothesis
        n = len(self.deviations)
        own = [not p.fixed for placed in hypothesis for p in placed.effect.parameters]
        free = np.concatenate([np.ones(n, dtype=bool), np.array(own, dtype=bool)])
        moved = self.deviations.copy() if base is None else np.append(self.deviations, base.vector[n:])
        moved[free] += ground.moves(self.effect_response(point.placed, point.eta))
        _, _, low, high = self.problem.prior(hypothesis)
        origins = [np.clip(moved, low, high)] + ([] if base is None else [base.vector])
        return np.array([np.append(origin, point.eta) for origin in origins])

    def ranked(self, base: Fit | None = None, ground: Ground | None = None) -> list[Point]:
        """Solve all grid points, given a base hypothesis; by decreasing gain.

        Args:
            base: Fitted hypothesis that stays in the model; None for none.
            ground: What `ground` returned for it, where it was called before.
        """
        hypothesis: Hypothesis = () if base is None else base.hypothesis
        vector = np.zeros(len(self.problem.nominal)) if base is None else base.vector
        ground = ground or self.ground(base)
        own = {placed.key for placed in hypothesis}
        rest = ground.left[: len(ground.residual)]
        nodes = [node for node in self.nodes if node.placed.key not in own]
        nodes += self._signal_nodes(hypothesis, vector)

        def solved(node: Node) -> Point | None:
            inner = products(ground.head, node.columns)
            return read(
                node,
                node.gram - inner.T @ inner,
                products(node.columns, rest[:, None])[:, 0],
                settings=self.problem.settings.screening,
            )

        points = [point for point in in_threads(solved, nodes) if point is not None]
        return sorted(points, key=lambda point: -point.gain)

    def inertia_points(self, base: Fit, ground: Ground) -> list[Point]:
        """Errors of nominal parameters that a base does not hold, by the chi-squared that goes if the prior of one falls.

        They start where the parameter is, so that a fit moves it from there.
        """
        alone = ground.left
        own = {placed.key for placed in base.hypothesis}
        points = []
        for placed in [placed for placed in self.inertia if placed.key not in own]:
            column = ground.project(ground.nominal[:, self.problem.structure.parameters.index(placed.target)])
            gain = float((column @ alone) ** 2 / max(column @ column, 1e-300))
            points.append(Point(placed, gain, np.zeros(1)))
        return sorted(points, key=lambda point: -point.gain)

    def refine(self, point: Point, ground: Ground, iterations: int = 6) -> Point:
        """Move a grid point of a joint effect to the nearest optimum along the measured motion.

        Costs no free run of the nonlinear model: a handful of forces along the measured motion and linear responses.
        """
        settings = self.problem.settings.screening
        effect = point.placed.effect
        if effect.site != "joint" or not any(p.grid and not p.fixed for p in effect.parameters):
            return point
        prior = Prior(
            *(np.array(x) for x in zip(*((p.mean, p.std, *p.bounds) for p in effect.parameters), strict=True))
        )
        alone = ground.left
        free = np.flatnonzero([not p.fixed for p in effect.parameters])
        found = minimise(
            lambda eta: alone - ground.project(self.effect_response(point.placed, eta)),
            point.eta,
            prior=prior,
            free=free,
            reach=np.full(len(free), settings.refining_reach),
            iterations=iterations,
            tolerance=max(1.0, settings.refined * float(alone @ alone)),
            exact=False,
            settings=self.problem.settings.numerics,
        )
        if not np.isfinite(found.cost):
            return point
        return Point(point.placed, float(alone @ alone - found.residual @ found.residual), found.vector)

    def _base(self, hypothesis: Hypothesis, vector: Array, simulated: bool) -> tuple[Array, Array, Array]:
        """Residual, parameter columns and nominal deviations of a base: along the measured motion for forces, simulated otherwise."""
        if simulated or any(placed.effect.site in {"actuator", "sensor"} for placed in hypothesis):
            residual = self.problem.residual(hypothesis, vector)
            # what is left of an explanation without one of its effects may diverge, and tells nothing then
            if np.isfinite(residual).all():
                columns = self._simulated_columns(hypothesis, vector, residual)
                return residual, columns, vector[: len(self.problem.nominal)]
        residual = self.zero.copy()
        columns = [self.nominal]
        _, etas = self.problem.split(hypothesis, vector)
        for placed, eta in zip(hypothesis, etas, strict=True):
            if placed.effect.site == "inertia":
                i = self.problem.structure.parameters.index(placed.target)
                columns.append(1e3 * self.nominal[:, [i]])
            if placed.effect.site == "joint":
                response, changes = self._shaped(placed, eta)
                residual = residual - response
                columns.append(changes)
        return residual, np.hstack(columns), self.deviations

    def _shaped(self, placed: Placed, eta: Array) -> tuple[Array, Array]:
        """Response (n,) to an effect along the measured motion, and its changes (n, k) with the free parameters."""
        free = [k for k, parameter in enumerate(placed.effect.parameters) if not parameter.fixed]
        points = np.repeat(eta[None], 1 + len(free), axis=0)
        for point, k in zip(points[1:], free, strict=True):
            parameter = placed.effect.parameters[k]
            step = self.problem.settings.screening.shape_step * parameter.std
            point[k] += step if point[k] + step <= parameter.bounds[1] else -step
        response, *moved = in_threads(lambda point: self.effect_response(placed, point), points)
        changes = [(m - response) / (p[k] - eta[k]) for m, p, k in zip(moved, points[1:], free, strict=True)]
        return response, np.array(changes).reshape(-1, len(response)).T

    def _simulated_columns(self, hypothesis: Hypothesis, vector: Array, residual: Array) -> Array:
        """Responses (n, k) of a free run to the nominal parameters and to the free ones of its effects."""
        _, std, _, high = self.problem.prior(hypothesis)
        shapes = [p.fixed for placed in hypothesis for p in placed.effect.parameters]
        held = [False] * len(self.problem.nominal) + shapes
        return np.column_stack(
            in_threads(
                lambda i: self._simulated_column(
                    hypothesis,
                    vector,
                    residual,
                    i,
                    self.problem.settings.screening.run_step * std[i],
                    high[i],
                ),
                np.flatnonzero(~np.array(held)).tolist(),
            )
        )

    def _simulated_column(
        self, hypothesis: Hypothesis, vector: Array, residual: Array, entry: int, step: float, high: float
    ) -> Array:
        """Response (n,) of a free run to one entry of its vector; zero where a step either way lets the run diverge."""
        for change in (step, -step):
            moved = vector.copy()
            moved[entry] += change
            if moved[entry] > high:
                continue
            away = self.problem.residual(hypothesis, moved)
            if away.shape == residual.shape:
                return np.asarray((residual - away) / change, dtype=np.float64)
        return np.zeros_like(residual)

    def _signal_nodes(self, hypothesis: Hypothesis, vector: Array) -> list[Node]:
        """Changes that actuator and sensor effects make to the simulated channels of a base."""
        own = {placed.key for placed in hypothesis}
        base = self.problem.residual(hypothesis, vector)

        def node(task: tuple[Placed, Array]) -> Node | None:
            placed, eta = task
            point = eta.copy()
            if placed.effect.parameters[0].signed:
                point[0] = self.problem.settings.screening.signal_step
            changed = self.problem.residual((*hypothesis, placed), np.concatenate([vector, point]))
            if changed.shape != base.shape or not np.any(changed != base):
                return None
            column = (base - changed)[:, None]
            return Node(placed, point, column, column.T @ column)

        tasks = [(p, eta) for p in self.signals if p.key not in own for eta in p.effect.grid()]
        return [found for found in in_threads(node, tasks) if found is not None]


def _unspoilt(problem: Problem, base: Fit, record: CaseRecord) -> Array:
    """Channels (n, n_channels) of the free run of a base without its sensor effects."""
    _, etas = problem.split(base.hypothesis, base.vector)
    kept = [(p, eta) for p, eta in zip(base.hypothesis, etas, strict=True) if p.effect.site != "sensor"]
    vector = np.concatenate([base.vector[: len(problem.nominal)], *(eta for _, eta in kept)])
    return problem.simulate(tuple(p for p, _ in kept), vector, record)


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


def force_along(problem: Problem, placed: Placed, eta: Array, index: int) -> Array:
    """Force of an effect on the degrees of freedom (n, n_dof) along the measured motion of record `index`."""
    motion = problem.motion(index)
    record = problem.records[index]
    rows = placed.place.rows
    elements, rates = problem.elements((placed,), [eta], record)
    local = Elements(elements.table, rows, elements.theta, elements.start)
    force = driven_force(
        local,
        position=motion.position @ rows.T,
        velocity=motion.velocity @ rows.T,
        step=record.step,
        substeps=steps(record.step * rates, settings=problem.settings.simulation),
        start_time=record.start,
    )
    if placed.effect.in_place:
        force[:, 0] -= own_friction(problem.structure, problem.nominal, motion, rows[0], record.step)
    return force @ rows
