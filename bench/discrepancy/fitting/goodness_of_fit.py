"""How good a fit is: its posterior and complexity, and whether its residuals are those of noise."""

from __future__ import annotations

import numpy as np

from bench.discrepancy.fitting.map_fit import Fit
from bench.discrepancy.likelihood.problem import Problem
from bench.discrepancy.model.placement import Hypothesis, Placed
from bench.discrepancy.settings import DEFAULT, SearchSettings


def key_of(hypothesis: Hypothesis) -> frozenset:
    """Key of a hypothesis, regardless of the order of its effects."""
    return frozenset(placed.key for placed in hypothesis)


def posterior(fitted: Fit) -> float:
    """Log posterior of a hypothesis up to a constant."""
    settings = fitted.settings.search
    # the inaccuracy of one effect may be made good by any other
    exact = all(placed.effect.exact for placed in fitted.hypothesis)
    tolerance = 0.0 if exact else 0.5 * settings.immaterial * fitted.n_residuals
    return fitted.log_evidence + (settings.log_prior_effect - tolerance) * len(fitted.hypothesis)


def log_prior_of(hypothesis: Hypothesis, *, settings: SearchSettings) -> float:
    """Log prior odds of a hypothesis against the nominal model alone."""
    return sum(settings.log_prior_effect + placed.effect.log_prior for placed in hypothesis)


def complexity(hypothesis: Hypothesis, *, settings: SearchSettings = DEFAULT.search) -> float:
    """How much a hypothesis takes to be described, in units of log prior.

    A parameter counts as one, which is what it gains on average where nothing is to be gained. A law of seven parameters is larger so
    than two of one each, and what holds a law at the limit of its parameters is better told by the two.
    """
    return free_parameters(hypothesis) - log_prior_of(hypothesis, settings=settings)


def free_parameters(hypothesis: Hypothesis) -> int:
    """Number of the parameters of its effects that a fit moves."""
    return sum(not p.fixed for placed in hypothesis for p in placed.effect.parameters)


def consistent(fitted: Fit) -> bool:
    """Whether the residuals of a fit are as small as the stated noise lets them be."""
    settings = fitted.settings.search
    spread = np.sqrt(2.0 / fitted.n_residuals)
    return fitted.reduced < 1.0 + settings.significant * spread + settings.model_error


def near(fitted: Fit) -> bool:
    """Whether the free run of a fit is off by less than the noise."""
    return fitted.reduced < fitted.settings.search.near


def names(hypothesis: Hypothesis) -> str:
    """Readable names of a hypothesis."""
    return " + ".join(p.effect.name + _where(p) for p in hypothesis) or "nothing"


def _where(placed: Placed) -> str:
    """Where an effect sits, in brackets; of a number that is wrong, which one."""
    number = placed.target if placed.effect.site == "inertia" else ""
    told = ": ".join(part for part in (placed.place.name, number) if part)
    return f" ({told})" if placed.place.name else ""


def sticks(fitted: Fit) -> bool:
    """Whether a hypothesis holds friction that is set-valued at rest."""
    return any(placed.effect.sticks for placed in fitted.hypothesis)


def leaves_much(problem: Problem, fitted: Fit) -> bool:
    """Whether a hypothesis leaves more of a response than a right model does.

    Args:
        problem: Records and priors.
        fitted: Of these.
    """
    crude = problem.settings.likelihood.error.crude
    for data in problem.data:
        left = data.responses - problem.simulate(fitted.hypothesis, fitted.vector, data.record)
        power = np.mean(left**2, axis=0) - problem.noise**2
        if np.any(power > crude**2 * np.var(data.responses, axis=0)):
            return True
    return False
