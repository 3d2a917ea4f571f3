"""Search for what is missing from an articulated model: effects at all places are screened, the most promising fitted, one by one.

A screened effect is one run (or a few, over a grid) of the joints that it changes. The change that it makes, less what the nominal
parameters could do as well, is regressed on the residuals: what that takes away is what the effect promises.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from bench.discrepancy.articulated.fitting import ArticulatedFit, Others, fit, free_entries, linearised
from bench.discrepancy.articulated.problem import ArticulatedProblem, Hypothesis, Placed, misfit_of
from bench.discrepancy.numerics.threads import in_threads
from bench.discrepancy.settings import ArticulatedSearchSettings as SearchSettings

Array = NDArray[np.float64]
UNSCALED = ("actuator_saturation", "backlash", "joint_compliance", "one_sided_stop")
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

    placed: Placed
    eta: Array
    gain: float
    start: Array


class _Ground:
    """What a fit leaves on some joints, without what its own parameters could still do about it."""

    def __init__(self, problem: ArticulatedProblem, base: ArticulatedFit, joints: Sequence[int]) -> None:
        self.joints = tuple(joints)
        self.count = problem.count
        self.base = base
        free = set(free_entries(problem, base.hypothesis).tolist())
        columns = [i for i in range(len(base.vector)) if i in free and self._moves(problem, base, i)]
        self.columns = columns
        parts = in_threads(lambda j: linearised(problem, base, j, columns), self.joints)
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
            return problem.nominal[i].kind == "mass" or problem.nominal[i].joint in self.joints
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
            chi2 = float(left[part] @ left[part]) * float(self.base.scale[j]) ** 2
            total += misfit_of(chi2, float(self.count[j]))
        return total

    def moved(self, change: Array) -> Array:
        """The vector of the fit, its own parameters moved to where a change of the residuals wants them."""
        step, *_ = np.linalg.lstsq(self.triangle, -self.basis.T @ (self.whole + change))
        out = self.base.vector.copy()
        out[self.columns] += step
        inside = 1e-6 * (self.high - self.low)
        inside[~np.isfinite(inside)] = 1e-6
        return np.clip(out, self.low + inside, self.high - inside)


def screen(problem: ArticulatedProblem, base: ArticulatedFit, candidates: Sequence[Placed]) -> list[Screened]:
    """Screen effects on top of a fit; the most promising first."""
    everything = tuple(range(len(problem.joints)))
    grounds = {joints: _Ground(problem, base, joints) for joints in [*((j,) for j in everything), everything]}

    def look(placed: Placed) -> list[Screened]:
        ground = grounds[tuple(problem.reached((placed,)))]
        hypothesis = (*base.hypothesis, placed)
        before = ground.misfit(ground.left)
        drive = problem.joints[placed.joint].drive
        found = []
        for eta in grid(placed, servo=bool(drive and drive.servo), sides=_sides(problem, placed)):
            vector = np.concatenate([base.vector, eta])
            raw = np.concatenate([
                *(problem.residual(j, hypothesis, vector) / base.scale[j] - ground.residuals[j] for j in ground.joints),
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


def _scaled(placed: Placed, eta: Array, along: float) -> Array:
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


def grid(placed: Placed, *, servo: bool, sides: Sequence[float]) -> list[Array]:
    """Values of the parameters that are tried; a small amplitude where the effect is linear in it.

    Whether a wrong encoder is in the loop is asked of servos only, and on which side of an elastic drive it sits where nobody says.
    """
    effect = placed.effect
    if effect.name == "cogging":
        return [np.array([s, c, n]) for n in effect.parameters[2].grid for s, c in ((0.03, 0.0), (0.0, 0.03))]
    if effect.name == "com_error":
        return [0.03 * axis for axis in np.eye(3)]
    axes = []
    for k, p in enumerate(effect.parameters):
        default = 0.1 * p.std if p.signed and k == 0 else p.mean
        values = p.grid or (default,)
        if p.name == "in_loop" and not servo:
            values = values[:1]
        axes.append(sides if p.name == "encoder_on_link" else values)
    return [np.array(point) for point in product(*axes)]


def _sides(problem: ArticulatedProblem, placed: Placed) -> tuple[float, ...]:
    """Sides of an elastic drive where the encoder of a joint may sit."""
    side = problem.records[0].joints[placed.joint].side
    return {"motor": (0.0,), "link": (1.0,)}.get(side, (0.0, 1.0))


def _by_effect(points: Sequence[Screened], starts: int) -> list[list[Screened]]:
    """Grid points effect by effect, the most promising effects first, and of each the `starts` most promising points."""
    out: dict[tuple[str, str], list[Screened]] = {}
    for point in sorted(points, key=lambda p: -p.gain):
        out.setdefault(point.placed.key, []).append(point)
    return [mine[:starts] for mine in out.values()]


def _strained(problem: ArticulatedProblem, base: ArticulatedFit, settings: SearchSettings) -> set[int]:
    """Joints one of whose nominal parameters a fit has moved too far."""
    return {p.joint for p, x in zip(problem.nominal, base.vector, strict=False) if abs(x) > settings.strained}


def _untouched(problem: ArticulatedProblem, base: ArticulatedFit) -> ArticulatedFit:
    """A fit with the nominal parameters as stated."""
    vector = base.vector.copy()
    vector[: len(problem.nominal)] = 0.0
    return ArticulatedFit.at(problem, base.hypothesis, vector)


def nominal_fit(problem: ArticulatedProblem, settings: SearchSettings) -> ArticulatedFit:
    """The nominal model alone, with the scales of the joints that it leaves."""
    vector = np.zeros(len(problem.nominal))
    scale = ArticulatedFit.at(problem, (), vector).scale
    current = fit(problem, (), vector, scale=scale, iterations=settings.iterations)
    for _ in range(settings.refits - 1):
        before = current.scale
        current = fit(problem, (), current.vector, scale=before, iterations=settings.iterations)
        if np.allclose(before, current.scale, rtol=0.05):
            break
    return current


def search(
    problem: ArticulatedProblem,
    candidates: Sequence[Placed],
    *,
    settings: SearchSettings | None = None,
    progress: Callable[[str], None] = lambda text: None,
) -> list[ArticulatedFit]:
    """All fitted hypotheses, the likeliest first."""
    settings = settings or problem.settings.articulated.search
    progress("nominal model")
    current = nominal_fit(problem, settings)
    found = [current]
    for count in range(1, settings.most + 1):
        taken = {placed.key for placed in current.hypothesis}
        rest = [c for c in candidates if c.key not in taken]
        best, fits = _round(
            problem, current, rest, settings, lambda text, n=count: progress(f"effect {n}: {text}")
        )
        found += fits
        if best is None or best.log_posterior < current.log_posterior + settings.worth:
            break
        current = best
        settled = problem.settled(current.hypothesis, current.vector)
        if settled is not problem:
            problem = settled
            current = fit(
                problem,
                current.hypothesis,
                current.vector,
                scale=current.scale,
                iterations=settings.iterations,
            )
            found.append(current)
    return sorted(found, key=lambda f: -f.log_posterior)


def _round(
    problem: ArticulatedProblem,
    base: ArticulatedFit,
    candidates: Sequence[Placed],
    settings: SearchSettings,
    progress: Callable[[str], None],
) -> tuple[ArticulatedFit | None, list[ArticulatedFit]]:
    """One effect more: screened and fitted where runs forget, the best of them fitted again as they are.

    Returns:
        The best, all joints free, and all that were fitted as they are.
    """
    first: list[ArticulatedFit] = []
    for level in settings.softening:
        soft = problem.softened(level)
        if first:
            first = [_again(soft, f, settings) for f in first]
            continue
        ground = fit(
            soft, base.hypothesis, base.vector, scale=_scale_of(soft, base), iterations=settings.iterations
        )
        progress("screening")
        points = screen(soft, ground, candidates)
        if _strained(
            soft, ground, settings
        ):  # what stands in for the missing hides it; also from what was stated
            points += screen(soft, _untouched(soft, ground), candidates)
        progress("fits")
        first = _fits(soft, ground, _by_effect(points, settings.starts), settings)
        if soft is problem:  # servos hold every joint: nothing forgets more than it does anyway
            break
    others = Others.of(problem, base)
    fits = []
    first = [f for f in first if sound(problem, f)] or first
    for one in sorted(first, key=lambda f: -f.log_posterior)[: settings.finalists]:
        new = fit(
            problem,
            one.hypothesis,
            one.vector,
            scale=_scale_of(problem, one),
            iterations=settings.iterations,
            others=others,
        )
        # once more with the scale that it leaves: what a joint says of the masses counts for more then
        fits.append(
            fit(
                problem,
                one.hypothesis,
                new.vector,
                scale=new.scale,
                iterations=settings.iterations,
                others=others,
            )
        )
    fits = [f for f in fits if sound(problem, f)]
    if not fits:
        return None, fits
    best = max(fits, key=lambda f: f.log_posterior)
    whole = fit(problem, best.hypothesis, best.vector, scale=best.scale, iterations=settings.iterations)
    return whole, [*(f for f in fits if f is not best), whole]


def _again(problem: ArticulatedProblem, found: ArticulatedFit, settings: SearchSettings) -> ArticulatedFit:
    """A fit once more in another problem, on the joints that its last effect changes."""
    base = ArticulatedFit.at(problem, found.hypothesis[:-1], found.vector)
    return fit(
        problem, found.hypothesis, found.vector, scale=_scale_of(problem, found), iterations=settings.iterations,
        others=Others.of(problem, base),
    )  # fmt: skip


def _beside(
    problem: ArticulatedProblem, found: ArticulatedFit, others: Others, settings: SearchSettings
) -> ArticulatedFit:
    """A fit whose last effect is periodic, with the next whole numbers of periods in a turn for as long as they are likelier.

    Over the range of a joint two neighbouring numbers differ by a fraction of a period, which a phase and a wrong gain of the encoder make
    up for; screened one at a time, with what else is missing still in the residuals, they are hardly told apart.
    """
    names = [p.name for p in found.hypothesis[-1].effect.parameters]
    if PERIODS not in names:
        return found
    placed, first = found.hypothesis[-1], len(found.vector) - len(names)
    sine, cosine, at = (first + names.index(name) for name in ("sine", "cosine", PERIODS))
    grid = placed.effect.parameters[names.index(PERIODS)].grid
    while True:
        starts = []
        for n in (found.vector[at] + d for d in (-2, -1, 1, 2)):
            if n in grid:
                # the same torque in the middle of the range: A sin(n q + phase)
                turn = (found.vector[at] - n) * placed.scales.middle
                vector = found.vector.copy()
                vector[sine] = found.vector[sine] * np.cos(turn) - found.vector[cosine] * np.sin(turn)
                vector[cosine] = found.vector[sine] * np.sin(turn) + found.vector[cosine] * np.cos(turn)
                vector[at] = n
                starts.append(vector)
        new = fit(
            problem, found.hypothesis, np.array(starts), scale=found.scale, iterations=settings.iterations, others=others,
        )  # fmt: skip
        if new.log_posterior <= found.log_posterior + settings.rise:
            return found
        found = new


PERIODS = "periods_per_turn"
"""Whole number among the parameters of a periodic effect."""


def sound(problem: ArticulatedProblem, found: ArticulatedFit) -> bool:
    """Whether a fit is finite and no parameter of its effects sits at a bound."""
    settings = problem.settings.articulated
    if not (np.isfinite(found.log_posterior) and np.isfinite(found.vector).all()):
        return False
    at = len(problem.nominal)
    for placed in found.hypothesis:
        for p in placed.effect.parameters:
            low, high = p.bounds
            inside = low + settings.at_bound < found.vector[at] < high - settings.at_bound
            if not (inside or p.fixed or p.name in BOUNDED):
                return False
            at += 1
    return True


BOUNDED = ("motor_share", "position")
"""Parameters whose bounds are physical: a share is at most one, a stop lies where the joint goes."""


def _scale_of(problem: ArticulatedProblem, found: ArticulatedFit) -> Array:
    """Scale (n_joints,) of the residuals of a fit's model in a problem, at least one."""
    joints = range(len(problem.joints))
    left = in_threads(
        lambda j: float(np.sum(problem.residual(j, found.hypothesis, found.vector) ** 2)), joints
    )
    return np.sqrt(np.maximum(np.array(left) / problem.count, 1.0))


