"""Explanations: hypotheses for all degrees of freedom together, and how well they predict.

A rig may fall apart into groups of degrees of freedom that its linear structure does not couple: the axial and the torsional
motion of a joint. Each group is searched on its own. Effects that couple groups (`coupled_effects`) are tried alone before; other effects
are searched beside them at once where the groups promise far less than a coupling does, else when the groups alone leave more than
noise, or a force. Chi-squared and evidence add over groups, so all explanations can be compared.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np

from bench.discrepancy.case.case import Case
from bench.discrepancy.effects.effect import Effect
from bench.discrepancy.fitting.fits import Search, Task, converge
from bench.discrepancy.fitting.goodness_of_fit import consistent, key_of, names, near
from bench.discrepancy.fitting.map_fit import Fit
from bench.discrepancy.likelihood.model_error import ModelInadequacy
from bench.discrepancy.likelihood.problem import Problem, band_bins
from bench.discrepancy.model.placement import Placed
from bench.discrepancy.model.placements import placements
from bench.discrepancy.model.rigs import structure_of
from bench.discrepancy.model.structure import Structure
from bench.discrepancy.numerics.deadline import NEVER, Deadline
from bench.discrepancy.search.coupled_effects import coupled_fits
from bench.discrepancy.search.explanation import Explanation, leaves_nothing, nothing_left_first, parsimonious
from bench.discrepancy.search.forward_selection import (
    Prepared,
    attribute,
    prepare,
)
from bench.discrepancy.settings import DiagnosisSettings


def explain(
    case: Case,
    catalogue: Sequence[Effect],
    *,
    most: int = 3,
    progress: Callable[[str], None] = lambda text: None,
    error: ModelInadequacy | None = None,
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
    if len(groups) > 1:
        parts = [structure.restricted(group) for group in groups]
        return _in_groups(
            case, catalogue, structure, parts,
            most=most, progress=progress, error=error, deadline=deadline, settings=settings,
        )  # fmt: skip
    search = _attributed(
        Problem(case, structure, case.identification, error=error, deadline=deadline, settings=settings),
        placements(case, structure, catalogue),
        most=most,
        progress=progress,
        deadline=deadline,
    )
    problem = search.problem
    problem.deadline = NEVER  # what is known already, and what is judged, is fitted to the end
    converge(search, _again(search, seeds))
    found = [Explanation(((problem, fitted),)) for fitted in search.ranked()]
    return nothing_left_first(found) if problem.scaled else parsimonious(found)


def _in_groups(
    case: Case,
    catalogue: Sequence[Effect],
    structure: Structure,
    parts: Sequence[Structure],
    *,
    most: int,
    progress: Callable[[str], None],
    error: ModelInadequacy | None,
    deadline: Deadline,
    settings: DiagnosisSettings,
) -> list[Explanation]:
    """Explanations of a rig that falls apart into groups of degrees of freedom, and of effects that couple them."""
    bins = _common_bins(case, structure, settings=settings)

    def problem_of(structure: Structure) -> Problem:
        return Problem(
            case, structure, case.identification, bins=bins, error=error, deadline=deadline, settings=settings
        )

    whole = problem_of(structure)
    prepared = []
    for part in parts:
        problem = problem_of(part)
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
        _group_by_group(case, catalogue, prepared, progress=progress, deadline=deadline)
    found = nothing_left_first(_combined([entry[0] for entry in prepared]))
    missing = odd and not deep and not leaves_nothing(found)
    if missing and deadline.allows("effects that couple the degrees of freedom"):
        coupled_fits(coupled, catalogue, most, progress)
    # what falls apart is doubted better group by group
    known = {key_of(e.hypothesis) for e in found}
    found += [Explanation(((whole, f),)) for f in coupled.ranked() if key_of(f.hypothesis) not in known]
    for problem in (part for explanation in found for part, _ in explanation.parts):
        problem.deadline = NEVER  # what is judged is fitted to the end
    return nothing_left_first(sorted(found, key=lambda e: -e.log_posterior))


def _group_by_group(
    case: Case,
    catalogue: Sequence[Effect],
    prepared: Sequence[Prepared],
    *,
    progress: Callable[[str], None],
    deadline: Deadline,
) -> None:
    """Search each group on its own, two effects in each; once one is far from explained, one in the others."""
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
        hopeless = hopeless or search.ranked()[0].reduced > problem.settings.search.hopeless_group


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
