"""Screening: what every effect at every place promises on top of a fit, by one linearised run of the joints that it changes.

The change that an effect makes, less what the nominal parameters could do as well, is regressed on the residuals: what that takes away
is what it promises. All residuals of a joint count alike here: what takes away most of their power is fitted first, and the fits weigh
what is left octave by octave.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from bench.arrays import Array
from bench.discrepancy.articulated_effects.hypothesis import PlacedOnJoint
from bench.discrepancy.articulated_search.fitting import ArticulatedFit, free_entries, linearised
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.numerics.threads import in_threads

UNSCALED = ("actuator_saturation", "backlash", "joint_compliance", "one_sided_stop", "surface_contact")
"""Effects whose first parameter is no amplitude of the force."""


@dataclass(frozen=True, eq=False)
class Screened:
    """A grid point of an effect on top of a fit.

    Attributes:
        placed: The effect.
        eta: Its parameters, the amplitude scaled to what the regression likes best.
        gain: Decrease of twice the negative log-likelihood that it promises.
        start: The vector from which it is fitted: that of the fit, moved by what the regression says of it.
    """

    placed: PlacedOnJoint
    eta: Array
    gain: float
    start: Array


class _Ground:
    """What a fit leaves on some joints, without what its own parameters could still do about it."""

    def __init__(self, problem: ArticulatedProblem, base: ArticulatedFit, joints: Sequence[int]) -> None:
        self.joints = tuple(joints)
        self.count = problem.octaves.count.sum(axis=1)
        self.units = {j: float(np.sqrt(max(base.reduced[j], 1.0))) for j in joints}
        self.base = base
        free = set(free_entries(problem, base.hypothesis).tolist())
        columns = [i for i in range(len(base.vector)) if i in free and self._moves(problem, base, i)]
        self.columns = columns
        parts = in_threads(lambda j: linearised(problem, base, j, columns, self.units[j]), self.joints)
        mean, std, _, _ = problem.prior(base.hypothesis)
        rows = np.zeros((len(columns), len(columns)))
        rows[np.arange(len(columns)), np.arange(len(columns))] = 1.0 / std[columns]
        self.residuals = {j: r for j, (_, r) in zip(self.joints, parts, strict=True)}
        self.n_prior = len(columns)
        self.basis, self.triangle = np.linalg.qr(np.vstack([*(jacobian for jacobian, _ in parts), rows]))
        self.whole = np.concatenate([
            *(r for _, r in parts), (base.vector[columns] - mean[columns]) / std[columns]
        ])  # fmt: skip
        self.left = self.without(self.whole)
        ends = np.cumsum([len(r) for _, r in parts])
        self.slices = [slice(end - len(r), end) for end, (_, r) in zip(ends, parts, strict=True)]
        _, _, self.low, self.high = problem.prior(base.hypothesis)

    def _moves(self, problem: ArticulatedProblem, base: ArticulatedFit, i: int) -> bool:
        n = len(problem.nominal)
        if i < n:
            return problem.nominal[i].of_body or any(j in problem.nominal[i].joints for j in self.joints)
        for placed in base.hypothesis:
            n += len(placed.effect.parameters)
            if i < n:
                return any(j in self.joints for j in problem.reached((placed,)))
        return False

    def without(self, change: Array) -> Array:
        return change - self.basis @ (self.basis.T @ change)

    def misfit(self, left: Array) -> float:
        """Minus twice the log-likelihood of residuals in units of the scales, those of the prior included."""
        total = float(left[self.slices[-1].stop :] @ left[self.slices[-1].stop :])
        for j, part in zip(self.joints, self.slices, strict=True):
            mean = float(left[part] @ left[part]) * self.units[j] ** 2 / float(self.count[j])
            total += float(self.count[j]) * (mean if mean <= 1.0 else 1.0 + float(np.log(mean)))
        return total

    def moved(self, change: Array) -> Array:
        """The vector of the fit, its own parameters moved to where a change of the residuals wants them."""
        step, *_ = np.linalg.lstsq(self.triangle, -self.basis.T @ (self.whole + change))
        out = self.base.vector.copy()
        out[self.columns] += step
        inside = 1e-6 * (self.high - self.low)
        inside[~np.isfinite(inside)] = 1e-6
        return np.clip(out, self.low + inside, self.high - inside)


def screen(
    problem: ArticulatedProblem, base: ArticulatedFit, candidates: Sequence[PlacedOnJoint]
) -> list[Screened]:
    """Screen effects on top of a fit; the most promising first."""
    grounds = {
        joints: _Ground(problem, base, joints)
        for joints in dict.fromkeys(problem.reached((c,)) for c in candidates)
    }

    def look(placed: PlacedOnJoint) -> list[Screened]:
        if not problem.deadline.allows("effects that were not screened"):
            return []
        ground = grounds[tuple(problem.reached((placed,)))]
        hypothesis = (*base.hypothesis, placed)
        before = ground.misfit(ground.left)
        drive = problem.joints[placed.joint].drive
        found = []
        for eta in grid(placed, servo=bool(drive and drive.servo), sides=_sides(problem, placed)):
            vector = np.concatenate([base.vector, eta])
            raw = np.concatenate([
                *(problem.residual(j, hypothesis, vector) / ground.units[j] - ground.residuals[j] for j in ground.joints),
                np.zeros(ground.n_prior),
            ])  # fmt: skip
            change = ground.without(raw)
            size = float(change @ change)
            if not np.isfinite(size) or size <= 0.0:
                continue
            along = -float(ground.left @ change) / size
            if along <= 0.0 and not placed.effect.parameters[0].signed:
                continue
            gain = before - ground.misfit(ground.left + along * change)
            factor = 1.0 if placed.effect.name in UNSCALED else along
            found.append(
                Screened(placed, _scaled(placed, eta, along), float(gain), ground.moved(factor * raw))
            )
        return sorted(found, key=lambda p: -p.gain)

    points = [p for found in in_threads(look, candidates) for p in found]
    return sorted(points, key=lambda p: -p.gain)


def _scaled(placed: PlacedOnJoint, eta: Array, along: float) -> Array:
    """A grid point with its amplitude changed by a factor."""
    out, first = eta.copy(), placed.effect.parameters[0]
    if placed.effect.name in UNSCALED:
        return out
    linear = [k for k, p in enumerate(placed.effect.parameters) if p.signed and not p.fixed]
    for k in linear if first.signed else ():
        out[k] = np.clip(eta[k] * along, *placed.effect.parameters[k].bounds)
    if not first.signed:
        out[0] = np.clip(eta[0] + np.log(np.clip(along, 0.02, 50.0)), *first.bounds)
    return out


def grid(placed: PlacedOnJoint, *, servo: bool, sides: Sequence[float]) -> list[Array]:
    """Values of the parameters that are tried; a small amplitude where the effect is linear in it.

    Whether a wrong encoder is in the loop is asked of servos only, and on which side of an elastic drive it sits where nobody says.
    """
    effect = placed.effect
    if effect.name == "cogging":
        return [np.array([s, c, n]) for n in effect.parameters[2].grid for s, c in ((0.03, 0.0), (0.0, 0.03))]
    if effect.name in ("com_error", "base_tilt"):
        return [0.03 * axis for axis in np.eye(len(effect.parameters))]
    axes = []
    for k, p in enumerate(effect.parameters):
        default = 0.1 * p.std if p.signed and k == 0 else p.mean
        values = p.grid or (default,)
        if p.name == "in_loop" and not servo:
            values = values[:1]
        axes.append(sides if p.name == "encoder_on_link" else values)
    return [np.array(point) for point in product(*axes)]


def _sides(problem: ArticulatedProblem, placed: PlacedOnJoint) -> tuple[float, ...]:
    """Sides of an elastic drive where the encoder of a joint may sit."""
    side = problem.records[0].joints[placed.joint].side
    return {"motor": (0.0,), "link": (1.0,)}.get(side, (0.0, 1.0))


def by_effect(points: Sequence[Screened], starts: int, plays: int = 0) -> list[list[Screened]]:
    """Grid points effect by effect, the most promising effects first, and of each the `starts` most promising points.

    Of a play it is the `plays` most promising ones, where these are more.
    """
    out: dict[tuple[str, str], list[Screened]] = {}
    for point in sorted(points, key=lambda p: -p.gain):
        out.setdefault(point.placed.key, []).append(point)
    most = {False: starts, True: max(starts, plays)}
    return [mine[: most[mine[0].placed.effect.play]] for mine in out.values()]
