"""A case of an articulated model, asked: with its noise as stated or as it is, in steps as long as they may be."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bench.discrepancy.articulated.explaining import Explained, Question, explained
from bench.discrepancy.articulated.louder_noise import explained_with_louder_noise
from bench.discrepancy.articulated.stepping import accurate, misses_a_drive, stepped
from bench.discrepancy.articulated_effects.effect import ArticulatedEffect
from bench.discrepancy.articulated_judgement.torque_error import TorqueProblem
from bench.discrepancy.articulated_search.placements import placements
from bench.discrepancy.articulated_search.problem import ArticulatedProblem
from bench.discrepancy.case.case import Case
from bench.discrepancy.multibody.model import ArticulatedModel
from bench.discrepancy.numerics.deadline import Deadline
from bench.discrepancy.settings import ArticulatedSearchSettings, DiagnosisSettings


@dataclass(frozen=True, eq=False)
class Asking:
    """What cases of a model are asked with.

    Attributes:
        model: The model.
        catalogue: Effects.
        search: Settings of the search.
        rng: For the bootstrap intervals.
        stated: Whether all noise is stated.
        settings: Thresholds.
        deadline: When nothing further is begun.
        progress: Called with a line of text at every stage.
    """

    model: ArticulatedModel
    catalogue: Sequence[ArticulatedEffect]
    search: ArticulatedSearchSettings
    rng: np.random.Generator
    stated: bool
    settings: DiagnosisSettings
    deadline: Deadline
    progress: Callable[[str], None]

    def asked(self, case: Case) -> Explained:
        """What explains a case, in steps that are short enough for the nominal model, for what is named and for an elastic drive."""
        problem = self._in_steps(case)
        if self.stated:
            louder = explained_with_louder_noise(problem, self._in_steps, self._explained, self.progress)
            if louder is not None:
                return louder
        found = self._explained(problem)
        if problem.settings is self.settings or self._accurate(problem, found):
            return found
        return self._explained(self._finer(case))

    def _in_steps(self, case: Case) -> ArticulatedProblem:
        return stepped(case, self.model, self.settings, self.deadline)

    def _finer(self, case: Case) -> ArticulatedProblem:
        return ArticulatedProblem.of(case, self.model, case.identification, self.settings, self.deadline)

    def _explained(self, problem: ArticulatedProblem) -> Explained:
        judging = ArticulatedProblem.of(problem.case, self.model, problem.case.validation, problem.settings)
        question = Question(judging, self.search, self.rng, self.stated, self.progress)
        return explained(problem, placements(problem, self.catalogue), question)

    def _accurate(self, problem: ArticulatedProblem, found: Explained) -> bool:
        """Whether the steps of a problem are short enough for what is named by its runs, and hide no elastic drive, or none finer are to be
        had."""
        if isinstance(found.problem, TorqueProblem):
            return True
        nominal = next(fit for fit in found.fits if not fit.hypothesis)
        if not accurate(problem, nominal, found.final, self.settings):
            return not problem.deadline.allows("the same once more in finer integration steps")
        if found.verdict.complete:
            return True
        finer = self._finer(problem.case)
        return not misses_a_drive(finer, found.final, placements(finer, self.catalogue), self.progress)
