"""Nonparametric rivals: one force that promises no law in place of all that an explanation names.

Two or three laws together imitate within the noise what no catalogue holds: relaxations the memory of rubber, which reaches over
decades of time; a stop and a cubic spring the contact of two spheres. But they are more laws, or more finely tuned ones, than what
they imitate: the evidence of a single force that is free in the displacement, the velocity, both or its memory is higher then, while a
law that is true has the better evidence itself, since it does with one number where a free force needs many.

Curves and surfaces are free but smooth: their values have the prior of a Gaussian process, whose lengths and size are averaged over.
A stop, too, has a rival that the catalogue does not hold: one that throws back less than it takes.

References:
    C. E. Rasmussen & C. K. I. Williams, Gaussian Processes for Machine Learning, MIT Press 2006, ch. 5 (evidence).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from bench.discrepancy.effects.effect import Effect, FreeParameter, Scales, Values
from bench.discrepancy.effects.nonparametric import (
    FREE_DISPLACEMENT,
    FREE_MEMORY,
    FREE_SURFACE,
    FREE_VELOCITY,
    mixed,
    smoothing,
    smoothing_both,
)
from bench.discrepancy.fitting.goodness_of_fit import consistent, posterior
from bench.discrepancy.fitting.map_fit import Fit, fit
from bench.discrepancy.likelihood.problem import Array, Problem
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.model.placements import placements
from bench.discrepancy.screening.candidates import along
from bench.discrepancy.screening.linear_amplitudes import GridPoint, products
from bench.discrepancy.screening.projection import Ground
from bench.discrepancy.screening.screen import Screen
from bench.discrepancy.search.explanation import Explanation
from bench.discrepancy.settings import JudgementSettings

CONTACTS = ("one_sided_stop", "gap")
"""Effects whose law has a damper in the contact, its third parameter, which the catalogue leaves at zero."""
DAMPING = FreeParameter("damping", "force/velocity", std=1.5)


class Rival(NamedTuple):
    """An explanation by free forces, and what these are: names of closures, joined by " + "."""

    explanation: Explanation
    closure: str


class _Promise(NamedTuple):
    """A free force with its evidence along a motion that is known.

    Attributes:
        placed: The force, with its likeliest prior.
        start: Vector (n,) that a fit starts from.
        log_posterior: As `posterior` states it, averaged over the priors.
        penalty: What the average takes from the log posterior with the likeliest prior.
    """

    placed: Placed
    start: Array
    log_posterior: float
    penalty: float


def likelier_force(explanations: Sequence[Explanation], *, margin: float = 0.0) -> Rival | None:
    """The best explanation with one free force in place of all effects of a group of degrees of freedom, where that is likelier.

    Args:
        explanations: By effects of the catalogue, the best first.
        margin: By how much the log posterior has to be higher.

    Returns:
        The likelier explanation; None where the laws are likelier, in every group.
    """
    best = explanations[0]
    if not best.scaled or any(problem.windowed for problem, _ in best.parts):
        return None
    parts, free = [], []
    for problem, fitted in best.parts:
        contacts = _contacts(problem, explanations) if fitted.hypothesis else []
        rival = _rival(problem, fitted, contacts, margin) if fitted.hypothesis else None
        parts.append((problem, rival or fitted))
        free += [rival.hypothesis[0].effect.name] if rival else []
    return Rival(Explanation(tuple(parts)), " + ".join(dict.fromkeys(free))) if free else None


def _contacts(problem: Problem, explanations: Sequence[Explanation]) -> list[Fit]:
    """The likeliest fits of each contact, alone and beside one or two other effects, where it may stand elsewhere."""
    found: dict[tuple, Fit] = {}
    for explanation in explanations:
        for own, fitted in explanation.parts:
            for placed in fitted.hypothesis if own is problem else ():
                if placed.effect.name in CONTACTS:
                    found.setdefault((placed.key, len(fitted.hypothesis)), fitted)
    return list(dict.fromkeys(found.values()))


def _rival(problem: Problem, fitted: Fit, contacts: Sequence[Fit], margin: float) -> Fit | None:
    """The fit of a single force alone, where it is likelier than a hypothesis; the likeliest one."""
    settings = problem.settings.search
    best, most = None, posterior(fitted) + margin
    for placed, start, penalty in [*_damped(problem, contacts), *_free(problem, fitted)]:
        rival = fit(
            problem, (placed,), start=start, iterations=settings.thorough, limit=fitted.cost + settings.sight
        )
        if posterior(rival) + penalty > most:
            best, most = rival, posterior(rival) + penalty
    return best


def _damped(problem: Problem, fits: Sequence[Fit]) -> Iterator[tuple[Placed, Array, float]]:
    """Each contact of some hypotheses with a damper of its own, and where to begin with it alone."""
    for fitted in fits:
        _, etas = problem.split(fitted.hypothesis, fitted.vector)
        for placed, eta in zip(fitted.hypothesis, etas, strict=True):
            if placed.effect.name in CONTACTS:
                nominal = fitted.vector[: len(problem.nominal)]
                start = np.concatenate([nominal, eta, [DAMPING.mean]])
                yield replace(placed, effect=damped(placed.effect)), start, 0.0


def _free(problem: Problem, fitted: Fit) -> Iterator[tuple[Placed, Array, float]]:
    """Free forces that promise to be likelier than a hypothesis, the likeliest first, and where to begin with them."""
    settings = problem.settings
    families = (FREE_DISPLACEMENT, FREE_VELOCITY, FREE_SURFACE, FREE_MEMORY)
    screen = along(Screen(problem, ()), fitted)
    screen.add(placements(problem.case, problem.structure, families))
    ground = screen.ground()
    promises = sorted(
        (_promised(screen, ground, node) for node in screen.nodes), key=lambda p: -p.log_posterior
    )
    for promise in promises[: settings.judgement.free_forces]:
        # along a motion that no free run told, evidence is less than there is
        if not consistent(fitted) or promise.log_posterior > posterior(fitted) - settings.search.within_reach:
            yield promise.placed, promise.start, promise.penalty


def damped(contact: Effect) -> Effect:
    """A contact that throws back less than it takes: its law with the damper that the catalogue leaves out."""
    spring = contact.theta
    assert spring is not None

    def theta(values: Values, scales: Scales) -> Values:
        found = spring(values[:-1], scales)
        found[2] = values[-1]
        return found

    return replace(
        contact, name=f"damped_{contact.name}", parameters=(*contact.parameters, DAMPING), theta=theta
    )


def _promised(screen: Screen, ground: Ground, node: GridPoint) -> _Promise:
    """The evidence of a free force, linear in its coefficients along a motion that is known."""
    settings = screen.problem.settings.search
    left = ground.left
    inner = products(ground.head, node.columns)
    gram = node.gram - inner.T @ inner
    right = products(node.columns, left[: len(ground.residual), None])[:, 0]
    alone = -0.5 * float(left @ left) - float(np.sum(np.log(np.abs(np.diag(ground.triangle)))))
    found: list[tuple[float, Array, Array]] = []
    for mixing in _mixings(node.placed.effect, settings=screen.problem.settings.judgement):
        curvature = np.eye(mixing.shape[1]) + mixing.T @ gram @ mixing
        factor = cho_factor(curvature)
        eta = np.asarray(cho_solve(factor, mixing.T @ right))
        occam = float(np.sum(np.log(np.abs(np.diag(factor[0])))))
        found.append((0.5 * float(right @ mixing @ eta) - occam, mixing, eta))
    gain, mixing, eta = max(found, key=lambda entry: entry[0])
    penalty = float(np.logaddexp.reduce([entry[0] for entry in found])) - float(np.log(len(found))) - gain
    prior = settings.log_prior_effect - 0.5 * settings.immaterial * screen.problem.n_residuals
    moved = screen.deviations + ground.moves(node.columns @ (mixing @ eta).astype(np.float32))
    placed = replace(node.placed, effect=mixed(node.placed.effect, mixing))
    return _Promise(placed, np.concatenate([moved, eta]), alone + gain + penalty + prior, penalty)


def _mixings(effect: Effect, *, settings: JudgementSettings) -> Iterator[Array]:
    """Prior covariances of a free force's coefficients, by what makes them of independent ones of unit deviation."""
    if effect is FREE_MEMORY:
        yield np.eye(effect.n_linear)
        return
    if effect is FREE_SURFACE:
        shapes = [
            smoothing_both(*lengths)
            for lengths in product(settings.surface_lengths_along, settings.surface_lengths_across)
        ]
    else:
        shapes = [smoothing(length) for length in settings.curve_lengths]
    for shape, size in product(shapes, settings.curve_sizes):
        yield size * shape
