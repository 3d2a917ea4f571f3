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
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.fit import Fit
from bench.discrepancy.problem import COULOMB, Array, Hypothesis, Placed, Problem, whitened
from bench.discrepancy.system import NO_ELEMENTS, Elements, LinearStructure, driven_force, free_run

SIGNAL_STEP = 0.1
"""Value of eta at which a signed channel effect without grid is tried."""
TINY = -60.0
"""Value of eta that makes a positive amplitude vanish."""
SHAPE_STEP = 0.02
"""Finite difference in the shape parameters of a base effect, in units of their prior standard deviation."""


class Node(NamedTuple):
    """A grid point of an effect.

    Attributes:
        placed: The effect.
        eta: Parameters with unit amplitude.
        columns: (n, k) whitened responses that span the effect at this shape.
        gram: (k, k) their products.
    """

    placed: Placed
    eta: Array
    columns: NDArray[np.float32]
    gram: Array


class Point(NamedTuple):
    """A grid point, solved.

    Attributes:
        placed: The effect.
        gain: Decrease of chi-squared, nominal deviations and the base's parameters re-estimated.
        eta: Start for a fit.
    """

    placed: Placed
    gain: float
    eta: Array


class Screen:
    """Whitened responses to all joint effects along the measured motion, ready to be conditioned on a base.

    Args:
        problem: Records and nominal model.
        candidates: Effects; actuator, sensor and inertia effects are kept for `ranked`.
        each: Maps a function over items, in threads where wanted.
    """

    def __init__(self, problem: Problem, candidates: Sequence[Placed], each: Callable = map) -> None:
        self.problem = problem
        self.inertia = [p for p in candidates if p.effect.site == "inertia"]
        self.signals = [p for p in candidates if p.effect.site in {"actuator", "sensor"}]
        linear = problem.structure.at(problem.nominal)
        self.linear = LinearStructure(linear.mass, linear.damping, linear.stiffness, np.eye(len(linear.mass)))
        n = len(problem.nominal)
        for i in range(len(problem.records)):
            problem.motion(i)
        self.zero = problem.residual((), np.zeros(n))
        self.nominal = np.column_stack(
            [self.response(lambda i, p=p: self._deviation(i, p)) for p in range(n)]
        )
        tasks = [(p, eta) for p in candidates if p.effect.site == "joint" for eta in p.effect.grid()]
        self.nodes = [node for node in each(lambda task: self._node(*task), tasks) if node is not None]

    def _deviation(self, index: int, parameter: int) -> Array:
        """Force that a deviation of one nominal parameter by its uncertainty takes from the structure."""
        if self.problem.structure.parameters[parameter] == COULOMB:
            return -self.problem.spread[parameter] * np.sign(self.problem.motion(index).velocity)
        motion, s = self.problem.motion(index), self.problem.structure
        force = motion.acceleration @ s.mass[parameter].T + motion.velocity @ s.damping[parameter].T
        return -self.problem.spread[parameter] * (force + motion.position @ s.stiffness[parameter].T)

    def response(self, force_on_dofs: Callable[[int], Array]) -> Array:
        """Whitened response of all records to forces on the degrees of freedom, given by record index."""
        parts = []
        for i, data in enumerate(self.problem.data):
            if self.problem.driven:
                parts.append(whitened(-force_on_dofs(i), data))
                continue
            motion = free_run(self.linear, NO_ELEMENTS, loads=force_on_dofs(i), step=data.record.step)
            channels = np.column_stack([motion[o.order] @ o.row for o in self.problem.structure.observers])
            parts.append(whitened(channels, data))
        return np.concatenate(parts)

    def effect_response(self, placed: Placed, eta: Array) -> Array:
        """Whitened response to an effect along the measured motion."""
        return self.response(lambda i: -force_along(self.problem, placed, eta, i))

    def _node(self, placed: Placed, eta: Array) -> Node | None:
        columns = np.column_stack([self.effect_response(placed, point) for point in _spanning(placed, eta)])
        if placed.effect.modulated or placed.effect.affine:
            columns[:, 1:] -= columns[:, :1]
        if not np.isfinite(columns).all() or not np.any(columns):
            return None
        return Node(placed, eta, columns.astype(np.float32), columns.T @ columns)

    def ranked(self, base: Fit | None = None) -> list[Point]:
        """Solve all grid points, given a base hypothesis; by decreasing gain.

        Args:
            base: Fitted hypothesis that stays in the model, its parameters free to first order; None for none.
        """
        hypothesis: Hypothesis = () if base is None else base.hypothesis
        vector = np.zeros(len(self.problem.nominal)) if base is None else base.vector
        residual, columns = self._base(hypothesis, vector)
        own = {placed.key for placed in hypothesis}
        n = columns.shape[1]
        priors = np.zeros((n, n))
        priors[: len(self.problem.nominal), : len(self.problem.nominal)] = np.eye(len(self.problem.nominal))
        basis, _ = np.linalg.qr(np.vstack([columns, priors]))
        head = basis[: len(residual)]
        rest = (residual - head @ (head.T @ residual)).astype(np.float32)
        head = head.astype(np.float32)
        points = []
        for node in [node for node in self.nodes if node.placed.key not in own] + self._signal_nodes(
            hypothesis, vector
        ):
            inner = (head.T @ node.columns).astype(float)
            point = _read(node, node.gram - inner.T @ inner, (node.columns.T @ rest).astype(float))
            if point is not None:
                points.append(point)
        points.sort(key=lambda point: -point.gain)
        return points

    def _base(self, hypothesis: Hypothesis, vector: Array) -> tuple[Array, Array]:
        """Residual and parameter columns of a base: along the measured motion for forces, simulated otherwise."""
        if any(placed.effect.site in {"actuator", "sensor"} for placed in hypothesis):
            residual = self.problem.residual(hypothesis, vector)
            columns = []
            _, std, _, high = self.problem.prior(hypothesis)
            for i in range(len(vector)):
                moved = vector.copy()
                moved[i] += 1e-3 * std[i] * (1.0 if moved[i] + 1e-3 * std[i] <= high[i] else -1.0)
                columns.append((residual - self.problem.residual(hypothesis, moved)) / (moved[i] - vector[i]))
            return residual, np.column_stack(columns)
        residual = self.zero.copy()
        columns = [self.nominal]
        _, etas = self.problem.split(hypothesis, vector)
        for placed, eta in zip(hypothesis, etas, strict=True):
            if placed.effect.site == "inertia":
                i = self.problem.structure.parameters.index(placed.target)
                columns.append(1e3 * self.nominal[:, [i]])
                continue
            response = self.effect_response(placed, eta)
            residual = residual - response
            for k, parameter in enumerate(placed.effect.parameters):
                if parameter.fixed:
                    continue
                moved = eta.copy()
                step = SHAPE_STEP * parameter.std
                moved[k] += step if moved[k] + step <= parameter.bounds[1] else -step
                columns.append(
                    ((self.effect_response(placed, moved) - response) / (moved[k] - eta[k]))[:, None]
                )
        return residual, np.hstack(columns)

    def _signal_nodes(self, hypothesis: Hypothesis, vector: Array) -> list[Node]:
        """Changes that actuator and sensor effects make to the simulated channels of a base."""
        own = {placed.key for placed in hypothesis}
        base = self.problem.residual(hypothesis, vector)
        nodes = []
        for placed in self.signals:
            if placed.key in own:
                continue
            for eta in placed.effect.grid():
                point = eta.copy()
                if placed.effect.parameters[0].signed:
                    point[0] = SIGNAL_STEP
                changed = self.problem.residual((*hypothesis, placed), np.concatenate([vector, point]))
                if changed.shape == base.shape and np.any(changed != base):
                    column = (base - changed)[:, None]
                    nodes.append(Node(placed, point, column.astype(np.float32), column.T @ column))
        return nodes


