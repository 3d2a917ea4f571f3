"""An explanation: a hypothesis for all degrees of freedom together, how well it predicts, and which of several comes first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

from bench.discrepancy.case.case import CaseRecord
from bench.discrepancy.fitting.goodness_of_fit import consistent, posterior
from bench.discrepancy.fitting.initial_state_fit import predict
from bench.discrepancy.fitting.map_fit import Fit
from bench.discrepancy.likelihood.problem import Array, Problem
from bench.discrepancy.likelihood.whitening import whitened
from bench.discrepancy.model.placement import Hypothesis
from bench.discrepancy.screening.score_test import LackOfFit, lack_of_fit
from bench.discrepancy.settings import DiagnosisSettings


@dataclass(frozen=True, eq=False)
class Explanation:
    """A hypothesis for the whole rig, fitted.

    Attributes:
        parts: One (problem, fit) for every group of degrees of freedom.
        smaller: By index of an effect, it without that one, fitted again: kept by whoever made it.
    """

    parts: tuple[tuple[Problem, Fit], ...]
    smaller: dict[int, Explanation] = field(default_factory=dict, init=False, repr=False)

    @property
    def hypothesis(self) -> Hypothesis:
        """All effects."""
        return tuple(placed for _, fitted in self.parts for placed in fitted.hypothesis)

    @property
    def settings(self) -> DiagnosisSettings:
        """Thresholds of the problems it explains."""
        return self.parts[0][0].settings

    @property
    def n_free(self) -> int:
        """Number of free parameters of all effects."""
        return sum(not p.fixed for placed in self.hypothesis for p in placed.effect.parameters)

    @property
    def log_posterior(self) -> float:
        """Log posterior up to a constant common to all explanations of a case."""
        return sum(posterior(fitted) for _, fitted in self.parts)

    @property
    def consistent(self) -> bool:
        """Whether every group's residuals are down to the noise."""
        return all(consistent(fitted) for _, fitted in self.parts)

    @cached_property
    def lacks(self) -> tuple[LackOfFit, ...]:
        """What free models still find in each group."""
        return tuple(lack_of_fit(problem, fitted) for problem, fitted in self.parts)

    def lacking(self, nothing: Explanation) -> tuple[bool, ...]:
        """Whether something is left in each group although chi-squared is down to the noise; beside the nominal model alone.

        Not asked of windows: their motion is known as measured only, and its noise is that of the residuals.
        """
        if not self.consistent or any(problem.windowed or problem.error for problem, _ in self.parts):
            return (False,) * len(self.parts)
        explained = nothing.chi2 - self.chi2
        return tuple(
            lack.significant(explained, effects=len(fitted.hypothesis))
            for lack, (_, fitted) in zip(self.lacks, self.parts, strict=True)
        )

    @property
    def noise_stated(self) -> bool:
        """Whether the noise of every response channel is stated, so that chi-squared has an absolute meaning."""
        return all(problem.noise_stated for problem, _ in self.parts)

    @property
    def scaled(self) -> bool:
        """Whether chi-squared has an absolute meaning, by the noise or by the error of the model."""
        return all(problem.scaled for problem, _ in self.parts)

    @property
    def coarse(self) -> bool:
        """Whether residuals are weighed by the error of the model, not by their noise alone."""
        return any(problem.error is not None for problem, _ in self.parts)

    @property
    def chi2(self) -> float:
        """Chi-squared of all groups."""
        return sum(f.chi2 for _, f in self.parts)

    @property
    def reduced(self) -> float:
        """Chi-squared of all groups over its expectation."""
        return self.chi2 / sum(f.n_residuals for _, f in self.parts)

    def predict(self, record: CaseRecord) -> dict[str, Array]:
        """Free run of a record: response channel to samples (n,)."""
        out: dict[str, Array] = {}
        for problem, fitted in self.parts:
            samples = predict(problem, fitted.hypothesis, fitted.vector, record)
            out.update({name: samples[:, c] for c, name in enumerate(problem.structure.channels)})
        return out

    def reduced_on(self, record: CaseRecord) -> float:
        """Chi-squared over its expectation on a record that the fit has not seen."""
        chi2 = count = 0.0
        for problem, fitted in self.parts:
            data = problem.prepare(record, (fitted.hypothesis, fitted.vector))
            residual = whitened(
                data.responses - predict(problem, fitted.hypothesis, fitted.vector, record), data
            )
            chi2 += float(residual @ residual)
            count += len(residual)
        return chi2 / count


def nominal_alone(explanations: Sequence[Explanation]) -> Explanation:
    """The explanation without any effect."""
    return next(e for e in explanations if not e.hypothesis)


def leaves_nothing(found: Sequence[Explanation]) -> bool:
    """Whether the first explanation is down to the noise, and free models find nothing in what it leaves."""
    nothing = nominal_alone(found)
    return found[0].consistent and not any(found[0].lacking(nothing))


def nothing_left_first(found: list[Explanation]) -> list[Explanation]:
    """Put an explanation that leaves nothing before a likelier one in which free models find a force.

    The complexity penalty that an effect pays for the inaccuracy of the diagnosis may else let a law win that the records refute.
    """
    if not found[0].consistent or leaves_nothing(found):
        return found
    nothing = nominal_alone(found)
    near = [
        e
        for e in found[1:]
        if e.log_posterior > found[0].log_posterior - found[0].settings.search.within_reach and e.consistent
    ]
    for other in near[: found[0].settings.search.reconsidered]:
        if not any(other.lacking(nothing)):
            return [other, *(e for e in found if e is not other)]
    return found


def parsimonious(found: list[Explanation]) -> list[Explanation]:
    """Put the plainest explanation first."""
    chosen = plainest(found)
    return [chosen, *(e for e in found if e is not chosen)]


def plainest(found: Sequence[Explanation]) -> Explanation:
    """The explanation of fewest parameters that no larger one improves much.

    Where chi-squared has no absolute scale, or all explanations are far from the noise, residuals of a measured component are mostly
    model error, far from independent: differences in evidence then say little about one more effect. Parameters are counted,
    not effects, since a law of seven would else be preferred to two of one each.
    """
    ordered = sorted(found, key=lambda e: (e.n_free, e.reduced))
    chosen = ordered[0]
    for larger in ordered[1:]:
        if larger.reduced < found[0].settings.search.stalled * chosen.reduced:
            chosen = larger
    return chosen