def _fits(
    problem: ArticulatedProblem,
    base: ArticulatedFit,
    points: Sequence[Sequence[Screened]],
    settings: SearchSettings,
) -> list[ArticulatedFit]:
    """Fits of the most promising effects on top of a fit, on the joints that they change."""
    others = Others.of(problem, base)
    out: list[ArticulatedFit] = []
    gained = 0.0
    strained = _strained(problem, base, settings)
    for k, mine in enumerate(points):
        # where a number of the model was moved too far, all numbers that may be wrong instead are tried
        instead = mine[0].placed.effect.number and mine[0].placed.joint in strained
        hopeful = k < settings.fitted and mine[0].gain >= settings.hope * gained
        if not (k < settings.least or hopeful or instead):
            continue
        hypothesis: Hypothesis = (*base.hypothesis, mine[0].placed)
        # nominal parameters that stood in for what was missing are also tried where they were stated, and fitted from there:
        # a start of less misfit need not be the nearer one
        untouched = np.concatenate([np.zeros(len(problem.nominal)), base.vector[len(problem.nominal) :]])
        starts = [
            np.array([np.concatenate([point.start, point.eta]) for point in mine]),
            np.array([np.concatenate([at, point.eta]) for point in mine for at in (base.vector, untouched)]),
        ]
        new = max(
            (
                fit(
                    problem,
                    hypothesis,
                    start,
                    scale=base.scale,
                    iterations=settings.iterations,
                    others=others,
                )
                for start in (starts if strained else [np.vstack(starts)])
            ),
            key=lambda f: f.log_posterior,
        )
        new = fit(
            problem, hypothesis, new.vector, scale=new.scale, iterations=settings.iterations, others=others
        )
        new = _beside(problem, new, others, settings)
        out.append(new)
        gained = max(gained, 2.0 * (new.log_posterior - base.log_posterior))
    return out