def force_along(problem: Problem, placed: Placed, eta: Array, index: int) -> Array:
    """Force of an effect on the degrees of freedom (n, n_dof) along the measured motion of record `index`."""
    motion = problem.motion(index)
    record = problem.records[index]
    rows = placed.place.rows
    elements, rate = problem.elements((placed,), [eta], record)
    local = Elements(elements.table, rows, elements.theta, elements.start)
    substeps = int(np.clip(np.ceil(record.step * rate / 0.6), 1, 16))
    force = driven_force(
        local,
        position=motion.position @ rows.T,
        velocity=motion.velocity @ rows.T,
        step=record.step,
        substeps=substeps,
        start_time=record.start,
    )
    return force @ rows


def _amplitudes(placed: Placed) -> list[int]:
    count = placed.effect.n_linear or placed.effect.n_coordinates
    return [i for i, p in enumerate(placed.effect.parameters) if i < count and not p.grid]


def _spanning(placed: Placed, eta: Array) -> list[Array]:
    """Parameter points whose responses span the effect at one shape."""
    effect = placed.effect
    unit = eta.copy()
    amplitudes = _amplitudes(placed)
    for i in amplitudes:
        unit[i] = 1.0 if effect.parameters[i].signed else 0.0
    if effect.modulated:
        still, sine, cosine = unit.copy(), unit.copy(), unit.copy()
        still[1], sine[1], cosine[1] = TINY, 0.0, 0.0
        sine[3], cosine[3] = 0.0, 0.5 * np.pi
        return [still, sine, cosine]
    if effect.affine:
        without, with_one = unit.copy(), unit.copy()
        without[1], with_one[1] = TINY, 0.0
        return [without, with_one]
    points = []
    for i in amplitudes:
        single = unit.copy()
        for j in amplitudes:
            if j != i:
                single[j] = 0.0 if effect.parameters[j].signed else TINY
        points.append(single)
    return points


