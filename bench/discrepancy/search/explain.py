"""Explanations: hypotheses for all degrees of freedom together, and how well they predict.

A rig may fall apart into groups of degrees of freedom that its linear structure does not couple: the axial and the torsional
motion of a joint. Each group is searched on its own. Effects that couple groups (`coupled_effects`) are tried alone before; other effects
are searched beside them at once where the groups promise far less than a coupling does, else when the groups alone leave more than
noise, or a force. Chi-squared and evidence add over groups, so all explanations can be compared.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from bench.discrepancy.case.case import Case, CaseRecord
from bench.discrepancy.effects.effect import Effect
from bench.discrepancy.fitting.goodness_of_fit import consistent, key_of, names, near, posterior
from bench.discrepancy.fitting.initial_state_fit import predict
from bench.discrepancy.fitting.map_fit import Fit, fit
from bench.discrepancy.likelihood.model_error import ModelError
from bench.discrepancy.likelihood.problem import Array, Problem, band_bins
from bench.discrepancy.likelihood.whitening import whitened
from bench.discrepancy.model.placement import Hypothesis, Placed
from bench.discrepancy.model.placements import placements
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.model.structure import Structure
from bench.discrepancy.numerics.deadline import NEVER, Deadline
from bench.discrepancy.screening.candidates import leading
from bench.discrepancy.screening.score_test import LackOfFit, lack_of_fit
from bench.discrepancy.screening.screen import Screen
from bench.discrepancy.search.coupled_effects import coupled_fits
from bench.discrepancy.search.fits import Search, Task, converge
from bench.discrepancy.search.forward_selection import (
    Prepared,
    attribute,
    prepare,
)
from bench.discrepancy.settings import DiagnosisSettings


@dataclass(frozen=True, eq=False)
class Explanation:
    """A hypothesis for the whole rig, fitted.

    Attributes:
        parts: One (problem, fit) for every group of degrees of freedom.
    """

    parts: tuple[tuple[Problem, Fit], ...]

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


def explain(
    case: Case,
    catalogue: Sequence[Effect],
    *,
    most: int = 3,
    progress: Callable[[str], None] = lambda text: None,
    error: ModelError | None = None,
    deadline: Deadline = NEVER,
    seeds: Sequence[Explanation] = (),
    settings: DiagnosisSettings,
) -> list[Explanation]:
    """Search the explanations of a case; by decreasing posterior.

    Args:
        case: Nominal model and records.
        catalogue: Effects to consider.
        most: Largest number of effects in a group.
        progress: Called with a line of text at every stage.
        error: Error of the model that residuals are weighed by besides their noise.
        deadline: When no further stage is begun.
        seeds: Explanations of the same records in other weights, the best first, which are fitted again; of rigs that do not fall apart.
        settings: Thresholds of the diagnosis.
    """
    structure = structure_of(case, settings=settings)
    groups = structure.groups()
    if len(groups) == 1:
        search = _attributed(
            Problem(case, structure, case.identification, error=error, settings=settings),
            placements(case, structure, catalogue),
            most=most,
            progress=progress,
            deadline=deadline,
        )
        problem = search.problem
        converge(search, _again(search, seeds))
        found = [Explanation(((problem, fitted),)) for fitted in search.ranked()]
        return _nothing_left_first(found) if problem.scaled else _parsimonious(found)
    bins = _common_bins(case, structure, settings=settings)
    whole = Problem(case, structure, case.identification, bins=bins, error=error, settings=settings)
    prepared = []
    for group in groups:
        part = structure.restricted(group)
        problem = Problem(case, part, case.identification, bins=bins, error=error, settings=settings)
        progress(f"screening of {', '.join(part.dofs)}")
        prepared.append(prepare(problem, placements(case, part, catalogue)))
    odd = [entry for entry in prepared if not consistent(entry[0].ranked(0)[0])]
    coupled = Search(whole)
    deep = settled = False
    if len(odd) > 1:
        little = max(_promise(entry) for entry in odd) > settings.search.promising
        deep = coupled_fits(
            coupled, catalogue, most, progress, lambda alone: little or _beyond(alone, prepared)
        )
        settled = deep and consistent(coupled.ranked()[0])
    if not settled:
        hopeless = False
        for entry in prepared:
            problem = entry[0].problem
            progress(f"degrees of freedom {', '.join(problem.structure.dofs)}")
            chosen = placements(case, problem.structure, catalogue)
            search = attribute(
                problem,
                chosen,
                most=1 if hopeless else 2,
                progress=progress,
                prepared=entry,
                deadline=deadline,
            )
            hopeless = hopeless or search.ranked()[0].reduced > settings.search.hopeless_group
    found = _nothing_left_first(_combined([entry[0] for entry in prepared]))
    missing = odd and not deep and not _leaves_nothing(found)
    if missing and deadline.allows("effects that couple the degrees of freedom"):
        coupled_fits(coupled, catalogue, most, progress)
    # what falls apart is doubted better group by group
    known = {key_of(e.hypothesis) for e in found}
    found += [Explanation(((whole, f),)) for f in coupled.ranked() if key_of(f.hypothesis) not in known]
    return _nothing_left_first(sorted(found, key=lambda e: -e.log_posterior))


def _again(search: Search, seeds: Sequence[Explanation]) -> list[Task]:
    """Fits of the foremost of other explanations that a search has not come to: what explained enough ended it early."""
    tasks = [
        (e.hypothesis, e.parts[0][1].vector)
        for e in seeds[: search.problem.settings.search.seeds]
        if len(e.parts) == 1
    ]
    starts = len(search.problem.nominal)
    return [
        (hypothesis, vector)
        for hypothesis, vector in tasks
        if key_of(hypothesis) not in search.fits
        and len(vector) == starts + sum(len(placed.effect.parameters) for placed in hypothesis)
    ]


def _attributed(
    problem: Problem,
    candidates: Sequence[Placed],
    *,
    most: int,
    progress: Callable[[str], None],
    deadline: Deadline,
) -> Search:
    """`attribute`, and once more where the best explanation makes more of the noise of what drives it than the nominal model.

    A law that the velocity enters strongly passes much of the noise of a prescribed motion on, and a sensor of twice the gain that of
    a measured load; the right one would be refuted by it.
    """
    search = attribute(problem, candidates, most=most, progress=progress, deadline=deadline)
    best = search.ranked()[0]
    sensors = any(placed.effect.site == "sensor" for placed in best.hypothesis)
    stated = problem.noise_stated and problem.error is None
    if (problem.driven or sensors) and stated and best.hypothesis and near(best):
        behind = problem.behind(best.hypothesis, best.vector)
        left = float(np.sum(behind.residual(best.hypothesis, best.vector) ** 2))
        if abs(left - best.chi2) > problem.settings.search.noisier * best.n_residuals:
            progress(f"the noise behind {names(best.hypothesis)}")
            return attribute(behind, candidates, most=most, progress=progress, deadline=deadline)
    return search


def _promised(entry: Prepared) -> float:
    """Chi-squared that the best grid point of a screening promises to leave."""
    search, _, points = entry
    return search.ranked(0)[0].chi2 - (points[0].gain if points else 0.0)


def _promise(entry: Prepared) -> float:
    """Reduced chi-squared that the best grid point of a screening promises."""
    return _promised(entry) / entry[0].problem.n_residuals


def _beyond(coupled: Fit, prepared: Sequence[Prepared]) -> bool:
    """Whether an effect on each group of degrees of freedom promises far less than a coupling has kept."""
    return sum(_promised(entry) for entry in prepared) > coupled.chi2 + coupled.settings.search.sight


def _nothing_left_first(found: list[Explanation]) -> list[Explanation]:
    """Put an explanation that leaves nothing before a likelier one in which free models find a force.

    The toll that an effect pays for the inaccuracy of the diagnosis may else let a law win that the records refute.
    """
    if not found[0].consistent or _leaves_nothing(found):
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


def nominal_alone(explanations: Sequence[Explanation]) -> Explanation:
    """The explanation without any effect."""
    return next(e for e in explanations if not e.hypothesis)


def _leaves_nothing(found: Sequence[Explanation]) -> bool:
    """Whether the first explanation is down to the noise, and free models find nothing in what it leaves."""
    nothing = nominal_alone(found)
    return found[0].consistent and not any(found[0].lacking(nothing))


def _parsimonious(found: list[Explanation]) -> list[Explanation]:
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


def _common_bins(case: Case, structure: Structure, *, settings: DiagnosisSettings) -> dict[str, int]:
    whole = Problem(case, structure, case.identification, settings=settings)
    bins = {d.record.name: d.n_bins for d in whole.data}
    for record in case.validation:
        responses = np.column_stack([record.values[name] for name in structure.channels])
        bins[record.name] = band_bins(responses, whole.noise, settings=settings.likelihood)
    return bins


def _combined(searches: Sequence[Search]) -> list[Explanation]:
    ranked = [
        [
            (s.problem, fitted)
            for fitted in dict.fromkeys(
                (*s.ranked()[: searches[0].problem.settings.search.kept], s.ranked(0)[0])
            )
        ]
        for s in searches
    ]
    found = [Explanation(tuple(parts)) for parts in product(*ranked)]
    return sorted(found, key=lambda e: -e.log_posterior)


def close(best: Explanation, nothing: Explanation, closures: Sequence[Effect]) -> tuple[Explanation, str]:
    """Add nonparametric closures to an explanation while they pay.

    Args:
        best: The best catalogued explanation.
        nothing: The nominal model alone.
        closures: Free models of a missing force.

    Returns:
        The closed explanation, and the names of the closures used.
    """
    settings = best.settings.search
    parts, used = [], []
    for (problem, fitted), lacks in zip(best.parts, best.lacking(nothing), strict=True):
        current = fitted
        if lacks or not consistent(fitted) or problem.error is not None:
            candidates = placements(problem.case, problem.structure, closures)
            screen = Screen(problem, candidates)
            current = fit(problem, (), start=np.zeros(len(problem.nominal)), iterations=settings.thorough)
            if fitted.reduced - 1.0 < settings.helpful * (current.reduced - 1.0):
                current = fitted
            for _ in range(settings.closures):
                closed = _closed(problem, screen, current)
                if closed is None:
                    break
                current = closed
                used.append(closed.hypothesis[-1].effect.name)
                if consistent(current) and not lacks:
                    break
        parts.append((problem, current))
    return Explanation(tuple(parts)), " + ".join(dict.fromkeys(used))


def _closed(problem: Problem, screen: Screen, current: Fit) -> Fit | None:
    """One more closure on top of a fit: of those that the screening likes best the first that pays; None where none does."""
    settings = problem.settings.search
    own = {placed.key for placed in current.hypothesis}
    for point in leading(
        [p for p in screen.ranked(current) if p.placed.key not in own],
        settings.closures_tried,
        0.0,
        starts=1,
        settings=problem.settings,
    ):
        start = np.concatenate([current.vector, point.eta])
        closed = fit(problem, (*current.hypothesis, point.placed), start=start, iterations=12)
        idle = not consistent(current) and closed.reduced - 1.0 > settings.stalled * (current.reduced - 1.0)
        if not idle and closed.log_evidence > current.log_evidence:
            return closed
    return None
