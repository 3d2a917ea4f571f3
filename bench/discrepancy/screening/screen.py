"""Screening: every effect on a grid of its shape parameters, by one linear least-squares problem a grid point.

Effect amplitudes and nominal deviations enter the response along the measured motion linearly (`motion_response`). Residuals are
those of the free run, whitened as in the fits: screened improvements of chi-squared are nearly those that a fit would find, at the
price of one linear simulation a grid point, and there is no start from which it could fail to converge.

Effects of actuators and sensors spoil the measured motion itself. They are screened by what they change in the
simulated channels instead.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bench.discrepancy.fitting.map_fit import Fit
from bench.discrepancy.fitting.starts import Point
from bench.discrepancy.likelihood.problem import Array, Problem
from bench.discrepancy.model.placement import Hypothesis, Placed
from bench.discrepancy.numerics.least_squares import Prior, minimise
from bench.discrepancy.numerics.threads import in_threads
from bench.discrepancy.screening.linear_amplitudes import (
    GridPoint,
    products,
    read,
    spanning,
)
from bench.discrepancy.screening.motion_response import About, MotionResponse
from bench.discrepancy.screening.projection import Ground
from bench.discrepancy.screening.run_columns import signal_nodes, simulated_columns


class Screen(MotionResponse):
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
        super().__init__(problem, about=about)
        self.candidates: list[Placed] = []
        self._beside: tuple[bytes, Screen] | None = None
        self.inertia: list[Placed] = []
        self.signals: list[Placed] = []
        self.nodes: list[GridPoint] = []
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

    def _node(self, placed: Placed, eta: Array) -> GridPoint | None:
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
        return GridPoint(placed, eta, columns, products(columns, columns))

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
        nodes += signal_nodes(self.problem, self.signals, hypothesis, vector)

        def solved(node: GridPoint) -> Point | None:
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
                columns = simulated_columns(self.problem, hypothesis, vector, residual)
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