def _read(node: Node, gram: Array, right: Array) -> Point | None:  # noqa: PLR0912  (one branch a kind of effect)
    """Best coefficients of a node, and the parameters they stand for; None where their sign makes no sense."""
    effect = node.placed.effect
    parameters = effect.parameters
    eta = node.eta.copy()
    # single precision leaves a relative error of some 1e-6 in the projected products
    if gram.trace() <= 1e-5 * max(node.gram.trace(), 1e-300):
        return None
    c = np.linalg.lstsq(gram, right, rcond=1e-10)[0]
    if effect.site in {"actuator", "sensor"}:
        if parameters[0].signed:
            eta[0] = np.clip(SIGNAL_STEP * c[0], *parameters[0].bounds)
        elif c[0] <= 0:
            return None
    elif effect.modulated:
        if c[0] <= 0:
            return None
        eta[0] = np.log(c[0])
        eta[1] = np.log(max(np.hypot(c[1], c[2]) / c[0], 1e-6))
        eta[3] = np.arctan2(c[2], c[1])
    elif effect.affine:
        if c[0] <= 0 or c[1] <= 0:
            return None
        eta[0], eta[1] = np.log(c[0]), np.log(c[1] / c[0])
    else:
        for position, i in enumerate(_amplitudes(node.placed)):
            if parameters[i].signed:
                eta[i] = c[position]
            elif c[position] > 0:
                eta[i] = np.log(c[position])
            elif len(c) == 1:
                return None
            else:
                c[position] = 0.0
                eta[i] = -7.0
    low = np.array([p.bounds[0] for p in parameters])
    high = np.array([p.bounds[1] for p in parameters])
    gain = float(2.0 * c @ right - c @ gram @ c)
    return Point(node.placed, gain, np.clip(eta, low, high))
